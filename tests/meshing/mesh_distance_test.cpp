#include "meshing/mesh_distance.hpp"

#include <random>

#include "base/error.hpp"
#include "geometry/primitives.hpp"
#include "support/bodies.hpp"
#include "support/convergence.hpp"
#include "support/tolerance.hpp"

namespace pliant::mesh_distance_test {
namespace {

using test::tolerance;

std::vector<Vector3> points_around(double reach, int count) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-reach, reach);
  std::vector<Vector3> points;
  for (int n = 0; n < count; ++n) points.emplace_back(uniform(random), uniform(random), uniform(random));
  return points;
}

/// A ball with a cavity that is not in its middle: solid between the two spheres, hollow within the inner one.
TEST(SignedDistance, OfAHollowBallIsPositiveInItsCavity) {
  const double outer = 0.1, inner = 0.04, spacing = 0.005;
  const Vector3 middle(0.02, 0.01, 0.0);
  TriangleMesh mesh = make_sphere(outer, 4);
  const TriangleMesh cavity = make_sphere(inner, 4);
  const int first = int(mesh.vertices.size());
  for (const Vector3& v : cavity.vertices) mesh.vertices.push_back(v + middle);
  for (const auto& [a, b, c] : cavity.triangles) mesh.triangles.push_back({first + a, first + c, first + b});
  const SignedDistance distance = signed_distance(mesh, spacing, 0.05);
  for (const Vector3& p : points_around(0.12, 2000)) {
    const double exact = std::max(p.norm() - outer, inner - (p - middle).norm());
    if (std::abs(exact) > 3.0 * spacing) continue;  // farther away it is the closest triangle of a few
    EXPECT_NEAR(distance.value(p), exact, 0.1 * spacing);
  }
}

TEST(SignedDistance, OfAMeshSphereIsThatOfTheSphere) {
  const double radius = 0.1, spacing = 0.005, margin = 0.05;
  const TriangleMesh mesh = make_sphere(radius, 4);
  const SignedDistance distance = signed_distance(mesh, spacing, margin);
  // The middles of facets lie edge^2 / (6 radius) inside the sphere; the interpolant errs by spacing^2 / (4 |p|).
  const double edge = radius * 1.2 / 16, allowed = edge * edge / (6 * radius) + spacing * spacing / (4 * 0.9 * radius);
  // Farther away OpenVDB carries the closest triangle from point to point and now and then misses a closer one.
  const double far = spacing, allowed_far = 0.4 * spacing, allowed_mean = 0.03 * spacing;
  int inside = 0, checked = 0;
  double sum = 0.0, aligned = 0.0;
  for (const Vector3& p : points_around(0.14, 2000)) {
    const double exact = p.norm() - radius;
    if (std::abs(exact) > 0.9 * margin) continue;
    ++checked;
    inside += exact < 0.0;
    const SignedDistance::Sample sample = distance.sample(p);
    EXPECT_NEAR(sample.value, exact, tolerance(std::abs(exact) > far ? allowed_far : allowed));
    EXPECT_GT(sample.gradient.dot(p.normalized()), 0.8);
    sum += std::abs(sample.value - exact);
    aligned += sample.gradient.dot(p.normalized());
  }
  EXPECT_LT(sum / checked, tolerance(allowed_mean));
  EXPECT_NEAR(aligned / checked, 1.0, tolerance(5e-3));
  EXPECT_GT(inside, 50);
  EXPECT_GT(checked - inside, 50);
}

TEST(SignedDistance, SharpCornersOfABox) {
  const SignedDistance distance = signed_distance(make_box(Vector3(0.1, 0.06, 0.08), 0.02), 0.005, 0.03);
  EXPECT_NEAR(distance.value(Vector3(0.06, 0.0, 0.0)), 0.01, tolerance(1e-6));
  EXPECT_NEAR(distance.value(Vector3(0.0, 0.02, 0.0)), -0.01, tolerance(1e-6));
  EXPECT_NEAR(distance.value(Vector3(0.06, 0.04, 0.05)), std::sqrt(3.0) * 0.01, tolerance(2e-4));
}

TEST(SignedDistance, GradientMatchesCentralDifferencesInsideAndBeyondTheGrid) {
  const double spacing = 0.02;
  const SignedDistance distance = test::sphere_distance(0.1, spacing, 0.04);
  int beyond = 0, within = 0;
  for (const Vector3& p : points_around(0.2, 300)) {
    const Vector3 cell = (p - distance.box().min) / spacing;
    const double h = 1e-6;
    if (((cell.array() - cell.array().round()).abs() < 2 * h / spacing).any()) continue;  // the gradient jumps there
    (p.cwiseAbs().maxCoeff() > 0.14 ? beyond : within) += 1;
    const Vector3 gradient = distance.sample(p).gradient;
    for (int d = 0; d < 3; ++d) {
      const double difference =
          (distance.value(p + h * Vector3::Unit(d)) - distance.value(p - h * Vector3::Unit(d))) / (2 * h);
      EXPECT_NEAR(gradient[d], difference, tolerance(1e-6)) << p.transpose();
    }
  }
  EXPECT_GT(beyond, 50);
  EXPECT_GT(within, 50);
}

TEST(SignedDistance, InterpolantConvergesWithSecondOrder) {
  const std::vector<double> spacings = {0.04, 0.02, 0.01};
  std::vector<double> errors;
  for (const double spacing : spacings) {
    const SignedDistance distance = test::sphere_distance(0.1, spacing, 0.04);
    double sum = 0.0;
    for (const Vector3& p : points_around(0.12, 500))
      if (p.norm() > 0.05) sum += std::abs(distance.value(p) - (p.norm() - 0.1));
    errors.push_back(sum);
  }
  const double order = test::fitted_order(spacings, errors);
  EXPECT_GT(order, 1.7);
  EXPECT_LT(order, 2.3);
}

TEST(SignedDistance, KeepsGrowingBeyondItsGrid) {
  const SignedDistance distance = test::sphere_distance(0.1, 0.02, 0.04);
  double last = 0.0;
  for (const double reach : {0.13, 0.2, 0.5, 2.0}) {
    const double value = distance.value(reach * Vector3(1, 1, 0.5).normalized());
    EXPECT_GT(value, last);
    last = value;
  }
}

TEST(SignedDistance, RefusesASurfaceThatEnclosesNothing) {
  // Between the grid's points, which lie beside the mesh's corner.
  EXPECT_THROW(signed_distance(make_sphere(0.003, 1), 0.01, 0.02), InputError);
}

TEST(SignedDistance, OfASurfaceFartherOutIsLessByAsMuch) {
  const SignedDistance distance = signed_distance(make_sphere(0.1, 4), 0.005, 0.05);
  const auto offset = [](const Vector3& p) { return 0.001 + 0.002 * p.x() / 0.1; };
  const SignedDistance outwards = distance.offset_by(offset);
  EXPECT_EQ(outwards.box().min, distance.box().min);
  EXPECT_EQ(outwards.box().max, distance.box().max);
  for (const Vector3& p : points_around(0.11, 500))
    if (std::abs(p.norm() - 0.1) < 0.01) {
      EXPECT_NEAR(distance.value(p) - outwards.value(p), offset(p), 2e-7);
    }
}

TEST(SignedDistance, OffsetIsThatOfAGreaterBall) {
  constexpr double more = 1e-3, spacing = 0.005;
  constexpr double of_grid =
      spacing * spacing / 4.0 / 0.09;  // what interpolation loses where the curvatures are 1/0.09
  const SignedDistance greater = signed_distance(make_sphere(0.1 + more, 4), spacing, 0.05);
  const SignedDistance moved =
      signed_distance(make_sphere(0.1, 4), spacing, 0.05).offset_by([](const Vector3&) { return more; });
  for (const Vector3& p : points_around(0.11, 500))
    if (std::abs(p.norm() - 0.1) < 0.01) {
      EXPECT_NEAR(moved.value(p), greater.value(p), of_grid);
    }
}

}  // namespace
}  // namespace pliant::mesh_distance_test
