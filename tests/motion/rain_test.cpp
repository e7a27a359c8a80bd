#include "motion/rain.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/primitives.hpp"
#include "support/bodies.hpp"

namespace pliant::rain_test {
namespace {

struct Plate {
  Vector3 size = Vector3(0.4, 0.04, 0.3);
  std::shared_ptr<const Body> body = test::tet_body(size, {4, 1, 3}, false);
  TriangleMesh surface = make_box(size, 0.1);
  MotionLayout layout;
  VectorX theta = layout.zero();
  Points still = Points::Zero(body->node_count(), 3);
  RainOptions options;

  Plate() {
    theta.segment<3>(layout.gravity) = Vector3(0.0, -9.81, 0.0);
    options.rate = 2000.0, options.diameter = 0.003, options.velocity = {1.0, -6.0, 0.5}, options.until = 1.0;
  }
  /// Momentum that steps of dt hand over within a time [kg m/s], the plate in `velocities`.
  Vector3 momentum(Rain& rain, double dt, double seconds, const Points& velocities) {
    Vector3 sum = Vector3::Zero();
    rain.set_parameters(theta);
    for (int step = 0; step * dt < seconds; ++step) {
      rain.begin_step({&body->nodes, &velocities, step * dt, dt});
      Points force = Points::Zero(body->node_count(), 3);
      rain.add_force(body->nodes, force);
      sum += dt * force.colwise().sum().transpose();
    }
    return sum;
  }
};

TEST(Rain, HandsOverTheMomentumOfItsDrops) {
  Plate plate;
  Rain rain(*plate.body, plate.surface, plate.options, plate.layout.gravity);
  const Vector3 sum = plate.momentum(rain, 2e-3, 1.0, plate.still);
  EXPECT_LT((sum - double(rain.hits().size()) * plate.options.drop_mass() * plate.options.velocity).norm(),
            1e-9 * sum.norm());
  // Across the fall the plate covers so much: its count is Poisson's.
  const Vector3 fall = plate.options.velocity.normalized();
  const double area =
      0.4 * 0.3 * std::abs(fall.y()) + 0.04 * 0.3 * std::abs(fall.x()) + 0.4 * 0.04 * std::abs(fall.z());
  const double expected = 2000.0 * area;
  EXPECT_NEAR(double(rain.hits().size()), expected, 4.0 * std::sqrt(expected));
}

TEST(Rain, HitsTheSameDropsWhateverTheStep) {
  Plate plate;
  Rain one(*plate.body, plate.surface, plate.options, plate.layout.gravity), other = one;
  plate.momentum(one, 2e-3, 0.5, plate.still);
  plate.momentum(other, 0.5e-3, 0.5, plate.still);
  EXPECT_NEAR(double(one.hits().size()), double(other.hits().size()), 2.0);  // but for the last step's end
  // A step that is taken again, shorter, hits nothing twice.
  const std::size_t count = one.hits().size();
  one.begin_step({&plate.body->nodes, &plate.still, 0.498, 1e-3});
  one.begin_step({&plate.body->nodes, &plate.still, 0.499, 1e-3});
  EXPECT_EQ(one.hits().size(), count);
}

/// A plate that falls along with the drops is hit by them no harder than by their relative velocity.
TEST(Rain, BrakesAgainstTheSurfacesOwnVelocity) {
  Plate plate;
  Points falling = plate.still;
  falling.rowwise() += Eigen::RowVector3d(0.5, -3.0, 0.25);
  Rain rain(*plate.body, plate.surface, plate.options, plate.layout.gravity);
  const Vector3 sum = plate.momentum(rain, 2e-3, 0.2, falling);
  EXPECT_LT((sum - 0.5 * double(rain.hits().size()) * plate.options.drop_mass() * plate.options.velocity).norm(),
            1e-9 * sum.norm());
}

TEST(Rain, WaterStaysAndRunsOff) {
  Plate plate;
  plate.options.stays = 0.5, plate.options.runs_off = 0.2, plate.options.until = 0.3;
  Rain rain(*plate.body, plate.surface, plate.options, plate.layout.gravity);
  plate.momentum(rain, 2e-3, 0.4, plate.still);
  double water = 0.0;
  for (const Rain::Hit& hit : rain.hits())
    water += 0.5 * plate.options.drop_mass() * std::exp(-(0.6 + 0.5e-3 - hit.time) / 0.2);
  ASSERT_GT(water, 0.0);
  const Points x = plate.body->nodes;
  // After the rain, water alone weighs.
  Points force = Points::Zero(x.rows(), 3);
  rain.begin_step({nullptr, nullptr, 0.6, 1e-3});
  rain.add_force(x, force);
  EXPECT_NEAR(force.col(1).sum(), -9.81 * water, 1e-9 * 9.81 * water);
  EXPECT_LT(std::abs(force.col(0).sum()), 1e-12);
}

TEST(Rain, RefusesNoDrops) {
  Plate plate;
  plate.options.rate = 0.0;
  EXPECT_THROW(Rain(*plate.body, plate.surface, plate.options, plate.layout.gravity), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::rain_test
