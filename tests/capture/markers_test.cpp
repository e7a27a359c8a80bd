#include "capture/markers.hpp"

#include <cmath>
#include <limits>
#include <random>

#include "input_errors.hpp"
#include "support/c3d_writer.hpp"
#include "temporary_folder.hpp"

namespace pliant::markers_test {
namespace {

using test::C3dWriter;
using test::complaint_of;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr const char* rest_rows = "id,x,y,z\n3,0.125,-2,1\ntip 1,0,0,5e-4\n";

Points points(std::initializer_list<Vector3> rows) {
  Points result(Eigen::Index(rows.size()), 3);
  Eigen::Index i = 0;
  for (const Vector3& row : rows) result.row(i++) = row;
  return result;
}

class MarkerFiles : public ::testing::Test {
 protected:
  MarkerSet read(const std::string& track, int frame_count = 3) const {
    return read_markers({folder.write("rest.csv", rest), folder.write("track.csv", track)}, frame_count);
  }
  MarkerSet read(const C3dWriter& track, int frame_count = 3) const {
    return read_markers({folder.write("rest.csv", rest), folder.write("track.C3D", track.bytes())}, frame_count);
  }
  template <class Track>
  std::string said(const Track& track, int frame_count = 3) const {
    return complaint_of([&] { (void)read(track, frame_count); });
  }

  TemporaryFolder folder;
  std::string rest = rest_rows;
};

TEST_F(MarkerFiles, PositionsComeBack) {
  const MarkerPositions markers{{"3", "tip 1"}, points({{0.125, -2, 1}, {0, 0, 5e-4}})};
  write_marker_positions(folder / "a.csv", markers);
  const MarkerPositions read = read_marker_positions(folder / "a.csv");
  EXPECT_EQ(read.ids, markers.ids);
  EXPECT_EQ(read.positions, markers.positions);
}

TEST_F(MarkerFiles, PlacesThatNobodySawAreNotWritten) {
  MarkerPositions markers{{"a", "b"}, points({{1, 2, 3}, {4, 5, 6}})};
  markers.positions(0, 1) = std::numeric_limits<double>::quiet_NaN();
  write_marker_positions(folder / "a.csv", markers);
  EXPECT_THAT(read_marker_positions(folder / "a.csv").ids, ElementsAre("b"));
}

TEST_F(MarkerFiles, ATrackIsMatchedById) {
  const MarkerSet set = read("frame,id,x,y,z\n2,tip 1,1,2,3\n0,3,4,5,6\n2,3,7,8,9\n");
  EXPECT_THAT(set.ids, ElementsAre("3", "tip 1"));
  EXPECT_EQ(set.rest, points({{0.125, -2, 1}, {0, 0, 5e-4}}));
  ASSERT_EQ(set.frames.size(), 3u);
  EXPECT_TRUE(set.is_seen(0, 0));
  EXPECT_FALSE(set.is_seen(0, 1));
  EXPECT_TRUE(set.frames[1].array().isNaN().all());
  EXPECT_EQ(set.frames[2], points({{7, 8, 9}, {1, 2, 3}}));
  EXPECT_EQ(set.frame_rate, std::nullopt);
}

TEST_F(MarkerFiles, AFewRowsAreNotMillionsOfFrames) {
  EXPECT_THAT(said("frame,id,x,y,z\n0,3,4,5,6\n", 10'000'000), HasSubstr("track.csv: 10000000 frames of markers of"));
}

TEST_F(MarkerFiles, ATrackComesBack) {
  const MarkerSet set = read("frame,id,x,y,z\n0,3,4,5,6\n2,3,7,8,9\n2,tip 1,1,2,3\n");
  write_marker_track(folder / "again.csv", set.ids, set.frames);
  EXPECT_EQ(read_file(folder / "again.csv"), "frame,id,x,y,z\n0,3,4,5,6\n2,3,7,8,9\n2,tip 1,1,2,3\n");
  EXPECT_THROW(write_marker_track(folder / "bad.csv", std::vector<std::string>{"a,b", "c"}, set.frames),
               std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder / "bad.csv"));
}

TEST_F(MarkerFiles, EveryFaultOfATrackIsToldWithItsPlace) {
  const std::string all =
      said("frame,id,x,y,z\n0,3,1,2,nan\n3,3,1,2,3\n1,9,1,2,3\n1,9,1,2,3\n2,3,1,2,3\n2,3,1,2,4\n-1,3,0,0,0\n");
  EXPECT_THAT(all, AllOf(HasSubstr("track.csv:2:9: \"nan\"; expected a finite number"),
                         HasSubstr("track.csv:3:1: frame 3; expected 0 to 2"),
                         HasSubstr("track.csv:4:3: marker \"9\" is not among the markers at rest"),
                         HasSubstr("track.csv:7:3: marker \"3\" appears a second time in frame 2"),
                         HasSubstr("track.csv:8:1: \"-1\"; expected a whole number from 0")));
  EXPECT_THAT(all, Not(HasSubstr("track.csv:5"))) << "an unknown id is told once";
}

TEST_F(MarkerFiles, FaultsOfBothFilesAreToldTogether) {
  rest = "id,x,y,z\n3,0,0,x\n3,0,0,0\n";
  const std::string all = said("frame,id,x,y,z\n0,3,1,2\n0,9,1,2,3\n");
  EXPECT_THAT(all,
              AllOf(HasSubstr("rest.csv:2:7: \"x\""), HasSubstr("rest.csv:3:1: marker \"3\" appears a second time"),
                    HasSubstr("it stands in line 2 already"), HasSubstr("track.csv:2:1: 4 cells")));
  EXPECT_THAT(all, Not(HasSubstr("not among"))) << "the file at rest has to be corrected first";
  rest = "id,x,y\n";
  EXPECT_THAT(said("frame,id,x,y,z\n"), AllOf(HasSubstr("rest.csv:1:1: the header"), HasSubstr("track.csv: no row")));
}

TEST_F(MarkerFiles, ManyFaultsAreCounted) {
  std::string track = "frame,id,x,y,z\n";
  for (int i = 0; i < 100; ++i) track += "0,3,a,0,0\n";
  const std::string all = said(track);  // the first row is broken, the others come twice as well
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 20);
  EXPECT_THAT(all, HasSubstr("179 more problems"));
}

TEST_F(MarkerFiles, ThoseUnderLoadAreOneFrame) {
  const auto pair = [&](const std::string& under_load) {
    return read_marker_pair(folder.write("rest.csv", rest), folder.write("load.csv", under_load));
  };
  const MarkerSet set = pair("id,x,y,z\ntip 1,1,2,3\n");
  ASSERT_EQ(set.frames.size(), 1u);
  EXPECT_FALSE(set.is_seen(0, 0));
  EXPECT_EQ(set.frames[0].row(1), Eigen::RowVector3d(1, 2, 3));
  EXPECT_THAT(complaint_of([&] { (void)pair("id,x,y,z\n4,1,2,3\n3,1,2,3\n3,1,2,3\n"); }),
              AllOf(HasSubstr("load.csv:2:1: marker \"4\" is not among"),
                    HasSubstr("load.csv:4:1: marker \"3\" appears a second time; expected each id once")));
  EXPECT_THAT(complaint_of([&] { (void)pair(""); }), HasSubstr("load.csv: the file is empty"));
}

/// The markers of `rest_rows` and one on the clamp, in millimetres; "tip 1" is not seen in frame 1.
C3dWriter capture_of_three() {
  C3dWriter file;
  file.labels = {"clamp", "tip 1", "3"};
  const double unseen = std::nan("");
  file.frames = {points({{1, 1, 1}, {10, 20, 30}, {40, 50, 60}}),
                 points({{1, 1, 1}, {unseen, unseen, unseen}, {41, 51, 61}})};
  return file;
}

TEST_F(MarkerFiles, C3dTrajectoriesAreMatchedByLabel) {
  const MarkerSet set = read(capture_of_three());
  EXPECT_THAT(set.ids, ElementsAre("3", "tip 1"));
  ASSERT_EQ(set.frames.size(), 3u);
  EXPECT_TRUE(set.frames[0].isApprox(points({{0.04, 0.05, 0.06}, {0.01, 0.02, 0.03}}), 1e-12));
  EXPECT_TRUE(set.is_seen(1, 0));
  EXPECT_FALSE(set.is_seen(1, 1));
  EXPECT_FALSE(set.is_seen(2, 0)) << "the recording ends before";
  EXPECT_EQ(set.frame_rate, 100.0);
  EXPECT_THAT(set.left_out, ElementsAre("clamp"));
}

TEST_F(MarkerFiles, C3dSlipsAreTold) {
  EXPECT_THAT(said(capture_of_three(), 1), HasSubstr("track.C3D: 2 frames; expected 1 at most"));
  C3dWriter file = capture_of_three();
  file.labels[1] = "tip1";
  EXPECT_THAT(said(file), AllOf(HasSubstr("no trajectory with the label \"tip 1\"; expected one of \"3\", \"clamp\""),
                                HasSubstr("did you mean \"tip1\"?")));
  file.labels = {"", "tip 1", "tip 1"};
  EXPECT_THAT(said(file), AllOf(HasSubstr("several trajectories with the label \"tip 1\""),
                                HasSubstr("no trajectory with the label \"3\"")));
  file.units.reset();
  EXPECT_THAT(said(file), HasSubstr("no unit of length"));
  file.labels.assign(3, "");
  file.units = "m";
  EXPECT_THAT(said(file), HasSubstr("expected labels in POINT:LABELS"));
}

TEST(TrackNoise, IsThatOfTheReadingsNotOfASmoothMotion) {
  constexpr double noise = 2e-4;
  std::mt19937 random(7);
  std::normal_distribution<double> error(0.0, noise);
  MarkerSet set;
  set.rest = Points::Zero(5, 3);
  for (int f = 0; f < 100; ++f) {
    Points at(5, 3);
    for (Eigen::Index k = 0; k < at.size(); ++k) at.data()[k] = 0.03 * std::sin(0.2 * f + double(k)) + error(random);
    if (f == 40) at.row(2).setConstant(std::numeric_limits<double>::quiet_NaN());  // not seen
    set.frames.push_back(at);
  }
  ASSERT_TRUE(track_noise(set));
  EXPECT_NEAR(*track_noise(set), noise, 0.1 * noise);
  set.frames.resize(3);
  EXPECT_FALSE(track_noise(set)) << "no third difference";
}

TEST_F(MarkerFiles, DeviationsAreMatchedById) {
  const std::vector<std::string> ids = {"3", "tip 1"};
  const Points read = read_marker_deviations(folder.write("std.csv", "id,sx,sy,sz\ntip 1,1e-4,2e-4,3e-4\n"), ids);
  ASSERT_EQ(read.rows(), 2);
  EXPECT_TRUE(read.row(0).array().isNaN().all());
  EXPECT_EQ(read(1, 2), 3e-4);
}

TEST_F(MarkerFiles, DeviationsThatAreNoneAreRefused) {
  const std::vector<std::string> ids = {"3"};
  const auto of = [&](const char* text) {
    return complaint_of([&] { (void)read_marker_deviations(folder.write("std.csv", text), ids); });
  };
  EXPECT_THAT(of("id,sx,sy,sz\n4,1,1,1\n"),
              AllOf(HasSubstr("std.csv"), HasSubstr("\"4\" is not among the markers at rest")));
  EXPECT_THAT(of("id,sx,sy,sz\n3,1,0,1\n"), HasSubstr("not positive"));
  EXPECT_THAT(of("id,x,y,z\n3,1,1,1\n"), HasSubstr("id,sx,sy,sz"));
  EXPECT_THAT(of("id,sx,sy,sz\n3,1,1,1\n3,1,1,1\n"), HasSubstr("a second time"));
}

/// Five markers that fall and turn a little, with a scatter of a tenth of a millimetre.
MarkerSet falling_markers(int frames) {
  MarkerSet markers;
  markers.ids = {"a", "b", "c", "d", "e"};
  markers.rest = points({{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}, {0.1, 0.1, 0}});
  std::mt19937 random(3);
  std::normal_distribution<double> scatter(0.0, 1e-4);
  for (int f = 0; f < frames; ++f) {
    Points frame = markers.rest;
    for (Eigen::Index i = 0; i < frame.rows(); ++i) {
      frame(i, 0) += 0.02 * f * frame(i, 1);
      frame(i, 1) -= 0.001 * f * f;
      for (int d = 0; d < 3; ++d) frame(i, d) += scatter(random);
    }
    markers.frames.push_back(frame);
  }
  return markers;
}

TEST(MarkerDoubts, AreNoneOfAMotion) { EXPECT_THAT(marker_doubts(falling_markers(20), true), IsEmpty()); }

TEST(MarkerDoubts, NameTradedMarkersAndTheFrame) {
  MarkerSet markers = falling_markers(20);
  for (std::size_t f = 12; f < 20; ++f) markers.frames[f].row(1).swap(markers.frames[f].row(3));
  EXPECT_THAT(marker_doubts(markers, true),
              ElementsAre("markers \"b\" and \"d\" trade places in frame 12: their names may be traded"));
  for (std::size_t f = 0; f < 12; ++f) markers.frames[f].row(1).swap(markers.frames[f].row(3));
  EXPECT_THAT(marker_doubts(markers, true), ElementsAre(HasSubstr("trade places in frame 0")));
  EXPECT_THAT(marker_doubts(markers, false), IsEmpty()) << "a released object does not start where it rests";
}

TEST(MarkerDoubts, NameAJumpThatTheOthersDoNotMake) {
  MarkerSet markers = falling_markers(20);
  markers.frames[7](2, 2) += 0.05;
  const auto doubts = marker_doubts(markers, true);
  ASSERT_EQ(doubts.size(), 2u) << "away and back";
  EXPECT_THAT(doubts[0], AllOf(HasSubstr("marker \"c\" jumps by 0.0"), HasSubstr("in frame 7")));
  EXPECT_THAT(doubts[1], HasSubstr("in frame 8"));
}

TEST(MarkerDoubts, NameMarkersTradedUnderALoad) {
  MarkerSet markers = falling_markers(2);
  markers.frames = {markers.frames[1]};
  EXPECT_THAT(marker_doubts(markers, true), IsEmpty());
  markers.frames[0].row(0).swap(markers.frames[0].row(4));
  EXPECT_THAT(marker_doubts(markers, true),
              ElementsAre("markers \"a\" and \"e\" trade places: their names may be traded"));
}

}  // namespace
}  // namespace pliant::markers_test
