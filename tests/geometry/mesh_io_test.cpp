#include "geometry/mesh_io.hpp"

#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>

#include "base/files.hpp"
#include "geometry/meshes.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::mesh_io_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Not representable in single precision on purpose: a reader that narrows is seen.
TriangleMesh sample() { return test::box_mesh({-0.1, 0.2, 1.0 / 3.0}, {0.123456789012, 0.3, 0.7}); }

void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.triangles, b.triangles);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t i = 0; i < a.vertices.size(); ++i) EXPECT_EQ(a.vertices[i], b.vertices[i]) << "vertex " << i;
}

TEST(MeshRoundTrip, PlyKeepsEveryBit) {
  const TemporaryFolder folder;
  write_mesh(folder / "a.ply", sample());
  expect_same(read_mesh(folder / "a.ply"), sample());
}

TEST(MeshRoundTrip, ObjKeepsOrderAndDoublePrecision) {
  const TemporaryFolder folder;
  write_mesh(folder / "a.obj", sample());
  const TriangleMesh mesh = read_mesh(folder / "a.obj");
  EXPECT_EQ(mesh.triangles, sample().triangles);
  ASSERT_EQ(mesh.vertices.size(), 8u);
  // tinyobjloader's decimal parser may miss the nearest double by a few units in the last place.
  for (std::size_t i = 0; i < 8; ++i) EXPECT_LT((mesh.vertices[i] - sample().vertices[i]).norm(), 1e-15);
}

TEST(MeshRoundTrip, StlJoinsCornersAndKeepsSinglePrecision) {
  const TemporaryFolder folder;
  write_mesh(folder / "a.stl", sample());
  const TriangleMesh mesh = read_mesh(folder / "a.stl");
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_NEAR(enclosed_volume(mesh), enclosed_volume(sample()), 1e-8);
  EXPECT_TRUE(examine(mesh).is_closed_solid);
}

TEST(ReadMesh, TakesEndingsInAnyCase) {
  const TemporaryFolder folder;
  write_mesh(folder / "a.PLY", sample());
  expect_same(read_mesh(folder / "a.PLY"), sample());
}

TEST(ReadMesh, NamesEndingsThatItCanRead) {
  EXPECT_THAT(complaint_of([] { (void)read_mesh("scan.fbx"); }), HasSubstr(".ply, .obj or .stl"));
  EXPECT_THAT(complaint_of([] { write_mesh("scan", {}); }), HasSubstr(".ply, .obj or .stl"));
}

TEST(ReadMesh, SaysThatAFileIsMissing) {
  const TemporaryFolder folder;
  for (const char* name : {"none.ply", "none.obj", "none.stl"})
    EXPECT_THAT(complaint_of([&] { (void)read_mesh(folder / name); }), HasSubstr("cannot be read: No such file"));
}

TEST(ReadMesh, SaysThatAFileIsEmpty) {
  const TemporaryFolder folder;
  for (const char* name : {"a.ply", "a.obj", "a.stl"}) {
    folder.write(name, "");
    EXPECT_THAT(complaint_of([&] { (void)read_mesh(folder / name); }), HasSubstr("the file is empty")) << name;
  }
}

// Every shorter version of a binary file is refused: there is no length at which half a mesh passes.
TEST(ReadMesh, RefusesEveryTruncation) {
  const TemporaryFolder folder;
  for (const char* name : {"a.ply", "a.stl"}) {
    write_mesh(folder / name, sample());
    const std::string whole = read_file(folder / name);
    for (std::size_t length = 0; length < whole.size(); ++length) {
      write_file(folder / name, std::string_view(whole).substr(0, length));
      EXPECT_THROW((void)read_mesh(folder / name), InputError) << name << " cut to " << length << " bytes";
    }
  }
}

TEST(ReadMesh, RefusesNumbersThatAreNotFinite) {
  const TemporaryFolder folder;
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (const char* name : {"a.ply", "a.obj", "a.stl"}) {
      TriangleMesh mesh = sample();
      mesh.vertices[5].y() = bad;
      write_mesh(folder / name, mesh);
      EXPECT_THROW((void)read_mesh(folder / name), InputError) << name << " with " << bad;
    }
}

TEST(ReadPly, SplitsPolygonsIntoFans) {
  const TemporaryFolder folder;
  folder.write("a.ply",
               "ply\nformat ascii 1.0\ncomment a pentagon\nelement vertex 5\nproperty float x\nproperty float y\n"
               "property float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n"
               "0 0 0\n1 0 0\n2 1 0\n1 2 0\n0 1 0\n5 0 1 2 3 4\n");
  const std::vector<std::array<int, 3>> fan = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}};
  EXPECT_EQ(read_mesh(folder / "a.ply").triangles, fan);
}

TEST(ReadPly, NamesFaceAndVertexOutOfRange) {
  const TemporaryFolder folder;
  folder.write(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 3\n");
  EXPECT_THAT(complaint_of([&] { (void)read_mesh(folder / "a.ply"); }),
              AllOf(HasSubstr("face 1 names vertex 3"), HasSubstr("expected a whole number of 0 to 2")));
}

TEST(ReadPly, RefusesAFaceOfFractionsOfVertices) {
  const TemporaryFolder folder;
  folder.write(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar float vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n");
  EXPECT_THAT(complaint_of([&] { (void)read_mesh(folder / "a.ply"); }), HasSubstr("face 0 names vertex 1.5"));
}

TEST(ReadPly, SaysThatAPointCloudIsNoMesh) {
  const TemporaryFolder folder;
  folder.write("a.ply",
               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
               "property float z\nend_header\n0 0 0\n");
  EXPECT_THAT(complaint_of([&] { (void)read_mesh(folder / "a.ply"); }), HasSubstr("point cloud"));
}

TEST(ReadObj, TriangulatesPolygonsAndTakesNegativeIndices) {
  const TemporaryFolder folder;
  folder.write("a.obj", "# quad\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1 4/1\nf -4 -3 -2\n");
  const TriangleMesh mesh = read_mesh(folder / "a.obj");
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 3u);
}

TEST(ReadObj, NamesTheLineOfABadVertex) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.obj", "v 0 0 0\nv 1 0\nv 1 1 0\nf 1 2 3\n");
  EXPECT_THAT(complaint_of([&] { (void)read_mesh(path); }), StartsWith(path.string() + ":2:1: a vertex \"v 1 0\""));
}

TEST(ReadObj, RefusesIndicesOutOfRange) {
  const TemporaryFolder folder;
  folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n");
  EXPECT_THROW((void)read_mesh(folder / "a.obj"), InputError);
  folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 -4\n");
  EXPECT_THROW((void)read_mesh(folder / "a.obj"), InputError);
}

TEST(ReadStl, ReadsText) {
  const TemporaryFolder folder;
  folder.write("a.stl",
               "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e-1 0\n"
               "endloop\nendfacet\nendsolid one\n");
  const TriangleMesh mesh = read_mesh(folder / "a.stl");
  ASSERT_EQ(mesh.vertices.size(), 3u);
  EXPECT_EQ(mesh.vertices[2], Vector3(0, 0.1, 0));
}

TEST(ReadStl, NamesTheLineOfABadCorner) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.stl", "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 zero\n");
  EXPECT_THAT(complaint_of([&] { (void)read_mesh(path); }), StartsWith(path.string() + ":4:1"));
}

TEST(ReadStl, RefusesTextThatIsCutShort) {
  const TemporaryFolder folder;
  folder.write("a.stl", "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n");
  EXPECT_THAT(complaint_of([&] { (void)read_mesh(folder / "a.stl"); }), HasSubstr("cut short"));
}

const char* const text_facet =
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";

TEST(ReadStl, TakesTextBesideTheLetter) {
  const TemporaryFolder folder;
  std::string capitals = std::string("solid one\n") + text_facet + "endsolid one\n";
  for (char& c : capitals) c = char(std::toupper(static_cast<unsigned char>(c)));
  for (const std::string& text : {capitals, std::string("\n\n  solid\n\n") + text_facet + "\n\nendsolid\n\n",
                                  std::string("\xEF\xBB\xBFsolid \xC3\xA9\r\n") + text_facet + "end solid",
                                  std::string("solid a\nendsolid a\nsolid b\n") + text_facet + "endsolid b"}) {
    folder.write("a.stl", text);
    EXPECT_EQ(read_mesh(folder / "a.stl").triangles.size(), 1u) << text;
  }
  folder.write("a.stl", std::string("solid a\n") + text_facet + "endsolid a\nsolid b\n" + text_facet + "endsolid b\n");
  EXPECT_EQ(read_mesh(folder / "a.stl").triangles.size(), 2u);
}

TEST(ReadStl, RefusesASecondSolidThatIsCutShort) {
  const TemporaryFolder folder;
  folder.write("a.stl", std::string("solid a\n") + text_facet + "endsolid a\nsolid b\n" + text_facet);
  EXPECT_THAT(complaint_of([&] { (void)read_mesh(folder / "a.stl"); }), HasSubstr("cut short"));
  folder.write("a.stl",
               "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid");
  EXPECT_THAT(complaint_of([&] { (void)read_mesh(folder / "a.stl"); }),
              AllOf(HasSubstr("a.stl:7"), HasSubstr("without three corners")));
}

class BinaryStl : public ::testing::Test {
 protected:
  BinaryStl() {
    write_mesh(folder / "a.stl", sample());
    whole = read_file(folder / "a.stl");
  }
  TriangleMesh read(const std::string& bytes) const {
    write_file(folder / "a.stl", bytes);
    return read_mesh(folder / "a.stl");
  }
  static std::string promising(std::string bytes, std::uint32_t count) {
    std::memcpy(bytes.data() + 80, &count, 4);
    return bytes;
  }
  TemporaryFolder folder;
  std::string whole;
};

TEST_F(BinaryStl, MayBeginWithSolidAndGoOnBehindTheEnd) {
  std::string solid = whole;
  solid.replace(0, 14, "solid facet\nfa");
  for (const std::string& tail : {std::string(), std::string("made by a scanner"), std::string(100, '\0')})
    for (const std::string& bytes : {whole, solid}) EXPECT_EQ(read(bytes + tail), read(whole)) << tail.size();
}

TEST_F(BinaryStl, IsCountedWhereItsHeadingDoesNot) {
  for (const std::uint32_t count : {0U, 0xFFFFFFFFU}) EXPECT_EQ(read(promising(whole, count)).triangles.size(), 12u);
  EXPECT_EQ(read(promising(whole, 11)).triangles.size(), 12u);  // which closes the surface
}

TEST_F(BinaryStl, SaysWhichCountsDisagree) {
  EXPECT_THAT(complaint_of([&] { (void)read(promising(whole, 13)); }),
              AllOf(HasSubstr("which hold 12 triangles"), HasSubstr("promises 13"), HasSubstr("cut short")));
  EXPECT_THAT(complaint_of([&] { (void)read(promising(whole.substr(0, whole.size() - 50), 10)); }),
              AllOf(HasSubstr("promises 10 triangles"), HasSubstr("holds 11"), HasSubstr("meshio convert")));
}

TEST(SharedMeshes, RestScansAreClosedSolids) {
  const auto data = test::shared_data();
  if (!std::filesystem::exists(data / "oracle-press")) GTEST_SKIP() << "no shared recordings at " << data;
  for (const char* name : {"oracle-bounce-a", "oracle-ramp", "oracle-press", "oracle-load", "silicone-h_e_c"}) {
    const MeshReport report = examine(read_mesh(data / name / "rest.ply"));
    EXPECT_TRUE(report.is_closed_solid) << name;
    EXPECT_EQ(report.components, 1) << name;
  }
}

}  // namespace
}  // namespace pliant::mesh_io_test
