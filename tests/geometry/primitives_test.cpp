#include "geometry/primitives.hpp"

#include <cmath>
#include <map>
#include <numbers>

namespace pliant::primitives_test {
namespace {

// Every directed edge once, and its reverse once: closed, manifold and consistently oriented.
bool is_closed_and_oriented(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const auto& [a, b, c] : mesh.triangles) ++edges[{a, b}], ++edges[{b, c}], ++edges[{c, a}];
  for (const auto& [edge, count] : edges)
    if (count != 1 || !edges.contains({edge.second, edge.first})) return false;
  return true;
}

double order(double coarse_error, double fine_error) { return std::log2(coarse_error / fine_error); }

TEST(Primitives, AreClosedAndOutward) {
  for (const TriangleMesh& mesh :
       {make_box({0.3, 0.2, 0.1}, 0.04), make_sphere(0.2, 2), make_torus(0.3, 0.1, 24, 12)}) {
    EXPECT_TRUE(is_closed_and_oriented(mesh));
    EXPECT_GT(enclosed_volume(mesh), 0.0);
    EXPECT_LT(enclosed_centroid(mesh).norm(), 1e-12);
  }
}

TEST(Primitives, EulerCharacteristicTellsBallsFromRings) {
  const auto characteristic = [](const TriangleMesh& m) {
    return int(m.vertices.size()) - int(m.triangles.size()) / 2;
  };
  EXPECT_EQ(characteristic(make_box({1, 2, 3}, 0.5)), 2);
  EXPECT_EQ(characteristic(make_sphere(1.0, 3)), 2);
  EXPECT_EQ(characteristic(make_torus(1.0, 0.2, 10, 8)), 0);
}

TEST(Primitives, BoxHasItsExactVolume) {
  const TriangleMesh box = make_box({0.3, 0.2, 0.1}, 0.03);
  EXPECT_NEAR(enclosed_volume(box), 0.006, 1e-15);
  EXPECT_NEAR((bounding_box(box).extent() - Vector3(0.3, 0.2, 0.1)).norm(), 0.0, 1e-15);
}

TEST(Primitives, SphereVolumeConvergesWithSecondOrder) {
  const auto error = [](int n) { return 4.0 / 3.0 * std::numbers::pi - enclosed_volume(make_sphere(1.0, n)); };
  for (int n = 2; n < 5; ++n) {
    EXPECT_GT(error(n), 0.0);
    EXPECT_NEAR(order(error(n), error(n + 1)), 2.0, 0.1);
  }
}

TEST(Primitives, TorusVolumeConvergesWithSecondOrder) {
  const double ideal = 2.0 * std::pow(std::numbers::pi, 2) * 0.3 * 0.1 * 0.1;
  const auto error = [&](int n) { return ideal - enclosed_volume(make_torus(0.3, 0.1, 3 * n, n)); };
  for (const int n : {8, 16, 32}) EXPECT_NEAR(order(error(n), error(2 * n)), 2.0, 0.1);
}

Box cube(double half) {
  Box box;
  box.extend(Vector3::Constant(-half));
  box.extend(Vector3::Constant(half));
  return box;
}

TEST(LevelSurface, OfABallConvergesWithSecondOrder) {
  const Vector3 centre(0.011, -0.007, 0.003);
  const auto ball = [&](const Vector3& p) { return (p - centre).norm() - 0.3; };
  const double ideal = 4.0 / 3.0 * std::numbers::pi * std::pow(0.3, 3);
  const auto error = [&](double spacing) {
    const TriangleMesh mesh = make_level_surface(ball, cube(0.4), spacing);
    EXPECT_TRUE(is_closed_and_oriented(mesh));
    EXPECT_LT((enclosed_centroid(mesh) - centre).norm(), spacing * spacing);
    return ideal - enclosed_volume(mesh);
  };
  // Over a factor of four, in which how the lattice happens to lie counts less.
  EXPECT_NEAR(0.5 * order(error(0.08), error(0.02)), 2.0, 0.2);
}

TEST(LevelSurface, IsManifoldWhereTheFunctionIsZeroAtPointsOfTheLattice) {
  // A ring, and its faces, edges and points where they fall on the lattice.
  const auto ring = [](const Vector3& p) {
    const double from_axis = std::max(std::abs(p.x()), std::abs(p.y()));
    return std::max({from_axis - 0.3, 0.1 - from_axis, std::abs(p.z()) - 0.1});
  };
  const TriangleMesh mesh = make_level_surface(ring, cube(0.5), 0.1);
  EXPECT_TRUE(is_closed_and_oriented(mesh));
  EXPECT_EQ(int(mesh.vertices.size()) - int(mesh.triangles.size()) / 2, 0);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 &A = mesh.vertices[a], &B = mesh.vertices[b], &C = mesh.vertices[c];
    EXPECT_GT((B - A).cross(C - A).norm(), 1e-6);
  }
}

TEST(LevelSurface, RefusesWhatItCannotClose) {
  const auto ball = [](const Vector3& p) { return p.norm() - 0.3; };
  EXPECT_THROW(make_level_surface(ball, cube(0.25), 0.05), std::invalid_argument);
  EXPECT_THROW(make_level_surface(ball, cube(0.4), 0.0), std::invalid_argument);
  EXPECT_THROW(make_level_surface(ball, Box(), 0.05), std::invalid_argument);
  EXPECT_THROW(make_level_surface([](const Vector3&) { return std::nan(""); }, cube(0.4), 0.1), std::invalid_argument);
}

TEST(Primitives, RefuseSenselessSizes) {
  EXPECT_THROW(make_box({0.1, -0.1, 0.1}, 0.1), std::invalid_argument);
  EXPECT_THROW(make_box({0.1, 0.1, std::nan("")}, 0.1), std::invalid_argument);
  EXPECT_THROW(make_sphere(1.0, 9), std::invalid_argument);
  EXPECT_THROW(make_torus(0.1, 0.2, 12, 12), std::invalid_argument);
  EXPECT_THROW(make_torus(0.2, 0.1, 2, 12), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::primitives_test
