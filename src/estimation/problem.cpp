#include "estimation/problem.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/error.hpp"
#include "capture/markers.hpp"
#include "capture/region.hpp"
#include "elasticity/modulus_field.hpp"
#include "meshing/mesh_distance.hpp"

namespace pliant {

namespace {

constexpr double density_guess = 200.0;  // [kg/m^3], where nothing anchors it: only ratios follow then
constexpr double gravity_guess = 9.81;
constexpr double range_error_std = 0.02;  // [m], of light that enters a translucent material

std::function<bool(const Vector3&)> region_test(const TriangleMesh& mesh, const Region& region) {
  const auto* vertices = std::get_if<RegionVertices>(&region);
  if (!vertices) return [region](const Vector3& p) { return contains(region, p); };
  // Named vertices hold the object around them, as far as the next vertices.
  std::vector<Vector3> centres;
  double radius = 0.0;
  for (const int v : vertices->indices) centres.push_back(mesh.vertices[std::size_t(v)]);
  for (const auto& triangle : mesh.triangles)
    for (int side = 0; side < 3; ++side)
      radius += (mesh.vertices[triangle[side]] - mesh.vertices[triangle[(side + 1) % 3]]).norm();
  radius /= 3.0 * double(mesh.triangles.size());
  return [centres = std::move(centres), radius](const Vector3& p) {
    return std::any_of(centres.begin(), centres.end(), [&](const Vector3& c) { return (p - c).norm() <= radius; });
  };
}

/// Of a scalar: its block gives name and unit.
Parameter scalar(const ParameterLayout& layout, const ParameterHandle& at, Transform transform, double lower,
                 double upper, double prior_mean, double prior_std, bool estimated, double scale = 1.0) {
  const ParameterBlock& block = layout.block_of(at);
  Parameter p{block.name, block.unit, transform, at, scale, lower, upper, estimated};
  p.prior_std = prior_std;
  p.prior_mean = VectorX::Constant(1, prior_mean);
  return p;
}

Parameter vector(const ParameterLayout& layout, const ParameterHandle& at, double scale, const Vector3& prior_mean,
                 double prior_std, bool estimated) {
  const ParameterBlock& block = layout.block_of(at);
  Parameter p{block.name, block.unit, Transform::Vector, at, scale};
  p.estimated = estimated;
  p.prior_std = prior_std;
  p.prior_mean = prior_mean;
  return p;
}

/// Whether forces are known that anchor pascals: a weight that is let go, or weights that hang while the object is seen.
bool has_known_forces(const Capture& capture) {
  return capture.initial.release_of.has_value() ||
         std::ranges::any_of(capture.loads, [](const Load& load) { return load.role == "fit"; });
}

Vector3 centre_of(const TriangleMesh& surface) {
  const Box box = bounding_box(surface);
  return 0.5 * (box.min + box.max);
}

}  // namespace

ControlledField control_field(const Body& body, const Capture& capture, const FieldOptions& options) {
  const int count = options.control_points;
  if (options.weights == FieldOptions::Weights::Linear) {
    Eigen::Index longest = 0;
    bounding_box(*capture.surface).extent().maxCoeff(&longest);
    return linear_field(body, Vector3::Unit(longest), count);
  }
  const std::vector<Vector3> points = farthest_points(body, count);
  return options.weights == FieldOptions::Weights::Harmonic ? harmonic_field(body, points)
                                                            : inverse_distance_field(body, points);
}

double object_size(const Capture& capture) { return bounding_box(*capture.surface).extent().maxCoeff(); }

std::shared_ptr<const SignedDistance> capture_distance(const Capture& capture, double band) {
  if (!capture.surface)
    throw InputError({{capture.file},
                      "there is no scan of the object at rest ([object] surface)",
                      "a closed triangle mesh",
                      "scan the object and name the mesh in capture.toml"});
  const double size = object_size(capture);
  return std::make_shared<SignedDistance>(signed_distance(*capture.surface, size / 80.0, (band + 0.1) * size));
}

std::shared_ptr<const Body> make_body_of(const Capture& capture, const SignedDistance& distance,
                                         const Resolution& resolution, std::vector<Vector3>& control_points) {
  const double edge = object_size(capture) / resolution.cells;
  Body body;
  if (capture.volume) {
    const VolumeMesh& volume = *capture.volume;
    const TetMesh mesh = make_tet_mesh(volume.nodes, volume.tets, volume.mid_nodes);
    body = make_body(resolution.element == ElementKind::QuadraticTetrahedron ? with_mid_nodes(mesh) : mesh);
  } else if (resolution.element == ElementKind::Hexahedron) {
    body = make_body(make_hex_grid(distance, bounding_box(*capture.surface), edge));
  } else {
    TetMeshOptions options;
    options.cell_size = edge;
    options.quadratic = resolution.element == ElementKind::QuadraticTetrahedron;
    body = make_body(make_tet_mesh(*capture.surface, options));
  }
  if (!capture.regions.empty()) {
    std::vector<std::function<bool(const Vector3&)>> regions;
    for (const MaterialRegion& region : capture.regions)
      regions.push_back(region_test(*capture.surface, region.region));
    body.modulus = region_field(body, regions).field;
  } else if (resolution.field.control_points > 1) {
    ControlledField field = control_field(body, capture, resolution.field);
    body.modulus = std::move(field.field);
    control_points = std::move(field.points);
  }
  return std::make_shared<Body>(std::move(body));
}

std::vector<Hold> held_regions(const std::vector<FixedRegion>& regions, const TriangleMesh& surface) {
  std::vector<Hold> holds;
  for (const FixedRegion& fixed : regions) {
    const RigidMotion motion = fixed.displaced_to.value_or(RigidMotion{});
    holds.push_back({region_test(surface, fixed.region), motion.rotation, motion.translation});
  }
  return holds;
}

std::vector<Hold> held_regions(const Capture& capture) { return held_regions(capture.fixed, *capture.surface); }

Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          const Resolution& resolution, const CaptureBlocks& blocks, const VectorX& parameters,
                          const SimulationOptions& settings, const std::vector<Vector3>& tracked) {
  std::vector<Vector3> control_points;
  auto body = make_body_of(capture, *distance, resolution, control_points);
  Discretisation d =
      discretise(capture, std::move(distance), std::move(body), resolution, blocks, parameters, settings, tracked);
  d.control_points = std::move(control_points);
  return d;
}

namespace {

/// Of the scan, far from what is held; none where the regions hold no vertex of it.
PullPoints pull_points(const Capture& capture, int count) {
  std::vector<Vector3> held;
  for (const FixedRegion& fixed : capture.fixed) {
    const auto contains = region_test(*capture.surface, fixed.region);
    std::ranges::copy_if(capture.surface->vertices, std::back_inserter(held), contains);
  }
  if (count == 0 || held.empty()) return {};
  return {far_points(capture.surface->vertices, held, count), object_size(capture)};
}

constexpr double shape_length = 0.25;  // over which a scan's errors are alike, times the object's size

ShapeField shape_field(const Capture& capture, const Resolution& resolution) {
  if (resolution.shape_points == 0) return {};
  const double size = object_size(capture);
  PullPoints far = pull_points(capture, resolution.shape_points);
  const std::vector<Vector3>& vertices = capture.surface->vertices;
  if (far.at.empty()) far.at = far_points(vertices, {vertices.front()}, resolution.shape_points);
  return {std::move(far.at), resolution.shape_std * size, shape_length * size};
}

}  // namespace

Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          std::shared_ptr<const Body> body, const Resolution& resolution, const CaptureBlocks& blocks,
                          const VectorX& parameters, const SimulationOptions& settings,
                          const std::vector<Vector3>& tracked) {
  Discretisation d;
  d.distance = std::move(distance);
  d.body = std::move(body);
  const double size = object_size(capture);
  const bool any_surface = std::ranges::any_of(capture.loads, [](const Load& l) { return l.cloud || !l.images.empty(); });
  if (!capture.depth.empty() || !capture.clouds.empty() || any_surface)
    d.mismatch.surface =
        std::make_shared<SurfaceConstraints>(d.body, d.distance, resolution.band * size, size / resolution.cells);
  if (!tracked.empty()) d.mismatch.tracks = std::make_shared<PointTracks>(*d.body, tracked);
  d.simulation = settings;
  d.simulation.is_static = capture.is_static;
  d.simulation.times.assign(capture.times.begin() + capture.start_frame, capture.times.end());
  const double gravity = std::max(blocks.motion.gravity.vector(parameters).norm(), 0.1);
  d.simulation.max_dt = default_time_step(*d.body, gravity);
  d.simulation.scan_sags = capture.shape_is == ShapeIs::Static && !d.body->is_free_elsewhere();
  // What hangs and touches nothing moves smoothly; its elements are quadratic, and its steps dear.
  const std::vector<double>& times = d.simulation.times;
  if (d.simulation.scan_sags && capture.planes.empty() && times.size() > 1)
    d.simulation.max_dt =
        std::max(d.simulation.max_dt, 0.125 * (times.back() - times.front()) / double(times.size() - 1));
  d.simulation.max_dt /= resolution.steps;
  d.simulation.blocks = blocks.motion;
  d.mismatch.sensors = blocks.sensors;
  d.mismatch.centre = centre_of(*capture.surface);
  d.simulation.contact = default_contact(*d.body, parameters[blocks.motion.density] * d.body->volume(), gravity);
  for (const Weight& weight : capture.weights) d.simulation.weights.push_back({weight.at, weight.mass});
  if (const auto& weight = capture.initial.release_of; weight && capture.initial.released)
    d.simulation.released_weights.push_back({weight->at, weight->mass});
  d.simulation.pull_points = pull_points(capture, int(blocks.motion.pulls.size()));
  d.simulation.shape = shape_field(capture, resolution);
  d.simulation.holds = held_regions(capture);
  return d;
}

std::vector<std::string> sensor_names(const Capture& capture) {
  std::vector<std::string> names;
  for (const DepthCamera& camera : capture.depth) names.push_back(camera.name);
  if (!capture.clouds.empty()) names.emplace_back("clouds");
  if (!capture.markers.empty()) names.emplace_back("markers");
  return names;
}

int pull_count(const Capture& capture, const Resolution& resolution) {
  if (!capture.initial.released || capture.initial.release_of) return 0;
  return capture.initial.pulls.empty() ? resolution.pulls : int(capture.initial.pulls.size());
}

std::vector<std::string> modulus_names(const Capture& capture, int controls) {
  std::vector<std::string> names;
  for (int k = 0; k < controls; ++k) {
    if (controls == 1 || (k == 0 && !capture.regions.empty()))
      names.emplace_back("youngs_modulus");
    else if (!capture.regions.empty())
      names.push_back("youngs_modulus@" + capture.regions[std::size_t(k) - 1].name);
    else
      names.push_back("youngs_modulus@" + std::to_string(k + 1));
  }
  return names;
}

CaptureParameters default_parameters(const Capture& capture, double volume, int controls, int pulls, int shapes) {
  const double size = object_size(capture);
  const double gravity = capture.gravity ? capture.gravity->norm() : gravity_guess;
  const double density = capture.mass ? *capture.mass / volume : capture.density ? *capture.density : density_guess;
  const double time = std::sqrt(size / std::max(gravity, 0.1));   // of a fall through the object's own size
  const double stress = density * std::max(gravity, 0.1) * size;  // under its own weight

  ParameterLayout layout;
  CaptureBlocks blocks;
  blocks.motion = add_motion_blocks(
      layout, {.moduli = controls, .planes = int(capture.planes.size()), .pulls = pulls, .scan_corrections = shapes},
      modulus_names(capture, controls));
  for (const std::string& sensor : sensor_names(capture)) blocks.sensors.push_back(add_sensor_blocks(layout, sensor));
  const MotionBlocks& m = blocks.motion;
  VectorX theta = VectorX::Zero(layout.size());
  m.set_moduli(theta, 20.0 * stress);
  theta[m.poissons_ratio] = 0.35;
  theta[m.mass_damping] = 0.05 / time;
  theta[m.stiffness_damping] = 0.02 * time;
  theta[m.density] = density;
  theta.segment<3>(m.gravity) = capture.gravity.value_or(-gravity_guess * capture.up);
  theta.segment<3>(m.linear_velocity) = capture.initial.linear_velocity;
  theta.segment<3>(m.angular_velocity) = capture.initial.angular_velocity;

  std::vector<Parameter> p;
  // Priors are wide: they say what soft solids are like and only matter where the recording says nothing.
  for (const ParameterHandle& modulus : m.youngs_moduli)
    p.push_back(scalar(layout, modulus, Transform::Logarithm, 1e-2 * stress, 1e8 * stress, std::log(theta[modulus]),
                       std::numeric_limits<double>::infinity(), true));
  p.push_back(scalar(layout, m.poissons_ratio, Transform::LogitHalf, 0.02, 0.495, std::log(0.35 / 0.15), 0.5, true));
  p.push_back(scalar(layout, m.mass_damping, Transform::Logarithm, 1e-4 / time, 20.0 / time,
                     std::log(theta[m.mass_damping]), 1.5, !capture.is_static));
  p.push_back(scalar(layout, m.stiffness_damping, Transform::Logarithm, 1e-5 * time, 2.0 * time,
                     std::log(theta[m.stiffness_damping]), 1.5, !capture.is_static));
  p.push_back(scalar(layout, m.density, Transform::Logarithm, 0.1, 3e4, std::log(density), 0.5,
                     !capture.mass && !capture.density && has_known_forces(capture)));
  if (capture.gravity) {  // its length is known better than how the world's axes stand
    Parameter direction = vector(layout, m.gravity, 1.0, Vector3::Zero(), 0.05, false);
    direction.transform = Transform::Direction;
    direction.prior_mean = VectorX::Zero(2);
    direction.origin = *capture.gravity;
    p.push_back(std::move(direction));
  } else {
    p.push_back(vector(layout, m.gravity, 1.0, m.gravity.vector(theta), 10.0, true));
  }
  const double speed = std::sqrt(gravity * size);
  const bool moves = !capture.initial.known && !capture.is_static;
  p.push_back(vector(layout, m.linear_velocity, speed, m.linear_velocity.vector(theta) / speed, 3.0, moves));
  p.push_back(vector(layout, m.angular_velocity, 1.0 / time, m.angular_velocity.vector(theta) * time, 3.0, moves));
  for (std::size_t i = 0; i < m.planes.size(); ++i) {
    theta.segment<3>(m.planes[i].point) = capture.planes[i].point;
    theta.segment<3>(m.planes[i].normal) = capture.planes[i].normal;
    Parameter plane = vector(layout, m.planes[i].whole(), size, Vector3::Zero(), 0.2, !capture.planes[i].known);
    plane.transform = Transform::PlanePosition;
    plane.origin = theta.segment<6>(m.planes[i].whole());
    p.push_back(std::move(plane));
  }
  for (std::size_t k = 0; k < m.pulls.size(); ++k) {
    if (k < capture.initial.pulls.size()) theta.segment<3>(m.pulls[k]) = capture.initial.pulls[k];
    p.push_back(vector(layout, m.pulls[k], 1.0, Vector3::Zero(), 0.5, true));
    p.back().is_auxiliary = true;
  }
  for (std::size_t k = 0; k < blocks.sensors.size(); ++k) {
    const SensorBlocks& sensor = blocks.sensors[k];
    if (k < capture.depth.size())
      p.push_back(scalar(layout, sensor.range_error, Transform::Shift, -0.2, 0.2, 0.0, range_error_std / size, false,
                         size));
    p.push_back(vector(layout, sensor.turn, 1.0, Vector3::Zero(), 0.05, false));
    p.push_back(vector(layout, sensor.shift, size, Vector3::Zero(), 0.05, false));
  }
  for (const ParameterHandle& correction : m.scan_corrections) {
    p.push_back(vector(layout, correction, 1.0, Vector3::Zero(), 1.0, true));
    p.back().is_auxiliary = true;
  }
  return {ParameterSet(std::move(layout), std::move(p), std::move(theta)), std::move(blocks)};
}

TrackedPoints tracked_points(const Capture& capture) {
  TrackedPoints tracked;
  const double noise = capture.surface ? 1e-3 * object_size(capture) : 1e-3;
  for (const MarkerTrack& block : capture.markers) {
    const MarkerSet set = read_markers(block, capture.frame_count());
    const int sensor = int(sensor_names(capture).size()) - 1;
    const int first = int(tracked.rest.size());
    for (int m = 0; m < set.marker_count(); ++m) tracked.rest.push_back(set.rest.row(m).transpose());
    for (int frame = 0; frame < int(set.frames.size()); ++frame)
      for (int m = 0; m < set.marker_count(); ++m)
        if (set.is_seen(frame, m))
          tracked.frames[frame].push_back(
              {first + m, set.frames[std::size_t(frame)].row(m).transpose(), noise, sensor});
  }
  return tracked;
}

std::vector<FrameObservations> frame_observations(const Capture& capture, const std::vector<ObservedFrame>& observed,
                                                  const TrackedPoints& tracked) {
  const auto frame_of = [&](int recorded) {
    const int frame = recorded - capture.start_frame;
    return capture.initial.released ? std::max(frame, 0) : frame;
  };
  const int cameras = int(capture.depth.size());
  std::map<int, FrameObservations> frames;
  for (const ObservedFrame& seen : observed) {
    std::vector<SurfaceObservation>& points = frames[frame_of(seen.frame)].points;
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
      const int camera = i < seen.camera.size() ? seen.camera[i] : -1;
      points.push_back({seen.points[i], double(seen.noise[i]), camera < 0 ? cameras : camera,
                        i < seen.view.size() ? seen.view[i] : Vector3::Zero()});
    }
  }
  for (const auto& [frame, points] : tracked.frames) {
    auto& tracks = frames[frame_of(frame)].tracks;
    tracks.insert(tracks.end(), points.begin(), points.end());
  }
  std::vector<FrameObservations> from_start;
  for (auto& [frame, seen] : frames) {
    if (frame < 0 || frame >= capture.frame_count() - capture.start_frame) continue;
    seen.frame = frame;
    from_start.push_back(std::move(seen));
  }
  return from_start;
}

}  // namespace pliant
