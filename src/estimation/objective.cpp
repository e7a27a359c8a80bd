#include "estimation/objective.hpp"

#include <tbb/task_group.h>

#include <algorithm>
#include <cmath>

namespace pliant {

double CostEvaluation::surface_rms() const {
  double sum = 0.0;
  long long count = 0;
  for (const FrameFit& f : frames) sum += f.sum_squares, count += f.points;
  return count > 0 ? std::sqrt(sum / double(count)) : 0.0;
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

Objective::Objective(Mismatch mismatch, std::shared_ptr<const Body> body, SimulationOptions simulation,
                     std::shared_ptr<const std::vector<FrameObservations>> observations, ParameterSet parameters,
                     ObjectiveOptions options)
    : mismatch_(std::move(mismatch)),
      observations_(std::move(observations)),
      parameters_(std::move(parameters)),
      options_(options),
      simulation_(std::move(body), std::move(simulation)) {}

double Objective::frame_weight(const FrameObservations& seen) const {
  const double count = double(seen.points.size());
  return std::min(1.0, options_.independent_points / count);
}

void Objective::fit_surface(const FrameObservations& seen, const Points& positions, const std::vector<Points>& tangents,
                            FrameFit& fit) const {
  fit.points = int(seen.points.size());
  const auto matches = mismatch_.surface->match(seen.points, positions);
  const RobustLoss loss{options_.outlier_scale};
  const double share = frame_weight(seen);
  MatrixX J(fit.points, Eigen::Index(tangents.size()));
  for (std::size_t c = 0; c < tangents.size(); ++c)
    J.col(Eigen::Index(c)) = mismatch_.surface->tangent(matches, tangents[c]);
  VectorX weight(fit.points), weighted(fit.points);
  for (int i = 0; i < fit.points; ++i) {
    const double noise = seen.points[i].noise, w = share / (noise * noise);
    const PointMatch& m = matches[i];
    fit.sum_noise_squares += noise * noise;
    weight[i] = weighted[i] = 0.0;
    if (m.cell < 0) {
      fit.cost += w * loss.outlier();
      fit.sum_squares += options_.outlier_scale * options_.outlier_scale;
      continue;
    }
    ++fit.matched;
    fit.cost += w * loss.value(m.distance);
    const double true_distance = std::abs(m.distance) / m.stretch;
    fit.sum_squares += std::pow(std::min(true_distance, options_.outlier_scale), 2);
    fit.max_distance = std::max(fit.max_distance, true_distance);
    weight[i] = w * loss.weight(m.distance);
    weighted[i] = weight[i] * m.distance;
  }
  if (!tangents.empty()) {
    fit.gradient += J.transpose() * weighted;
    fit.gauss_newton += J.transpose() * weight.asDiagonal() * J;
  }
}

void Objective::fit_tracks(const FrameObservations& seen, const Points& positions, const std::vector<Points>& tangents,
                           FrameFit& fit) const {
  fit.tracks = int(seen.tracks.size());
  const Points r = mismatch_.tracks->residuals(seen.tracks, positions);
  const RobustLoss loss{options_.outlier_scale};
  VectorX weight(3 * r.rows());
  for (int i = 0; i < fit.tracks; ++i) {
    const double distance = r.row(i).norm(), w = 1.0 / (seen.tracks[i].noise * seen.tracks[i].noise);
    fit.cost += w * loss.value(distance);
    fit.track_sum_squares += std::pow(std::min(distance, options_.outlier_scale), 2);
    weight.segment<3>(3 * i).setConstant(w * loss.weight(distance));
  }
  if (tangents.empty()) return;
  MatrixX J(weight.size(), Eigen::Index(tangents.size()));
  for (std::size_t c = 0; c < tangents.size(); ++c)
    J.col(Eigen::Index(c)) = flat(mismatch_.tracks->tangent(seen.tracks, tangents[c]));
  fit.gradient += J.transpose() * weight.cwiseProduct(flat(r));
  fit.gauss_newton += J.transpose() * weight.asDiagonal() * J;
}

FrameFit Objective::fit_frame(const FrameObservations& seen, const Points& positions,
                              const std::vector<Points>& tangents) const {
  FrameFit fit;
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

CostEvaluation Objective::run(const VectorX& p, bool with_tangents) {
  const VectorX theta = parameters_.to_theta(p);
  const MatrixX directions = with_tangents ? parameters_.jacobian(p) : MatrixX(theta.size(), 0);
  const auto& observations = *observations_;
  CostEvaluation evaluation;
  std::vector<FrameFit> fits(observations.size());
  std::size_t next = 0;
  tbb::task_group beside;
  const RolloutSummary summary = simulation_.run(
      theta, directions, options_.last_frame, [&](int frame, const State& state, std::span<const State> tangents) {
        if (next < observations.size() && observations[next].frame == frame) {
          std::vector<Points> changes;
          for (const State& t : tangents) changes.push_back(t.x);
          const std::size_t slot = next++;
          beside.run([this, &observations, &fits, slot, x = state.x, changes = std::move(changes)] {
            fits[slot] = fit_frame(observations[slot], x, changes);
          });
        }
        return frame < options_.last_frame;
      });
  beside.wait();
  evaluation.steps = summary.steps;
  if (!summary.succeeded) return evaluation.failure = summary.failure, evaluation;
  fits.resize(next);
  VectorX curvature;
  evaluation.cost = parameters_.prior(p, &evaluation.gradient, &curvature);
  evaluation.gauss_newton = curvature.asDiagonal();
  for (const FrameFit& fit : fits) {
    evaluation.cost += fit.cost;
    if (!with_tangents) continue;
    evaluation.gradient += fit.gradient;
    evaluation.gauss_newton += fit.gauss_newton;
  }
  evaluation.frames = std::move(fits);
  evaluation.succeeded = std::isfinite(evaluation.cost);
  if (!evaluation.succeeded) evaluation.failure = "the cost is not finite";
  return evaluation;
}

CostEvaluation Objective::evaluate(const VectorX& p) { return run(p, false); }
CostEvaluation Objective::linearise(const VectorX& p) { return run(p, true); }

CostEvaluation Objective::gradient(const VectorX& p) {
  const VectorX theta = parameters_.to_theta(p);
  const auto& observations = *observations_;
  const RobustLoss loss{options_.outlier_scale};
  CostEvaluation evaluation;
  const auto seen_in = [&](int frame) -> const FrameObservations* {
    const auto it = std::lower_bound(observations.begin(), observations.end(), frame,
                                     [](const FrameObservations& o, int f) { return o.frame < f; });
    return it != observations.end() && it->frame == frame ? &*it : nullptr;
  };
  VectorX theta_bar;
  const RolloutSummary summary = simulation_.run_adjoint(
      theta, options_.last_frame,
      [&](int frame, const State& state) {
        if (const auto* seen = seen_in(frame)) evaluation.frames.push_back(fit_frame(*seen, state.x, {}));
        return true;
      },
      [&](int frame, const State& state, Points& x_bar) {
        const auto* seen = seen_in(frame);
        if (!seen) return;
        if (!seen->points.empty()) {
          const auto matches = mismatch_.surface->match(seen->points, state.x);
          VectorX bar = VectorX::Zero(Eigen::Index(matches.size()));
          for (std::size_t i = 0; i < matches.size(); ++i)
            if (matches[i].cell >= 0)
              bar[Eigen::Index(i)] =
                  frame_weight(*seen) / std::pow(seen->points[i].noise, 2) * loss.derivative(matches[i].distance);
          x_bar += mismatch_.surface->adjoint(matches, bar);
        }
        if (!seen->tracks.empty()) {
          Points bar = mismatch_.tracks->residuals(seen->tracks, state.x);
          for (std::size_t i = 0; i < seen->tracks.size(); ++i) {
            const double distance = bar.row(Eigen::Index(i)).norm();
            bar.row(Eigen::Index(i)) *= loss.weight(distance) / std::pow(seen->tracks[i].noise, 2);
          }
          mismatch_.tracks->add_adjoint(seen->tracks, bar, x_bar);
        }
      },
      theta_bar);
  evaluation.steps = summary.steps;
  if (!summary.succeeded) return evaluation.failure = summary.failure, evaluation;
  evaluation.cost = parameters_.prior(p, &evaluation.gradient);
  evaluation.gradient += parameters_.jacobian(p).transpose() * theta_bar;
  for (const FrameFit& fit : evaluation.frames) evaluation.cost += fit.cost;
  evaluation.succeeded = std::isfinite(evaluation.cost) && evaluation.gradient.allFinite();
  if (!evaluation.succeeded) evaluation.failure = "the cost or its gradient is not finite";
  return evaluation;
}

}  // namespace pliant
