// Tetrahedra of a scan whose parts are much thinner than the elements that were asked for.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <set>
#include <vector>

#include "elasticity/modes.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/level_mesh.hpp"

namespace pliant::tet_meshing_test {
namespace {

constexpr double stalk = 0.007, height = 0.3, leaf_half_thickness = 0.003;  // radius of the stalk [m]

/// A stalk with two flat leaves, negative inside [m].
double plant(const Vector3& p) {
  const Vector3 on_axis(0.0, std::clamp(p.y(), 0.0, height), 0.0);
  double inside = (p - on_axis).norm() - stalk;
  const auto leaf = [&](const Vector3& middle) {
    const Vector3 half(0.06, leaf_half_thickness, 0.022), scaled = (p - middle).cwiseQuotient(half);
    const double r = scaled.norm(), slope = scaled.cwiseQuotient(half).norm();
    return slope > 0.0 ? r * (r - 1.0) / slope : -leaf_half_thickness;
  };
  for (const Vector3& middle : {Vector3(0.058, 0.22, 0.0), Vector3(-0.058, 0.12, 0.0)})
    inside = std::min(inside, leaf(middle));
  return inside;
}

TriangleMesh plant_surface() {
  return make_even_level_surface(plant, {Vector3(-0.14, -0.02, -0.04), Vector3(0.14, 0.32, 0.04)}, 0.0015);
}

/// Parts of elements that hang together by faces.
std::size_t parts(const TetMesh& mesh) {
  std::vector<int> parent(mesh.tets.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int e) {
    while (parent[std::size_t(e)] != e) e = parent[std::size_t(e)];
    return e;
  };
  std::map<std::array<int, 3>, int> first;
  for (int e = 0; e < mesh.tet_count(); ++e)
    for (int k = 0; k < 4; ++k) {
      std::array<int, 3> face{};
      for (int j = 0; j < 3; ++j) face[std::size_t(j)] = mesh.tets[std::size_t(e)][std::size_t((k + 1 + j) % 4)];
      std::ranges::sort(face);
      const auto [entry, is_new] = first.try_emplace(face, e);
      if (!is_new) parent[std::size_t(root(e))] = root(entry->second);
    }
  std::set<int> roots;
  for (int e = 0; e < mesh.tet_count(); ++e) roots.insert(root(e));
  return roots.size();
}

TEST(TetMeshing, KeepsLeavesThatAreThinnerThanTheElements) {
  const TriangleMesh surface = plant_surface();
  ASSERT_TRUE(examine(surface).is_closed_solid);
  TetMeshOptions options;
  for (const double cells : {8.0, 12.0}) {
    options.cell_size = default_tet_size(surface, cells);
    ASSERT_GT(options.cell_size, 4.0 * 2.0 * leaf_half_thickness) << "or nothing is shown";
    const TetMesh mesh = make_tet_mesh(surface, options);
    EXPECT_EQ(parts(mesh), 1u) << cells;
    EXPECT_NEAR(mesh.volume() / enclosed_volume(surface), 1.0, 0.01) << cells;
    double farthest = 0.0;
    for (const Vector3& v : surface.vertices) {
      const TetPoint at = mesh.locate(v);
      Barycentric inside = at.barycentric.cwiseMax(0.0);
      inside /= inside.sum();
      Vector3 nearest = Vector3::Zero();
      for (int k = 0; k < 4; ++k)
        nearest += inside[k] * mesh.nodes.row(mesh.tets[std::size_t(at.tet)][std::size_t(k)]).transpose();
      farthest = std::max(farthest, (v - nearest).norm());
    }
    EXPECT_LT(farthest, 0.3 * options.cell_size) << cells;
  }
}

TEST(TetMeshing, ThickBodiesHaveTheElementsThatWereAskedFor) {
  TetMeshOptions options;
  const TriangleMesh box = make_box(Vector3(0.3, 0.1, 0.1), 0.01);
  options.cell_size = default_tet_size(box, 12.0);
  const TetMesh mesh = make_tet_mesh(box, options);
  EXPECT_NEAR(mesh.volume() / enclosed_volume(box), 1.0, 1e-6);
  double sum = 0.0;
  for (const auto& tet : mesh.tets)
    for (int a = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b)
        sum += (mesh.nodes.row(tet[std::size_t(a)]) - mesh.nodes.row(tet[std::size_t(b)])).norm();
  EXPECT_NEAR(sum / (6.0 * mesh.tet_count()) / options.cell_size, 0.9, 0.2);
}

/// A round bar along x from 0, with flat ends.
TriangleMesh round_bar(double radius, double length) {
  constexpr int around = 48, along = 160;
  TriangleMesh bar;
  for (int i = 0; i <= along; ++i)
    for (int j = 0; j < around; ++j) {
      const double angle = 2.0 * std::numbers::pi * j / around;
      bar.vertices.emplace_back(length * i / along, radius * std::cos(angle), radius * std::sin(angle));
    }
  const int low = int(bar.vertices.size()), high = low + 1;
  bar.vertices.emplace_back(0.0, 0.0, 0.0);
  bar.vertices.emplace_back(length, 0.0, 0.0);
  for (int j = 0; j < around; ++j) {
    const int next = (j + 1) % around, end = along * around;
    bar.triangles.push_back({low, next, j});
    bar.triangles.push_back({high, end + j, end + next});
    for (int i = 0; i < along; ++i) {
      const int a = i * around + j, b = i * around + next, c = a + around, d = b + around;
      bar.triangles.push_back({a, b, d});
      bar.triangles.push_back({a, d, c});
    }
  }
  return bar;
}

/// Elements are three times as wide as the bar is thick: cross-sections are polygons of five or six corners, which cut
/// off a seventh of the area and a third of the bending stiffness where the corners lie on the scan.
TEST(TetMeshing, RoundBarsSwingAsTheorySaysHoweverCoarseTheElements) {
  constexpr double radius = 0.007, length = 0.3, clamped = 0.03, modulus = 1e6, density = 1000.0;
  const TriangleMesh surface = round_bar(radius, length);
  ASSERT_TRUE(examine(surface).is_closed_solid);
  // Euler and Bernoulli's first root; of the slender bar's frequency shear takes less than half a hundredth.
  const double theory = std::pow(1.8751040687 / (length - clamped), 2) * std::sqrt(modulus / density) * radius / 2.0;
  for (const double cells : {6.0, 10.0, 15.0}) {
    TetMeshOptions options;
    options.cell_size = default_tet_size(surface, cells);
    options.quadratic = true;
    options.parts = {[](const Vector3& p) { return p.x() <= clamped; }};
    const auto body = std::make_shared<const Body>(make_body(make_tet_mesh(surface, options)));
    const MotionLayout layout;
    VectorX theta = layout.zero();
    theta[layout.youngs_moduli[0]] = modulus;
    theta[layout.poissons_ratio] = 0.3;
    theta[layout.density] = density;
    std::vector<int> held;
    for (int n = 0; n < body->node_count(); ++n)
      if (body->nodes(n, 0) < clamped + 1e-6) held.push_back(n);
    ModalAnalysis analysis(body, layout, held);
    const Modes modes = analysis.lowest(theta, 2);
    ASSERT_TRUE(modes.converged) << modes.failure;
    for (int mode = 0; mode < 2; ++mode)
      EXPECT_NEAR(std::sqrt(modes.squared_frequencies[mode]) / theory, 1.0, 0.01) << cells << " cells, mode " << mode;
  }
}

}  // namespace
}  // namespace pliant::tet_meshing_test
