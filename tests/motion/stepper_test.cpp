#include "motion/stepper.hpp"

#include <numbers>

#include "elasticity/corotated.hpp"
#include "motion/body_forces.hpp"
#include "motion/fixed_regions.hpp"
#include "motion/simulation.hpp"
#include "support/bodies.hpp"
#include "support/convergence.hpp"
#include "support/dense.hpp"
#include "support/eigenvalues.hpp"
#include "support/scenes.hpp"
#include "support/tolerance.hpp"

namespace pliant::stepper_test {
namespace {

using test::tolerance;

const MotionLayout layout;

VectorX soft_material() {
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 4000.0);
  theta[layout.poissons_ratio] = 0.35;
  theta[layout.density] = 100.0;
  return theta;
}

StepOptions step_options(double dt, double newmark_theta) {
  StepOptions options;
  options.dt = dt;
  options.newmark_theta = newmark_theta;
  options.solver.kind = SolverKind::Simplicial;
  return options;
}

/// A body with elasticity, gravity and nodes held.
struct Stepped {
  Stepped(std::shared_ptr<const Body> of, const VectorX& theta, const StepOptions& options, std::vector<int> held = {})
      : body(std::move(of)), stepper(body, terms(body, layout), layout, options) {
    stepper.set_parameters(theta);
    stepper.hold(std::move(held));
  }
  static std::vector<std::unique_ptr<ForceTerm>> terms(const std::shared_ptr<const Body>& body,
                                                       const MotionBlocks& blocks) {
    std::vector<std::unique_ptr<ForceTerm>> list;
    list.push_back(make_elasticity(body, blocks));
    list.push_back(std::make_unique<Gravity>(*body, blocks));
    return list;
  }
  void step(State& state) {
    Points delta = stepper.options().dt * state.v;
    ASSERT_TRUE(stepper.prepare(state));
    ASSERT_TRUE(stepper.solve(state, delta).converged);
    stepper.advance(delta, state);
  }
  std::shared_ptr<const Body> body;
  Stepper stepper;
};

/// Linear and angular momentum about the origin.
Eigen::Matrix<double, 6, 1> momentum(const Body& body, double density, const State& state) {
  Points p = Points::Zero(state.v.rows(), 3);
  body.add_mass_product(density, state.v, p);
  Eigen::Matrix<double, 6, 1> m = Eigen::Matrix<double, 6, 1>::Zero();
  m.head<3>() = p.colwise().sum().transpose();
  for (Eigen::Index n = 0; n < p.rows(); ++n)
    m.tail<3>() += Vector3(state.x.row(n).transpose()).cross(Vector3(p.row(n).transpose()));
  return m;
}

double total_energy(const std::shared_ptr<const Body>& body, const VectorX& theta, const State& state) {
  const auto term = make_elasticity(body, layout);
  Elasticity& elasticity = *term;
  elasticity.set_parameters(theta);
  elasticity.linearise(state.x);
  Points p = Points::Zero(state.v.rows(), 3);
  body->add_mass_product(theta[layout.density], state.v, p);
  return elasticity.energy(state.x) + 0.5 * p.cwiseProduct(state.v).sum();
}

/// Spinning about no principal axis.
State spinning(const Body& body, double rate) {
  State state{body.reference_positions(), Points(body.node_count(), 3)};
  const Vector3 omega = rate * Vector3(1.0, -2.0, 3.0).normalized();
  for (Eigen::Index n = 0; n < state.v.rows(); ++n)
    state.v.row(n) = (omega.cross(Vector3(state.x.row(n).transpose())) + Vector3(0.3, 0.2, -0.1)).transpose();
  return state;
}

TEST(Stepper, FreeFallIsExact) {
  for (const double blend : {0.5, 0.55, 0.8}) {
    const auto body = test::torus_body(0.1, 0.04, 0.05);
    VectorX theta = soft_material();
    const Vector3 g(0.5, -9.81, 1.0), v(0.3, 2.0, -0.4);
    theta.segment<3>(layout.gravity) = g;
    const double dt = 0.01;
    const int steps = 30;
    Stepped scene(body, theta, step_options(dt, blend));
    State state{body->reference_positions(), Points::Zero(body->node_count(), 3)};
    state.v.rowwise() += v.transpose();
    for (int s = 0; s < steps; ++s) scene.step(state);
    const double t = steps * dt;
    // Constant acceleration is what the rule integrates exactly for theta = 1/2; beyond, each step adds (theta - 1/2)
    // dt^2 g.
    const Vector3 moved = t * v + (0.5 * t * t + (blend - 0.5) * dt * t) * g;
    const Points expected = body->reference_positions().rowwise() + moved.transpose();
    EXPECT_LT((state.x - expected).cwiseAbs().maxCoeff(), tolerance(1e-11)) << blend;
    EXPECT_LT((state.v.rowwise() - (v + t * g).transpose()).cwiseAbs().maxCoeff(), tolerance(1e-10)) << blend;
  }
}

/// Relative change of the angular momentum of a body that spins freely.
Vector3 angular_drift(double dt, double rotation_prediction) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  StepOptions options = step_options(dt, 0.5);
  options.rotation_prediction = rotation_prediction;
  Stepped scene(body, soft_material(), options);
  State state = spinning(*body, 6.0);
  const auto before = momentum(*body, 100.0, state);
  for (double t = 0.0; t < 0.064 - 1e-9; t += dt) scene.step(state);
  const auto after = momentum(*body, 100.0, state);
  EXPECT_LT((after - before).head<3>().norm(), tolerance(1e-11) * before.head<3>().norm()) << "linear momentum";
  return (after - before).tail<3>() / before.tail<3>().norm();
}

TEST(Stepper, KeepsLinearMomentumAndAngularMomentumToItsOrder) {
  const std::vector<double> dts = {0.008, 0.004, 0.002};
  // What is left as dt vanishes is the corotated element's: R K (R^T x - X) turns a deformed cell by a torque of second
  // order in its strain, here 0.02.
  const Vector3 limit = angular_drift(0.0002, 0.5);
  EXPECT_LT(limit.norm(), tolerance(5e-4));
  std::vector<double> lagged, predicted;
  for (const double dt : dts) {
    lagged.push_back((angular_drift(dt, 0.0) - limit).norm());
    predicted.push_back((angular_drift(dt, 0.5) - limit).norm());
  }
  RecordProperty("limit", std::to_string(limit.norm() * 1e6) + "e-6");
  RecordProperty("lagged",
                 std::to_string(lagged.back()) + ", order " + std::to_string(test::fitted_order(dts, lagged)));
  RecordProperty("predicted",
                 std::to_string(predicted.back()) + ", order " + std::to_string(test::fitted_order(dts, predicted)));
  EXPECT_GT(test::fitted_order(dts, lagged), 0.8);
  EXPECT_LT(test::fitted_order(dts, lagged), 1.4)
      << "rotations of the start are of first order: the test sees the difference";
  EXPECT_GT(test::fitted_order(dts, predicted), 1.6);
}

TEST(Stepper, EnergyDoesNotGrow) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  const VectorX theta = soft_material();
  Stepped scene(body, theta, step_options(1.0 / 240.0, 0.55));
  State state = spinning(*body, 6.0);
  state.x.col(1) *= 1.3;  // stretched, too
  const double start = total_energy(body, theta, state);
  double last = start;
  for (int s = 0; s < 200; ++s) {
    scene.step(state);
    const double now = total_energy(body, theta, state);
    EXPECT_LT(now, last * (1.0 + 2e-2)) << "step " << s;
    EXPECT_LT(now, start * (1.0 + 1e-9)) << "step " << s;
    last = now;
  }
  EXPECT_GT(last, 0.05 * start) << "and it does not vanish either";
}

/// The first mode of a short clamped bar, as the assembled matrices have it.
struct Mode {
  Mode() : body(test::box_body(Vector3(0.3, 0.1, 0.1), 0.1)) {
    theta = soft_material();
    held = held_nodes(*body, {{[](const Vector3& p) { return p.x() < -0.15 + 1e-5; }}});
    const auto term = make_elasticity(body, layout);
    Elasticity& elasticity = *term;
    elasticity.set_parameters(theta);
    elasticity.linearise(body->reference_positions());
    BlockMatrix K(body->pattern), M(body->pattern);
    elasticity.add_matrix(1.0, K);
    for (std::size_t b = 0; b < body->mass.size(); ++b)
      for (int d = 0; d < 3; ++d) M.block(int(b))[4 * d] = 100.0 * body->mass[b];
    for (const int n : held) K.constrain(n), M.constrain(n);
    for (const int n : held)
      for (int d = 0; d < 3; ++d) K.block(K.pattern().diagonal[n])[4 * d] = 1e9;  // out of the way of the first mode
    const test::GeneralisedEigen eigen = test::generalised_eigen(test::dense(K), test::dense(M));
    omega = std::sqrt(eigen.values[0]);
    VectorX first = eigen.vectors.col(0);
    shape = as_points(first);
    shape *= 1e-6 / shape.cwiseAbs().maxCoeff();  // small: the corotated body is then linear to rounding
    Points product = Points::Zero(shape.rows(), 3);
    body->add_mass_product(1.0, shape, product);
    dual = product / product.cwiseProduct(shape).sum();
  }
  /// Amplitude of the mode after a time, released at one.
  double released(double time, double dt, double blend) const {
    Stepped scene(body, theta, step_options(dt, blend), held);
    State state{body->reference_positions() + shape, Points::Zero(shape.rows(), 3)};
    const int steps = int(std::lround(time / dt));
    for (int s = 0; s < steps; ++s) scene.step(state);
    return (state.x - body->reference_positions()).cwiseProduct(dual).sum();
  }
  /// Rayleigh damping: q'' + (alpha + beta w^2) q' + w^2 q = 0, q(0) = 1, q'(0) = 0.
  double exact(double time) const {
    const double c = 0.5 * (theta[layout.mass_damping] + theta[layout.stiffness_damping] * omega * omega);
    const double d = std::sqrt(omega * omega - c * c);
    return std::exp(-c * time) * (std::cos(d * time) + c / d * std::sin(d * time));
  }
  /// At a time when errors of amplitude and of phase both show.
  double order(double blend, const std::vector<int>& step_counts) const {
    const double period = 2.0 * std::numbers::pi / omega, time = 1.125 * period;
    std::vector<double> dts, errors;
    for (const int steps : step_counts) {
      dts.push_back(time / steps);
      errors.push_back(std::abs(released(time, dts.back(), blend) - exact(time)));
    }
    return test::fitted_order(dts, errors);
  }

  std::shared_ptr<const Body> body;
  VectorX theta;
  std::vector<int> held;
  double omega = 0.0;
  Points shape, dual;
};

TEST(Stepper, FreeOscillationHasTheModesFrequencyAndOrderTwo) {
  Mode mode;
  for (const auto& [alpha, beta] :
       {std::pair{0.0, 0.0}, std::pair{1.0, 0.0}, std::pair{0.0, 0.004}, std::pair{1.0, 0.004}}) {
    mode.theta[layout.mass_damping] = alpha;
    mode.theta[layout.stiffness_damping] = beta;
    EXPECT_NEAR(mode.order(0.5, {50, 100, 200, 400}), 2.0, 0.1) << "alpha " << alpha << " beta " << beta;
    EXPECT_NEAR(mode.order(0.55, {400, 800, 1600}), 1.0, 0.15) << "alpha " << alpha << " beta " << beta;
  }
}

TEST(Stepper, MassDampingHalvesAtItsRate) {
  Mode mode;
  mode.theta[layout.mass_damping] = 2.0;
  // exp(-alpha t / 2) is one half; the phase is chosen at a maximum, where it does not matter.
  const double damped = std::sqrt(mode.omega * mode.omega - 1.0), period = 2.0 * std::numbers::pi / damped;
  const double cycles = std::round(std::log(2.0) / period), time = cycles * period;
  ASSERT_GE(cycles, 1.0);
  EXPECT_NEAR(mode.released(time, period / 400, 0.5), std::exp(-time), tolerance(2e-3));
}

TEST(Stepper, StiffnessDampingActsWithTheSquareOfTheFrequency) {
  Mode mode;
  mode.theta[layout.stiffness_damping] = 0.1 / mode.omega;  // damping ratio 0.05
  const double damped = mode.omega * std::sqrt(1 - 0.05 * 0.05), period = 2.0 * std::numbers::pi / damped;
  EXPECT_NEAR(mode.released(3 * period, period / 400, 0.5), std::exp(-0.05 * mode.omega * 3 * period), tolerance(2e-3));
}

TEST(Stepper, WithoutDampingThetaOneHalfKeepsTheAmplitude) {
  const Mode mode;
  const double period = 2.0 * std::numbers::pi / mode.omega;
  EXPECT_NEAR(mode.released(10 * period, period / 200, 0.5), 1.0, tolerance(5e-3));
  EXPECT_LT(mode.released(10 * period, period / 200, 0.55), 0.95) << "above one half it damps numerically";
}

/// Repeated about its own end, a step of the lagged scheme is that of the implicit one: rotations, contact, damping.
TEST(Stepper, RepeatedLaggedStepsConvergeToTheImplicitStep) {
  const test::TorusScene scene = test::torus_scene(0.05, 2);
  const auto& body = scene.body;
  for (const double blend : {0.51, 0.999}) {
    const auto make = [&](Integrator integrator) {
      auto terms = Stepped::terms(body, scene.layout);
      terms.push_back(std::make_unique<RigidContact>(
          RigidContact::sliding(*body, surface_samples(*body), scene.layout.planes[0], scene.options.contact)));
      StepOptions options = step_options(1.0 / 120.0, blend);
      options.integrator = integrator;
      options.newton.tolerance = 1e-13;
      auto stepper = std::make_unique<Stepper>(body, std::move(terms), scene.layout, options);
      stepper->set_parameters(scene.theta);
      return stepper;
    };
    State start = spinning(*body, 6.0);
    start.x.col(0) *= 1.1;  // stretched
    start.x.col(1).array() -= 0.03;
    const auto implicit = make(Integrator::Newton), lagged = make(Integrator::Lagged);
    Points exact = Points::Zero(start.x.rows(), 3);
    ASSERT_TRUE(implicit->prepare(start));
    ASSERT_TRUE(implicit->solve(start, exact).converged);
    Points delta = lagged->options().dt * start.v;
    ASSERT_TRUE(lagged->prepare(start));
    ASSERT_TRUE(lagged->solve(start, delta).converged);
    const double once = (delta - exact).norm() / exact.norm();
    EXPECT_GT(once, 1e-4) << "one lagged step is not the implicit one";
    double change = 1.0;
    for (int i = 0; i < 200 && change > 1e-13; ++i) {
      Points end = delta;
      ASSERT_TRUE(lagged->prepare(start, delta));
      ASSERT_TRUE(lagged->solve(start, end).converged);
      change = (end - delta).norm() / delta.norm();
      delta = end;
    }
    EXPECT_LT((delta - exact).norm(), tolerance(1e-9) * exact.norm()) << blend;
    State by_lagged = start, by_implicit = start;
    lagged->advance(delta, by_lagged);
    implicit->advance(exact, by_implicit);
    EXPECT_LT((by_lagged.v - by_implicit.v).norm(), tolerance(1e-8) * by_implicit.v.norm()) << blend;
  }
}

TEST(Stepper, ReportsAnEndThatIsNotFinite) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  Stepped scene(body, soft_material(), step_options(0.01, 0.5));
  const State state{body->reference_positions(), Points::Zero(body->node_count(), 3)};
  Points delta = Points::Zero(body->node_count(), 3);
  EXPECT_TRUE(scene.stepper.prepare(state, delta));
  delta(3, 1) = std::nan("");
  EXPECT_FALSE(scene.stepper.prepare(state, delta));
}

TEST(Stepper, RefusesSenselessOptions) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  EXPECT_NO_THROW(Stepper(body, {}, layout, step_options(0.1, 0.5)));
  EXPECT_THROW(Stepper(body, {}, layout, step_options(0.0, 0.5)), std::invalid_argument);
  EXPECT_THROW(Stepper(body, {}, layout, step_options(0.1, 0.4)), std::invalid_argument);
  EXPECT_THROW(Stepper(body, {}, layout, step_options(0.1, 1.0)), std::invalid_argument);
  StepOptions options = step_options(0.1, 0.5);
  options.contact_weight = 0.5;
  EXPECT_THROW(Stepper(body, {}, layout, options), std::invalid_argument);
  options = step_options(0.1, 0.5);
  options.rotation_prediction = 1.1;
  EXPECT_THROW(Stepper(body, {}, layout, options), std::invalid_argument);
}

TEST(Stepper, ReportsAStateThatIsNotFinite) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  Stepped scene(body, soft_material(), step_options(0.01, 0.5));
  State state{body->reference_positions(), Points::Zero(body->node_count(), 3)};
  state.v(3, 1) = std::nan("");
  EXPECT_FALSE(scene.stepper.prepare(state));
}

TEST(Simulation, ParametersThatAreNotFiniteFailWithAReason) {
  SimulationOptions options;
  options.times = {0.0, 0.1};
  options.max_dt = 0.02;
  Simulation simulation(test::torus_body(0.1, 0.04, 0.05), options);
  VectorX theta = soft_material();
  layout.set_moduli(theta, std::nan(""));
  const RolloutSummary summary = simulation.run(theta, [](int, const State&, auto) { return true; });
  EXPECT_FALSE(summary.succeeded);
  EXPECT_FALSE(summary.failure.empty());
}

TEST(Simulation, FramesMayBeUnequallyFarApart) {
  SimulationOptions options;
  options.times = {1.0, 1.013, 1.1, 1.1004};
  options.max_dt = 0.01;
  options.newmark_theta = 0.5;
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  Simulation simulation(body, options);
  VectorX theta = soft_material();
  theta.segment<3>(layout.gravity) = Vector3(0, -10, 0);
  const auto summary = simulation.run(theta, [&](int frame, const State& state, auto) {
    const double t = options.times[std::size_t(frame)] - 1.0;
    EXPECT_NEAR((state.x - body->reference_positions()).col(1).mean(), -5.0 * t * t, tolerance(1e-8));  // the solver's
    return true;
  });
  EXPECT_EQ(summary.frames, 4);
  EXPECT_EQ(summary.steps, 2 + 9 + 1);
}

/// A sphere set down softly on a plane, and strongly damped.
TEST(RigidContact, CarriesTheWeightOfABodyAtRest) {
  const double radius = 0.05, weight_density = 200.0;
  const auto body = std::make_shared<const Body>(make_body(test::sphere_grid(radius, 0.025)));
  SimulationOptions options;
  options.times = {0.0, 2.0};
  options.max_dt = 0.01;
  const MotionLayout with_plane({.planes = 1});
  options.blocks = with_plane;
  options.contact = default_contact(*body, weight_density * body->volume(), 9.81);
  VectorX theta = with_plane.zero();
  with_plane.set_moduli(theta, 2e4);
  theta[with_plane.poissons_ratio] = 0.4;
  theta[with_plane.density] = weight_density;
  theta[with_plane.mass_damping] = 20.0;
  theta[with_plane.stiffness_damping] = 0.01;
  const Vector3 normal = Vector3(0.0, 1.0, 0.0);
  theta.segment<3>(with_plane.gravity) = -9.81 * normal;
  theta.segment<3>(with_plane.planes[0].point) = -(radius + 1e-3) * normal;
  theta.segment<3>(with_plane.planes[0].normal) = normal;
  Simulation simulation(body, options);
  State end;
  ASSERT_TRUE(simulation.run(theta, [&](int, const State& state, auto) { return end = state, true; }).succeeded);
  ASSERT_LT(end.v.cwiseAbs().maxCoeff(), 1e-3) << "it has not come to rest";
  RigidContact contact = RigidContact::sliding(*body, surface_samples(*body), with_plane.planes[0], options.contact);
  contact.set_parameters(theta);
  contact.linearise(end.x);
  ASSERT_GT(contact.active_count(), 0);
  Points force = Points::Zero(end.x.rows(), 3);
  contact.add_force(end.x, force);
  const double weight = weight_density * body->volume() * 9.81;
  EXPECT_NEAR(force.col(1).sum(), weight, tolerance(0.01) * weight);
  std::vector<Vector3> samples;
  for (const SurfacePoint& p : body->surface) samples.push_back(p.position);
  const Points surface = Embedding(*body, samples).positions(end.x);
  const double penetration = -(radius + 1e-3) - surface.col(1).minCoeff();
  EXPECT_LT(penetration, 0.01 * radius);
  EXPECT_LT(surface.col(1).minCoeff(), -radius * 0.98) << "it lies on the plane, it does not float";
}

}  // namespace
}  // namespace pliant::stepper_test
