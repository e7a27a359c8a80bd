#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "arrays.hpp"
#include "simulation/model_simulation.hpp"

namespace pliant::python {

/// A motion that could not be simulated.
struct SimulationFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What may be given for one run beside the parameters; nothing: as the motion has it.
struct RunState {
  std::optional<Points> start, start_velocities, reference;
};

/// Frames of a motion.
struct Frames {
  std::vector<double> positions, velocities;  ///< frames x nodes x 3 [m], [m/s]
  int count = 0, steps = 0;
};

/// Derivatives of a sum over frames.
struct Gradient {
  VectorX theta;
  NodeCotangents nodes;
};

/// A body in a scene, and its simulation. Calls from several threads take turns.
class Motion {
 public:
  explicit Motion(ModelScene scene);

  const ModelScene& scene() const { return scene_; }
  const Body& body() const { return *scene_.body; }
  int frame_count() const { return int(scene_.simulation.times.size()); }

  /// @param stopped  asked at each frame
  /// Throws SimulationFailure, and std::invalid_argument where the state does not suit.
  Frames run(const VectorX& theta, const RunState& state, int frames, const std::function<bool()>& stopped);
  /// @param cotangent  frames x nodes x 3: derivative of the cost by positions
  Gradient gradient(const VectorX& theta, const RunState& state, const double* cotangent, int frames,
                    bool with_reference, const std::function<bool()>& stopped);

 private:
  void prepare(const RunState& state);

  ModelScene scene_;
  Simulation simulation_;
  bool has_reference_ = false;
  std::mutex turn_;
};

}  // namespace pliant::python
