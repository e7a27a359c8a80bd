// A ground that nobody sees, and friction that nobody stated, are found from the motion of what falls on it.
#include <gtest/gtest.h>

#include <numbers>

#include "support/dropped.hpp"

namespace pliant::hidden_ground_test {
namespace {

TEST(HiddenGround, IsFoundFromTenDegreesAndThirtyMillimetresOff) {
  const test::Dropped dropped;
  RecordedCapture recorded = dropped.record();
  Plane& ground = recorded.capture.scene.planes.front();
  const Vector3 axis = dropped.normal.cross(Vector3::UnitZ()).normalized();
  ground.normal = Eigen::AngleAxisd(10.0 * std::numbers::pi / 180.0, axis) * dropped.normal;
  ground.point = -0.03 * ground.normal;
  ground.known = ground.knows_friction = false;
  ground.friction = 0.0;
  const FitOutcome outcome = fit({recorded}, test::six_cells());
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  const PlaneBlock& found = outcome.recordings.front().discretisation.simulation.blocks.planes.front();
  const Vector3 normal = found.normal.vector(outcome.theta), point = found.point.vector(outcome.theta);
  EXPECT_LT(std::acos(normal.dot(dropped.normal)) * 180.0 / std::numbers::pi, 2.0);
  EXPECT_LT(std::abs(normal.dot(point)), 5e-3) << "beside the truth's point, the origin";
  EXPECT_NEAR(outcome.theta[found.friction], dropped.friction, 0.1);
  EXPECT_NEAR(test::value(outcome, "youngs_modulus"), dropped.youngs_modulus, 0.15 * dropped.youngs_modulus);
}

TEST(Friction, IsEstimatedWhereNobodyStatedIt) {
  const test::Dropped dropped;
  RecordedCapture recorded = dropped.record();
  const auto friction = [&] {
    const CaptureParameters p = default_parameters(recorded.capture, 1e-3);
    return *p.set.find("friction");
  };
  const auto begins_at = [&] {
    const CaptureParameters p = default_parameters(recorded.capture, 1e-3);
    return p.set.reference()[p.blocks.motion.planes.front().friction];
  };
  EXPECT_FALSE(friction().estimated);
  EXPECT_EQ(begins_at(), dropped.friction);
  recorded.capture.scene.planes.front().knows_friction = false;
  EXPECT_TRUE(friction().estimated);
  EXPECT_EQ(friction().prior_mean[0], begins_at());
  EXPECT_GT(begins_at(), 0.0) << "where nothing rubs what tumbles goes another way";
  recorded.capture.scene.timing.is_static = true;
  EXPECT_FALSE(friction().estimated) << "at rest it does not show";
}

}  // namespace
}  // namespace pliant::hidden_ground_test
