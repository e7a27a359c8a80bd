#include "exports/moving_surface.hpp"

#include <stdexcept>

#include "simulation/model_simulation.hpp"

namespace pliant {

MovingSurface moving_surface(const Model& model, const ExportProgress& progress) {
  const ModelScene scene = make_scene(model);
  MovingSurface moving;
  std::vector<Vector3> vertices;
  if (model.scene.object.surface) {
    vertices = model.scene.object.surface->vertices;
    moving.triangles = model.scene.object.surface->triangles;
  } else {
    const auto& mesh = std::get<TetMesh>(scene.body->mesh);
    for (Eigen::Index n = 0; n < mesh.nodes.rows(); ++n) vertices.push_back(mesh.nodes.row(n).transpose());
    moving.triangles = mesh.boundary;
  }
  const Embedding surface(*scene.body, vertices);
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
