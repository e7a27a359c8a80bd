#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/corrections.hpp"
#include "estimation/fit_run.hpp"
#include "estimation/given_quantities.hpp"
#include "estimation/judgement.hpp"
#include "estimation/scan_errors.hpp"

// What other models than a fit's own say of its estimate: systematic errors, the scan's errors, other meshes, steps and
// laws, and what the capture gives.

namespace pliant {

namespace {

// Enough to tell how far another model's estimate lies: of a time step, which changes little, and on coarser meshes,
// where they cost little.
constexpr int few_iterations = 2, many_iterations = 12;
constexpr int uneven_objects = 3;
constexpr double width_of_scan_errors =
    0.5;  // of a coefficient: differences by it are those of the least changes that show

}  // namespace

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
  CostEvaluation coarse;
  if (stage.id.number == 0) {
    try {
      coarse = objective_of(stage, parameters, grid(coarse_spacing(), stage.change), true).evaluate(p);
    } catch (const InputError&) {  // so coarse a mesh cannot be so far from the scan
    }
    if (coarse.succeeded) spacing = coarse_spacing();
  }
  const CostEvaluation& about = coarse.succeeded ? coarse : e;
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
  record.work += coarse.work;
  for (const CostEvaluation& m : moved) record.work += m.work;
  const ScanErrorStep step = scan_error_step(e, about, moved, width_of_scan_errors, coefficients);
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
  outcome_.forward_steps += e.steps + coarse.steps;
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
