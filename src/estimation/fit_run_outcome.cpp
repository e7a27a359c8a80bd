#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>

#include "base/error.hpp"
#include "estimation/corrections.hpp"
#include "estimation/fit_run.hpp"
#include "estimation/notes.hpp"
#include "estimation/verdict.hpp"

// What a fit of motions comes to: its estimate, what it leaves open, and what is said of it.

namespace pliant {

namespace {

/// Of one simulation of all recordings, about.
double work_of_a_look(const Grid& grid) {
  double work = 0.0;
  for (const Discretisation& d : grid.recording) {
    const SimulationOptions& s = d.simulation;
    const double steps = s.is_static ? steps_of_an_equilibrium : (s.times.back() - s.times.front()) / s.max_dt;
    work += steps * d.body->node_count();
  }
  return work;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

FitOutcome FitRun::run() {
  execute();
  stages_are_over_ = true;
  PassState end = reached();
  has_looked_last_ = interrupted_ && !plan_.estimate(end.done);
  if (has_looked_last_) end.done.push_back(last_look(end));
  finish(end.done);
  return std::move(outcome_);
}

StageRecord FitRun::last_look(const PassState& at) {
  const Stage stage = plan_.last_look(at);
  VectorX theta = stage.from.front();
  const std::vector<StageChain> next = plan_.next(state_);
  const std::optional<StageUnderWay>& left = state_.under_way;
  if (left && left->optimiser.p.size() > 0 && !next.empty() && next.front().front().id == left->id)
    theta = parameters_of(next.front().front(), left->from).to_theta(left->optimiser.p);
  StageRecord record{stage.id, stage.name, theta, theta};
  record.reason = "interrupted";
  record.scan_errors = stage.change.scan_errors;
  constexpr double at_most = 0.25;                                         // minutes: who interrupts does not wait
  const bool has_begun = left || find_record(at.done, {StageKind::Fine});  // many simulations came before
  if (!has_begun && work_of_a_look(grid(stage)) > at_most * work_of_a_minute) {
    record.cost = infinite;
    record.reason = fmt::format(
        "interrupted before the first estimate on the full mesh, where one simulation takes long; Young's modulus was "
        "{} Pa so far, and --resume goes on from there",
        in_three_digits(theta[plan_.facts().moduli.front()]));
    CostEvaluation none;
    none.failure = record.reason;
    record.evaluation = std::make_shared<const CostEvaluation>(std::move(none));
    return record;
  }
  const ParameterSet parameters = parameters_of(stage, theta);
  CostEvaluation e = objective_of(stage, parameters, grid(stage)).evaluate(parameters.to_unconstrained(theta));
  record.succeeded = e.succeeded;
  record.cost = e.succeeded ? e.cost : infinite;
  record.elements = grid(stage).recording.front().body->element_count();
  record.evaluation = std::make_shared<const CostEvaluation>(std::move(e));
  return record;
}

void FitRun::finish(const std::vector<StageRecord>& done) {
  // Starts run side by side; their history is told in an order that does not depend on who was faster.
  std::ranges::stable_sort(outcome_.history, {},
                           [](const FitEvent& e) { return std::tuple(e.kind, e.start, e.iteration); });
  const StageRecord* first = plan_.estimate(done);
  if (first) say_corrections(done);
  for (const StageRecord& r : done)
    if (r.id.kind == StageKind::Resolution && !r.told.empty()) outcome_.notes.push_back(r.told);
  const auto failed =
      std::ranges::find_if(done, [](const StageRecord& r) { return is_on_full_grid(r.id.kind) && !r.succeeded; });
  const StageRecord& last = first ? refined(done, *first) : *failed;
  const ModelChange surface{.scan_errors = last.scan_errors};
  const Grid& at = grid(plan_.spacing_of(last), surface);
  ParameterSet parameters = plan_.estimated(done);
  parameters.set_reference(last.theta);
  outcome_.starts = plan_.starts(done);
  outcome_.start_theta = plan_.start_theta(done);
  outcome_.cells = at.cells;
  outcome_.used = used_options(at);
  outcome_.interrupted = interrupted_;
  outcome_.converged = last.converged && !interrupted_;
  outcome_.reason = interrupted_ && last.succeeded ? "interrupted" : last.reason;
  outcome_.theta = last.theta;
  outcome_.parameters = recordings_.with_field_prior(parameters, at);
  outcome_.final_cost = last.cost;
  Stage narrow{last.id, last.name, plan_.spacing_of(last)};
  narrow.band = options_.fine_band, narrow.change = surface;
  if (last.succeeded || !interrupted_)
    outcome_.start_cost =
        objective_of(narrow, parameters_of(narrow, outcome_.start_theta), at).evaluate(VectorX(0)).cost;
  outcome_.evaluation = evaluation_of(last, narrow, parameters);
  for (std::size_t r = 0; r < recordings_.all().size(); ++r) {
    const Discretisation& d = at.recording[r];
    outcome_.recordings.push_back({d, outcome_.theta, outcome_.evaluation.of_recording(int(r)),
                                   Simulation(d.body, d.simulation).rest_body(outcome_.theta)});
  }
  const bool has_derivatives = outcome_.evaluation.gauss_newton.rows() == parameters.dimension();
  if (outcome_.evaluation.succeeded && has_derivatives && parameters.dimension() > 0)
    add_uncertainty(outcome_, shifts_in(done, gauss_newton_shift(outcome_.evaluation, largest_shift)),
                    floor(outcome_.parameters, outcome_.theta));
  if (first) say_scan_errors(done, *first);
  say_untried(done);
  if (outcome_.evaluation.succeeded && !interrupted_) time_steps(narrow, parameters);
  if (const StageRecord* swing = find_record(done, {StageKind::Swing}); swing && !swing->told.empty())
    outcome_.notes.push_back(swing->told);
  std::vector<const Capture*> captures;
  for (const Recording& r : recordings_.all()) captures.push_back(&r.capture);
  add_notes(outcome_, captures);
  if (outcome_.evaluation.succeeded && !interrupted_) say_doubts_of_time(narrow, parameters);
}

void FitRun::say_doubts_of_time(const Stage& narrow, const ParameterSet& parameters) {
  constexpr int most_repeated = 2, most_missing = 4;  // frames
  const bool is_whole = std::ranges::all_of(recordings_.all(), [](const Recording& r) {
    return r.capture.scene.timing.is_static || r.last_frame >= r.last_seen;
  });
  if (plan_.facts().limits.ends_if_unexplained || recordings_.all_static() ||
      (is_whole && is_explained(outcome_.evaluation)))
    return;
  const auto shifted = [&](int later) {
    Compared compared{options_.wide_band, [](const Recording& r) { return r.last_seen; }};
    compared.later = later;
    return recordings_.objective(grid(narrow), parameters, compared, {}, monitor_.processes)
        .evaluate(parameters.to_unconstrained(parameters.reference()));
  };
  const CostEvaluation stated = shifted(0);
  if (!stated.succeeded || !may_need_correction(stated.cost, stated.independent_observations())) return;
  std::vector<ShiftedInTime> others;
  for (int later = -most_repeated; later <= most_missing; ++later)
    if (later != 0) others.push_back({later, shifted(later)});
  const auto doubt = doubt_of_time(stated, others);
  if (!doubt) return;
  const Capture& capture = recordings_.all()[std::size_t(doubt->recording)].capture;
  const bool misses = doubt->later > 0;
  const int many = std::abs(doubt->later);
  outcome_.notes.push_back(fmt::format(
      "{}: frame {} and those after it fit what was simulated {} frame{} {} ({:.0f} % of what noise does not explain). "
      "Frames seem to be {} there, which the times of the recording do not tell.",
      capture.name, capture.scene.timing.start_frame + doubt->frame, many, many == 1 ? "" : "s",
      misses ? "later" : "earlier", 100.0 * doubt->share, misses ? "missing" : "repeated"));
}

FitOptions FitRun::used_options(const Grid& at) const {
  FitOptions used = options_;
  used.cells = at.cells, used.steps = at.steps;
  used.element = recordings_.resolution(at.cells, at.steps).element;
  used.control_points = recordings_.controls();
  if (used.span == 0.0) used.span = 1.0;
  if (used.material == MaterialKind::Automatic) used.material = MaterialKind::NeoHookean;
  if (const auto law = used.law_of_motion()) used.law_terms = law->terms;
  return used;
}

/// With derivatives, but for a last look; that of the optimiser where it ran here.
CostEvaluation FitRun::evaluation_of(const StageRecord& record, const Stage& narrow, const ParameterSet& parameters) {
  const bool is_without = record.evaluation && (!record.succeeded || has_looked_last_);
  return is_without ? *record.evaluation : linearised_at(record, narrow, parameters);
}

CostEvaluation FitRun::linearised_at(const StageRecord& estimate, const Stage& stage, const ParameterSet& parameters) {
  if (estimate.evaluation && estimate.evaluation->gauss_newton.rows() == parameters.dimension())
    return *estimate.evaluation;
  return objective_of(stage, parameters, grid(stage)).linearise(parameters.to_unconstrained(estimate.theta));
}

void FitRun::say_corrections(const std::vector<StageRecord>& done) {
  const StageRecord* test = find_record(done, {StageKind::Test});
  const auto corrected = std::ranges::find(done, StageKind::Corrected, [](const StageRecord& r) { return r.id.kind; });
  if (!test || test->corrected.empty() || corrected == done.end()) return;
  outcome_.notes.push_back(
      "The residuals showed that " + test->told +
      " needed correction, which was estimated along with the "
      "material: the cost fell from " +
      in_three_digits(test->cost) + " to " + in_three_digits(corrected->cost) + ". Without it Young's modulus was " +
      in_three_digits(test->theta[plan_.facts().moduli.front()]) + " Pa; correct = false leaves it so.");
}

void FitRun::say_scan_errors(const std::vector<StageRecord>& done, const StageRecord& estimate) {
  if (estimate.scan_errors.empty()) return;
  const TriangleMesh &scan = *recordings_.front().capture.scene.object.surface,
                     &surface = outcome_.recordings.front().discretisation.surface.value();
  double mean = 0.0, squares = 0.0;
  const std::vector<Vector3> normals = vertex_normals(scan);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const double out = normals[v].dot(surface.vertices[v] - scan.vertices[v]);
    mean += out / double(normals.size()), squares += out * out / double(normals.size());
  }
  outcome_.notes.push_back(fmt::format(
      "The scan seems to err: the object's surface was found {:.2g} mm {} it in the mean and {:.2g} mm from "
      "it in the root mean square. alternatives = false leaves it where it was scanned, and surface_noise "
      "of [object] says how well the scan is known.",
      1e3 * std::abs(mean), mean > 0.0 ? "outside of" : "inside of", 1e3 * std::sqrt(squares)));
  const StageRecord* look = find_record(done, {StageKind::ScanErrors, estimate.id.start, 0});
  if (!look || (state_.begin && !state_.begin->scan_errors.empty())) return;
  outcome_.notes.push_back(
      fmt::format("On the scan as it is Young's modulus was {} Pa and the cost {}; off the scan the cost is {}.",
                  in_three_digits(look->from[plan_.facts().moduli.front()]), in_three_digits(look->cost),
                  in_three_digits(estimate.cost)));
}

/// Of the alternatives that could be tried, less that of the model that each stands beside: the fit's own, whose
/// gradient is not quite zero, or the first of them.
std::vector<ModelShift> FitRun::shifts_in(const std::vector<StageRecord>& done, const VectorX& own) const {
  std::vector<ModelShift> shifts;
  std::vector<StageRecord> tried;  // side by side: told in an order that does not depend on who was faster
  std::ranges::copy_if(done, std::back_inserter(tried),
                       [](const StageRecord& r) { return r.id.kind == StageKind::Alternative; });
  std::ranges::sort(tried, {}, [](const StageRecord& r) { return r.id.number; });
  const auto first = std::ranges::find(tried, 0, [](const StageRecord& r) { return r.id.number; });
  const ParameterSet estimated = plan_.estimated(done);
  const std::vector<const Parameter*> coordinates = estimated.coordinate_parameters();
  for (const StageRecord& r : tried) {
    const Alternative& a = plan_.facts().alternatives[std::size_t(r.id.number)];
    const bool has_first = first != tried.end() && !first->shifts.empty();
    if (a.beside_the_first && !has_first) continue;
    const VectorX& reference = a.beside_the_first ? first->shifts.front().shift : own;
    for (const ModelShift& s : r.shifts) {
      if (s.shift.size() != own.size() || reference.size() != own.size()) continue;
      if (s.cause == cause_mesh && plan_.facts().repeats_by_need && !plan_.repetitions(done).empty()) {
        shifts.push_back({s.cause, *mesh_shift(done, own)});
        continue;
      }
      VectorX shift = a.given ? s.shift : VectorX(a.size * (s.shift - reference));
      shift *= share_within(shift, coordinates, a.most);
      shifts.push_back({s.cause, std::move(shift)});
    }
  }
  const StageRecord* scan = nullptr;  // the last look
  for (const StageRecord& r : done)
    if (r.id.kind == StageKind::ScanErrors) scan = &r;
  if (scan)
    std::ranges::copy_if(scan->shifts, std::back_inserter(shifts),
                         [&](const ModelShift& s) { return s.shift.size() == own.size(); });
  return shifts;
}

void FitRun::say_untried(const std::vector<StageRecord>& done) {
  std::vector<std::string> untried;
  for (const StageRecord& r : done)
    if (r.id.kind == StageKind::Alternative && !r.reason.empty()) untried.push_back(note_of_untried(r.name, r.reason));
  std::ranges::sort(untried);  // side by side: told in an order that does not depend on who was faster
  outcome_.notes.insert(outcome_.notes.end(), untried.begin(), untried.end());
}

VectorX FitRun::floor(const ParameterSet& parameters, const VectorX& theta) const {
  const bool meets = std::ranges::any_of(recordings_.all(), [](const Recording& r) {
    return r.capture.scene.is_touched() && !r.capture.scene.timing.is_static;
  });
  return options_.alternatives
             ? unmodelled_std(parameters, theta, meets ? MeasuredAs::MeetingObstacles : MeasuredAs::Free)
             : VectorX();
}

/// The estimate on the finest mesh; that at all resolutions goes into the outcome.
const StageRecord& FitRun::refined(const std::vector<StageRecord>& done, const StageRecord& first) {
  std::vector<const StageRecord*> all = {&first};
  for (const StageRecord& r : done) {
    if (r.id.kind != StageKind::Finer) continue;
    if (r.succeeded)
      all.push_back(&r);
    else
      outcome_.notes.push_back("The estimate could not be repeated at " + r.name + ": " + r.reason + ".");
  }
  if (all.size() == 1 && (options_.refine <= 1 || interrupted_)) return first;
  std::vector<RefinedEstimate> estimates;
  for (const StageRecord* r : all) {
    const Spacing spacing = plan_.spacing_of(*r);
    estimates.push_back({spacing.cells, spacing.steps, r->elements, r->theta, r->cost, r->converged, r->reason});
  }
  outcome_.refinement = extrapolate(std::move(estimates), plan_.estimated(done));
  return *all[std::size_t(outcome_.refinement.finest)];
}

void FitRun::time_steps(const Stage& narrow, const ParameterSet& parameters) {
  Objective objective = recordings_.objective(
      grid(narrow), parameters, {narrow.band, [](const Recording&) { return 20; }}, {}, monitor_.processes);
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

}  // namespace pliant
