#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "estimation/fit_plan.hpp"
#include "estimation/notes.hpp"

// Which starts a fit follows, and how far.

namespace pliant {

std::vector<ScannedStart> best_of_scans(const std::vector<std::vector<std::pair<double, double>>>& scans, int most) {
  constexpr double hopeless = 4.0;  // times the lowest cost
  struct Candidate {
    ScannedStart start;
    double cost;
    bool is_valley;
  };
  std::vector<Candidate> all;
  double least = infinite;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const auto& trials = scans[s];
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const auto [modulus, cost] = trials[i];
      const bool is_valley =
          (i == 0 || cost <= trials[i - 1].second) && (i + 1 == trials.size() || cost <= trials[i + 1].second);
      all.push_back({{int(s), modulus}, cost, is_valley});
      least = std::min(least, cost);
    }
  }
  std::ranges::stable_sort(all, [](const Candidate& a, const Candidate& b) {
    return a.is_valley != b.is_valley ? a.is_valley : a.cost < b.cost;
  });
  std::vector<ScannedStart> best;
  for (const Candidate& c : all) {
    if (int(best.size()) >= most || !std::isfinite(c.cost)) break;
    if (c.cost <= hopeless * least) best.push_back(c.start);
  }
  return best;
}

namespace {

/// Coefficients of friction: what slides and what sticks take different ways, and no step leads from one to the other.
constexpr std::array scanned_frictions = {0.1, 0.4};

}  // namespace

int FitPlan::scan_count() const { return facts_.frictions.empty() ? 1 : int(scanned_frictions.size()); }

VectorX FitPlan::with_friction(VectorX theta, int scan) const {
  for (const ParameterHandle& friction : facts_.frictions) theta[friction] = scanned_frictions[std::size_t(scan)];
  return theta;
}

std::vector<VectorX> FitPlan::found_starts(const Records& done) const {
  const VectorX theta = before_starts(done);
  const StageRecord* swung = find_record(done, {StageKind::Swing});
  if (!facts_.is_scanned || (swung && swung->converged)) return {theta};
  std::vector<std::vector<std::pair<double, double>>> scans;
  for (int i = 0; i < scan_count(); ++i)
    if (const StageRecord* scan = find_record(done, {StageKind::Scan, 0, i})) scans.push_back(scan->trials);
  std::vector<VectorX> found;
  for (const ScannedStart& best : best_of_scans(scans, facts_.options.starts))
    found.push_back(with_friction(with_modulus(theta, best.modulus, done), best.scan));
  return found;
}

/// Starts are followed over the first frames, and on if one leads about as far down as the best one, elsewhere.
std::string FitPlan::why_given_up(int index, const Records& done) const {
  // Times the least cost over the first frames. Where the best start explains all that was seen, nothing else can
  // explain it much better.
  constexpr double hopeless = 4.0, hopeless_if_drawn = 2.0, hopeless_if_explained = 1.5;
  for (const StageRecord& r : done)
    if (r.id.kind == StageKind::Coarse && r.id.start == index && !r.succeeded) return r.reason;
  const StageRecord* first = first_of_start(index, done);
  if (!first) return {};
  const int given = int(found_starts(done).size());
  double least = infinite;
  bool is_explained = false;
  for (int i = 0; i < given; ++i) {
    if (const StageRecord* r = first_of_start(i, done); r && r->succeeded) least = std::min(least, r->cost);
    const StageRecord* end = i == index || facts_.swings ? nullptr : end_of_start(i, done);
    is_explained = is_explained || (end && end->succeeded && end->misfit < good_misfit);
  }
  const double most = index >= given ? hopeless_if_drawn : is_explained ? hopeless_if_explained : hopeless;
  if (!end_of_start(index, done) && first->cost > most * least)
    return "given up: over the first frames its cost was " + in_three_digits(first->cost / least) +
           " times that of the best start";
  if (const auto same = joined(index, done))
    return "given up: over the first frames it led to where start " + std::to_string(*same + 1) + " led";
  return {};
}

/// Whether a fit at theta is in the valley of another one: near it, and not much above.
bool FitPlan::is_in_valley(const VectorX& theta, double cost, const StageRecord& of) const {
  // Of unconstrained numbers, logarithms of moduli and dampings among them, and of costs. Swings that fall out of step
  // make valleys beside each other.
  constexpr double same_place = 0.4, same_cost = 2.0, same_cost_of_swings = 1.02;
  const VectorX way = facts_.parameters.to_unconstrained(theta) - facts_.parameters.to_unconstrained(of.theta);
  // What it meets and how sensors err is told too weakly to tell valleys apart.
  const std::vector<const Parameter*> parameters = facts_.parameters.coordinate_parameters();
  double farthest = 0.0;
  for (std::size_t i = 0; i < parameters.size(); ++i)
    if (parameters[i]->role != Role::Obstacle && parameters[i]->role != Role::Sensor)
      farthest = std::max(farthest, std::abs(way[Eigen::Index(i)]));
  return farthest <= same_place &&
         std::max(cost, of.cost) <= (facts_.swings ? same_cost_of_swings : same_cost) * std::min(cost, of.cost);
}

std::optional<int> FitPlan::joined_on_the_way(const Stage& stage, const VectorX& theta, double cost,
                                              const Records& done) const {
  if (stage.id.kind != StageKind::Coarse || stage.horizon.part < 1.0) return std::nullopt;
  for (int i = 0; i < facts_.options.most_starts; ++i) {
    const StageRecord* end = i == stage.id.start ? nullptr : end_of_start(i, done);
    if (end && end->succeeded && !end->joined && cost >= end->cost && is_in_valley(theta, cost, *end)) return i;
  }
  return std::nullopt;
}

/// Of two in one place, that with the lower cost is followed, or that which was followed already.
std::optional<int> FitPlan::joined(int index, const Records& done) const {
  if (const StageRecord* end = end_of_start(index, done)) return end->joined;
  const StageRecord* first = first_of_start(index, done);
  if (!first || !first->succeeded) return std::nullopt;
  for (int i = 0; i < facts_.options.most_starts; ++i) {
    const StageRecord* r = first_of_start(i, done);
    if (i == index || !r || !r->succeeded) continue;
    const bool is_better = r->cost < first->cost || (r->cost == first->cost && i < index);
    if ((is_better || end_of_start(i, done)) && is_in_valley(first->theta, first->cost, *r)) return i;
  }
  return std::nullopt;
}

int FitPlan::start_count(const Records& done) const {
  constexpr double good = 3.0;  // misfit on the coarse grid, in the wide band
  constexpr int at_once = 2;
  int count = int(found_starts(done).size());
  if (!facts_.is_scanned || count == 0) return count;
  double least = infinite;
  for (int i = 0; i < facts_.options.most_starts; ++i) {
    if (i == count) {  // all before are done, and none is good
      if (!(least > good)) return count;
      count = std::min(count + at_once, facts_.options.most_starts);
    }
    const StageRecord* end = end_of_start(i, done);
    if (!end && why_given_up(i, done).empty()) return count;
    if (end && end->succeeded) least = std::min(least, end->misfit);
  }
  return count;
}

VectorX FitPlan::drawn_start(int index, const Records& done) const {
  constexpr double decades = 0.7;  // to either side of what scan or swing showed
  std::mt19937_64 bits{std::uint64_t(index)};
  const auto uniform = [&] { return (double(bits() >> 11) + 0.5) * 0x1p-53; };
  const auto normal = [&] {
    return std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * std::numbers::pi * uniform());
  };
  double log_least = infinite, log_most = -infinite;
  for (const VectorX& found : found_starts(done)) {
    const double log = std::log10(found[facts_.moduli.front()]);
    log_least = std::min(log_least, log - decades), log_most = std::max(log_most, log + decades);
  }
  const double modulus = std::pow(10.0, log_least + (log_most - log_least) * uniform());
  VectorX theta = with_modulus(before_starts(done), modulus, done);
  ParameterSet drawn = facts_.parameters;
  // The throw is told by the first frames, better than by its prior.
  const auto is_drawn = [](const Parameter& p) {
    return std::isfinite(p.prior_std) && !p.is_auxiliary &&
           (p.role == Role::Damping || p.role == Role::Load || p.role == Role::Obstacle || shapes_law(p));
  };
  for (const Parameter& p : facts_.parameters.parameters()) drawn.set_estimated(p.name, p.estimated && is_drawn(p));
  drawn.set_reference(theta);
  VectorX p = drawn.to_unconstrained(theta);
  const std::vector<const Parameter*> of = drawn.coordinate_parameters();
  Eigen::Index first = 0;  // coordinate of the parameter
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    const Parameter& parameter = *of[std::size_t(i)];
    if (i > 0 && of[std::size_t(i) - 1] != &parameter) first = i;
    p[i] = parameter.prior_mean[i - first] + parameter.prior_std * normal();
    if (parameter.transform == Transform::InverseSinh) p[i] = std::abs(p[i]);
    const bool is_last = i - first == parameter.dimension() - 1;
    if (is_last && parameter.prior_shape.size() > 0) {
      auto drawn_at = p.segment(first, parameter.dimension());
      drawn_at = parameter.prior_mean + parameter.prior_shape * (drawn_at - parameter.prior_mean);
    }
  }
  return drawn.to_theta(drawn.clamp(p));
}

VectorX FitPlan::start_theta(const Records& done) const {
  const std::vector<VectorX> found = found_starts(done);
  VectorX theta = facts_.parameters.reference();
  if (!facts_.is_scanned || found.empty()) return theta;
  for (const ParameterHandle& friction : facts_.frictions) theta[friction] = found.front()[friction];
  return with_modulus(theta, found.front()[facts_.moduli.front()], done);
}

std::vector<FitStart> FitPlan::starts(const Records& done) const {
  std::vector<FitStart> all;
  const int count = start_count(done);
  for (int i = 0; i < count; ++i) {
    const StageChain chain = start(i, done);
    FitStart one;
    one.start = one.final = chain.front().from.front();
    one.cost = infinite;
    one.reason = "not begun";
    for (const Stage& stage : chain) {
      const StageRecord* r = find_record(done, stage.id);
      if (!r) break;
      if (stage.id.number == 0) one.start_cost = r->start_cost;
      one.iterations += r->iterations, one.converged = r->converged, one.reason = r->reason;
      one.cost = r->succeeded ? r->cost : infinite;
      one.final = r->theta;
    }
    if (!end_of_start(i, done)) {  // costs over the first frames are not those over all
      one.cost = infinite;
      if (const std::string why = why_given_up(i, done); !why.empty()) one.reason = why;
    }
    if (const auto same = joined(i, done))
      if (const StageRecord* r = end_of_start(*same, done); r && r->succeeded) one.cost = r->cost, one.final = r->theta;
    all.push_back(std::move(one));
  }
  return all;
}

}  // namespace pliant
