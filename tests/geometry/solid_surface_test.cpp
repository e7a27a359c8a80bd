// What is mended in surfaces, what is left out, and what is left alone.
#include "geometry/solid_surface.hpp"

#include <random>

#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"
#include "geometry/primitives.hpp"
#include "temporary_folder.hpp"

namespace pliant::solid_surface_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TriangleMesh ball_at(double radius, const Vector3& centre) {
  TriangleMesh mesh = make_sphere(radius, 3);
  for (Vector3& vertex : mesh.vertices) vertex += centre;
  return mesh;
}

const TriangleMesh ball = ball_at(0.1, {0.3, -0.2, 5.0});

/// Three vertices of its own for each triangle, off by at most `error`.
TriangleMesh soup(const TriangleMesh& mesh, double error = 0.0) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> off(-error, error);
  TriangleMesh result;
  for (const auto& triangle : mesh.triangles) {
    const int first = int(result.vertices.size());
    for (const int v : triangle)
      result.vertices.emplace_back(mesh.vertices[std::size_t(v)] + Vector3(off(random), off(random), off(random)));
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

void expect_solid(const SolidSurface& surface, double volume, int components = 1) {
  const MeshReport report = examine(surface.mesh);
  EXPECT_TRUE(report.is_closed_solid) << ::testing::PrintToString(report.complaints);
  EXPECT_EQ(report.components, components);
  EXPECT_NEAR(report.volume, volume, 1e-4 * volume);
}

TEST(Mend, LeavesASolidAsItIs) {
  for (const TriangleMesh& mesh : {ball, test::joined(ball, test::turned(ball_at(0.05, {0.3, -0.2, 5.0})))}) {
    const SolidSurface surface = mend(mesh);
    EXPECT_EQ(surface.mesh, mesh);
    EXPECT_THAT(surface.remarks, IsEmpty());
  }
}

TEST(Mend, JoinsCornersAtOnePlace) {
  const SolidSurface surface = mend(soup(ball));
  expect_solid(surface, enclosed_volume(ball));
  EXPECT_EQ(surface.mesh.vertices, soup(ball).vertices);  // indices stay valid
  EXPECT_EQ(examine(surface.mesh).unused_vertices, int(3 * ball.triangles.size() - ball.vertices.size()));
  EXPECT_THAT(surface.remarks, ElementsAre(HasSubstr("corners at the very places of others joined")));
}

/// The tolerance follows the error, and is told.
TEST(Mend, JoinsCornersThatRoundingToreApart) {
  for (const auto& [error, tolerance] : {std::pair(3e-8, "within 2.43e-06 m"), std::pair(2e-6, "within 2.43e-05 m")}) {
    const SolidSurface surface = mend(soup(ball, error));
    expect_solid(surface, enclosed_volume(ball));
    EXPECT_THAT(surface.remarks, ElementsAre(HasSubstr(tolerance)));
  }
}

TEST(Mend, JoinsNothingFartherApart) {
  const TriangleMesh mesh = soup(ball, 1e-3);
  EXPECT_EQ(mend(mesh).mesh, mesh);
}

/// A soup of a sheet whose faces lie closer than the greatest tolerance stays two faces: its edges are as short.
TEST(Mend, KeepsThinPartsApart) {
  const TriangleMesh sheet = test::box_mesh({0, 0, 0}, {1, 5e-5, 1});
  expect_solid(mend(soup(sheet)), 5e-5);
  TriangleMesh hole = soup(sheet);
  hole.triangles.pop_back();
  const MeshReport report = examine(mend(hole).mesh);
  EXPECT_EQ(report.boundary_edges, 3);
  EXPECT_EQ(report.degenerate_triangles, 0);
}

TEST(Mend, LeavesOutTrianglesThatAreNoneOrTwice) {
  TriangleMesh mesh = ball;
  const auto& [a, b, c] = mesh.triangles[7];
  for (const std::array<int, 3>& more : {std::array{a, b, c}, std::array{c, b, a}, std::array{a, a, b}})
    mesh.triangles.push_back(more);
  const SolidSurface surface = mend(mesh);
  EXPECT_EQ(surface.mesh, ball);
  EXPECT_THAT(surface.remarks, ElementsAre(HasSubstr("3 triangles without area, or there twice, left out")));
}

TEST(Mend, LeavesASurfaceOfEdgesAloneAsItIs) {
  const TriangleMesh edges{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {1, 2, 2}}};
  EXPECT_EQ(mend(edges).mesh, edges);
  const TriangleMesh two_twice{{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}}, {{0, 1, 2}, {1, 0, 3}}};
  EXPECT_FALSE(mend(two_twice).mesh.triangles.empty());
  const TriangleMesh at_origin{{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, {{0, 1, 2}, {1, 2, 3}}};
  EXPECT_EQ(mend(at_origin).mesh, at_origin);
}

TEST(Mend, TurnsWhatFacesInwards) {
  const SolidSurface surface = mend(test::turned(ball));
  expect_solid(surface, enclosed_volume(ball));
  EXPECT_THAT(surface.remarks, ElementsAre(HasSubstr("faced inwards; all are turned over")));
}

TEST(Mend, TurnsTheWallsOfACavityWithTheSkin) {
  const TriangleMesh inner = ball_at(0.05, {0.3, -0.2, 5.0});
  const double volume = enclosed_volume(ball) - enclosed_volume(inner);
  expect_solid(mend(test::joined(test::turned(ball), inner)), volume, 2);
  // One part that faces inwards, beside one that does not.
  const TriangleMesh other = ball_at(0.1, {0.6, -0.2, 5.0});
  const SolidSurface two = mend(test::joined(ball, test::turned(other)));
  expect_solid(two, enclosed_volume(ball) + enclosed_volume(other), 2);
  EXPECT_THAT(two.remarks, ElementsAre(HasSubstr("1 part that faced inwards is"), HasSubstr("in 2 parts")));
}

TEST(Mend, MakesNeighboursFaceOneSide) {
  TriangleMesh mesh = ball;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  const SolidSurface surface = mend(mesh);
  expect_solid(surface, enclosed_volume(ball));
  EXPECT_THAT(surface.remarks, ElementsAre(HasSubstr("triangles that faced another side than the neighbours")));
}

TEST(Mend, LeavesOutCrumbsWhereverTheyAre) {
  TriangleMesh mesh = ball;
  for (const Vector3& at : {Vector3(0.8, -0.2, 5.0), Vector3(0.3, -0.2, 5.0), Vector3(0.3, -0.1, 5.0)})
    mesh = test::joined(mesh, ball_at(0.004, at));  // apart, within, and through the surface
  mesh.vertices.emplace_back(9, 9, 9);
  TriangleMesh open = test::box_mesh({0.3, 0.5, 5}, {0.302, 0.502, 5.002});
  open.triangles.resize(3);
  const SolidSurface surface = mend(test::joined(mesh, open));
  expect_solid(surface, enclosed_volume(ball));
  EXPECT_EQ(surface.mesh.triangles, ball.triangles);
  EXPECT_THAT(surface.remarks, ElementsAre(HasSubstr("2 open crumbs"), HasSubstr("3 crumbs of together")));
  EXPECT_THAT(surface.remarks[1], HasSubstr("0.008 m at (0.8, -0.2, 5)"));
  const Box box = bounding_box(surface.mesh);  // of what is left alone
  EXPECT_NEAR(box.max.x(), 0.4, 1e-9);
  EXPECT_NEAR(box.max.y(), -0.1, 1e-9);
}

TEST(Mend, KeepsBubbles) {
  const TriangleMesh bubble = test::turned(ball_at(0.004, {0.3, -0.2, 5.0}));
  EXPECT_EQ(mend(test::joined(ball, bubble)).mesh, test::joined(ball, bubble));
}

TEST(Mend, LeavesOutCopies) {
  const SolidSurface surface = mend(test::joined(ball, test::turned(ball)));
  EXPECT_EQ(surface.mesh.triangles, ball.triangles);
  EXPECT_THAT(surface.remarks, ElementsAre(HasSubstr("1 part that is a copy of another left out")));
}

TEST(Mend, LeavesWhatIsAmbiguousForExamine) {
  TriangleMesh hole = ball;
  hole.triangles.pop_back();
  EXPECT_EQ(mend(hole).mesh, hole);
  EXPECT_EQ(examine(mend(test::joined(ball, ball_at(0.1, {0.4, -0.2, 5.0}))).mesh).has_shared_volume, true);
  EXPECT_THAT(mend({}).mesh.triangles, IsEmpty());
}

TEST(ReadSurface, Mends) {
  const test::TemporaryFolder folder;
  write_mesh(folder / "a.ply", test::turned(ball));
  EXPECT_GT(enclosed_volume(read_surface(folder / "a.ply")), 0.0);
}

}  // namespace
}  // namespace pliant::solid_surface_test
