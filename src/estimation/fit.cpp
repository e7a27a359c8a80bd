#include "estimation/fit.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numeric>
#include <tuple>

#include "base/error.hpp"
#include "capture/find_plane.hpp"
#include "estimation/notes.hpp"

namespace pliant {

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void apply_overrides(ParameterSet& parameters, const FitOptions& options) {
  VectorX theta = parameters.reference();
  std::vector<Parameter> list = parameters.parameters();
  for (const auto& entry : options.parameters) {
    const std::string& name = entry.first;
    const FitOptions::Override& change = entry.second;
    const auto it = std::find_if(list.begin(), list.end(), [&](const Parameter& p) { return p.name == name; });
    if (it == list.end())
      throw InputError({{}, "there is no parameter \"" + name + "\" in this recording", "", "see `pliant fit --help`"});
    if (change.start) {
      if (change.start->size() != it->dimension() || it->transform == Transform::PlanePosition)
        throw InputError({{},
                          "the start of " + name + " has " + std::to_string(change.start->size()) + " numbers",
                          it->transform == Transform::PlanePosition ? "planes to start where the capture has them"
                                                                    : std::to_string(it->dimension()) + " numbers",
                          ""});
      theta.segment(it->theta_index, it->dimension()) = *change.start;
      if (it->transform == Transform::Logarithm && !((*change.start)[0] > 0.0))
        throw InputError({{}, "the start of " + name + " is not positive", "a number above 0", ""});
    }
    if (change.estimated) it->estimated = *change.estimated;
    if (change.prior_std) it->prior_std = *change.prior_std;
  }
  parameters = ParameterSet(std::move(list), std::move(theta));
}

/// Puts planes that are only roughly known where the depth images show them. Returns the numbers of those found.
std::vector<int> take_planes_from_images(Capture& capture) {
  std::vector<int> found;
  for (int i = 0; i < int(capture.planes.size()); ++i) {
    Plane& plane = capture.planes[std::size_t(i)];
    if (plane.known) continue;
    const auto seen = find_plane(capture, plane);
    if (!seen) continue;
    plane.point = seen->point;
    plane.normal = seen->normal;
    found.push_back(i);
  }
  return found;
}

/// Thousands of readings fix a visible plane; what is left is the sensor's bias and the softness of contact, about this
/// part of the object's size, and as many radians.
constexpr double seen_plane_std = 0.003;

void trust_planes_seen(ParameterSet& parameters, const std::vector<int>& planes) {
  std::vector<Parameter> list = parameters.parameters();
  for (Parameter& p : list)
    for (const int plane : planes)
      if (p.theta_index == theta::plane_point(plane)) p.prior_std = seen_plane_std;
  parameters = ParameterSet(std::move(list), parameters.reference());
}

class Fit {
 public:
  Fit(const Capture& capture, const std::vector<ObservedFrame>& observed, const FitOptions& options,
      const FitMonitor& monitor, FitState state)
      : options_(options), monitor_(monitor), state_(std::move(state)) {
    capture_ = capture;
    require_fittable(capture_);
    const std::vector<int> planes_seen = take_planes_from_images(capture_);
    for (const int plane : planes_seen)
      outcome_.notes.push_back(
          "Plane " + std::to_string(plane + 1) +
          " is visible in the depth images; the fit starts from, and trusts, where it is seen there.");
    tracked_ = tracked_points(capture_);
    observations_ = std::make_shared<std::vector<FrameObservations>>(frame_observations(capture_, observed, tracked_));
    if (observations_->empty())
      throw InputError({{capture.file},
                        "no frame shows any point of the object",
                        "depth images or clouds that see it",
                        "run `pliant check` on the capture to see what the cameras saw"});
    controls_ = capture_.regions.empty() ? options_.control_points : int(capture_.regions.size()) + 1;
    parameters_ = default_parameters(capture_, enclosed_volume(*capture_.surface), controls_);
    trust_planes_seen(parameters_, planes_seen);
    apply_overrides(parameters_, options_);
    const double band = std::max(options_.wide_band, options_.fine_band) * 1.25;
    distance_ = capture_distance(capture_, band);
    size_ = object_size(capture_);
    coarse_ = make_level(options_.coarse_cells, band);
    fine_ = make_level(options_.cells, band);
    last_frame_ = std::min(int(fine_.simulation.times.size()) - 1, observations_->back().frame);
    horizon_start_ = first_frame_of_interest();
  }

  FitOutcome run() {
    outcome_.start_theta = parameters_.reference();
    if (!options_.parameters.contains("youngs_modulus") || !options_.parameters.at("youngs_modulus").start)
      scanned_ = true;
    estimate_initial_motion();
    if (scanned_) scan();
    follow_starts();
    refine();
    return std::move(outcome_);
  }

 private:
  static void require_fittable(const Capture& capture) {
    const auto refuse = [&](const std::string& found, const std::string& advice) {
      throw InputError({{capture.file}, found, "an object seen by depth cameras, clouds or markers", advice});
    };
    if (!capture.surface) refuse("there is no scan of the object at rest", "add [object] surface");
    if (capture.depth.empty() && capture.clouds.empty() && capture.markers.empty())
      refuse("there are no depth cameras, no clouds and no markers", "");
    if (capture.is_static && capture.fixed.empty() && capture.planes.empty())
      refuse("the recording is static, but nothing holds the object",
             "add the [[fixed]] region that it hangs from, or the [[plane]] that it rests on");
    if (capture.shape_is == ShapeIs::Static)
      refuse("the scan was taken sagging (shape_is = \"static\")",
             "scan the object free of load; load-free shapes are not estimated in this version");
    if (capture.initial.released)
      refuse("the object is released from a held, deformed pose ([initial] released)",
             "start the recording in the scanned pose");
    if (!capture.is_static && capture.frame_count() - capture.start_frame < 2)
      refuse("fewer than two frames follow start_frame", "record longer");
  }

  Discretisation make_level(double cells, double band) const {
    SimulationOptions settings;
    settings.newmark_theta = options_.newmark_theta;
    settings.solver.kind = options_.solver;
    settings.solver.tolerance = options_.solver_tolerance;
    settings.hold_strongly = options_.hold_strongly;
    settings.integrator = options_.integrator;
    const Resolution resolution{
        options_.element, {options_.control_points, options_.control_weights}, cells, options_.steps, band};
    return discretise(capture_, distance_, resolution, parameters_.reference(), settings, tracked_.rest);
  }

  /// Before this frame the object only flies or hangs; stiffness shows after it.
  int first_frame_of_interest() const { return capture_.is_static ? last_frame_ : std::max(1, last_frame_ / 3); }

  Objective make_objective(const Discretisation& level, const ParameterSet& parameters, double band,
                           int last_frame) const {
    ObjectiveOptions o;
    o.outlier_scale = band * size_;
    o.last_frame = last_frame;
    return {level.mismatch, level.body, level.simulation, observations_, parameters, o};
  }

  static OptimiserState start_of(const ParameterSet& parameters) {
    return {0, parameters.to_unconstrained(parameters.reference()), {}};
  }

  bool interrupted() const { return monitor_.interrupted && monitor_.interrupted(); }

  void emit(FitEvent event) {
    const std::lock_guard lock(mutex_);
    if (monitor_.on_event) monitor_.on_event(event);
    outcome_.history.push_back(std::move(event));
  }
  void save_state() {
    if (monitor_.on_state) monitor_.on_state(state_);
  }

  OptimiserSummary optimise(Objective& objective, const OptimiserState& from, const std::string& stage, int start,
                            int iterations, int& counter, double done_from, double done_to,
                            const std::function<void(const OptimiserState&)>& on_state = {}) {
    OptimiserOptions o;
    o.kind = options_.optimiser;
    o.max_iterations = iterations;
    const int first = counter;
    counter += from.iterations;
    OptimiserSummary s = minimise(objective, from, o, [&](const Iteration& i) {
      ++counter;
      if (on_state) on_state(i.state());
      const double part = double(counter - first) / iterations;
      emit({stage, start, counter, i.cost, i.damping, i.surface_rms, objective.parameters().to_theta(i.p),
            done_from + (done_to - done_from) * std::min(1.0, part)});
      return !interrupted();
    });
    const std::lock_guard lock(mutex_);
    outcome_.forward_steps += s.steps;
    return s;
  }

  /// Velocities and gravity that are unknown, from the first frames, at a middling stiffness.
  void estimate_initial_motion() {
    if (state_.motion) {
      set_reference(*state_.motion);
      return;
    }
    ParameterSet motion = parameters_;
    bool any = false;
    for (const Parameter& p : parameters_.parameters()) {
      const bool moves =
          p.estimated && (p.name == "linear_velocity" || p.name == "angular_velocity" || p.name == "gravity");
      motion.set_estimated(p.name, moves);
      any = any || moves;
    }
    if (!any) return;
    int counter = 0;
    for (const int part : {8, 4}) {
      const int horizon = std::max(2, last_frame_ / part);
      Objective objective = make_objective(coarse_, motion, options_.wide_band, std::min(horizon, last_frame_));
      const OptimiserSummary s = optimise(objective, start_of(motion), "motion", 0, 12, counter, 0.0, 0.05);
      if (s.succeeded) motion.set_reference(motion.to_theta(s.p));
      if (interrupted()) return;
    }
    set_reference(motion.reference());
    state_.motion = motion.reference();
    save_state();
  }

  void set_reference(const VectorX& theta) { parameters_.set_reference(theta); }

  /// At rest every softer body hangs lower and costs more equilibria: from stiff to soft, until it is clear that the
  /// valley was passed, or that nothing softer can hold itself up.
  template <class Try>
  void scan_downwards(int count, Try&& try_value) {
    double least = std::numeric_limits<double>::infinity();
    int worse = 0;
    for (int i = 0; i < count; ++i) state_.scan[std::size_t(i)] = {0.0, std::numeric_limits<double>::infinity()};
    for (int i = count - 1; i >= 0 && !interrupted(); --i) {
      try_value(i);
      const double cost = state_.scan[std::size_t(i)].second;
      worse = cost > 1.2 * least ? worse + 1 : 0;
      if (!std::isfinite(cost) || worse == 2) break;
      least = std::min(least, cost);
    }
  }

  /// Young's modulus over decades of the stress under the object's own weight.
  void scan() {
    const VectorX theta = parameters_.reference();
    const double g = std::max(theta::vector_at(theta, theta::gravity).norm(), 0.1);
    const double stress = theta[theta::density] * g * size_;
    const int count = 4 * options_.scan_per_decade + 1;
    if (int(state_.scan.size()) != count) {
      state_.scan.assign(std::size_t(count), {});
      std::atomic<int> done = 0;
      const auto try_value = [&](int i) {
        VectorX trial = theta;
        set_moduli(trial, controls_, stress * std::pow(10.0, double(i) / options_.scan_per_decade));
        state_.scan[std::size_t(i)] = {trial[theta::youngs_modulus], std::numeric_limits<double>::infinity()};
        if (interrupted()) return;
        ParameterSet fixed = parameters_;
        for (const Parameter& p : parameters_.parameters()) fixed.set_estimated(p.name, false);
        fixed.set_reference(trial);
        Objective objective = make_objective(coarse_, fixed, options_.wide_band, last_frame_);
        const CostEvaluation e = objective.evaluate(VectorX(0));
        if (e.succeeded) state_.scan[std::size_t(i)].second = e.cost;
        emit({"scan", 0, i + 1, e.cost, 0.0, e.surface_rms(), trial, 0.05 + 0.1 * double(++done) / count});
      };
      if (capture_.is_static)
        scan_downwards(count, try_value);
      else
        tbb::parallel_for(0, count, try_value, tbb::simple_partitioner());
      if (interrupted()) {
        state_.scan.clear();
        outcome_.interrupted = true;
        return;
      }
      save_state();
    }
    // Every start is a valley of the scan before it is merely low: neighbours lead to the same place.
    std::vector<int> order(state_.scan.size());
    std::iota(order.begin(), order.end(), 0);
    const auto cost = [&](int i) { return state_.scan[std::size_t(i)].second; };
    const auto is_valley = [&](int i) {
      return (i == 0 || cost(i) <= cost(i - 1)) && (i + 1 == int(order.size()) || cost(i) <= cost(i + 1));
    };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      if (is_valley(a) != is_valley(b)) return is_valley(a);
      return cost(a) < cost(b);
    });
    const double least = std::min_element(state_.scan.begin(), state_.scan.end(), [](const auto& a, const auto& b) {
                           return a.second < b.second;
                         })->second;
    constexpr double hopeless = 4.0;  // valleys this much above the lowest are not worth following
    for (const int i : order) {
      if (int(start_moduli_.size()) >= options_.starts || !std::isfinite(cost(i))) break;
      if (cost(i) > hopeless * least) continue;
      start_moduli_.push_back(state_.scan[std::size_t(i)].first);
    }
    if (start_moduli_.empty())
      throw InputError(
          {{capture_.file},
           "no stiffness between " + std::to_string(stress) + " Pa and ten thousand times that can be simulated",
           "",
           "check mass, gravity and the size of the scan"});
    set_moduli(outcome_.start_theta, controls_, start_moduli_.front());
  }

  void follow_starts() {
    if (outcome_.interrupted) return;
    if (!scanned_) start_moduli_ = {parameters_.reference()[theta::youngs_modulus]};
    const std::size_t count = start_moduli_.size();
    if (state_.starts.size() == count) {
      outcome_.starts = state_.starts;
      return;
    }
    std::vector<FitStart> starts(count);
    tbb::parallel_for(
        std::size_t(0), count, [&](std::size_t i) { starts[i] = follow(int(i), start_moduli_[i]); },
        tbb::simple_partitioner());
    if (interrupted()) outcome_.interrupted = true;
    outcome_.starts = starts;
    if (outcome_.interrupted) return;  // half-followed starts are a result, but nothing to go on from
    state_.starts = std::move(starts);
    save_state();
  }

  /// One start on the coarse grid: wide band, horizon growing as the early frames match.
  FitStart follow(int index, double modulus) {
    ParameterSet parameters = parameters_;
    VectorX theta = parameters_.reference();
    if (scanned_) set_moduli(theta, controls_, modulus);
    parameters.set_reference(theta);
    // Poisson's ratio is told from the rest only once the fit is close.
    parameters.set_estimated("poisson_ratio", false);
    FitStart start;
    start.start = theta;
    int counter = 0;
    for (const double part : {0.6, 1.0, 1.0}) {
      const bool last = part == 1.0 && counter > 0;
      const double from = 0.15 + 0.3 * (part < 1.0 ? 0.0 : 0.4);
      Objective objective =
          make_objective(coarse_, parameters, options_.wide_band, std::max(horizon_start_, int(part * last_frame_)));
      const OptimiserSummary s =
          optimise(objective, start_of(parameters), "coarse", index, last ? 10 : 5, counter, from, from + 0.15);
      start.iterations += s.iterations;
      start.converged = s.converged;
      start.reason = s.reason;
      if (!s.succeeded) {
        start.cost = std::numeric_limits<double>::infinity();
        start.final = parameters.reference();
        return start;
      }
      if (counter == s.iterations) start.start_cost = s.start_cost;
      start.cost = s.evaluation.cost;
      parameters.set_reference(parameters.to_theta(s.p));
      start.final = parameters.reference();
      if (interrupted()) break;
      if (last) break;
    }
    return start;
  }

  void refine() {
    VectorX theta = parameters_.reference();
    const auto best = std::min_element(outcome_.starts.begin(), outcome_.starts.end(),
                                       [](const FitStart& a, const FitStart& b) { return a.cost < b.cost; });
    const int index = best == outcome_.starts.end() ? 0 : int(best - outcome_.starts.begin());
    if (best != outcome_.starts.end() && std::isfinite(best->cost)) theta = best->final;
    const bool was_interrupted = outcome_.interrupted;
    ParameterSet parameters = parameters_;
    int counter = 0;
    OptimiserSummary s;
    FitState::Fine now{0, theta, {}};
    if (state_.fine) now = *state_.fine;
    for (; now.band < 2; ++now.band, now.optimiser = {}) {
      const bool last = now.band == 1;
      if (was_interrupted && !last) continue;
      parameters.set_reference(now.reference);
      if (now.optimiser.p.size() == 0) now.optimiser = start_of(parameters);
      const int iterations = outcome_.interrupted ? 1
                             : last               ? options_.max_iterations
                                                  : std::max(1, options_.max_iterations / 4);
      Objective objective =
          make_objective(fine_, parameters, last ? options_.fine_band : options_.wide_band, last_frame_);
      s = optimise(objective, now.optimiser, last ? "fine" : "fine, wide band", index, iterations, counter,
                   last ? 0.6 : 0.45, last ? 1.0 : 0.6, [&](const OptimiserState& optimiser) {
                     if (outcome_.interrupted) return;  // a last look at what was reached is no state to go on from
                     state_.fine = {now.band, now.reference, optimiser};
                     save_state();
                   });
      if (!s.succeeded) break;
      now.reference = parameters.to_theta(s.p);
      if (s.interrupted) outcome_.interrupted = true;
    }
    parameters.set_reference(now.reference);
    finish(parameters, s);
  }

  /// Starts run side by side; their history is told in an order that does not depend on who was faster.
  void sort_history() {
    const auto rank = [](const FitEvent& e) {
      return e.stage == "motion" ? 0 : e.stage == "scan" ? 1 : e.stage == "coarse" ? 2 : 3;
    };
    std::ranges::stable_sort(outcome_.history, {},
                             [&](const FitEvent& e) { return std::tuple(rank(e), e.start, e.iteration); });
  }

  void finish(ParameterSet& parameters, OptimiserSummary& s) {
    sort_history();
    outcome_.discretisation = fine_;
    outcome_.cells = options_.cells;
    outcome_.converged = s.converged && !outcome_.interrupted;
    outcome_.reason = outcome_.interrupted ? "interrupted" : s.reason;
    outcome_.theta = parameters.reference();
    outcome_.parameters = parameters;
    outcome_.final_cost = s.evaluation.cost;
    outcome_.start_cost = start_cost_on_fine();
    if (s.succeeded && s.evaluation.gauss_newton.size() == 0 && parameters.dimension() > 0) {
      Objective objective = make_objective(fine_, parameters, options_.fine_band, last_frame_);
      s.evaluation = objective.linearise(parameters.to_unconstrained(parameters.reference()));
    }
    outcome_.evaluation = std::move(s.evaluation);
    if (outcome_.evaluation.succeeded && parameters.dimension() > 0) {
      outcome_.covariance = parameter_covariance(outcome_.evaluation);
      outcome_.std = outcome_.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
      const VectorX inverse = outcome_.std.cwiseMax(1e-300).cwiseInverse();
      outcome_.correlation = inverse.asDiagonal() * outcome_.covariance * inverse.asDiagonal();
    }
    if (outcome_.evaluation.succeeded && !outcome_.interrupted) time_steps(parameters);
    add_notes(outcome_, capture_);
  }

  void time_steps(const ParameterSet& parameters) {
    Objective objective = make_objective(fine_, parameters, options_.fine_band, std::min(last_frame_, 20));
    const VectorX p = parameters.to_unconstrained(parameters.reference());
    auto begin = std::chrono::steady_clock::now();
    const CostEvaluation forward = objective.evaluate(p);
    const double forward_seconds = seconds_since(begin);
    begin = std::chrono::steady_clock::now();
    const CostEvaluation both = objective.gradient(p);
    const double both_seconds = seconds_since(begin);
    if (forward.steps == 0 || both.steps == 0) return;
    outcome_.ms_per_forward_step = 1000.0 * forward_seconds / forward.steps;
    outcome_.ms_per_adjoint_step = 1000.0 * std::max(0.0, both_seconds - forward_seconds) / both.steps;
  }

  double start_cost_on_fine() const {
    ParameterSet fixed = parameters_;
    for (const Parameter& p : parameters_.parameters()) fixed.set_estimated(p.name, false);
    fixed.set_reference(outcome_.start_theta);
    Objective objective = make_objective(fine_, fixed, options_.fine_band, last_frame_);
    return objective.evaluate(VectorX(0)).cost;
  }

  FitOptions options_;
  FitMonitor monitor_;
  FitState state_;
  FitOutcome outcome_;
  Capture capture_;
  TrackedPoints tracked_;
  std::shared_ptr<const std::vector<FrameObservations>> observations_;
  ParameterSet parameters_;
  std::shared_ptr<const SignedDistance> distance_;
  double size_ = 0.0;
  Discretisation coarse_, fine_;
  int last_frame_ = 0, horizon_start_ = 1;
  bool scanned_ = false;
  std::vector<double> start_moduli_;
  int controls_ = 1;  // moduli of the object
  std::mutex mutex_;
};

}  // namespace

std::string FitOptions::validate() const {
  const auto outside = [](double v, double low, double high) { return !(v >= low && v <= high); };
  if (outside(cells, 4, 64)) return "cells must lie in 4..64";
  if (outside(coarse_cells, 4, 64)) return "coarse_cells must lie in 4..64";
  if (!(steps > 0.0 && steps <= 16.0)) return "steps must lie in (0, 16]";
  if (points_per_frame != 0 && points_per_frame < 10) return "points_per_frame must be 0 (all) or at least 10";
  if (scan_per_decade < 1) return "scan_per_decade must be at least 1";
  if (control_points < 1 || control_points > 500) return "control_points must lie in 1..500";
  if (starts < 1) return "starts must be at least 1";
  if (max_iterations < 1) return "max_iterations must be at least 1";
  if (!(wide_band > 0.0 && wide_band < 0.5) || !(fine_band > 0.0 && fine_band < 0.5))
    return "bands must lie in (0, 0.5)";
  if (!(newmark_theta >= 0.5 && newmark_theta < 1.0)) return "newmark_theta must lie in [0.5, 1)";
  if (!(solver_tolerance > 0.0 && solver_tolerance < 1.0)) return "solver_tolerance must lie in (0, 1)";
  return "";
}

MatrixX parameter_covariance(const CostEvaluation& evaluation) {
  const MatrixX& H = evaluation.gauss_newton;
  const Eigen::Index n = H.rows();
  const MatrixX inverse = H.ldlt().solve(MatrixX::Identity(n, n));
  const auto& frames = evaluation.frames;
  const int count = int(frames.size());
  const int lags = std::min(count - 1, int(std::ceil(std::sqrt(double(count)))));
  MatrixX scatter = MatrixX::Zero(n, n);
  for (int lag = 0; lag <= lags; ++lag) {
    const double weight = lag == 0 ? 1.0 : 1.0 - double(lag) / (lags + 1);
    for (int f = lag; f < count; ++f) {
      const MatrixX outer = frames[f].gradient * frames[f - lag].gradient.transpose();
      scatter += weight * (lag == 0 ? outer : MatrixX(outer + outer.transpose()));
    }
  }
  MatrixX sandwich = inverse * scatter * inverse;
  // Fewer frames than parameters, or gradients that cancel by chance, must not make the estimate look sure.
  for (Eigen::Index i = 0; i < n; ++i) sandwich(i, i) = std::max(sandwich(i, i), 0.0);
  return sandwich + inverse;
}

FitOutcome fit(const Capture& capture, const std::vector<ObservedFrame>& observed, const FitOptions& options,
               const FitMonitor& monitor, FitState resume) {
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{}, wrong, "", "see `pliant fit --help`"});
  return Fit(capture, observed, options, monitor, std::move(resume)).run();
}

}  // namespace pliant
