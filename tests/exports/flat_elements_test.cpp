#include "exports/flat_elements.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace pliant::flat_elements_test {
namespace {

constexpr double edge = 0.1;  // of a cell; the box has 5 x 4 x 4

double worst_quality(const Points& nodes, const std::vector<std::array<int, 4>>& tets) {
  double worst = 1.0;
  for (const auto& tet : tets) {
    const auto at = [&](std::size_t k) -> Vector3 { return nodes.row(tet[k]).transpose(); };
    worst = std::min(worst, tet_shape_quality(at(0), at(1), at(2), at(3)));
  }
  return worst;
}
double worst_quality(const TetMesh& mesh) { return worst_quality(mesh.nodes, mesh.tets); }

/// A box of tetrahedra whose inner nodes are moved at random until some elements are flat, none inverted.
TetMesh distorted_box() {
  const TetMesh even = make_tet_box(Box{Vector3::Zero(), Vector3(5 * edge, 4 * edge, 4 * edge)}, {5, 4, 4}, false);
  std::vector<bool> is_on_surface(std::size_t(even.node_count()), false);
  for (const auto& face : even.boundary)
    for (const int node : face) is_on_surface[std::size_t(node)] = true;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> move(-1.0, 1.0);
  Points ways = Points::Zero(even.node_count(), 3);
  for (int n = 0; n < even.node_count(); ++n)
    if (!is_on_surface[std::size_t(n)])
      for (int d = 0; d < 3; ++d) ways(n, d) = move(random);
  double far = 0.2 * edge;
  while (worst_quality(even.nodes + far * ways, even.tets) > 0.05) far *= 1.02;
  return make_tet_mesh(even.nodes + far * ways, even.tets);
}

TEST(TetShapeQuality, IsOneOfARegularElementAndItsSignIsTheVolumes) {
  const Vector3 a(1, 1, 1), b(1, -1, -1), c(-1, 1, -1), d(-1, -1, 1);
  EXPECT_NEAR(std::abs(tet_shape_quality(a, b, c, d)), 1.0, 1e-12);
  EXPECT_EQ(tet_shape_quality(a, b, c, d), -tet_shape_quality(b, a, c, d));
  EXPECT_NEAR(tet_shape_quality(a, b, c, (a + b + c) / 3.0), 0.0, 1e-12);
}

TEST(FlatElements, AreMended) {
  const TetMesh mesh = distorted_box();
  ASSERT_LT(worst_quality(mesh), 0.1);
  const TetMesh mended = with_flat_elements_mended(mesh, [](const Vector3&) { return false; });
  EXPECT_GT(worst_quality(mended), 0.18);
  EXPECT_EQ(mended.tets, mesh.tets);
  EXPECT_NEAR(mended.volume(), mesh.volume(), 0.02 * mesh.volume());
  for (const auto& face : mesh.boundary)
    for (const int node : face) EXPECT_LT((mended.nodes.row(node) - mesh.nodes.row(node)).norm(), 0.2 * edge);
}

TEST(FlatElements, HeldNodesStayHeldAndOthersFree) {
  const TetMesh mesh = distorted_box();
  const auto is_held = [](const Vector3& place) { return place.x() <= 2.5 * edge; };
  const TetMesh mended = with_flat_elements_mended(mesh, is_held);
  ASSERT_NE(mended.nodes, mesh.nodes);
  for (int n = 0; n < mesh.node_count(); ++n)
    EXPECT_EQ(is_held(mended.nodes.row(n).transpose()), is_held(mesh.nodes.row(n).transpose())) << n;
  EXPECT_GT(worst_quality(mended), worst_quality(mesh));
}

TEST(FlatElements, WellShapedOnesStayAsTheyAre) {
  const TetMesh even = make_tet_box(Box{Vector3::Zero(), Vector3(edge, edge, edge)}, {2, 2, 2}, false);
  ASSERT_GT(worst_quality(even), 0.2);
  EXPECT_EQ(with_flat_elements_mended(even, [](const Vector3&) { return false; }).nodes, even.nodes);
}

TEST(FlatElements, OfQuadraticMeshesAreRefused) {
  const TetMesh quadratic = make_tet_box(Box{Vector3::Zero(), Vector3(edge, edge, edge)}, {1, 1, 1}, true);
  EXPECT_THROW((void)with_flat_elements_mended(quadratic, [](const Vector3&) { return false; }), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::flat_elements_test
