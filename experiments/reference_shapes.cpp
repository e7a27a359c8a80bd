// Load-free shapes of objects that sag (Wang 2015, section 6.1 and table 2), as JSON on stdout.
//   pliant_reference_shapes [NAME=VALUE]...
// object=plant|beam|holder   see held_objects.hpp
// cell_size=L                of the tetrahedra of the known load-free shape [m]
// order=1|2                  of the tetrahedra
// youngs_modulus=E, poissons_ratio=nu
// task=recover|remesh|refuse
//   recover  the scan is the known shape's equilibrium, and the load-free shape is looked for on the scan's own mesh
//   remesh   the scan's surface is meshed anew, with tetrahedra of scan_cell_size=L [m]
//   refuse   as recover, but of a material that is softer by the factor softer=S: what it can carry is named
// schemes=NAME,NAME,...      pseudo_transient, virtual_force, newton
// max_iterations=N           of the schemes but pseudo_transient, tolerance=T of their residual
// virtual_step=S, virtual_damping=D
// picture=FILE               load-free shape and what it sags into in grey, the scan as dots (PNG)
//
// Distances are divided by the object's size, its longest edge; times are of one thread.

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "choices.hpp"
#include "held_objects.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/reference_shape.hpp"
#include "motion/simulation.hpp"
#include "report/picture.hpp"

namespace pliant {
namespace {

using nlohmann::json;

constexpr double density = 1000.0;  // [kg/m^3]
const MotionLayout layout;

const Choices standard_choices = {{"object", "beam"},
                                  {"cell_size", "0.02"},
                                  {"scan_cell_size", "0.025"},
                                  {"order", "2"},
                                  {"youngs_modulus", "1e6"},
                                  {"poissons_ratio", "0.4"},
                                  {"task", "recover"},
                                  {"softer", "30"},
                                  {"schemes", "pseudo_transient"},
                                  {"max_iterations", "1000"},
                                  {"tolerance", "1e-8"},
                                  {"virtual_step", "0.1"},
                                  {"virtual_damping", "2"},
                                  {"picture", ""}};

double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::vector<std::string> names(const std::string& list) {
  std::istringstream text(list);
  std::vector<std::string> out;
  for (std::string item; std::getline(text, item, ',');) out.push_back(item);
  return out;
}

double greatest_distance(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

/// Sags as a simulator lets it that knows nothing of a scan: from the nodes of `mesh`, some of them held.
Points sagged(const TetMesh& mesh, const std::vector<double>& mass, const std::vector<int>& held, const VectorX& theta,
              std::string& failure) {
  Body body = make_body(mesh);
  if (!mass.empty()) body.mass = mass;
  SimulationOptions options;
  options.times = {0.0};
  options.is_static = true;
  options.material.elastic = ElasticLaw::Corotated;
  options.blocks = layout;
  options.newton.tolerance = 1e-12;
  const Points nodes = body.nodes;
  const double close = 1e-9 * body.size();
  options.holds = {{[nodes, held, close](const Vector3& p) {
    return std::ranges::any_of(held, [&](int n) { return (nodes.row(n).transpose() - p).norm() < close; });
  }}};
  Simulation simulation(std::make_shared<Body>(std::move(body)), options);
  Points x;
  const RolloutSummary summary =
      simulation.run(theta, [&](int, const State& state, auto) { return x = state.x, true; });
  failure = summary.succeeded ? "" : summary.failure;
  return x;
}

TetMesh with_nodes(const TetMesh& mesh, const Points& nodes) { return make_tet_mesh(nodes, mesh.tets, mesh.mid_nodes); }

Points rows(const std::vector<Vector3>& points) {
  Points out(Eigen::Index(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) out.row(Eigen::Index(i)) = points[i].transpose();
  return out;
}

TriangleMesh moved(const TriangleMesh& surface, const Points& vertices) {
  TriangleMesh out = surface;
  for (std::size_t i = 0; i < out.vertices.size(); ++i) out.vertices[i] = vertices.row(Eigen::Index(i)).transpose();
  return out;
}

class Experiment {
 public:
  explicit Experiment(Choices choices) : choices_(std::move(choices)), object_(make_held_object(text("object"))) {
    theta_ = layout.zero();
    layout.set_moduli(theta_, real("youngs_modulus"));
    theta_[layout.poissons_ratio] = real("poissons_ratio");
    theta_[layout.density] = density;
    theta_.segment<3>(layout.gravity) = Vector3(0.0, -9.81, 0.0);
  }

  json run() {
    json report;
    for (const auto& [name, value] : choices_)
      if (name != "picture") report["choices"][name] = value;
    double load = 0.0;
    if (getloadavg(&load, 1) == 1) report["load_at_start"] = load;
    known_ = std::make_shared<Body>(make_body(mesh_of(object_.surface, real("cell_size"))));
    size_ = known_->size();
    const std::vector<int> held = held_nodes(*known_, {object_.held});
    double begin = processor_seconds();
    std::string failure;
    scan_ = sagged(std::get<TetMesh>(known_->mesh), {}, held, theta_, failure);
    if (!failure.empty()) throw std::runtime_error("the known shape does not sag: " + failure);
    report["size"] = size_;
    report["sag"] = greatest_distance(scan_, known_->nodes) / size_;
    report["sag_seconds"] = processor_seconds() - begin;
    const bool is_remeshed = text("task") == "remesh";
    if (is_remeshed)
      remesh();
    else
      keep_mesh();
    report["nodes"] = scanned_->node_count(), report["elements"] = scanned_->element_count();
    report["known_nodes"] = known_->node_count();
    for (const std::string& scheme : names(text("schemes"))) {
      json row = find(scheme);
      row["scheme"] = scheme;
      std::fprintf(stderr, "%s\n", row.dump().c_str());
      report["schemes"].push_back(std::move(row));
    }
    return report;
  }

 private:
  const std::string& text(const char* name) const { return choices_.at(name); }
  double real(const char* name) const { return std::stod(text(name)); }

  TetMesh mesh_of(const TriangleMesh& surface, double cell_size) const {
    TetMeshOptions options;
    options.cell_size = cell_size;
    options.quadratic = text("order") == "2";
    options.feature_angle_deg = object_.feature_angle_deg;
    return make_tet_mesh(surface, options);
  }

  /// The scan's nodes are those of the known shape, and so is its mass: the two problems are each other's inverse.
  void keep_mesh() {
    Body body = make_body(with_nodes(std::get<TetMesh>(known_->mesh), scan_));
    body.mass = known_->mass;
    scanned_ = std::make_shared<Body>(std::move(body));
    held_ = held_nodes(*known_, {object_.held});
    weighed_ = theta_;
  }

  /// Of the known shape only the scan's surface is taken, and the mass as a balance tells it.
  void remesh() {
    scan_surface_ = Embedding(*known_, object_.surface.vertices).positions(scan_);
    const TetMesh mesh = mesh_of(moved(object_.surface, scan_surface_), real("scan_cell_size"));
    scanned_ = std::make_shared<Body>(make_body(mesh));
    held_ = held_nodes(*scanned_, {object_.held});
    weighed_ = theta_;
    weighed_[layout.density] *= known_->volume() / scanned_->volume();
  }

  json find(const std::string& name) {
    ReferenceShapeOptions options;
    options.scheme = name == "virtual_force" ? ReferenceScheme::VirtualForce
                     : name == "newton"      ? ReferenceScheme::Newton
                                             : ReferenceScheme::PseudoTransient;
    if (name != "pseudo_transient" && name != "virtual_force" && name != "newton")
      throw std::invalid_argument("\"" + name + "\" is not a scheme; see experiments/reference_shapes.cpp");
    if (options.scheme != ReferenceScheme::PseudoTransient) {
      options.max_iterations = int(real("max_iterations"));
      options.tolerance = real("tolerance");
    }
    options.virtual_step = real("virtual_step"), options.virtual_damping = real("virtual_damping");
    const Points load = scan_load(*scanned_, layout, weighed_, {});
    VectorX theta = weighed_;
    if (text("task") == "refuse") layout.scale_moduli(theta, 1.0 / real("softer"));
    double begin = processor_seconds();
    ReferenceShapeSolver solver(scanned_, held_, Material{ElasticLaw::Corotated}, layout, options);
    const ReferenceShape shape = solver.find(theta, load);
    json row = {{"found", shape.found},
                {"residual", shape.residual},
                {"iterations", shape.iterations},
                {"least_volume_ratio", shape.least_volume_ratio},
                {"seconds", processor_seconds() - begin}};
    if (!shape.found) {
      row["reason"] = shape.reason;
      if (shape.carried > 0.0) row["least_youngs_modulus"] = check_least(solver, theta, load, shape.carried);
      return row;
    }
    judge(shape.X, theta, row);
    return row;
  }

  /// What is named as the smallest modulus that carries the load, and whether it and a slightly smaller one do.
  json check_least(ReferenceShapeSolver& solver, const VectorX& theta, const Points& load, double carried) const {
    json row = {{"named", theta[layout.youngs_moduli[0]] / carried}};
    for (const double share : {0.95, 1.0}) {
      VectorX near = theta;
      layout.scale_moduli(near, share / carried);
      const double begin = processor_seconds();
      const ReferenceShape shape = solver.find(near, load);
      row["near"].push_back({{"share", share}, {"found", shape.found}, {"seconds", processor_seconds() - begin}});
    }
    return row;
  }

  void judge(const Points& X, const VectorX& theta, json& row) {
    const Points& scan = scanned_->scanned_positions();
    const double begin = processor_seconds();
    std::string failure;
    const Points again =
        sagged(with_nodes(std::get<TetMesh>(scanned_->mesh), X), scanned_->mass, held_, theta, failure);
    row["re_sag_seconds"] = processor_seconds() - begin;
    if (failure.empty())
      row["static_error"] = greatest_distance(again, scan) / size_;
    else
      row["re_sag_failure"] = failure;
    Points free_surface, again_surface, scan_surface;
    if (text("task") == "remesh") {
      const Embedding surface(*scanned_, scan_rows());
      free_surface = surface.positions(X);
      scan_surface = scan_surface_;
      again_surface = failure.empty() ? surface.positions(again) : scan_surface;
      compare_surfaces(free_surface, row);
    } else {
      row["known_error"] = greatest_distance(X, known_->nodes) / size_;
      const Embedding surface(*known_, object_.surface.vertices);
      free_surface = surface.positions(X);
      scan_surface = surface.positions(scan);
      again_surface = failure.empty() ? surface.positions(again) : scan_surface;
    }
    if (!text("picture").empty()) draw_overlay(free_surface, again_surface, scan_surface);
  }

  std::vector<Vector3> scan_rows() const {
    std::vector<Vector3> points;
    for (Eigen::Index v = 0; v < scan_surface_.rows(); ++v) points.emplace_back(scan_surface_.row(v).transpose());
    return points;
  }

  /// Of the vertices of the load-free surface that was found from where they belong, and from the known surface; and of
  /// the scan from it, which is the error of taking the scan for load-free.
  void compare_surfaces(const Points& free_surface, json& row) const {
    const Points known = rows(object_.surface.vertices);
    const auto rms = [&](const VectorX& distances) {
      return std::sqrt(distances.squaredNorm() / double(distances.size())) / size_;
    };
    const VectorX apart = (free_surface - known).rowwise().norm();
    const SignedDistance distance = signed_distance(object_.surface, 0.004 * size_, 0.1 * size_);
    VectorX from_surface(free_surface.rows());
    for (Eigen::Index v = 0; v < free_surface.rows(); ++v)
      from_surface[v] = distance.value(free_surface.row(v).transpose());
    row["vertices"] = {{"rms", rms(apart)}, {"greatest", apart.maxCoeff() / size_}};
    row["surface"] = {{"rms", rms(from_surface)}, {"greatest", from_surface.cwiseAbs().maxCoeff() / size_}};
    const VectorX sag = (scan_surface_ - known).rowwise().norm();
    row["scan_taken_for_load_free"] = {{"rms", rms(sag)}, {"greatest", sag.maxCoeff() / size_}};
  }

  void draw_overlay(const Points& free_surface, const Points& again, const Points& scan) const {
    PictureScene scene;
    scene.surface.resize(free_surface.rows() + again.rows(), 3);
    scene.surface << free_surface, again;
    const int shift = int(free_surface.rows());
    for (const auto& t : object_.surface.triangles) {
      scene.triangles.push_back(t);
      scene.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    }
    for (Eigen::Index v = 0; v < scan.rows(); ++v) scene.points.emplace_back(scan.row(v).transpose());
    Box box;
    for (Eigen::Index v = 0; v < scene.surface.rows(); ++v) box.extend(scene.surface.row(v).transpose());
    write_png(text("picture"), draw(scene, view_of(box, Vector3::UnitY(), 900, 640, 0.6, 0.15)));
  }

  Choices choices_;
  HeldObject object_;
  VectorX theta_, weighed_;  // of the known shape; the scan's, of the same mass
  std::shared_ptr<const Body> known_, scanned_;
  Points scan_, scan_surface_;
  std::vector<int> held_;  // of the scanned body
  double size_ = 0.0;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Experiment>("pliant_reference_shapes", argc, argv, pliant::standard_choices);
}
