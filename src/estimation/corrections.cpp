#include "estimation/corrections.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/dense.hpp"
#include "estimation/judgement.hpp"

namespace pliant {

namespace {

/// Rows of the unconstrained vector that belong to parameters of these names.
std::vector<Eigen::Index> rows_of(const ParameterSet& parameters, const std::vector<std::string>& names) {
  std::vector<Eigen::Index> rows;
  Eigen::Index at = 0;
  for (const Parameter& p : parameters.parameters()) {
    if (!p.estimated) continue;
    for (int d = 0; d < p.dimension(); ++d, ++at)
      if (std::ranges::find(names, p.name) != names.end()) rows.push_back(at);
  }
  return rows;
}

/// How far the cost falls in one Newton step of the rows `moved`, the rows `following` moving along.
double gain_of(const CostEvaluation& e, const std::vector<Eigen::Index>& following,
               const std::vector<Eigen::Index>& moved) {
  const auto fall = [&](const std::vector<Eigen::Index>& rows) {
    if (rows.empty()) return 0.0;
    const VectorX g = e.gradient(rows);
    const MatrixX H = e.gauss_newton(rows, rows);
    return 0.5 * g.dot(solve_symmetric(H, g));
  };
  std::vector<Eigen::Index> together = following;
  together.insert(together.end(), moved.begin(), moved.end());
  return fall(together) - fall(following);
}

}  // namespace

std::vector<Correction> possible_corrections(const ParameterSet& parameters, const std::vector<std::string>& chosen) {
  std::vector<Correction> corrections;
  const auto is_free = [&](const Parameter& p) {
    const std::string base = p.name.substr(0, p.name.find_first_of("@["));
    return !p.estimated && std::ranges::find(chosen, p.name) == chosen.end() &&
           std::ranges::find(chosen, base) == chosen.end();
  };
  for (const Parameter& p : parameters.parameters()) {
    if (!is_free(p)) continue;
    const std::string sensor = p.name.substr(p.name.find('@') + 1);
    if (p.role == Role::Sensor && p.is_scalar() && p.unit == "m")
      corrections.push_back(
          {(p.name.starts_with("outline_error") ? "the outlines of " : "the range of ") + sensor, {p.name}});
    else if (p.role == Role::Sensor && p.unit == "rad")  // a pose is a turn and a shift
      corrections.push_back({"the pose of " + sensor, {p.name, "sensor_shift@" + sensor}});
    else if (p.transform == Transform::Direction)
      corrections.push_back({"the direction of " + p.name, {p.name}});
  }
  return corrections;
}

bool may_need_correction(double cost, double observations) {
  return cost > (1.0 + judgement.tolerated_excess) * 0.5 * observations;
}

std::vector<NeededCorrection> needed_corrections(const CostEvaluation& evaluation, const ParameterSet& parameters,
                                                 const std::vector<Correction>& corrections, double observations) {
  std::vector<std::string> candidates;
  for (const Correction& c : corrections) candidates.insert(candidates.end(), c.parameters.begin(), c.parameters.end());
  const std::vector<Eigen::Index> all = rows_of(parameters, candidates);
  std::vector<Eigen::Index> following;
  for (Eigen::Index i = 0; i < evaluation.gradient.size(); ++i)
    if (std::ranges::find(all, i) == all.end()) following.push_back(i);
  const double explained = 0.5 * observations;  // the cost of residuals that are noise
  const double noise_scale = std::max(1.0, evaluation.cost / explained);
  std::vector<Correction> left = corrections;
  std::vector<NeededCorrection> needed;
  double excess = evaluation.cost - explained;
  while (excess > judgement.tolerated_excess * explained && !left.empty()) {
    NeededCorrection best;
    for (const Correction& c : left) {
      const std::vector<Eigen::Index> rows = rows_of(parameters, c.parameters);
      const double gain = gain_of(evaluation, following, rows);
      const double worth = 0.5 * double(rows.size()) * std::log(observations) * noise_scale;
      const double least = std::max(worth, 0.5 * excess);
      if (gain - least > best.gain - best.least) best = {c, gain, least};
    }
    if (best.gain <= best.least) break;
    const std::vector<Eigen::Index> rows = rows_of(parameters, best.correction.parameters);
    following.insert(following.end(), rows.begin(), rows.end());
    std::erase_if(left, [&](const Correction& c) { return c.what == best.correction.what; });
    excess -= best.gain;
    needed.push_back(std::move(best));
  }
  return needed;
}

std::optional<TimeDoubt> doubt_of_time(const CostEvaluation& stated, const std::vector<ShiftedInTime>& shifted) {
  const double least_share = judgement.share_of_shifted_times, abrupt = judgement.onset_of_shifted_times;
  const double observations = stated.independent_observations(), excess = stated.cost - 0.5 * observations;
  if (!may_need_correction(stated.cost, observations)) return std::nullopt;
  std::optional<TimeDoubt> best;
  for (const auto& [later, evaluation] : shifted) {
    std::map<std::pair<int, int>, double> costs;  // of recording and frame as stated
    for (const FrameFit& f : evaluation.frames) costs[{f.recording, f.frame - later}] = f.cost;
    const auto gain_at = [&](const FrameFit& f) {
      const auto other = costs.find({f.recording, f.frame});
      return other != costs.end() ? f.cost - other->second : 0.0;
    };
    for (std::size_t first = 1; first < stated.frames.size(); ++first) {
      const FrameFit &before = stated.frames[first - 1], &f = stated.frames[first];
      const bool begins_here = f.recording == before.recording && f.cost > abrupt * before.cost;
      if (!begins_here || gain_at(f) < (1.0 - 1.0 / abrupt) * f.cost) continue;
      double gain = 0.0;  // of frames from there on, while it grows
      for (std::size_t i = first; i < stated.frames.size() && stated.frames[i].recording == f.recording; ++i) {
        gain += gain_at(stated.frames[i]);
        if (gain > (best ? best->share : least_share) * excess) best = {f.recording, f.frame, later, gain / excess};
      }
    }
  }
  return best;
}

}  // namespace pliant
