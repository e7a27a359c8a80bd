#include "estimation/fit.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <tuple>

#include "base/dense.hpp"
#include "base/error.hpp"
#include "estimation/corrections.hpp"
#include "estimation/field_choice.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/fit_run.hpp"
#include "estimation/notes.hpp"
#include "estimation/tracking_loop.hpp"

namespace pliant {

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The best start in stages on the full grid, corrections, and repetitions on finer ones.
class Fit {
 public:
  Fit(std::vector<RecordedCapture> recorded, const FitOptions& options, const FitMonitor& monitor, FitState state)
      : run_(std::move(recorded), options, monitor, std::move(state)) {}

  FitOutcome run() {
    find_starts(run_);
    estimate();
    return std::move(run_.outcome);
  }

 private:
  static int to_the_end(const Recording& recording) { return recording.last_frame; }

  /// Of the stages on the full grid; the last one is in the narrow band.
  std::vector<double> fine_horizons() const {
    return run_.swings() ? std::vector{0.25, 0.5, 1.0, 1.0} : std::vector{1.0, 1.0};
  }

  /// Pulls that hold the pose before a release on one mesh bend another one otherwise: they are looked for anew, from
  /// those at hand and from none.
  VectorX pulled_on(const Grid& grid, const VectorX& theta) {
    ParameterSet pulls = run_.parameters;
    for (const Parameter& p : run_.parameters.parameters())
      pulls.set_estimated(p.name, p.estimated && FitRun::is_pull(p));
    if (pulls.dimension() == 0) return theta;
    VectorX best = theta;
    double least = std::numeric_limits<double>::infinity();
    for (const VectorX& from : {theta, run_.without_pulls(theta)}) {
      pulls.set_reference(from);
      Objective objective =
          run_.recordings.objective(grid, pulls, run_.options.wide_band, [](const Recording&) { return 0; });
      OptimiserOptions o;
      o.max_iterations = 24;
      const OptimiserSummary s =
          minimise(objective, FitRun::start_of(pulls), o, [&](const Iteration&) { return !run_.interrupted(); });
      run_.outcome.forward_steps += s.steps;
      if (!s.succeeded || !(s.evaluation.cost < least)) continue;
      least = s.evaluation.cost;
      best = pulls.to_theta(s.p);
    }
    return best;
  }

  /// One of the stages on the full grid.
  struct Stage {
    const char* name = "";
    double horizon = 1.0, band = 0.0;
    int iterations = 0;
    double from = 0.0, to = 1.0;  // of what is done
  };

  std::vector<Stage> fine_stages() const {
    std::vector<Stage> stages;
    const std::vector<double> horizons = fine_horizons();
    const double share = 0.15 / double(horizons.size() - 1);
    for (std::size_t i = 0; i + 1 < horizons.size(); ++i) {
      const double from = 0.45 + share * double(i);
      stages.push_back({"fine, wide band", horizons[i], run_.options.wide_band,
                        std::max(1, run_.options.max_iterations / 4), from, from + share});
    }
    stages.push_back({"fine", horizons.back(), run_.options.fine_band, run_.options.max_iterations, 0.6, 0.9});
    if (run_.state.corrected && !run_.state.corrected->parameters.empty())
      stages.push_back({"corrected", 1.0, run_.options.fine_band, run_.options.max_iterations, 0.9, 1.0});
    return stages;
  }

  /// Thin objects are meshed by their thickness, however few cells are asked for: starts were then followed on the full
  /// grid already.
  bool coarse_is_as_fine() const {
    constexpr double hardly = 0.8;  // of the elements
    for (std::size_t i = 0; i < run_.fine.recording.size(); ++i)
      if (run_.coarse.recording[i].body->element_count() < hardly * run_.fine.recording[i].body->element_count())
        return false;
    return true;
  }

  /// The start that fits best, and its number.
  std::pair<VectorX, int> best_start() const {
    const auto best = std::ranges::min_element(run_.outcome.starts, {}, &FitStart::cost);
    if (best == run_.outcome.starts.end()) return {run_.parameters.reference(), 0};
    return {std::isfinite(best->cost) ? best->final : run_.parameters.reference(),
            int(best - run_.outcome.starts.begin())};
  }

  void estimate() {
    const auto [start, index] = best_start();
    const bool was_interrupted = run_.outcome.interrupted;
    use_corrections();
    ParameterSet parameters = run_.parameters;
    OptimiserSummary s;
    int counter = 0;
    FitState::Fine now = run_.state.fine ? *run_.state.fine : FitState::Fine{0, pulled_on(run_.fine, start), {}};
    std::vector<Stage> stages = fine_stages();
    for (; now.stage < int(stages.size()) && run_.state.refined.empty(); ++now.stage, now.optimiser = {}) {
      const Stage& stage = stages[std::size_t(now.stage)];
      const bool last = now.stage + 1 == int(stages.size());
      if ((was_interrupted || coarse_is_as_fine()) && !last) continue;
      parameters = run_.parameters;
      // Where swings may still be out of step, Poisson's ratio would make up for what others lack.
      if (run_.swings() && !last) parameters.set_estimated("poissons_ratio", false);
      parameters.set_reference(now.reference);
      if (now.optimiser.p.size() == 0) now.optimiser = FitRun::start_of(parameters);
      Objective objective = run_.recordings.objective(run_.fine, parameters, stage.band,
                                                      [&](const Recording& r) { return r.horizon(stage.horizon); });
      s = run_.optimise(objective, now.optimiser, StageKind::Fine, stage.name, index,
                        run_.outcome.interrupted ? 1 : stage.iterations, counter, stage.from, stage.to,
                        [&](const OptimiserState& optimiser) {
                          if (run_.outcome.interrupted)
                            return;  // a last look at what was reached is no state to go on from
                          run_.state.fine = {now.stage, now.reference, optimiser};
                          run_.save_state();
                        });
      if (!s.succeeded) break;
      now.reference = parameters.to_theta(s.p);
      if (s.interrupted) run_.outcome.interrupted = true;
      if (!last || run_.state.corrected || run_.outcome.interrupted || !run_.options.correct) continue;
      find_corrections(now.reference, s.evaluation.cost);
      use_corrections();
      stages = fine_stages();
    }
    parameters.set_reference(now.reference);
    if (s.succeeded || !run_.state.refined.empty())
      say_corrections(run_.state.refined.empty() ? s.evaluation.cost : run_.state.refined.front().cost);
    if (!run_.state.refined.empty() || (run_.options.refine > 1 && !run_.outcome.interrupted && s.succeeded))
      repeat_finer(parameters, s, int(stages.size()), index, counter);
    finish(parameters, s);
  }

  /// Systematic errors that were not estimated and that a score test on the residuals requires.
  void find_corrections(const VectorX& theta, double cost) {
    run_.state.corrected = {{}, "", cost, theta[run_.recordings.material().youngs_moduli.front()]};
    std::vector<std::string> chosen;
    for (const auto& [name, change] : run_.options.parameters) chosen.push_back(name);
    const std::vector<Correction> possible = possible_corrections(run_.parameters, chosen);
    ParameterSet with_all = run_.parameters;
    for (const Correction& c : possible)
      for (const std::string& name : c.parameters) with_all.set_estimated(name, true);
    with_all.set_reference(theta);
    Objective objective = run_.recordings.objective(run_.fine, with_all, run_.options.fine_band, to_the_end);
    const CostEvaluation e = objective.linearise(with_all.to_unconstrained(theta));
    if (!e.succeeded) return;
    for (const NeededCorrection& needed : needed_corrections(e, with_all, possible, e.independent_observations())) {
      run_.state.corrected->what += (run_.state.corrected->what.empty() ? "" : " and ") + needed.correction.what;
      for (const std::string& name : needed.correction.parameters) run_.state.corrected->parameters.push_back(name);
    }
    run_.save_state();
  }

  void use_corrections() {
    if (!run_.state.corrected) return;
    for (const std::string& name : run_.state.corrected->parameters) run_.parameters.set_estimated(name, true);
  }

  void say_corrections(double cost) {
    if (!run_.state.corrected || run_.state.corrected->parameters.empty()) return;
    const FitState::Corrected& c = *run_.state.corrected;
    run_.outcome.notes.push_back("The residuals showed that " + c.what +
                                 " needed correction, which was estimated along with the "
                                 "material: the cost fell from " +
                                 in_three_digits(c.cost) + " to " + in_three_digits(cost) +
                                 ". Without it Young's modulus was " + in_three_digits(c.youngs_modulus) +
                                 " Pa; correct = false leaves it so.");
  }

  RefinedEstimate as_estimate(const Grid& grid, const VectorX& theta, const OptimiserSummary& s) const {
    return {grid.cells,  grid.steps, grid.recording.front().body->element_count(), theta, s.evaluation.cost,
            s.converged, s.reason};
  }

  /// The estimate again with finer steps and on finer meshes, each from where the one before ended. That of the finest
  /// mesh becomes the result.
  void repeat_finer(ParameterSet& parameters, OptimiserSummary& s, int first_stage, int index, int& counter) {
    std::vector<RefinedEstimate>& done = run_.state.refined;
    if (done.empty()) done.push_back(as_estimate(run_.fine, parameters.reference(), s));
    const std::vector<Spacing> spacings = run_.repetitions();
    double from = 1.0;
    for (std::size_t i = 0; i < spacings.size(); from += run_.work(spacings[i]), ++i) {
      if (i + 1 < done.size()) continue;  // before an interruption
      const Spacing& spacing = spacings[i];
      const int stage = first_stage + int(i);
      Grid grid = run_.recordings.grid(spacing.cells, spacing.steps);
      parameters.set_reference(pulled_on(grid, done.back().theta));
      Objective objective = run_.recordings.objective(grid, parameters, run_.options.fine_band, to_the_end);
      const bool goes_on = run_.state.fine && run_.state.fine->stage == stage;
      const std::string name = spacing.cells == run_.options.cells ? in_three_digits(spacing.steps) + " x steps"
                                                                   : in_three_digits(spacing.cells) + " cells";
      OptimiserSummary repeated = run_.optimise(
          objective, goes_on ? run_.state.fine->optimiser : FitRun::start_of(parameters), StageKind::Fine, name, index,
          run_.options.max_iterations, counter, from, from + run_.work(spacing), [&](const OptimiserState& optimiser) {
            run_.state.fine = {stage, parameters.reference(), optimiser};
            run_.save_state();
          });
      if (repeated.interrupted) run_.outcome.interrupted = true;
      if (!repeated.succeeded)
        run_.outcome.notes.push_back("The estimate could not be repeated at " + name + ": " + repeated.reason + ".");
      if (repeated.interrupted || !repeated.succeeded) break;
      done.push_back(as_estimate(grid, parameters.to_theta(repeated.p), repeated));
      run_.save_state();
      if (spacing.steps == run_.options.steps) run_.fine = std::move(grid), s = std::move(repeated);
    }
    const Refinement refinement = extrapolate(done, run_.parameters);
    if (run_.options.refine > 1) run_.outcome.refinement = refinement;
    const RefinedEstimate& finest = done[std::size_t(refinement.finest)];
    parameters.set_reference(finest.theta);
    if (s.succeeded && run_.fine.cells == finest.cells) return;
    if (run_.fine.cells != finest.cells || run_.fine.steps != finest.steps)
      run_.fine = run_.recordings.grid(finest.cells, finest.steps);  // done before an interruption
    s = {};
    s.succeeded = true, s.converged = finest.converged, s.reason = finest.reason, s.evaluation.cost = finest.cost;
  }

  /// Starts run side by side; their history is told in an order that does not depend on who was faster.
  void sort_history() {
    std::ranges::stable_sort(run_.outcome.history, {},
                             [](const FitEvent& e) { return std::tuple(e.kind, e.start, e.iteration); });
  }

  void finish(ParameterSet& parameters, OptimiserSummary& s) {
    sort_history();
    run_.outcome.cells = run_.fine.cells;
    run_.outcome.converged = s.converged && !run_.outcome.interrupted;
    run_.outcome.reason = run_.outcome.interrupted ? "interrupted" : s.reason;
    run_.outcome.theta = parameters.reference();
    run_.outcome.parameters = run_.recordings.with_field_prior(parameters, run_.fine);
    run_.outcome.final_cost = s.evaluation.cost;
    run_.outcome.start_cost = start_cost_on_fine();
    if (s.succeeded && s.evaluation.gauss_newton.size() == 0 && parameters.dimension() > 0) {
      Objective objective = run_.recordings.objective(run_.fine, parameters, run_.options.fine_band, to_the_end);
      s.evaluation = objective.linearise(parameters.to_unconstrained(parameters.reference()));
    }
    run_.outcome.evaluation = std::move(s.evaluation);
    for (std::size_t r = 0; r < run_.recordings.all().size(); ++r) {
      const Discretisation& d = run_.fine.recording[r];
      run_.outcome.recordings.push_back({d, run_.outcome.theta, run_.outcome.evaluation.of_recording(int(r)),
                                         Simulation(d.body, d.simulation).rest_body(run_.outcome.theta)});
    }
    if (run_.outcome.evaluation.succeeded && parameters.dimension() > 0) {
      run_.outcome.covariance = parameter_covariance(run_.outcome.evaluation);
      run_.outcome.std = run_.outcome.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
      const VectorX inverse = run_.outcome.std.cwiseMax(1e-300).cwiseInverse();
      run_.outcome.correlation = inverse.asDiagonal() * run_.outcome.covariance * inverse.asDiagonal();
    }
    if (run_.outcome.evaluation.succeeded && !run_.outcome.interrupted) time_steps(parameters);
    std::vector<const Capture*> captures;
    for (const Recording& r : run_.recordings.all()) captures.push_back(&r.capture);
    run_.outcome.notes.insert(run_.outcome.notes.end(), run_.state.notes.begin(), run_.state.notes.end());
    add_notes(run_.outcome, captures);
  }

  void time_steps(const ParameterSet& parameters) {
    Objective objective =
        run_.recordings.objective(run_.fine, parameters, run_.options.fine_band, [](const Recording&) { return 20; });
    const VectorX p = parameters.to_unconstrained(parameters.reference());
    auto begin = std::chrono::steady_clock::now();
    const CostEvaluation forward = objective.evaluate(p);
    const double forward_seconds = seconds_since(begin);
    begin = std::chrono::steady_clock::now();
    const CostEvaluation both = objective.gradient(p);
    const double both_seconds = seconds_since(begin);
    if (forward.steps == 0 || both.steps == 0) return;
    run_.outcome.ms_per_forward_step = 1000.0 * forward_seconds / forward.steps;
    run_.outcome.ms_per_adjoint_step = 1000.0 * std::max(0.0, both_seconds - forward_seconds) / both.steps;
  }

  double start_cost_on_fine() const {
    Objective objective = run_.recordings.objective(run_.fine, run_.fixed_at(run_.outcome.start_theta),
                                                    run_.options.fine_band, to_the_end);
    return objective.evaluate(VectorX(0)).cost;
  }

  FitRun run_;
};

}  // namespace

MatrixX parameter_covariance(const CostEvaluation& evaluation) {
  const MatrixX& H = evaluation.gauss_newton;
  const Eigen::Index n = H.rows();
  const MatrixX inverse = solve_symmetric(H, MatrixX(MatrixX::Identity(n, n)));
  MatrixX sandwich = inverse * gradient_scatter(evaluation) * inverse;
  // Fewer frames than parameters, or gradients that cancel by chance, must not make the estimate look sure.
  for (Eigen::Index i = 0; i < n; ++i) sandwich(i, i) = std::max(sandwich(i, i), 0.0);
  return sandwich + inverse;
}

FitOutcome fit(std::vector<RecordedCapture> recordings, const FitOptions& options, const FitMonitor& monitor,
               FitState resume) {
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{}, wrong, "", "see `pliant fit --help`"});
  if (recordings.empty()) throw InputError({{}, "no recording was given", "one or several", ""});
  if (tracks(recordings, options)) return fit_with_tracking(recordings, options, monitor, std::move(resume));
  if (options.control_points == FitOptions::automatic)
    return fit_with_chosen_field(recordings, options, monitor, std::move(resume));
  return Fit(std::move(recordings), options, monitor, std::move(resume)).run();
}

FitOutcome score(RecordedCapture held_out, const FitOutcome& fitted, const FitOptions& options,
                 const FitMonitor& monitor) {
  FitOptions fixed = options;
  fixed.tracking = TrackingUse::Off;
  fixed.cells = fitted.cells, fixed.refine = 1;
  fixed.control_points = fitted.recordings.front().discretisation.body->modulus.controls;
  for (const Parameter& p : fitted.parameters.parameters()) {
    if (!is_of_object(p)) continue;
    FitOptions::Override& change = fixed.parameters[p.name];
    change.estimated = false;
    if (p.name != "density" || p.estimated) change.start = VectorX::Constant(1, fitted.theta[p.at]);
  }
  std::vector<RecordedCapture> one;
  one.push_back(std::move(held_out));
  return fit(std::move(one), fixed, monitor);
}

}  // namespace pliant
