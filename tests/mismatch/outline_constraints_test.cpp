#include "mismatch/outline_constraints.hpp"

#include <numbers>
#include <random>

#include "geometry/primitives.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::outline_constraints_test {
namespace {

using test::tolerance;

constexpr double pixel_at_object = 2.5e-3;  // [m] of those at the object

PinholeCamera camera_at(const Vector3& eye, const Vector3& target) {
  PinholeCamera camera;
  camera.width = 320, camera.height = 240;
  camera.fx = 300.0, camera.fy = 340.0, camera.cx = 155.0, camera.cy = 124.0;
  const Vector3 forward = (target - eye).normalized(), right = forward.unitOrthogonal();
  camera.camera_to_world.rotation << right, forward.cross(right), forward;
  camera.camera_to_world.translation = eye;
  return camera;
}

/// Where a camera sees a point of the outline that lies along `outwards` from what it bounds.
OutlinePoint seen_point(const PinholeCamera& camera, const Vector3& point, const Vector3& outwards) {
  const Vector2 pixel = camera.project(point).head<2>();
  return {pixel, (camera.project(point + 1e-5 * outwards).head<2>() - pixel).normalized()};
}

/// Rays that pass a ball around the origin by `away`, and its outline's normals.
OutlineObservation around_ball(const PinholeCamera& camera, double radius, double away, int count) {
  OutlineObservation seen{camera, {}, 1e-3, pixel_at_object};
  const Vector3 eye = camera.camera_to_world.translation, axis = -eye.normalized(), u = axis.unitOrthogonal();
  const double angle = std::asin((radius + away) / eye.norm());
  for (int i = 0; i < count; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / count;
    const Vector3 side = std::cos(turn) * u + std::sin(turn) * axis.cross(u);
    const Vector3 ray = std::cos(angle) * axis + std::sin(angle) * side;
    seen.points.push_back(seen_point(camera, eye + ray * eye.norm() * std::cos(angle), side));
  }
  return seen;
}

TEST(OutlineConstraints, RaysPastABallHaveTheirDistanceToIt) {
  const double radius = 0.1;
  const auto body = test::box_body({0.24, 0.24, 0.24}, 0.06);
  const TriangleMesh ball = make_sphere(radius, 5);
  const OutlineConstraints outlines(*body, ball, 0.05, 0.02);
  // Off its axis, so that the outline in the picture is an ellipse.
  const PinholeCamera camera = camera_at({0.5, 0.2, -0.4}, {0.03, -0.02, 0.02});
  for (const double away : {-0.006, -0.001, 0.0, 0.002, 0.01}) {
    const OutlineObservation seen = around_ball(camera, radius, away, 100);
    for (const OutlineMatch& m : outlines.match(seen, body->reference_positions())) {
      ASSERT_TRUE(m.is_found) << away;
      EXPECT_NEAR(m.distance, away, tolerance(6e-5));  // edges of 4 mm lie as far within the ball
      EXPECT_NEAR(m.direction.norm(), 1.0, tolerance(1e-12));
    }
  }
}

TEST(OutlineConstraints, MasksThatReachTooFarAreCorrectedByTheirError) {
  const double radius = 0.1, error = 0.004;
  const auto body = test::box_body({0.24, 0.24, 0.24}, 0.06);
  const OutlineConstraints outlines(*body, make_sphere(radius, 5), 0.05, 0.02);
  PinholeCamera camera = camera_at({0.0, 0.0, -0.8}, Vector3::Zero());
  camera.fy = camera.fx;
  OutlineObservation seen = around_ball(camera, radius, error, 100);
  // What a pixel spans where the ray passes the ball.
  seen.pixel = std::sqrt(0.8 * 0.8 - radius * radius) /
               std::hypot(camera.fx, (seen.points[0].pixel - Vector2(camera.cx, camera.cy)).norm());
  SensorCorrection::Values values = SensorCorrection::Values::Zero();
  values << error, 0.02, -0.01, 0.03, 0.001, -0.002, 0.003;
  const Points X = body->reference_positions();
  const auto distances = [&](const SensorCorrection::Values& at) {
    VectorX all(Eigen::Index(seen.points.size()));
    const auto matches = outlines.match(corrected(seen, SensorCorrection(Vector3::Zero(), at)), X);
    for (Eigen::Index i = 0; i < all.size(); ++i) all[i] = matches[std::size_t(i)].distance;
    return all;
  };
  SensorCorrection::Values alone = SensorCorrection::Values::Zero();
  EXPECT_NEAR(distances(alone).mean(), error, tolerance(1e-4));
  alone[0] = error;
  EXPECT_NEAR(distances(alone).mean(), 0.0, tolerance(1e-4));
  // And its derivative, in the axes of a camera that is corrected too.
  const SensorCorrection correction(Vector3::Zero(), values);
  const auto matches = outlines.match(corrected(seen, correction), X);
  const auto derivative = [&](const SensorCorrection::Values& direction) {
    VectorX change(Eigen::Index(matches.size()));
    for (Eigen::Index i = 0; i < change.size(); ++i) {
      const OutlineMatch& m = matches[std::size_t(i)];
      const Vector3 view = camera.camera_to_world.rotation * m.outwards;
      const Vector3 stated = camera.camera_to_world(m.seen) + error * view;
      change[i] = -m.direction.dot(correction.jacobian(stated, Sight{view}) * direction);
    }
    return change;
  };
  for (int k = 0; k < 7; ++k) {  // the others are of sensors that read a range
    const SensorCorrection::Values direction = SensorCorrection::Values::Unit(k);
    const auto along = [&](double h) { return distances(values + h * direction); };
    EXPECT_LT(test::best_relative_error(along, derivative(direction), 1e-3), tolerance(1e-5)) << k;
  }
}

TEST(OutlineConstraints, ABallThatMovesAcrossTheViewMovesItsOutlineAlongTheNormal) {
  const double radius = 0.1;
  const auto body = test::box_body({0.24, 0.24, 0.24}, 0.06);
  const OutlineConstraints outlines(*body, make_sphere(radius, 5), 0.05, 0.02);
  const PinholeCamera camera = camera_at({0.0, 0.0, -0.8}, Vector3::Zero());
  const OutlineObservation seen = around_ball(camera, radius, 0.0, 60);
  const Vector3 moved(0.003, -0.002, 0.001);
  const Points direction = moved.transpose().replicate(body->node_count(), 1);
  const MatrixX tangents =
      outlines.tangents(outlines.match(seen, body->reference_positions()), std::span<const Points>(&direction, 1));
  const auto after = outlines.match(seen, body->reference_positions() + direction);
  for (std::size_t i = 0; i < after.size(); ++i) {
    ASSERT_TRUE(after[i].is_found);
    EXPECT_NEAR(after[i].distance, tangents(Eigen::Index(i), 0), tolerance(1.5e-4));  // moved^2 / radius
  }
  EXPECT_GT(tangents.cwiseAbs().maxCoeff(), 0.9 * moved.head<2>().norm());
}

TEST(OutlineConstraints, ContoursBeforeTheObjectItselfAreNotItsOutline) {
  const auto body = test::torus_body(0.1, 0.04, 0.04);
  const TriangleMesh ring = make_torus(0.1, 0.04, 64, 32);
  const OutlineConstraints outlines(*body, ring, 0.02, 0.015);
  // From the side the hole is hidden behind the near part of the ring; from above it is seen through.
  const PinholeCamera side = camera_at({0.0, 0.05, -0.7}, Vector3::Zero()),
                      above = camera_at({0.0, 0.7, 0.0}, Vector3::Zero());
  const OutlineObservation inside{side, {seen_point(side, {0.0, 0.0, 0.06}, {0.0, -1.0, 0.0})}, 1e-3, pixel_at_object};
  EXPECT_FALSE(outlines.match(inside, body->reference_positions())[0].is_found);
  const OutlineObservation through{
      above, {seen_point(above, {0.0, 0.0, 0.06}, {0.0, 0.0, -1.0})}, 1e-3, pixel_at_object};
  EXPECT_TRUE(outlines.match(through, body->reference_positions())[0].is_found);
  // The inner rim faces the hole: a normal that points into the ring is another contour's.
  const OutlineObservation against{
      above, {seen_point(above, {0.0, 0.0, 0.06}, {0.0, 0.0, 1.0})}, 1e-3, pixel_at_object};
  EXPECT_FALSE(outlines.match(against, body->reference_positions())[0].is_found);
}

TEST(OutlineConstraints, TangentMatchesCentralDifferencesAndAdjointTheTangent) {
  const auto body = test::torus_body(0.1, 0.04, 0.04);
  const TriangleMesh ring = make_torus(0.1, 0.04, 60, 30);
  const OutlineConstraints outlines(*body, ring, 0.1, 0.03);
  const Points X = body->reference_positions(), x = X + 0.15 * (test::deformed(X, 0.6, 0.4) - X);
  const Points direction = test::deformed(X, 0.8, 0.5);
  TriangleMesh bent = ring;
  const Embedding embedding(*body, ring.vertices);
  for (int v = 0; v < embedding.point_count(); ++v) bent.vertices[std::size_t(v)] = embedding.position(v, x);
  const std::vector<Vector3> normals = vertex_normals(bent);
  const PinholeCamera camera = camera_at({0.3, 0.6, -0.5}, {0.01, 0.02, 0.0});
  OutlineObservation seen{camera, {}, 1e-3, pixel_at_object};
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const Vector3 view = (bent.vertices[v] - camera.camera_to_world.translation).normalized();
    if (std::abs(view.dot(normals[v])) < 0.1)
      seen.points.push_back(seen_point(camera, bent.vertices[v] + (v % 2 ? 2e-3 : -1e-3) * normals[v], normals[v]));
  }
  seen.points.push_back({{-2000.0, 10.0}, {1.0, 0.0}});  // and one that matches nothing
  const auto matches = outlines.match(seen, x);
  const auto count = Eigen::Index(matches.size());
  const auto found = std::ranges::count_if(matches, &OutlineMatch::is_found);
  ASSERT_GT(found, 50);
  ASSERT_LT(found, count);
  const VectorX tangent = outlines.tangents(matches, {&direction, 1}).col(0);
  EXPECT_EQ(tangent[count - 1], 0.0);
  ASSERT_GT(tangent.norm(), 0.0);
  const auto along = [&](double h) {
    VectorX d = VectorX::Zero(count);
    const auto moved = outlines.match(seen, x + h * direction);
    for (Eigen::Index i = 0; i < count; ++i)
      if (matches[std::size_t(i)].is_found) d[i] = moved[std::size_t(i)].distance;
    return d;
  };
  EXPECT_LT(test::best_relative_error(along, tangent, 1e-3), tolerance(1e-6));
  EXPECT_GT(test::best_relative_error(along, 1.01 * tangent, 1e-3), 1e-3) << "a wrong derivative would pass";
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  VectorX bar(count);
  for (double& b : bar) b = normal(random);
  Points x_bar = Points::Zero(body->node_count(), 3);
  outlines.add_adjoint(matches, bar, x_bar);
  EXPECT_NEAR(bar.dot(tangent), x_bar.cwiseProduct(direction).sum(), tolerance(1e-12) * bar.norm() * tangent.norm());
}

}  // namespace
}  // namespace pliant::outline_constraints_test
