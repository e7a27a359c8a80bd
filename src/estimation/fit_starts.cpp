
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/fit_run.hpp"
#include "estimation/load_free.hpp"
#include "estimation/modal_start.hpp"
#include "estimation/swing.hpp"

namespace pliant {

namespace {

/// See `find_starts`.
class StartFinder {
 public:
  explicit StartFinder(FitRun& run)
      : run_(run), controls_(run.recordings.controls()), relative_moduli_(VectorX::Ones(controls_)) {}

  void find() {
    scanned_ = !given_start("youngs_modulus");
    spread_start();
    if (scanned_) start_where_it_carries();
    run_.outcome.start_theta = run_.parameters.reference();
    estimate_initial_motion();
    if (scanned_ && !start_from_swing()) scan();
    follow_starts();
  }

 private:
  /// Swings out of step are as wrong as any other: the valley about the truth narrows as more of them are seen.
  std::vector<double> growing_horizon() const {
    return run_.swings() ? std::vector{0.12, 0.25, 0.5, 1.0, 1.0} : std::vector{0.6, 1.0, 1.0};
  }

  void set_all_moduli(VectorX& theta, double youngs_modulus) const {
    run_.recordings.set_moduli(theta, youngs_modulus * relative_moduli_);
  }

  double first_modulus(const VectorX& theta) const { return theta[run_.recordings.material().youngs_moduli.front()]; }

  void set_reference(const VectorX& theta) { run_.parameters.set_reference(theta); }

  /// How the object moves or is held at the start, from the first frames, at a middling stiffness.
  void estimate_initial_motion() {
    if (run_.state.motion) {
      set_reference(*run_.state.motion);
      return;
    }
    ParameterSet motion = run_.parameters;
    bool any = false;
    for (const Parameter& p : run_.parameters.parameters()) {
      const bool moves = p.estimated && (p.role == Role::Initial || p.role == Role::Load);
      motion.set_estimated(p.name, moves);
      any = any || moves;
    }
    if (!any) return;
    int counter = 0;
    for (const int part : {8, 4}) {
      // The pose of a released object shows in the frames before, a velocity only after.
      const auto horizon = [&](const Recording& r) { return r.is_released() ? 0 : std::max(2, r.last_frame / part); };
      Objective objective = run_.recordings.objective(run_.coarse, motion, run_.options.wide_band, horizon);
      const OptimiserSummary s =
          run_.optimise(objective, FitRun::start_of(motion), StageKind::Motion, "motion", 0, 12, counter, 0.0, 0.05);
      if (s.succeeded) motion.set_reference(motion.to_theta(s.p));
      if (run_.interrupted()) return;
    }
    set_reference(motion.reference());
    run_.state.motion = motion.reference();
    run_.save_state();
  }

  /// At rest every softer body hangs lower and costs more equilibria: from stiff to soft, until it is clear that the
  /// valley was passed, or that nothing softer can hold itself up.
  template <class Try>
  void scan_downwards(int count, Try&& try_value) {
    double least = std::numeric_limits<double>::infinity();
    int worse = 0;
    for (int i = 0; i < count; ++i) run_.state.scan[std::size_t(i)] = {0.0, std::numeric_limits<double>::infinity()};
    for (int i = count - 1; i >= 0 && !run_.interrupted(); --i) {
      try_value(i);
      const double cost = run_.state.scan[std::size_t(i)].second;
      worse = cost > 1.2 * least ? worse + 1 : 0;
      if (!std::isfinite(cost) || worse == 2) break;
      least = std::min(least, cost);
    }
  }

  std::optional<double> given_start(const std::string& name) const {
    const auto change = run_.options.parameters.find(name);
    if (change == run_.options.parameters.end() || !change->second.start) return std::nullopt;
    return (*change->second.start)[0];
  }

  /// Moduli of regions and control points begin where the object's own does, but for those that the user has given.
  void spread_start() {
    VectorX theta = run_.parameters.reference();
    const double own = first_modulus(theta);
    const std::vector<std::string> names = modulus_names(run_.recordings.front().capture, controls_);
    for (int k = 0; k < controls_; ++k) relative_moduli_[k] = given_start(names[std::size_t(k)]).value_or(own) / own;
    set_all_moduli(theta, own);
    set_reference(theta);
  }

  /// An object that was scanned as it sags has to be stiff enough for its scan before anything can be tried.
  void start_where_it_carries() {
    double modulus = 0.0;
    for (std::size_t i = 0; i < run_.recordings.all().size(); ++i) {
      const Discretisation& d = run_.coarse.recording[i];
      if (!d.simulation.scan_sags) continue;
      modulus = std::max(modulus, carrying_modulus(d.body, d.simulation, run_.parameters.reference(),
                                                   [this] { return run_.interrupted(); }));
    }
    if (modulus == 0.0) return;
    carrying_modulus_ = modulus;
    VectorX theta = run_.parameters.reference();
    set_all_moduli(theta, modulus);
    set_reference(theta);
  }

  /// The modulus whose vibrations are as fast as those that were seen (Wang 2015, section 6.3), if some were: by points
  /// that were followed, else by the middle of those that were not. False where the scan has to look for it.
  bool start_from_swing() {
    if (run_.state.scan.empty()) {
      if (run_.interrupted() || !find_swing()) return false;
      // The pose before a release was found for another stiffness, which sags otherwise: look for it anew.
      set_reference(run_.without_pulls(run_.parameters.reference()));
      run_.state.motion.reset();
      estimate_initial_motion();
      if (run_.interrupted()) return false;
      run_.state.scan = {{first_modulus(run_.parameters.reference()), 0.0}};
      run_.state.motion = run_.parameters.reference();
      run_.save_state();
    }
    if (run_.state.scan.size() != 1) return false;
    const VectorX moduli = run_.recordings.material().moduli(run_.parameters.reference());
    relative_moduli_ = moduli / moduli[0];
    start_moduli_ = {moduli[0]};
    set_all_moduli(run_.outcome.start_theta, start_moduli_.front());
    return true;
  }

  /// The first modulus of a swing whose modes about rest are known, where its weight changes them.
  std::optional<double> with_weight(const Discretisation& d, const Recording& r, const VectorX& theta) const {
    if (r.blocks.motion.gravity.vector(theta).isZero()) return std::nullopt;
    Simulation simulation(d.body, d.simulation);
    const auto start = swing_start(simulation, theta, *r.observations);
    return start ? std::optional(start->youngs_modulus) : std::nullopt;
  }

  /// Takes over moduli and, where they show, dampings.
  bool find_swing() {
    for (std::size_t i = 0; i < run_.recordings.all().size(); ++i) {
      const Recording& r = run_.recordings.all()[i];
      if (r.capture.scene.timing.is_static || r.capture.scene.fixed.empty()) continue;
      const Discretisation& d = run_.coarse.recording[i];
      const std::vector<int> held = held_nodes(*d.body, d.simulation.holds);
      if (held.size() < 3) continue;
      VectorX theta = run_.parameters.reference();
      const auto say = [&](const char* what, double modulus) {
        run_.state.notes.push_back(std::string(what) + in_three_digits(modulus) + " Pa; the fit started there.");
      };
      if (!r.tracked.rest.empty()) {
        ModalStartOptions o;
        o.first_frame = r.capture.scene.timing.start_frame;
        o.curve_samples = 0;
        const ModalStart start =
            modal_start(d.body, r.blocks.motion, theta, held, r.tracked, r.capture.scene.timing.times, o);
        if (!start.found) continue;
        take_dampings(start);
        relative_moduli_ = start.moduli / start.moduli[0];
        theta = run_.parameters.reference();
        set_all_moduli(theta, start.moduli[0]);
        set_reference(theta);
        const double modulus = with_weight(d, r, theta).value_or(start.moduli[0]);
        set_all_moduli(theta, modulus);
        set_reference(theta);
        say("The vibrations of the followed points are those of a Young's modulus of about ", modulus);
        return true;
      }
      Simulation simulation(d.body, d.simulation);
      const auto start = swing_start(simulation, theta, *r.observations);
      if (!start) continue;
      set_all_moduli(theta, start->youngs_modulus);
      set_reference(theta);
      say(("The object swings at " + in_three_digits(start->frequency) + " Hz, as with a Young's modulus of about ")
              .c_str(),
          start->youngs_modulus);
      return true;
    }
    return false;
  }

  /// Dampings that the user has not given begin where the decay of the vibrations has them.
  void take_dampings(const ModalStart& start) {
    VectorX theta = run_.parameters.reference();
    const auto take = [&](const char* name, double value) {
      const auto change = run_.options.parameters.find(name);
      const Parameter* p = run_.parameters.find(name);
      if (value <= 0.0 || !p->estimated || (change != run_.options.parameters.end() && change->second.start)) return;
      theta[p->at] = std::clamp(value, p->lower, p->upper);
    };
    take("mass_damping", start.mass_damping);
    take("stiffness_damping", start.stiffness_damping);
    set_reference(theta);
  }

  /// Young's modulus over decades of the stress under the object's own weight.
  void scan() {
    const VectorX theta = run_.parameters.reference();
    const MotionBlocks& blocks = run_.recordings.front().blocks.motion;
    const double g = std::max(blocks.gravity.vector(theta).norm(), 0.1);
    const double stress =
        carrying_modulus_ > 0.0 ? 0.25 * carrying_modulus_ : theta[blocks.density] * g * run_.recordings.front().size;
    const int per_decade = run_.options.scan_per_decade * (run_.swings() ? 2 : 1);
    const int count = 4 * per_decade + 1;
    if (int(run_.state.scan.size()) != count) {
      run_.state.scan.assign(std::size_t(count), {});
      std::atomic<int> done = 0;
      const auto try_value = [&](int i) {
        VectorX trial = theta;
        set_all_moduli(trial, stress * std::pow(10.0, double(i) / per_decade));
        run_.state.scan[std::size_t(i)] = {first_modulus(trial), std::numeric_limits<double>::infinity()};
        if (run_.interrupted()) return;
        Objective objective = run_.recordings.objective(
            run_.coarse, run_.fixed_at(trial), run_.options.wide_band,
            [&](const Recording& r) { return run_.swings() ? r.horizon(growing_horizon().front()) : r.last_frame; });
        const CostEvaluation e = objective.evaluate(VectorX(0));
        if (e.succeeded) run_.state.scan[std::size_t(i)].second = e.cost;
        run_.emit({StageKind::Scan, "scan", 0, i + 1, e.cost, 0.0, e.surface_rms(), trial,
                   0.05 + 0.1 * double(++done) / count});
      };
      if (run_.recordings.all_static())
        scan_downwards(count, try_value);
      else
        parallel_tasks(std::size_t(count), [&](std::size_t i) { try_value(int(i)); });
      if (run_.interrupted()) {
        run_.state.scan.clear();
        run_.outcome.interrupted = true;
        return;
      }
      run_.save_state();
    }
    // Every start is a valley of the scan before it is merely low: neighbours lead to the same place.
    std::vector<int> order(run_.state.scan.size());
    std::iota(order.begin(), order.end(), 0);
    const auto cost = [&](int i) { return run_.state.scan[std::size_t(i)].second; };
    const auto is_valley = [&](int i) {
      return (i == 0 || cost(i) <= cost(i - 1)) && (i + 1 == int(order.size()) || cost(i) <= cost(i + 1));
    };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      if (is_valley(a) != is_valley(b)) return is_valley(a);
      return cost(a) < cost(b);
    });
    const double least =
        std::min_element(run_.state.scan.begin(), run_.state.scan.end(), [](const auto& a, const auto& b) {
          return a.second < b.second;
        })->second;
    constexpr double hopeless = 4.0;  // valleys this much above the lowest are not worth following
    for (const int i : order) {
      if (int(start_moduli_.size()) >= run_.options.starts || !std::isfinite(cost(i))) break;
      if (cost(i) > hopeless * least) continue;
      start_moduli_.push_back(run_.state.scan[std::size_t(i)].first);
    }
    if (start_moduli_.empty())
      throw InputError(
          {{run_.recordings.front().capture.file},
           "no stiffness between " + in_three_digits(stress) + " Pa and ten thousand times that can be simulated",
           "",
           "check mass, gravity and the size of the scan"});
    set_all_moduli(run_.outcome.start_theta, start_moduli_.front());
  }

  void follow_starts() {
    if (run_.outcome.interrupted) return;
    if (!scanned_) start_moduli_ = {first_modulus(run_.parameters.reference())};
    const std::size_t count = start_moduli_.size();
    if (run_.state.starts.size() == count) {
      run_.outcome.starts = run_.state.starts;
      return;
    }
    std::vector<FitStart> starts(count);
    parallel_tasks(count, [&](std::size_t i) { starts[i] = follow(int(i), start_moduli_[i]); });
    if (run_.interrupted()) run_.outcome.interrupted = true;
    run_.outcome.starts = starts;
    if (run_.outcome.interrupted) return;  // half-followed starts are a result, but nothing to go on from
    run_.state.starts = std::move(starts);
    run_.save_state();
  }

  /// One start on the coarse grid: wide band, horizon growing as the early frames match.
  FitStart follow(int index, double modulus) {
    ParameterSet parameters = run_.parameters;
    VectorX theta = run_.parameters.reference();
    if (scanned_) set_all_moduli(theta, modulus);
    parameters.set_reference(theta);
    // Poisson's ratio is told from the rest only once the fit is close.
    parameters.set_estimated("poissons_ratio", false);
    FitStart start;
    start.start = theta;
    int counter = 0;
    bool first = true;
    for (const double part : growing_horizon()) {
      const bool last = part == 1.0 && !first;
      const double from = 0.15 + 0.3 * (part < 1.0 ? 0.0 : 0.4);
      Objective objective = run_.recordings.objective(run_.coarse, parameters, run_.options.wide_band,
                                                      [&](const Recording& r) { return r.horizon(part); });
      const OptimiserSummary s = run_.optimise(objective, FitRun::start_of(parameters), StageKind::Coarse, "coarse",
                                               index, last ? 10 : 5, counter, from, from + 0.15);
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
      if (run_.interrupted()) break;
      if (last) break;
    }
    return start;
  }

  FitRun& run_;
  int controls_;             // moduli of the object
  VectorX relative_moduli_;  // of the scan and the starts, the first one's being one
  bool scanned_ = false;
  double carrying_modulus_ = 0.0;  // [Pa] that is enough for a scan that sags; 0: no scan does
  std::vector<double> start_moduli_;
};

}  // namespace

void find_starts(FitRun& run) { StartFinder(run).find(); }

}  // namespace pliant
