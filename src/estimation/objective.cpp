#include "estimation/objective.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pliant {

double CostEvaluation::surface_rms() const {
  double sum = 0.0;
  long long count = 0;
  for (const FrameFit& f : frames) sum += f.sum_squares, count += f.points;
  return count > 0 ? std::sqrt(sum / double(count)) : 0.0;
}

double CostEvaluation::surface_median() const {
  std::vector<float> all;
  for (const FrameFit& f : frames) all.insert(all.end(), f.distances.begin(), f.distances.end());
  if (all.empty()) return 0.0;
  const auto middle = all.begin() + std::ptrdiff_t(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return double(*middle);
}

double CostEvaluation::track_rms() const {
  double sum = 0.0;
  long long count = 0;
  for (const FrameFit& f : frames) sum += f.track_sum_squares, count += f.tracks;
  return count > 0 ? std::sqrt(sum / double(count)) : 0.0;
}

double CostEvaluation::matched_fraction() const {
  long long matched = 0, count = 0;
  for (const FrameFit& f : frames) matched += f.matched, count += f.points;
  return count > 0 ? double(matched) / double(count) : 0.0;
}

double CostEvaluation::independent_observations() const {
  double count = 0.0;
  for (const FrameFit& f : frames) count += f.independent;
  return count;
}

CostEvaluation CostEvaluation::of_recording(int recording) const {
  CostEvaluation one;
  one.succeeded = succeeded, one.failure = failure;
  for (const FrameFit& f : frames)
    if (f.recording == recording) one.cost += f.cost, one.frames.push_back(f);
  return one;
}

/// One recording: its share of the cost, by its own theta.
class Objective::Part {
 public:
  Part(ObservedMotion motion, int number, int theta_offset)
      : motion_(std::move(motion)),
        number_(number),
        offset_(theta_offset),
        simulation_(motion_.body, motion_.simulation) {}

  int theta_size() const { return simulation_.theta_size(); }
  bool hold_shape(const VectorX& joint) { return simulation_.hold_shape(joint.segment(offset_, theta_size())).empty(); }

  CostEvaluation run(const VectorX& joint, const MatrixX& joint_directions);
  CostEvaluation gradient(const VectorX& joint, VectorX& joint_bar);

 private:
  /// The sensors' corrections at a theta, and how they change along directions.
  struct Sensors {
    std::vector<SensorCorrection> corrections;
    std::vector<MatrixX> changes;  // 7 x directions, of each
    bool correct = false, change = false;
  };
  Sensors sensors_at(const VectorX& theta, const MatrixX& directions) const;
  const Sensors& sensors() const { return sensors_; }
  double frame_weight(const FrameObservations& seen) const {
    return std::min(1.0, motion_.options.independent_points / double(seen.points.size()));
  }
  std::vector<SurfaceObservation> corrected(const std::vector<SurfaceObservation>& points) const;
  std::vector<TrackObservation> corrected(const std::vector<TrackObservation>& tracks) const;
  bool is_corrected(int sensor) const { return sensor < int(sensors_.corrections.size()); }
  int sensor_index(int sensor) const {
    return theta::sensor(sensor, motion_.simulation.planes, motion_.simulation.pulls);
  }

  FrameFit fit_frame(const FrameObservations& seen, const Points& positions, const std::vector<Points>& tangents) const;
  void fit_surface(const FrameObservations& seen, const Points& positions, const std::vector<Points>& tangents,
                   FrameFit& fit) const;
  void fit_tracks(const FrameObservations& seen, const Points& positions, const std::vector<Points>& tangents,
                  FrameFit& fit) const;
  /// Cotangents of positions and of the sensors' corrections for the cost of a frame.
  void add_cotangents(const FrameObservations& seen, const Points& positions, Points& x_bar, VectorX& theta_bar) const;

  ObservedMotion motion_;
  int number_, offset_;
  Simulation simulation_;
  Sensors sensors_;
};

Objective::Part::Sensors Objective::Part::sensors_at(const VectorX& theta, const MatrixX& directions) const {
  Sensors s;
  for (int k = 0; k < motion_.simulation.sensors; ++k) {
    const SensorCorrection::Values values = theta.segment<SensorCorrection::size>(sensor_index(k));
    s.corrections.emplace_back(motion_.mismatch.centre, values);
    s.changes.emplace_back(directions.middleRows(sensor_index(k), SensorCorrection::size));
    s.correct = s.correct || !values.isZero();
    s.change = s.change || !s.changes.back().isZero();
  }
  return s;
}

std::vector<SurfaceObservation> Objective::Part::corrected(const std::vector<SurfaceObservation>& points) const {
  std::vector<SurfaceObservation> moved = points;
  if (sensors_.correct)
    for (SurfaceObservation& o : moved)
      if (is_corrected(o.sensor)) o.position = sensors_.corrections[std::size_t(o.sensor)].apply(o.position, o.view);
  return moved;
}

std::vector<TrackObservation> Objective::Part::corrected(const std::vector<TrackObservation>& tracks) const {
  std::vector<TrackObservation> moved = tracks;
  if (sensors_.correct)
    for (TrackObservation& o : moved)
      if (is_corrected(o.sensor))
        o.position = sensors_.corrections[std::size_t(o.sensor)].apply(o.position, Vector3::Zero());
  return moved;
}

void Objective::Part::fit_surface(const FrameObservations& seen, const Points& positions,
                                  const std::vector<Points>& tangents, FrameFit& fit) const {
  const SurfaceConstraints& surface = *motion_.mismatch.surface;
  const double outlier_scale = motion_.options.outlier_scale;
  fit.points = int(seen.points.size());
  fit.independent += std::min(double(fit.points), motion_.options.independent_points);
  const auto matches = surface.match(corrected(seen.points), positions);
  const RobustLoss loss{outlier_scale};
  const double share = frame_weight(seen);
  MatrixX J(fit.points, Eigen::Index(tangents.size()));
  for (std::size_t c = 0; c < tangents.size(); ++c) J.col(Eigen::Index(c)) = surface.tangent(matches, tangents[c]);
  VectorX weight(fit.points), weighted(fit.points);
  fit.distances.assign(std::size_t(fit.points), float(outlier_scale));
  for (int i = 0; i < fit.points; ++i) {
    const SurfaceObservation& o = seen.points[std::size_t(i)];
    const double noise = o.noise, w = share / (noise * noise);
    const PointMatch& m = matches[std::size_t(i)];
    fit.sum_noise_squares += noise * noise;
    weight[i] = weighted[i] = 0.0;
    if (m.cell < 0) {
      fit.cost += w * loss.outlier();
      fit.sum_squares += outlier_scale * outlier_scale;
      continue;
    }
    ++fit.matched;
    fit.cost += w * loss.value(m.distance);
    const double true_distance = std::abs(m.distance) / m.stretch;
    fit.distances[std::size_t(i)] = float(std::min(true_distance, outlier_scale));
    fit.sum_squares += std::pow(std::min(true_distance, outlier_scale), 2);
    fit.max_distance = std::max(fit.max_distance, true_distance);
    weight[i] = w * loss.weight(m.distance);
    weighted[i] = weight[i] * m.distance;
    // A point that moves changes its distance as the object does that moves the other way.
    if (sensors_.change && is_corrected(o.sensor))
      J.row(i) -= m.direction.transpose() * sensors_.corrections[std::size_t(o.sensor)].jacobian(o.position, o.view) *
                  sensors_.changes[std::size_t(o.sensor)];
  }
  if (!tangents.empty()) {
    fit.gradient += J.transpose() * weighted;
    fit.gauss_newton += J.transpose() * weight.asDiagonal() * J;
  }
}

void Objective::Part::fit_tracks(const FrameObservations& seen, const Points& positions,
                                 const std::vector<Points>& tangents, FrameFit& fit) const {
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
  if (tangents.empty()) return;
  MatrixX J(weight.size(), Eigen::Index(tangents.size()));
  for (std::size_t c = 0; c < tangents.size(); ++c)
    J.col(Eigen::Index(c)) = flat(tracks.tangent(seen.tracks, tangents[c]));
  for (int i = 0; i < fit.tracks && sensors_.change; ++i) {
    const TrackObservation& o = seen.tracks[std::size_t(i)];
    if (is_corrected(o.sensor))
      J.middleRows<3>(3 * i) -= sensors_.corrections[std::size_t(o.sensor)].jacobian(o.position, Vector3::Zero()) *
                                sensors_.changes[std::size_t(o.sensor)];
  }
  fit.gradient += J.transpose() * weight.cwiseProduct(flat(r));
  fit.gauss_newton += J.transpose() * weight.asDiagonal() * J;
}

FrameFit Objective::Part::fit_frame(const FrameObservations& seen, const Points& positions,
                                    const std::vector<Points>& tangents) const {
  FrameFit fit;
  fit.recording = number_;
  fit.frame = seen.frame;
  const auto n = Eigen::Index(tangents.size());
  if (n > 0) {
    fit.gradient.setZero(n);
    fit.gauss_newton.setZero(n, n);
  }
  if (!seen.points.empty()) fit_surface(seen, positions, tangents, fit);
  if (!seen.tracks.empty()) fit_tracks(seen, positions, tangents, fit);
  return fit;
}

CostEvaluation Objective::Part::run(const VectorX& joint, const MatrixX& joint_directions) {
  const VectorX theta = joint.segment(offset_, theta_size());
  // Directions along which only other recordings change cost nothing.
  std::vector<Eigen::Index> columns;
  for (Eigen::Index c = 0; c < joint_directions.cols(); ++c)
    if (!joint_directions.col(c).segment(offset_, theta_size()).isZero(0.0)) columns.push_back(c);
  const MatrixX directions = joint_directions.middleRows(offset_, theta_size())(Eigen::all, columns);
  sensors_ = sensors_at(theta, directions);
  const auto& observations = *motion_.observations;
  CostEvaluation evaluation;
  std::vector<FrameFit> fits(observations.size());
  std::size_t next = 0;
  tbb::task_group beside;
  const int last_frame = motion_.options.last_frame;
  const RolloutSummary summary = simulation_.run(
      theta, directions, last_frame, [&](int frame, const State& state, std::span<const State> tangents) {
        if (next < observations.size() && observations[next].frame == frame) {
          std::vector<Points> changes;
          for (const State& t : tangents) changes.push_back(t.x);
          const std::size_t slot = next++;
          beside.run([this, &observations, &fits, slot, x = state.x, changes = std::move(changes)] {
            fits[slot] = fit_frame(observations[slot], x, changes);
          });
        }
        return frame < last_frame;
      });
  beside.wait();
  evaluation.steps = summary.steps;
  if (!summary.succeeded) return evaluation.failure = summary.failure, evaluation;
  fits.resize(next);
  const Eigen::Index n = joint_directions.cols();
  for (FrameFit& fit : fits) {
    evaluation.cost += fit.cost;
    if (n == 0) continue;
    VectorX gradient = VectorX::Zero(n);
    MatrixX matrix = MatrixX::Zero(n, n);
    if (!columns.empty()) gradient(columns) = fit.gradient, matrix(columns, columns) = fit.gauss_newton;
    fit.gradient = std::move(gradient), fit.gauss_newton = std::move(matrix);
  }
  evaluation.frames = std::move(fits);
  return evaluation.succeeded = true, evaluation;
}

void Objective::Part::add_cotangents(const FrameObservations& seen, const Points& positions, Points& x_bar,
                                     VectorX& theta_bar) const {
  const RobustLoss loss{motion_.options.outlier_scale};
  if (!seen.points.empty()) {
    const SurfaceConstraints& surface = *motion_.mismatch.surface;
    const auto matches = surface.match(corrected(seen.points), positions);
    VectorX bar = VectorX::Zero(Eigen::Index(matches.size()));
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const SurfaceObservation& o = seen.points[i];
      if (matches[i].cell < 0) continue;
      bar[Eigen::Index(i)] = frame_weight(seen) / (o.noise * o.noise) * loss.derivative(matches[i].distance);
      if (is_corrected(o.sensor))
        theta_bar.segment<SensorCorrection::size>(sensor_index(o.sensor)) -=
            bar[Eigen::Index(i)] *
            sensors_.corrections[std::size_t(o.sensor)].jacobian(o.position, o.view).transpose() * matches[i].direction;
    }
    x_bar += surface.adjoint(matches, bar);
  }
  if (!seen.tracks.empty()) {
    Points bar = motion_.mismatch.tracks->residuals(corrected(seen.tracks), positions);
    for (std::size_t i = 0; i < seen.tracks.size(); ++i) {
      const TrackObservation& o = seen.tracks[i];
      const auto row = Eigen::Index(i);
      bar.row(row) *= loss.weight(bar.row(row).norm()) / (o.noise * o.noise);
      if (is_corrected(o.sensor))
        theta_bar.segment<SensorCorrection::size>(sensor_index(o.sensor)) -=
            sensors_.corrections[std::size_t(o.sensor)].jacobian(o.position, Vector3::Zero()).transpose() *
            bar.row(row).transpose();
    }
    motion_.mismatch.tracks->add_adjoint(seen.tracks, bar, x_bar);
  }
}

CostEvaluation Objective::Part::gradient(const VectorX& joint, VectorX& joint_bar) {
  const VectorX theta = joint.segment(offset_, theta_size());
  sensors_ = sensors_at(theta, MatrixX(theta.size(), 0));
  const auto& observations = *motion_.observations;
  CostEvaluation evaluation;
  const auto seen_in = [&](int frame) -> const FrameObservations* {
    const auto it = std::lower_bound(observations.begin(), observations.end(), frame,
                                     [](const FrameObservations& o, int f) { return o.frame < f; });
    return it != observations.end() && it->frame == frame ? &*it : nullptr;
  };
  VectorX theta_bar, sensor_bar = VectorX::Zero(theta.size());
  const RolloutSummary summary = simulation_.run_adjoint(
      theta, motion_.options.last_frame,
      [&](int frame, const State& state) {
        if (const auto* seen = seen_in(frame)) evaluation.frames.push_back(fit_frame(*seen, state.x, {}));
        return true;
      },
      [&](int frame, const State& state, Points& x_bar) {
        if (const auto* seen = seen_in(frame)) add_cotangents(*seen, state.x, x_bar, sensor_bar);
      },
      theta_bar);
  evaluation.steps = summary.steps;
  if (!summary.succeeded) return evaluation.failure = summary.failure, evaluation;
  joint_bar.segment(offset_, theta_size()) = theta_bar + sensor_bar;
  for (const FrameFit& fit : evaluation.frames) evaluation.cost += fit.cost;
  return evaluation.succeeded = true, evaluation;
}

Objective::Objective(std::vector<ObservedMotion> recordings, ParameterSet parameters)
    : parameters_(std::move(parameters)) {
  int offset = 0;
  for (ObservedMotion& motion : recordings) {
    parts_.push_back(std::make_unique<Part>(std::move(motion), int(parts_.size()), offset));
    offset += parts_.back()->theta_size();
  }
  if (offset != int(parameters_.reference().size()))
    throw std::invalid_argument("theta is not as long as those of the recordings together");
}

Objective::Objective(Mismatch mismatch, std::shared_ptr<const Body> body, SimulationOptions simulation,
                     std::shared_ptr<const std::vector<FrameObservations>> observations, ParameterSet parameters,
                     ObjectiveOptions options)
    : Objective({{std::move(mismatch), std::move(body), std::move(simulation), std::move(observations), options}},
                std::move(parameters)) {}

Objective::~Objective() = default;
Objective::Objective(Objective&&) noexcept = default;

CostEvaluation Objective::sum(const VectorX& p, std::vector<CostEvaluation> parts, bool has_gradient,
                              bool has_matrix) const {
  CostEvaluation total;
  for (const CostEvaluation& part : parts) total.steps += part.steps;
  for (const CostEvaluation& part : parts)
    if (!part.succeeded) return total.failure = part.failure, total;
  MatrixX curvature;
  total.cost = parameters_.prior(p, &total.gradient, &curvature);
  if (has_matrix) total.gauss_newton = std::move(curvature);
  for (CostEvaluation& part : parts) {
    total.cost += part.cost;
    for (FrameFit& fit : part.frames) {
      if (has_matrix) total.gradient += fit.gradient, total.gauss_newton += fit.gauss_newton;
      total.frames.push_back(std::move(fit));
    }
  }
  if (!has_gradient) total.gradient.resize(0);
  total.succeeded = std::isfinite(total.cost);
  if (!total.succeeded) total.failure = "the cost is not finite";
  return total;
}

CostEvaluation Objective::run(const VectorX& p, bool with_tangents) {
  const VectorX theta = parameters_.to_theta(p);
  const MatrixX directions = with_tangents ? parameters_.jacobian(p) : MatrixX(theta.size(), 0);
  std::vector<CostEvaluation> parts(parts_.size());
  tbb::parallel_for(
      std::size_t(0), parts_.size(), [&](std::size_t i) { parts[i] = parts_[i]->run(theta, directions); },
      tbb::simple_partitioner());
  return sum(p, std::move(parts), with_tangents, with_tangents);
}

bool Objective::hold_shapes(const VectorX& p) {
  const VectorX theta = parameters_.to_theta(p);
  return std::ranges::all_of(parts_, [&](const auto& part) { return part->hold_shape(theta); });
}

CostEvaluation Objective::evaluate(const VectorX& p) { return run(p, false); }
CostEvaluation Objective::linearise(const VectorX& p) { return run(p, true); }

CostEvaluation Objective::gradient(const VectorX& p) {
  const VectorX theta = parameters_.to_theta(p);
  std::vector<CostEvaluation> parts(parts_.size());
  VectorX theta_bar = VectorX::Zero(theta.size());  // each part writes its own segment
  tbb::parallel_for(
      std::size_t(0), parts_.size(), [&](std::size_t i) { parts[i] = parts_[i]->gradient(theta, theta_bar); },
      tbb::simple_partitioner());
  CostEvaluation total = sum(p, std::move(parts), true, false);
  if (!total.succeeded) return total;
  total.gradient += parameters_.jacobian(p).transpose() * theta_bar;
  total.succeeded = total.gradient.allFinite();
  if (!total.succeeded) total.failure = "the gradient is not finite";
  return total;
}

}  // namespace pliant
