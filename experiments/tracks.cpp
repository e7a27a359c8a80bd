// Moduli and dampings of a bar from the motion of all its nodes (Wang 2015, figure 9 and table 1), as JSON on stdout.
//   pliant_bar [NAME=VALUE]...
// moduli=E,E,...    of the truth, evenly spread along the bar [Pa]
// controls=N        that are fitted
// noise=S           of each coordinate, times the bar's length
// truth_steps=N     of the truth to one of the fit
// frames=N, rate=R  of each of the three motions, and [1/s]
// steps=N           of the fit to a frame
// integrator=lagged|newton, newmark_theta=T, solver=automatic|cholmod
// optimiser=levenberg_marquardt|nelder_mead
// start=modal|off   off: ten times the truth's mean modulus and dampings
// tolerance=T       of ln E, ln alpha and ln beta, at which an optimiser stops
// budget=S          wall time [s] after which it is stopped; evaluations=N likewise
//
// The bar is held at one end and set in motion three times, in three recordings: straight, it turns about its axis,
// swings about the held end, or moves along its axis, and so twists, bends or stretches from there. No gravity.

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <stdexcept>

#include "elasticity/corotated.hpp"
#include "elasticity/modulus_field.hpp"
#include "estimation/modal_start.hpp"
#include "estimation/objective.hpp"
#include "estimation/optimiser.hpp"

namespace pliant {
namespace {

using nlohmann::json;

constexpr double length = 1.0, edge = 0.25;        // [m]
constexpr double least_modulus = 1e3;              // [Pa]
constexpr double alpha = 2e-2, beta = 1e-3;        // the truth's, as in the paper [1/s], [s]
constexpr double poissons_ratio = 0.4, rho = 1e3;  // known
constexpr double off = 10.0;

struct Motion {
  const char* name;
  Vector3 linear, angular;  // [m/s], [rad/s]
};
const std::vector<Motion> motions = {
    {"twist", {0, 0, 0}, {10, 0, 0}}, {"bend", {0, 0.5, 0}, {0, 0, 1}}, {"stretch", {1.5, 0, 0}, {0, 0, 0}}};

using Choices = std::map<std::string, std::string>;

Choices read_choices(int argc, char** argv) {
  Choices choices = {{"moduli", "6.8e5"},     {"controls", "1"},          {"noise", "0"},
                     {"truth_steps", "1"},    {"frames", "250"},          {"rate", "60"},
                     {"steps", "1"},          {"integrator", "lagged"},   {"start", "modal"},
                     {"solver", "automatic"}, {"tolerance", "1e-3"},      {"newmark_theta", "0.5"},
                     {"budget", "1e9"},       {"evaluations", "1000000"}, {"optimiser", "levenberg_marquardt"}};
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto equals = word.find('=');
    if (equals == std::string::npos || !choices.contains(word.substr(0, equals)))
      throw std::invalid_argument("\"" + word + "\" is not one of this program's choices; see experiments/bar.cpp");
    choices[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return choices;
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Hold wall() {
  return {[](const Vector3& p) { return p.x() < 1e-6 * length; }};
}

std::shared_ptr<const Body> bar(int controls) {
  Box box;
  box.extend(Vector3(0, -0.5 * edge, -0.5 * edge));
  box.extend(Vector3(length, 0.5 * edge, 0.5 * edge));
  Body body = make_body(make_tet_box(box, {20, 5, 5}, false));
  if (controls > 1) body.modulus = linear_field(body, Vector3::UnitX(), controls).field;
  return std::make_shared<Body>(std::move(body));
}

VectorX make_theta(const Motion& motion, const VectorX& moduli, double mass_damping, double stiffness_damping) {
  const int m = int(moduli.size());
  VectorX theta = VectorX::Zero(theta::size(0, m));
  for (int k = 0; k < m; ++k) theta[theta::modulus(k, m, theta.size())] = moduli[k];
  theta[theta::poissons_ratio] = poissons_ratio;
  theta[theta::mass_damping] = mass_damping;
  theta[theta::stiffness_damping] = stiffness_damping;
  theta[theta::density] = rho;
  theta.segment<3>(theta::linear_velocity) = motion.linear;
  theta.segment<3>(theta::angular_velocity) = motion.angular;
  return theta;
}

class Experiment {
 public:
  explicit Experiment(Choices choices)
      : choices_(std::move(choices)), controls_(integer("controls")), body_(bar(controls_)) {
    std::istringstream list(choices_.at("moduli"));
    std::vector<double> values;
    for (std::string item; std::getline(list, item, ',');) values.push_back(std::stod(item));
    truth_ = Eigen::Map<const VectorX>(values.data(), Eigen::Index(values.size()));
    options_.max_dt = (1.0 + 1e-9) / (real("rate") * real("steps"));
    options_.newmark_theta = real("newmark_theta");
    options_.integrator = choices_.at("integrator") == "newton" ? Integrator::Newton : Integrator::Lagged;
    if (choices_.at("solver") == "cholmod") options_.solver.kind = SolverKind::Cholmod;
    for (int f = 0; f < integer("frames"); ++f) options_.times.push_back(f / real("rate"));
    options_.holds = {wall()};
    for (int n = 0; n < body_->node_count(); ++n) rest_.push_back(body_->nodes.row(n).transpose());
  }

  json run() {
    json report;
    for (const auto& [name, value] : choices_) report["choices"][name] = value;
    report["nodes"] = body_->node_count(), report["elements"] = body_->element_count();
    report["motions"] = record();
    report["costs"] = time_steps();
    report["start"] = find_start();
    report.update(fit());
    return report;
  }

 private:
  double real(const char* name) const { return std::stod(choices_.at(name)); }
  int integer(const char* name) const { return std::stoi(choices_.at(name)); }

  /// What is seen of the three motions.
  json record() {
    json seen = json::array();
    const auto true_body = bar(int(truth_.size()));
    SimulationOptions options = options_;
    options.max_dt /= integer("truth_steps");
    const double noise = real("noise") * length;
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (const Motion& motion : motions) {
      auto frames = std::make_shared<std::vector<FrameObservations>>();
      double farthest = 0.0;
      Simulation simulation(true_body, options);
      const RolloutSummary summary =
          simulation.run(make_theta(motion, truth_, alpha, beta), [&](int frame, const State& state, auto) {
            FrameObservations at{frame};
            farthest = std::max(farthest, (state.x - true_body->nodes).rowwise().norm().maxCoeff());
            for (int n = 0; n < true_body->node_count(); ++n) {
              Vector3 position = state.x.row(n);
              for (int d = 0; d < 3 && noise > 0.0; ++d) position[d] += noise * normal(random);
              at.tracks.push_back({n, position, noise > 0.0 ? noise : 1e-3 * length});
            }
            frames->push_back(std::move(at));
            return true;
          });
      if (!summary.succeeded) throw std::runtime_error("the truth cannot be simulated: " + summary.failure);
      seen.push_back({{"name", motion.name}, {"frames", frames->size()}, {"largest_displacement", farthest}});
      observations_.push_back(std::move(frames));
    }
    return seen;
  }

  /// Of one thread: a step of the bend, a factorisation and a solve.
  json time_steps() const {
    Simulation simulation(body_, options_);
    const VectorX theta = make_theta(motions[1], mean_modulus() * VectorX::Ones(controls_), alpha, beta);
    double begin = wall_seconds();
    const RolloutSummary summary = simulation.run(theta, [](int, const State&, auto) { return true; });
    const double step = (wall_seconds() - begin) / summary.steps;
    std::vector<std::unique_ptr<ForceTerm>> terms;
    terms.push_back(make_elasticity(body_));
    StepOptions step_options;
    step_options.dt = options_.max_dt, step_options.newmark_theta = options_.newmark_theta;
    Stepper stepper(body_, std::move(terms), step_options);
    stepper.hold(held_nodes(*body_, {wall()}));
    stepper.set_parameters(theta);
    if (!stepper.prepare({body_->nodes, Points::Zero(body_->node_count(), 3)}))
      throw std::runtime_error("a step's matrix cannot be factorised");
    const auto solver = make_linear_solver(body_->pattern, options_.solver);
    constexpr int repetitions = 50;
    double factorisation = 0.0, solve = 0.0;
    const VectorX b = VectorX::Ones(3 * body_->node_count());
    VectorX x = VectorX::Zero(b.size());
    for (int i = 0; i < repetitions; ++i) {
      begin = wall_seconds();
      if (!solver->factorise(stepper.matrix())) throw std::runtime_error("a step's matrix cannot be factorised");
      factorisation += (wall_seconds() - begin) / repetitions;
      x.setZero();
      begin = wall_seconds();
      (void)solver->solve(b, x);
      solve += (wall_seconds() - begin) / repetitions;
    }
    return {{"ms_per_forward_step", 1e3 * step},
            {"ms_per_factorisation", 1e3 * factorisation},
            {"ms_per_linear_solve", 1e3 * solve},
            {"linear_solver", solver->name()},
            {"steps_per_frame", integer("steps")}};
  }

  /// Geometric.
  double mean_modulus() const {
    double sum = 0.0;
    for (const double modulus : truth_) sum += std::log(modulus);
    return std::exp(sum / double(truth_.size()));
  }

  /// From the frequencies of the bend; where they say nothing, from far off.
  json find_start() {
    moduli_ = VectorX::Constant(controls_, off * mean_modulus());
    mass_damping_ = off * alpha, stiffness_damping_ = off * beta;
    if (choices_.at("start") != "modal") return {{"by", "off"}};
    const double begin = wall_seconds();
    TrackedPoints tracked;
    tracked.rest = rest_;
    for (const FrameObservations& frame : *observations_[1]) tracked.frames[frame.frame] = frame.tracks;
    ModalStartOptions options;
    options.curve_samples = 0;
    const ModalStart found = modal_start(body_, make_theta(motions[1], moduli_, 0.0, 0.0), held_nodes(*body_, {wall()}),
                                         tracked, options_.times, options);
    json report = {{"by", found.found ? "modal" : "off"}, {"reason", found.reason}};
    report["wall_seconds"] = wall_seconds() - begin;
    if (!found.found) return report;
    moduli_ = found.moduli;
    mass_damping_ = std::max(found.mass_damping, 1e-3), stiffness_damping_ = std::max(found.stiffness_damping, 1e-5);
    report["moduli"] = std::vector<double>(moduli_.begin(), moduli_.end());
    report["log_deviations"] = std::vector<double>(found.log_deviations.begin(), found.log_deviations.end());
    report["mass_damping"] = mass_damping_, report["stiffness_damping"] = stiffness_damping_;
    return report;
  }

  Objective objective(VectorX& start) const {
    std::vector<ObservedMotion> recordings;
    const auto tracks = std::make_shared<PointTracks>(*body_, rest_);
    for (std::size_t r = 0; r < motions.size(); ++r) {
      const VectorX theta = make_theta(motions[r], moduli_, mass_damping_, stiffness_damping_);
      ObservedMotion motion{{nullptr, tracks}, body_, options_, observations_[r], {}};
      motion.options.outlier_scale = 10.0 * length;  // squares, as in the paper
      motion.options.last_frame = int(options_.times.size()) - 1;
      recordings.push_back(std::move(motion));
      start.conservativeResize(start.size() + theta.size());
      start.tail(theta.size()) = theta;
    }
    const int size = int(start.size()) / int(motions.size());
    std::vector<Parameter> list;
    const auto add = [&](const std::string& name, const char* unit, int index, double lower, double upper) {
      list.push_back({name, unit, Transform::Logarithm, index, 1.0, lower, upper, true});
      for (int r = 1; r < int(motions.size()); ++r) list.back().also.push_back(r * size + index);
    };
    for (int k = 0; k < controls_; ++k)
      add("youngs_modulus@" + std::to_string(k + 1), "Pa", theta::modulus(k, controls_, size), least_modulus, 1e9);
    add("mass_damping", "1/s", theta::mass_damping, 1e-5, 1e2);
    add("stiffness_damping", "s", theta::stiffness_damping, 1e-6, 1.0);
    return {std::move(recordings), ParameterSet(std::move(list), start)};
  }

  json fit() const {
    VectorX start;
    Objective cost = objective(start);
    OptimiserOptions options;
    options.kind =
        choices_.at("optimiser") == "nelder_mead" ? OptimiserKind::NelderMead : OptimiserKind::LevenbergMarquardt;
    options.max_iterations = integer("evaluations");
    options.step_tolerance = real("tolerance");
    options.cost_tolerance = 1e-12;  // moduli and dampings say when it is over
    const double begin = wall_seconds(), busy = processor_seconds(), budget = real("budget");
    json history = json::array();
    const OptimiserSummary summary =
        minimise(cost, cost.parameters().to_unconstrained(start), options, [&](const Iteration& i) {
          std::fprintf(stderr, "%4d %12.6g %8.2g %c %6.1f s\n", i.number, i.cost, i.damping, i.accepted ? '+' : '-',
                       wall_seconds() - begin);
          history.push_back({i.number, i.cost, wall_seconds() - begin, worst_error(cost.parameters(), i.p)});
          return wall_seconds() - begin < budget;
        });
    json report = {{"wall_seconds", wall_seconds() - begin},
                   {"processor_seconds", processor_seconds() - busy},
                   {"iterations", summary.iterations},
                   {"evaluations", summary.evaluations},
                   {"forward_steps", summary.steps},
                   {"converged", summary.converged},
                   {"reason", summary.reason},
                   {"start_cost", summary.start_cost},
                   {"cost", summary.evaluation.cost},
                   {"track_rms", summary.evaluation.track_rms()},
                   {"history", history}};
    const VectorX found = cost.parameters().to_theta(summary.p);
    const VectorX truth = true_values();
    const auto& list = cost.parameters().parameters();
    for (std::size_t i = 0; i < list.size(); ++i) {
      const double value = found[list[i].theta_index], is = truth[Eigen::Index(i)];
      report["parameters"].push_back(
          {{"name", list[i].name}, {"value", value}, {"truth", is}, {"relative_error", value / is - 1.0}});
    }
    return report;
  }

  /// Moduli at the fitted control points, then the dampings.
  VectorX true_values() const {
    if (truth_.size() != 1 && truth_.size() != controls_)
      throw std::invalid_argument("moduli: one for all, or as many as are fitted");
    VectorX truth(controls_ + 2);
    truth.head(controls_) = truth_.size() == 1 ? VectorX::Constant(controls_, truth_[0]) : truth_;
    truth.tail<2>() << alpha, beta;
    return truth;
  }

  /// Greatest relative error of a modulus.
  double worst_error(const ParameterSet& parameters, const VectorX& p) const {
    const VectorX found = parameters.to_theta(p), truth = true_values();
    double worst = 0.0;
    for (int k = 0; k < controls_; ++k)
      worst = std::max(worst, std::abs(found[parameters.parameters()[std::size_t(k)].theta_index] / truth[k] - 1.0));
    return worst;
  }

  Choices choices_;
  int controls_;
  std::shared_ptr<const Body> body_;
  SimulationOptions options_;
  std::vector<Vector3> rest_;
  std::vector<std::shared_ptr<const std::vector<FrameObservations>>> observations_;
  VectorX truth_, moduli_;
  double mass_damping_ = 0.0, stiffness_damping_ = 0.0;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  try {
    std::printf("%s\n", pliant::Experiment(pliant::read_choices(argc, argv)).run().dump(1).c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pliant_bar: %s\n", error.what());
    return 1;
  }
}
