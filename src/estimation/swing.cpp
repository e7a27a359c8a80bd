#include "estimation/swing.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/median.hpp"
#include "base/points.hpp"
#include "estimation/damped_sinusoid.hpp"

namespace pliant {

namespace {

/// Coordinate by coordinate the median: outliers hardly move it.
Vector3 middle(const Points& points) {
  Vector3 m;
  std::vector<double> values(std::size_t(points.rows()));
  for (int d = 0; d < 3; ++d) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = points(Eigen::Index(i), d);
    m[d] = median(values);
  }
  return m;
}

/// A point's path.
struct Path {
  std::vector<double> times;  // [s]
  std::vector<Vector3> points;

  VectorX along(const Vector3& direction) const {
    VectorX signal(Eigen::Index(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) signal[Eigen::Index(i)] = points[i].dot(direction);
    return signal;
  }
  /// Along which it goes farthest.
  Vector3 direction() const {
    Points centred = to_points(points);
    centred.rowwise() -= centred.colwise().mean().eval();
    const Matrix3 spread = centred.transpose() * centred;
    return Eigen::SelfAdjointEigenSolver<Matrix3>(spread).eigenvectors().col(2);
  }
};

std::optional<double> swing_of(const Path& path, const Vector3& direction) {
  if (path.times.size() < 8) return std::nullopt;
  const auto sinusoid = dominant_sinusoid(path.times, path.along(direction), resolvable_band(path.times));
  if (!sinusoid || !rejection_reason(*sinusoid, path.times.size()).empty()) return std::nullopt;
  return sinusoid->natural();
}

/// An outline's points where the object hangs: how far from the camera does not change its rhythm.
void add_outline(const OutlineObservation& outline, const Vector3& middle, std::vector<Vector3>& points) {
  const double depth = outline.camera.project(middle).z();
  for (const OutlinePoint& point : outline.points)
    points.push_back(outline.camera.unproject(point.pixel.x(), point.pixel.y(), depth));
}

/// @param centre  of the object at rest [m]
Path seen_path(const std::vector<FrameObservations>& seen, const std::vector<double>& times, const Vector3& centre) {
  constexpr std::size_t fewest = 10;
  Path path;
  for (const FrameObservations& frame : seen) {
    std::vector<Vector3> there;
    for (const SurfaceObservation& point : frame.points) there.push_back(point.position);
    for (const TrackObservation& point : frame.tracks) there.push_back(point.position);
    for (const OutlineObservation& outline : frame.outlines) add_outline(outline, centre, there);
    if (there.size() < fewest) continue;
    path.times.push_back(times[std::size_t(frame.frame)] + frame.after);
    path.points.push_back(middle(to_points(there)));
  }
  return path;
}

/// @param last  where to stop [s]
Path simulated_path(Simulation& simulation, const VectorX& theta, double last) {
  std::vector<Vector3> samples;
  for (const SurfacePoint& p : simulation.body().surface) samples.push_back(p.position);
  const Embedding surface(simulation.body(), samples);
  Path path;
  simulation.run(theta, [&](int frame, const State& state, auto) {
    path.times.push_back(simulation.options().times[std::size_t(frame)]);
    path.points.push_back(middle(surface.positions(state.x)));
    return path.times.back() < last;
  });
  return path;
}

struct TriedModulus {
  double modulus = 0.0, frequency_squared = 0.0;  // [Pa], angular [1/s^2]
};

/// By what the modulus is to be multiplied. Without weight the square goes with it; what stands is slowed down and what
/// hangs sped up by its weight, and a second simulation shows by how much: the square is a straight line of the
/// modulus.
double factor_to(double frequency_squared, const TriedModulus& now, const std::optional<TriedModulus>& before) {
  constexpr double most = 10.0;
  if (before) {
    const double slope = (now.frequency_squared - before->frequency_squared) / (now.modulus - before->modulus);
    const double factor = 1.0 + (frequency_squared - now.frequency_squared) / (slope * now.modulus);
    if (slope > 0.0 && factor > 1.0 / most && factor < most) return factor;
  }
  return frequency_squared / now.frequency_squared;
}

}  // namespace

std::optional<SwingStart> swing_start(Simulation& simulation, VectorX parameters,
                                      const std::vector<FrameObservations>& seen) {
  const Vector3 centre = simulation.body().scanned_positions().colwise().mean().transpose();
  const Path path = seen_path(seen, simulation.options().times, centre);
  if (path.points.empty()) return std::nullopt;
  const Vector3 direction = path.direction();
  const auto observed = swing_of(path, direction);
  if (!observed) return std::nullopt;
  constexpr int most_rounds = 6;
  constexpr double periods = 6.0;  // that are enough to tell a frequency by
  constexpr double near_enough = 1.05;
  const ParameterHandle modulus = simulation.options().blocks.youngs_moduli.front();
  const double last = path.times.front() + periods * 2.0 * std::numbers::pi / *observed;
  const auto until_then = std::ranges::count_if(path.times, [&](double time) { return time <= last; });
  std::optional<TriedModulus> before;
  for (int round = 0; round < most_rounds; ++round) {
    const Path moves = simulated_path(simulation, parameters, last);
    const auto simulated = swing_of(moves, direction);
    // Too slow or too fast to show in these frames: try a body that is stiffer, then one that is softer. One that
    // cannot hold itself up has to be stiffer. Where one that swung went before, the step from it was too long.
    const bool fails = int(moves.points.size()) < int(until_then);
    double ratio = before ? std::sqrt(before->modulus / parameters[modulus]) : fails ? 3.0 : round == 0 ? 10.0 : 0.1;
    if (simulated && !fails) {
      const TriedModulus now{parameters[modulus], *simulated * *simulated};
      ratio = factor_to(*observed * *observed, now, before);
      before = now;
    }
    simulation.options().blocks.scale_moduli(parameters, ratio);
    if (simulated && !fails && std::abs(std::log(ratio)) < std::log(near_enough))
      return SwingStart{parameters[modulus], *observed / (2.0 * std::numbers::pi)};
  }
  return std::nullopt;
}

}  // namespace pliant
