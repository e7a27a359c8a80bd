#include "estimation/load_free.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "motion/linear_statics.hpp"

namespace pliant {

namespace {

/// As a simulator does that knows nothing of the scan: from the load-free shape, with the same nodes held.
RolloutSummary sag_from_load_free(const Body& free, SimulationOptions options, const VectorX& theta, Points& sagged) {
  const auto& mesh = std::get<TetMesh>(free.mesh);
  const std::vector<int> held = held_nodes(free, options.holds);
  Body body = make_body(make_tet_mesh(free.nodes, mesh.tets, mesh.mid_nodes), free.options);
  body.mass = free.mass;
  body.modulus = free.modulus;
  const double close = 1e-9 * body.size();
  options.holds = {{[&free, held, close](const Vector3& p) {
    return std::ranges::any_of(held, [&](int n) { return (free.nodes.row(n).transpose() - p).norm() < close; });
  }}};
  for (PointMass& weight : options.weights) weight.at = Embedding(free, {weight.at}).position(0, free.nodes);
  options.newton.tolerance = 1e-11;
  Simulation simulation(std::make_shared<Body>(std::move(body)), options);
  return simulation.run(theta, [&](int, const State& state, auto) { return sagged = state.x, true; });
}

}  // namespace

Capture at_rest(const Capture& capture) {
  Capture still = capture;
  still.scene.timing.is_static = true;
  still.scene.initial = {};
  still.scene.timing.frame_rate = 0.0;
  still.scene.timing.times = {0.0};
  still.scene.timing.start_frame = 0;
  still.depth.clear(), still.silhouettes.clear(), still.clouds.clear(), still.markers.clear();
  return still;
}

double modulus_of_sag(const std::shared_ptr<const Body>& body, const std::vector<Hold>& holds,
                      const MotionBlocks& blocks, VectorX theta, double sag) {
  const std::vector<int> held = held_nodes(*body, holds);
  const LinearStatics statics(body, held, blocks, theta);
  if (!statics.is_held()) return 0.0;
  const double gravity = blocks.gravity.vector(theta).norm();
  double most = 0.0;
  for (int d = 0; d < 3; ++d) {
    theta.segment<3>(blocks.gravity) = gravity * Vector3::Unit(d);
    most = std::max(most, statics.greatest_displacement(scan_load(*body, blocks, theta, {})));
  }
  return theta[blocks.youngs_moduli.front()] * most / (sag * body->size());
}

double carrying_modulus(const std::shared_ptr<const Body>& body, const SimulationOptions& scene, VectorX theta,
                        const std::function<bool()>& interrupted) {
  constexpr double sag_of_size = 0.5;
  constexpr int most_doublings = 24;
  const std::vector<int> held = held_nodes(*body, scene.holds);
  ReferenceShapeOptions options;
  options.by_parts = false;
  options.max_iterations = 30;
  ReferenceShapeSolver shape(body, held, scene.material, scene.blocks, options);
  const Points load = scan_load(*body, scene.blocks, theta, scene.weights);
  const auto scale = [&](double factor) { scene.blocks.scale_moduli(theta, factor); };
  const LinearStatics statics(body, held, scene.blocks, theta);
  if (statics.is_held()) scale(statics.greatest_displacement(load) / (sag_of_size * body->size()));
  for (int i = 0; i < most_doublings; ++i, scale(2.0)) {
    if ((interrupted && interrupted()) || shape.find(theta, load).found)
      return theta[scene.blocks.youngs_moduli.front()];
  }
  throw InputError({{},
                    "no material holds up the scan of the sagging object",
                    "its surface as it sags, held where [[fixed]] says",
                    "check mass, gravity, [[fixed]] and the scan"});
}

LoadFree find_load_free(const Capture& capture, const Resolution& resolution, const CaptureBlocks& blocks,
                        const VectorX& theta, const ReferenceShapeOptions& options) {
  if (resolution.element == ElementKind::Hexahedron)
    throw InputError({{capture.file},
                      "the stress-free reference shape of hexahedra is their regular grid",
                      "tetrahedra",
                      "use element=quadratic_tetrahedra or element=tetrahedra"});
  if (capture.scene.fixed.empty())
    throw InputError(
        {{capture.file}, "nothing holds the object while it sags", "a [[fixed]] region", "name what holds it"});
  const Capture still = at_rest(capture);
  const auto distance = capture_distance(still, resolution.band);
  const Discretisation scanned = discretise(still, distance, resolution, blocks, theta);
  const Body& body = *scanned.body;
  LoadFree found;
  ReferenceShapeSolver solver(scanned.body, held_nodes(body, scanned.simulation.holds), scanned.simulation.material,
                              blocks.motion, options);
  found.shape = solver.find(theta, scan_load(body, blocks.motion, theta, scanned.simulation.weights));
  const Points& scan = body.scanned_positions();
  const auto free = std::make_shared<Body>(with_reference(body, found.shape.X));
  found.scene = discretise(still, distance, free, resolution, blocks, theta);
  found.scene.control_points = scanned.control_points;
  found.surface = *still.scene.object.surface;
  const Points vertices = Embedding(*free, still.scene.object.surface->vertices).positions(found.shape.X);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v)
    found.surface.vertices[std::size_t(v)] = vertices.row(v).transpose();
  found.sag = (scan - found.shape.X).rowwise().norm().maxCoeff();
  found.sagged_again = scan;
  if (!found.shape.found) return found;
  const RolloutSummary again = sag_from_load_free(*free, found.scene.simulation, theta, found.sagged_again);
  if (!again.succeeded)
    throw InputError({{capture.file}, "the shape found does not sag again: " + again.failure, "", ""});
  found.re_sag_error = (found.sagged_again - scan).rowwise().norm().maxCoeff();
  return found;
}

}  // namespace pliant
