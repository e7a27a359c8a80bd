#include "output/fit_output.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include "base/error.hpp"
#include "base/files.hpp"
#include "elasticity/element_moduli.hpp"
#include "elasticity/law_elasticity.hpp"
#include "elasticity/law_layout.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/judgement.hpp"
#include "estimation/load_free.hpp"
#include "live/live_page.hpp"
#include "output/prediction.hpp"
#include "output/press_output.hpp"
#include "output/track_output.hpp"
#include "pictures/field_pictures.hpp"
#include "report/gallery.hpp"
#include "report/plot.hpp"
#include "report/report.hpp"
#include "simulation/law_table.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/strain_range.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

ParameterValue value_of(const Parameter& p, const VectorX& theta) {
  if (p.transform == Transform::PlanePosition)
    return PlaneValue{theta.segment<3>(p.at), theta.segment<3>(p.at.first + 3)};
  if (!p.is_scalar()) return Vector3(theta.segment<3>(p.at));
  return theta[p.at];
}

/// Standard deviation of a value from that of its unconstrained numbers, by the transform's derivative.
ParameterValue std_of(const Parameter& p, const VectorX& std, const MatrixX& jacobian, int at) {
  if (p.is_scalar()) return std::abs(jacobian(p.at.first, at)) * std[at];
  const MatrixX spread = jacobian.middleCols(at, p.dimension()) * std.segment(at, p.dimension()).asDiagonal();
  const auto row_norm = [&](Eigen::Index row) {
    return Vector3(spread.row(row).norm(), spread.row(row + 1).norm(), spread.row(row + 2).norm());
  };
  if (p.transform != Transform::PlanePosition) return row_norm(p.at);
  return PlaneValue{row_norm(p.at), row_norm(p.at.first + 3)};
}

std::map<std::string, double> scalars_of(const ParameterSet& parameters, const VectorX& theta) {
  std::map<std::string, double> values;
  for (const Parameter& p : parameters.parameters()) {
    if (p.is_scalar()) {
      values[p.name] = theta[p.at];
    } else {
      for (int d = 0; d < 3; ++d) values[p.name + "." + "xyz"[d]] = theta[p.at.first + d];
      if (p.transform == Transform::PlanePosition)
        for (int d = 0; d < 3; ++d) values[p.name + ".normal." + "xyz"[d]] = theta[p.at.first + 3 + d];
    }
  }
  return values;
}

/// Of what was estimated.
std::map<std::string, double> estimates_of(const ParameterSet& parameters, const VectorX& theta) {
  std::map<std::string, double> values = scalars_of(parameters, theta);
  for (const Parameter& p : parameters.parameters())
    if (!p.estimated)
      std::erase_if(values, [&](const auto& v) { return v.first.substr(0, v.first.find('.')) == p.name; });
  return values;
}

void add_resolutions(Result& result, const FitOutcome& outcome) {
  for (const RefinedEstimate& e : outcome.refinement.estimates) {
    ResolutionResult r{e.cells, e.steps,     e.elements, estimates_of(outcome.parameters, e.theta),
                       {},      e.converged, e.reason};
    if (std::isfinite(e.cost)) r.cost = e.cost;
    result.resolutions.push_back(std::move(r));
  }
}

void add_correlations(Result& result, const FitOutcome& outcome) {
  if (outcome.correlation.size() == 0) return;
  const auto names = outcome.parameters.coordinate_names();
  for (std::size_t i = 0; i < names.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      result.identifiability.push_back({{names[j], names[i]}, outcome.correlation(Eigen::Index(i), Eigen::Index(j))});
  std::stable_sort(result.identifiability.begin(), result.identifiability.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.correlation) > std::abs(b.correlation); });
}

/// Forms of a law have numbers of their own each: what they have in common, and how far markers under presses lie off.
ConvergenceHistory law_history(const FitOutcome& outcome) {
  const bool has_markers = std::ranges::any_of(outcome.history, [](const FitEvent& e) { return e.marker_rms > 0.0; });
  ConvergenceHistory history{{"youngs_modulus"}, {"Pa"}, {}};
  if (has_markers) history.parameters.emplace_back("marker_rms"), history.units.emplace_back("m");
  for (const FitEvent& e : outcome.history) {
    history.rows.push_back({e.start, e.iteration, e.stage, e.cost, e.damping, {e.youngs_modulus}});
    if (has_markers) history.rows.back().parameters.push_back(e.marker_rms);
  }
  return history;
}

/// @param with_trials  whether the trials of a scan are among the rows: they are no iterations
ConvergenceHistory history_of(const FitOutcome& outcome, bool with_trials) {
  if (outcome.law) return law_history(outcome);
  ConvergenceHistory history;
  std::vector<const Parameter*> shown;
  for (const Parameter& p : outcome.parameters.parameters())
    if (p.is_scalar() && (p.estimated || p.name == "youngs_modulus")) shown.push_back(&p);
  for (const Parameter* p : shown) history.parameters.push_back(p->name), history.units.push_back(p->unit);
  // Starts, and the values of a scan, are worked on side by side: their order must not depend on the threads.
  std::vector<FitEvent> events = outcome.history;
  std::ranges::stable_sort(events, {}, [](const FitEvent& e) {
    const int stage = std::min(int(e.kind), int(StageKind::Coarse));
    return std::tuple(e.start, stage, e.kind == StageKind::Scan ? e.iteration : 0);
  });
  for (const FitEvent& e : events) {
    if (e.kind == StageKind::Scan && !with_trials) continue;
    ConvergenceRow row{e.start, e.iteration, e.stage, e.cost, e.damping, {}};
    for (const Parameter* p : shown) row.parameters.push_back(e.theta[p->at]);
    history.rows.push_back(std::move(row));
  }
  return history;
}

/// What was observed in a frame, and how far it lies from the simulated surface; points outside the band are left out.
void add_observations(GalleryFrame& frame, const std::vector<Vector3>& seen, const Discretisation& d,
                      const Points& nodes) {
  std::vector<SurfaceObservation> points;
  for (const Vector3& p : seen) points.push_back({p, 1.0});
  if (!d.mismatch.surface) return;
  const auto matches = d.mismatch.surface->match(points, nodes);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (matches[i].cell < 0) continue;
    frame.points.push_back(points[i].position);
    frame.residuals.push_back(matches[i].distance / matches[i].stretch);
  }
}

/// Where an outline's rays pass the simulated contour, and how far they pass it.
void add_outline(GalleryFrame& frame, const OutlineObservation& seen, const Discretisation& d, const VectorX& theta,
                 const Points& nodes) {
  const SensorBlocks& blocks = d.mismatch.sensors[std::size_t(seen.sensor)];
  const OutlineObservation there = corrected(seen, SensorCorrection(d.mismatch.centre, blocks.values(theta)));
  for (const OutlineMatch& match : d.mismatch.outlines->match(there, nodes)) {
    if (!match.is_found) continue;
    frame.points.push_back(there.camera.camera_to_world(match.seen));
    frame.residuals.push_back(match.distance);
  }
}

/// A frame's points where the estimate has them.
std::vector<Vector3> corrected_points(const ObservedFrame& seen, const Capture& capture, const Discretisation& d,
                                      const VectorX& theta) {
  std::vector<Vector3> points = seen.points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int sensor = seen.camera[i] < 0 ? int(capture.depth.size()) : seen.camera[i];
    const SensorCorrection correction(d.mismatch.centre, d.mismatch.sensors[std::size_t(sensor)].values(theta));
    points[i] = correction.apply(points[i], sight_of(capture, seen, i));
  }
  return points;
}

/// A few of the fitted frames that tell the story, simulated with the estimate and drawn over what was observed.
Gallery gallery_of(const RecordedCapture& recorded_capture, const RecordingOutcome& outcome) {
  const Capture& capture = recorded_capture.capture;
  const Discretisation& d = outcome.discretisation;
  Gallery gallery;
  gallery.triangles = capture.scene.object.surface->triangles;
  gallery.planes = planes_at(capture, d.simulation.blocks, outcome.theta);
  if (!capture.depth.empty())
    gallery.camera = capture.depth.front().camera;
  else if (!capture.silhouettes.empty())
    gallery.camera = capture.silhouettes.front().camera;
  gallery.up = capture.scene.world.up;
  gallery.width = 480, gallery.height = 400;
  const auto& fitted = outcome.evaluation.frames;
  std::vector<int> told;
  for (const int i : spread_frames(0, int(fitted.size()) - 1, 6)) told.push_back(fitted[std::size_t(i)].frame);
  if (told.empty()) return gallery;
  const Embedding embedding(*d.body, surface_of(capture, d).vertices);
  const double start = capture.scene.timing.times[std::size_t(capture.scene.timing.start_frame)];
  Simulation simulation(d.body, d.simulation);
  simulation.run(outcome.theta, [&](int frame, const State& state, auto) {
    if (!std::ranges::binary_search(told, frame)) return true;
    const int recorded = frame + capture.scene.timing.start_frame;
    GalleryFrame drawn{
        recorded, capture.scene.timing.times[std::size_t(recorded)] - start, embedding.positions(state.x), {}, {}};
    const auto seen = std::ranges::find(recorded_capture.observed, recorded, &ObservedFrame::frame);
    if (seen != recorded_capture.observed.end()) {
      add_observations(drawn, corrected_points(*seen, capture, d, outcome.theta), d, state.x);
      for (const ObservedOutline& outline : seen->outlines)
        add_outline(drawn, outline_observation(capture, outline, recorded), d, outcome.theta, state.x);
    }
    gallery.frames.push_back(std::move(drawn));
    return frame < told.back();
  });
  return gallery;
}

void add_pictures(ReportData& report, const Gallery& gallery) {
  if (gallery.frames.empty()) return;
  report.residual_range = residual_range(all_residuals(gallery));
  report.pictures = draw_gallery(gallery, report.residual_range);
}

/// A stage's name for people; what stands before a colon is kept.
std::string spoken_stage(const std::string& stage) {
  static const std::map<std::string, std::string> names = {{"motion", "motion at the start"},
                                                           {"coarse", "coarse grid"},
                                                           {"fine, wide band", "fine grid, wide outlier scale"},
                                                           {"fine", "fine grid"}};
  const auto colon = stage.rfind(": ");
  const std::size_t own = colon == std::string::npos ? 0 : colon + 2;
  const auto it = names.find(stage.substr(own));
  return it == names.end() ? stage : stage.substr(0, own) + it->second;
}

/// The convergence that the page draws.
ConvergenceHistory drawn_history(const FitOutcome& outcome) {
  ConvergenceHistory history = history_of(outcome, false);
  for (ConvergenceRow& row : history.rows) row.stage = spoken_stage(row.stage);
  return history;
}

/// Of what follows from several coordinates: half of a 90 % interval over the deviation, the greatest of them.
double largest_quantile(const Uncertainty& u) {
  double most = 1.6449;
  for (Eigen::Index i = 0; i < u.std.size(); ++i)
    if (u.std[i] > 0.0) most = std::max(most, u.high[i] / u.std[i]);
  return most;
}

/// The field over the object, and its mean where the control points' parameters leave that out.
void add_modulus_field(Result& result, const FitOutcome& outcome) {
  const RecordingOutcome& first = outcome.recordings.front();
  const int controls = first.discretisation.body->modulus.controls;
  if (controls == 1 && outcome.fields.empty()) return;
  FieldResult field{"youngs_modulus", {}, "model.vtu"};
  for (const TriedField& t : outcome.fields) {
    TriedFieldResult tried{t.control_points, t.estimated, {}, {}};
    if (std::isfinite(t.cost)) tried.cost = t.cost;
    if (std::isfinite(t.log_bayes_factor)) tried.log_bayes_factor = t.log_bayes_factor;
    field.tried.push_back(tried);
  }
  const MatrixX covariance = log_modulus_covariance(outcome);
  const std::vector<Vector3>& points = first.discretisation.control_points;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double value = first.theta[first.discretisation.simulation.blocks.youngs_moduli[k]];
    ControlPoint point{points[k], value, {}};
    if (covariance.size() > 0) point.std = value * std::sqrt(covariance(Eigen::Index(k), Eigen::Index(k)));
    field.control_points.push_back(point);
  }
  result.fields.push_back(std::move(field));
  if (result.find("youngs_modulus")) return;
  const ModulusStatistics statistics = modulus_statistics(outcome);
  ParameterResult mean{"youngs_modulus", statistics.mean, "Pa", {}, {}, true};
  if (covariance.size() > 0) {
    mean.std = statistics.mean_std;
    const double factor = std::exp(largest_quantile(outcome.uncertainty) * statistics.mean_std / statistics.mean);
    mean.interval_90 = std::pair(statistics.mean / factor, statistics.mean * factor);
  }
  result.parameters.insert(result.parameters.begin(), std::move(mean));
}

/// Poisson's ratio at small strain, the mean over the object, where terms or zones of a law have their own.
void add_mean_ratio(Result& result, const FitOutcome& outcome) {
  if (!outcome.law || outcome.law->sampled || result.find("poissons_ratio")) return;
  const Body& body = *outcome.law->scene->body;
  const auto mean_at = [&](const VectorX& theta) {
    const auto law = law_at(body, outcome.law->layout, theta);
    double sum = 0.0;
    for (int e = 0; e < body.element_count(); ++e)
      sum += body.element_volume[std::size_t(e)] / body.volume() * law->small_strain(e).poissons_ratio;
    return sum;
  };
  ParameterResult mean{"poissons_ratio", mean_at(outcome.theta), "1", {}, {}, true};
  if (outcome.covariance.size() > 0) {
    const VectorX here = outcome.parameters.to_unconstrained(outcome.theta);
    VectorX by(here.size());
    for (Eigen::Index i = 0; i < here.size(); ++i) {
      constexpr double step = 1e-4;
      const VectorX to = step * VectorX::Unit(here.size(), i);
      by[i] = (mean_at(outcome.parameters.to_theta(here + to)) - mean_at(outcome.parameters.to_theta(here - to))) /
              (2.0 * step);
    }
    const double std = std::sqrt(std::max(0.0, by.dot(outcome.covariance * by)));
    const double nu = std::get<double>(mean.value), logit = std::log(2.0 * nu / (1.0 - 2.0 * nu));
    const double half = largest_quantile(outcome.uncertainty) * std / std::max(1e-9, nu * (1.0 - 2.0 * nu));
    const auto at = [](double x) { return 0.5 / (1.0 + std::exp(-x)); };
    mean.std = std;
    mean.interval_90 = std::pair(at(logit - half), at(logit + half));
  }
  result.parameters.push_back(std::move(mean));
}

}  // namespace

ErrorResult surface_errors(const CostEvaluation& evaluation) {
  ErrorResult errors;
  double max = 0.0;
  const bool is_one = std::ranges::all_of(
      evaluation.frames, [&](const FrameFit& f) { return f.recording == evaluation.frames.front().recording; });
  for (const FrameFit& f : evaluation.frames) {
    errors.points += f.points + f.tracks;
    max = std::max(max, f.max_distance);
    if (!is_one || f.points == 0) continue;
    if (!errors.frames.empty() && errors.frames.back().frame == f.frame) {  // seen by sensors one after the other
      auto& same = errors.frames.back();
      const double all = same.points + f.points;
      same.rms = std::sqrt((same.points * same.rms * same.rms + f.sum_squares) / all);
      same.noise = std::sqrt((same.points * same.noise * same.noise + f.sum_noise_squares) / all);
      same.points += f.points;
    } else {
      errors.frames.push_back(
          {f.frame, std::sqrt(f.sum_squares / f.points), std::sqrt(f.sum_noise_squares / f.points), f.points});
    }
  }
  const bool has_surface = std::ranges::any_of(evaluation.frames, [](const FrameFit& f) { return f.points > 0; });
  const bool has_tracks = std::ranges::any_of(evaluation.frames, [](const FrameFit& f) { return f.tracks > 0; });
  const bool has_outlines = std::ranges::any_of(evaluation.frames, [](const FrameFit& f) { return f.outlines > 0; });
  if (has_surface) {
    errors.surface_rms = evaluation.surface_rms();
    errors.surface_median = evaluation.surface_median();
    errors.surface_max = max;
  }
  if (has_outlines) errors.outline_rms = evaluation.outline_rms();
  if (has_tracks) errors.marker_rms = evaluation.track_rms();
  return errors;
}

namespace {

TrackingResult tracking_result(const TrackingOutcome& outcome, const MaterialBlocks& material) {
  TrackingResult result{outcome.keeps_loop ? "tracked motion" : "points", outcome.why, {}, {}, {}};
  for (const TrackingRound& r : outcome.rounds)
    result.rounds.push_back(
        {r.youngs_modulus, r.theta[material.youngs_moduli.front()], r.surface_rms, r.fit_rms, r.confidence, r.lost});
  const auto held_out = [](const std::optional<HeldOutFrames>& h) -> std::optional<HeldOutFramesResult> {
    if (!h) return std::nullopt;
    HeldOutFramesResult r{h->frames, {}, {}};
    if (h->succeeded) r.cost = h->cost, r.surface_rms = h->surface_rms;
    return r;
  };
  result.loop = held_out(outcome.loop), result.direct = held_out(outcome.direct);
  return result;
}

}  // namespace

namespace {

/// Deviations of an estimated parameter whose unconstrained numbers begin at `at`, and of a scalar the interval.
void add_uncertainty_of(ParameterResult& r, const Parameter& p, const FitOutcome& outcome, const MatrixX& jacobian,
                        int at) {
  r.std = std_of(p, outcome.std, jacobian, at);
  const Uncertainty& u = outcome.uncertainty;
  if (u.std.size() != outcome.std.size()) return;
  r.std_noise = std_of(p, u.std_noise, jacobian, at);
  r.std_model = std_of(p, u.std_model, jacobian, at);
  if (!p.is_scalar()) return;
  const VectorX here = outcome.parameters.to_unconstrained(outcome.theta);
  VectorX low = here, high = here;
  low[at] += u.low[at], high[at] += u.high[at];
  const auto within_bounds = [&](const VectorX& end) {
    return outcome.parameters.to_theta(outcome.parameters.clamp(end))[p.at];
  };
  r.interval_90 = std::pair(within_bounds(low), within_bounds(high));
}

/// The prior of an estimated scalar or vector whose first unconstrained number is that at `at`; nothing where it has
/// none.
std::optional<PriorResult> prior_of(const Parameter& p, const FitOutcome& outcome, int at) {
  if (p.is_auxiliary || !std::isfinite(p.prior_std)) return std::nullopt;
  if (p.transform == Transform::Vector && p.prior_shape.size() == 0)
    return PriorResult{Vector3(p.scale * p.prior_mean), {}, Vector3::Constant(p.scale * p.prior_std)};
  if (!p.is_scalar()) return std::nullopt;
  constexpr double of_90_percent = 1.6449;
  const auto value = [&](double deviations) {
    VectorX there = outcome.parameters.to_unconstrained(outcome.theta);
    there[at] = p.prior_mean[0] + deviations * p.prior_std;
    return outcome.parameters.to_theta(outcome.parameters.clamp(there))[p.at];
  };
  return PriorResult{value(0.0), std::pair(value(-of_90_percent), value(of_90_percent))};
}

void add_verdict(Result& result, const FitOutcome& outcome, const MatrixX& jacobian) {
  if (outcome.uncertainty.std.size() == 0) return;
  result.verdict = name_of(outcome.verdict.kind);
  result.reasons = outcome.verdict.reasons;
  for (const UncertaintyShare& share : outcome.uncertainty.budget) {
    UncertaintyResult of_cause{share.cause, {}};
    int at = 0;
    for (const Parameter& p : outcome.parameters.parameters()) {
      if (!p.estimated) continue;
      if (p.is_scalar() && !p.is_auxiliary) of_cause.std[p.name] = std::get<double>(std_of(p, share.std, jacobian, at));
      at += p.dimension();
    }
    result.uncertainty.push_back(std::move(of_cause));
  }
}

}  // namespace

Result make_result(const std::vector<RecordedCapture>& recordings, const FitOutcome& outcome, const RunFacts& facts) {
  const Capture& capture = recordings.front().capture;
  Result result;
  result.software.version = facts.version;
  result.software.commit = facts.commit;
  result.capture = {capture.name, capture.sha256};
  const bool has_std = outcome.std.size() > 0;
  const Refinement& refinement = outcome.refinement;
  const bool repeated = refinement.estimates.size() > 1;
  const MatrixX jacobian =
      has_std || repeated ? outcome.parameters.jacobian(outcome.parameters.to_unconstrained(outcome.theta)) : MatrixX();
  int at = 0;
  for (const Parameter& p : outcome.parameters.parameters()) {
    ParameterResult r{p.name, value_of(p, outcome.theta), p.unit, {}, {}, p.estimated};
    if (p.estimated) {
      if (outcome.start_theta.size() > 0) r.start = value_of(p, outcome.start_theta);
      if (has_std) add_uncertainty_of(r, p, outcome, jacobian, at);
      r.prior = prior_of(p, outcome, at);
      if (refinement.mesh_error.size() > 0) r.mesh_error = std_of(p, refinement.mesh_error, jacobian, at);
      if (refinement.step_error.size() > 0) r.step_error = std_of(p, refinement.step_error, jacobian, at);
      if (repeated) r.extrapolated = value_of(p, outcome.parameters.to_theta(refinement.extrapolated));
      at += p.dimension();
    }
    result.parameters.push_back(std::move(r));
  }
  add_modulus_field(result, outcome);
  add_mean_ratio(result, outcome);
  add_verdict(result, outcome, jacobian);
  result.material = outcome.material;
  for (const Judged& number : all_judged()) result.judgement[number.name] = number;
  for (const auto& [name, text] : written_choices(outcome.given, false)) result.options_given[name] = text;
  for (const auto& [name, text] : written_choices(outcome.used, true)) result.options_used[name] = text;
  result.error = surface_errors(outcome.evaluation);
  for (std::size_t r = 0; r < recordings.size() && recordings.size() > 1; ++r)
    result.recordings.push_back(
        {recordings[r].capture.name, recordings[r].capture.sha256, surface_errors(outcome.recordings[r].evaluation)});
  result.cost = {outcome.start_cost, outcome.final_cost};
  add_correlations(result, outcome);
  for (const FitStart& s : outcome.starts) {
    StartResult r{scalars_of(outcome.parameters, s.start),
                  scalars_of(outcome.parameters, s.final),
                  {},
                  s.iterations,
                  s.converged,
                  s.reason};
    if (std::isfinite(s.cost)) r.cost = s.cost;
    result.starts.push_back(std::move(r));
  }
  add_resolutions(result, outcome);
  if (const auto& held_out = outcome.held_out) {
    result.held_out = {held_out->name, held_out->sha256, {}};
    if (held_out->evaluation.succeeded) result.held_out->error = surface_errors(held_out->evaluation);
  }
  result.time.wall_seconds = facts.wall_seconds;
  result.time.forward_steps = outcome.forward_steps;
  if (outcome.ms_per_forward_step > 0.0) result.time.ms_per_forward_step = outcome.ms_per_forward_step;
  if (outcome.ms_per_adjoint_step > 0.0) result.time.ms_per_adjoint_step = outcome.ms_per_adjoint_step;
  result.notes = outcome.notes;
  if (outcome.law) {
    result.curves = predict_curves(*outcome.law->scene, outcome.law->law);
    for (const TestedObject& other : outcome.law->others)
      std::ranges::move(predict_curves(*other.scene, other.law), std::back_inserter(result.curves));
  }
  if (outcome.tracking)
    result.tracking = tracking_result(*outcome.tracking, outcome.recordings.front().discretisation.simulation.blocks);
  return result;
}

namespace {

using Progress = std::function<void(const char*, int, int)>;

/// From where the fields of presses are seen.
Gallery gallery_of(const Capture& capture) {
  Gallery gallery;
  gallery.triangles = capture.scene.object.surface->triangles;
  gallery.up = capture.scene.world.up;
  gallery.width = 480, gallery.height = 400;
  return gallery;
}

void write_motion(const fs::path& folder, const std::vector<RecordedCapture>& recordings, const FitOutcome& outcome,
                  const std::vector<double>& modulus_std, ReportData& report, const Progress& tell) {
  const Capture& capture = recordings.front().capture;
  const RecordingOutcome& first = outcome.recordings.front();
  const auto elasticity = scene_elasticity(first.discretisation.body, first.discretisation.simulation);
  elasticity->set_parameters(first.theta);
  FieldPictures fields(first.discretisation.body, *elasticity, surface_of(capture, first.discretisation), modulus_std,
                       frames_at(first.discretisation.simulation.times, capture.scene.timing.start_frame));
  StrainRange strains(*first.discretisation.body);
  write_trajectory(
      folder, first.discretisation.body, first.discretisation.simulation, first.theta,
      [&](int done, int total) { return tell("trajectory", done, total), true; },
      [&](int frame, const State& state, const BodyFields& of) {
        fields.add(frame, state.x, of);
        strains.add(of, capture.scene.timing.is_static
                            ? std::nullopt
                            : std::optional(first.discretisation.simulation.times[std::size_t(frame)]));
      });
  report.result.deformation = strains.result();
  for (const auto& f : surface_errors(first.evaluation).frames) {
    const int frame = f.frame + capture.scene.timing.start_frame;
    report.residuals.push_back({frame, capture.scene.timing.times[std::size_t(frame)], f.rms, f.points, f.noise});
  }
  tell("loads", 0, 1);
  report.loads = predict_loads(capture, {first.discretisation, outcome.parameters.layout(), first.theta});
  std::erase_if(report.loads, [](const LoadError& load) { return load.role != "test"; });
  tell("loads", 1, 1);
  tell("pictures", 0, 1);
  const Gallery gallery = gallery_of(recordings.front(), first);
  add_pictures(report, gallery);
  report.fields = fields.draw(gallery);
  tell("pictures", 1, 1);
}

/// Vectors of all parameters drawn from the estimate's uncertainty; none where nothing of the material is known.
std::vector<VectorX> posterior_draws(const FitOutcome& outcome) {
  constexpr int count = 5;
  if (outcome.covariance.size() == 0) return {};
  const Eigen::LLT<MatrixX> factor(outcome.covariance);
  if (factor.info() != Eigen::Success) return {};
  const ParameterSet& parameters = outcome.parameters;
  const VectorX p = parameters.to_unconstrained(outcome.theta);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<VectorX> draws;
  for (int k = 0; k < count; ++k) {
    const VectorX z = VectorX::NullaryExpr(p.size(), [&](Eigen::Index) { return normal(random); });
    draws.push_back(parameters.to_theta(parameters.clamp(p + factor.matrixL() * z)));
  }
  return draws;
}

/// The object for each draw, as a page takes it.
std::vector<LiveSample> posterior_samples(const FitOutcome& outcome, const LiveData& live) {
  std::vector<LiveSample> samples;
  const ParameterSet& parameters = outcome.parameters;
  const auto& of_presses = outcome.law;
  if (of_presses && of_presses->sampled) return {};  // made from fits, with no uncertainty of its own
  const Parameter* const modulus = parameters.find("youngs_modulus");
  const bool has_modulus = modulus && modulus->estimated;
  if (!of_presses && !has_modulus) return {};
  const MotionLayout blocks = live_blocks(live.planes);
  for (const VectorX& drawn : posterior_draws(outcome)) {
    LiveSample& sample = samples.emplace_back(LiveSample{live.theta, {}});
    if (of_presses) {
      sample.law = law_at(*of_presses->scene->body, of_presses->layout, drawn);
      continue;
    }
    const RecordingOutcome& first = outcome.recordings.front();
    if (const LawLayout* layout = first.discretisation.simulation.material.law_layout())
      sample.law = law_at(*first.discretisation.body, *layout, drawn);
    blocks.scale_moduli(sample.theta, drawn[modulus->at] / outcome.theta[modulus->at]);
    for (const auto& [name, at] :
         {std::pair{"poissons_ratio", blocks.poissons_ratio}, std::pair{"mass_damping", blocks.mass_damping},
          std::pair{"stiffness_damping", blocks.stiffness_damping}})
      if (const Parameter* const own = parameters.find(name); own && own->estimated) sample.theta[at] = drawn[own->at];
  }
  return samples;
}

/// The frames of a motion for a page, with some of the points seen in each.
void add_motion(LiveRecording& recording, const RecordedCapture& recorded, const FitOutcome& outcome) {
  constexpr std::size_t most_points = 300;  // a frame
  const Timing& timing = recorded.capture.scene.timing;
  for (int frame = timing.start_frame; frame < timing.frame_count(); ++frame) {
    recording.times.push_back(timing.times[std::size_t(frame)]);
    std::vector<Vector3>& points = recording.points.emplace_back();
    const auto seen = std::ranges::find(recorded.observed, frame, &ObservedFrame::frame);
    if (seen == recorded.observed.end()) continue;
    const std::vector<Vector3> all = corrected_points(
        *seen, recorded.capture, outcome.recordings.front().discretisation, outcome.recordings.front().theta);
    const std::size_t every = std::max<std::size_t>(1, all.size() / most_points);
    for (std::size_t i = 0; i < all.size(); i += every) points.push_back(all[i]);
  }
}

/// The page in which the object can be touched. Its name.
std::string write_live_page(const fs::path& folder, const RecordedCapture& recorded, const FitOutcome& outcome,
                            const Model& model, const std::optional<DeformationResult>& strained) {
  LiveRecording recording;
  if (strained) recording.greatest_strain = strained->greatest_strain;
  // A page knows no pose from which an object was let go.
  if (!outcome.law && !recorded.capture.scene.timing.is_static && !model.scene.initial.released)
    add_motion(recording, recorded, outcome);
  if (outcome.law)
    for (std::size_t i = 0; i < outcome.law->scene->presses.size(); ++i) {
      const Press& press = outcome.law->scene->facts[i];
      recording.presses.push_back({press.contact_centre, press.contact_radius, press.force});
      recording.points.push_back(outcome.law->scene->presses[i].loaded);
    }
  const char* const name = "live.html";
  LiveData data = live_data(model);
  data.samples = posterior_samples(outcome, data);
  write_file(folder / name, live_page(model, std::move(data), recording));
  return name;
}

void write_law(const fs::path& folder, const Capture& capture, const LawOutcome& law,
               const std::vector<double>& modulus_std, ReportData& report, const Progress& tell) {
  std::optional<FieldPictures> fields;
  if (capture.scene.object.surface && !law.predictions.empty()) {
    FieldStates states{"press"};
    for (std::size_t i = 0; i < law.predictions.size(); ++i) {
      const ObservedPress& press = law.scene->presses[i];
      states.at.push_back(double(i + 1));
      states.names.push_back(fmt::format("{}{}, {} N", press.name, press.role == "test" ? " (test)" : "",
                                         readable(press.force.norm(), 3)));
    }
    const auto elasticity = LawElasticity::make(law.scene->body, law.law);
    fields.emplace(law.scene->body, *elasticity, *capture.scene.object.surface, modulus_std, std::move(states));
  }
  std::optional<StrainRange> strains;
  if (law.scene && law.scene->body) strains.emplace(*law.scene->body);
  write_presses(folder, law, tell, [&](int press, const Points& nodes, const BodyFields& of) {
    if (fields) fields->add(press, nodes, of);
    if (strains && is_fitted(law.scene->presses[std::size_t(press)].role)) strains->add(of, std::nullopt);
  });
  report.result.deformation = wider(strains ? strains->result() : std::nullopt, strain_range(report.result.curves));
  if (fields) report.fields = fields->draw(gallery_of(capture));
  const auto add_presses = [&](const PressScene& scene, const std::vector<PressPrediction>& predictions) {
    std::ranges::move(press_errors(scene, predictions), std::back_inserter(report.presses));
    for (const ObservedPress& press : scene.presses) report.press_forces.push_back(press.force.norm());
  };
  add_presses(*law.scene, law.predictions);
  for (const TestedObject& other : law.others) add_presses(*other.scene, other.predictions);
  if (law.sampled) report.basis_errors = law.sampled->error_by_size;
}

void write_tracks(const fs::path& folder, const std::vector<RecordedCapture>& recordings, const FitOutcome& outcome,
                  const Progress& tell) {
  for (std::size_t i = 0; i < outcome.tracking->tracks.size(); ++i) {
    const std::string name = recordings.size() == 1 ? "track" : "track-" + std::to_string(i + 1);
    write_track(folder / name, recordings[i].capture, recordings[i].observed, *outcome.tracking->tracks[i],
                outcome.recordings[i].discretisation.simulation.blocks, outcome.recordings[i].theta, true, tell);
  }
}

}  // namespace

void write_fit_output(const fs::path& folder, const std::vector<RecordedCapture>& recordings, const FitOutcome& outcome,
                      const Result& result, const RunFacts& facts,
                      const std::function<void(const char*, int, int)>& progress) {
  const Progress tell = [&](const char* what, int done, int total) {
    if (progress) progress(what, done, total);
  };
  if (!outcome.law && recordings.front().capture.scene.timing.times.empty()) {  // of loads alone
    std::vector<RecordedCapture> still = recordings;
    for (RecordedCapture& recorded : still) recorded.capture = at_rest(recorded.capture);
    return write_fit_output(folder, still, outcome, result, facts, progress);
  }
  const Capture& capture = recordings.front().capture;
  ReportData report;
  report.title = capture.name;
  report.capture_path = facts.capture_path;
  report.result = result;
  report.convergence = drawn_history(outcome);
  if (outcome.correlation.size() > 0)
    report.correlations = {outcome.parameters.coordinate_names(), outcome.correlation};
  write_result(folder / "result.json", report.result);
  write_convergence(folder / "convergence.csv", history_of(outcome, true));
  std::vector<double> modulus_std;
  std::optional<Model> model;
  if (capture.scene.object.surface) {
    model = make_model(capture, outcome);
    save_model(folder, *model);
    modulus_std = model->volume.youngs_modulus_std;
  }
  if (outcome.law)
    write_law(folder, capture, *outcome.law, modulus_std, report, tell);
  else
    write_motion(folder, recordings, outcome, modulus_std, report, tell);
  write_result(folder / "result.json", report.result);  // with how far the object was strained
  if (model && is_known_to_pages(*model))
    report.live_page = write_live_page(folder, recordings.front(), outcome, *model, report.result.deformation);
  write_report(folder / "report.html", report);
  if (outcome.tracking) write_tracks(folder, recordings, outcome, tell);
}

}  // namespace pliant
