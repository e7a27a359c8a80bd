#include "estimation/explained_span.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "estimation/fit_plan.hpp"
#include "estimation/judgement.hpp"
#include "estimation/verdict.hpp"
#include "scene/obstacle.hpp"

namespace pliant {

namespace {

constexpr double after_touch = 1.25;  // times the part until the obstacle is touched
constexpr double growth = 1.2;        // of the part, from one that is explained
constexpr double whole = 1.0;

bool meets_obstacles(const RecordedCapture& r) {
  return (!r.capture.scene.planes.empty() || !r.capture.scene.obstacles.empty()) && !r.capture.scene.timing.is_static &&
         !r.capture.scene.initial.released;
}

/// The part of a recording until a node comes nearer to an obstacle than a hundredth of the body's size; 1 where none
/// does.
double part_until_touch(const RecordingOutcome& r, const std::vector<RigidObstacle>& obstacles, int frames) {
  Simulation simulation(r.discretisation.body, r.discretisation.simulation);
  const MotionBlocks& blocks = r.discretisation.simulation.blocks;
  const Points& rest = r.discretisation.body->nodes;
  const double near = 0.01 * (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).maxCoeff();
  int touched = -1;
  (void)simulation.run(r.theta, [&](int frame, const State& state, std::span<const State>) {
    for (const PlaneBlock& plane : blocks.planes) {
      const Vector3 point = plane.point.vector(r.theta), normal = plane.normal.vector(r.theta);
      if (((state.x * normal).array() - point.dot(normal)).minCoeff() < near) touched = frame;
    }
    for (const RigidObstacle& obstacle : obstacles) {
      const auto distance = distance_to(obstacle);
      const RigidMotion back = motion_of(obstacle).at(simulation.options().times[std::size_t(frame)]).inverse();
      for (Eigen::Index n = 0; n < state.x.rows() && touched < 0; ++n)
        if (distance(back(state.x.row(n).transpose())) < near) touched = frame;
    }
    return touched < 0 && frame < frames;
  });
  return touched < 0 ? 1.0 : double(touched) / std::max(1, frames);
}

/// A part as it is tried; nearly all is all.
double up_to_whole(double part) { return part > judgement.nearly_whole ? whole : part; }

int last_seen(const CostEvaluation& evaluation) {
  return evaluation.frames.empty() ? 0 : evaluation.frames.back().frame;
}

}  // namespace

ExplainedSpan::ExplainedSpan(std::vector<RecordedCapture> recordings, const FitOptions& options, FitState resume)
    : recordings_(std::move(recordings)), options_(options), left_(std::move(resume.pass)) {
  if (resume.span) search_ = std::move(*resume.span);
  is_left_ = !left_.done.empty() || left_.under_way.has_value();
}

bool ExplainedSpan::suits(const std::vector<RecordedCapture>& recordings, const FitOptions& options) {
  return options.span == 0.0 && options.refine == 1 && std::ranges::any_of(recordings, meets_obstacles);
}

bool ExplainedSpan::is_decided() const { return search_.has_whole && (search_.part >= whole || search_.is_ended); }

std::optional<Pass> ExplainedSpan::next() {
  if (outcome_) return std::nullopt;
  Pass pass;
  pass.recordings = recordings_;
  pass.options = options_;
  pass.limits.ends_if_unexplained = !search_.has_whole;
  is_last_ = is_decided();
  if (search_.has_whole) {
    pass.options.span = is_last_ ? search_.part : search_.next_part;
    if (search_.has_parts) {
      pass.options.cells = std::min(64.0, options_.cells * Refinement::mesh_ratio);
      pass.stage = fmt::format("first {:.0f} %", 100.0 * pass.options.span);
    }
    pass.options.alternatives = options_.alternatives && is_last_;
    pass.begin = is_last_ ? *search_.state : begun_from(*search_.state);
    pass.done_from = pass.done_to = 0.9;
  }
  if (is_left_) pass.begin = left_, is_left_ = false;
  return pass;
}

bool ExplainedSpan::take(FitOutcome outcome, PassState reached) {
  std::ranges::move(outcome.history, std::back_inserter(history_));
  forward_steps_ += outcome.forward_steps;
  const bool has_failed = outcome.interrupted || !outcome.evaluation.succeeded;
  const bool fits = !has_failed && is_explained(outcome.evaluation);
  const bool was_whole = !search_.has_whole;
  if (was_whole) {
    starts_ = outcome.starts;
    double part = 0.0;
    for (std::size_t i = 0; i < outcome.recordings.size() && !fits && !has_failed; ++i)
      if (meets_obstacles(recordings_[i])) {
        const RecordingOutcome& r = outcome.recordings[i];
        part = std::max(part, part_until_touch(r, recordings_[i].capture.scene.obstacles, last_seen(r.evaluation)));
      }
    search_.next_part = search_.part = up_to_whole(std::max(judgement.least_part.value, after_touch * part));
    search_.has_parts = search_.part < whole;
  }
  if (has_failed || is_last_ || (was_whole && fits)) {
    if (!was_whole && search_.has_parts) outcome.starts = starts_;
    if (!was_whole && search_.part < whole) say(outcome);
    outcome.history = std::move(history_);
    outcome.forward_steps = forward_steps_;
    outcome_ = std::move(outcome);
    return false;
  }
  const bool is_first_part = !was_whole && search_.next_part == search_.part;
  if (was_whole || is_first_part || fits) search_.state = std::move(reached);
  if (!was_whole) {
    if (fits) search_.part = search_.next_part;
    search_.next_part = up_to_whole(growth * search_.next_part);
    search_.is_ended = !fits;
  }
  search_.has_whole = true;
  return true;
}

void ExplainedSpan::say(FitOutcome& outcome) const {
  std::string until;
  for (const RecordingOutcome& r : outcome.recordings) {
    const std::vector<double>& times = r.discretisation.simulation.times;
    const int last = last_seen(r.evaluation);
    until += fmt::format("{}{:.2f} s of {:.2f} s", until.empty() ? "" : ", ",
                         times[std::size_t(std::min(last, int(times.size()) - 1))] - times.front(),
                         times.back() - times.front());
  }
  outcome.verdict.reasons.push_back("That is said of the first " + until + " of the motion, which alone was fitted.");
  outcome.notes.insert(outcome.notes.begin(),
                       "No parameters explain the whole motion: small errors of a model grow with every impact. The "
                       "estimate is that of the first " +
                           until + ", on a finer mesh; --set span=1 fits all.");
}

}  // namespace pliant
