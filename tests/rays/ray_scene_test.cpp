#include "rays/ray_scene.hpp"

#include <cmath>
#include <numbers>

#include "capture/capture.hpp"
#include "geometry/primitives.hpp"

namespace pliant::ray_scene_test {
namespace {

constexpr double single_precision = 2e-6;  // relative; depths are kept as float

PinholeCamera looking_down_z(int width, int height, double f) {
  return {width, height, f, f, (width - 1) / 2.0, (height - 1) / 2.0, {}};
}

TriangleMesh moved(TriangleMesh mesh, const Vector3& shift) {
  for (Vector3& vertex : mesh.vertices) vertex += shift;
  return mesh;
}

TEST(RayScene, DepthOfATiltedSquareIsThatOfItsPlane) {
  // plane n.x = d seen by a turned and shifted camera; depth along the axis, not along the ray
  const Vector3 normal = Vector3(0.3, -0.2, -1.0).normalized(), point(0.1, 0.0, 2.0);
  const Vector3 a = normal.unitOrthogonal(), b = normal.cross(a);
  Points corners(4, 3);
  corners << (point - 9 * a - 9 * b).transpose(), (point + 9 * a - 9 * b).transpose(),
      (point + 9 * a + 9 * b).transpose(), (point - 9 * a + 9 * b).transpose();
  RayScene scene;
  scene.add(corners, std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}});
  PinholeCamera camera = looking_down_z(33, 25, 40.0);
  camera.camera_to_world.rotation = Eigen::AngleAxisd(0.2, Vector3(1, 2, -1).normalized()).toRotationMatrix();
  camera.camera_to_world.translation = {0.05, -0.02, 0.3};

  const DepthRender image = scene.render_depth(camera);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Vector3 direction = camera.unproject(u, v, 1.0) - camera.camera_to_world.translation;
      const double expected = normal.dot(point - camera.camera_to_world.translation) / normal.dot(direction);
      ASSERT_GT(expected, 0.0);
      EXPECT_NEAR(image.depth[image.at(u, v)], expected, single_precision * expected);
      EXPECT_NEAR(image.cosine[image.at(u, v)], -normal.dot(direction.normalized()), 1e-6);
      EXPECT_EQ(image.mesh[image.at(u, v)], 0);
    }
}

TEST(RayScene, NearestOfSeveralMeshesWinsAndMovesWithItsVertices) {
  RayScene scene;
  const TriangleMesh near = moved(make_sphere(0.1, 3), {0, 0, 1}), far = moved(make_sphere(0.4, 3), {0, 0, 2});
  EXPECT_EQ(scene.add(near), 0);
  EXPECT_EQ(scene.add(far), 1);
  const PinholeCamera camera = looking_down_z(81, 61, 100.0);
  const DepthRender first = scene.render_depth(camera);
  const int centre = first.at(40, 30);
  EXPECT_EQ(first.mesh[centre], 0);
  EXPECT_NEAR(first.depth[centre], 0.9, 2e-3);
  EXPECT_EQ(first.mesh[first.at(40, 14)], 1);
  EXPECT_EQ(first.depth[first.at(0, 0)], 0.0f);
  EXPECT_EQ(first.triangle[first.at(0, 0)], -1);

  scene.set_vertices(0, vertex_points(moved(near, {0, 0, 5})));
  const DepthRender second = scene.render_depth(camera);
  EXPECT_EQ(second.mesh[centre], 1);
  EXPECT_NEAR(second.depth[centre], 1.6, 2e-3);
}

TEST(RayScene, SeenAreaApproachesThatOfASphereAndFromInsideTheCosineIsNegative) {
  RayScene scene;
  scene.add(moved(make_sphere(0.5, 5), {0, 0, 3}));
  const PinholeCamera camera = looking_down_z(301, 301, 800.0);
  const DepthRender image = scene.render_depth(camera);
  int seen = 0;
  for (const int mesh : image.mesh) seen += mesh == 0;
  const double tangent = 0.5 / std::sqrt(9.0 - 0.25);
  EXPECT_NEAR(seen, std::numbers::pi * std::pow(800.0 * tangent, 2), 0.003 * seen);

  PinholeCamera inside = camera;
  inside.camera_to_world.translation = {0, 0, 3};
  const DepthRender within = scene.render_depth(inside);
  EXPECT_NEAR(within.depth[within.at(150, 150)], 0.5, 1e-3);
  EXPECT_LT(within.cosine[within.at(150, 150)], -0.99f);
}

TEST(RayScene, OffsetsMoveTheRayByPartsOfAPixel) {
  RayScene scene;
  scene.add(moved(make_sphere(0.5, 4), {0, 0, 2}));
  PinholeCamera camera = looking_down_z(41, 31, 60.0);
  const DepthRender shifted = scene.render_depth(camera, [](int, int) { return Eigen::Vector2d(0.25, -0.5); });
  camera.cx -= 0.25, camera.cy += 0.5;
  EXPECT_EQ(shifted.depth, scene.render_depth(camera).depth);
}

TEST(RayScene, RepeatedRendersAgreeBitByBit) {
  const auto render = [] {
    RayScene scene;
    scene.add(moved(make_torus(0.3, 0.1, 96, 48), {0, 0, 1}));
    return scene.render_depth(looking_down_z(160, 120, 150.0));
  };
  const DepthRender a = render(), b = render();
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.triangle, b.triangle);
}

TEST(RayScene, CastKnowsWhereOnTheTriangleItHit) {
  RayScene scene;
  Points corners(3, 3);
  corners << 0, 0, 1, 1, 0, 1, 0, 1, 1;
  scene.add(corners, std::vector<std::array<int, 3>>{{0, 1, 2}});
  const auto hit = scene.cast({0.2, 0.3, 0.0}, {0, 0, 1});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->u, 0.2, 1e-6);
  EXPECT_NEAR(hit->v, 0.3, 1e-6);
  EXPECT_NEAR(hit->distance, 1.0, 1e-12);
  EXPECT_FALSE(scene.cast({0.2, 0.3, 0.0}, {0, 0, -1}));
  EXPECT_FALSE(scene.cast({0.9, 0.9, 0.0}, {0, 0, 1}));
  EXPECT_TRUE(scene.is_blocked({0.2, 0.3, 0.0}, {0, 0, 1}, 0.0, 2.0));
  EXPECT_FALSE(scene.is_blocked({0.2, 0.3, 0.0}, {0, 0, 1}, 0.0, 0.5));
}

TEST(RayScene, RefusesTrianglesWithoutVerticesAndOtherNumbersOfVertices) {
  RayScene scene;
  EXPECT_THROW(scene.add(Points::Zero(2, 3), std::vector<std::array<int, 3>>{{0, 1, 2}}), std::invalid_argument);
  scene.add(make_sphere(1.0, 0));
  EXPECT_THROW(scene.set_vertices(0, Points::Zero(3, 3)), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::ray_scene_test
