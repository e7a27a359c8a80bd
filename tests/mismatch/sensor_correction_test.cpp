#include "mismatch/sensor_correction.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <stdexcept>

#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::sensor_correction_test {
namespace {

using test::tolerance;

const Vector3 centre(0.1, -0.2, 0.3), point(0.4, 0.1, -0.2), view = Vector3(1, 2, -2).normalized();
const Sight sight{view, 0.9, Vector3(0.1, -0.3, 0.2)};

SensorCorrection::Values somewhere(double turn = 1.0) {
  SensorCorrection::Values values;
  values << 0.03, 0.2 * turn, -0.1 * turn, 0.3 * turn, 0.01, -0.02, 0.015, 0.02, -0.03;
  return values;
}

/// A rigid motion alone.
SensorCorrection::Values pose() {
  SensorCorrection::Values values = somewhere();
  values[0] = values[7] = values[8] = 0.0;
  return values;
}

/// A camera that looks somewhere.
PinholeCamera camera() {
  PinholeCamera camera{320, 240, 280.0, 290.0, 159.5, 119.5, {}};
  camera.camera_to_world.rotation = Eigen::AngleAxisd(0.7, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
  camera.camera_to_world.translation = Vector3(0.3, -0.1, 0.2);
  return camera;
}

TEST(SensorCorrection, NothingToCorrectChangesNothing) {
  const SensorCorrection none(centre, SensorCorrection::Values::Zero());
  EXPECT_LT((none.apply(point, sight) - point).norm(), tolerance(1e-16));
}

TEST(SensorCorrection, ShortensTheRangeAndMovesRigidly) {
  SensorCorrection::Values range = SensorCorrection::Values::Zero();
  range[0] = 0.02;
  EXPECT_LT((SensorCorrection(centre, range).apply(point, sight) - (point - 0.02 * view)).norm(), tolerance(1e-15));
  const SensorCorrection moved(centre, pose());
  EXPECT_NEAR((moved.apply(point, sight) - moved.apply(centre, sight)).norm(), (point - centre).norm(),
              tolerance(1e-14));
  EXPECT_LT((moved.apply(centre, sight) - centre - pose().segment<3>(4)).norm(), tolerance(1e-15))
      << "it turns about the centre";
}

/// Readings a share of which is too long, and a focal length that is stated too long by a share, put points where the
/// correction brings them back from.
TEST(SensorCorrection, BringsBackWhatReadingsOfACameraErrBy) {
  constexpr double u = 40.0, v = 210.0, depth = 1.2;
  const PinholeCamera right = camera();
  const Vector3 truth = right.unproject(u, v, depth);
  const auto left_of = [&](double share, int value) {
    PinholeCamera stated = right;
    if (value == 8) stated.fx *= 1.0 + share, stated.fy *= 1.0 + share;
    const Vector3 read = stated.unproject(u, v, value == 7 ? depth / (1.0 - share) : depth);
    const SensorCorrection correction(centre, share * SensorCorrection::Values::Unit(value));
    EXPECT_GT((read - truth).norm(), 0.3 * std::abs(share)) << value;
    return (correction.apply(read, sight_of(stated, read)) - truth).norm();
  };
  for (const int value : {7, 8})
    for (const double share : {1e-3, -0.05}) EXPECT_LT(left_of(share, value), tolerance(1e-14)) << value;
}

class AtTurn : public ::testing::TestWithParam<double> {};

TEST_P(AtTurn, JacobianMatchesCentralDifferences) {
  const SensorCorrection::Values at = somewhere(GetParam());
  const SensorCorrection::Jacobian J = SensorCorrection(centre, at).jacobian(point, sight);
  for (int i = 0; i < SensorCorrection::size; ++i) {
    const auto along = [&](double h) -> VectorX {
      return SensorCorrection(centre, at + h * SensorCorrection::Values::Unit(i)).apply(point, sight);
    };
    EXPECT_LT(test::best_relative_error(along, VectorX(J.col(i)), 0.1), tolerance(1e-8)) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(FromNoneToALot, AtTurn, ::testing::Values(0.0, 1e-5, 1e-3, 1.0, 5.0));

struct TwoSensors : ::testing::Test {
  ParameterLayout layout;
  SensorBlocks left = add_sensor_blocks(layout, "left"), right = add_sensor_blocks(layout, "right");
};

TEST_F(TwoSensors, HaveBlocksOfTheirOwn) {
  EXPECT_EQ(layout.size(), 2 * SensorCorrection::size);
  EXPECT_EQ(right.error, layout.at("range_error@right"));
  EXPECT_EQ(right.turn, layout.at("sensor_turn@right"));
  EXPECT_EQ(right.shift, layout.at("sensor_shift@right"));
  EXPECT_EQ(right.range_scale, layout.at("range_scale@right"));
  EXPECT_EQ(right.focal_error, layout.at("focal_error@right"));
  for (const ParameterHandle& block : left.all()) EXPECT_EQ(layout.block_of(block).role, Role::Sensor);
  EXPECT_THROW(add_sensor_blocks(layout, "left"), std::invalid_argument);
}

TEST_F(TwoSensors, ReadAndAddTheirValuesInTheOrderOfTheCorrection) {
  VectorX theta = VectorX::Zero(layout.size());
  right.add(somewhere(), theta);
  right.add(somewhere(), theta);
  EXPECT_EQ(right.values(theta), 2.0 * somewhere());
  EXPECT_EQ(left.values(theta), SensorCorrection::Values::Zero());
  EXPECT_EQ(theta[layout.at("range_error@right")], 2.0 * somewhere()[0]);
  EXPECT_EQ(right.rows(theta), theta.tail(SensorCorrection::size)) << "rows of a matrix likewise";
}

TEST_F(TwoSensors, MoveWithTheirLayout) {
  ParameterLayout after;
  after.add({"before", "1", 5});
  const SensorBlocks expected = add_sensor_blocks(after, "left");
  const SensorBlocks moved = left.moved([](const ParameterHandle& handle) {
    return ParameterHandle{handle.first + 5, handle.size};
  });
  EXPECT_EQ(moved.all(), expected.all());
}

}  // namespace
}  // namespace pliant::sensor_correction_test
