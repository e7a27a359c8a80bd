// Moduli and dampings of an object from the motion of all its nodes (Wang 2015), as JSON on stdout.
//   pliant_tracks [NAME=VALUE]...
// object=bar|dinosaur   see tracked_objects.hpp; cell_size=L of the dinosaur [m]
// seed=N                of the bar's control points' places; 0: evenly along it
// starts=struck|deformed of the bar: with a velocity from rest, or at rest from poses in which its end was held
// task=fit|landscape|deviations
// moduli=E,E,...        of the truth, one for all or one a control point [Pa]
// controls=N            that are fitted
// noise=S               of each coordinate, times the object's size
// truth_steps=N         of the truth to one of the fit
// frames=N, rate=R      of each motion, and [1/s]
// horizon=N,N,...       frames that a fit compares, from the first, one stage after another; the start is found from
// all steps=N               of the fit to a frame solver=automatic|simplicial|cholmod, newmark_theta=T
// optimiser=levenberg_marquardt|nelder_mead
// start=modal|off       off: ten times the truth's mean modulus and dampings
// curve_samples=N       of the start's frequency match over each modulus
// tolerance=T           of ln E, ln alpha and ln beta, at which an optimiser stops; stages but the last: ten times that
// budget=S              wall time [s] after which it is stopped; evaluations=N likewise
// samples=N, from=E, to=E   of the landscape: the cost at N x N pairs of the first two moduli [Pa], all else true
//
// Without gravity, one recording a motion. Where a deformed object is at the start is known, as it would be from its
// track.

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <stdexcept>

#include "choices.hpp"
#include "elasticity/corotated.hpp"
#include "estimation/modal_start.hpp"
#include "estimation/objective.hpp"
#include "estimation/optimiser.hpp"
#include "estimation/recordings.hpp"
#include "tracked_objects.hpp"

namespace pliant {
namespace {

using nlohmann::json;

constexpr double least_modulus = 1e3;              // [Pa]
constexpr double alpha = 2e-2, beta = 1e-3;        // the truth's, as in the paper [1/s], [s]
constexpr double poissons_ratio = 0.4, rho = 1e3;  // known
constexpr double off = 10.0;

const Choices standard_choices = {{"object", "bar"},
                                  {"cell_size", "0.03"},
                                  {"seed", "0"},
                                  {"starts", "struck"},
                                  {"task", "fit"},
                                  {"moduli", "6.8e5"},
                                  {"controls", "1"},
                                  {"noise", "0"},
                                  {"truth_steps", "1"},
                                  {"frames", "250"},
                                  {"rate", "60"},
                                  {"horizon", "50"},
                                  {"steps", "4"},
                                  {"solver", "cholmod"},
                                  {"newmark_theta", "0.51"},
                                  {"optimiser", "levenberg_marquardt"},
                                  {"start", "modal"},
                                  {"curve_samples", "0"},
                                  {"tolerance", "1e-3"},
                                  {"budget", "1e9"},
                                  {"evaluations", "1000000"},
                                  {"samples", "15"},
                                  {"from", "1e4"},
                                  {"to", "1e7"}};

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

template <class Kind>
Kind kind_named(const std::map<std::string, Kind>& kinds, const std::string& name) {
  const auto found = kinds.find(name);
  if (found == kinds.end()) throw std::invalid_argument("\"" + name + "\" is not known; see experiments/tracks.cpp");
  return found->second;
}

std::vector<double> numbers(const std::string& list) {
  std::istringstream text(list);
  std::vector<double> values;
  for (std::string item; std::getline(text, item, ',');) values.push_back(std::stod(item));
  return values;
}

TrackedObject make_object(const Choices& choices, int controls) {
  if (choices.at("object") == "dinosaur") return make_dinosaur(controls, std::stod(choices.at("cell_size")));
  if (choices.at("object") == "bar")
    return make_bar(controls, unsigned(std::stoul(choices.at("seed"))), choices.at("starts") == "deformed");
  throw std::invalid_argument("\"" + choices.at("object") + "\" is not an object; see experiments/tracks.cpp");
}

struct Material {
  VectorX moduli;
  double mass_damping, stiffness_damping;
};

/// Writes the parameters of a motion into its blocks.
void set_motion(const MotionBlocks& blocks, const StartingMotion& motion, const Material& material, VectorX& theta) {
  for (std::size_t k = 0; k < blocks.youngs_moduli.size(); ++k)
    theta[blocks.youngs_moduli[k]] = material.moduli[Eigen::Index(k)];
  theta[blocks.poissons_ratio] = poissons_ratio;
  theta[blocks.mass_damping] = material.mass_damping;
  theta[blocks.stiffness_damping] = material.stiffness_damping;
  theta[blocks.density] = rho;
  theta.segment<3>(blocks.linear_velocity) = motion.linear;
  theta.segment<3>(blocks.angular_velocity) = motion.angular;
}
VectorX make_theta(const MotionLayout& layout, const StartingMotion& motion, const Material& material) {
  VectorX theta = layout.zero();
  set_motion(layout, motion, material, theta);
  return theta;
}

/// Of motions of one object, each with its own start.
JointLayout joined(const MotionLayout& one, std::size_t motions) {
  const CaptureParameters parameters{ParameterSet(one.layout(), {}, one.zero()), {one, {}}};
  return join(std::vector(motions, parameters), true);
}

class Experiment {
 public:
  explicit Experiment(Choices choices)
      : choices_(std::move(choices)),
        controls_(integer("controls")),
        object_(make_object(choices_, controls_)),
        layout_({.moduli = controls_}),
        body_(object_.body) {
    options_.blocks = layout_;
    const std::vector<double> moduli = numbers(choices_.at("moduli"));
    truth_ = Eigen::Map<const VectorX>(moduli.data(), Eigen::Index(moduli.size()));
    if (truth_.size() != 1 && truth_.size() != controls_)
      throw std::invalid_argument("moduli: one for all, or as many as are fitted");
    options_.max_dt = (1.0 + 1e-9) / (real("rate") * real("steps"));
    options_.newmark_theta = real("newmark_theta");
    options_.solver.kind = kind_named<SolverKind>({{"automatic", SolverKind::Automatic},
                                                   {"simplicial", SolverKind::Simplicial},
                                                   {"cholmod", SolverKind::Cholmod}},
                                                  choices_.at("solver"));
    for (int f = 0; f < integer("frames"); ++f) options_.times.push_back(f / real("rate"));
    options_.holds = {object_.held};
    held_ = held_nodes(*body_, options_.holds);
    for (int n = 0; n < body_->node_count(); ++n) rest_.push_back(body_->nodes.row(n).transpose());
  }

  json run() {
    json report;
    for (const auto& [name, value] : choices_) report["choices"][name] = value;
    double load = 0.0;
    if (getloadavg(&load, 1) == 1) report["load_at_start"] = load;
    report["nodes"] = body_->node_count(), report["elements"] = body_->element_count();
    report["motions"] = record();
    if (choices_.at("task") == "landscape") {
      report["landscape"] = landscape();
      return report;
    }
    if (choices_.at("task") == "deviations") {
      report["deviations"] = deviations();
      return report;
    }
    report["costs"] = time_steps();
    report["start"] = find_start();
    report.update(fit());
    return report;
  }

 private:
  double real(const char* name) const { return std::stod(choices_.at(name)); }
  /// Last frames that the stages of a fit compare.
  std::vector<int> horizons() const {
    std::vector<int> last;
    for (const double count : numbers(choices_.at("horizon")))
      last.push_back(std::min(int(count), integer("frames")) - 1);
    return last;
  }
  int integer(const char* name) const { return std::stoi(choices_.at(name)); }

  /// What is seen of the motions. Without noise residuals still need a scale, a thousandth of the size.
  json record() {
    json seen = json::array();
    const TrackedObject truth = make_object(choices_, int(truth_.size()));
    SimulationOptions options = options_;
    options.max_dt /= integer("truth_steps");
    const MotionLayout layout({.moduli = int(truth_.size())});
    options.blocks = layout;
    std::mt19937 random(7);
    for (std::size_t m = 0; m < object_.motions.size(); ++m) {
      const StartingMotion& motion = object_.motions[m];
      const int last = m == observed_motion_for_modes() ? integer("frames") - 1 : horizons().back();
      auto frames = std::make_shared<std::vector<FrameObservations>>();
      double farthest = 0.0;
      options.start = start_of(truth, motion, options);
      starts_.push_back(options.start);
      Simulation simulation(truth.body, options);
      const VectorX theta = make_theta(layout, motion, {truth_, alpha, beta});
      const RolloutSummary summary =
          simulation.run(theta, MatrixX(theta.size(), 0), last, [&](int frame, const State& state, auto) {
            farthest = std::max(farthest, (state.x - body_->nodes).rowwise().norm().maxCoeff());
            frames->push_back({frame, {}, followed(state.x, random)});
            return true;
          });
      if (!summary.succeeded) throw std::runtime_error("the truth cannot be simulated: " + summary.failure);
      seen.push_back({{"name", motion.name}, {"frames", frames->size()}, {"largest_displacement", farthest}});
      observations_.push_back(std::move(frames));
    }
    return seen;
  }

  /// Where a motion's nodes are when it begins: in the equilibrium in which a part of the object is led; empty where
  /// none is, and it begins at rest.
  Points start_of(const TrackedObject& object, const StartingMotion& motion, SimulationOptions options) const {
    if (!motion.led) return {};
    options.start = {};
    options.holds.push_back(*motion.led);
    options.is_static = true;
    options.times = {0.0};
    Points start;
    const VectorX theta = make_theta(MotionLayout({.moduli = int(truth_.size())}), motion, {truth_, alpha, beta});
    const RolloutSummary summary = Simulation(object.body, options).run(theta, [&](int, const State& state, auto) {
      start = state.x;
      return true;
    });
    if (!summary.succeeded) throw std::runtime_error("the deformed start has no equilibrium: " + summary.failure);
    return start;
  }

  std::vector<TrackObservation> followed(const Points& positions, std::mt19937& random) const {
    const double noise = real("noise") * object_.size;
    std::normal_distribution<double> normal;
    std::vector<TrackObservation> tracks;
    for (int n = 0; n < body_->node_count(); ++n) {
      Vector3 position = positions.row(n);
      for (int d = 0; d < 3 && noise > 0.0; ++d) position[d] += noise * normal(random);
      tracks.push_back({n, position, noise > 0.0 ? noise : 1e-3 * object_.size});
    }
    return tracks;
  }

  /// Of one thread, in the last of the motions: a step, a step of the reverse sweep, a factorisation and a solve.
  json time_steps() const {
    Simulation simulation(body_, options_);
    const VectorX theta =
        make_theta(layout_, object_.motions.back(), {mean_modulus() * VectorX::Ones(controls_), alpha, beta});
    const int last = std::min(15, integer("frames") - 1);
    double begin = wall_seconds();
    const RolloutSummary summary =
        simulation.run(theta, MatrixX(theta.size(), 0), last, [](int, const State&, auto) { return true; });
    const double forward = (wall_seconds() - begin) / summary.steps;
    VectorX theta_bar;
    begin = wall_seconds();
    (void)simulation.run_adjoint(
        theta, last, [](int, const State&) { return true; },
        [](int, const State&, Points& x_bar) { x_bar.array() += 1.0; }, theta_bar);
    const double both = (wall_seconds() - begin) / summary.steps;
    json report = {{"ms_per_forward_step", 1e3 * forward},
                   {"ms_per_adjoint_step", 1e3 * (both - forward)},
                   {"steps_per_frame", integer("steps")}};
    report.update(time_solver(theta));
    return report;
  }

  json time_solver(const VectorX& theta) const {
    std::vector<std::unique_ptr<ForceTerm>> terms;
    terms.push_back(make_elasticity(body_, layout_));
    StepOptions step_options;
    step_options.dt = options_.max_dt, step_options.newmark_theta = options_.newmark_theta;
    Stepper stepper(body_, std::move(terms), layout_, step_options);
    stepper.hold(held_);
    stepper.set_parameters(theta);
    if (!stepper.prepare({body_->nodes, Points::Zero(body_->node_count(), 3)}))
      throw std::runtime_error("a step's matrix cannot be factorised");
    const auto solver = make_linear_solver(body_->pattern, options_.solver);
    constexpr int repetitions = 10;
    double factorisation = 0.0, solve = 0.0;
    const VectorX b = VectorX::Ones(3 * body_->node_count());
    for (int i = 0; i < repetitions; ++i) {
      double begin = wall_seconds();
      if (!solver->factorise(stepper.matrix())) throw std::runtime_error("a step's matrix cannot be factorised");
      factorisation += (wall_seconds() - begin) / repetitions;
      VectorX x = VectorX::Zero(b.size());
      begin = wall_seconds();
      (void)solver->solve(b, x);
      solve += (wall_seconds() - begin) / repetitions;
    }
    return {{"linear_solver", solver->name()},
            {"ms_per_factorisation", 1e3 * factorisation},
            {"ms_per_linear_solve", 1e3 * solve}};
  }

  /// Geometric.
  double mean_modulus() const {
    double sum = 0.0;
    for (const double modulus : truth_) sum += std::log(modulus);
    return std::exp(sum / double(truth_.size()));
  }

  /// From the frequencies of the motion that shows most of them; where none says anything, from far off.
  json find_start() {
    moduli_ = VectorX::Constant(controls_, off * mean_modulus());
    mass_damping_ = off * alpha, stiffness_damping_ = off * beta;
    if (choices_.at("start") != "modal") return {{"by", "off"}};
    const double begin = wall_seconds();
    const ModalStart found = modal_start_of(observed_motion_for_modes());
    json report = {{"by", found.found ? "modal" : "off"}, {"reason", found.reason}};
    report["wall_seconds"] = wall_seconds() - begin;
    if (!found.found) return report;
    moduli_ = found.moduli;
    mass_damping_ = std::max(found.mass_damping, 1e-3), stiffness_damping_ = std::max(found.stiffness_damping, 1e-5);
    report["moduli"] = list(moduli_);
    report["log_deviations"] = list(found.log_deviations);
    std::fprintf(stderr, "start: %s\n", report.dump().c_str());
    report["mass_damping"] = mass_damping_, report["stiffness_damping"] = stiffness_damping_;
    for (const MatchCurve& curve : found.curves)
      report["curves"].push_back(
          {{"control", curve.control + 1}, {"moduli", list(curve.moduli)}, {"mismatch", list_or_null(curve.mismatch)}});
    return report;
  }

  /// The bar's bend, the dinosaur's swing: where the lowest vibrations are.
  std::size_t observed_motion_for_modes() const { return object_.motions.size() > 1 ? 1 : 0; }

  ModalStart modal_start_of(std::size_t motion) const {
    TrackedPoints tracked;
    tracked.rest = rest_;
    for (const FrameObservations& frame : *observations_[motion]) tracked.frames[frame.frame] = frame.tracks;
    ModalStartOptions options;
    options.curve_samples = integer("curve_samples");
    const VectorX theta = make_theta(layout_, object_.motions[motion], {moduli_, 0.0, 0.0});
    return modal_start(body_, layout_, theta, held_, tracked, options_.times, options);
  }

  static std::vector<double> list(const VectorX& values) { return {values.begin(), values.end()}; }
  static json list_or_null(const VectorX& values) {
    json out = json::array();
    for (const double value : values) out.push_back(std::isfinite(value) ? json(value) : json());
    return out;
  }

  json landscape() {
    if (controls_ < 2) throw std::invalid_argument("a landscape needs two controls");
    moduli_ = true_values().head(controls_), mass_damping_ = alpha, stiffness_damping_ = beta;
    VectorX theta;
    Objective cost = objective(horizons().back(), theta);
    VectorX p = cost.parameters().to_unconstrained(theta);  // logarithms, the moduli first
    const int samples = integer("samples");
    const VectorX logs = VectorX::LinSpaced(samples, std::log(real("from")), std::log(real("to")));
    json rows = json::array();
    for (const double second : logs) {
      VectorX row(samples);
      for (int i = 0; i < samples; ++i) {
        p[0] = logs[i], p[1] = second;
        const CostEvaluation e = cost.evaluate(p);
        row[i] = e.succeeded ? e.cost : std::nan("");
      }
      rows.push_back(list_or_null(row));
      std::fprintf(stderr, "%zu of %d rows\n", rows.size(), samples);
    }
    return {{"moduli", list(logs.array().exp())}, {"truth", list(true_values().head(2))}, {"costs", rows}};
  }

  /// Standard deviations of ln E, ln alpha and ln beta that the noise leaves, to first order about the truth, for each
  /// number of frames: no unbiased estimate has smaller ones.
  json deviations() {
    moduli_ = true_values().head(controls_), mass_damping_ = alpha, stiffness_damping_ = beta;
    json out = json::array();
    for (const int last_frame : horizons()) {
      VectorX theta;
      Objective cost = objective(last_frame, theta);
      const CostEvaluation e = cost.linearise(cost.parameters().to_unconstrained(theta));
      if (!e.succeeded) throw std::runtime_error("the truth cannot be simulated: " + e.failure);
      const VectorX variances = e.gauss_newton.inverse().diagonal();
      out.push_back({{"frames", last_frame + 1}, {"log_deviations", list(variances.cwiseSqrt())}});
    }
    return out;
  }

  Objective objective(int last_frame, VectorX& start) const {
    std::vector<ObservedMotion> recordings;
    const auto tracks = std::make_shared<PointTracks>(*body_, rest_);
    const JointLayout joint = joined(layout_, object_.motions.size());
    start = VectorX::Zero(joint.layout.size());
    for (std::size_t r = 0; r < object_.motions.size(); ++r) {
      set_motion(joint.blocks[r].motion, object_.motions[r], {moduli_, mass_damping_, stiffness_damping_}, start);
      ObservedMotion motion{{nullptr, tracks}, body_, options_, observations_[r], {}};
      motion.simulation.blocks = joint.blocks[r].motion;
      motion.simulation.start = starts_[r];
      motion.options.outlier_scale = 10.0 * object_.size;  // squares, as in the paper
      motion.options.last_frame = last_frame;
      recordings.push_back(std::move(motion));
    }
    const MotionBlocks& shared = joint.blocks.front().motion;
    std::vector<Parameter> list;
    for (std::size_t k = 0; k < shared.youngs_moduli.size(); ++k)
      list.push_back({"youngs_modulus@" + std::to_string(k + 1), "Pa", Transform::Logarithm, shared.youngs_moduli[k],
                      1.0, least_modulus, 1e9, true});
    list.push_back({"mass_damping", "1/s", Transform::Logarithm, shared.mass_damping, 1.0, 1e-5, 1e2, true});
    list.push_back({"stiffness_damping", "s", Transform::Logarithm, shared.stiffness_damping, 1.0, 1e-6, 1.0, true});
    return {std::move(recordings), ParameterSet(joint.layout, std::move(list), start)};
  }

  /// From few frames to all: where simulation and truth have not yet drifted apart by half a swing, valleys are wide.
  json fit() const {
    OptimiserOptions options;
    options.kind = kind_named<OptimiserKind>(
        {{"levenberg_marquardt", OptimiserKind::LevenbergMarquardt}, {"nelder_mead", OptimiserKind::NelderMead}},
        choices_.at("optimiser"));
    options.max_iterations = integer("evaluations");
    options.cost_tolerance = 1e-12;  // moduli and dampings say when it is over
    const std::vector<int> last_frames = horizons();
    const double begin = wall_seconds(), busy = processor_seconds(), budget = real("budget");
    json report, history = json::array(), stages = json::array();
    int evaluations = 0;
    long long steps = 0;
    VectorX p;
    for (std::size_t stage = 0; stage < last_frames.size(); ++stage) {
      const bool is_last = stage + 1 == last_frames.size();
      VectorX start;
      Objective cost = objective(last_frames[stage], start);
      if (stage == 0) p = cost.parameters().to_unconstrained(start);
      options.step_tolerance = (is_last ? 1.0 : 10.0) * real("tolerance");
      const OptimiserSummary summary = minimise(cost, p, options, [&](const Iteration& i) {
        std::fprintf(stderr, "%4d %4d %12.6g %8.2g %c %6.1f s\n", last_frames[stage] + 1, i.number, i.cost, i.damping,
                     i.accepted ? '+' : '-', wall_seconds() - begin);
        history.push_back({history.size() + 1, i.cost, wall_seconds() - begin, worst_error(cost.parameters(), i.p)});
        return wall_seconds() - begin < budget;
      });
      p = summary.p;
      evaluations += summary.evaluations, steps += summary.steps;
      stages.push_back({{"frames", last_frames[stage] + 1},
                        {"evaluations", summary.evaluations},
                        {"start_cost", summary.start_cost},
                        {"cost", summary.evaluation.cost},
                        {"wall_seconds", wall_seconds() - begin},
                        {"processor_seconds", processor_seconds() - busy},
                        {"reason", summary.reason},
                        {"parameters", compare(cost.parameters(), p)}});
      report = {{"converged", summary.converged && is_last},
                {"reason", summary.reason},
                {"cost", summary.evaluation.cost},
                {"track_rms", summary.evaluation.track_rms()},
                {"parameters", stages.back()["parameters"]}};
      if (summary.interrupted || !summary.succeeded) break;
    }
    report["start_cost"] = stages.front()["start_cost"];
    report["wall_seconds"] = wall_seconds() - begin, report["processor_seconds"] = processor_seconds() - busy;
    report["evaluations"] = evaluations, report["forward_steps"] = steps;
    report["iterations"] = history.size();
    report["history"] = std::move(history), report["stages"] = std::move(stages);
    return report;
  }

  json compare(const ParameterSet& parameters, const VectorX& p) const {
    const VectorX found = parameters.to_theta(p), truth = true_values();
    json out = json::array();
    for (std::size_t i = 0; i < parameters.parameters().size(); ++i) {
      const Parameter& parameter = parameters.parameters()[i];
      const double value = found[parameter.at], is = truth[Eigen::Index(i)];
      out.push_back({{"name", parameter.name}, {"value", value}, {"truth", is}, {"relative_error", value / is - 1.0}});
    }
    return out;
  }

  /// Moduli at the fitted control points, then the dampings.
  VectorX true_values() const {
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
      worst = std::max(worst, std::abs(found[parameters.parameters()[std::size_t(k)].at] / truth[k] - 1.0));
    return worst;
  }

  Choices choices_;
  int controls_;
  TrackedObject object_;
  MotionLayout layout_;
  std::shared_ptr<const Body> body_;
  SimulationOptions options_;
  std::vector<int> held_;
  std::vector<Vector3> rest_;
  std::vector<std::shared_ptr<const std::vector<FrameObservations>>> observations_;
  std::vector<Points> starts_;  // one a motion; empty: at rest
  VectorX truth_, moduli_;
  double mass_damping_ = 0.0, stiffness_damping_ = 0.0;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Experiment>("pliant_tracks", argc, argv, pliant::standard_choices);
}
