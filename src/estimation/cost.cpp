#include "estimation/cost.hpp"

#include <cmath>

#include "base/median.hpp"

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
  return double(median(std::move(all)));
}

double CostEvaluation::outline_rms() const {
  double sum = 0.0;
  int count = 0;
  for (const FrameFit& f : frames) sum += f.outline_sum_squares, count += f.outlines;
  return count > 0 ? std::sqrt(sum / count) : 0.0;
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

std::vector<CostEvaluation> CostFunction::evaluate(std::span<const VectorX> points, const OnEvaluated& on_evaluated) {
  std::vector<CostEvaluation> all(points.size());
  bool goes_on = true;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!goes_on) {
      all[i].failure = "left out";
      continue;
    }
    all[i] = evaluate(points[i]);
    if (on_evaluated) goes_on = on_evaluated(i, all[i]);
  }
  return all;
}

}  // namespace pliant
