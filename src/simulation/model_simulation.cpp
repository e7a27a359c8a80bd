#include "simulation/model_simulation.hpp"

#include <algorithm>
#include <array>
#include <functional>

#include "base/error.hpp"
#include "base/points.hpp"
#include "simulation/law_table.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant {

namespace {

/// Parameters of a model's material in a scene.
VectorX model_theta(const Model& model, const Scene& scene, const Vector3& gravity, const MotionLayout& blocks) {
  VectorX theta = blocks.zero();
  for (std::size_t k = 0; k < blocks.pulls.size(); ++k) theta.segment<3>(blocks.pulls[k]) = scene.initial.pulls[k];
  blocks.set_moduli(theta, model.youngs_modulus);
  theta[blocks.poissons_ratio] = model.poissons_ratio;
  theta[blocks.mass_damping] = model.mass_damping;
  theta[blocks.stiffness_damping] = model.stiffness_damping;
  theta[blocks.density] = model.scene.object.density.value();
  theta.segment<3>(blocks.gravity) = gravity;
  theta.segment<3>(blocks.linear_velocity) = scene.initial.linear_velocity;
  theta.segment<3>(blocks.angular_velocity) = scene.initial.angular_velocity;
  set_obstacles(scene, blocks, theta);
  set_loads(scene, blocks, theta);
  return theta;
}

bool has_tetrahedra(const Model& model) {
  return model.volume.kind != VtuCell::Hexahedron && !model.volume.connectivity.empty();
}

/// The body of a model: tetrahedra from its volume mesh, hexahedra laid anew over the situation's surface; with each
/// element's modulus where the volume mesh has as many elements.
std::shared_ptr<const Body> body_of(const Model& model, const Scene& scene, const SignedDistance* distance) {
  const ModelVolume& volume = model.volume;
  Body body;
  if (!has_tetrahedra(model)) {
    body = make_body(hex_grid_of(scene, *distance, model.cell_size));
  } else {
    const auto points = std::size_t(corner_count(volume.kind));
    std::vector<std::array<int, 4>> tets;
    std::vector<std::array<int, 6>> mid_nodes;
    for (std::size_t i = 0; i < volume.connectivity.size(); i += points) {
      std::copy_n(volume.connectivity.begin() + std::ptrdiff_t(i), 4, tets.emplace_back().begin());
      if (points == 10)
        std::copy_n(volume.connectivity.begin() + std::ptrdiff_t(i) + 4, 6, mid_nodes.emplace_back().begin());
    }
    body = make_body(make_tet_mesh(volume.nodes, std::move(tets), std::move(mid_nodes)));
  }
  if (volume.youngs_modulus.size() == body.modulus.relative.size())
    for (std::size_t e = 0; e < volume.youngs_modulus.size(); ++e)
      body.modulus.relative[e] = volume.youngs_modulus[e] / model.youngs_modulus;
  return std::make_shared<Body>(std::move(body));
}

/// Eight straight elements in the place of each quadratic one, over the same nodes: one at each corner, and four about
/// the shortest diagonal of what is left.
TetMesh in_eight(const TetMesh& mesh) {
  // By corners 0 to 3 and mid nodes 4 to 9 of the edges 01 02 03 12 13 23; a diagonal, and the ring about it.
  constexpr std::array<std::array<int, 4>, 4> at_corners = {{{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}}};
  constexpr std::array<std::array<int, 6>, 3> diagonals = {
      {{4, 9, 5, 7, 8, 6}, {5, 8, 4, 6, 9, 7}, {6, 7, 4, 8, 9, 5}}};
  std::vector<std::array<int, 4>> tets;
  for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
    std::array<int, 10> nodes{};
    std::ranges::copy(mesh.tets[e], nodes.begin());
    std::ranges::copy(mesh.mid_nodes[e], nodes.begin() + 4);
    const auto at = [&](int local) { return mesh.nodes.row(nodes[std::size_t(local)]); };
    const auto add = [&](const std::array<int, 4>& local) {
      std::array<int, 4> tet{};
      for (std::size_t k = 0; k < 4; ++k) tet[k] = nodes[std::size_t(local[k])];
      const Vector3 a = at(local[1]) - at(local[0]), b = at(local[2]) - at(local[0]), c = at(local[3]) - at(local[0]);
      if (a.cross(b).dot(c) < 0.0) std::swap(tet[2], tet[3]);
      tets.push_back(tet);
    };
    for (const auto& corner : at_corners) add(corner);
    const auto shortest = std::ranges::min(
        diagonals, {}, [&](const std::array<int, 6>& d) { return (at(d[0]) - at(d[1])).squaredNorm(); });
    for (std::size_t k = 0; k < 4; ++k) add({shortest[0], shortest[1], shortest[2 + k], shortest[2 + (k + 1) % 4]});
  }
  return make_tet_mesh(mesh.nodes, std::move(tets));
}

/// Middles of a model's elements [m], one a row; none where there is no volume mesh.
Points element_middles(const ModelVolume& volume) {
  const auto points = std::size_t(corner_count(volume.kind));
  Points middles = Points::Zero(Eigen::Index(volume.connectivity.size() / points), 3);
  for (std::size_t i = 0; i < volume.connectivity.size(); ++i)
    middles.row(Eigen::Index(i / points)) += volume.nodes.row(volume.connectivity[i]) / double(points);
  return middles;
}

/// Tetrahedra laid anew over a model's surface, each with the modulus of the nearest of the model's elements.
/// @param cells  along the object's longest axis
std::shared_ptr<const Body> meshed_anew(const Model& model, ElementKind kind, double cells) {
  Scene scene = model.scene;
  if (!scene.object.surface)
    throw InputError({{},
                      "the model has no surface that could be meshed anew",
                      "a model with a surface",
                      "leave out the number of cells: its own elements are taken"});
  scene.object.volume.reset();
  const auto distance = scene_distance(scene, Resolution{}.band);
  std::vector<Vector3> no_points;
  Resolution resolution;
  resolution.element = kind;
  resolution.cells = cells;
  Body body = *make_body_of(scene, *distance, resolution, no_points);
  const ModelVolume& volume = model.volume;
  const Points middles = element_middles(volume);
  body.modulus = {};
  body.modulus.relative.assign(std::size_t(body.element_count()), 1.0);
  if (middles.rows() == 0 || volume.youngs_modulus.size() != std::size_t(middles.rows()) ||
      std::ranges::adjacent_find(volume.youngs_modulus, std::not_equal_to<>()) == volume.youngs_modulus.end())
    return std::make_shared<Body>(std::move(body));
  for (int e = 0; e < body.element_count(); ++e) {
    Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
    for (const int node : body.element(e)) middle += body.nodes.row(node) / double(body.element(e).size());
    Eigen::Index nearest = 0;
    (middles.rowwise() - middle).rowwise().squaredNorm().minCoeff(&nearest);
    body.modulus.relative[std::size_t(e)] = volume.youngs_modulus[std::size_t(nearest)] / model.youngs_modulus;
  }
  return std::make_shared<Body>(std::move(body));
}

/// Tetrahedra of a model as those of another order.
std::shared_ptr<const Body> of_kind(std::shared_ptr<const Body> own, ElementKind kind) {
  if (own->kind == kind) return own;
  const auto& mesh = std::get<TetMesh>(own->mesh);
  const bool is_split = kind == ElementKind::Tetrahedron;
  Body other = make_body(is_split ? in_eight(mesh) : with_mid_nodes(mesh));
  const std::size_t parts = is_split ? 8 : 1;
  for (std::size_t e = 0; e < other.modulus.relative.size(); ++e)
    other.modulus.relative[e] = own->modulus.relative[e / parts];
  return std::make_shared<Body>(std::move(other));
}

}  // namespace

std::shared_ptr<const Body> model_body(const Model& model, std::optional<ElementKind> kind,
                                       std::optional<double> cells) {
  const double own_cells = object_size(model.scene) / model.cell_size;
  if (cells) return meshed_anew(model, kind.value_or(ElementKind::QuadraticTetrahedron), *cells);
  // Quadratic tetrahedra whose nodes lie about as close as those of hexahedra.
  auto own = has_tetrahedra(model) ? body_of(model, model.scene, nullptr)
                                   : meshed_anew(model, ElementKind::QuadraticTetrahedron, 0.6 * own_cells);
  return kind ? of_kind(std::move(own), *kind) : own;
}

TriangleMesh surface_of(const Model& model, const Body& body) {
  if (model.scene.object.surface) return *model.scene.object.surface;
  const auto& mesh = std::get<TetMesh>(body.mesh);
  return {to_vectors(mesh.nodes), mesh.boundary};
}

ModelScene make_scene(const Model& model) {
  Scene situation = model.scene;
  if (situation.timing.times.empty()) situation.timing.is_static = true, situation.timing.times = {0.0};
  return make_scene(model, situation, scene_distance(situation, Resolution{}.band), {});
}

RolloutSummary simulate(const Model& model, const std::function<bool(double, const State&)>& on_frame) {
  const ModelScene scene = make_scene(model);
  return Simulation(scene.body, scene.simulation).run(scene.theta, [&](int frame, const State& state, auto) {
    return on_frame(scene.simulation.times[std::size_t(frame)], state);
  });
}

ModelScene make_scene(const Model& model, const Scene& situation, std::shared_ptr<const SignedDistance> distance,
                      const std::filesystem::path& file, bool has_wind) {
  Scene scene = situation;
  if (scene.initial.released && !scene.initial.release_of && scene.initial.pulls.empty()) {
    if (model.scene.initial.pulls.empty())
      throw InputError({{file},
                        "the object is released, and the model knows no pose before a release",
                        "the model of a fit to this recording",
                        "let `pliant fit --hold-out` find the pose and score the rest"});
    scene.initial.pulls = model.scene.initial.pulls;
    scene.initial.pulled_at = model.scene.initial.pulled_at;
  }
  const Vector3 gravity = scene.world.gravity.value_or(model.scene.world.gravity.value_or(-9.81 * scene.world.up));
  ModelScene made;
  MotionCounts counts = load_counts(scene);
  counts.wind = counts.wind || has_wind;
  counts.pulls = int(scene.initial.pulls.size());
  const MotionLayout blocks(counts);
  made.layout = blocks.layout();
  made.theta = model_theta(model, scene, gravity, blocks);
  SimulationOptions settings;
  settings.newmark_theta = model.newmark_theta;
  settings.material = model.material;
  Resolution resolution;
  resolution.cells = object_size(scene) / model.cell_size;
  resolution.pulls = int(scene.initial.pulls.size());
  made.body = body_of(model, scene, distance.get());
  made.distance = std::move(distance);
  if (model.law) settings.material.elastic = make_law(*model.law, made.body->element_count());
  resolution.element = made.body->kind;
  made.simulation = make_simulation(scene, *made.body, resolution, blocks, made.theta, settings);
  if (model.contact_stiffness > 0.0) made.simulation.contact = {model.contact_stiffness, model.contact_smoothing};
  const double frame_rate = model.scene.timing.frame_rate;
  if (frame_rate > 0.0) made.simulation.max_dt = 1.0 / (frame_rate * model.substeps) * (1.0 + 1e-9);
  return made;
}

}  // namespace pliant
