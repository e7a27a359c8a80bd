#include "estimation/fit.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <numeric>
#include <tuple>

#include "base/error.hpp"
#include "estimation/corrections.hpp"
#include "estimation/field_choice.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/load_free.hpp"
#include "estimation/modal_start.hpp"
#include "estimation/notes.hpp"
#include "estimation/recordings.hpp"
#include "estimation/swing.hpp"
#include "estimation/tracking_loop.hpp"

namespace pliant {

namespace {

OptimiserSummary minimise_from(Objective& objective, const OptimiserState& state, const OptimiserOptions& options,
                               const std::function<bool(const Iteration&)>& on_iteration) {
  return minimise(objective, state, options, on_iteration);
}

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class Fit {
 public:
  Fit(std::vector<RecordedCapture> recorded, const FitOptions& options, const FitMonitor& monitor, FitState state)
      : options_(options),
        monitor_(monitor),
        state_(std::move(state)),
        recordings_(std::move(recorded), options_, outcome_.notes),
        parameters_(recordings_.parameters()),
        controls_(recordings_.controls()),
        relative_moduli_(VectorX::Ones(controls_)),
        coarse_(recordings_.grid(options_.coarse_cells, options_.steps)),
        fine_(recordings_.grid(options_.cells, options_.steps)) {}

  FitOutcome run() {
    scanned_ = !given_start("youngs_modulus");
    spread_start();
    if (scanned_) start_where_it_carries();
    outcome_.start_theta = parameters_.reference();
    estimate_initial_motion();
    if (scanned_ && !start_from_swing()) scan();
    follow_starts();
    estimate();
    return std::move(outcome_);
  }

 private:
  static int to_the_end(const Recording& recording) { return recording.last_frame; }

  /// Swings out of step are as wrong as any other: the valley about the truth narrows as more of them are seen.
  bool swings() const { return recordings_.any_released(); }
  std::vector<double> growing_horizon() const {
    return swings() ? std::vector{0.12, 0.25, 0.5, 1.0, 1.0} : std::vector{0.6, 1.0, 1.0};
  }
  /// Of the stages on the full grid; the last one is in the narrow band.
  std::vector<double> fine_horizons() const {
    return swings() ? std::vector{0.25, 0.5, 1.0, 1.0} : std::vector{1.0, 1.0};
  }
  void set_all_moduli(VectorX& theta, double youngs_modulus) const {
    recordings_.set_moduli(theta, youngs_modulus * relative_moduli_);
  }
  /// The same parameters at another theta, none estimated.
  ParameterSet fixed_at(const VectorX& theta) const {
    std::vector<Parameter> list = parameters_.parameters();
    for (Parameter& p : list) p.estimated = false;
    return {std::move(list), theta};
  }

  static OptimiserState start_of(const ParameterSet& parameters) {
    return {0, parameters.to_unconstrained(parameters.reference()), {}};
  }

  bool interrupted() const { return monitor_.interrupted && monitor_.interrupted(); }

  void emit(FitEvent event) {
    event.fraction_done /= all_work();
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
    const bool in_turns = options_.load_free == LoadFreeScheme::InTurns && recordings_.any_sags();
    OptimiserSummary s = (in_turns ? minimise_in_turns : minimise_from)(objective, from, o, [&](const Iteration& i) {
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

  /// How the object moves or is held at the start, from the first frames, at a middling stiffness.
  void estimate_initial_motion() {
    if (state_.motion) {
      set_reference(*state_.motion);
      return;
    }
    ParameterSet motion = parameters_;
    bool any = false;
    for (const Parameter& p : parameters_.parameters()) {
      constexpr std::array of_the_start = {"pull@", "linear_velocity", "angular_velocity", "gravity"};
      const bool moves =
          p.estimated && std::ranges::any_of(of_the_start, [&](const char* name) { return p.name.starts_with(name); });
      motion.set_estimated(p.name, moves);
      any = any || moves;
    }
    if (!any) return;
    int counter = 0;
    for (const int part : {8, 4}) {
      // The pose of a released object shows in the frames before, a velocity only after.
      const auto horizon = [&](const Recording& r) { return r.is_released() ? 0 : std::max(2, r.last_frame / part); };
      Objective objective = recordings_.objective(coarse_, motion, options_.wide_band, horizon);
      const OptimiserSummary s = optimise(objective, start_of(motion), "motion", 0, 12, counter, 0.0, 0.05);
      if (s.succeeded) motion.set_reference(motion.to_theta(s.p));
      if (interrupted()) return;
    }
    set_reference(motion.reference());
    state_.motion = motion.reference();
    save_state();
  }

  void set_reference(const VectorX& theta) { parameters_.set_reference(theta); }

  VectorX without_pulls(VectorX theta) const {
    for (const Parameter& p : parameters_.parameters())
      if (p.estimated && p.name.starts_with("pull@")) theta.segment<3>(p.theta_index) = p.scale * p.prior_mean;
    return theta;
  }

  /// Pulls that hold the pose before a release on one mesh bend another one otherwise: they are looked for anew, from
  /// those at hand and from none.
  VectorX pulled_on(const Grid& grid, const VectorX& theta) {
    ParameterSet pulls = parameters_;
    for (const Parameter& p : parameters_.parameters())
      pulls.set_estimated(p.name, p.estimated && p.name.starts_with("pull@"));
    if (pulls.dimension() == 0) return theta;
    VectorX best = theta;
    double least = std::numeric_limits<double>::infinity();
    for (const VectorX& from : {theta, without_pulls(theta)}) {
      pulls.set_reference(from);
      Objective objective = recordings_.objective(grid, pulls, options_.wide_band, [](const Recording&) { return 0; });
      OptimiserOptions o;
      o.max_iterations = 24;
      const OptimiserSummary s =
          minimise(objective, start_of(pulls), o, [&](const Iteration&) { return !interrupted(); });
      outcome_.forward_steps += s.steps;
      if (!s.succeeded || !(s.evaluation.cost < least)) continue;
      least = s.evaluation.cost;
      best = pulls.to_theta(s.p);
    }
    return best;
  }

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

  std::optional<double> given_start(const std::string& name) const {
    const auto change = options_.parameters.find(name);
    if (change == options_.parameters.end() || !change->second.start) return std::nullopt;
    return (*change->second.start)[0];
  }

  /// Moduli of regions and control points begin where the object's own does, but for those that the user has given.
  void spread_start() {
    VectorX theta = parameters_.reference();
    const double own = theta[theta::youngs_modulus];
    const std::vector<std::string> names = modulus_names(recordings_.front().capture, controls_);
    for (int k = 0; k < controls_; ++k) relative_moduli_[k] = given_start(names[std::size_t(k)]).value_or(own) / own;
    set_all_moduli(theta, own);
    set_reference(theta);
  }

  /// An object that was scanned as it sags has to be stiff enough for its scan before anything can be tried.
  void start_where_it_carries() {
    double modulus = 0.0;
    for (std::size_t i = 0; i < recordings_.all().size(); ++i) {
      const Discretisation& d = coarse_.recording[i];
      if (!d.simulation.scan_sags) continue;
      const VectorX own = recordings_.all()[i].own(parameters_.reference());
      modulus = std::max(modulus, carrying_modulus(d.body, d.simulation, own, [this] { return interrupted(); }));
    }
    if (modulus == 0.0) return;
    carrying_modulus_ = modulus;
    VectorX theta = parameters_.reference();
    set_all_moduli(theta, modulus);
    set_reference(theta);
  }

  /// The modulus whose vibrations are as fast as those that were seen (Wang 2015, section 6.3), if some were: by points
  /// that were followed, else by the middle of those that were not. False where the scan has to look for it.
  bool start_from_swing() {
    if (state_.scan.empty()) {
      if (interrupted() || !find_swing()) return false;
      // The pose before a release was found for another stiffness, which sags otherwise: look for it anew.
      set_reference(without_pulls(parameters_.reference()));
      state_.motion.reset();
      estimate_initial_motion();
      if (interrupted()) return false;
      state_.scan = {{parameters_.reference()[theta::youngs_modulus], 0.0}};
      state_.motion = parameters_.reference();
      save_state();
    }
    if (state_.scan.size() != 1) return false;
    const VectorX own = recordings_.front().own(parameters_.reference());
    for (int k = 0; k < controls_; ++k)
      relative_moduli_[k] = own[theta::modulus(k, controls_, own.size())] / own[theta::youngs_modulus];
    start_moduli_ = {own[theta::youngs_modulus]};
    set_all_moduli(outcome_.start_theta, start_moduli_.front());
    return true;
  }

  /// The first modulus of a swing whose modes about rest are known, where its weight changes them.
  std::optional<double> with_weight(const Discretisation& d, const Recording& r, const VectorX& theta) const {
    const VectorX own = r.own(theta);
    if (theta::vector_at(own, theta::gravity).isZero()) return std::nullopt;
    Simulation simulation(d.body, d.simulation);
    const auto start = swing_start(simulation, own, controls_, *r.observations);
    return start ? std::optional(start->youngs_modulus) : std::nullopt;
  }

  /// Takes over moduli and, where they show, dampings.
  bool find_swing() {
    for (std::size_t i = 0; i < recordings_.all().size(); ++i) {
      const Recording& r = recordings_.all()[i];
      if (r.capture.is_static || r.capture.fixed.empty()) continue;
      const Discretisation& d = coarse_.recording[i];
      const std::vector<int> held = held_nodes(*d.body, d.simulation.holds);
      if (held.size() < 3) continue;
      VectorX theta = parameters_.reference();
      const auto say = [&](const char* what, double modulus) {
        state_.notes.push_back(std::string(what) + text_of(modulus) + " Pa; the fit started there.");
      };
      if (!r.tracked.rest.empty()) {
        ModalStartOptions o;
        o.first_frame = r.capture.start_frame;
        o.curve_samples = 0;
        const ModalStart start = modal_start(d.body, r.own(theta), held, r.tracked, r.capture.times, o);
        if (!start.found) continue;
        take_dampings(start);
        relative_moduli_ = start.moduli / start.moduli[0];
        theta = parameters_.reference();
        set_all_moduli(theta, start.moduli[0]);
        set_reference(theta);
        const double modulus = with_weight(d, r, theta).value_or(start.moduli[0]);
        set_all_moduli(theta, modulus);
        set_reference(theta);
        say("The vibrations of the followed points are those of a Young's modulus of about ", modulus);
        return true;
      }
      Simulation simulation(d.body, d.simulation);
      const auto start = swing_start(simulation, r.own(theta), controls_, *r.observations);
      if (!start) continue;
      set_all_moduli(theta, start->youngs_modulus);
      set_reference(theta);
      say(("The object swings at " + text_of(start->frequency) + " Hz, as with a Young's modulus of about ").c_str(),
          start->youngs_modulus);
      return true;
    }
    return false;
  }

  /// Dampings that the user has not given begin where the decay of the vibrations has them.
  void take_dampings(const ModalStart& start) {
    VectorX theta = parameters_.reference();
    const auto take = [&](const char* name, double value) {
      const auto change = options_.parameters.find(name);
      const Parameter* p = parameters_.find(name);
      if (value <= 0.0 || !p->estimated || (change != options_.parameters.end() && change->second.start)) return;
      theta[p->theta_index] = std::clamp(value, p->lower, p->upper);
      for (const int other : p->also) theta[other] = theta[p->theta_index];
    };
    take("mass_damping", start.mass_damping);
    take("stiffness_damping", start.stiffness_damping);
    set_reference(theta);
  }

  /// Young's modulus over decades of the stress under the object's own weight.
  void scan() {
    const VectorX theta = parameters_.reference();
    const double g = std::max(theta::vector_at(theta, theta::gravity).norm(), 0.1);
    const double stress =
        carrying_modulus_ > 0.0 ? 0.25 * carrying_modulus_ : theta[theta::density] * g * recordings_.front().size;
    const int per_decade = options_.scan_per_decade * (swings() ? 2 : 1);
    const int count = 4 * per_decade + 1;
    if (int(state_.scan.size()) != count) {
      state_.scan.assign(std::size_t(count), {});
      std::atomic<int> done = 0;
      const auto try_value = [&](int i) {
        VectorX trial = theta;
        set_all_moduli(trial, stress * std::pow(10.0, double(i) / per_decade));
        state_.scan[std::size_t(i)] = {trial[theta::youngs_modulus], std::numeric_limits<double>::infinity()};
        if (interrupted()) return;
        Objective objective = recordings_.objective(
            coarse_, fixed_at(trial), options_.wide_band,
            [&](const Recording& r) { return swings() ? r.horizon(growing_horizon().front()) : r.last_frame; });
        const CostEvaluation e = objective.evaluate(VectorX(0));
        if (e.succeeded) state_.scan[std::size_t(i)].second = e.cost;
        emit({"scan", 0, i + 1, e.cost, 0.0, e.surface_rms(), trial, 0.05 + 0.1 * double(++done) / count});
      };
      if (recordings_.all_static())
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
      throw InputError({{recordings_.front().capture.file},
                        "no stiffness between " + text_of(stress) + " Pa and ten thousand times that can be simulated",
                        "",
                        "check mass, gravity and the size of the scan"});
    set_all_moduli(outcome_.start_theta, start_moduli_.front());
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
    if (scanned_) set_all_moduli(theta, modulus);
    parameters.set_reference(theta);
    // Poisson's ratio is told from the rest only once the fit is close.
    parameters.set_estimated("poisson_ratio", false);
    FitStart start;
    start.start = theta;
    int counter = 0;
    bool first = true;
    for (const double part : growing_horizon()) {
      const bool last = part == 1.0 && !first;
      const double from = 0.15 + 0.3 * (part < 1.0 ? 0.0 : 0.4);
      Objective objective = recordings_.objective(coarse_, parameters, options_.wide_band,
                                                  [&](const Recording& r) { return r.horizon(part); });
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
      if (first) start.start_cost = s.start_cost;
      first = false;
      start.cost = s.evaluation.cost;
      parameters.set_reference(parameters.to_theta(s.p));
      start.final = parameters.reference();
      if (interrupted()) break;
      if (last) break;
    }
    return start;
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
      stages.push_back({"fine, wide band", horizons[i], options_.wide_band, std::max(1, options_.max_iterations / 4),
                        from, from + share});
    }
    stages.push_back({"fine", horizons.back(), options_.fine_band, options_.max_iterations, 0.6, 0.9});
    if (state_.corrected && !state_.corrected->parameters.empty())
      stages.push_back({"corrected", 1.0, options_.fine_band, options_.max_iterations, 0.9, 1.0});
    return stages;
  }

  /// Thin objects are meshed by their thickness, however few cells are asked for: starts were then followed on the full
  /// grid already.
  bool coarse_is_as_fine() const {
    constexpr double hardly = 0.8;  // of the elements
    for (std::size_t i = 0; i < fine_.recording.size(); ++i)
      if (coarse_.recording[i].body->element_count() < hardly * fine_.recording[i].body->element_count()) return false;
    return true;
  }

  /// The start that fits best, and its number.
  std::pair<VectorX, int> best_start() const {
    const auto best = std::ranges::min_element(outcome_.starts, {}, &FitStart::cost);
    if (best == outcome_.starts.end()) return {parameters_.reference(), 0};
    return {std::isfinite(best->cost) ? best->final : parameters_.reference(), int(best - outcome_.starts.begin())};
  }

  void estimate() {
    const auto [start, index] = best_start();
    const bool was_interrupted = outcome_.interrupted;
    use_corrections();
    ParameterSet parameters = parameters_;
    OptimiserSummary s;
    int counter = 0;
    FitState::Fine now = state_.fine ? *state_.fine : FitState::Fine{0, pulled_on(fine_, start), {}};
    std::vector<Stage> stages = fine_stages();
    for (; now.stage < int(stages.size()) && state_.refined.empty(); ++now.stage, now.optimiser = {}) {
      const Stage& stage = stages[std::size_t(now.stage)];
      const bool last = now.stage + 1 == int(stages.size());
      if ((was_interrupted || coarse_is_as_fine()) && !last) continue;
      parameters = parameters_;
      // Where swings may still be out of step, Poisson's ratio would make up for what others lack.
      if (swings() && !last) parameters.set_estimated("poisson_ratio", false);
      parameters.set_reference(now.reference);
      if (now.optimiser.p.size() == 0) now.optimiser = start_of(parameters);
      Objective objective = recordings_.objective(fine_, parameters, stage.band,
                                                  [&](const Recording& r) { return r.horizon(stage.horizon); });
      s = optimise(objective, now.optimiser, stage.name, index, outcome_.interrupted ? 1 : stage.iterations, counter,
                   stage.from, stage.to, [&](const OptimiserState& optimiser) {
                     if (outcome_.interrupted) return;  // a last look at what was reached is no state to go on from
                     state_.fine = {now.stage, now.reference, optimiser};
                     save_state();
                   });
      if (!s.succeeded) break;
      now.reference = parameters.to_theta(s.p);
      if (s.interrupted) outcome_.interrupted = true;
      if (!last || state_.corrected || outcome_.interrupted || !options_.correct) continue;
      find_corrections(now.reference, s.evaluation.cost);
      use_corrections();
      stages = fine_stages();
    }
    parameters.set_reference(now.reference);
    if (s.succeeded || !state_.refined.empty())
      say_corrections(state_.refined.empty() ? s.evaluation.cost : state_.refined.front().cost);
    if (!state_.refined.empty() || (options_.refine > 1 && !outcome_.interrupted && s.succeeded))
      repeat_finer(parameters, s, int(stages.size()), index, counter);
    finish(parameters, s);
  }

  /// What was not estimated and spoils the recordings, as their residuals at the estimate show.
  void find_corrections(const VectorX& theta, double cost) {
    state_.corrected = {{}, "", cost, theta[theta::youngs_modulus]};
    std::vector<std::string> chosen;
    for (const auto& [name, change] : options_.parameters) chosen.push_back(name);
    const std::vector<Correction> possible = possible_corrections(parameters_, chosen);
    ParameterSet with_all = parameters_;
    for (const Correction& c : possible)
      for (const std::string& name : c.parameters) with_all.set_estimated(name, true);
    with_all.set_reference(theta);
    Objective objective = recordings_.objective(fine_, with_all, options_.fine_band, to_the_end);
    const CostEvaluation e = objective.linearise(with_all.to_unconstrained(theta));
    if (!e.succeeded) return;
    for (const NeededCorrection& needed : needed_corrections(e, with_all, possible, e.independent_observations())) {
      state_.corrected->what += (state_.corrected->what.empty() ? "" : " and ") + needed.correction.what;
      for (const std::string& name : needed.correction.parameters) state_.corrected->parameters.push_back(name);
    }
    save_state();
  }

  void use_corrections() {
    if (!state_.corrected) return;
    for (const std::string& name : state_.corrected->parameters) parameters_.set_estimated(name, true);
  }

  void say_corrections(double cost) {
    if (!state_.corrected || state_.corrected->parameters.empty()) return;
    const FitState::Corrected& c = *state_.corrected;
    outcome_.notes.push_back("The residuals showed that " + c.what +
                             " needed correction, which was estimated along with the "
                             "material: the cost fell from " +
                             text_of(c.cost) + " to " + text_of(cost) + ". Without it Young's modulus was " +
                             text_of(c.youngs_modulus) + " Pa; correct = false leaves it so.");
  }

  RefinedEstimate as_estimate(const Grid& grid, const VectorX& theta, const OptimiserSummary& s) const {
    return {grid.cells,  grid.steps, grid.recording.front().body->element_count(), theta, s.evaluation.cost,
            s.converged, s.reason};
  }

  std::vector<Spacing> repetitions() const {
    return refined_spacings({options_.cells, options_.steps}, options_.refine, recordings_.any_meshed_here(),
                            !recordings_.all_static());
  }
  /// Of a repetition, in units of the first estimate's: a warm start needs few iterations.
  double work(const Spacing& s) const { return 0.3 * s.steps / options_.steps * std::pow(s.cells / options_.cells, 3); }
  double all_work() const {
    double all = 1.0;
    for (const Spacing& s : repetitions()) all += work(s);
    return all;
  }

  /// The estimate again with finer steps and on finer meshes, each from where the one before ended. That of the finest
  /// mesh becomes the result.
  void repeat_finer(ParameterSet& parameters, OptimiserSummary& s, int first_stage, int index, int& counter) {
    std::vector<RefinedEstimate>& done = state_.refined;
    if (done.empty()) done.push_back(as_estimate(fine_, parameters.reference(), s));
    const std::vector<Spacing> spacings = repetitions();
    double from = 1.0;
    for (std::size_t i = 0; i < spacings.size(); from += work(spacings[i]), ++i) {
      if (i + 1 < done.size()) continue;  // before an interruption
      const Spacing& spacing = spacings[i];
      const int stage = first_stage + int(i);
      Grid grid = recordings_.grid(spacing.cells, spacing.steps);
      parameters.set_reference(pulled_on(grid, done.back().theta));
      Objective objective = recordings_.objective(grid, parameters, options_.fine_band, to_the_end);
      const bool goes_on = state_.fine && state_.fine->stage == stage;
      const std::string name =
          spacing.cells == options_.cells ? text_of(spacing.steps) + " x steps" : text_of(spacing.cells) + " cells";
      OptimiserSummary repeated =
          optimise(objective, goes_on ? state_.fine->optimiser : start_of(parameters), name, index,
                   options_.max_iterations, counter, from, from + work(spacing), [&](const OptimiserState& optimiser) {
                     state_.fine = {stage, parameters.reference(), optimiser};
                     save_state();
                   });
      if (repeated.interrupted) outcome_.interrupted = true;
      if (!repeated.succeeded)
        outcome_.notes.push_back("The estimate could not be repeated at " + name + ": " + repeated.reason + ".");
      if (repeated.interrupted || !repeated.succeeded) break;
      done.push_back(as_estimate(grid, parameters.to_theta(repeated.p), repeated));
      save_state();
      if (spacing.steps == options_.steps) fine_ = std::move(grid), s = std::move(repeated);
    }
    const Refinement refinement = extrapolate(done, parameters_);
    if (options_.refine > 1) outcome_.refinement = refinement;
    const RefinedEstimate& finest = done[std::size_t(refinement.finest)];
    parameters.set_reference(finest.theta);
    if (s.succeeded && fine_.cells == finest.cells) return;
    if (fine_.cells != finest.cells || fine_.steps != finest.steps)
      fine_ = recordings_.grid(finest.cells, finest.steps);  // done before an interruption
    s = {};
    s.succeeded = true, s.converged = finest.converged, s.reason = finest.reason, s.evaluation.cost = finest.cost;
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
    outcome_.cells = fine_.cells;
    outcome_.converged = s.converged && !outcome_.interrupted;
    outcome_.reason = outcome_.interrupted ? "interrupted" : s.reason;
    outcome_.theta = parameters.reference();
    outcome_.parameters = recordings_.with_field_prior(parameters, fine_);
    outcome_.final_cost = s.evaluation.cost;
    outcome_.start_cost = start_cost_on_fine();
    if (s.succeeded && s.evaluation.gauss_newton.size() == 0 && parameters.dimension() > 0) {
      Objective objective = recordings_.objective(fine_, parameters, options_.fine_band, to_the_end);
      s.evaluation = objective.linearise(parameters.to_unconstrained(parameters.reference()));
    }
    outcome_.evaluation = std::move(s.evaluation);
    for (std::size_t r = 0; r < recordings_.all().size(); ++r) {
      const VectorX own = recordings_.all()[r].own(outcome_.theta);
      outcome_.recordings.push_back(
          {fine_.recording[r], own, outcome_.evaluation.of_recording(int(r)),
           Simulation(fine_.recording[r].body, fine_.recording[r].simulation).rest_body(own)});
    }
    if (outcome_.evaluation.succeeded && parameters.dimension() > 0) {
      outcome_.covariance = parameter_covariance(outcome_.evaluation);
      outcome_.std = outcome_.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
      const VectorX inverse = outcome_.std.cwiseMax(1e-300).cwiseInverse();
      outcome_.correlation = inverse.asDiagonal() * outcome_.covariance * inverse.asDiagonal();
    }
    if (outcome_.evaluation.succeeded && !outcome_.interrupted) time_steps(parameters);
    std::vector<const Capture*> captures;
    for (const Recording& r : recordings_.all()) captures.push_back(&r.capture);
    outcome_.notes.insert(outcome_.notes.end(), state_.notes.begin(), state_.notes.end());
    add_notes(outcome_, captures);
  }

  void time_steps(const ParameterSet& parameters) {
    Objective objective =
        recordings_.objective(fine_, parameters, options_.fine_band, [](const Recording&) { return 20; });
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
    Objective objective = recordings_.objective(fine_, fixed_at(outcome_.start_theta), options_.fine_band, to_the_end);
    return objective.evaluate(VectorX(0)).cost;
  }

  FitOptions options_;
  FitMonitor monitor_;
  FitState state_;
  FitOutcome outcome_;
  Recordings recordings_;
  ParameterSet parameters_;
  int controls_;             // moduli of the object
  VectorX relative_moduli_;  // of the scan and the starts, the first one's being one
  Grid coarse_, fine_;
  bool scanned_ = false;
  double carrying_modulus_ = 0.0;  // [Pa] that is enough for a scan that sags; 0: no scan does
  std::vector<double> start_moduli_;
  std::mutex mutex_;
};

}  // namespace

MatrixX parameter_covariance(const CostEvaluation& evaluation) {
  const MatrixX& H = evaluation.gauss_newton;
  const Eigen::Index n = H.rows();
  const MatrixX inverse = H.ldlt().solve(MatrixX::Identity(n, n));
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
    if (!is_material(p)) continue;
    FitOptions::Override& change = fixed.parameters[p.name];
    change.estimated = false;
    if (p.name != "density" || p.estimated) change.start = VectorX::Constant(1, fitted.theta[p.theta_index]);
  }
  std::vector<RecordedCapture> one;
  one.push_back(std::move(held_out));
  return fit(std::move(one), fixed, monitor);
}

}  // namespace pliant
