#include "rays/look_at.hpp"

#include <numbers>

#include "capture/capture.hpp"

namespace pliant::look_at_test {
namespace {

const Vector3 eye(0.3, 0.8, 1.1), target(-0.1, 0.2, 0.05);

TEST(LookAt, TargetIsInTheMiddleAndUpIsUp) {
  const PinholeCamera camera = look_at(eye, target, Vector3::UnitY(), 640, 480, 0.7);
  const Vector3 seen = camera.project(target), above = camera.project(target + Vector3(0, 0.01, 0));
  EXPECT_NEAR(seen.x(), 319.5, 1e-9);
  EXPECT_NEAR(seen.y(), 239.5, 1e-9);
  EXPECT_NEAR(seen.z(), (eye - target).norm(), 1e-12);
  EXPECT_NEAR(above.x(), 319.5, 1e-9);
  EXPECT_LT(above.y(), 239.0);  // image rows count downwards
}

TEST(LookAt, IsARotationAndHasTheFieldOfView) {
  const PinholeCamera camera = look_at(eye, target, Vector3(0.1, 1, 0), 640, 480, 0.7);
  const Matrix3& r = camera.camera_to_world.rotation;
  EXPECT_LT((r * r.transpose() - Matrix3::Identity()).norm(), 1e-14);
  EXPECT_NEAR(r.determinant(), 1.0, 1e-14);
  const Vector3 top = camera.unproject(319.5, -0.5, 1.0) - eye, bottom = camera.unproject(319.5, 479.5, 1.0) - eye;
  EXPECT_NEAR(std::acos(top.normalized().dot(bottom.normalized())), 0.7, 1e-12);
}

TEST(LookAt, RefusesViewsWithoutADirection) {
  EXPECT_THROW(look_at(eye, eye, Vector3::UnitY(), 64, 48, 0.7), std::invalid_argument);
  EXPECT_THROW(look_at({0, 1, 0}, {0, 0, 0}, Vector3::UnitY(), 64, 48, 0.7), std::invalid_argument);
  EXPECT_THROW(look_at(eye, target, Vector3::UnitY(), 64, 48, std::numbers::pi), std::invalid_argument);
  EXPECT_THROW(look_at(eye, target, Vector3::UnitY(), 0, 48, 0.7), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::look_at_test
