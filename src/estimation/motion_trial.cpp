#include "estimation/motion_trial.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/error.hpp"
#include "base/instants.hpp"
#include "base/parallel.hpp"
#include "base/profile.hpp"

namespace pliant {

/// The simulation, and how its frames are compared.
class MotionTrial::Comparison {
 public:
  Comparison(ObservedMotion motion, int number)
      : motion_(std::move(motion)),
        number_(number),
        instants_(instants_to_compare(motion_)),
        simulation_(motion_.body, with_times(motion_.simulation, instants_)) {
    const auto add = [this](std::vector<ParameterHandle>& blocks, const std::vector<ParameterHandle>& all) {
      blocks.insert(blocks.end(), all.begin(), all.end());
      for (const ParameterHandle& block : all)
        least_size_ = std::max(least_size_, Eigen::Index(block.first + block.size));
    };
    add(blocks_of_motion_, motion_.simulation.blocks.all());
    if (const LawLayout* law = motion_.simulation.material.law_layout()) add(blocks_of_motion_, law->all());
    for (const SensorBlocks& sensor : motion_.mismatch.sensors) add(blocks_of_sensors_, sensor.all());
  }

  const ObservedMotion& motion() const { return motion_; }
  int number() const { return number_; }
  double expected_work() const {
    const SimulationOptions& s = motion_.simulation;
    const double steps = s.is_static ? steps_of_an_equilibrium * double(instants_.size())
                                     : (instants_.back() - instants_.front()) / s.max_dt;
    return steps * motion_.body->node_count();
  }
  bool hold_shape(const VectorX& theta) { return simulation_.hold_shape(theta).empty(); }
  void begin_shape_from(const Comparison& other) { simulation_.begin_shape_from(other.simulation_); }

  CostEvaluation run(const VectorX& theta, const MatrixX& all_directions);
  /// @param theta_bar  out: the cost's derivative by theta
  CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar);

 private:
  /// The sensors' corrections and the planes that they see at a theta, and how both change along directions.
  struct Sensors {
    std::vector<SensorCorrection> corrections;
    std::vector<MatrixX> changes;                     // values x directions, of each
    std::vector<Eigen::Matrix<double, 6, 1>> planes;  // where they are: point and normal of each
    std::vector<MatrixX> plane_changes;               // 6 x directions, of each
    bool correct = false, change = false;
  };
  Sensors sensors_at(const VectorX& theta, const MatrixX& directions) const;
  const Sensors& sensors() const { return sensors_; }
  /// What each of so many points of a frame counts.
  double share_of(const FrameObservations& seen, std::size_t points) const {
    return std::min(1.0, independent_points(seen) / double(points));
  }
  double independent_points(const FrameObservations& seen) const {
    return seen.at_rest > 0 ? seen.at_rest * motion_.options.independent_points_at_rest
                            : motion_.options.independent_points;
  }
  std::vector<SurfaceObservation> corrected(const std::vector<SurfaceObservation>& points) const;
  std::vector<TrackObservation> corrected(const std::vector<TrackObservation>& tracks) const;
  OutlineObservation corrected(const OutlineObservation& outline) const;
  bool is_corrected(int sensor) const { return sensor < int(sensors_.corrections.size()); }
  const SensorBlocks& sensor_blocks(int sensor) const { return motion_.mismatch.sensors[std::size_t(sensor)]; }

  /// Residuals of a plane that was seen: the height of its point above the scene's plane, and the two tilts of its
  /// normal against that plane's, over their deviations; and their derivatives by the values of its sensor's correction
  /// and by the plane's point and normal.
  struct PlaneResidual {
    Vector3 value;
    Eigen::Matrix<double, 3, SensorCorrection::size> by_sensor;
    Eigen::Matrix<double, 3, 6> by_plane;
  };
  PlaneResidual plane_residual(const PlaneObservation& seen) const;

  /// How positions change along those of all directions that move the body; sensors alone change along the others.
  struct Tangents {
    Eigen::Index directions = 0;
    std::vector<Eigen::Index> along;  // which of them move it
    std::vector<Points> positions;    // one each
  };
  /// How far something that was seen is from the simulated surface, or from its contour, and where it was seen.
  struct Distance {
    bool is_matched;
    double value, stretch;  // [m]; value / stretch is the true distance
    Vector3 direction;      // d value = direction . d surface
    Vector3 point;          // as the sensor states it
    Sight sight;
    double noise;  // [m]
    int sensor;
  };
  static std::vector<Distance> distances_of(const std::vector<SurfaceObservation>& seen,
                                            const std::vector<PointMatch>& matches);
  std::vector<Distance> distances_of(const OutlineObservation& seen, const std::vector<OutlineMatch>& matches) const;
  /// @param share  what each counts
  /// @param J      their changes as the surface moves, one row each
  void add_distances(const std::vector<Distance>& distances, double share, MatrixX J, FrameFit& fit) const;
  /// Cotangents of the distances, and of their sensors' corrections.
  VectorX distance_bars(const std::vector<Distance>& distances, double share, VectorX& theta_bar) const;

  FrameFit fit_frame(const FrameObservations& seen, const Points& positions, const Tangents& tangents) const;
  void fit_surface(const FrameObservations& seen, const Points& positions, const Tangents& tangents,
                   FrameFit& fit) const;
  void fit_outlines(const FrameObservations& seen, const Points& positions, const Tangents& tangents,
                    FrameFit& fit) const;
  void fit_tracks(const FrameObservations& seen, const Points& positions, const Tangents& tangents,
                  FrameFit& fit) const;
  void fit_planes(const FrameObservations& seen, const Tangents& tangents, FrameFit& fit) const;
  /// Cotangents of positions and of the sensors' corrections for the cost of a frame.
  void add_cotangents(const FrameObservations& seen, const Points& positions, Points& x_bar, VectorX& theta_bar) const;

  /// Times of the frames up to the horizon, and of what sensors saw between them.
  static std::vector<double> instants_to_compare(const ObservedMotion& motion) {
    const std::vector<double>& frames = motion.simulation.times;
    const std::size_t count = std::min(frames.size(), std::size_t(motion.options.last_frame) + 1);
    std::vector<double> times(frames.begin(), frames.begin() + std::ptrdiff_t(count));
    for (const FrameObservations& seen : *motion.observations)
      if (seen.frame < int(count) && seen.after > 0.0) times.push_back(frames[std::size_t(seen.frame)] + seen.after);
    return motion.simulation.is_static ? times : instants_of(std::move(times));
  }
  static SimulationOptions with_times(SimulationOptions options, const std::vector<double>& times) {
    options.times = times;
    return options;
  }
  int last_instant() const { return int(instants_.size()) - 1; }
  void stop_if_interrupted() const {
    if (motion_.options.interrupted && motion_.options.interrupted()) throw Interrupted();
  }
  double work_of(const RolloutSummary& summary, double with_derivatives) const {
    const double steps = motion_.simulation.is_static ? steps_of_an_equilibrium : 1.0;
    return motion_.body->node_count() * steps * summary.steps * with_derivatives;
  }
  /// What was seen at an instant of the simulation; nothing where no sensor looked.
  const FrameObservations* seen_at(int instant) const {
    const std::vector<FrameObservations>& all = *motion_.observations;
    const std::vector<double>& frames = motion_.simulation.times;
    if (motion_.simulation.is_static) {
      const auto it = std::ranges::lower_bound(all, instant, {}, &FrameObservations::frame);
      return it != all.end() && it->frame == instant ? &*it : nullptr;
    }
    const double time = instants_[std::size_t(instant)];
    const auto time_of = [&](const FrameObservations& o) { return frames[std::size_t(o.frame)] + o.after; };
    const auto it = std::ranges::lower_bound(all, time - same_instant, {}, time_of);
    return it != all.end() && time_of(*it) <= time + same_instant ? &*it : nullptr;
  }

  void require_all_blocks(const VectorX& theta) const {
    if (theta.size() < least_size_)
      throw std::invalid_argument("the parameter vector is not of the layout that the motion's blocks are of");
  }

  ObservedMotion motion_;
  std::vector<ParameterHandle> blocks_of_motion_, blocks_of_sensors_;
  Eigen::Index least_size_ = 0;  // of a parameter vector that has them
  int number_;
  std::vector<double> instants_;  // [s] of the simulation
  Simulation simulation_;
  Sensors sensors_;
};

MotionTrial::Comparison::Sensors MotionTrial::Comparison::sensors_at(const VectorX& theta,
                                                                     const MatrixX& directions) const {
  Sensors s;
  for (const SensorBlocks& blocks : motion_.mismatch.sensors) {
    const SensorCorrection::Values values = blocks.values(theta);
    s.corrections.emplace_back(motion_.mismatch.centre, values);
    s.changes.push_back(blocks.rows(directions));
    s.correct = s.correct || !values.isZero();
    s.change = s.change || !s.changes.back().isZero();
  }
  for (const PlaneBlock& plane : motion_.simulation.blocks.planes) {
    s.planes.emplace_back(theta.segment<6>(plane.whole()));
    s.plane_changes.emplace_back(directions.middleRows<6>(plane.whole()));
  }
  return s;
}

std::vector<SurfaceObservation> MotionTrial::Comparison::corrected(
    const std::vector<SurfaceObservation>& points) const {
  std::vector<SurfaceObservation> moved = points;
  if (sensors_.correct)
    for (SurfaceObservation& o : moved)
      if (is_corrected(o.sensor)) o.position = sensors_.corrections[std::size_t(o.sensor)].apply(o.position, o.sight);
  return moved;
}

std::vector<TrackObservation> MotionTrial::Comparison::corrected(const std::vector<TrackObservation>& tracks) const {
  std::vector<TrackObservation> moved = tracks;
  if (sensors_.correct)
    for (TrackObservation& o : moved)
      if (is_corrected(o.sensor)) o.position = sensors_.corrections[std::size_t(o.sensor)].apply(o.position, {});
  return moved;
}

OutlineObservation MotionTrial::Comparison::corrected(const OutlineObservation& outline) const {
  if (!sensors_.correct || !is_corrected(outline.sensor)) return outline;
  return pliant::corrected(outline, sensors_.corrections[std::size_t(outline.sensor)]);
}

std::vector<MotionTrial::Comparison::Distance> MotionTrial::Comparison::distances_of(
    const std::vector<SurfaceObservation>& seen, const std::vector<PointMatch>& matches) {
  std::vector<Distance> all;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const SurfaceObservation& o = seen[i];
    const PointMatch& m = matches[i];
    all.push_back({m.cell >= 0, m.distance, m.stretch, m.direction, o.position, o.sight, o.noise, o.sensor});
  }
  return all;
}

std::vector<MotionTrial::Comparison::Distance> MotionTrial::Comparison::distances_of(
    const OutlineObservation& seen, const std::vector<OutlineMatch>& matches) const {
  const RigidMotion& pose = seen.camera.camera_to_world;
  const double error = is_corrected(seen.sensor) ? sensors_.corrections[std::size_t(seen.sensor)].error() : 0.0;
  std::vector<Distance> all;
  for (const OutlineMatch& m : matches) {
    const Vector3 outwards = pose.rotation * m.outwards;
    all.push_back({m.is_found, m.distance, 1.0, m.direction, pose(m.seen) + error * outwards, Sight{outwards},
                   seen.noise, seen.sensor});
  }
  return all;
}

void MotionTrial::Comparison::add_distances(const std::vector<Distance>& distances, double share, MatrixX J,
                                            FrameFit& fit) const {
  const double outlier_scale = motion_.options.outlier_scale;
  const RobustLoss loss{outlier_scale};
  const auto count = Eigen::Index(distances.size());
  VectorX weight = VectorX::Zero(count), weighted = VectorX::Zero(count);
  fit.points += int(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Distance& d = distances[std::size_t(i)];
    const double w = share / (d.noise * d.noise);
    fit.sum_noise_squares += d.noise * d.noise;
    fit.distances.push_back(float(outlier_scale));
    if (!d.is_matched) {
      fit.cost += w * loss.outlier();
      fit.sum_squares += outlier_scale * outlier_scale;
      continue;
    }
    ++fit.matched;
    fit.cost += w * loss.value(d.value);
    const double true_distance = std::abs(d.value) / d.stretch;
    fit.distances.back() = float(std::min(true_distance, outlier_scale));
    fit.sum_squares += std::pow(std::min(true_distance, outlier_scale), 2);
    fit.max_distance = std::max(fit.max_distance, true_distance);
    weight[i] = w * loss.weight(d.value);
    weighted[i] = weight[i] * d.value;
    // A point that moves changes its distance as the object does that moves the other way.
    if (sensors_.change && is_corrected(d.sensor))
      J.row(i) -= d.direction.transpose() * sensors_.corrections[std::size_t(d.sensor)].jacobian(d.point, d.sight) *
                  sensors_.changes[std::size_t(d.sensor)];
  }
  if (J.cols() > 0) {
    fit.gradient += J.transpose() * weighted;
    fit.gauss_newton += J.transpose() * weight.asDiagonal() * J;
  }
  if (!motion_.options.keeps_rows) return;
  VectorX residual = VectorX::Zero(count);
  for (Eigen::Index i = 0; i < count; ++i)
    if (distances[std::size_t(i)].is_matched) residual[i] = distances[std::size_t(i)].value;
  fit.rows.push_back({std::move(residual), std::move(weight), std::move(J)});
}

VectorX MotionTrial::Comparison::distance_bars(const std::vector<Distance>& distances, double share,
                                               VectorX& theta_bar) const {
  const RobustLoss loss{motion_.options.outlier_scale};
  VectorX bar = VectorX::Zero(Eigen::Index(distances.size()));
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const Distance& d = distances[i];
    if (!d.is_matched) continue;
    bar[Eigen::Index(i)] = share / (d.noise * d.noise) * loss.derivative(d.value);
    if (is_corrected(d.sensor))
      sensor_blocks(d.sensor).add(
          -bar[Eigen::Index(i)] * sensors_.corrections[std::size_t(d.sensor)].jacobian(d.point, d.sight).transpose() *
              d.direction,
          theta_bar);
  }
  return bar;
}

void MotionTrial::Comparison::fit_surface(const FrameObservations& seen, const Points& positions,
                                          const Tangents& tangents, FrameFit& fit) const {
  const SurfaceConstraints& surface = *motion_.mismatch.surface;
  fit.independent += std::min(double(seen.points.size()), independent_points(seen));
  const auto matches = surface.match(corrected(seen.points), positions);
  MatrixX J = MatrixX::Zero(Eigen::Index(matches.size()), tangents.directions);
  J(Eigen::all, tangents.along) = surface.tangents(matches, tangents.positions);
  add_distances(distances_of(seen.points, matches), share_of(seen, matches.size()), std::move(J), fit);
}

void MotionTrial::Comparison::fit_outlines(const FrameObservations& seen, const Points& positions,
                                           const Tangents& tangents, FrameFit& fit) const {
  const std::size_t count = seen.outline_points();
  const double squares_before = fit.sum_squares;
  fit.independent += std::min(double(count), independent_points(seen));
  fit.outlines = int(count);
  for (const OutlineObservation& outline : seen.outlines) {
    const auto matches = motion_.mismatch.outlines->match(corrected(outline), positions);
    MatrixX J = MatrixX::Zero(Eigen::Index(matches.size()), tangents.directions);
    J(Eigen::all, tangents.along) = motion_.mismatch.outlines->tangents(matches, tangents.positions);
    add_distances(distances_of(outline, matches), share_of(seen, count), std::move(J), fit);
  }
  fit.outline_sum_squares = fit.sum_squares - squares_before;
}

void MotionTrial::Comparison::fit_tracks(const FrameObservations& seen, const Points& positions,
                                         const Tangents& tangents, FrameFit& fit) const {
  const PointTracks& tracks = *motion_.mismatch.tracks;
  const double outlier_scale = motion_.options.outlier_scale;
  fit.tracks = int(seen.tracks.size());
  fit.independent += 3.0 * fit.tracks;
  const Points r = tracks.residuals(corrected(seen.tracks), positions);
  const RobustLoss loss{outlier_scale};
  VectorX weight(3 * r.rows());
  for (int i = 0; i < fit.tracks; ++i) {
    const double noise = seen.tracks[std::size_t(i)].noise, distance = r.row(i).norm(), w = 1.0 / (noise * noise);
    fit.cost += w * loss.value(distance);
    fit.track_sum_squares += std::pow(std::min(distance, outlier_scale), 2);
    weight.segment<3>(3 * i).setConstant(w * loss.weight(distance));
  }
  if (tangents.directions == 0) return;
  MatrixX J = MatrixX::Zero(weight.size(), tangents.directions);
  for (std::size_t c = 0; c < tangents.along.size(); ++c)
    J.col(tangents.along[c]) = flat(tracks.tangent(seen.tracks, tangents.positions[c]));
  for (int i = 0; i < fit.tracks && sensors_.change; ++i) {
    const TrackObservation& o = seen.tracks[std::size_t(i)];
    if (is_corrected(o.sensor))
      J.middleRows<3>(3 * i) -= sensors_.corrections[std::size_t(o.sensor)].jacobian(o.position, {}) *
                                sensors_.changes[std::size_t(o.sensor)];
  }
  fit.gradient += J.transpose() * weight.cwiseProduct(flat(r));
  fit.gauss_newton += J.transpose() * weight.asDiagonal() * J;
}

MotionTrial::Comparison::PlaneResidual MotionTrial::Comparison::plane_residual(const PlaneObservation& seen) const {
  const Eigen::Matrix<double, 6, 1>& there = sensors_.planes[std::size_t(seen.plane)];
  const Vector3 point = there.head<3>(), normal = there.tail<3>();
  const SensorCorrection& sensor = sensors_.corrections[std::size_t(seen.sensor)];
  const Vector3 at = sensor.apply(seen.point, seen.sight);
  // The normal turns as the way to a point one metre along it does; where ways off the axis grow, it turns to the axis.
  const Vector3 end = seen.point + seen.normal;
  Sight to_end = seen.sight;
  to_end.off_axis -= seen.normal_off_axis;
  const Vector3 turned = sensor.apply(end, to_end) - at;
  const SensorCorrection::Jacobian at_changes = sensor.jacobian(seen.point, seen.sight),
                                   turns = sensor.jacobian(end, to_end) - at_changes;
  Eigen::Matrix<double, 2, 3> across;
  across.row(0) = seen.normal.unitOrthogonal().transpose() / seen.tilt_std;
  across.row(1) = seen.normal.cross(seen.normal.unitOrthogonal()).transpose() / seen.tilt_std;
  PlaneResidual r;
  r.value << normal.dot(at - point) / seen.height_std, across * (turned - normal);
  r.by_sensor << normal.transpose() * at_changes / seen.height_std, across * turns;
  r.by_plane << -normal.transpose() / seen.height_std, (at - point).transpose() / seen.height_std,
      Eigen::Matrix<double, 2, 3>::Zero(), -across;
  return r;
}

void MotionTrial::Comparison::fit_planes(const FrameObservations& seen, const Tangents& tangents, FrameFit& fit) const {
  for (const PlaneObservation& o : seen.planes) {
    const PlaneResidual r = plane_residual(o);
    fit.cost += 0.5 * r.value.squaredNorm();
    fit.independent += 3.0;
    if (tangents.directions == 0) continue;
    const MatrixX J = r.by_sensor * sensors_.changes[std::size_t(o.sensor)] +
                      r.by_plane * sensors_.plane_changes[std::size_t(o.plane)];
    fit.gradient += J.transpose() * r.value;
    fit.gauss_newton += J.transpose() * J;
  }
}

FrameFit MotionTrial::Comparison::fit_frame(const FrameObservations& seen, const Points& positions,
                                            const Tangents& tangents) const {
  const Timed timed(Activity::Mismatch);
  FrameFit fit;
  fit.recording = number_;
  fit.frame = seen.frame;
  const Eigen::Index n = tangents.directions;
  if (n > 0) {
    fit.gradient.setZero(n);
    fit.gauss_newton.setZero(n, n);
  }
  if (!seen.points.empty()) fit_surface(seen, positions, tangents, fit);
  if (seen.outline_points() > 0) fit_outlines(seen, positions, tangents, fit);
  if (!seen.tracks.empty()) fit_tracks(seen, positions, tangents, fit);
  fit_planes(seen, tangents, fit);
  return fit;
}

CostEvaluation MotionTrial::Comparison::run(const VectorX& theta, const MatrixX& all_directions) {
  require_all_blocks(theta);
  // Directions along which only other recordings change cost nothing.
  std::vector<Eigen::Index> columns, along;
  for (Eigen::Index c = 0; c < all_directions.cols(); ++c) {
    const bool moves = changes_any(blocks_of_motion_, all_directions.col(c));
    if (moves) along.push_back(Eigen::Index(columns.size()));
    if (moves || changes_any(blocks_of_sensors_, all_directions.col(c))) columns.push_back(c);
  }
  const MatrixX directions = all_directions(Eigen::all, columns);
  sensors_ = sensors_at(theta, directions);
  CostEvaluation evaluation;
  std::vector<FrameFit> fits(motion_.observations->size());
  std::size_t next = 0;
  TaskGroup beside;
  const RolloutSummary summary =
      simulation_.run(theta, directions(Eigen::all, along), last_instant(),
                      [&](int instant, const State& state, std::span<const State> tangents) {
                        stop_if_interrupted();
                        if (const FrameObservations* seen = seen_at(instant)) {
                          Tangents changes{directions.cols(), along, {}};
                          for (const State& t : tangents) changes.positions.push_back(t.x);
                          const std::size_t slot = next++;
                          beside.run([this, seen, &fits, slot, x = state.x, changes = std::move(changes)] {
                            fits[slot] = fit_frame(*seen, x, changes);
                          });
                        }
                        return instant < last_instant();
                      });
  beside.wait();
  evaluation.steps = summary.steps;
  evaluation.work = work_of(summary, 1.0 + steps_of_a_tangent * double(along.size()));
  if (!summary.succeeded) return evaluation.failure = summary.failure, evaluation;
  fits.resize(next);
  const Eigen::Index n = all_directions.cols();
  for (FrameFit& fit : fits) {
    evaluation.cost += fit.cost;
    if (n == 0) continue;
    VectorX gradient = VectorX::Zero(n);
    MatrixX matrix = MatrixX::Zero(n, n);
    if (!columns.empty()) gradient(columns) = fit.gradient, matrix(columns, columns) = fit.gauss_newton;
    fit.gradient = std::move(gradient), fit.gauss_newton = std::move(matrix);
    for (ResidualRows& rows : fit.rows) {
      MatrixX J = MatrixX::Zero(rows.residual.size(), n);
      J(Eigen::all, columns) = rows.J;
      rows.J = std::move(J);
    }
  }
  evaluation.frames = std::move(fits);
  return evaluation.succeeded = true, evaluation;
}

void MotionTrial::Comparison::add_cotangents(const FrameObservations& seen, const Points& positions, Points& x_bar,
                                             VectorX& theta_bar) const {
  const Timed timed(Activity::Mismatch);
  const RobustLoss loss{motion_.options.outlier_scale};
  if (!seen.points.empty()) {
    const SurfaceConstraints& surface = *motion_.mismatch.surface;
    const auto matches = surface.match(corrected(seen.points), positions);
    x_bar += surface.adjoint(
        matches, distance_bars(distances_of(seen.points, matches), share_of(seen, matches.size()), theta_bar));
  }
  for (const OutlineObservation& outline : seen.outlines) {
    const auto matches = motion_.mismatch.outlines->match(corrected(outline), positions);
    motion_.mismatch.outlines->add_adjoint(
        matches, distance_bars(distances_of(outline, matches), share_of(seen, seen.outline_points()), theta_bar),
        x_bar);
  }
  if (!seen.tracks.empty()) {
    Points bar = motion_.mismatch.tracks->residuals(corrected(seen.tracks), positions);
    for (std::size_t i = 0; i < seen.tracks.size(); ++i) {
      const TrackObservation& o = seen.tracks[i];
      const auto row = Eigen::Index(i);
      bar.row(row) *= loss.weight(bar.row(row).norm()) / (o.noise * o.noise);
      if (is_corrected(o.sensor))
        sensor_blocks(o.sensor).add(-sensors_.corrections[std::size_t(o.sensor)].jacobian(o.position, {}).transpose() *
                                        bar.row(row).transpose(),
                                    theta_bar);
    }
    motion_.mismatch.tracks->add_adjoint(seen.tracks, bar, x_bar);
  }
  for (const PlaneObservation& o : seen.planes) {
    const PlaneResidual r = plane_residual(o);
    sensor_blocks(o.sensor).add(r.by_sensor.transpose() * r.value, theta_bar);
    theta_bar.segment<6>(motion_.simulation.blocks.planes[std::size_t(o.plane)].whole()) +=
        r.by_plane.transpose() * r.value;
  }
}

CostEvaluation MotionTrial::Comparison::gradient(const VectorX& theta, VectorX& theta_bar) {
  require_all_blocks(theta);
  sensors_ = sensors_at(theta, MatrixX(theta.size(), 0));
  CostEvaluation evaluation;
  VectorX sensor_bar = VectorX::Zero(theta.size());
  const RolloutSummary summary = simulation_.run_adjoint(
      theta, last_instant(),
      [&](int instant, const State& state) {
        stop_if_interrupted();
        if (const auto* seen = seen_at(instant)) evaluation.frames.push_back(fit_frame(*seen, state.x, {}));
        return true;
      },
      [&](int instant, const State& state, Points& x_bar) {
        if (const auto* seen = seen_at(instant)) add_cotangents(*seen, state.x, x_bar, sensor_bar);
      },
      theta_bar);
  evaluation.steps = summary.steps;
  evaluation.work = work_of(summary, 1.0 + steps_of_an_adjoint);
  if (!summary.succeeded) return evaluation.failure = summary.failure, evaluation;
  theta_bar += sensor_bar;
  for (const FrameFit& fit : evaluation.frames) evaluation.cost += fit.cost;
  return evaluation.succeeded = true, evaluation;
}

MotionTrial::MotionTrial(ObservedMotion motion, int number)
    : comparison_(std::make_unique<Comparison>(std::move(motion), number)) {}
MotionTrial::~MotionTrial() = default;

CostEvaluation MotionTrial::run(const VectorX& theta, const MatrixX& directions) {
  return comparison_->run(theta, directions);
}

CostEvaluation MotionTrial::gradient(const VectorX& theta, VectorX& theta_bar) {
  return comparison_->gradient(theta, theta_bar);
}

double MotionTrial::expected_work() const { return comparison_->expected_work(); }

bool MotionTrial::hold_shape(const VectorX& theta) { return comparison_->hold_shape(theta); }

std::unique_ptr<Trial> MotionTrial::anew() const {
  auto same = std::make_unique<MotionTrial>(comparison_->motion(), comparison_->number());
  same->comparison_->begin_shape_from(*comparison_);
  return same;
}

}  // namespace pliant
