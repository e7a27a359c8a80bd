#include "estimation/specimens.hpp"

#include <memory>

#include "base/error.hpp"
#include "estimation/material_tests.hpp"
#include "estimation/problem.hpp"
#include "estimation/refinement.hpp"

namespace pliant {

Resolution resolution_of_tests(const Capture& capture, const FitOptions& options) {
  const bool is_chosen = options.element || capture.scene.object.volume;
  Resolution resolution;
  resolution.cells = is_chosen ? options.cells : options.cells / Refinement::mesh_ratio;
  resolution.element =
      options.element.value_or(is_chosen ? ElementKind::Tetrahedron : ElementKind::QuadraticTetrahedron);
  return resolution;
}

namespace {

/// Stress-strain curves: around the object where the capture has a shape; else around one tetrahedron.
PressScene scene_of_curves(const Capture& capture, const FitOptions& options) {
  if (capture.scene.object.surface) {
    std::vector<Vector3> control_points;
    auto body = std::make_shared<Body>(
        *make_body_of(capture.scene, SignedDistance(), resolution_of_tests(capture, options), control_points));
    body->modulus = unit_element()->modulus;  // a specimen tells of one material
    body->modulus.relative.assign(std::size_t(body->element_count()), 1.0);
    return make_press_scene(capture, std::move(body));
  }
  PressScene scene;
  scene.body = unit_element();
  scene.unit_weight = Points::Zero(scene.body->node_count(), 3);
  scene.density = capture.scene.object.density.value_or(0.0);
  StaticTests tests;
  tests.curves = observed_curves(capture);
  scene.tests = std::make_shared<StaticTests>(std::move(tests));
  return scene;
}

/// The object on its mesh, and all its tests. A capture without a scan has stress-strain curves alone.
/// @param cells  elements along the object's longest axis
PressScene scene_of_tests(const Capture& capture, const FitOptions& options, double cells) {
  if (is_of_material_curves(capture)) return scene_of_curves(capture, options);
  if (!capture.scene.object.surface)
    throw InputError({{capture.file},
                      "there is no scan of the object at rest ([object] surface)",
                      "a closed triangle mesh",
                      "scan the object and name the mesh in capture.toml"});
  Resolution resolution = resolution_of_tests(capture, options);
  resolution.cells = cells;
  std::vector<Vector3> control_points;
  return make_press_scene(capture, make_body_of(capture.scene, SignedDistance(), resolution, control_points));
}

std::vector<int> fitted_presses(const PressScene& scene) {
  std::vector<int> fitted;
  for (int i = 0; i < int(scene.presses.size()); ++i)
    if (is_fitted(scene.presses[std::size_t(i)].role)) fitted.push_back(i);
  return fitted;
}

/// Folders are told apart where names are not.
std::string label_of(const Capture& capture) {
  const std::string folder = capture.file.parent_path().filename().string();
  return folder.empty() ? capture.name : folder;
}

}  // namespace

std::vector<TestedSpecimen> specimens_of(const std::vector<const Capture*>& captures, const FitOptions& options,
                                         double finer, bool are_named) {
  std::vector<TestedSpecimen> all;
  for (const Capture* capture : captures) {
    const double cells = finer * resolution_of_tests(*capture, options).cells;
    auto scene = std::make_shared<PressScene>(scene_of_tests(*capture, options, cells));
    if (are_named || captures.size() > 1) put_in_front(label_of(*capture), *scene);
    std::vector<int> presses = fitted_presses(*scene);
    all.push_back({std::move(scene), std::move(presses)});
  }
  return all;
}

}  // namespace pliant
