// Objects whose scan shows them sagging, or shows them only roughly: the shape and the material together.
#include <utility>

#include "base/error.hpp"
#include "elasticity/modulus_field.hpp"
#include "estimation/load_free.hpp"
#include "estimation/optimiser.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::load_free_fit_test {
namespace {

using test::tolerance;

constexpr double length = 0.3, edge = 0.02;
constexpr double stiff = 2.4e6, soft = 8e5;  // of the held half and the free one [Pa]

/// A bar of two stiffnesses that is struck as it sags; every node is followed. Made by the elements that it is fitted
/// with: an inverse crime on purpose.
struct StruckBar {
  /// @param error  of the scan: how far its free end is bent aside [m]
  explicit StruckBar(bool sags, double error = 0.0) {
    Body made = *test::tet_body({length, edge, edge}, {6, 1, 1}, true, 0.0);
    made.modulus = region_field(made, {[](const Vector3& p) { return p.x() > 0.0; }}).field;
    const TetMesh mesh = std::get<TetMesh>(made.mesh);
    const auto straight = std::make_shared<Body>(std::move(made));
    options.holds = {{[](const Vector3& p) { return p.x() < -0.5 * length + 1e-6; }}};
    options.times = {0.0};
    options.is_static = true;
    // As of what moves where its stress-free shape is unknown.
    options.material.elastic = ElasticLaw::Corotated;
    options.material.damping = StiffnessDamping::Rayleigh;
    options.max_dt = 1.0 / 120.0 + 1e-9;
    options.blocks = layout;
    set_moduli(truth, stiff, soft);
    truth[layout.poissons_ratio] = 0.35;
    truth[layout.mass_damping] = 0.3;
    truth[layout.stiffness_damping] = 0.002;
    truth[layout.density] = 600.0;
    truth.segment<3>(layout.gravity) = Vector3(0, 0, -9.81);
    truth.segment<3>(layout.linear_velocity) = Vector3(0.0, 0.4, 0.5);
    free = straight->nodes;
    Points there = free;
    if (sags)
      (void)Simulation(straight, options).run(truth, [&](int, const State& s, auto) { return there = s.x, true; });
    Points scan = there;
    for (Eigen::Index n = 0; n < scan.rows(); ++n) scan(n, 1) += error * std::pow(free(n, 0) / length + 0.5, 2);
    Body scanned = make_body(make_tet_mesh(scan, mesh.tets, mesh.mid_nodes));
    scanned.modulus = straight->modulus;
    if (sags) scanned.mass = straight->mass;  // what sagged there; the scan's own would differ a little
    Body moving = scanned;
    if (sags) moving = with_reference(scanned, free);
    if (error != 0.0) moving = *straight;
    moving.mass = scanned.mass;
    body = std::make_shared<Body>(std::move(scanned));
    options.is_static = false;
    for (int f = 1; f < 13; ++f) options.times.push_back(f / 30.0);
    std::vector<Vector3> points;
    for (int n = 0; n < body->node_count(); ++n) points.push_back(scan.row(n).transpose());
    tracks = std::make_shared<PointTracks>(*body, points);
    const Embedding followed(*body, points);  // nodes of curved elements are not exactly where they are looked for
    auto frames = std::make_shared<std::vector<FrameObservations>>();
    Simulation simulation(std::make_shared<Body>(std::move(moving)), options);
    const RolloutSummary summary = simulation.run(truth, [&](int frame, const State& state, auto) {
      FrameObservations one{frame};
      for (int n = 0; n < body->node_count(); ++n) one.tracks.push_back({n, followed.position(n, state.x), 1e-3});
      frames->push_back(std::move(one));
      return true;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    seen = frames;
    options.scan_sags = sags;
  }
  Objective objective(const ParameterSet& parameters) const {
    ObjectiveOptions o;
    o.outlier_scale = 0.5 * length;
    o.last_frame = int(options.times.size()) - 1;
    return {{nullptr, tracks}, body, options, seen, parameters, o};
  }
  /// From now on the scan may err.
  void correct_scan(const ShapeField& shape) {
    const MotionLayout before =
        std::exchange(layout, MotionLayout({.moduli = 2, .scan_corrections = int(shape.points.size())}));
    truth = carry(before.layout(), truth, layout.layout(), layout.zero());
    options.blocks = layout;
    options.shape = shape;
  }
  void set_moduli(VectorX& theta, double first, double second) const {
    theta[layout.youngs_moduli[0]] = first, theta[layout.youngs_moduli[1]] = second;
  }
  ParameterSet parameters(double of_stiff, double of_soft) const {
    VectorX theta = truth;
    set_moduli(theta, of_stiff * stiff, of_soft * soft);
    std::vector<Parameter> list;
    for (int k = 0; k < 2; ++k)
      list.push_back({"youngs_modulus@" + std::to_string(k + 1), "Pa", Transform::Logarithm,
                      layout.youngs_moduli[std::size_t(k)], 1.0, 1.0, 1e9, true});
    for (const ParameterHandle& correction : layout.scan_corrections) {
      Parameter p{layout.layout().block_of(correction).name, "1", Transform::Vector, correction};
      p.estimated = true;
      p.prior_std = 1.0;
      p.prior_mean = VectorX::Zero(3);
      list.push_back(std::move(p));
    }
    return {layout.layout(), std::move(list), theta};
  }
  std::pair<double, double> errors(const VectorX& theta) const {
    return {theta[layout.youngs_moduli[0]] / stiff - 1.0, theta[layout.youngs_moduli[1]] / soft - 1.0};
  }
  double shape_error(const VectorX& theta) const {
    return (Simulation(body, options).rest_body(theta)->nodes - free).rowwise().norm().maxCoeff() / length;
  }

  std::shared_ptr<const Body> body;
  Points free;
  MotionLayout layout{{.moduli = 2}};
  SimulationOptions options;
  VectorX truth = layout.zero();
  std::shared_ptr<const PointTracks> tracks;
  std::shared_ptr<const std::vector<FrameObservations>> seen;
};

OptimiserOptions patient() {
  OptimiserOptions o;
  o.max_iterations = 60;
  o.step_tolerance = 1e-5;
  o.cost_tolerance = 1e-7;
  return o;
}

/// In turns it creeps towards the same, and ends where a turn hardly moves it.
TEST(LoadFreeFit, FindsModuliAndShapeTogetherAndNearlyInTurns) {
  const StruckBar bar(true);
  const ParameterSet parameters = bar.parameters(1.8, 0.7);
  const VectorX start = parameters.to_unconstrained(parameters.reference());
  EXPECT_GT(bar.shape_error(parameters.reference()), 0.02) << "the start is worth leaving";
  Objective objective = bar.objective(parameters), other = bar.objective(parameters);
  const OptimiserSummary together = minimise(objective, start, patient());
  OptimiserOptions longer = patient();
  longer.max_iterations = 400;
  longer.step_tolerance = 1e-4;
  const OptimiserSummary in_turns = minimise_staggered(other, OptimiserState{0, start, {}}, longer);
  const auto expect_near = [&](const OptimiserSummary& s, double modulus, double shape) {
    ASSERT_TRUE(s.succeeded && s.converged) << s.reason;
    const VectorX theta = parameters.to_theta(s.p);
    const auto [of_stiff, of_soft] = bar.errors(theta);
    EXPECT_LT(std::abs(of_stiff), tolerance(modulus));
    EXPECT_LT(std::abs(of_soft), tolerance(modulus));
    EXPECT_LT(bar.shape_error(theta), tolerance(shape));
  };
  expect_near(together, 1e-3, 1e-4);
  expect_near(in_turns, 0.05, 5e-3);
  EXPECT_LT(together.evaluation.cost, 1e-2 * in_turns.evaluation.cost);
  EXPECT_LT(together.evaluations, in_turns.evaluations);
}

TEST(LoadFreeFit, TheScanTakenForLoadFreeMisleads) {
  StruckBar bar(true);
  bar.options.scan_sags = false;
  const ParameterSet parameters = bar.parameters(1.0, 1.0);
  Objective objective = bar.objective(parameters);
  const OptimiserSummary s = minimise(objective, parameters.to_unconstrained(parameters.reference()), patient());
  ASSERT_TRUE(s.succeeded);
  const auto [of_stiff, of_soft] = bar.errors(parameters.to_theta(s.p));
  EXPECT_GT(std::max(std::abs(of_stiff), std::abs(of_soft)), 0.2);
}

/// A scan that is bent aside by 3 % of the bar's length: its correction follows from how the bar swings.
TEST(ScanCorrection, IsFoundAlongWithTheMaterial) {
  StruckBar bar(false, 0.03 * length);
  const ParameterSet rigid = bar.parameters(1.3, 0.8);
  Objective uncorrected = bar.objective(rigid);
  const OptimiserSummary without = minimise(uncorrected, rigid.to_unconstrained(rigid.reference()), patient());
  bar.correct_scan({{Vector3(0.5 * length, 0, 0), Vector3(0.2 * length, 0, 0), Vector3(-0.1 * length, 0, 0)},
                    0.02 * length,
                    0.5 * length});
  const ParameterSet parameters = bar.parameters(1.3, 0.8);
  const double before = bar.shape_error(parameters.reference());
  Objective objective = bar.objective(parameters);
  const OptimiserSummary s = minimise(objective, parameters.to_unconstrained(parameters.reference()), patient());
  ASSERT_TRUE(s.succeeded) << s.reason;
  const VectorX theta = parameters.to_theta(s.p);
  const auto [of_stiff, of_soft] = bar.errors(theta);
  EXPECT_LT(std::abs(of_stiff), tolerance(0.03));
  EXPECT_LT(std::abs(of_soft), tolerance(0.06));
  EXPECT_LT(bar.shape_error(theta), 0.2 * before);
  EXPECT_LT(s.evaluation.cost, 0.1 * without.evaluation.cost);
}

/// The bar lies along x and hangs aside under its weight along y or z, whichever way gravity points in the scene.
TEST(ModulusOfSag, LetsAHeldBodySagByThatPart) {
  const StruckBar bar(false);
  constexpr double part = 0.01;
  for (const Vector3& gravity : {Vector3(0, 0, -9.81), Vector3(-9.81, 0, 0)}) {
    VectorX theta = bar.truth;
    theta.segment<3>(bar.layout.gravity) = gravity;
    const double modulus = modulus_of_sag(bar.body, bar.options.holds, bar.layout, theta, part);
    bar.layout.scale_moduli(theta, modulus / theta[bar.layout.youngs_moduli[0]]);
    theta.segment<3>(bar.layout.gravity) = Vector3(0, 0, -9.81);
    SimulationOptions still = bar.options;
    still.is_static = true;
    double sag = 0.0;
    Simulation(bar.body, still).run(theta, [&](int, const State& state, auto) {
      sag = (state.x - bar.body->nodes).rowwise().norm().maxCoeff();
      return true;
    });
    EXPECT_NEAR(sag / bar.body->size(), part, 0.03 * part);
  }
  VectorX weightless = bar.truth;
  weightless.segment<3>(bar.layout.gravity).setZero();
  EXPECT_EQ(modulus_of_sag(bar.body, bar.options.holds, bar.layout, weightless, part), 0.0);
}

TEST(CarryingModulus, HoldsTheScanUpFromAnyStart) {
  const StruckBar bar(true);
  for (const double start : {1e2, 1e9}) {
    VectorX theta = bar.truth;
    bar.layout.set_moduli(theta, start);
    const double modulus = carrying_modulus(bar.body, bar.options, theta, {});
    bar.layout.set_moduli(theta, modulus);
    Simulation simulation(bar.body, bar.options);
    EXPECT_TRUE(simulation.run(theta, [](int, const State&, auto) { return false; }).succeeded) << modulus;
    EXPECT_GT(modulus, 1e4);
    EXPECT_LT(modulus, 1e7);
  }
  StruckBar heavy(true);
  VectorX theta = heavy.truth;
  theta[heavy.layout.density] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)carrying_modulus(heavy.body, heavy.options, theta, {}), InputError);
}

}  // namespace
}  // namespace pliant::load_free_fit_test
