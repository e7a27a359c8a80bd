#include "report/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace pliant {

namespace {

std::vector<Vector3> rows_of(const Points& points) {
  std::vector<Vector3> rows;
  for (Eigen::Index i = 0; i < points.rows(); ++i) rows.push_back(points.row(i).transpose());
  return rows;
}

StaticError static_error(const MarkerSet& seen, const Points& predicted) {
  StaticError error;
  double squares = 0.0, most = 0.0, moved = 0.0;
  int count = 0;
  for (int m = 0; m < seen.marker_count(); ++m) {
    if (!seen.is_seen(0, m)) continue;
    const double off = (predicted.row(m) - seen.frames[0].row(m)).norm();
    squares += off * off;
    most = std::max(most, off);
    moved = std::max(moved, (seen.frames[0].row(m) - seen.rest.row(m)).norm());
    ++count;
  }
  if (count == 0) return error;
  error.marker_rms = std::sqrt(squares / count);
  error.marker_max = most;
  error.max_displacement = moved;
  if (moved > 0.0) error.relative_error = *error.marker_rms / moved;
  return error;
}

}  // namespace

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
    for (const Vector3& point : rows_of(set.rest)) rest.push_back(point);
  }
  if (rest.empty()) throw InputError({{capture.file}, "the recording follows no markers", "a block [[markers]]", ""});
  const Discretisation& d = scene.discretisation;
  const Embedding embedding(*d.body, rest);
  prediction.frames.assign(std::size_t(capture.frame_count()),
                           Points::Constant(Eigen::Index(rest.size()), 3, std::numeric_limits<double>::quiet_NaN()));
  Simulation simulation(d.body, d.simulation);
  prediction.summary = simulation.run(scene.theta, [&](int frame, const State& state, auto) {
    prediction.frames[std::size_t(capture.start_frame + frame)] = embedding.positions(state.x);
    return true;
  });
  return prediction;
}

std::vector<StaticError> predict_loads(const Capture& capture, const CaptureScene& scene) {
  std::vector<StaticError> errors;
  const Discretisation& d = scene.discretisation;
  for (std::size_t i = 0; i < capture.loads.size(); ++i) {
    const Load& load = capture.loads[i];
    if (!load.markers || !load.markers_rest) continue;
    const MarkerSet seen = read_marker_pair(*load.markers_rest, *load.markers);
    const Embedding embedding(*d.body, rows_of(seen.rest));
    SimulationOptions options = d.simulation;
    options.is_static = true;
    options.times = {0.0};
    options.weights.push_back({load.at, load.mass});
    StaticError error;
    Simulation simulation(d.body, options);
    const RolloutSummary summary = simulation.run(scene.theta, [&](int, const State& state, auto) {
      error = static_error(seen, embedding.positions(state.x));
      return true;
    });
    if (!summary.succeeded) error = {};
    error.name = "load " + std::to_string(i + 1);
    error.role = load.role;
    errors.push_back(std::move(error));
  }
  return errors;
}

}  // namespace pliant
