#include "estimation/fit_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/corrections.hpp"
#include "estimation/fit_starts.hpp"
#include "estimation/given_quantities.hpp"
#include "estimation/judgement.hpp"
#include "estimation/load_free.hpp"
#include "estimation/notes.hpp"
#include "estimation/scan_errors.hpp"
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

constexpr double most_cells = 64.0;  // along the object's longest axis
// Enough to tell how far another model's estimate lies: of a time step, which changes little, and on coarser meshes,
// where they cost little.
constexpr int few_iterations = 2, many_iterations = 5;
constexpr int uneven_objects = 3;
constexpr double width_of_scan_errors =
    0.5;  // of a coefficient: differences by it are those of the least changes that show
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
  f.looks_at_scan_errors = options_.alternatives && recordings_.any_scan_errs();
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

/// Each stands for what is known to differ between a model and what is recorded: its mesh and time step, the law at
/// large strain, how evenly stiff the object is, and what the capture gives.
std::vector<Alternative> FitRun::alternatives() const {
  const bool is_static = recordings_.all_static();
  std::vector<Alternative> all;
  const double ratio = Refinement::mesh_ratio;
  // Of motions, what another law changes is seen on the coarser mesh as well, for a third of the work.
  const bool has_coarser = recordings_.any_meshed_here() && !is_static;
  const double cells = has_coarser ? 1.0 / ratio : 1.0;
  if (has_coarser)
    all.push_back({cause_mesh, cells, 1.0, {}, false, judgement.size_of_coarser_mesh, false, many_iterations});
  if (recordings_.any_meshed_here() && is_static)
    all.push_back({cause_mesh, ratio, 1.0, {}, false, judgement.size_of_finer_mesh});
  if (!is_static)
    all.push_back({"time step",
                   1.0,
                   1.0 / Refinement::step_ratio,
                   {},
                   false,
                   judgement.size_of_longer_step,
                   false,
                   few_iterations});
  // An impact shakes all of an object, and few steps tell poorly what unevenness changes there: 0.3, 0.9, 2, 5 and 12 %
  // were found of five recordings, by a fifth more time. What hangs or swings feels what is near its clamp.
  const bool meets_nothing =
      std::ranges::none_of(recordings_.all(), [](const Recording& r) { return r.capture.scene.is_touched(); });
  if (recordings_.any_uneven() && meets_nothing) {
    double worst = 0.0;  // what an object is as stiff as, on some mean, varies by less than its stiffness does
    for (const Recording& r : recordings_.all()) worst = std::max(worst, r.unevenness);
    const double share = 1.0 / std::sqrt(double(uneven_objects));
    for (int realisation = 1; realisation <= uneven_objects; ++realisation) {
      Alternative uneven{cause_unevenness, cells, 1.0, {.unevenness = realisation}};
      uneven.size = share / part_of_unevenness;
      uneven.most = share * worst;
      uneven.beside_the_first = has_coarser, uneven.iterations = few_iterations;
      all.push_back(std::move(uneven));
    }
  }
  if (!options_.law_of_motion() && options_.material != MaterialKind::Linear)
    all.push_back({"law at large strain",
                   cells,
                   1.0,
                   {.small_strain = true},
                   false,
                   is_static ? judgement.size_of_small_strain_at_rest : judgement.size_of_small_strain,
                   has_coarser,
                   has_coarser ? many_iterations : few_iterations});
  all.push_back({"what is given", cells, 1.0, {}, true, 1.0});
  return all;
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

/// Systematic errors that were not estimated and show in the residuals at the estimate.
StageRecord FitRun::test_corrections(const Stage& stage) {
  const VectorX& theta = stage.from.front();
  StageRecord record{stage.id, stage.name, theta, theta};
  record.succeeded = true;
  if (const StageRecord* estimate = plan_.estimate(state_.done)) {
    record.cost = estimate->cost;
    const CostEvaluation* ended = estimate->evaluation.get();
    if (ended && !may_need_correction(record.cost, ended->independent_observations())) return record;
  }
  std::vector<std::string> chosen;
  for (const auto& [name, change] : options_.parameters) chosen.push_back(name);
  const std::vector<Correction> possible = possible_corrections(plan_.facts().parameters, chosen);
  ParameterSet with_all = plan_.facts().parameters;
  for (const Correction& c : possible)
    for (const std::string& name : c.parameters) with_all.set_estimated(name, true);
  with_all.set_reference(theta);
  Objective objective = objective_of(stage, with_all, grid(stage));
  const CostEvaluation e = objective.linearise(with_all.to_unconstrained(theta));
  record.work = e.work;
  if (!e.succeeded) return record;
  for (const NeededCorrection& needed : needed_corrections(e, with_all, possible, e.independent_observations())) {
    record.told += (record.told.empty() ? "" : " and ") + needed.correction.what;
    for (const std::string& name : needed.correction.parameters) record.corrected.push_back(name);
  }
  return record;
}

/// One Gauss-Newton step of the estimate and the scan's errors together; what the latter leave open moves the estimate.
/// The first time what surfaces differ by is seen on the coarse mesh, which leads most of the way.
StageRecord FitRun::look_at_scan_errors(const Stage& stage) {
  constexpr double worth = 0.5;  // a standard deviation of what is estimated and of the errors together
  const VectorX& theta = stage.from.front();
  StageRecord record{stage.id, stage.name, theta, theta};
  record.succeeded = true;
  const ParameterSet parameters = parameters_of(stage, theta);
  const VectorX p = parameters.to_unconstrained(theta);
  const CostEvaluation e = objective_of(stage, parameters, grid(stage), true).linearise(p);
  record.work = e.work;
  if (!e.succeeded) return record;
  std::vector<double> coefficients = stage.change.scan_errors;
  coefficients.resize(ScanErrors::count);
  Spacing spacing = stage.grid;
  CostEvaluation at = e;
  if (stage.id.number == 0) {
    try {
      CostEvaluation coarse = objective_of(stage, parameters, grid(coarse_spacing(), stage.change), true).evaluate(p);
      if (coarse.succeeded) spacing = coarse_spacing(), at = std::move(coarse);
    } catch (const InputError&) {  // so coarse a mesh cannot be so far from the scan
    }
  }
  const Grid& beside = grid(spacing, stage.change);
  std::vector<CostEvaluation> moved(coefficients.size());
  const auto evaluate = [&](std::size_t k) {
    ModelChange change = stage.change;
    change.scan_errors = coefficients;
    change.scan_errors[k] += width_of_scan_errors;
    try {
      const Grid there = recordings_.grid(spacing.cells, spacing.steps, change, &beside);
      moved[k] = objective_of(stage, parameters, there, true).evaluate(p);
    } catch (const InputError& error) {
      moved[k].failure = error.what();
    }
  };
  if (monitor_.has_others())  // what they exchange has an order
    for (std::size_t k = 0; k < moved.size(); ++k) evaluate(k);
  else
    parallel_tasks(moved.size(), evaluate);
  record.work += at.work;
  for (const CostEvaluation& m : moved) record.work += m.work;
  const ScanErrorStep step = scan_error_step(e, at, moved, width_of_scan_errors, coefficients);
  record.cost = e.cost;
  record.converged = step.promise > worth;
  record.scan_errors = step.coefficients;
  record.theta = parameters.to_theta(parameters.clamp(p + step.shift.cwiseMax(-largest_shift).cwiseMin(largest_shift)));
  // Stiffness goes at most with the fourth power of a thickness, of which both sides err. Differences about an impact
  // tell less well than that.
  double most = 0.0;
  for (const Recording& r : recordings_.all()) most = std::max(most, 4.0 * 2.0 * r.scan_error / r.thickness);
  MatrixX follows = step.follows.cwiseMax(-largest_shift).cwiseMin(largest_shift);
  const std::vector<const Parameter*> coordinates = parameters.coordinate_parameters();
  VectorX of_all = VectorX::Zero(follows.rows());
  for (Eigen::Index i = 0; i < follows.rows(); ++i) of_all[i] = follows.row(i).norm();
  follows *= share_within(of_all, coordinates, most);
  for (Eigen::Index k = 0; k < follows.cols(); ++k) record.shifts.push_back({cause_scan, follows.col(k)});
  const std::lock_guard lock(mutex_);
  outcome_.forward_steps += e.steps + at.steps;
  for (const CostEvaluation& m : moved) outcome_.forward_steps += m.steps;
  return record;
}

StageRecord FitRun::try_alternative(const Stage& stage, bool& is_cut) {
  const Alternative& alternative = *stage.alternative;
  const VectorX& from = stage.from.front();
  const VectorX& estimate = plan_.result(ended_before_)->theta;
  StageRecord record{stage.id, stage.name, from, from};
  record.succeeded = true;
  const ParameterSet parameters = parameters_of(stage, from);
  if (record.reason = why_not_made(stage); !record.reason.empty()) return record;
  if (alternative.given) {
    record.shifts = shifts_of_given(stage, parameters, record.work);
    return record;
  }
  Objective objective = objective_of(stage, parameters, grid(stage));
  const MovedEstimate moved =
      move_estimate(objective, parameters, alternative.iterations, [&] { return !is_interrupted(); });
  const OptimiserSummary& s = moved.summary;
  is_cut = s.interrupted;
  record.cost = s.succeeded ? s.evaluation.cost : infinite;
  record.iterations = s.iterations, record.work = s.work;
  if (!s.succeeded) record.reason = s.reason;
  if (s.succeeded) {
    record.converged = moved.converged;
    const VectorX end = parameters.to_theta(moved.p);
    if (record.converged) record.theta = end;
    const ParameterSet all = plan_.estimated(ended_before_);
    const VectorX shift = all.to_unconstrained(end) - all.to_unconstrained(estimate);
    record.shifts = {{alternative.cause, shift.cwiseMax(-largest_shift).cwiseMin(largest_shift)}};
  }
  const std::lock_guard lock(mutex_);
  outcome_.forward_steps += s.steps;
  return record;
}

std::vector<ModelShift> FitRun::shifts_of_given(const Stage& stage, const ParameterSet& estimated, double& work) {
  const std::vector<GivenQuantity> given = given_quantities(estimated, recordings_.common_errors());
  const GivenScale scale = recordings_.given_scale();
  ParameterSet all = with_given(estimated, given);
  if (scale.deviation > 0.0) all = with_strengths_of_gravity(all);
  Objective objective = objective_of(stage, all, grid(stage));
  const CostEvaluation e = objective.linearise(all.to_unconstrained(all.reference()));
  work = e.work;
  return e.succeeded ? pliant::shifts_of_given(e, all, given, scale) : std::vector<ModelShift>{};
}

/// Whether the mesh's part in the uncertainty of a modulus is more than half of the noise's, and the next finer mesh
/// can be had within the budget, or within a little less where other parts are larger: what was spent is in the
/// records, what it takes follows from the last estimate's iterations. Both are counted, not timed: a machine that is
/// busy, or slow, gives the same answer.
StageRecord FitRun::look_at_resolution(const Stage& stage) {
  constexpr double tolerated = 0.5, growth = 3.5;  // of the noise's; power of the ratio of edges, of work
  constexpr int iterations = 4;                    // from an estimate that is near, with the first linearisation
  const VectorX& theta = stage.from.front();
  StageRecord record{stage.id, stage.name, theta, theta};
  record.succeeded = true;
  const StageRecord& at = *plan_.result(state_.done);
  const ParameterSet parameters = parameters_of(stage, theta);
  const CostEvaluation e = linearised_at(at, stage, parameters);
  const VectorX own = gauss_newton_shift(e, largest_shift);
  const std::optional<VectorX> mesh = mesh_shift(state_.done, own);
  if (!e.succeeded || !mesh) return record;
  const VectorX all =
      uncertainty_of(e, shifts_in(state_.done, own), floor(parameters, theta), int(recordings_.all().size())).std;
  const VectorX noise = noise_covariance(e).diagonal().cwiseMax(0.0).cwiseSqrt();
  const std::vector<const Parameter*> of = parameters.coordinate_parameters();
  double share = 0.0, statistical = 0.0, whole = 0.0;
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (!is_modulus(*of[i]) || std::abs((*mesh)[Eigen::Index(i)]) <= share) continue;
    share = std::abs((*mesh)[Eigen::Index(i)]), statistical = noise[Eigen::Index(i)], whole = all[Eigen::Index(i)];
  }
  if (share <= tolerated * statistical) return record;
  double spent = 0.0;
  for (const StageRecord& r : state_.done) spent += r.work / work_of_a_minute;
  const double predicted =
      at.work / work_of_a_minute / (at.iterations + 1) * iterations * std::pow(Refinement::mesh_ratio, growth);
  const double price = share * share > 0.5 * whole * whole ? 1.0 : 1.1;
  record.converged = price * (spent + predicted) <= options_.budget;
  if (!record.converged)
    record.told = fmt::format(
        "The mesh contributes {:.1f} % to the uncertainty of Young's modulus, noise {:.1f} %: a finer one would narrow "
        "it and takes about {:.0f} {} in all, --budget {:.0f}.",
        100.0 * share, 100.0 * statistical, std::ceil(spent + predicted),
        spent + predicted > 1.0 ? "minutes" : "minute", std::ceil(1.001 * price * (spent + predicted)));
  return record;
}

/// By how far the estimate errs for its mesh, as the last finer one or the alternative shows.
/// @param own  what is left of the way to the estimate's own minimum
std::optional<VectorX> FitRun::mesh_shift(const std::vector<StageRecord>& done, const VectorX& own) const {
  const std::vector<const StageRecord*> finer = plan_.repetitions(done);
  if (!finer.empty()) {
    const ParameterSet parameters = plan_.estimated(done);
    const StageRecord& before = finer.size() > 1 ? *finer[finer.size() - 2] : *plan_.estimate(done);
    return judgement.size_of_coarser_mesh *
           (parameters.to_unconstrained(before.theta) - parameters.to_unconstrained(finer.back()->theta));
  }
  for (const StageRecord& r : done) {
    if (r.id.kind != StageKind::Alternative || r.shifts.empty()) continue;
    const Alternative& a = plan_.facts().alternatives[std::size_t(r.id.number)];
    if (a.cause == cause_mesh && r.shifts.front().shift.size() == own.size())
      return a.size * (r.shifts.front().shift - own);
  }
  return std::nullopt;
}

}  // namespace pliant
