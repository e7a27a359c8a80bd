#include "geometry/ply.hpp"

#include <bit>
#include <cstring>

#include "base/files.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::ply_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

template <class T>
std::string bytes_of(T value, bool big_endian) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

// One row of every type there is, and a list whose lengths are shorts.
std::string file_of_every_type(bool big_endian) {
  std::string file = "ply\nformat " + std::string(big_endian ? "binary_big_endian" : "binary_little_endian") + " 1.0\n";
  file +=
      "obj_info none\nelement vertex 1\nproperty char a\nproperty uchar b\nproperty short c\nproperty ushort d\n"
      "property int e\nproperty uint f\nproperty float32 x\nproperty double y\nproperty list ushort int8 l\n"
      "property float64 z\nend_header\n";
  file += bytes_of(std::int8_t(-5), big_endian) + bytes_of(std::uint8_t(250), big_endian);
  file += bytes_of(std::int16_t(-3000), big_endian) + bytes_of(std::uint16_t(60000), big_endian);
  file += bytes_of(std::int32_t(-70000), big_endian) + bytes_of(std::uint32_t(4000000000u), big_endian);
  file += bytes_of(0.5f, big_endian) + bytes_of(-1e300, big_endian);
  file += bytes_of(std::uint16_t(2), big_endian) + bytes_of(std::int8_t(7), big_endian) +
          bytes_of(std::int8_t(-8), big_endian);
  return file + bytes_of(3.25, big_endian);
}

class PlyByteOrder : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(LittleAndBig, PlyByteOrder, ::testing::Bool());

TEST_P(PlyByteOrder, ReadsEveryType) {
  const TemporaryFolder folder;
  const PlyFile ply = read_ply(folder.write("a.ply", file_of_every_type(GetParam())));
  const PlyElement& row = *ply.element("vertex");
  const auto value = [&](const char* name) { return row.property(name)->values.at(0); };
  EXPECT_EQ(value("a"), -5);
  EXPECT_EQ(value("b"), 250);
  EXPECT_EQ(value("c"), -3000);
  EXPECT_EQ(value("d"), 60000);
  EXPECT_EQ(value("e"), -70000);
  EXPECT_EQ(value("f"), 4000000000.0);
  EXPECT_EQ(value("x"), 0.5);
  EXPECT_EQ(value("y"), -1e300);
  EXPECT_EQ(value("z"), 3.25);
  EXPECT_THAT(row.property("l")->values, ElementsAre(7, -8));
}

TEST(ReadPly, RefusesAnotherMagic) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.ply", "\x89PNG\r\nxxx");
  EXPECT_THAT(complaint_of([&] { (void)read_ply(path); }),
              AllOf(StartsWith(path.string() + ":1"), HasSubstr("expected the line \"ply\"")));
}

TEST(ReadPly, RefusesACountThatTheFileCannotHold) {
  const TemporaryFolder folder;
  folder.write("a.ply",
               "ply\nformat binary_little_endian 1.0\nelement vertex 3999999999\nproperty float x\nend_header\n");
  EXPECT_THAT(complaint_of([&] { (void)read_ply(folder / "a.ply"); }), HasSubstr("promises 3999999999 rows"));
}

TEST(ReadPly, RefusesAListLongerThanTheFile) {
  const TemporaryFolder folder;
  folder.write("a.ply",
               "ply\nformat ascii 1.0\nelement face 1\nproperty list uint int i\nend_header\n4000000000 1 2 3\n");
  EXPECT_THAT(complaint_of([&] { (void)read_ply(folder / "a.ply"); }), HasSubstr("cut short"));
}

TEST(ReadPly, NamesTheLineOfAWordThatIsNoNumber) {
  const TemporaryFolder folder;
  const auto path =
      folder.write("a.ply", "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nend_header\n0.5\nabc\n");
  EXPECT_THAT(complaint_of([&] { (void)read_ply(path); }), StartsWith(path.string() + ":7: \"abc\" in vertex 1"));
}

TEST(ReadPly, RefusesBrokenHeaders) {
  const TemporaryFolder folder;
  for (const char* header :
       {"ply\nelement vertex 0\nend_header\n", "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n",
        "ply\nformat ascii 1.0\nproperty float x\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty quaternion x\nend_header\n",
        "ply\nformat utf8 1.0\nend_header\n", "ply\nformat ascii 1.0\nvertices 3\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex 0\n"})
    EXPECT_THROW((void)read_ply(folder.write("a.ply", header)), InputError) << header;
}

}  // namespace
}  // namespace pliant::ply_test
