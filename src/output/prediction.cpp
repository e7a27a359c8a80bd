#include "output/prediction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>

#include "base/points.hpp"
#include "capture/observe.hpp"
#include "geometry/surface_distance.hpp"

namespace pliant {

namespace {

void set_distances(const std::vector<double>& distances, double size, LoadError& error) {
  error.points = int(distances.size());
  if (distances.empty()) return;
  error.mean = std::accumulate(distances.begin(), distances.end(), 0.0) / double(distances.size());
  error.max = std::ranges::max(distances);
  error.relative_mean = *error.mean / size;
  error.relative_max = *error.max / size;
}

/// @param predicted  one row a marker [m]
void compare_markers(const MarkerSet& seen, const Points& predicted, double size, LoadError& error) {
  std::vector<double> distances;
  double squares = 0.0, moved = 0.0;
  for (int m = 0; m < seen.marker_count(); ++m) {
    if (!seen.is_seen(0, m)) continue;
    distances.push_back((predicted.row(m) - seen.frames[0].row(m)).norm());
    squares += distances.back() * distances.back();
    moved = std::max(moved, (seen.frames[0].row(m) - seen.rest.row(m)).norm());
  }
  set_distances(distances, size, error);
  if (distances.empty()) return;
  error.marker_rms = std::sqrt(squares / double(distances.size()));
  error.marker_max = error.max;
  error.max_displacement = moved;
  if (moved > 0.0) error.relative_error = *error.marker_rms / moved;
}

/// What was seen of one load, ready to be compared with node positions.
class LoadComparison {
 public:
  LoadComparison(const Capture& capture, const Load& load, const Body& body) : size_(object_size(capture.scene)) {
    if (load.markers && load.markers_rest) {
      markers_ = read_marker_pair(*load.markers_rest, *load.markers);
      embedding_ = Embedding(body, to_vectors(markers_->rest));
      observed_ = "markers";
      return;
    }
    ObservedLoad observed = observe_load(capture, load);
    outliers_ = observed.outliers;
    points_ = std::move(observed.seen.points);
    surface_ = *capture.scene.object.surface;
    embedding_ = Embedding(body, surface_.vertices);
    const bool is_cloud = load.cloud.has_value(), is_depth = !load.images.empty();
    observed_ = is_cloud && is_depth ? "cloud and depth" : is_cloud ? "cloud" : "depth";
  }

  void compare(const Points& nodes, LoadError& error) {
    const Points predicted = embedding_.positions(nodes);
    error.observed = observed_;
    if (markers_) return compare_markers(*markers_, predicted, size_, error);
    surface_.vertices = to_vectors(predicted);
    error.outliers = outliers_;
    set_distances(distances_to_surface(surface_, points_), size_, error);
  }

 private:
  double size_;
  std::optional<MarkerSet> markers_;
  std::vector<Vector3> points_;
  TriangleMesh surface_;
  Embedding embedding_;
  std::string observed_;
  int outliers_ = 0;
};

}  // namespace

std::string taken_as_known(const Capture& capture) {
  const Scene& scene = capture.scene;
  std::vector<std::string> guesses;
  if (!scene.initial.known && !scene.initial.released && !scene.timing.is_static)
    guesses.emplace_back("the velocity at the start");
  if (std::ranges::any_of(scene.planes, [](const Plane& plane) { return !plane.known; }))
    guesses.emplace_back("where the ground lies");
  if (guesses.empty()) return "";
  const bool are_two = guesses.size() > 1;
  return guesses.front() + (are_two ? " and " + guesses.back() + " are" : " is") + " taken as the capture has " +
         (are_two ? "them" : "it") +
         ", though only roughly known; `pliant fit FITTED --hold-out CAPTURE` predicts a recording with what is not "
         "known of it estimated, and the material kept";
}

MarkerPrediction predict_markers(const Capture& capture, const CaptureScene& scene) {
  MarkerPrediction prediction;
  std::set<std::string> known;
  std::vector<Vector3> rest;
  for (const MarkerTrack& block : capture.markers) {
    const MarkerSet set = read_markers(block, capture.frame_count());
    for (const std::string& id : set.ids)
      if (!known.insert(id).second)
        throw InputError({{capture.file}, "two blocks [[markers]] share the id " + id, "ids that differ", ""});
    prediction.ids.insert(prediction.ids.end(), set.ids.begin(), set.ids.end());
    for (const Vector3& point : to_vectors(set.rest)) rest.push_back(point);
  }
  if (rest.empty()) throw InputError({{capture.file}, "the recording follows no markers", "a block [[markers]]", ""});
  const Discretisation& d = scene.discretisation;
  const Embedding embedding(*d.body, rest);
  prediction.frames.assign(std::size_t(capture.frame_count()),
                           Points::Constant(Eigen::Index(rest.size()), 3, std::numeric_limits<double>::quiet_NaN()));
  Simulation simulation(d.body, d.simulation);
  prediction.summary = simulation.run(scene.theta, [&](int frame, const State& state, auto) {
    prediction.frames[std::size_t(capture.scene.timing.start_frame) + std::size_t(frame)] =
        embedding.positions(state.x);
    return true;
  });
  return prediction;
}

std::vector<LoadError> predict_loads(const Capture& capture, const CaptureScene& scene) {
  std::vector<LoadError> errors;
  const Discretisation& d = scene.discretisation;
  for (std::size_t i = 0; i < capture.loads.size(); ++i) {
    const Load& load = capture.loads[i];
    LoadError error;
    error.name = "load " + std::to_string(i + 1);
    error.role = load.role;
    LoadComparison comparison(capture, load, *d.body);
    SimulationOptions options = d.simulation;
    options.is_static = true;
    options.times = {0.0};
    options.weights.push_back({load.at, load.mass});
    Simulation simulation(d.body, options);
    const RolloutSummary summary = simulation.run(scene.theta, [&](int, const State& state, auto) {
      comparison.compare(state.x, error);
      return true;
    });
    if (!summary.succeeded)
      error.failure = summary.failure;
    else if (!error.mean)
      error.failure = "nothing of the object was seen under this load";
    errors.push_back(std::move(error));
  }
  return errors;
}

std::string load_sentence(const LoadError& error) {
  const std::string name = error.name + " (" + error.role + "): ";
  if (!error.failure.empty()) return name + error.failure;
  const auto part = [](const char* word, double length, double relative) {
    return fmt::format("{} {:.3g} mm ({:.2f} % of the object's size)", word, 1e3 * length, 100.0 * relative);
  };
  std::string text = name + part("mean", *error.mean, *error.relative_mean) + ", " +
                     part("max", *error.max, *error.relative_max) +
                     fmt::format(", {} {}", error.points, error.observed == "markers" ? "markers" : "points");
  if (error.outliers > 0) text += fmt::format(", {} that stand alone left out", error.outliers);
  return text;
}

}  // namespace pliant
