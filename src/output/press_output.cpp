#include "output/press_output.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "base/files.hpp"
#include "elasticity/law_elasticity.hpp"
#include "motion/contact_defaults.hpp"
#include "simulation/law_table.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace fs = std::filesystem;

Model make_model(const Capture& capture, const LawOutcome& outcome) {
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
  model.scene.inner = capture.scene.inner;
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
  return head + fmt::format("{:.3g} mm rms, {:.3g} mm at most, {:.1f} % of the greatest displacement",
                            1e3 * *press.marker_rms, 1e3 * *press.marker_max,
                            100.0 * press.relative_error.value_or(0.0));
}

namespace {

std::string presses_csv(const LawOutcome& outcome) {
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
    text += fmt::format("{},{:.6g}\n", i, material.error_by_size[i]);
  return text;
}

void write_deformed(const fs::path& folder, const LawOutcome& outcome,
                    const std::function<void(const char*, int, int)>& progress,
                    const std::function<void(int, const Points&, const BodyFields&)>& on_press) {
  std::vector<PvdEntry> entries;
  const auto elasticity = LawElasticity::make(outcome.scene->body, outcome.law);
  for (std::size_t i = 0; i < outcome.predictions.size(); ++i) {
    if (progress) progress("presses", int(i), int(outcome.predictions.size()));
    const PressPrediction& p = outcome.predictions[i];
    if (!p.succeeded) continue;
    const std::string name = fmt::format("presses/{:03d}.vtu", i + 1);
    const State state{p.placement.nodes, Points::Zero(p.placement.nodes.rows(), 3)};
    const BodyFields fields = body_fields(*outcome.scene->body, *elasticity, state.x);
    write_vtu(folder / name, frame_grid(*outcome.scene->body, state, fields), VtuPrecision::Single);
    if (on_press) on_press(int(i), state.x, fields);
    entries.push_back({double(i + 1), name});
  }
  write_pvd(folder / "presses.pvd", entries);
}

}  // namespace

void write_presses(const fs::path& folder, const LawOutcome& outcome,
                   const std::function<void(const char*, int, int)>& progress,
                   const std::function<void(int, const Points&, const BodyFields&)>& on_press) {
  if (!outcome.predictions.empty()) write_file(folder / "presses.csv", presses_csv(outcome));
  if (outcome.sampled) write_file(folder / "basis.csv", basis_csv(*outcome.sampled));
  if (!outcome.predictions.empty()) write_deformed(folder, outcome, progress, on_press);
}

}  // namespace pliant
