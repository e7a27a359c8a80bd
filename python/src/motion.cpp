#include "motion.hpp"

#include <algorithm>

namespace pliant::python {

Motion::Motion(ModelScene scene) : scene_(std::move(scene)), simulation_(scene_.body, scene_.simulation) {}

void Motion::prepare(const RunState& state) {
  simulation_.set_start(state.start.value_or(Points()), state.start_velocities.value_or(Points()));
  if (!state.reference && !has_reference_) return;
  simulation_.set_reference(state.reference.value_or(scene_.body->reference_positions()));
  has_reference_ = true;
}

Frames Motion::run(const VectorX& theta, const RunState& state, int count, const std::function<bool()>& stopped) {
  const std::lock_guard turn(turn_);
  prepare(state);
  Frames frames;
  const auto numbers = 3 * std::size_t(body().node_count());
  frames.positions.resize(std::size_t(count) * numbers);
  frames.velocities.resize(std::size_t(count) * numbers);
  const RolloutSummary summary =
      simulation_.run(theta, MatrixX(theta.size(), 0), count - 1, [&](int frame, const State& at, auto) {
        const auto first = std::ptrdiff_t(std::size_t(frame) * numbers);
        std::copy_n(at.x.data(), numbers, frames.positions.begin() + first);
        if (at.v.size() > 0) std::copy_n(at.v.data(), numbers, frames.velocities.begin() + first);
        ++frames.count;
        return !stopped();
      });
  if (!summary.succeeded) throw SimulationFailure(summary.failure);
  frames.steps = summary.steps;
  return frames;
}

Gradient Motion::gradient(const VectorX& theta, const RunState& state, const double* cotangent, int count,
                          bool with_reference, const std::function<bool()>& stopped) {
  const std::lock_guard turn(turn_);
  prepare(state);
  Gradient gradient;
  gradient.nodes.with_reference = with_reference;
  has_reference_ = has_reference_ || with_reference;
  const auto numbers = 3 * Eigen::Index(body().node_count());
  const RolloutSummary summary = simulation_.run_adjoint(
      theta, count - 1, [&](int, const State&) { return !stopped(); },
      [&](int frame, const State&, Points& bar) {
        flat(bar) += Eigen::Map<const VectorX>(cotangent + frame * numbers, numbers);
      },
      gradient.theta, &gradient.nodes);
  if (!summary.succeeded) throw SimulationFailure(summary.failure);
  return gradient;
}

}  // namespace pliant::python
