#include "capture/markers.hpp"

#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using ::testing::HasSubstr;

TEST(Markers, ComeBack) {
  const TemporaryFolder folder;
  const MarkerPositions markers = {{3, {0.125, -2, 1}}, {11, {0, 0, 5e-4}}};
  write_markers(folder / "a.csv", markers);
  EXPECT_EQ(read_markers(folder / "a.csv"), markers);
  const std::map<int, MarkerPositions> track = {{0, markers}, {7, {{3, {1, 2, 3}}}}};
  write_marker_track(folder / "b.csv", track);
  EXPECT_EQ(read_marker_track(folder / "b.csv"), track);
}

TEST(Markers, TakeSpacesAndWindowsLines) {
  const TemporaryFolder folder;
  folder.write("a.csv", "id, x, y, z\r\n1, 0.5, 0, 0\r\n\r\n");
  EXPECT_EQ(read_markers(folder / "a.csv"), (MarkerPositions{{1, {0.5, 0, 0}}}));
}

TEST(Markers, SayWhatIsWrongAndWhere) {
  const TemporaryFolder folder;
  const auto said = [&](const std::string& content) {
    return complaint_of([&] { (void)read_markers(folder.write("a.csv", content)); });
  };
  EXPECT_THAT(said(""), HasSubstr("the file is empty"));
  EXPECT_THAT(said("x,y,z\n"), HasSubstr("a.csv:1:1: the header \"x,y,z\"; expected \"id,x,y,z\""));
  EXPECT_THAT(said("id,x,y,z\n1,0,0\n"), HasSubstr("a.csv:2:1: 3 cells"));
  EXPECT_THAT(said("id,x,y,z\n1,0,nan,0\n"), HasSubstr("a.csv:2:1: \"nan\"; expected a finite number"));
  EXPECT_THAT(said("id,x,y,z\n1.5,0,0,0\n"), HasSubstr("a whole number"));
  EXPECT_THAT(said("id,x,y,z\n1,0,0,0\n1,0,0,0\n"), HasSubstr("a.csv:3:1: marker 1 appears a second time"));
}

}  // namespace
}  // namespace pliant
