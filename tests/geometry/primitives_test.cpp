#include "geometry/primitives.hpp"

#include <cmath>
#include <map>
#include <numbers>

namespace pliant {
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

TEST(Primitives, RefuseSenselessSizes) {
  EXPECT_THROW(make_box({0.1, -0.1, 0.1}, 0.1), std::invalid_argument);
  EXPECT_THROW(make_box({0.1, 0.1, std::nan("")}, 0.1), std::invalid_argument);
  EXPECT_THROW(make_sphere(1.0, 9), std::invalid_argument);
  EXPECT_THROW(make_torus(0.1, 0.2, 12, 12), std::invalid_argument);
  EXPECT_THROW(make_torus(0.2, 0.1, 2, 12), std::invalid_argument);
}

}  // namespace
}  // namespace pliant
