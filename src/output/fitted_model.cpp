#include "output/fitted_model.hpp"

#include <algorithm>
#include <cmath>

#include "output/press_output.hpp"
#include "simulation/law_table.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

std::vector<Plane> planes_at(const Capture& capture, const MotionBlocks& blocks, const VectorX& theta) {
  std::vector<Plane> planes = capture.scene.planes;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    planes[i].point = blocks.planes[i].point.vector(theta);
    planes[i].normal = blocks.planes[i].normal.vector(theta);
    planes[i].friction = theta[blocks.planes[i].friction];
    planes[i].knows_friction = true;
  }
  return planes;
}

MatrixX log_modulus_covariance(const FitOutcome& outcome) {
  if (outcome.covariance.size() == 0) return {};
  const int controls = outcome.recordings.front().discretisation.body->modulus.controls;
  const std::vector<ParameterHandle>& moduli =
      outcome.recordings.front().discretisation.simulation.blocks.youngs_moduli;
  std::vector<int> coordinate(std::size_t(controls), -1);
  int at = 0;
  for (const Parameter& p : outcome.parameters.parameters()) {
    if (!p.estimated) continue;
    for (int k = 0; k < controls; ++k)
      if (p.at == moduli[std::size_t(k)]) coordinate[std::size_t(k)] = at;
    at += p.dimension();
  }
  MatrixX covariance = MatrixX::Zero(controls, controls);
  for (int i = 0; i < controls; ++i)
    for (int j = 0; j < controls; ++j)
      if (const int a = coordinate[std::size_t(i)], b = coordinate[std::size_t(j)]; a >= 0 && b >= 0)
        covariance(i, j) = outcome.covariance(a, b);
  return covariance;
}

ModulusStatistics modulus_statistics(const FitOutcome& outcome) {
  const RecordingOutcome& first = outcome.recordings.front();
  return modulus_statistics(first.discretisation.body, first.discretisation.simulation.blocks, first.theta,
                            log_modulus_covariance(outcome));
}

namespace {

World world_of(const Vector3& gravity) {
  World world;
  world.gravity = gravity;
  if (gravity.norm() > 0.0) world.up = -gravity.normalized();
  return world;
}

}  // namespace

Model make_model(const Capture& capture, const FitOutcome& outcome) {
  if (outcome.law) {
    Model model = make_model(capture, *outcome.law);
    if (outcome.law->sampled) return model;
    const ModulusStatistics modulus = modulus_statistics(outcome);
    if (modulus.mean_std > 0.0)
      for (std::size_t e = 0; e < model.volume.youngs_modulus.size(); ++e)
        model.volume.youngs_modulus_std.push_back(model.volume.youngs_modulus[e] * modulus.std[Eigen::Index(e)] /
                                                  modulus.value[Eigen::Index(e)]);
    return model;
  }
  const RecordingOutcome& first = outcome.recordings.front();
  Discretisation free = first.discretisation;
  free.body = first.rest_body;
  return make_model(capture, free, first.theta, modulus_statistics(outcome), outcome.cells);
}

Model make_model(const Capture& capture, const Discretisation& d, const VectorX& t, const ModulusStatistics& modulus,
                 double cells) {
  const MotionBlocks& blocks = d.simulation.blocks;
  Model model;
  model.name = capture.name;
  TriangleMesh surface = surface_of(capture, d);
  model.youngs_modulus = modulus.mean;
  model.poissons_ratio = t[blocks.poissons_ratio];
  if (const LawLayout* law = d.simulation.material.law_layout()) model.law = model_law(*law_at(*d.body, *law, t));
  model.mass_damping = t[blocks.mass_damping];
  model.stiffness_damping = t[blocks.stiffness_damping];
  const bool knows_mass = capture.scene.object.mass.has_value();  // then that is kept where the surface is off the scan
  const double mass = t[blocks.density] * enclosed_volume(knows_mass ? *capture.scene.object.surface : surface);
  if (d.body->kind != ElementKind::Hexahedron) {  // the scan may have been taken under load
    const Points free = Embedding(*d.body, surface.vertices).positions(d.body->reference_positions());
    for (Eigen::Index v = 0; v < free.rows(); ++v) surface.vertices[std::size_t(v)] = free.row(v).transpose();
  }
  Scene& scene = model.scene;
  scene.object.mass = mass;
  scene.object.density = mass / enclosed_volume(surface);
  scene.object.surface = std::move(surface);
  scene.world = world_of(blocks.gravity.vector(t));
  scene.planes = planes_at(capture, blocks, t);
  for (Plane& plane : scene.planes) plane.known = true;
  scene.fixed = capture.scene.fixed;
  scene.inner = capture.scene.inner;
  scene.obstacles = capture.scene.obstacles, scene.led = capture.scene.led;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    scene.obstacles[i].friction = t[blocks.obstacles[i].friction];
    scene.obstacles[i].knows_friction = true;
  }
  const double begins = capture.scene.timing.times.empty() ? 0.0 : capture.scene.timing.times.front();
  for (RigidObstacle& obstacle : scene.obstacles)  // a model's first frame is at 0 s
    for (auto& key : obstacle.motion) key.time -= begins;
  for (LedRegion& led : scene.led) {
    led.from -= begins, led.until -= begins;
    for (auto& key : led.motion) key.time -= begins;
  }
  scene.weights = capture.scene.weights;
  scene.wind = capture.scene.wind, scene.forces = capture.scene.forces;
  if (scene.wind) {
    const Vector3 change = blocks.wind.vector(t) - scene.wind->velocity;
    scene.wind->velocity += change, scene.wind->known = true;
    for (auto& key : scene.wind->over_time) key.value += change;
  }
  for (std::size_t k = 0; k < scene.forces.size(); ++k) {
    scene.forces[k].known = true;
    for (auto& key : scene.forces[k].force) key.value *= t[blocks.strengths[k]];
  }
  scene.initial = capture.scene.initial;
  scene.initial.linear_velocity = blocks.linear_velocity.vector(t);
  scene.initial.angular_velocity = blocks.angular_velocity.vector(t);
  scene.initial.known = true;
  for (const ParameterHandle& pull : blocks.pulls) scene.initial.pulls.push_back(pull.vector(t));
  scene.initial.pulled_at = d.simulation.pull_points.at;
  model.cell_size = object_size(capture.scene) / cells;
  if (const auto* grid = std::get_if<HexGrid>(&d.body->mesh)) {
    model.cell_size = grid->cell_size;
    model.grid_origin = grid->origin;
  }
  if (const Timing& timing = capture.scene.timing; !timing.is_static) {
    const double rate = (timing.frame_count() - 1) / (timing.times.back() - timing.times.front());
    scene.timing = evenly_timed(rate, timing.frame_count(), timing.start_frame);
    model.substeps = std::max(1, int(std::ceil(1.0 / (rate * d.simulation.max_dt) - 1e-9)));
  }
  model.newmark_theta = d.simulation.newmark_theta;
  model.contact_stiffness = d.simulation.contact.stiffness;
  if (blocks.contact_stiffness.exists() && t[blocks.contact_stiffness] > 0.0)
    model.contact_stiffness = t[blocks.contact_stiffness];
  model.material.elastic = d.simulation.material.of_mean_strain().value_or(ElasticLaw::NeoHookean);
  model.material.damping = d.simulation.material.damping;
  model.contact_smoothing = d.simulation.contact.smoothing;
  model.volume.nodes = d.body->reference_positions();
  model.volume.kind = vtu_cell(d.body->kind);
  model.volume.connectivity = d.body->connectivity;
  for (int e = 0; e < d.body->element_count(); ++e) {
    model.volume.youngs_modulus.push_back(modulus.value[e]);
    if (modulus.mean_std > 0.0) model.volume.youngs_modulus_std.push_back(modulus.std[e]);
    model.volume.poissons_ratio.push_back(model.poissons_ratio);
    const bool is_cell = d.body->kind == ElementKind::Hexahedron;
    model.volume.fill.push_back(is_cell ? d.body->element_volume[std::size_t(e)] / std::pow(model.cell_size, 3) : 1.0);
  }
  return model;
}

namespace {

/// Whether a surface has the vertices of a scan, no farther from it than a scan errs.
bool is_same_scan(const TriangleMesh& scan, const TriangleMesh& surface) {
  constexpr double errs = 0.03;  // of the size
  const double most = errs * bounding_box(scan).extent().maxCoeff();
  if (scan.vertices.size() != surface.vertices.size() || scan.triangles != surface.triangles) return false;
  for (std::size_t v = 0; v < scan.vertices.size(); ++v)
    if ((scan.vertices[v] - surface.vertices[v]).norm() > most) return false;
  return true;
}

}  // namespace

CaptureScene make_scene(const Model& model, const Capture& recorded) {
  Capture capture = recorded;
  if (capture.scene.object.shape_is == ShapeIs::Static) {  // the model's surface and mesh are stress-free already
    capture.scene.object.surface = model.scene.object.surface;
    capture.scene.object.shape_is = ShapeIs::Reference;
  }
  if (is_same_scan(*capture.scene.object.surface, *model.scene.object.surface))  // off which the fit found it
    capture.scene.object.surface = model.scene.object.surface;
  std::vector<Plane>& planes = capture.scene.planes;  // how they rub the model knows, where nobody said it
  for (std::size_t i = 0; i < std::min(planes.size(), model.scene.planes.size()); ++i)
    if (!planes[i].knows_friction) planes[i].friction = model.scene.planes[i].friction;
  std::vector<RigidObstacle>& obstacles = capture.scene.obstacles;
  for (std::size_t i = 0; i < std::min(obstacles.size(), model.scene.obstacles.size()); ++i)
    if (!obstacles[i].knows_friction) obstacles[i].friction = model.scene.obstacles[i].friction;
  ModelScene made = make_scene(model, capture.scene, capture_distance(capture, Resolution{}.band), capture.file);
  Resolution resolution;
  resolution.cells = object_size(capture.scene) / model.cell_size;
  Mismatch mismatch = make_mismatch(capture, made.distance, made.body, resolution, tracked_points(capture).rest);
  return {{std::move(made.distance), std::move(made.body), std::move(mismatch), {}, std::move(made.simulation)},
          std::move(made.layout),
          std::move(made.theta)};
}

}  // namespace pliant
