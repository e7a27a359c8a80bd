#include "simulation/scene_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "base/error.hpp"
#include "geometry/offset_surface.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/patch_forces.hpp"
#include "motion/wind.hpp"
#include "scene/region.hpp"
#include "simulation/flat_sheet.hpp"
#include "simulation/inner_bodies.hpp"
#include "simulation/key_changes.hpp"
#include "simulation/obstacles.hpp"

namespace pliant {

namespace {

ControlledField painted_field(const Body& body, const Scene& scene) {
  const std::vector<Vector3>& vertices = scene.object.surface->vertices;
  MatrixX weights(Eigen::Index(vertices.size()), Eigen::Index(scene.controls.size()));
  for (std::size_t k = 0; k < scene.controls.size(); ++k)
    weights.col(Eigen::Index(k)) = Eigen::Map<const VectorX>(scene.controls[k].weights.data(), weights.rows());
  return extended_field(body, vertices, weights);
}

}  // namespace

int control_count(const Scene& scene, int asked_for) {
  const int named = int(named_moduli(scene).size());
  return named > 0 ? named : asked_for;
}

ControlledField modulus_field(const Body& body, const Scene& scene, const FieldOptions& options) {
  if (!scene.regions.empty()) return region_field(body, region_tests(scene));
  const bool is_placed = !scene.controls.empty();
  if (is_placed && !scene.controls.front().weights.empty()) return painted_field(body, scene);
  const int count = control_count(scene, options.control_points);
  if (count == 1) return {{1, {}, body.modulus.relative}, {}};
  if (options.weights == FieldOptions::Weights::Linear && !is_placed) {
    Eigen::Index longest = 0;
    bounding_box(*scene.object.surface).extent().maxCoeff(&longest);
    return linear_field(body, Vector3::Unit(longest), count);
  }
  std::vector<Vector3> points;
  for (const MaterialControl& control : scene.controls) points.push_back(control.point);
  if (!is_placed) points = farthest_points(body, count);
  return options.weights == FieldOptions::Weights::InverseDistance ? inverse_distance_field(body, points)
                                                                   : harmonic_field(body, points);
}

double object_size(const Scene& scene) { return bounding_box(*scene.object.surface).extent().maxCoeff(); }

std::shared_ptr<const SignedDistance> scene_distance(const Scene& scene, double band) {
  constexpr double usual = 80.0, finest = 120.0, finest_of_sheets = 400.0;  // grid points along the object
  constexpr double across = 24.0;  // and through it: edges are rounded between grid points
  const double size = object_size(scene), margin = (band + 0.1) * size;
  if (const auto sheet = flat_sheet(*scene.object.surface); sheet && sheet->thickness < size / finest) {
    const double spacing = 0.9 * sheet->thickness;
    if (spacing < size / finest_of_sheets)
      throw InputError({{},
                        fmt::format("a sheet of {:.2g} m thickness", sheet->thickness),
                        fmt::format("{:.2g} m at least, of an object of {:.2g} m", size / finest_of_sheets / 0.9, size),
                        "what is thinner is no solid any more: fit a smaller piece of it"});
    return std::make_shared<SignedDistance>(signed_distance(*scene.object.surface, spacing, margin));
  }
  auto distance = std::make_shared<SignedDistance>(signed_distance(*scene.object.surface, size / usual, margin));
  const double spacing = std::max(thickness(scene, *distance) / across, size / finest);
  if (spacing < 0.8 * distance->spacing()) *distance = signed_distance(*scene.object.surface, spacing, margin);
  return distance;
}

std::vector<std::function<bool(const Vector3&)>> region_tests(const Scene& scene) {
  std::vector<std::function<bool(const Vector3&)>> regions;
  for (const MaterialRegion& region : scene.regions)
    regions.push_back(is_in_region(*scene.object.surface, region.region));
  return regions;
}

double thickness(const Scene& scene, const SignedDistance& distance) {
  constexpr double share = 0.25;  // of the surface that may be thinner
  const TriangleMesh& surface = *scene.object.surface;
  const double size = object_size(scene), start = 1e-3 * size, least_step = 0.25 * distance.spacing();
  std::vector<std::pair<double, double>> through;  // distance and area
  double area = 0.0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Vector3 &p = surface.vertices[std::size_t(a)], &q = surface.vertices[std::size_t(b)],
                  &r = surface.vertices[std::size_t(c)];
    const Vector3 cross = (q - p).cross(r - p), middle = (p + q + r) / 3.0, inwards = -cross.normalized();
    if (!(cross.norm() > 0.0)) continue;
    double t = start;
    for (double depth = least_step; t < size; t += std::max(depth, least_step)) {
      depth = -distance.value(middle + t * inwards);
      if (depth <= 0.0 && t > 2.0 * distance.spacing()) break;
    }
    through.emplace_back(t, 0.5 * cross.norm());
    area += through.back().second;
  }
  std::ranges::sort(through);
  double before = 0.0;
  for (const auto& [t, part] : through)
    if ((before += part) >= share * area) return t;
  return size;
}

double hex_cell_size(const Scene& scene, const SignedDistance& distance, double cells, int most) {
  return hex_cell_size_of_thickness(scene, thickness(scene, distance), cells, most);
}

namespace {

/// Regions that something holds, standing still or led, as they are at rest.
std::vector<Hold> gripped_regions(const Scene& scene) {
  std::vector<Hold> regions = held_regions(scene);
  for (const LedRegion& led : scene.led) regions.push_back({is_in_region(*scene.object.surface, led.region)});
  return regions;
}

/// Where a held region ends within the object along an axis, and on which side of it the region lies.
struct HeldEnd {
  double at;     // [m]
  double inner;  // -1: below, 1: above
};

/// The first one along each axis.
std::array<std::optional<HeldEnd>, 3> held_ends(const Scene& scene, const Box& object) {
  std::array<std::optional<HeldEnd>, 3> ends;
  const auto add = [&](int axis, double at, double inner) {
    const double slack = 1e-6 * object.extent()[axis];
    if (!ends[std::size_t(axis)] && at > object.min[axis] + slack && at < object.max[axis] - slack)
      ends[std::size_t(axis)] = HeldEnd{at, inner};
  };
  const auto add_region = [&](const Region& region) {
    if (const auto* box = std::get_if<RegionBox>(&region))
      for (int axis = 0; axis < 3; ++axis) add(axis, box->min[axis], 1.0), add(axis, box->max[axis], -1.0);
    if (const auto* half = std::get_if<RegionHalfSpace>(&region))
      for (int axis = 0; axis < 3; ++axis)
        if (std::abs(half->normal[axis]) > 1.0 - 1e-9) add(axis, half->point[axis], half->normal[axis]);
  };
  for (const FixedRegion& fixed : scene.fixed) add_region(fixed.region);
  for (const LedRegion& led : scene.led) add_region(led.region);
  return ends;
}

}  // namespace

HexGrid hex_grid_of(const Scene& scene, const SignedDistance& distance, double cell_size) {
  constexpr double inside = 1e-6;  // of a cell: nodes between the layers are held
  const Box object = bounding_box(*scene.object.surface);
  const auto ends = held_ends(scene, object);
  Vector3 shift = Vector3::Zero();
  for (int axis = 0; axis < 3; ++axis)
    if (const auto& end = ends[std::size_t(axis)]) {
      const double cells = std::ceil(object.extent()[axis] / cell_size);
      const double origin = 0.5 * (object.min[axis] + object.max[axis] - cells * cell_size);
      const double from_plane = (origin - end->at) / cell_size - inside * end->inner;
      shift[axis] = from_plane - std::round(from_plane);
    }
  HexGridOptions options;
  options.is_held = [holds = gripped_regions(scene)](const Vector3& p) {
    return std::ranges::any_of(holds, [&](const Hold& hold) { return hold.contains(p); });
  };
  return make_hex_grid(distance, object, cell_size, options, shift);
}

namespace {

/// The scene's tetrahedra, their boundary beside the scan by an offset [m]; none: on it.
TetMesh tetrahedra_of(const Scene& scene, const Resolution& resolution,
                      const std::function<double(const Vector3&)>& offset = {}) {
  const bool quadratic = resolution.element == ElementKind::QuadraticTetrahedron;
  if (scene.object.volume) {
    const VolumeMesh& volume = *scene.object.volume;
    const TetMesh mesh = make_tet_mesh(volume.nodes, volume.tets, volume.mid_nodes);
    const TetMesh own = quadratic ? with_mid_nodes(mesh) : mesh;
    return offset ? with_offset_boundary(own, offset) : own;
  }
  TetMeshOptions options;
  options.cell_size = object_size(scene) / resolution.cells;
  options.quadratic = quadratic;
  for (const Hold& hold : gripped_regions(scene)) options.parts.push_back(hold.contains);
  // Linear elements lock where they are flat.
  const auto sheet = flat_sheet(*scene.object.surface);
  if (quadratic && sheet && sheet->thickness < least_through * options.cell_size) {
    const TetMesh own = flat_tetrahedra(*scene.object.surface, *sheet, options);
    return offset ? with_offset_boundary(own, offset) : own;
  }
  options.offset = offset;
  return make_tet_mesh(*scene.object.surface, options);
}

/// Of an object that is thinner than cells see.
[[noreturn]] void refuse_hexahedra(const Scene& scene, double cell_size) {
  const TriangleMesh& surface = *scene.object.surface;
  const double thin = 2.0 * enclosed_volume(surface) / surface_area(surface);
  throw InputError(
      {{},
       fmt::format("hexahedra of {:.2g} m in an object of about {:.2g} m thickness", cell_size, thin),
       fmt::format("two through it at least, which are {:.0f} along the object", 2.0 * object_size(scene) / thin),
       "where it is flat, set element=quadratic_tetrahedra: one through the thickness bends as it does; of a "
       "curved shell make quadratic tetrahedra elsewhere and name them as `volume_mesh` (docs/formats.md)"});
}

HexGrid hexahedra_of(const Scene& scene, const SignedDistance& distance, const Resolution& resolution) {
  double cell_size = resolution.follows_thickness ? hex_cell_size(scene, distance, resolution.cells)
                                                  : object_size(scene) / resolution.cells;
  HexGrid grid;
  try {
    grid = hex_grid_of(scene, distance, cell_size);
  } catch (const InputError&) {
    refuse_hexahedra(scene, cell_size);
  }
  if (std::abs(grid.volume() / enclosed_volume(*scene.object.surface) - 1.0) > 0.5) refuse_hexahedra(scene, cell_size);
  // Where a neck falls between cells, a part of the object would hang by an edge, or not at all.
  for (int smaller = 0; smaller < 6 && face_connected_parts(grid) > 1; ++smaller)
    grid = hex_grid_of(scene, distance, cell_size *= 0.85);
  return grid;
}

/// By how far the surface of the object lies outside its scan at a place of it [m]: 0 where it is held.
std::function<double(const Vector3&)> offset_of(const Scene& scene, const Resolution& resolution) {
  return [offset = resolution.offset, holds = gripped_regions(scene)](const Vector3& p) {
    return std::ranges::any_of(holds, [&](const Hold& hold) { return hold.contains(p); }) ? 0.0 : offset(p);
  };
}

/// The body with its surface beside the scan but where it is held, on the same lattice or by the same elements; as
/// heavy where the scene tells the mass.
Body beside_scan(const Scene& scene, const SignedDistance& distance, const Body& body, const Resolution& resolution) {
  Body other;
  const TriangleMesh surface = surface_of(scene, resolution);
  if (body.kind == ElementKind::Hexahedron) {
    other = make_body(hex_grid_of(scene, offset_distance(scene, distance, resolution), body.grid().cell_size),
                      body.options);
  } else {
    try {
      other = make_body(tetrahedra_of(scene, resolution, offset_of(scene, resolution)), body.options);
    } catch (const std::invalid_argument&) {
      throw InputError({{},
                        "elements turn inside out where the surface is as far from the scan as that may err",
                        "errors that are a small part of the object's thickness",
                        "check surface_noise of [object], in metres"});
    }
  }
  if (scene.object.mass)
    for (double& mass : other.mass) mass *= enclosed_volume(*scene.object.surface) / enclosed_volume(surface);
  return other;
}

/// Makes the stiffness vary over the body, which is as stiff on the geometric mean.
void make_uneven(Body& body, const std::function<double(const Vector3&)>& unevenness) {
  std::vector<double>& relative = body.modulus.relative;
  std::vector<double> logarithm(relative.size());
  const double volume = body.volume();
  double mean = 0.0;
  for (int e = 0; e < body.element_count(); ++e) {
    Vector3 centre = Vector3::Zero();
    for (const int node : body.element(e)) centre += body.nodes.row(node).transpose() / body.nodes_per_element();
    logarithm[std::size_t(e)] = unevenness(centre);
    mean += body.element_volume[std::size_t(e)] / volume * logarithm[std::size_t(e)];
  }
  for (std::size_t e = 0; e < relative.size(); ++e) relative[e] *= std::exp(logarithm[e] - mean);
}

}  // namespace

TriangleMesh surface_of(const Scene& scene, const Resolution& resolution) {
  TriangleMesh surface = *scene.object.surface;
  if (!resolution.offset) return surface;
  const auto offset = offset_of(scene, resolution);
  const std::vector<Vector3> outwards = offset_directions(surface);
  for (std::size_t v = 0; v < outwards.size(); ++v) surface.vertices[v] += offset(surface.vertices[v]) * outwards[v];
  return surface;
}

SignedDistance offset_distance(const Scene& scene, const SignedDistance& scan, const Resolution& resolution) {
  return scan.offset_by(offset_of(scene, resolution));
}

std::shared_ptr<const Body> make_body_of(const Scene& scene, const SignedDistance& distance,
                                         const Resolution& resolution, std::vector<Vector3>& control_points) {
  const bool are_hexahedra = !scene.object.volume && resolution.element == ElementKind::Hexahedron;
  Body body = are_hexahedra ? make_body(hexahedra_of(scene, distance, resolution))
                            : make_body(tetrahedra_of(scene, resolution));
  if (resolution.offset) body = beside_scan(scene, distance, body, resolution);
  for (double& mass : body.mass) mass *= resolution.relative_density;
  if (resolution.unevenness) make_uneven(body, resolution.unevenness);
  ControlledField field = modulus_field(body, scene, resolution.field);
  body.modulus = std::move(field.field);
  control_points = std::move(field.points);
  return std::make_shared<Body>(std::move(body));
}

std::vector<Hold> held_regions(const std::vector<FixedRegion>& regions, const TriangleMesh& surface) {
  std::vector<Hold> holds;
  for (const FixedRegion& fixed : regions) {
    const RigidMotion motion = fixed.displaced_to.value_or(RigidMotion{});
    holds.push_back({is_in_region(surface, fixed.region), motion.rotation, motion.translation});
  }
  return holds;
}

std::vector<Hold> held_regions(const Scene& scene) { return held_regions(scene.fixed, *scene.object.surface); }

int pull_count(const Scene& scene, const Resolution& resolution) {
  if (!scene.initial.released || scene.initial.release_of) return 0;
  const Initial& initial = scene.initial;
  if (!initial.pulls.empty()) return int(initial.pulls.size());
  return initial.pulled_at.empty() ? resolution.pulls : int(initial.pulled_at.size());
}

namespace {

/// Of the scan, far from what is held; none where the regions hold no vertex of it.
PullPoints far_from_holds(const Scene& scene, int count) {
  std::vector<Vector3> held;
  for (const FixedRegion& fixed : scene.fixed) {
    const auto contains = is_in_region(*scene.object.surface, fixed.region);
    std::ranges::copy_if(scene.object.surface->vertices, std::back_inserter(held), contains);
  }
  if (count == 0 || held.empty()) return {};
  return {far_points(scene.object.surface->vertices, held, count), object_size(scene)};
}

PullPoints pull_points(const Scene& scene, int count) {
  if (!scene.initial.pulled_at.empty()) return {scene.initial.pulled_at, object_size(scene)};
  return far_from_holds(scene, count);
}

constexpr double shape_length = 0.25;  // over which a scan's errors are alike, times the object's size

ShapeField shape_field(const Scene& scene, const Resolution& resolution) {
  if (resolution.shape_points == 0) return {};
  const double size = object_size(scene);
  PullPoints far = far_from_holds(scene, resolution.shape_points);
  const std::vector<Vector3>& vertices = scene.object.surface->vertices;
  if (far.at.empty()) far.at = far_points(vertices, {vertices.front()}, resolution.shape_points);
  return {std::move(far.at), resolution.shape_std * size, shape_length * size};
}

}  // namespace

void set_obstacles(const Scene& scene, const MotionBlocks& blocks, VectorX& theta) {
  const std::vector<Plane>& planes = scene.planes;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    theta.segment<3>(blocks.planes[i].point) = planes[i].point;
    theta.segment<3>(blocks.planes[i].normal) = planes[i].normal;
    theta[blocks.planes[i].friction] = planes[i].friction;
  }
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    theta[blocks.obstacles[i].friction] = scene.obstacles[i].friction;
}

void add_loads(const Scene& scene, SimulationOptions& simulation) {
  const MotionBlocks& blocks = simulation.blocks;
  if (const auto& wind = scene.wind; wind && blocks.wind.exists()) {
    WindOptions options;
    options.air_density = wind->air_density, options.normal = wind->normal, options.tangential = wind->tangential;
    options.change = changes(wind->over_time, wind->velocity);
    options.gusts = Gusts(wind->velocity, scene.world.up, wind->gust_intensity, wind->gust_length, wind->seed);
    options.delay = wind->delay;
    simulation.further_forces.push_back(
        [surface = *scene.object.surface, options, at = blocks.wind](const auto& body) -> std::unique_ptr<ForceTerm> {
          return std::make_unique<Wind>(*body, surface, options, at);
        });
  }
  for (std::size_t k = 0; k < blocks.strengths.size(); ++k)
    simulation.further_forces.push_back(
        [force = scene.forces[k], at = blocks.strengths[k]](const auto& body) -> std::unique_ptr<ForceTerm> {
          return std::make_unique<PatchLoad>(*body, surface_patch(*body, force.at, force.radius),
                                             KeyFrames<3>(force.force), at);
        });
}

void set_loads(const Scene& scene, const MotionBlocks& blocks, VectorX& theta) {
  if (scene.wind && blocks.wind.exists()) theta.segment<3>(blocks.wind) = scene.wind->velocity;
  for (const ParameterHandle& strength : blocks.strengths) theta[strength] = 1.0;
}

MotionCounts load_counts(const Scene& scene) {
  MotionCounts counts;
  counts.planes = int(scene.planes.size());
  counts.obstacles = int(scene.obstacles.size());
  counts.wind = scene.wind.has_value();
  counts.strengths = int(scene.forces.size());
  return counts;
}

SimulationOptions make_simulation(const Scene& scene, const Body& body, const Resolution& resolution,
                                  const MotionBlocks& blocks, const VectorX& theta, const SimulationOptions& settings) {
  SimulationOptions simulation = settings;
  simulation.is_static = scene.timing.is_static;
  simulation.times.assign(scene.timing.times.begin() + scene.timing.start_frame, scene.timing.times.end());
  const double gravity = std::max(blocks.gravity.vector(theta).norm(), 0.1);
  simulation.max_dt = default_time_step(body, gravity);
  simulation.scan_sags = scene.object.shape_is == ShapeIs::Static && !body.is_free_elsewhere();
  // What is held and touches nothing moves as smoothly as its frames show. Quadratic elements of what sags are dear.
  const double of_frame = simulation.scan_sags ? 0.125 : 0.1;
  const double longest = simulation.scan_sags ? std::numeric_limits<double>::infinity() : 2.5;  // times the default
  const std::vector<double>& times = simulation.times;
  if (scene.is_held() && !scene.is_touched() && times.size() > 1)
    simulation.max_dt *= std::clamp(
        of_frame * (times.back() - times.front()) / double(times.size() - 1) / simulation.max_dt, 1.0, longest);
  simulation.max_dt /= resolution.steps;
  simulation.blocks = blocks;
  simulation.contact = default_contact(body, theta[blocks.density] * body.volume(), gravity);
  simulation.friction_speed = default_friction_speed(body, gravity);
  for (const Weight& weight : scene.weights) simulation.weights.push_back({weight.at, weight.mass});
  if (const auto& weight = scene.initial.release_of; weight && scene.initial.released)
    simulation.released_weights.push_back({weight->at, weight->mass});
  simulation.pull_points = pull_points(scene, int(blocks.pulls.size()));
  simulation.shape = shape_field(scene, resolution);
  simulation.holds = holds_of(body, scene);
  add_loads(scene, simulation);
  add_obstacles(scene, body, theta, simulation);
  return simulation;
}

}  // namespace pliant
