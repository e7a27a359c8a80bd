#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/markers.hpp"
#include "ensemble/record.hpp"
#include "model/samples.hpp"
#include "simulation/model_simulation.hpp"

namespace pliant {

/// A number that every member of an ensemble has.
struct EnsembleQuantity {
  std::string name;  ///< as in tables; "x@tip" where it belongs to a point that was asked for
  std::string unit;
  bool operator==(const EnsembleQuantity&) const = default;
};

/// What is asked of every member of an ensemble.
struct EnsembleQuestion {
  MarkerPositions points = {};  ///< of the object at rest, whose paths are kept
  bool keeps_surface = true;    ///< the paths of the surface's vertices are kept
};

/// A model and all that its members have in common: body, scene, what is told of each. Members differ by their
/// material. They are simulated as the model's recording was (`pliant simulate`), each from scratch: a member depends
/// on its material alone.
class EnsembleScene {
 public:
  /// Throws InputError for a model with a material law of its own, whose numbers no draw of moduli changes, for a point
  /// that lies far from the object, and as `make_scene` does.
  /// @param points_file  for complaints
  EnsembleScene(const Model& model, EnsembleQuestion question, const std::filesystem::path& points_file = {});

  /// What is told of a member, in the order of `MemberRecord::outputs`.
  const std::vector<EnsembleQuantity>& outputs() const { return outputs_; }
  /// What is told of a member in every frame, in the order of `MemberRecord::series`.
  static const std::vector<EnsembleQuantity>& series();
  RecordShape shape() const;
  /// Of the frames, since the first [s].
  std::vector<double> times() const;
  /// What is seen of the object; its vertices come first among the points of a record, where they are kept.
  const TriangleMesh& surface() const { return surface_; }
  const EnsembleQuestion& question() const { return question_; }

  /// Simulates a member. Where it cannot be, its record says so and why.
  /// @param interrupted  asked after every frame; may be empty. Throws Interrupted where it says so.
  MemberRecord simulate(const DrawnMaterial& material, const std::function<bool()>& interrupted = {}) const;

 private:
  class Telling;
  double first_frequency(const VectorX& theta) const;

  EnsembleQuestion question_;
  ModelScene scene_;
  SimulationOptions elastic_;
  Vector3 up_;
  TriangleMesh surface_;
  Embedding vertices_, points_;
  Points rest_vertices_, rest_points_;
  std::vector<EnsembleQuantity> outputs_;
};

}  // namespace pliant
