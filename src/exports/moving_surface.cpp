#include "exports/moving_surface.hpp"

#include <stdexcept>

#include "simulation/model_simulation.hpp"

namespace pliant {

MovingSurface moving_surface(const Model& model, const ExportProgress& progress) {
  const ModelScene scene = make_scene(model);
  MovingSurface moving;
  const TriangleMesh seen = surface_of(model, *scene.body);
  moving.triangles = seen.triangles;
  const Embedding surface(*scene.body, seen.vertices);
  const int count = int(scene.simulation.times.size());
  bool is_going_on = true;
  Simulation simulation(scene.body, scene.simulation);
  const RolloutSummary summary = simulation.run(scene.theta, [&](int frame, const State& state, auto) {
    moving.frames.push_back(surface.positions(state.x));
    moving.times.push_back(scene.simulation.times[std::size_t(frame)] - scene.simulation.times.front());
    return is_going_on = !progress || progress(frame + 1, count);
  });
  if (!is_going_on) return {};
  if (!summary.succeeded) throw std::runtime_error("the model cannot be simulated: " + summary.failure);
  return moving;
}

}  // namespace pliant
