// A bar of two stiffnesses, scanned as it sags, then struck: its load-free shape and both moduli are unknown.
//   pliant_load_free compare CELLS NOISE
//     both moduli from several starts, with derivatives through the equilibrium, by a splitting, and with the scan
//     taken for load-free; and as Wang 2015 does it (algorithm 1, section 6.3): by a downhill simplex that finds the
//     load-free shape before each evaluation, from where the vibrations' frequencies lead. JSON on stdout
//   pliant_load_free landscape CELLS NOISE COUNT
//     the cost over a grid of COUNT x COUNT moduli; null where no load-free shape holds the scan up
// CELLS are elements along the bar, those of the truth twice as many; NOISE [m] is that of the points that are
// followed.

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "elasticity/modulus_field.hpp"
#include "estimation/modal_start.hpp"
#include "estimation/optimiser.hpp"

namespace pliant {
namespace {

using nlohmann::json;

constexpr double length = 0.4, edge = 0.03;
constexpr double youngs_moduli[] = {2.4e6, 8e5};  // of the held half and of the free one [Pa]
constexpr double rho = 600.0, nu = 0.35, mass_damping = 0.3, stiffness_damping = 0.003;
constexpr double rate = 60.0;
constexpr int frames = 46;
const MotionLayout layout({.moduli = 2});

std::vector<Hold> hold() {
  return {{[](const Vector3& p) { return p.x() < 1e-6; }}};
}

TetMesh corners_of(int cells) {
  Box box;
  box.extend(Vector3(0.0, -0.5 * edge, -0.5 * edge));
  box.extend(Vector3(length, 0.5 * edge, 0.5 * edge));
  return make_tet_box(box, {cells, cells / 10 + 1, cells / 10 + 1}, false);
}

/// Quadratic tetrahedra; straight, or with their corners elsewhere and edges straight there.
Body make_bar(int cells, const Points* corners = nullptr) {
  const TetMesh mesh = corners_of(cells);
  Body straight = make_body(with_mid_nodes(mesh));
  const auto field = region_field(straight, {[](const Vector3& p) { return p.x() > 0.5 * length; }}).field;
  Body body = corners ? make_body(with_mid_nodes(make_tet_mesh(*corners, mesh.tets))) : std::move(straight);
  body.modulus = field;
  return body;
}

VectorX make_theta(double held, double free) {
  VectorX theta = layout.zero();
  theta[layout.youngs_moduli[0]] = held;
  theta[layout.youngs_moduli[1]] = free;
  theta[layout.poissons_ratio] = nu;
  theta[layout.mass_damping] = mass_damping;
  theta[layout.stiffness_damping] = stiffness_damping;
  theta[layout.density] = rho;
  theta.segment<3>(layout.gravity) = Vector3(0.0, 0.0, -9.81);
  theta.segment<3>(layout.linear_velocity) = Vector3(0.0, 0.5, 0.6);
  return theta;
}

SimulationOptions scene_of(double steps_per_frame) {
  SimulationOptions options;
  options.blocks = layout;
  for (int f = 0; f < frames; ++f) options.times.push_back(f / rate);
  options.max_dt = (1.0 + 1e-9) / (rate * steps_per_frame);
  options.holds = hold();
  options.newton.tolerance = 1e-10;
  return options;
}

Points sagged(const std::shared_ptr<const Body>& body, const VectorX& theta) {
  SimulationOptions options = scene_of(1);
  options.is_static = true;
  options.times = {0.0};
  Simulation simulation(body, options);
  Points x;
  const RolloutSummary summary =
      simulation.run(theta, [&](int, const State& state, auto) { return x = state.x, true; });
  if (!summary.succeeded) throw std::runtime_error(summary.failure);
  return x;
}

/// What was recorded, of a bar of other elements than it is fitted with; the physics are the same (an inverse crime in
/// that).
struct Recorded {
  std::shared_ptr<const Body> scanned;
  Points straight;  // corners of the scanned body's elements, free of load
  std::shared_ptr<std::vector<FrameObservations>> seen = std::make_shared<std::vector<FrameObservations>>();
  std::vector<Vector3> followed;  // in the scan
  double sag = 0.0;               // greatest [m]
};

Recorded record(int cells, double noise) {
  const VectorX theta = make_theta(youngs_moduli[0], youngs_moduli[1]);
  const auto fine = std::make_shared<Body>(make_bar(2 * cells));
  const Points x = sagged(fine, theta);
  Recorded recorded;
  recorded.straight = corners_of(cells).nodes;
  const auto at = [&](const Points& points) {
    std::vector<Vector3> list;
    for (Eigen::Index n = 0; n < points.rows(); ++n) list.push_back(points.row(n).transpose());
    return Embedding(*fine, list);
  };
  const Points scan = at(recorded.straight).positions(x);
  recorded.sag = (scan - recorded.straight).rowwise().norm().maxCoeff();
  recorded.scanned = std::make_shared<Body>(make_bar(cells, &scan));
  Points points(20, 3);
  for (int i = 0; i < 20; ++i)
    points.row(i) << length * (i / 4 + 1) / 5.0, (i % 2 ? 0.5 : -0.5) * edge, (i % 4 < 2 ? 0.5 : -0.5) * edge;
  const Embedding followed = at(points);
  const Points there = followed.positions(x);
  for (Eigen::Index i = 0; i < there.rows(); ++i) recorded.followed.push_back(there.row(i).transpose());
  // The bar is struck where it sags: its state at the start is that of the scan, not that free of load.
  const auto& mesh = std::get<TetMesh>(fine->mesh);
  Body sagging = make_body(make_tet_mesh(x, mesh.tets, mesh.mid_nodes));
  sagging.modulus = fine->modulus;
  Body moving = with_reference(sagging, fine->nodes);
  moving.mass = fine->mass;
  Simulation simulation(std::make_shared<Body>(std::move(moving)), scene_of(8));
  std::mt19937 random(11);
  std::normal_distribution<double> error(0.0, noise);
  const RolloutSummary summary = simulation.run(theta, [&](int frame, const State& state, auto) {
    FrameObservations seen{frame};
    const Points p = followed.positions(state.x);
    for (int i = 0; i < int(p.rows()); ++i)
      seen.tracks.push_back(
          {i, p.row(i).transpose() + Vector3(error(random), error(random), error(random)), std::max(noise, 1e-5)});
    if (frame > 0) recorded.seen->push_back(std::move(seen));
    return true;
  });
  if (!summary.succeeded) throw std::runtime_error(summary.failure);
  return recorded;
}

ParameterSet parameters_from(double held, double free) {
  std::vector<Parameter> list;
  for (std::size_t k = 0; k < 2; ++k)
    list.push_back(
        {k == 0 ? "held" : "free", "Pa", Transform::Logarithm, layout.youngs_moduli[k], 1.0, 1e3, 1e10, true});
  return {layout.layout(), std::move(list), make_theta(held, free)};
}

Objective objective_of(const Recorded& recorded, const ParameterSet& parameters, bool scan_sags, int last_frame) {
  SimulationOptions options = scene_of(4);
  options.scan_sags = scan_sags;
  Mismatch mismatch;
  mismatch.tracks = std::make_shared<PointTracks>(*recorded.scanned, recorded.followed);
  ObjectiveOptions compare;
  compare.outlier_scale = 0.5 * length;
  compare.last_frame = last_frame;
  return {mismatch, recorded.scanned, options, recorded.seen, parameters, compare};
}

/// Factors of the true moduli that the vibrations' frequencies about the scan lead to, from equal moduli.
std::array<double, 2> modal_start_of(const Recorded& recorded) {
  TrackedPoints tracked;
  tracked.rest = recorded.followed;
  for (const FrameObservations& frame : *recorded.seen) tracked.frames[frame.frame] = frame.tracks;
  const VectorX theta = make_theta(1e6, 1e6);
  const ModalStart start = modal_start(recorded.scanned, layout, theta, held_nodes(*recorded.scanned, hold()), tracked,
                                       scene_of(1).times, {.curve_samples = 0});
  if (!start.found) throw std::runtime_error("no start by vibrations: " + start.reason);
  return {start.moduli[0] / youngs_moduli[0], start.moduli[1] / youngs_moduli[1]};
}

constexpr const char* simplex = "simplex, shape before each evaluation";

/// One fit of both moduli, over more and more frames.
json fitted(const Recorded& recorded, const std::string& scheme, const std::array<double, 2>& times_truth) {
  const bool scan_sags = scheme.front() != 's' || scheme == simplex;
  const ParameterSet parameters = parameters_from(times_truth[0] * youngs_moduli[0], times_truth[1] * youngs_moduli[1]);
  OptimiserOptions options;
  options.max_iterations = !scan_sags ? 8 : 60;  // it runs to a bound, slowly
  options.step_tolerance = 1e-4;
  options.cost_tolerance = 1e-6;
  if (scheme == simplex) options.kind = OptimiserKind::NelderMead, options.max_iterations = 400;
  const auto begin = std::chrono::steady_clock::now();
  OptimiserSummary s;
  s.p = parameters.to_unconstrained(parameters.reference());
  int iterations = 0, evaluations = 0;
  for (const int last_frame : {frames / 4, frames / 2, frames - 1}) {  // swings out of step are all alike
    Objective objective = objective_of(recorded, parameters, scan_sags, last_frame);
    const OptimiserState start{0, s.p, {}};
    s = scheme == "in turns" ? minimise_staggered(objective, start, options) : minimise(objective, start, options);
    iterations += s.iterations, evaluations += s.evaluations;
    if (!s.succeeded) break;
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const VectorX theta = parameters.to_theta(s.p);
  json run = {{"scheme", scheme},           {"start", times_truth}, {"succeeded", s.succeeded},
              {"converged", s.converged},   {"reason", s.reason},   {"iterations", iterations},
              {"evaluations", evaluations}, {"seconds", seconds}};
  if (s.succeeded) {
    run["cost"] = s.evaluation.cost;
    run["errors"] = {theta[layout.youngs_moduli[0]] / youngs_moduli[0] - 1.0,
                     theta[layout.youngs_moduli[1]] / youngs_moduli[1] - 1.0};
    if (scan_sags) {
      SimulationOptions own = scene_of(4);
      own.scan_sags = true;
      const Points X = Simulation(recorded.scanned, own).rest_body(theta)->nodes;
      run["shape_error"] =
          (X.topRows(recorded.straight.rows()) - recorded.straight).rowwise().norm().maxCoeff() / length;
    }
  }
  std::fprintf(stderr, "%s\n", run.dump().c_str());
  return run;
}

json compare(const Recorded& recorded) {
  json runs = json::array();
  const std::array<double, 2> starts[] = {{2.0, 0.5}, {3.0, 3.0}};
  for (const std::array<double, 2>& start : starts)
    for (const char* scheme : {"together", "in turns", "scan taken for load-free"})
      runs.push_back(fitted(recorded, scheme, start));
  const std::array<double, 2> by_modes = modal_start_of(recorded);
  for (const char* scheme : {"together", simplex}) runs.push_back(fitted(recorded, scheme, by_modes));
  return runs;
}

/// Costs by the free half's modulus, then the held one's.
json landscape(const Recorded& recorded, int count) {
  std::vector<double> moduli;
  for (int k = 0; k < count; ++k) moduli.push_back(1e5 * std::pow(1e3, double(k) / (count - 1)));
  std::vector<std::vector<json>> costs(moduli.size(), std::vector<json>(moduli.size()));
  for (std::size_t held = 0; held < moduli.size(); ++held) {
    int failed = 0;
    for (std::size_t free = moduli.size(); free-- > 0 && failed < 2;) {  // what is softer than what gives way does too
      const ParameterSet parameters = parameters_from(moduli[held], moduli[free]);
      Objective objective = objective_of(recorded, parameters, true, frames - 1);
      const CostEvaluation e = objective.evaluate(parameters.to_unconstrained(parameters.reference()));
      if (e.succeeded) costs[free][held] = e.cost;
      failed = e.succeeded ? 0 : failed + 1;
    }
    std::fprintf(stderr, "column %zu of %d\n", held + 1, count);
  }
  return {{"moduli", moduli}, {"costs", costs}, {"truth", youngs_moduli}};
}

int run(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: pliant_load_free compare|landscape CELLS NOISE [COUNT]\n");
    return 2;
  }
  const Recorded recorded = record(std::atoi(argv[2]), std::atof(argv[3]));
  json report = {{"nodes", recorded.scanned->node_count()},
                 {"elements", recorded.scanned->element_count()},
                 {"sag", recorded.sag},
                 {"length", length},
                 {"truth", youngs_moduli},
                 {"noise", std::atof(argv[3])}};
  if (std::string(argv[1]) == "compare")
    report["runs"] = compare(recorded);
  else
    report["landscape"] = landscape(recorded, argc > 4 ? std::atoi(argv[4]) : 13);
  std::cout << report.dump(1) << "\n";
  return 0;
}

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) try { return pliant::run(argc, argv); } catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
