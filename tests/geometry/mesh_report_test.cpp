#include <limits>

#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"

namespace pliant::mesh_report_test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TriangleMesh unit_box() { return test::box_mesh(Vector3::Zero(), Vector3::Ones()); }

TEST(Examine, FindsNothingWrongWithABox) {
  const MeshReport report = examine(unit_box());
  EXPECT_TRUE(report.is_closed_solid);
  EXPECT_THAT(report.complaints, IsEmpty());
  EXPECT_EQ(report.components, 1);
  EXPECT_DOUBLE_EQ(report.volume, 1.0);
  EXPECT_EQ(report.box.max, Vector3::Ones());
}

TEST(Examine, CountsTheEdgesOfAHole) {
  TriangleMesh mesh = unit_box();
  mesh.triangles.pop_back();
  const MeshReport report = examine(mesh);
  EXPECT_FALSE(report.is_closed_solid);
  EXPECT_EQ(report.boundary_edges, 3);
  EXPECT_THAT(report.complaints, Contains(HasSubstr("3 edges belong to one triangle only")));
}

TEST(Examine, SeesATriangleThatIsTurnedOver) {
  TriangleMesh mesh = unit_box();
  std::swap(mesh.triangles[4][0], mesh.triangles[4][1]);
  const MeshReport report = examine(mesh);
  EXPECT_FALSE(report.is_closed_solid);
  EXPECT_EQ(report.misoriented_edges, 3);
}

TEST(Examine, SeesASurfaceThatFacesInwards) {
  TriangleMesh mesh = unit_box();
  for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  const MeshReport report = examine(mesh);
  EXPECT_FALSE(report.is_closed_solid);
  EXPECT_THAT(report.complaints, Contains(HasSubstr("face inwards")));
}

TEST(Examine, SeesAFinThatMakesAnEdgeNonManifold) {
  TriangleMesh mesh = unit_box();
  mesh.vertices.emplace_back(2, 2, 2);
  mesh.triangles.push_back({0, 1, 8});
  const MeshReport report = examine(mesh);
  EXPECT_EQ(report.non_manifold_edges, 1);
  EXPECT_EQ(report.boundary_edges, 2);
  EXPECT_FALSE(report.is_closed_solid);
}

TEST(Examine, CountsComponents) {
  TriangleMesh mesh = unit_box();
  const TriangleMesh other = test::box_mesh(Vector3::Constant(3), Vector3::Constant(4));
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (auto [a, b, c] : other.triangles) mesh.triangles.push_back({a + 8, b + 8, c + 8});
  EXPECT_EQ(examine(mesh).components, 2);
  EXPECT_DOUBLE_EQ(examine(mesh).volume, 2.0);
}

TEST(Examine, RefusesPartsThatCutOneAnother) {
  const TriangleMesh mesh = test::joined(unit_box(), test::box_mesh({0.5, 0.3, 0.4}, {1.5, 0.8, 0.9}));
  const MeshReport report = examine(mesh);
  EXPECT_FALSE(report.is_closed_solid);
  EXPECT_TRUE(report.has_shared_volume);
  EXPECT_THAT(report.complaints,
              Contains(HasSubstr("of 1 x 0.5 x 0.5 m about (1, 0.55, 0.65) cuts through the part of 1 x 1 x 1 m")));
  EXPECT_THAT(report.cure, HasSubstr("trimesh.boolean.union"));
  EXPECT_TRUE(examine(test::joined(unit_box(), test::box_mesh({0.2, 0, 0}, {1.2, 1, 1}))).has_shared_volume);
}

TEST(Examine, TellsACavityFromASolidInASolid) {
  const TriangleMesh inner = test::box_mesh(Vector3::Constant(0.2), Vector3::Constant(0.8));
  const MeshReport solid = examine(test::joined(unit_box(), inner)),
                   hollow = examine(test::joined(unit_box(), test::turned(inner)));
  EXPECT_FALSE(solid.is_closed_solid);
  EXPECT_THAT(solid.complaints, Contains(HasSubstr("both face the same way: a cavity faces inwards")));
  EXPECT_TRUE(hollow.is_closed_solid);
  EXPECT_THAT(hollow.complaints, IsEmpty());
  EXPECT_NEAR(hollow.volume, 1.0 - 0.216, 1e-12);
  const TriangleMesh core = test::box_mesh(Vector3::Constant(0.4), Vector3::Constant(0.6));
  EXPECT_TRUE(examine(test::joined(test::joined(unit_box(), test::turned(inner)), core)).is_closed_solid);
}

TEST(Examine, PartsThatOnlyTouchAreNoFault) {
  EXPECT_TRUE(examine(test::joined(unit_box(), test::box_mesh({1, 0, 0}, {2, 1, 1}))).is_closed_solid);
  EXPECT_TRUE(examine(test::joined(unit_box(), test::box_mesh({1, 0.2, 0.3}, {2, 0.7, 0.6}))).is_closed_solid);
}

TEST(Examine, CountsUnusedDegenerateAndNonFinite) {
  TriangleMesh mesh = unit_box();
  mesh.vertices.emplace_back(5, 5, 5);
  mesh.triangles.push_back({0, 0, 1});
  EXPECT_EQ(examine(mesh).unused_vertices, 1);
  EXPECT_EQ(examine(mesh).degenerate_triangles, 1);
  EXPECT_EQ(examine(mesh).box.max, Vector3::Constant(5));
  mesh.vertices[8].x() = std::numeric_limits<double>::quiet_NaN();
  const MeshReport report = examine(mesh);
  EXPECT_EQ(report.non_finite_vertices, 1);
  EXPECT_FALSE(report.is_closed_solid);
  EXPECT_THAT(report.complaints, Contains(HasSubstr("vertex 8")));
}

TEST(Examine, SurvivesAnEmptyMesh) {
  EXPECT_FALSE(examine({}).is_closed_solid);
  EXPECT_THAT(examine({}).complaints, SizeIs(1));
}

}  // namespace
}  // namespace pliant::mesh_report_test
