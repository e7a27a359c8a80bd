#include "capture/plane_fit.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

namespace pliant::plane_fit_test {
namespace {

struct Scene {
  std::vector<Vector3> points;
  std::vector<float> noise;
};

const Vector3 true_normal = Vector3(1, 2, -3).normalized(), true_point(0.3, -0.2, 1.1);

// A plane with noise, and a share of points anywhere in a cube of 1 m.
Scene noisy_plane(int count, double sigma, double outliers) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  const Vector3 a = true_normal.unitOrthogonal(), b = true_normal.cross(a);
  Scene scene;
  for (int i = 0; i < count; ++i) {
    const bool is_outlier = i < outliers * count;
    scene.points.push_back(is_outlier ? Vector3(true_point + Vector3(uniform(random), uniform(random), uniform(random)))
                                      : Vector3(true_point + uniform(random) * a + uniform(random) * b +
                                                sigma * normal(random) * true_normal));
    scene.noise.push_back(float(sigma));
  }
  return scene;
}

double angle_between(const Vector3& a, const Vector3& b) { return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))); }

TEST(FitPlane, FindsAPlaneAmongHalfOutliers) {
  const Scene scene = noisy_plane(4000, 0.002, 0.5);
  const auto plane = fit_plane(scene.points, scene.noise);
  ASSERT_TRUE(plane);
  // Slope error of n points over a side L: sigma sqrt(12 / n) / L = 0.15 mrad; four of these.
  EXPECT_LT(angle_between(plane->normal, true_normal), 0.6e-3);
  EXPECT_NEAR(plane->height(true_point), 0.0, 4 * 0.002 / std::sqrt(2000));
  EXPECT_NEAR(plane->rms, 0.002, 0.0002);
  EXPECT_NEAR(plane->inliers, 2000, 60);
}

TEST(FitPlane, IsTheSameEveryTime) {
  const Scene scene = noisy_plane(1000, 0.002, 0.3);
  const auto one = fit_plane(scene.points, scene.noise), two = fit_plane(scene.points, scene.noise);
  EXPECT_EQ(one->normal, two->normal);
  EXPECT_EQ(one->point, two->point);
}

TEST(FitPlane, KeepsToTheGivenDirection) {
  const Scene scene = noisy_plane(1000, 0.002, 0.1);
  PlaneFitOptions options;
  options.normal = -true_normal;
  const auto plane = fit_plane(scene.points, scene.noise, options);
  ASSERT_TRUE(plane);
  EXPECT_GT(plane->normal.dot(-true_normal), 0.999);
  options.normal = true_normal.unitOrthogonal();
  const auto other = fit_plane(scene.points, scene.noise, options);
  EXPECT_TRUE(!other || other->inliers < 200) << "the plane itself is at 90 degrees to what was asked for";
}

TEST(FitPlane, FindsNothingInALineOrInTwoPoints) {
  std::vector<Vector3> line;
  for (int i = 0; i < 100; ++i) line.emplace_back(0.01 * i, 0, 0);
  EXPECT_FALSE(fit_plane(line, std::vector<float>(100, 0.001f)));
  EXPECT_FALSE(fit_plane(std::span(line).first(2), std::vector<float>(2, 0.001f)));
}

}  // namespace
}  // namespace pliant::plane_fit_test
