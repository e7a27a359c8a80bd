#include "meshing/level_mesh.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "geometry/mesh_io.hpp"

namespace pliant::level_mesh_test {
namespace {

constexpr double radius = 0.05;

TriangleMesh sphere_of(double spacing) {
  const Vector3 centre(0.001, 0.002, 0.003);
  Box box;
  box.extend(Vector3::Constant(-0.06));
  box.extend(Vector3::Constant(0.06));
  return make_even_level_surface([&](const Vector3& p) { return (p - centre).norm() - radius; }, box, spacing);
}

double volume_error(double spacing) {
  return std::abs(enclosed_volume(sphere_of(spacing)) / (4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3)) - 1.0);
}

TEST(LevelMesh, SphereIsClosedAndItsEdgesAreAsLongAsTheSpacing) {
  constexpr double spacing = 0.004;
  const TriangleMesh mesh = sphere_of(spacing);
  EXPECT_TRUE(examine(mesh).is_closed_solid);
  EXPECT_GT(enclosed_volume(mesh), 0.0) << "outward oriented";
  double sum = 0.0;
  for (const auto& t : mesh.triangles)
    sum += (mesh.vertices[std::size_t(t[0])] - mesh.vertices[std::size_t(t[1])]).norm();
  EXPECT_NEAR(sum / double(mesh.triangles.size()) / spacing, 1.0, 0.25);
}

TEST(LevelMesh, VolumeConvergesWithTheSquareOfTheSpacing) {
  const double order = std::log2(volume_error(0.008) / volume_error(0.004));
  EXPECT_NEAR(order, 2.0, 0.5);
}

TEST(LevelMesh, NothingInsideGivesNoTriangles) {
  Box box;
  box.extend(Vector3::Zero());
  box.extend(Vector3::Ones());
  EXPECT_TRUE(make_even_level_surface([](const Vector3&) { return 1.0; }, box, 0.2).triangles.empty());
  EXPECT_THROW((void)make_even_level_surface([](const Vector3&) { return 1.0; }, box, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::level_mesh_test
