#include "estimation/fit_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/fit_starts.hpp"
#include "estimation/judgement.hpp"
#include "estimation/load_free.hpp"
#include "estimation/notes.hpp"
#include "estimation/verdict.hpp"

namespace pliant {

namespace {

/// The overload that goes on from a state.
OptimiserSummary minimise_from(Objective& objective, const OptimiserState& state, const OptimiserOptions& options,
                               const std::function<bool(const Iteration&)>& on_iteration) {
  return minimise(objective, state, options, on_iteration);
}

OptimiserState start_of(const ParameterSet& parameters) {
  return {0, parameters.to_unconstrained(parameters.reference()), {}};
}

int last_frame(const Horizon& horizon, const Recording& r) {
  switch (horizon.until) {
    case Horizon::Until::Start:
      return 0;
    case Horizon::Until::Beginning:  // the pose of a released object shows in the frames before, a velocity only after
      return r.is_released() ? 0 : std::max(2, int(horizon.part * r.last_frame));
    case Horizon::Until::Part:
      break;
  }
  return horizon.part < 1.0 ? r.horizon(horizon.part) : r.last_frame;
}

constexpr double most_cells = 64.0;        // along the object's longest axis
constexpr int trials_after_rejection = 3;  // costs alone are a third of the work, and two threads share them

}  // namespace

FitRun::FitRun(std::vector<RecordedCapture> recorded, const FitOptions& options, const FitMonitor& monitor,
               PassState state, const PassLimits& limits)
    : StageLoop(options, monitor, std::move(state)),
      recordings_(std::move(recorded), options_, outcome_.notes),
      layout_(std::make_shared<ParameterLayout>(recordings_.parameters().layout())),
      plan_(facts(limits)) {
  state_.controls = recordings_.controls();
}

// What the plan depends on --------------------------------------------------------------------------------------------

const Grid& FitRun::grid(const Spacing& spacing, const ModelChange& change) {
  const auto it = std::ranges::find_if(grids_, [&](const auto& g) {
    return g->cells == spacing.cells && g->steps == spacing.steps && g->change == change;
  });
  if (it != grids_.end()) return **it;
  grids_.push_back(std::make_unique<Grid>(recordings_.grid(spacing.cells, spacing.steps, change)));
  return *grids_.back();
}

std::optional<double> FitRun::given_start(const std::string& name) const {
  const auto change = options_.parameters.find(name);
  if (change == options_.parameters.end() || !change->second.start) return std::nullopt;
  return (*change->second.start)[0];
}

/// Of what sags and swings freely, whose steps are dear, longer ones do while starts are followed.
Spacing FitRun::coarse_spacing() const {
  constexpr double of_swings = 0.5;  // steps in each of the fit's
  const bool swings = std::ranges::all_of(recordings_.all(), [](const Recording& r) {
    return r.is_released() && !r.capture.scene.is_touched() && r.capture.scene.object.shape_is == ShapeIs::Static;
  });
  return {options_.coarse_cells, options_.steps * (swings ? of_swings : 1.0)};
}

FitRun::Carrying FitRun::carrying(const VectorX& theta) {
  constexpr double moderate = 0.2;  // sag of the object's size, under its weight as linear elasticity has it
  // What is seen as it sags must bear that; others may hang as a rag does, where few simulations are lost in trying.
  constexpr double part_of_scan = 0.25, part_at_rest = 0.02, part_in_motion = 0.1;
  Carrying found;
  const Grid& coarse = grid(coarse_spacing());
  for (std::size_t i = 0; i < coarse.recording.size(); ++i) {
    const Discretisation& d = coarse.recording[i];
    const Recording& r = recordings_.all()[i];
    if (d.simulation.holds.empty()) continue;
    const bool sags = d.simulation.scan_sags;
    const double modulus =
        sags ? pliant::carrying_modulus(d.body, d.simulation, theta, [this] { return monitor_.agrees_to_stop(); })
             : modulus_of_sag(d.body, d.simulation.holds, r.blocks.motion, theta, moderate);
    const double part = sags ? part_of_scan : d.simulation.is_static ? part_at_rest : part_in_motion;
    found.modulus = std::max(found.modulus, modulus);
    found.softest = std::max(found.softest, part * modulus);
  }
  return found;
}

PlanFacts FitRun::facts(const PassLimits& limits) {
  PlanFacts f;
  f.options = options_, f.limits = limits;
  f.parameters = recordings_.parameters();
  f.moduli = recordings_.material().youngs_moduli;
  for (const Recording& r : recordings_.all()) {
    const auto is_unknown = [&](const ParameterHandle& friction) {
      return std::ranges::any_of(f.parameters.parameters(), [&](const Parameter& p) {
        return p.at == friction && p.estimated && !given_start(p.name);
      });
    };
    for (const PlaneBlock& plane : r.blocks.motion.planes)
      if (is_unknown(plane.friction)) f.frictions.push_back(plane.friction);
    for (const ContactBlock& obstacle : r.blocks.motion.obstacles)
      if (is_unknown(obstacle.friction)) f.frictions.push_back(obstacle.friction);
  }
  const Recording& first = recordings_.front();
  f.density = first.blocks.motion.density, f.gravity = first.blocks.motion.gravity;
  f.size = first.size;
  f.swings = recordings_.any_released();
  f.coarse = coarse_spacing();
  f.is_scanned = !given_start("youngs_modulus");
  f.told_at_rest = recordings_.told_at_rest();
  // Moduli of regions and control points begin where the object's own does, but for those that the user has given.
  VectorX theta = f.parameters.reference();
  const double own = theta[f.moduli.front()];
  const std::vector<std::string> names = modulus_names(first.capture, recordings_.controls());
  f.relative_moduli = VectorX::Ones(recordings_.controls());
  for (int k = 0; k < recordings_.controls(); ++k)
    f.relative_moduli[k] = given_start(names[std::size_t(k)]).value_or(own) / own;
  recordings_.set_moduli(theta, own * f.relative_moduli);
  // What is held has to be stiff enough for its weight before anything can be tried.
  if (f.is_scanned) {
    const Carrying enough = carrying(theta);
    f.softest = enough.softest;
    if (enough.modulus > 0.0) recordings_.set_moduli(theta, enough.modulus * f.relative_moduli);
  }
  f.parameters.set_reference(theta);
  f.repetitions = refined_spacings({options_.cells, options_.steps}, options_.refine, recordings_.any_meshed_here(),
                                   !recordings_.all_static());
  if (options_.alternatives) f.alternatives = alternatives();
  f.looks_at_scan_errors = (options_.alternatives || limits.looks_at_scan_errors) && recordings_.any_scan_errs();
  f.repeats_by_need =
      options_.refine == 1 && options_.alternatives && options_.budget > 0.0 && recordings_.any_meshed_here();
  for (double cells = options_.cells * Refinement::mesh_ratio; f.repeats_by_need && cells <= most_cells;
       cells *= Refinement::mesh_ratio)
    f.repetitions.push_back({cells, options_.steps});
  constexpr double hardly = 0.8;  // of the elements
  const Grid &coarse = grid(coarse_spacing()), &fine = grid({options_.cells, options_.steps});
  f.coarse_is_as_fine = true;
  for (std::size_t i = 0; i < fine.recording.size(); ++i)
    f.coarse_is_as_fine = f.coarse_is_as_fine &&
                          coarse.recording[i].body->element_count() >= hardly * fine.recording[i].body->element_count();
  return f;
}

// The loop ------------------------------------------------------------------------------------------------------------

std::vector<StageChain> FitRun::next() {
  std::vector<StageChain> chains = plan_.next(state_);
  ended_before_ = state_.done;  // what stages beside each other may know of others
  const bool at_alternatives = !chains.empty() && chains.front().front().alternative;
  if (at_alternatives) (void)grid(plan_.spacing_of(*plan_.result(state_.done)), plan_.surface(state_.done));
  if (at_alternatives && !grids_of_fit_) grids_of_fit_ = grids_.size();
  if (!at_alternatives && grids_of_fit_) {  // those of alternatives are not used again
    grids_.resize(*grids_of_fit_);
    grids_of_fit_.reset();
  }
  for (const StageChain& chain : chains)
    for (const Stage& stage : chain) make_grid(stage);  // before threads ask for it
  return chains;
}

void FitRun::make_grid(const Stage& stage) {
  if (!stage.alternative && stage.id.kind != StageKind::OffScan) {
    (void)grid(stage);
    return;
  }
  try {
    (void)grid(stage);
  } catch (const InputError& error) {  // no mesh as fine, too small an object, or one too thin for such errors
    not_made_.emplace_back(stage.id, error.what());
  }
}

std::string FitRun::why_not_made(const Stage& stage) const {
  const auto failure = std::ranges::find(not_made_, stage.id, &std::pair<StageId, std::string>::first);
  return failure == not_made_.end() ? "" : failure->second;
}

StageRecord FitRun::run_stage(const Stage& stage, bool& is_cut) {
  switch (stage.id.kind) {
    case StageKind::Swing:
      return find_swing(stage);
    case StageKind::Scan:
      return scan(stage, is_cut);
    case StageKind::Pulls:
      return find_pulls(stage, is_cut);
    case StageKind::Test:
      return test_corrections(stage);
    case StageKind::ScanErrors:
      return look_at_scan_errors(stage);
    case StageKind::Alternative:
      return try_alternative(stage, is_cut);
    case StageKind::Resolution:
      return look_at_resolution(stage);
    default:
      return minimise_stage(stage, is_cut);
  }
}

/// What a scan or a repetition has reached is nothing yet.
PassState FitRun::reached() const {
  PassState reached = state_;
  for (const StageRecord& r : partial_)
    if (r.id.kind != StageKind::Scan && r.id.kind != StageKind::Finer && r.id.kind != StageKind::Alternative &&
        r.id.kind != StageKind::ScanErrors && r.id.kind != StageKind::OffScan && r.id.kind != StageKind::Resolution)
      reached.done.push_back(r);
  return reached;
}

void FitRun::tell(FitEvent event) {
  event.fraction_done /= all_work();
  if (event.fraction_done > 1.0) event.fraction_done = 0.0;  // beyond what was planned: how much is left is not known
  event.youngs_modulus = event.theta[recordings_.material().youngs_moduli.front()];
  event.layout = layout_;
  emit(std::move(event));
}

double FitRun::all_work() const {
  double all = 1.0;
  if (plan_.facts().repeats_by_need) return all;
  for (const Spacing& s : plan_.facts().repetitions) all += plan_.work(s);
  return all;
}

// Stages --------------------------------------------------------------------------------------------------------------

ParameterSet FitRun::parameters_of(const Stage& stage, const VectorX& theta) const {
  ParameterSet set = plan_.facts().parameters;
  for (const Parameter& p : plan_.facts().parameters.parameters())
    set.set_estimated(p.name, std::ranges::find(stage.free, p.name) != stage.free.end());
  set.set_reference(theta);
  return set;
}

VectorX FitRun::pose_of(const Stage& stage) const {
  const std::lock_guard lock(mutex_);
  const StageRecord* record = stage.pose_of ? find_record(state_.done, *stage.pose_of) : nullptr;
  return record ? record->theta : VectorX();
}

Objective FitRun::objective_of(const Stage& stage, const ParameterSet& parameters, const Grid& grid,
                               bool keeps_rows) const {
  return recordings_.objective(
      grid, parameters,
      {stage.band,
       [&](const Recording& r) { return last_frame(stage.horizon, r); },
       pose_of(stage),
       stage.by_pose,
       {},
       keeps_rows},
      [this] { return !stages_are_over_ && monitor_.is_asked_to_stop(); }, monitor_.processes);
}

OptimiserSummary FitRun::optimise(Objective& objective, const Stage& stage, const OptimiserState& from,
                                  std::optional<int>& joined) {
  OptimiserOptions o;
  o.kind = options_.optimiser;
  o.max_iterations = stage.iterations;
  o.promise_tolerance = stage.promise_tolerance, o.cost_tolerance = stage.cost_tolerance;
  if (!recordings_.all_static()) o.trials_after_rejection = trials_after_rejection;
  const bool saves = is_on_full_grid(stage.id.kind) && !interrupted_;  // a last look is no state to go on from
  const bool is_staggered = options_.load_free == LoadFreeScheme::Staggered && recordings_.any_sags();
  int iterations = from.iterations;
  OptimiserSummary s = (is_staggered ? minimise_staggered : minimise_from)(objective, from, o, [&](const Iteration& i) {
    ++iterations;
    if (saves) keep_under_way(stage, i.state());
    FitEvent event{stage.id.kind, stage.name, stage.id.start, stage.iterations_before + iterations,
                   i.cost,        i.damping,  i.surface_rms,  objective.parameters().to_theta(i.p)};
    const double part = std::min(1.0, double(iterations) / stage.iterations);
    event.fraction_done = stage.done_from + (stage.done_to - stage.done_from) * part;
    tell(std::move(event));
    joined = plan_.joined_on_the_way(stage, objective.parameters().to_theta(i.p), i.cost, ended_before_);
    return !joined && !is_interrupted();
  });
  const std::lock_guard lock(mutex_);
  outcome_.forward_steps += s.steps;
  return s;
}

VectorX FitRun::with_tried_moduli(Objective& objective, VectorX p, double& work) const {
  constexpr int most_rounds = 2, most_worse = 2;
  const std::vector<const Parameter*> of = objective.parameters().coordinate_parameters();
  double least = infinite;
  // One after the other: each load-free shape is near the one before.
  const auto is_less = [&](const VectorX& trial) {
    const CostEvaluation e = objective.evaluate(trial);
    work += e.work;
    if (!e.succeeded || e.cost >= least) return false;
    least = e.cost;
    return true;
  };
  (void)is_less(p);
  bool moved = true;
  for (int round = 0; round < most_rounds && std::exchange(moved, false); ++round)
    for (std::size_t i = 0; i < of.size() && !is_interrupted(); ++i) {
      if (!is_modulus(*of[i])) continue;
      const VectorX from = p;
      const auto is_better = [&](double factor) {
        VectorX trial = from;
        trial[Eigen::Index(i)] += std::log(factor);
        trial = objective.parameters().clamp(trial);
        if (!is_less(trial)) return false;
        p = trial;
        return moved = true;
      };
      int worse = 0;
      for (double factor = 0.5; factor > 0.1 && worse < most_worse; factor *= 0.5) worse += is_better(factor) ? 0 : 1;
      if (p == from && is_better(2.0)) (void)is_better(4.0);
    }
  return p;
}

/// Of the places where a stage may begin the one of the least cost.
VectorX FitRun::best_of(const Stage& stage) {
  const VectorX* best = &stage.from.front();
  double least = infinite;
  for (const VectorX& theta : stage.from) {
    if (stage.from.size() == 1) break;
    const ParameterSet parameters = parameters_of(stage, theta);
    const CostEvaluation e = objective_of(stage, parameters, grid(stage)).evaluate(parameters.to_unconstrained(theta));
    if (e.succeeded && e.cost < least) least = e.cost, best = &theta;
  }
  return *best;
}

StageRecord FitRun::minimise_stage(const Stage& stage, bool& is_cut) {
  if (const std::string why = why_not_made(stage); !why.empty()) {
    StageRecord record{stage.id, stage.name, stage.from.front(), stage.from.front()};
    record.reason = why;
    return record;
  }
  const StageUnderWay* left = under_way(stage.id);
  const VectorX from = left ? left->from : best_of(stage);
  const ParameterSet parameters = parameters_of(stage, from);
  Objective objective = objective_of(stage, parameters, grid(stage));
  Stage own = stage;
  own.from = {from};
  OptimiserState begin = left && left->optimiser.p.size() > 0 ? left->optimiser : start_of(parameters);
  double tried = 0.0;
  if (stage.tries_moduli && begin.iterations == 0) begin.p = with_tried_moduli(objective, begin.p, tried);
  std::optional<int> joined;
  OptimiserSummary s = optimise(objective, own, begin, joined);
  is_cut = s.interrupted && !joined;
  StageRecord record{stage.id, stage.name, from, from};
  record.succeeded = s.succeeded, record.converged = s.converged, record.reason = s.reason;
  record.scan_errors = stage.change.scan_errors;
  if (joined) record.joined = joined, record.reason = "came into the valley of start " + std::to_string(*joined + 1);
  record.iterations = s.iterations, record.work = tried + s.work;
  record.start_cost = s.start_cost, record.cost = s.succeeded ? s.evaluation.cost : infinite;
  if (s.succeeded && !is_cut && s.evaluation.cost > stage.give_up_above) {
    record.succeeded = record.converged = s.evaluation.succeeded = false;
    record.reason = s.evaluation.failure = "the cost falls by too little to be followed further";
  }
  if (s.succeeded) record.misfit = misfit_of(s.evaluation), record.is_explained = is_explained(s.evaluation);
  record.elements = grid(stage).recording.front().body->element_count();
  if (s.succeeded) record.theta = parameters.to_theta(s.p);
  if (is_on_full_grid(stage.id.kind))
    record.evaluation = std::make_shared<const CostEvaluation>(std::move(s.evaluation));
  return record;
}

StageRecord FitRun::find_pulls(const Stage& stage, bool& is_cut) {
  StageRecord record{stage.id, stage.name, stage.from.front(), stage.from.front()};
  record.cost = infinite;
  record.succeeded = true;  // without them the next stage looks for them
  const bool is_registered =
      std::ranges::any_of(recordings_.all(), [](const Recording& r) { return r.pose.has_value(); });
  for (VectorX theta : stage.from) {
    OptimiserSummary s;
    for (Stage part = stage; const bool by_pose : {true, false}) {
      if (by_pose && !is_registered) continue;
      part.by_pose = by_pose;
      const ParameterSet pulls = parameters_of(part, theta);
      Objective objective = objective_of(part, pulls, grid(part));
      OptimiserOptions o;
      o.max_iterations = part.iterations;
      s = minimise(objective, start_of(pulls), o, [&](const Iteration&) { return !is_interrupted(); });
      outcome_.forward_steps += s.steps;
      is_cut = is_cut || s.interrupted;
      record.iterations += s.iterations, record.work += s.work;
      if (s.succeeded) theta = pulls.to_theta(s.p);
    }
    if (!s.succeeded || !(s.evaluation.cost < record.cost)) continue;
    record.cost = s.evaluation.cost;
    record.theta = theta;
  }
  return record;
}

StageRecord FitRun::find_swing(const Stage& stage) {
  StageRecord record{stage.id, stage.name, stage.from.front(), stage.from.front()};
  record.succeeded = true;
  if (auto found = seen_swing(recordings_, plan_.facts(), grid(stage), stage.from.front())) {
    record.converged = true;
    record.theta = std::move(found->theta);
    record.told = std::move(found->told);
  }
  return record;
}

namespace {

/// All moduli are free, whatever was assumed about them beforehand, and nothing else is.
ParameterSet moduli_alone(const ParameterSet& parameters, const VectorX& theta) {
  std::vector<Parameter> list;
  for (const Parameter& p : parameters.parameters()) {
    if (!is_modulus(p)) continue;
    list.push_back(p);
    list.back().estimated = true;
    list.back().prior_std = infinite;
  }
  return {parameters.layout(), std::move(list), theta};
}

/// At rest every softer body hangs lower and costs more equilibria: from stiff to soft, until it is clear that the
/// valley was passed, or that nothing softer can hold itself up.
void evaluate_downwards(Objective& objective, std::span<const VectorX> points,
                        const std::function<bool(std::size_t, const CostEvaluation&)>& on_evaluated) {
  double least = infinite;
  int worse = 0;
  bool goes_on = true;
  for (std::size_t i = points.size(); i-- > 0 && goes_on && worse < 2;) {
    const CostEvaluation e = objective.evaluate(points.subspan(i, 1)).front();
    const double cost = e.succeeded ? e.cost : infinite;
    worse = cost > 1.2 * least ? worse + 1 : 0;
    goes_on = on_evaluated(i, e) && std::isfinite(cost);
    least = std::min(least, cost);
  }
}

}  // namespace

StageRecord FitRun::scan(const Stage& stage, bool& is_cut) {
  StageRecord record{stage.id, stage.name, stage.from.front(), stage.from.front()};
  record.succeeded = true;
  const VectorX& theta = stage.from.front();
  Objective objective = objective_of(stage, parameters_of(stage, theta), grid(stage));
  const ParameterSet moduli = moduli_alone(plan_.facts().parameters, theta);
  objective.set_parameters(moduli);
  std::vector<VectorX> trials, points;
  for (const double modulus : stage.trials) {
    trials.push_back(plan_.with_modulus(theta, modulus, state_.done));
    points.push_back(moduli.to_unconstrained(trials.back()));
    record.trials.emplace_back(trials.back()[plan_.facts().moduli.front()], infinite);
  }
  std::atomic<int> done = 0;
  std::vector<double> work(trials.size(), 0.0);
  std::string why_not;  // of the stiffest
  const auto on_evaluated = [&](std::size_t i, const CostEvaluation& e) {
    work[i] = e.work;
    if (e.succeeded) record.trials[i].second = e.cost;
    if (!e.succeeded && i + 1 == trials.size()) why_not = e.failure;
    FitEvent event{StageKind::Scan, stage.name, 0, stage.iterations_before + int(i) + 1, e.cost, 0.0,
                   e.surface_rms(), trials[i]};
    const double part = double(++done) / double(trials.size());
    event.fraction_done = stage.done_from + (stage.done_to - stage.done_from) * part;
    tell(std::move(event));
    return !is_interrupted();
  };
  if (recordings_.all_static())
    evaluate_downwards(objective, points, on_evaluated);
  else
    (void)objective.evaluate(points, on_evaluated);
  record.work = std::accumulate(work.begin(), work.end(), 0.0);
  is_cut = is_interrupted();
  if (!is_cut && best_of_scans({record.trials}, 1).empty())
    throw InputError({{recordings_.front().capture.file},
                      "no stiffness between " + in_three_digits(stage.trials.front()) +
                          " Pa and ten thousand times that can be simulated; of the stiffest: " + why_not,
                      "",
                      "check mass, gravity and the size of the scan"});
  return record;
}

}  // namespace pliant
