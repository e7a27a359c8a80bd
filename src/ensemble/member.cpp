#include "ensemble/member.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/points.hpp"
#include "base/types.hpp"
#include "elasticity/body_fields.hpp"
#include "simulation/small_motions.hpp"

namespace pliant {

namespace {

constexpr double far_away = 0.1;  // of a point from the object's box, times the object's size

/// What is told of every member, before what is told of points: the order of `Telling::outputs`.
const std::vector<EnsembleQuantity> common_outputs = {{"first_frequency", "Hz"},
                                                      {"greatest_displacement", "m"},
                                                      {"greatest_displacement_time", "s"},
                                                      {"furthest_x", "m"},
                                                      {"furthest_y", "m"},
                                                      {"furthest_z", "m"},
                                                      {"end_displacement", "m"},
                                                      {"lowest_x", "m"},
                                                      {"lowest_y", "m"},
                                                      {"lowest_z", "m"},
                                                      {"lowest_time", "s"},
                                                      {"peak_strain", "1"}};

/// The greatest strain of all elements [-].
/// @param elasticity  of the body, with its parameters set; it is left linearised about `positions`
double peak_strain(const Body& body, Elasticity& elasticity, const Points& positions) {
  elasticity.linearise(positions);
  double most = 0.0;
  for (int e = 0; e < body.element_count(); ++e) most = std::max(most, greatest_strain(elasticity.rotation(e).S));
  return most;
}

Points rest_of(const Embedding& points, const Body& body) { return points.positions(body.reference_positions()); }

void check_points(const MarkerPositions& points, const TriangleMesh& surface, const std::filesystem::path& file) {
  const Box object = bounding_box(surface);
  const Box about = grown(object, far_away * object.extent().maxCoeff());
  std::vector<Problem> problems;
  for (std::size_t i = 0; i < points.ids.size(); ++i) {
    const Vector3 p = points.positions.row(Eigen::Index(i)).transpose();
    if ((p.array() < about.min.array()).any() || (p.array() > about.max.array()).any())
      problems.push_back({{file},
                          "point \"" + points.ids[i] + "\" lies far from the object",
                          "points of the object at rest [m], in the model's world",
                          "is the file in another unit, or of another pose?"});
  }
  if (!problems.empty()) throw InputError(std::move(problems));
}

}  // namespace

/// Gathers what is told of one member, frame by frame.
class EnsembleScene::Telling {
 public:
  Telling(const EnsembleScene& scene, MemberRecord& record) : scene_(scene), record_(record) {}

  /// @param strain  the greatest of all elements [-]
  void add(double time, const State& state, double strain) {
    const Points vertices = scene_.vertices_.positions(state.x);
    Eigen::Index far = 0, low = 0;
    const double displacement = greatest(vertices, scene_.rest_vertices_, far);
    const double height = (vertices * scene_.up_).minCoeff(&low);
    if (!(displacement <= displacement_))
      displacement_ = displacement, displacement_time_ = time, furthest_ = vertices.row(far).transpose();
    if (!(height >= height_)) height_ = height, lowest_time_ = time, lowest_ = vertices.row(low).transpose();
    strain_ = std::max(strain_, strain);
    last_displacement_ = displacement;
    for (const double value : {displacement, height, strain}) record_.series.push_back(float(value));
    if (scene_.question_.keeps_surface) keep(vertices);
    add_points(state);
  }

  /// The numbers of all frames together, after the first frequency.
  void finish(double first_frequency) {
    std::vector<double>& out = record_.outputs;
    out = {first_frequency,    displacement_, displacement_time_, furthest_.x(), furthest_.y(), furthest_.z(),
           last_displacement_, lowest_.x(),   lowest_.y(),        lowest_.z(),   lowest_time_,  strain_};
    for (Eigen::Index i = 0; i < points_.rows(); ++i) {
      for (Eigen::Index k = 0; k < 3; ++k) out.push_back(points_(i, k));
      out.push_back(point_displacements_[std::size_t(i)]);
    }
  }

 private:
  static double greatest(const Points& positions, const Points& rest, Eigen::Index& at) {
    return std::sqrt((positions - rest).rowwise().squaredNorm().maxCoeff(&at));
  }
  void keep(const Points& positions) {
    for (Eigen::Index i = 0; i < positions.rows(); ++i)
      for (Eigen::Index k = 0; k < 3; ++k) record_.positions.push_back(float(positions(i, k)));
  }
  void add_points(const State& state) {
    points_ = scene_.points_.positions(state.x);
    keep(points_);
    point_displacements_.resize(std::size_t(points_.rows()), 0.0);
    for (Eigen::Index i = 0; i < points_.rows(); ++i) {
      double& most = point_displacements_[std::size_t(i)];
      most = std::max(most, (points_.row(i) - scene_.rest_points_.row(i)).norm());
    }
  }

  const EnsembleScene& scene_;
  MemberRecord& record_;
  double displacement_ = not_a_number, displacement_time_ = 0.0, last_displacement_ = 0.0;
  double height_ = not_a_number, lowest_time_ = 0.0, strain_ = 0.0;
  Vector3 furthest_, lowest_;
  Points points_;
  std::vector<double> point_displacements_;
};

EnsembleScene::EnsembleScene(const Model& model, EnsembleQuestion question, const std::filesystem::path& points_file)
    : question_(std::move(question)), up_(model.scene.world.up), outputs_(common_outputs) {
  if (model.law)
    throw InputError({{},
                      "the model has a material law of its own (`" + model.law->name + "`)",
                      "a model of Young's modulus and Poisson's ratio, which are what its members differ by",
                      "fit the recording without `material`"});
  scene_ = make_scene(model);
  elastic_ = elastic_alone(scene_.simulation);
  surface_ = surface_of(model, *scene_.body);
  check_points(question_.points, surface_, points_file);
  vertices_ = Embedding(*scene_.body, surface_.vertices);
  points_ = Embedding(*scene_.body, to_vectors(question_.points.positions));
  rest_vertices_ = rest_of(vertices_, *scene_.body), rest_points_ = rest_of(points_, *scene_.body);
  for (const std::string& id : question_.points.ids) {
    for (const char* axis : {"x@", "y@", "z@"}) outputs_.push_back({axis + id, "m"});
    outputs_.push_back({"greatest_displacement@" + id, "m"});
  }
}

const std::vector<EnsembleQuantity>& EnsembleScene::series() {
  static const std::vector<EnsembleQuantity> all = {
      {"greatest_displacement", "m"}, {"lowest_height", "m"}, {"peak_strain", "1"}};
  return all;
}

RecordShape EnsembleScene::shape() const {
  const int vertices = question_.keeps_surface ? int(surface_.vertices.size()) : 0;
  return {int(outputs_.size()), int(series().size()), int(scene_.simulation.times.size()),
          vertices + int(question_.points.ids.size())};
}

std::vector<double> EnsembleScene::times() const {
  std::vector<double> times = scene_.simulation.times;
  for (double& time : times) time -= scene_.simulation.times.front();
  return times;
}

double EnsembleScene::first_frequency(const VectorX& theta) const {
  try {
    return small_motions(scene_.body, elastic_, theta, scene_.body->nodes, 1).frequencies.front();
  } catch (const InputError&) {
    return not_a_number;  // of a body that is not held as a whole
  }
}

MemberRecord EnsembleScene::simulate(const DrawnMaterial& material, const std::function<bool()>& interrupted) const {
  const RecordShape kept = shape();
  MemberRecord record;
  record.series.reserve(kept.frame_series()), record.positions.reserve(kept.frame_points());
  const std::vector<double> instants = times();
  const MotionBlocks& at = scene_.simulation.blocks;
  VectorX theta = scene_.theta;
  at.set_moduli(theta, material.youngs_modulus);
  theta[at.poissons_ratio] = material.poissons_ratio;
  theta[at.mass_damping] = material.mass_damping, theta[at.stiffness_damping] = material.stiffness_damping;
  try {
    const auto elasticity = scene_elasticity(scene_.body, scene_.simulation);
    elasticity->set_parameters(theta);
    Telling telling(*this, record);
    Simulation simulation(scene_.body, scene_.simulation);
    const RolloutSummary summary = simulation.run(theta, [&](int frame, const State& state, auto) {
      telling.add(instants[std::size_t(frame)], state, peak_strain(*scene_.body, *elasticity, state.x));
      if (interrupted && interrupted()) throw Interrupted();
      return true;
    });
    if (!summary.succeeded)
      return failed_record(kept, "stopped in frame " + std::to_string(summary.frames) + ": " + summary.failure);
    telling.finish(first_frequency(theta));
    record.state = MemberRecord::State::Simulated;
    return record;
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    return failed_record(kept, error.what());
  }
}

}  // namespace pliant
