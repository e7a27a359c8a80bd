#include "capture/point_cloud.hpp"

#include <cstdint>
#include <cstring>
#include <limits>

#include "base/files.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::point_cloud_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<Vector3> sample = {{0.5, -1.25, 3}, {1e-3f, 0, -7}};

std::string pcd_header(const std::string& data, int points) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z\nSIZE 4 4 4 4\nTYPE U F F F\nCOUNT 1 1 1 1\nWIDTH " +
         std::to_string(points) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(points) + "\nDATA " +
         data + "\n";
}

std::string binary_pcd() {
  std::string text = pcd_header("binary", 2);
  for (const Vector3& point : sample) {
    const float row[4] = {0, float(point.x()), float(point.y()), float(point.z())};
    text.append(reinterpret_cast<const char*>(row), sizeof row);
  }
  return text;
}

/// Both points twice, field by field: the colours a byte and a copy of it 15 bytes on, the rest as it is.
std::string compressed_pcd() {
  std::string places;
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < 4; ++i) {
      const auto value = float(sample[i % 2][axis]);
      places.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
  const std::string packed =
      std::string{0, 0, char(7 << 5), 6, 0} + char(31) + places.substr(0, 32) + char(15) + places.substr(32);
  std::string text = pcd_header("binary_compressed", 4);
  for (const std::uint32_t size : {std::uint32_t(packed.size()), std::uint32_t(64)})
    text.append(reinterpret_cast<const char*>(&size), sizeof size);
  return text + packed;
}

TEST(PointCloud, ReadsCompressedPcd) {
  const TemporaryFolder folder;
  folder.write("a.pcd", compressed_pcd());
  EXPECT_THAT(read_points(folder / "a.pcd"), ElementsAre(sample[0], sample[1], sample[0], sample[1]));
  std::string broken = compressed_pcd();
  broken[broken.find("compressed\n") + 11 + 8 + 4] = 100;  // a copy from before the beginning
  folder.write("a.pcd", broken);
  EXPECT_THAT(complaint_of([&] { (void)read_points(folder / "a.pcd"); }),
              HasSubstr("compressed points that are broken"));
}

TEST(PointCloud, PlyComesBack) {
  const TemporaryFolder folder;
  write_points(folder / "a.ply", sample);
  EXPECT_THAT(read_points(folder / "a.ply"), ElementsAre(sample[0], sample[1]));
  EXPECT_EQ(read_point_count(folder / "a.ply"), 2u);
}

TEST(PointCloud, ReadsBinaryPcd) {
  const TemporaryFolder folder;
  folder.write("a.pcd", binary_pcd());
  EXPECT_THAT(read_points(folder / "a.pcd"), ElementsAre(sample[0], sample[1]));
  EXPECT_EQ(read_point_count(folder / "a.pcd"), 2u);
}

TEST(PointCloud, ReadsAsciiPcdAndLeavesOutMissingPoints) {
  const TemporaryFolder folder;
  folder.write("a.pcd", pcd_header("ascii", 2) + "7 0.5 -1.25 3\n7 nan nan nan\n");
  EXPECT_THAT(read_points(folder / "a.pcd"), ElementsAre(sample[0]));
}

TEST(PointCloud, RefusesEveryTruncation) {
  const TemporaryFolder folder;
  write_points(folder / "a.ply", sample);
  folder.write("a.pcd", binary_pcd());
  folder.write("b.pcd", compressed_pcd());
  for (const char* name : {"a.ply", "a.pcd", "b.pcd"}) {
    const std::string whole = read_file(folder / name);
    for (std::size_t length = 0; length < whole.size(); ++length) {
      write_file(folder / name, std::string_view(whole).substr(0, length));
      EXPECT_THROW((void)read_points(folder / name), InputError) << name << " cut to " << length;
    }
  }
}

TEST(PointCloud, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  const auto said = [&](const char* name, const std::string& content) {
    return complaint_of([&] { (void)read_points(folder.write(name, content)); });
  };
  EXPECT_THAT(said("a.xyz", "1 2 3\n"), HasSubstr(".ply or .pcd"));
  EXPECT_THAT(said("a.pcd", pcd_header("binary_packed", 2)), HasSubstr("expected ascii, binary or binary_compressed"));
  EXPECT_THAT(said("a.pcd", pcd_header("ascii", 1) + "7 0.5 x 3\n"), HasSubstr("a.pcd:12: \"x\" in point 0"));
  EXPECT_THAT(said("a.pcd", pcd_header("ascii", 999999999)), HasSubstr("cut short"));
  EXPECT_THAT(said("a.pcd", "FIELDS x y\nSIZE 4 4\nTYPE F F\nCOUNT 1 1\nPOINTS 1\nDATA ascii\n1 2\n"),
              HasSubstr("no fields x, y and z"));
  EXPECT_THAT(said("a.pcd", pcd_header("ascii", 1) + "7 nan nan nan\n"), HasSubstr("no finite point"));
  // sizes whose sum wraps around to the few bytes of a row
  EXPECT_THAT(said("a.pcd",
                   "FIELDS x y z pad\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 18446744073709551608\nPOINTS 1\n"
                   "DATA binary\n" +
                       std::string(12, 'x')),
              HasSubstr("18446744073709551608 numbers"));
}

}  // namespace
}  // namespace pliant::point_cloud_test
