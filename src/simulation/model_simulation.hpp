#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "geometry/signed_distance.hpp"
#include "model/model.hpp"
#include "motion/simulation.hpp"

namespace pliant {

/// Body, scene and parameters that a model describes.
struct ModelScene {
  std::shared_ptr<const SignedDistance> distance;
  std::shared_ptr<const Body> body;
  SimulationOptions simulation;
  ParameterLayout layout;  ///< of `theta`
  VectorX theta;
};
/// A model in its own situation. Throws InputError where its object is released from a pose that it does not know.
ModelScene make_scene(const Model& model);

/// A model's material in another situation, on a grid as fine as the model's.
/// @param distance  of the situation's surface, as `scene_distance` makes it
/// @param file      that the situation was read from, for complaints
/// @param has_wind  the parameters have a wind also where there is none
/// Throws InputError where the object is released from a pose that neither knows.
ModelScene make_scene(const Model& model, const Scene& situation, std::shared_ptr<const SignedDistance> distance,
                      const std::filesystem::path& file, bool has_wind = false);

/// Moves a model in its own situation.
/// @param on_frame  called with each frame's time [s] and state; false stops
/// Returns the steps taken and why the simulation ended early, if it did. Throws as `make_scene` does.
RolloutSummary simulate(const Model& model, const std::function<bool(double, const State&)>& on_frame);

/// What is seen of a model: the object's surface, or, where it has none, the boundary of its tetrahedra over all of
/// their nodes.
/// @param body  of the model (`make_scene`)
TriangleMesh surface_of(const Model& model, const Body& body);

/// The body of a model as tetrahedra, with each element's modulus: its own, or, where the model is of hexahedra,
/// quadratic ones with about as many nodes along its longest axis, each with the modulus of the hexahedron about it.
/// @param kind   linear or quadratic; others than the above become eight linear ones each, or get mid nodes
/// @param cells  along the object's longest axis: tetrahedra laid anew over its surface, each with the modulus of the
///               nearest of the model's elements. Throws InputError where the model has no surface then.
std::shared_ptr<const Body> model_body(const Model& model, std::optional<ElementKind> kind = std::nullopt,
                                       std::optional<double> cells = std::nullopt);

}  // namespace pliant
