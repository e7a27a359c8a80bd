// Stiffness from the frequencies of followed points: a bar that swings, simulated with known moduli and dampings.
#include "estimation/modal_start.hpp"

#include <numbers>
#include <random>

#include "elasticity/modulus_field.hpp"
#include "input_errors.hpp"
#include "motion/simulation.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::modal_start_test {
namespace {

using test::tolerance;
using ::testing::HasSubstr;

constexpr double length = 0.2, edge = 0.04;

struct SwingOptions {
  std::vector<double> moduli = {4e5};  ///< of the whole, or of the held half and the free one
  double gravity = 3.0;                ///< downwards [m/s^2]
  double mass_damping = 0.8, stiffness_damping = 5e-4;
  double noise = 3e-4;         ///< [m]
  bool follows_nodes = false;  ///< all of them; else seven points
  bool is_complete = false;    ///< no rows are missing
  bool is_of_hexahedra = false;
  int frames = 180;
  double frame_rate = 120.0;  ///< [1/s]
};

/// A bar held at one end, let go from its straight pose with a push and a twist, and what is seen of it.
struct Swing {
  explicit Swing(const SwingOptions& o) {
    Body soft = o.is_of_hexahedra ? *test::box_body({length, edge, 0.75 * edge}, 0.25 * edge)
                                  : *test::tet_body({length, edge, 0.75 * edge}, {8, 2, 2}, false, 0.0);
    layout = MotionLayout({.moduli = int(o.moduli.size())});
    if (o.moduli.size() == 2) soft.modulus = region_field(soft, {[](const Vector3& p) { return p.x() > 0.0; }}).field;
    body = std::make_shared<Body>(std::move(soft));
    held = held_nodes(*body, {root()});
    SimulationOptions options;
    for (int f = 0; f < o.frames; ++f) times.push_back(f / o.frame_rate);
    options.times = times;
    options.max_dt = 1.0 / 960.0 + 1e-9;
    options.holds = {root()};
    options.hold_strongly = true;
    options.blocks = layout;
    truth = layout.zero();
    for (std::size_t k = 0; k < o.moduli.size(); ++k) truth[layout.youngs_moduli[k]] = o.moduli[k];
    truth[layout.poissons_ratio] = 0.35;
    truth[layout.mass_damping] = o.mass_damping;
    truth[layout.stiffness_damping] = o.stiffness_damping;
    truth[layout.density] = 1000.0;
    truth.segment<3>(layout.gravity) = Vector3(0, -o.gravity, 0);
    truth.segment<3>(layout.linear_velocity) = Vector3(0.0, 0.15, 0.3);
    truth.segment<3>(layout.angular_velocity) = Vector3(8.0, 0.0, 0.0);
    if (o.follows_nodes)
      for (int n = 0; n < body->node_count(); ++n) tracked.rest.push_back(body->nodes.row(n).transpose());
    else
      for (const double s : {-0.2, 0.15, 0.45})
        for (const double y : {-0.4, 0.45}) tracked.rest.push_back({s * length, y * edge, (s + 0.1) * 0.5 * edge});
    if (!o.follows_nodes) tracked.rest.push_back({0.0, 0.0, 0.36 * edge});
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const Embedding points(*body, tracked.rest);
    Simulation simulation(body, options);
    const RolloutSummary summary = simulation.run(truth, [&](int frame, const State& state, auto) {
      if (!o.is_complete && frame >= 40 && frame < 45) return true;  // hidden altogether
      auto& seen = tracked.frames[frame];
      for (int p = 0; p < points.point_count(); ++p)
        if (o.is_complete || (2 * p + frame) % 5 != 0)  // rows are missing
          seen.push_back(
              {p, points.position(p, state.x) + o.noise * Vector3(normal(random), normal(random), normal(random)),
               std::max(o.noise, 1e-5)});
      return true;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
  }
  static Hold root() {
    return {[](const Vector3& p) { return p.x() < -0.5 * length + 1e-6; }};
  }
  /// From moduli that are off by a factor each.
  ModalStart start(const std::vector<double>& off, const ModalStartOptions& options = {}) const {
    VectorX wrong = truth;
    for (std::size_t k = 0; k < off.size(); ++k) wrong[layout.youngs_moduli[k]] *= off[k];
    wrong[layout.mass_damping] = wrong[layout.stiffness_damping] = 0.0;
    return modal_start(body, layout, wrong, held, tracked, times, options);
  }

  std::shared_ptr<const Body> body;
  std::vector<int> held;
  std::vector<double> times;
  MotionLayout layout;
  VectorX truth;
  TrackedPoints tracked;
};

/// How far one modulus is from the true one, in the logarithm.
double log_error_of(const ModalStart& start, const Swing& swing, int k) {
  return std::log(start.moduli[k] / swing.truth[swing.layout.youngs_moduli[std::size_t(k)]]);
}

/// The farthest of all.
double log_error(const ModalStart& start, const Swing& swing) {
  double worst = 0.0;
  for (int k = 0; k < int(start.moduli.size()); ++k) worst = std::max(worst, std::abs(log_error_of(start, swing, k)));
  return worst;
}

int used_count(const ModalStart& start) {
  return int(std::ranges::count_if(start.modes, [](const ObservedMode& m) { return m.is_used; }));
}

TEST(ModalStartOf, ABarFindsItsModulusAndDampings) {
  for (const bool hexahedra : {false, true}) {
    SwingOptions o;
    o.is_of_hexahedra = hexahedra;
    const Swing swing(o);
    const ModalStart start = swing.start({0.1});
    ASSERT_TRUE(start.found) << start.reason;
    EXPECT_EQ(start.reason, "");
    EXPECT_LT(log_error(start, swing), tolerance(0.05));  // swings of 0.2 rad and a bar that sags
    EXPECT_LT(log_error(start, swing), tolerance(3.0 * start.log_deviations[0]));
    EXPECT_GE(used_count(start), 4);
    EXPECT_TRUE(start.dampings_are_told_apart);
    EXPECT_NEAR(start.mass_damping / o.mass_damping, 1.0, tolerance(0.3));
    EXPECT_NEAR(start.stiffness_damping / o.stiffness_damping, 1.0, tolerance(0.4));
    EXPECT_EQ(start.coordinates.projection, ModeProjection::Displacements);
    double weights = 0.0, energies = 0.0;
    for (const ObservedMode& m : start.modes) {
      weights += m.weight, energies += m.energy;
      EXPECT_EQ(m.is_used, m.reason.empty());
      if (m.is_used) {
        EXPECT_NEAR(m.modelled_frequency / m.observed_frequency, 1.0, tolerance(0.05)) << m.mode;
      }
    }
    EXPECT_NEAR(weights, 1.0, tolerance(1e-12));
    EXPECT_NEAR(energies, 1.0, tolerance(1e-12));
    // The curve is a parabola in ln E whose bottom is what was found.
    ASSERT_EQ(start.curves.size(), 1u);
    const MatchCurve& curve = start.curves[0];
    EXPECT_NEAR(curve.moduli[0], 1e3, tolerance(1e-6));
    EXPECT_NEAR(curve.moduli[curve.moduli.size() - 1], 1e8, tolerance(1e-1));
    for (Eigen::Index i = 0; i < curve.moduli.size(); ++i)
      EXPECT_NEAR(curve.mismatch[i] - start.mismatch, std::pow(0.5 * std::log(curve.moduli[i] / start.moduli[0]), 2),
                  tolerance(1e-6));
  }
}

/// The body that vibrates is not the one whose modes are taken.
TEST(ModalStartOf, ABarIsThatOfAnotherMesh) {
  SwingOptions o;
  o.is_of_hexahedra = true;
  const Swing swing(o);
  const auto body = test::tet_body({length, edge, 0.75 * edge}, {6, 2, 2}, true, 0.1);
  const std::vector<int> held = held_nodes(*body, {Swing::root()});
  const ModalStart start = modal_start(body, swing.layout, swing.truth, held, swing.tracked, swing.times);
  ASSERT_TRUE(start.found) << start.reason;
  EXPECT_LT(log_error(start, swing), tolerance(0.1));
}

/// A stiff free half hardly bends: it shows least, and its own deviation says so.
TEST(ModalStartOf, TwoZonesFindsBothModuli) {
  struct Case {
    std::vector<double> moduli;
    double factor;
  };
  for (const auto& [moduli, factor] :
       {Case{{8e5, 2e5}, 1.1}, {{1e6, 1e5}, 1.1}, {{4e5, 4e5}, 1.15}, {{2e5, 8e5}, 1.5}}) {
    SwingOptions o;
    o.moduli = moduli;
    const Swing swing(o);
    ModalStartOptions options;
    options.curve_samples = 8;
    const ModalStart start = swing.start({10.0, 0.1}, options);
    ASSERT_TRUE(start.found) << start.reason;
    EXPECT_LT(log_error(start, swing), tolerance(std::log(factor))) << moduli[0];
    for (int k = 0; k < 2; ++k)
      EXPECT_LT(std::abs(log_error_of(start, swing, k)), tolerance(2.5 * start.log_deviations[k]))
          << moduli[0] << " " << k;
    EXPECT_LT(start.log_deviations.maxCoeff(), 0.5);
    ASSERT_EQ(start.curves.size(), 2u);
    for (const MatchCurve& curve : start.curves)
      EXPECT_GT(curve.mismatch.minCoeff(), start.mismatch * (1.0 - 1e-6));  // what was found is the lowest
  }
}

/// A free half ten times as stiff: from equal moduli alone the match ends in a worse valley (mismatch 1.1e-3). The
/// stiff half is hardly seen, so that only its direction is sure.
TEST(ModalStartOf, TwoFarApartZonesFindsTheBestOfSeveralValleys) {
  SwingOptions o;
  o.moduli = {1e5, 1e6};
  o.is_of_hexahedra = true;
  const Swing swing(o);
  ModalStartOptions options;
  options.curve_samples = 0;
  const ModalStart start = swing.start({1.0, 1.0}, options);
  ASSERT_TRUE(start.found) << start.reason;
  EXPECT_LT(start.mismatch, tolerance(5e-4));
  EXPECT_LT(std::abs(log_error_of(start, swing, 0)), tolerance(std::log(1.1)));
  EXPECT_GT(start.moduli[1], 2.5 * start.moduli[0]);
}

TEST(ModalStartOf, OnlyTheLowestModeSaysWhatItLeavesOpen) {
  SwingOptions o;
  o.moduli = {2e5, 8e5};
  const Swing swing(o);
  ModalStartOptions options;
  options.modes = 1;
  options.curve_samples = 0;
  const ModalStart start = swing.start({1.0, 1.0}, options);
  ASSERT_TRUE(start.found);
  EXPECT_THAT(start.reason, HasSubstr("1 vibrations for 2 moduli"));
  EXPECT_TRUE(start.curves.empty());
  // What the moduli in theta are does not matter.
  EXPECT_LT((swing.start({10.0, 0.1}, options).moduli - start.moduli).norm(), 1e-9 * start.moduli.norm());
  EXPECT_FALSE(start.dampings_are_told_apart);
  // Both dampings have half of the decay.
  const double omega = 2.0 * std::numbers::pi * start.modes[0].observed_frequency;
  EXPECT_NEAR(start.mass_damping, start.stiffness_damping * omega * omega, 1e-9 * start.mass_damping);
  EXPECT_NEAR(0.5 * (start.mass_damping + start.stiffness_damping * omega * omega),
              start.modes[0].damping_ratio * omega, 1e-9 * omega);
}

/// A soft bar under full gravity turns by most of a right angle.
TEST(ModalStartOf, AFarSwingFindsItsModulus) {
  SwingOptions o;
  o.moduli = {1e5};
  o.gravity = 9.81;
  o.follows_nodes = true;
  const Swing swing(o);
  const ModalStart start = swing.start({0.1});
  ASSERT_TRUE(start.found) << start.reason;
  EXPECT_GT(start.largest_rotation, 0.7);
  EXPECT_EQ(start.coordinates.projection, ModeProjection::RotationStrain);
  EXPECT_LT(log_error(start, swing), tolerance(0.1));
}

TEST(ModalStartOf, ABarThatOnlySettlesSaysSo) {
  SwingOptions o;
  o.mass_damping = 100.0;
  const ModalStart start = Swing(o).start({1.0});
  EXPECT_FALSE(start.found);
  EXPECT_THAT(start.reason, HasSubstr("no vibration of the body is seen"));
}

TEST(ModalStartOf, WhatCannotBeIsToldInWords) {
  SwingOptions o;
  o.frames = 10;
  Swing swing(o);
  EXPECT_THAT(swing.start({1.0}).reason, HasSubstr("seen at 10 instants"));
  ModalStartOptions options;
  options.modes = 0;
  EXPECT_THAT(test::complaint_of([&] { swing.start({1.0}, options); }), HasSubstr("0 modes"));
  options.modes = 2;
  options.least_modulus = 2e8;
  EXPECT_THAT(test::complaint_of([&] { swing.start({1.0}, options); }), HasSubstr("moduli from"));
  swing.times.pop_back();
  EXPECT_THAT(test::complaint_of([&] { swing.start({1.0}); }), HasSubstr("followed points at frame 9"));
}

/// A free body that flies, tumbles and vibrates in its own modes.
TEST(ModalStartOf, AFreeBodyFindsItsModulus) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {4, 2, 2}, true);
  const MotionLayout layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 3e4);
  theta[layout.poissons_ratio] = 0.4;
  theta[layout.density] = 800.0;
  const Modes own = modes(body, layout, theta, {}, 9);
  TrackedPoints tracked;
  for (const double x : {-0.09, -0.03, 0.04, 0.09})
    for (const double y : {-0.04, 0.045})
      for (const double z : {-0.05, 0.04}) tracked.rest.push_back({x, y, z});
  const Embedding points(*body, tracked.rest);
  std::vector<double> times;
  for (int f = 0; f < 80; ++f) {
    const double t = f / 240.0;
    times.push_back(t);
    Points x = body->nodes;
    for (const int mode : {6, 8})
      x += 4e-3 * std::exp(-1.5 * t) * std::cos(std::sqrt(own.squared_frequencies[mode]) * t) *
           own.shapes[std::size_t(mode)] / own.shapes[std::size_t(mode)].cwiseAbs().maxCoeff();
    const Matrix3 R = Eigen::AngleAxisd(9.0 * t, Vector3(1, 2, -1).normalized()).toRotationMatrix();
    for (int p = 0; p < points.point_count(); ++p)
      tracked.frames[f].push_back({p, R * points.position(p, x) + Vector3(0.4 * t, -4.9 * t * t, 0.1), 1e-4});
  }
  layout.set_moduli(theta, 1e6);
  const ModalStart start = modal_start(body, layout, theta, {}, tracked, times);
  ASSERT_TRUE(start.found) << start.reason;
  EXPECT_NEAR(start.moduli[0] / 3e4, 1.0, tolerance(0.03));
  EXPECT_LT(start.largest_rotation, 0.3);  // the tumbling is taken out
}

/// Bends a bar along x to an arc of curvature kappa [1/m]: parts turn by kappa s and stretch by -kappa y.
Points bent(const Points& rest, double kappa) {
  Points out = rest;
  for (Eigen::Index n = 0; n < rest.rows(); ++n) {
    const double s = rest(n, 0) + 0.5 * length, y = rest(n, 1);
    out(n, 0) = std::sin(kappa * s) * (1.0 / kappa - y) - 0.5 * length;
    out(n, 1) = 1.0 / kappa - std::cos(kappa * s) * (1.0 / kappa - y);
  }
  return out;
}

/// Rotation-strain coordinates grow in proportion to the curvature, however far the bar is bent; displacements do not.
TEST(RotationStrainCoordinates, AreProportionalToABend) {
  const auto body = test::tet_body({length, edge, edge}, {12, 2, 2}, false, 0.0);
  const MotionLayout layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 1e5);
  theta[layout.poissons_ratio] = 0.3;
  theta[layout.density] = 1000.0;
  const Hold root{[](const Vector3& p) { return p.x() < -0.5 * length + 1e-6; }};
  const Modes found = modes(body, layout, theta, held_nodes(*body, {root}), 6);
  std::vector<Vector3> rest;
  for (int n = 0; n < body->node_count(); ++n) rest.push_back(body->nodes.row(n).transpose());
  const std::vector<double> angles = {0.02, 0.5, 1.0, 2.0};  // of the end [rad]
  std::vector<SeenInstant> instants;
  for (const double angle : angles) {
    const Points x = bent(body->nodes, angle / length);
    SeenInstant instant{double(instants.size()), {}};
    for (int n = 0; n < body->node_count(); ++n) instant.seen.push_back({n, x.row(n).transpose(), 1e-4});
    instants.push_back(std::move(instant));
  }
  const TrackedMotion motion(*body, rest, instants, false);
  EXPECT_TRUE(motion.has_gradients());
  EXPECT_NEAR(motion.largest_rotation(), 2.0, 0.15);
  EXPECT_EQ(motion.automatic(), ModeProjection::RotationStrain);
  const VectorX stiffness = found.squared_frequencies / found.squared_frequencies[0];
  const MatrixX bend = motion.project(found.shapes, stiffness, ModeProjection::RotationStrain).values;
  const MatrixX plain = motion.project(found.shapes, stiffness, ModeProjection::Displacements).values;
  Eigen::Index strongest = 0;
  bend.row(3).cwiseAbs().maxCoeff(&strongest);
  for (int i = 1; i < 4; ++i) {
    const VectorX expected = bend.row(0) * angles[std::size_t(i)] / angles[0];
    // Affine fits over neighbourhoods that turn by a few hundredths within themselves.
    EXPECT_LT((bend.row(i).transpose() - expected).norm(), tolerance(0.02) * expected.norm()) << i;
  }
  EXPECT_NEAR(plain(0, strongest) / bend(0, strongest), 1.0, tolerance(0.15));  // where it is bent little they agree
  const VectorX proportional = plain.row(0) * angles[3] / angles[0];
  EXPECT_GT((plain.row(3).transpose() - proportional).norm(), 0.3 * proportional.norm());
}

/// Points on one line show no rotation: the plain projection is what is left.
TEST(RotationStrainCoordinates, NeedPointsThatSpanThem) {
  const auto body = test::tet_body({length, edge, edge}, {8, 2, 2}, false, 0.0);
  std::vector<Vector3> rest;
  for (int i = 0; i < 8; ++i) rest.push_back({0.02 * i - 0.07, 0.01, 0.01});
  SeenInstant instant{0.0, {}};
  for (int i = 0; i < 8; ++i) instant.seen.push_back({i, rest[std::size_t(i)] + Vector3(0, 0.01 * i * i, 0), 1e-4});
  const TrackedMotion motion(*body, rest, {instant}, false);
  EXPECT_FALSE(motion.has_gradients());
  EXPECT_EQ(motion.automatic(), ModeProjection::Displacements);
  EXPECT_EQ(motion.largest_rotation(), 0.0);
}

}  // namespace
}  // namespace pliant::modal_start_test
