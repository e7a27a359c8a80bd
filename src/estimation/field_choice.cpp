#include "estimation/field_choice.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "base/error.hpp"
#include "estimation/bounded_step.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/fit_plan.hpp"
#include "estimation/judgement.hpp"
#include "estimation/recordings.hpp"

namespace pliant {

namespace {

constexpr std::array numbers = {1, 2, 3, 4, 6, 8, 12, 16};
constexpr double impossible = -std::numeric_limits<double>::infinity();
/// What a field must take off the cost at the least: what a mesh lacks is no noise, and many points make evidence of
/// little.
double least_gain(int best_control_points) {
  return best_control_points == 1 ? judgement.gain_of_second_modulus : judgement.gain_of_further_moduli;
}
/// Of that gain, what one step shows, or the wide band, where dampings and others made up for it.
constexpr double share_on_the_way = 0.3;

/// Whether a field that was fitted is kept beside the best one before.
bool is_worth_it(const TriedField& tried, const TriedField& best) {
  return tried.estimated && !tried.is_refused && tried.log_bayes_factor > judgement.strong_evidence &&
         tried.cost < (1.0 - least_gain(best.control_points)) * best.cost;
}

std::string text_of(double value, const char* format) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string points(int count) { return count == 1 ? "1 control point" : std::to_string(count) + " control points"; }

FitOptions with_controls(FitOptions options, int count) {
  options.control_points = count;
  return options;
}

/// A parameter vector with the moduli of another field: ln E_to = M ln E_from.
VectorX changed(const JointLayout& from, const VectorX& theta, const JointLayout& to, const MatrixX& M) {
  const VectorX logs = from.blocks.front().motion.moduli(theta).array().log();
  return with_moduli(from, theta, to, (M * logs).array().exp());
}

/// The last estimate before any off its surface.
const StageRecord& last_on_surface(const PassState& state) {
  return *std::ranges::find_if(state.done.rbegin(), state.done.rend(), [](const StageRecord& r) {
    return r.succeeded && (r.id.kind == StageKind::Fine || r.id.kind == StageKind::Corrected);
  });
}

/// A guess at how much is done after so many fields.
double done_before(int fields) { return 0.95 * (1.0 - std::pow(0.6, fields)); }

}  // namespace

FieldChoice::FieldChoice(std::vector<RecordedCapture> recordings, const FitOptions& options, FitState resume,
                         std::shared_ptr<ProcessGroup> processes)
    : recordings_(std::move(recordings)),
      options_(options),
      processes_(std::move(processes)),
      left_(std::move(resume.pass)) {
  if (resume.field) choice_ = std::move(*resume.field);
  resumed_ = choice_.under_way;
}

std::optional<Pass> FieldChoice::next() {
  if (is_done()) return std::nullopt;
  while (!is_cut_ && !is_decided()) {
    const int count = numbers[choice_.tried.size()];
    const std::optional<PassState> begin = beginning_of(count);
    if (!begin) continue;
    choice_.under_way = count_ = count;
    const int done = int(choice_.tried.size());
    return pass_of(count, *begin, 1, done_before(done), done_before(done + 1));
  }
  is_last_ = true;
  count_ = best().control_points;
  if (is_cut_) {
    Pass look = pass_of(count_, *choice_.state, 1, 1.0, 1.0);
    look.is_saved = false;
    return look;
  }
  const PassState from = resumed_ == count_ ? left_ : *choice_.state;  // the former where this one was interrupted
  choice_.under_way = count_;
  return pass_of(count_, from, options_.refine, done_before(int(choice_.tried.size())), 1.0);
}

bool FieldChoice::take(FitOutcome outcome, PassState reached) {
  histories_.emplace_back(count_, outcome.history);
  forward_steps_ += outcome.forward_steps;
  const bool is_judged = is_last_ && count_ > 1 && !outcome.interrupted &&
                         outcome.uncertainty.std.size() == outcome.parameters.dimension();
  if (const double evidence = is_judged ? whole_evidence(outcome) : infinite;
      !(evidence > judgement.evidence_of_parts)) {
    refuse_fields(evidence);
    return true;
  }
  if (is_last_) {
    outcome_ = with_history(std::move(outcome));
    if (is_cut_) outcome_->interrupted = true, outcome_->converged = false, outcome_->reason = "interrupted";
    return false;
  }
  if (count_ == 1 && (outcome.interrupted || !outcome.evaluation.succeeded)) {
    outcome_ = std::move(outcome);
    return false;
  }
  is_cut_ = outcome.interrupted;
  if (is_cut_) return false;
  judge(outcome, std::move(reached));
  return true;
}

/// Two numbers in a row were not worth it, or points would be closer than elements.
bool FieldChoice::is_decided() const {
  const std::size_t done = choice_.tried.size();
  return done > 0 && (done == numbers.size() || int(done) - choice_.best > 2 || numbers[done] > options_.cells);
}

std::optional<PassState> FieldChoice::beginning_of(int count) {
  const bool goes_on = resumed_ == count;
  if (goes_on) resumed_ = 0;
  if (count == 1) return left_;
  TriedField promised{count, false, std::numeric_limits<double>::infinity(), impossible};
  PassState begin;
  try {
    begin = with_field(count, promised);
  } catch (const InputError&) {  // the mesh has no room for so many points
  }
  promised_ = promised;
  if (goes_on) return left_;
  // Where one modulus does not explain what was seen, dampings stand where they make up for it: one step from there
  // tells nothing.
  const bool may_lead_elsewhere =
      choice_.tried.size() == 1 && begin.begin && !estimate_of(*choice_.state)->is_explained;
  if (is_worth_a_fit(promised, best()) || may_lead_elsewhere) return begin;
  promised.cost = std::numeric_limits<double>::infinity();
  choice_.tried.push_back(promised);
  return std::nullopt;
}

PassState FieldChoice::with_field(int count, TriedField& promised) {
  std::vector<std::string> unused;
  const Recordings recordings(recordings_, with_controls(options_, count), unused);
  PassState begin = begun_from(*choice_.state);
  const Grid grid = recordings.grid(options_.cells, options_.steps, {.scan_errors = begin.begin->scan_errors});
  const Body& body = *grid.recording.front().body;
  const MatrixX moduli = carried_over(body, field_of(body, best().control_points), body.modulus);
  const JointLayout before = layout_of(best().control_points), after = layout_of(count);
  const auto change = [&](VectorX& theta) { theta = changed(before, theta, after, moduli); };
  begin.controls = count;
  for (StageRecord& r : begin.done) change(r.from), change(r.theta);
  VectorX& theta = begin.begin->theta;
  change(theta);
  ParameterSet parameters = recordings.parameters();
  if (const StageRecord* test = find_record(begin.done, {StageKind::Test}))
    for (const std::string& name : test->corrected) parameters.set_estimated(name, true);
  parameters.set_reference(theta);
  Objective objective = recordings.objective(
      grid, parameters, {options_.fine_band, [](const Recording& r) { return r.last_frame; }}, {}, processes_);
  const VectorX p = parameters.to_unconstrained(theta);
  const CostEvaluation e = objective.linearise(p);
  forward_steps_ += e.steps;
  if (e.succeeded) {
    promised.log_bayes_factor = log_bayes_factor(e, objective.parameters(), p, moduli);
    const VectorX step = step_within_bounds(objective.parameters(), p, e.gradient, e.gauss_newton).step;
    promised.cost = e.cost + step.dot(e.gradient + 0.5 * e.gauss_newton * step);
  }
  // Dampings and, above all, Poisson's ratio made up for what the coarser field lacks: a stage earlier, and the
  // latter where it began.
  const bool is_corrected = last_on_surface(*choice_.state).id.kind == StageKind::Corrected;
  begin.begin->stage = std::max(0, begin.begin->stage - (is_corrected ? 2 : 1));
  if (const Parameter* nu = parameters.find("poissons_ratio"); nu->estimated)
    theta[nu->at] = recordings.parameters().reference()[nu->at];
  return begin;
}

ModulusField FieldChoice::field_of(const Body& body, int count) const {
  return modulus_field(body, recordings_.front().capture.scene, {count, options_.control_weights}).field;
}

double FieldChoice::wide_band_limit() const {
  const StageRecord& narrow = last_on_surface(*choice_.state);
  const int number = narrow.id.number - (narrow.id.kind == StageKind::Corrected ? 1 : 0);
  const StageRecord* wide = find_record(choice_.state->done, {StageKind::Fine, narrow.id.start, number - 1});
  const double off_scan = narrow.cost - estimate_of(*choice_.state)->cost;  // the fall there
  return wide ? (1.0 - share_on_the_way * least_gain(best().control_points)) * (wide->cost - off_scan)
              : std::numeric_limits<double>::infinity();
}

void FieldChoice::judge(const FitOutcome& outcome, PassState reached) {
  TriedField tried{count_, true, outcome.final_cost, impossible};
  const bool is_given_up = !outcome.evaluation.succeeded && std::isfinite(outcome.final_cost);
  if (count_ > 1 && outcome.evaluation.succeeded) {
    const Body& body = *outcome.recordings.front().discretisation.body;
    const VectorX p = outcome.parameters.to_unconstrained(outcome.theta);
    tried.log_bayes_factor = log_bayes_factor(outcome.evaluation, outcome.parameters, p,
                                              carried_over(body, field_of(body, best().control_points), body.modulus));
  }
  if (count_ == 1) tried.log_bayes_factor = 0.0;
  if (is_given_up) tried = promised_;
  if (count_ == 1 || is_worth_it(tried, best())) {
    choice_.best = int(choice_.tried.size());
    choice_.state = std::move(reached);
    if (count_ == 1) choice_.even = choice_.state;
  }
  choice_.tried.push_back(tried);
  choice_.under_way = 0;
}

double FieldChoice::whole_evidence(const FitOutcome& outcome) const {
  const Body& body = *outcome.recordings.front().discretisation.body;
  return log_bayes_factor(outcome.uncertainty, outcome.parameters, outcome.parameters.to_unconstrained(outcome.theta),
                          carried_over(body, field_of(body, 1), body.modulus));
}

void FieldChoice::refuse_fields(double whole_evidence) {
  for (TriedField& t : choice_.tried)
    if (t.estimated && t.log_bayes_factor > judgement.strong_evidence)
      t.log_bayes_factor = std::min(t.log_bayes_factor, whole_evidence), t.is_refused = true;
  choice_.best = choice_.under_way = 0;
  choice_.state = choice_.even;
  is_last_ = false;
}

Pass FieldChoice::pass_of(int count, const PassState& from, int refine, double done_from, double done_to) const {
  Pass pass;
  pass.recordings = recordings_;
  pass.options = with_controls(options_, count);
  pass.options.refine = refine;
  pass.options.alternatives = options_.alternatives && is_last_;
  if (count > 1 && !is_last_) pass.limits.wide_band_cost = wide_band_limit();
  pass.limits.looks_at_scan_errors = options_.alternatives && count == 1;
  pass.begin = from;
  if (count > 1) pass.stage = points(count);
  pass.done_from = done_from, pass.done_to = done_to;
  return pass;
}

FitOutcome FieldChoice::with_history(FitOutcome outcome) {
  outcome.forward_steps = forward_steps_;
  outcome.fields = choice_.tried;
  outcome.history.clear();
  const Body& body = *outcome.recordings.front().discretisation.body;
  const JointLayout layout = layout_of(body.modulus.controls);
  for (auto& [count, events] : histories_) {
    const JointLayout own = layout_of(count);
    const MatrixX moduli = carried_over(body, field_of(body, count), body.modulus);
    for (FitEvent& event : events) {
      event.theta = changed(own, event.theta, layout, moduli);
      outcome.history.push_back(std::move(event));
    }
  }
  outcome.notes.insert(outcome.notes.begin(), explained(choice_.tried));
  return outcome;
}

bool is_worth_a_fit(const TriedField& promised, const TriedField& best) {
  // From moduli that vary one step tells less than there is: Poisson's ratio stands where it makes up for what they
  // lack.
  const double least_evidence = best.control_points == 1 ? judgement.strong_evidence : 0.0;
  return promised.log_bayes_factor > least_evidence &&
         promised.cost < (1.0 - share_on_the_way * least_gain(best.control_points)) * best.cost;
}

std::string explained(const std::vector<TriedField>& tried) {
  std::string evidence;
  TriedField best = tried.front();
  for (std::size_t i = 1; i < tried.size(); ++i) {
    const TriedField& t = tried[i];
    const bool is_possible = std::isfinite(t.log_bayes_factor);
    evidence += std::string(i == 1 ? "" : ",") + " of " + points(t.control_points) + " over " +
                std::to_string(best.control_points) + ": " +
                (is_possible ? text_of(t.log_bayes_factor, "%+.1f") : "cannot be simulated");
    if (is_possible && !t.estimated) evidence += " (promised by one step)";
    if (t.is_refused)
      evidence += " (with what other models and parts of the motion leave open of it, where " +
                  text_of(judgement.evidence_of_parts, "%.0f") + " is needed)";
    if (is_worth_it(t, best)) best = t;
  }
  return "Young's modulus was given " + points(best.control_points) +
         ", as many as the recordings support. Logarithm of the evidence" + evidence + ". More points need more than " +
         text_of(judgement.strong_evidence, "%.0f") + ", and " +
         text_of(100.0 * least_gain(best.control_points), "%.0f") + " % off the cost.";
}

MatrixX carried_over(const Body& body, const ModulusField& from, const ModulusField& to) {
  const Eigen::Map<const VectorX> volume(body.element_volume.data(), Eigen::Index(body.element_volume.size()));
  const VectorX root = volume.cwiseSqrt();
  const auto weighted = [&](const ModulusField& field) -> MatrixX {
    if (field.controls == 1) return root;
    return root.asDiagonal() * field.weights;
  };
  return weighted(to).colPivHouseholderQr().solve(weighted(from));
}

}  // namespace pliant
