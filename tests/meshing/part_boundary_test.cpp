#include "meshing/part_boundary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/primitives.hpp"
#include "mesh/tet_mesh.hpp"

namespace pliant::part_boundary_test {
namespace {

struct Elements {
  std::vector<Vector3> nodes;
  std::vector<std::array<int, 4>> tets;

  double volume(const std::array<int, 4>& t) const {
    const auto at = [&](int k) -> const Vector3& { return nodes[std::size_t(t[std::size_t(k)])]; };
    return (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0)) / 6.0;
  }
  /// Of the elements whose corners all lie inside.
  double volume_in(const std::function<bool(const Vector3&)>& contains) const {
    double sum = 0.0;
    for (const auto& t : tets)
      if (std::ranges::all_of(t, [&](int n) { return contains(nodes[std::size_t(n)]); })) sum += volume(t);
    return sum;
  }
  /// The elements that do not lie inside.
  Elements without(const std::function<bool(const Vector3&)>& contains) const {
    Elements rest;
    std::map<int, int> number;
    for (auto t : tets) {
      if (std::ranges::all_of(t, [&](int n) { return contains(nodes[std::size_t(n)]); })) continue;
      for (int& n : t) {
        const auto [entry, is_new] = number.try_emplace(n, int(rest.nodes.size()));
        if (is_new) rest.nodes.push_back(nodes[std::size_t(n)]);
        n = entry->second;
      }
      rest.tets.push_back(t);
    }
    return rest;
  }
  TetMesh mesh() const {
    Points x(Eigen::Index(nodes.size()), 3);
    for (std::size_t n = 0; n < nodes.size(); ++n) x.row(Eigen::Index(n)) = nodes[n].transpose();
    return make_tet_mesh(std::move(x), tets);  // refuses what is no mesh
  }
};

/// A bar of 8 x 2 x 2 cells along x, 0.8 m long.
Elements bar() {
  const TetMesh box = make_tet_box({{0.0, 0.0, 0.0}, {0.8, 0.2, 0.2}}, {8, 2, 2}, false);
  Elements e;
  for (int n = 0; n < box.node_count(); ++n) e.nodes.emplace_back(box.nodes.row(n).transpose());
  e.tets = box.tets;
  return e;
}

class EndsOfABar : public testing::TestWithParam<double> {};

TEST_P(EndsOfABar, AreFollowedWhereverTheyEnd) {
  const double end = GetParam();
  const auto held = [&](const Vector3& p) { return p.x() <= end; };
  Elements e = bar();
  follow_part(e.nodes, e.tets, held, 1e-3);
  EXPECT_NEAR(e.volume_in(held), end * 0.04, 1e-9);
  const TetMesh mesh = e.mesh();
  EXPECT_NEAR(mesh.volume(), 0.8 * 0.04, 1e-12);
  for (const SurfacePoint& p : mesh.surface) {
    const Vector3 a = p.position;
    EXPECT_LT(std::min({std::abs(a.x()), std::abs(a.x() - 0.8), std::abs(a.y()), std::abs(a.y() - 0.2), std::abs(a.z()),
                        std::abs(a.z() - 0.2)}),
              1e-12);
  }
  EXPECT_GT(quality(e.without(held).mesh()).least_dihedral_deg, 2.5);
}

INSTANTIATE_TEST_SUITE_P(Shares, EndsOfABar, testing::Values(0.01, 0.03, 0.05, 0.07, 0.1, 0.13, 0.18, 0.45));

TEST(PartBoundary, IsFollowedByASphereThatLiesInTheMiddle) {
  const auto held = [](const Vector3& p) { return (p - Vector3(0.41, 0.1, 0.1)).norm() <= 0.07; };
  Elements e = bar();
  follow_part(e.nodes, e.tets, held, 1e-3);
  const double sphere = 4.0 / 3.0 * 3.14159 * std::pow(0.07, 3);
  EXPECT_NEAR(e.volume_in(held), sphere, 0.6 * sphere);  // a sphere of less than an element's edge, as a polyhedron
  EXPECT_NEAR(e.mesh().volume(), 0.8 * 0.04, 1e-9);
}

TEST(PartBoundary, OfAPartBetweenTheNodesGetsNodes) {
  const auto held = [](const Vector3& p) { return p.x() > 0.42 && p.x() < 0.48; };
  Elements e = bar();
  ASSERT_EQ(std::ranges::count_if(e.nodes, held), 0);
  follow_part(e.nodes, e.tets, held, 1e-3);
  EXPECT_GE(std::ranges::count_if(e.nodes, held), 9);
  EXPECT_NEAR(e.volume_in(held), 0.06 * 0.04, 0.2 * 0.06 * 0.04);
  EXPECT_NEAR(e.mesh().volume(), 0.8 * 0.04, 1e-12);
}

TEST(PartBoundary, ThatIsFarAwayChangesNothing) {
  Elements e = bar();
  const Elements before = e;
  follow_part(
      e.nodes, e.tets, [](const Vector3& p) { return p.x() > 2.0; }, 1e-3);
  EXPECT_EQ(e.nodes, before.nodes);
  EXPECT_EQ(e.tets, before.tets);
}

}  // namespace
}  // namespace pliant::part_boundary_test
