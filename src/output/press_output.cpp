#include "output/press_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "base/files.hpp"
#include "elasticity/law_elasticity.hpp"
#include "motion/probe_contact.hpp"
#include "report/report.hpp"
#include "simulation/law_table.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace fs = std::filesystem;

Result make_result(const Capture& capture, const PressFitOutcome& outcome, const RunFacts& facts) {
  FitOutcome fit;
  fit.parameters = outcome.parameters;
  fit.theta = outcome.theta;
  fit.start_theta = outcome.parameters.reference();
  fit.std = outcome.std, fit.covariance = outcome.covariance, fit.correlation = outcome.correlation;
  fit.evaluation = outcome.evaluation;
  fit.start_cost = outcome.start_cost, fit.final_cost = outcome.evaluation.cost;
  fit.converged = outcome.converged, fit.interrupted = outcome.interrupted, fit.reason = outcome.reason;
  fit.notes = outcome.notes;
  for (const TriedLaw& tried : outcome.tried) {
    const LawForm& l = tried.form;
    const std::string form = l.terms == 0 ? "a linear law"
                                          : fmt::format("Ogden's law of {} term{}{}", l.terms, l.terms == 1 ? "" : "s",
                                                        l.own_ratios ? " with Poisson's ratios of their own" : "");
    const std::string field =
        l.laws > 1 ? fmt::format(", one for each of {} {}", l.laws, capture.scene.regions.empty() ? "zones" : "regions")
        : l.controls > 1 ? fmt::format(" with {} moduli", l.controls)
                         : "";
    const char* verdict = tried.kept ? "kept" : std::isfinite(tried.cost) ? "not kept" : "not fitted";
    fit.notes.push_back(std::isfinite(tried.evidence)
                            ? fmt::format("{}{}: {}, ln of the evidence for it {:.1f}{}", form, field, verdict,
                                          tried.evidence, std::isfinite(tried.cost) ? "" : " by what a step promises")
                            : fmt::format("{}{}: {}", form, field, tried.kept ? "tried first" : verdict));
  }
  for (std::size_t c = 0; c < outcome.cuts.size(); ++c)
    fit.notes.push_back(fmt::format("Zones: {}.", describe(outcome.cuts[c], int(c) + 1)));
  if (!outcome.scene->presses.empty())
    fit.notes.push_back(fmt::format("A marker's coordinate is taken to err by {:.3g} mm.", 1e3 * outcome.noise));
  if (outcome.sampled) {
    double least = std::numeric_limits<double>::infinity(), most = 0.0;
    for (const PressSample& s : outcome.samples) least = std::min(least, s.weight), most = std::max(most, s.weight);
    fit.notes.push_back(fmt::format(
        "The sampled material has {:.1f} samples an element, from {} presses; the weight of smoothness was chosen by "
        "the noise in each, between {:.3g} and {:.3g}. Its stress misses that of the presses' own fields by "
        "{:.1f} % of the greatest, root mean square. The parameters above are those of the law that it is smooth "
        "about.",
        outcome.sampled->mean_samples, outcome.samples.size(), least, most, 100.0 * outcome.sampled->stress_misfit));
  }
  RecordingOutcome recording;
  recording.discretisation.body = outcome.scene->body;
  recording.discretisation.control_points = outcome.control_points;
  MaterialBlocks& material = recording.discretisation.simulation.blocks;
  material.youngs_moduli.clear();
  for (int k = 0; k < outcome.layout.form().controls; ++k) material.youngs_moduli.push_back(outcome.layout.modulus(k));
  recording.theta = outcome.theta;
  fit.recordings.push_back(std::move(recording));
  Result result = make_result(std::vector<RecordedCapture>{{capture, {}}}, fit, facts);
  result.curves = predict_curves(*outcome.scene, outcome.law);
  // Where the fit began was another form of the law.
  for (ParameterResult& parameter : result.parameters) parameter.start.reset();
  return result;
}

Model make_model(const Capture& capture, const PressFitOutcome& outcome) {
  const Body& body = *outcome.scene->body;
  Model model;
  model.name = capture.name;
  model.scene.object.surface = capture.scene.object.surface;
  model.youngs_modulus = mean_modulus(body, *outcome.law);
  double nu = 0.0;
  for (int e = 0; e < body.element_count(); ++e)
    nu += body.element_volume[std::size_t(e)] / body.volume() * outcome.law->small_strain(e).poissons_ratio;
  model.poissons_ratio = nu;
  const double density = outcome.scene->density > 0.0 ? outcome.scene->density : 100.0;
  model.scene.object.density = density;
  model.scene.object.mass = density * body.volume();
  model.scene.world = capture.scene.world;
  model.scene.planes = capture.scene.planes;
  model.scene.fixed = capture.scene.fixed;
  model.cell_size = mean_edge(body);
  model.volume.nodes = body.nodes;
  model.volume.kind = body.kind == ElementKind::Tetrahedron ? VtuCell::Tetrahedron : VtuCell::QuadraticTetrahedron;
  model.volume.connectivity = body.connectivity;
  for (int e = 0; e < body.element_count(); ++e) {
    const SmallStrainModuli m = outcome.law->small_strain(e);
    model.volume.youngs_modulus.push_back(m.youngs_modulus);
    model.volume.poissons_ratio.push_back(m.poissons_ratio);
    model.volume.fill.push_back(1.0);
  }
  model.law = model_law(*outcome.law);
  return model;
}

std::vector<StaticError> press_errors(const PressScene& scene, const std::vector<PressPrediction>& predictions) {
  std::vector<StaticError> errors;
  for (std::size_t i = 0; i < predictions.size(); ++i) {
    const PressPrediction& p = predictions[i];
    StaticError error{scene.presses[i].name, scene.presses[i].role, {}, {}, scene.presses[i].greatest_displacement, {}};
    if (p.succeeded)
      error.marker_rms = p.marker_rms, error.marker_max = p.marker_max, error.relative_error = p.relative_error;
    errors.push_back(std::move(error));
  }
  return errors;
}

namespace {

void require_tetrahedra(const Model& model) {
  if (model.volume.kind != VtuCell::Tetrahedron && model.volume.kind != VtuCell::QuadraticTetrahedron)
    throw InputError(
        {{}, "a model of hexahedra", "tetrahedra, which rigid bodies can press", "fit with --set element=tetrahedra"});
}

}  // namespace

std::vector<CurvePrediction> predict_curves(const Model& model, const Capture& capture) {
  const auto body = model_body(model);
  if (capture.indentations.empty() && capture.grips.empty())
    return predict_curves(observed_curves(capture), *law_of(model, *body));
  require_tetrahedra(model);
  return predict_curves(make_press_scene(capture, body), law_of(model, *body));
}

std::vector<StaticError> predict_presses(const Model& model, const Capture& capture) {
  require_tetrahedra(model);
  const auto body = model_body(model);
  const PressScene scene = make_press_scene(capture, body);
  return press_errors(scene, predict_presses(scene, law_of(model, *body)));
}

std::string press_sentence(const StaticError& press) {
  const std::string head = press.name + " (" + press.role + "): ";
  if (!press.marker_rms) return head + "the model finds no equilibrium";
  return head + fmt::format("{:.2f} mm rms, {:.2f} mm at most, {:.1f} % of the greatest displacement",
                            1e3 * *press.marker_rms, 1e3 * *press.marker_max,
                            100.0 * press.relative_error.value_or(0.0));
}

namespace {

std::string presses_csv(const PressFitOutcome& outcome) {
  std::string text = "press,role,force [N],greatest displacement [m],marker rms [m],marker max [m],relative error\n";
  for (std::size_t i = 0; i < outcome.predictions.size(); ++i) {
    const ObservedPress& seen = outcome.scene->presses[i];
    const PressPrediction& p = outcome.predictions[i];
    text += fmt::format("{},{},{:.6g},{:.6g},", i + 1, seen.role, seen.force.norm(), seen.greatest_displacement);
    text += p.succeeded ? fmt::format("{:.6g},{:.6g},{:.6g}\n", p.marker_rms, p.marker_max, p.relative_error) : ",,\n";
  }
  return text;
}

std::string basis_csv(const SampledMaterial& material) {
  std::string text = "samples an element,relative error of stress\n";
  for (std::size_t i = 0; i < material.error_by_size.size(); ++i)
    text += fmt::format("{},{:.6g}\n", i + 1, material.error_by_size[i]);
  return text;
}

ConvergenceHistory history_of(const PressFitOutcome& outcome) {
  ConvergenceHistory history{{"youngs_modulus", "marker_rms"}, {"Pa", "m"}, {}};
  for (const PressFitEvent& e : outcome.history)
    history.rows.push_back({0, e.iteration, e.stage, e.cost, 0.0, {e.youngs_modulus, e.marker_rms}});
  return history;
}

void write_deformed(const fs::path& folder, const PressFitOutcome& outcome,
                    const std::function<void(const char*, int, int)>& progress) {
  std::vector<PvdEntry> entries;
  const auto elasticity = LawElasticity::make(outcome.scene->body, outcome.law);
  for (std::size_t i = 0; i < outcome.predictions.size(); ++i) {
    if (progress) progress("presses", int(i), int(outcome.predictions.size()));
    const PressPrediction& p = outcome.predictions[i];
    if (!p.succeeded) continue;
    const std::string name = fmt::format("presses/{:03d}.vtu", i + 1);
    const State state{p.placement.nodes, Points::Zero(p.placement.nodes.rows(), 3)};
    write_vtu(folder / name, frame_grid(*outcome.scene->body, state, *elasticity), VtuPrecision::Single);
    entries.push_back({double(i + 1), name});
  }
  write_pvd(folder / "presses.pvd", entries);
}

}  // namespace

void write_press_output(const fs::path& folder, const Capture& capture, const PressFitOutcome& outcome,
                        const Result& result, const RunFacts& facts,
                        const std::function<void(const char*, int, int)>& progress) {
  const ConvergenceHistory history = history_of(outcome);
  write_result(folder / "result.json", result);
  if (capture.scene.object.surface) save_model(folder, make_model(capture, outcome));
  write_convergence(folder / "convergence.csv", history);
  if (!outcome.predictions.empty()) write_file(folder / "presses.csv", presses_csv(outcome));
  if (outcome.sampled) write_file(folder / "basis.csv", basis_csv(*outcome.sampled));
  if (!outcome.predictions.empty()) write_deformed(folder, outcome, progress);
  ReportData report;
  report.title = capture.name;
  report.capture_path = facts.capture_path;
  report.result = result;
  report.convergence = history;
  report.presses = press_errors(*outcome.scene, outcome.predictions);
  for (const ObservedPress& press : outcome.scene->presses) report.press_forces.push_back(press.force.norm());
  if (outcome.sampled) report.basis_errors = outcome.sampled->error_by_size;
  if (outcome.correlation.size() > 0)
    report.correlations = {outcome.parameters.coordinate_names(), outcome.correlation};
  write_report(folder / "report.html", report);
}

}  // namespace pliant
