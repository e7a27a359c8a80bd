#include "geometry/surface_distance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "geometry/meshes.hpp"

namespace pliant::surface_distance_test {
namespace {

TEST(SurfaceDistance, IsThatToFacesEdgesAndCorners) {
  const TriangleMesh box = test::box_mesh({0, 0, 0}, {1, 2, 3});
  const std::vector<Vector3> points = {{0.5, 1.0, 3.25}, {0.5, 1.0, 1.6}, {-3.0, 1.0, 7.0},
                                       {2.0, 4.0, 5.0},  {1.0, 0.7, 2.9}, {100.0, 1.0, 1.0}};
  const std::vector<double> expected = {0.25, 0.5, 5.0, 3.0, 0.0, 99.0};
  const std::vector<double> distances = distances_to_surface(box, points);
  ASSERT_EQ(distances.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(distances[i], expected[i], 1e-12) << i;
}

TEST(SurfaceDistance, IsTheLeastOfAllTriangles) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-1.0, 1.0);
  const auto point = [&] { return Vector3(anywhere(random), anywhere(random), anywhere(random)); };
  TriangleMesh mesh;
  for (int t = 0; t < 60; ++t) {
    for (int corner = 0; corner < 3; ++corner) mesh.vertices.push_back(point());
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  mesh.vertices[2] = mesh.vertices[1] = mesh.vertices[0];        // a point
  mesh.vertices[5] = 2.0 * mesh.vertices[4] - mesh.vertices[3];  // a segment
  std::vector<Vector3> points;
  for (int i = 0; i < 100; ++i) points.push_back(2.0 * point());
  points.push_back(mesh.vertices[0]);
  const std::vector<double> distances = distances_to_surface(mesh, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    double least = 1e300;
    for (const auto& [a, b, c] : mesh.triangles)
      least = std::min(
          least,
          (closest_on_triangle(points[i], mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) - points[i]).norm());
    EXPECT_NEAR(distances[i], least, 1e-14) << i;
  }
}

TEST(SurfaceDistance, NeedsATriangle) {
  EXPECT_THROW((void)distances_to_surface({}, std::vector<Vector3>{{0, 0, 0}}), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::surface_distance_test
