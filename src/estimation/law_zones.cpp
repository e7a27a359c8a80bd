#include "estimation/law_zones.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "base/dense.hpp"
#include "estimation/field_evidence.hpp"

namespace pliant {

namespace {

constexpr int slabs = 16;             // of a zone, each coordinate
constexpr double least_share = 0.02;  // of the volume, in either part of a cut
constexpr std::array by_all = {ZoneCut::By::X, ZoneCut::By::Y, ZoneCut::By::Z, ZoneCut::By::Depth};
constexpr std::array by_names = {"x", "y", "z", "depth"};

/// Where the numbers of a law stand in p.
std::vector<Eigen::Index> places(const ParameterSet& set, const LawLayout& layout, int law) {
  std::vector<Eigen::Index> all;
  for (const ParameterHandle& number : layout.numbers(law)) all.push_back(set.coordinate(number));
  return all;
}

/// Precision of ln E of zones about their mean, whatever that is.
MatrixX zone_precision(int zones, double modulus_variation) {
  return (MatrixX::Identity(zones, zones) - MatrixX::Constant(zones, zones, 1.0 / zones)) /
         (modulus_variation * modulus_variation);
}

/// Parts that no division of a body in zones cuts: numbers of elements with the same zone in each.
std::vector<int> common_parts(const std::vector<std::vector<int>>& divisions) {
  std::map<std::vector<int>, int> number;
  std::vector<int> part_of;
  for (std::size_t e = 0; e < divisions.front().size(); ++e) {
    std::vector<int> key;
    for (const std::vector<int>& division : divisions) key.push_back(division[e]);
    part_of.push_back(number.try_emplace(std::move(key), int(number.size())).first->second);
  }
  return part_of;
}

/// The presses differentiated by each part's own law at the present estimate, and what that says about any division of
/// the body along the parts' borders: the linear model of all residuals.
class PartDerivatives {
 public:
  /// @param zone_of   that theta is of; part_of: finer
  PartDerivatives(PressObjective& objective, const PressScene& scene, const LawLayout& layout, const VectorX& theta,
                  const std::vector<int>& zone_of, std::vector<int> part_of)
      : part_of_(std::move(part_of)) {
    const int parts = 1 + *std::ranges::max_element(part_of_);
    layout_ = LawLayout({parts, layout.form().terms, parts, layout.form().own_ratios});
    std::vector<int> zone(std::size_t(parts), 0);
    for (std::size_t e = 0; e < part_of_.size(); ++e) zone[std::size_t(part_of_[e])] = zone_of[e];
    auto body = std::make_shared<Body>(*scene.body);
    body->modulus = zone_field(body->modulus, part_of_, parts);
    std::vector<Parameter> list = law_parameters(layout_, theta[layout.modulus(0)]).parameters();
    for (Parameter& p : list) p.prior_std = std::numeric_limits<double>::infinity();  // it is that of the zones
    set_ = ParameterSet(layout_.layout(), std::move(list), carry_law(layout, theta, layout_, zone));
    p_ = set_.to_unconstrained(set_.reference());
    objective.set_form(body, layout_, set_);
    fine_ = objective.linearise(p_);
  }
  bool succeeded() const { return fine_.succeeded; }

  /// The cost and its derivatives at p of `set`, the laws of `zones` zones, by the linear model.
  CostEvaluation of_division(const std::vector<int>& zone_of, const LawLayout& layout, const ParameterSet& set,
                             const VectorX& p) const {
    std::vector<Eigen::Index> target(std::size_t(p_.size()));
    for (std::size_t part = 0; part < std::size_t(layout_.form().laws); ++part) {
      const auto element = std::size_t(std::ranges::find(part_of_, int(part)) - part_of_.begin());
      const auto fine = places(set_, layout_, int(part)), coarse = places(set, layout, zone_of[element]);
      for (std::size_t s = 0; s < fine.size(); ++s) target[std::size_t(fine[s])] = coarse[s];
    }
    const VectorX moved = p(target) - p_;
    const auto summed = [&](const VectorX& gradient) {
      VectorX sum = VectorX::Zero(p.size());
      for (std::size_t i = 0; i < target.size(); ++i) sum[target[i]] += gradient[Eigen::Index(i)];
      return sum;
    };
    CostEvaluation all;
    all.succeeded = true;
    all.cost = fine_.cost + fine_.gradient.dot(moved) + 0.5 * moved.dot(fine_.gauss_newton * moved);
    all.gradient = summed(fine_.gradient + fine_.gauss_newton * moved);
    all.gauss_newton = MatrixX::Zero(p.size(), p.size());
    for (std::size_t i = 0; i < target.size(); ++i)
      for (std::size_t j = 0; j < target.size(); ++j)
        all.gauss_newton(target[i], target[j]) += fine_.gauss_newton(Eigen::Index(i), Eigen::Index(j));
    for (const FrameFit& frame : fine_.frames) {
      FrameFit own;
      own.independent = frame.independent;
      own.cost = frame.cost;
      own.gradient = summed(frame.gradient + frame.gauss_newton * moved);
      all.frames.push_back(std::move(own));
    }
    VectorX gradient;
    MatrixX curvature;
    all.cost += set.prior(p, &gradient, &curvature);
    all.gradient += gradient;
    all.gauss_newton += curvature;
    return all;
  }

 private:
  std::vector<int> part_of_;
  LawLayout layout_;
  ParameterSet set_;
  VectorX p_;
  CostEvaluation fine_;
};

/// Inner borders of `slabs` equal slabs between the least and the greatest coordinate of some elements [m].
std::vector<double> borders(const VectorX& coordinate, const std::vector<int>& elements) {
  const VectorX own = coordinate(elements);
  std::vector<double> at;
  if (own.size() > 0 && own.maxCoeff() > own.minCoeff())
    for (int i = 1; i < slabs; ++i) at.push_back(own.minCoeff() + i * (own.maxCoeff() - own.minCoeff()) / slabs);
  return at;
}

std::vector<int> elements_in(const std::vector<int>& zone_of, const std::vector<int>& zones) {
  std::vector<int> elements;
  for (std::size_t e = 0; e < zone_of.size(); ++e)
    if (std::ranges::find(zones, zone_of[e]) != zones.end()) elements.push_back(int(e));
  return elements;
}

/// Whether every zone holds enough of the object.
bool are_large(const Body& body, const std::vector<int>& zone_of, int zones) {
  std::vector<double> volume(std::size_t(zones), 0.0);
  for (std::size_t e = 0; e < zone_of.size(); ++e) volume[std::size_t(zone_of[e])] += body.element_volume[e];
  return *std::ranges::min_element(volume) >= least_share * body.volume();
}

}  // namespace

std::string describe(const ZoneCut& cut, int zones_before) {
  return fmt::format("zone {} cut at {} = {:.3g} mm: {} it zone {}", cut.zone + 1, by_names[std::size_t(cut.by)],
                     1e3 * cut.at, cut.by == ZoneCut::By::Depth ? "below" : "above", zones_before + 1);
}

MatrixX zone_coordinates(const Body& body) {
  MatrixX all(body.element_count(), 4);
  for (int e = 0; e < body.element_count(); ++e) {
    Vector3 centre = Vector3::Zero();
    const Points& nodes = body.scanned_positions();
    for (const int n : body.element(e)) centre += nodes.row(n).transpose() / double(body.nodes_per_element());
    double depth = std::numeric_limits<double>::infinity();
    for (const SurfacePoint& s : body.surface) depth = std::min(depth, (s.position - centre).squaredNorm());
    all.row(e) << centre.transpose(), std::sqrt(depth);
  }
  return all;
}

std::vector<int> zones_after(const MatrixX& coordinates, const std::vector<ZoneCut>& cuts) {
  std::vector<int> zone_of(std::size_t(coordinates.rows()), 0);
  for (std::size_t c = 0; c < cuts.size(); ++c)
    for (std::size_t e = 0; e < zone_of.size(); ++e)
      if (zone_of[e] == cuts[c].zone && coordinates(Eigen::Index(e), int(cuts[c].by)) >= cuts[c].at)
        zone_of[e] = int(c) + 1;
  return zone_of;
}

ModulusField zone_field(const ModulusField& before, const std::vector<int>& zone_of, int zones) {
  ModulusField field;
  field.relative = before.relative;
  field.controls = zones;
  if (zones == 1) return field;
  field.weights = MatrixX::Zero(Eigen::Index(zone_of.size()), zones);
  for (std::size_t e = 0; e < zone_of.size(); ++e) field.weights(Eigen::Index(e), zone_of[e]) = 1.0;
  return field;
}

LawForm with_zone(const LawForm& form) { return {form.controls + 1, form.terms, form.controls + 1, form.own_ratios}; }

VectorX with_zone(const LawLayout& from, const VectorX& theta, const LawLayout& to, int zone) {
  std::vector<int> like;
  for (int k = 0; k < from.form().controls; ++k) like.push_back(k);
  like.push_back(zone);
  return carry_law(from, theta, to, like);
}

VectorX law_contrast_deviations(const LawForm& form, double modulus_variation) {
  std::vector<double> deviations = {modulus_variation, 1.0};  // of ln E; of Poisson's ratio
  for (int i = 0; i < form.terms; ++i) {
    deviations.push_back(1.0);  // of an exponent: its scale
    if (i > 0) deviations.push_back(modulus_variation);
    if (i > 0 && form.own_ratios) deviations.push_back(1.0);
  }
  return Eigen::Map<const VectorX>(deviations.data(), Eigen::Index(deviations.size()));
}

double zone_evidence(const CostEvaluation& evaluation, const ParameterSet& parameters, const VectorX& p,
                     const LawLayout& layout, int cut_from, double modulus_variation) {
  const VectorX deviation = law_contrast_deviations(layout.form(), modulus_variation);
  MatrixX contrasts = MatrixX::Zero(deviation.size(), p.size());
  const auto last = places(parameters, layout, layout.form().controls - 1),
             first = places(parameters, layout, cut_from);
  for (Eigen::Index s = 0; s < deviation.size(); ++s) {
    contrasts(s, last[std::size_t(s)]) = 1.0;
    contrasts(s, first[std::size_t(s)]) = -1.0;
  }
  const MatrixX spread = deviation.array().square().matrix().asDiagonal();
  return log_bayes_factor(evaluation, parameters, p, contrasts, spread);
}

double own_laws_evidence(const CostEvaluation& evaluation, const ParameterSet& parameters, const VectorX& p,
                         const LawLayout& layout, double modulus_variation) {
  const VectorX deviation = law_contrast_deviations(layout.form(), modulus_variation);
  const Eigen::Index numbers = deviation.size() - 1, others = layout.form().laws - 1;  // the moduli are free anyway
  MatrixX contrasts = MatrixX::Zero(others * numbers, p.size()),
          spread = MatrixX::Zero(others * numbers, others * numbers);
  const auto first = places(parameters, layout, 0);
  // Laws scatter about a common mean: differences from the first share what that does.
  for (Eigen::Index law = 1; law <= others; ++law) {
    const auto own = places(parameters, layout, int(law));
    for (Eigen::Index s = 1; s <= numbers; ++s) {
      const Eigen::Index row = (law - 1) * numbers + s - 1;
      contrasts(row, own[std::size_t(s)]) = 1.0;
      contrasts(row, first[std::size_t(s)]) = -1.0;
      for (Eigen::Index other = 1; other <= others; ++other)
        spread(row, (other - 1) * numbers + s - 1) = deviation[s] * deviation[s] * (other == law ? 1.0 : 0.5);
    }
  }
  return log_bayes_factor(evaluation, parameters, p, contrasts, spread);
}

ParameterSet zone_parameters(const LawLayout& layout, double youngs_modulus, double modulus_variation) {
  ParameterSet set = law_parameters(layout, youngs_modulus);
  if (layout.form().laws > 1)
    set.set_joint_prior(layout.modulus_names(), zone_precision(layout.form().controls, modulus_variation));
  return set;
}

std::optional<PromisedCut> most_promising_cut(PressObjective& objective, const PressScene& scene,
                                              const LawLayout& layout, const VectorX& theta,
                                              const std::vector<ZoneCut>& cuts, double modulus_variation) {
  const MatrixX coordinates = zone_coordinates(*scene.body);
  const int zones = int(cuts.size()) + 1;
  const std::vector<int> zone_of = zones_after(coordinates, cuts);
  const LawLayout finer({zones + 1, layout.form().terms, zones + 1, layout.form().own_ratios});
  const ParameterSet set = zone_parameters(finer, theta[layout.modulus(0)], modulus_variation);
  std::optional<PromisedCut> best;
  for (const ZoneCut::By by : by_all) {
    std::vector<ZoneCut> tried;
    std::vector<std::vector<int>> divisions = {zone_of};
    for (int z = 0; z < zones; ++z)
      for (const double at : borders(coordinates.col(int(by)), elements_in(zone_of, {z}))) {
        std::vector<ZoneCut> more = cuts;
        more.push_back({z, by, at});
        std::vector<int> division = zones_after(coordinates, more);
        if (!are_large(*scene.body, division, zones + 1)) continue;
        tried.push_back(more.back());
        divisions.push_back(std::move(division));
      }
    if (tried.empty()) continue;
    const PartDerivatives parts(objective, scene, layout, theta, zone_of, common_parts(divisions));
    if (!parts.succeeded()) continue;
    for (std::size_t i = 0; i < tried.size(); ++i) {
      const VectorX p = set.to_unconstrained(with_zone(layout, theta, finer, tried[i].zone));
      const CostEvaluation coarse = parts.of_division(divisions[i + 1], finer, set, p);
      const double evidence = zone_evidence(coarse, set, p, finer, tried[i].zone, modulus_variation);
      if (!best || evidence > best->evidence) best = {tried[i], evidence};
    }
  }
  return best;
}

std::optional<PromisedMove> best_move(PressObjective& objective, const PressScene& scene, const LawLayout& layout,
                                      const VectorX& theta, const std::vector<ZoneCut>& cuts, std::size_t moved,
                                      double modulus_variation) {
  const MatrixX coordinates = zone_coordinates(*scene.body);
  const int zones = int(cuts.size()) + 1;
  const std::vector<int> zone_of = zones_after(coordinates, cuts);
  // The zone as it was before the cut.
  const std::vector<int> before = zones_after(coordinates, {cuts.begin(), cuts.begin() + std::ptrdiff_t(moved)});
  std::vector<double> tried;
  std::vector<std::vector<int>> divisions = {zone_of};
  for (const double at : borders(coordinates.col(int(cuts[moved].by)), elements_in(before, {cuts[moved].zone}))) {
    std::vector<ZoneCut> other = cuts;
    other[moved].at = at;
    std::vector<int> division = zones_after(coordinates, other);
    if (division == zone_of || !are_large(*scene.body, division, zones)) continue;
    tried.push_back(at);
    divisions.push_back(std::move(division));
  }
  if (tried.empty()) return std::nullopt;
  const PartDerivatives parts(objective, scene, layout, theta, zone_of, common_parts(divisions));
  if (!parts.succeeded()) return std::nullopt;
  const ParameterSet set = zone_parameters(layout, theta[layout.modulus(0)], modulus_variation);
  const VectorX p = set.to_unconstrained(theta);
  const auto promised_cost = [&](const std::vector<int>& division) {
    const CostEvaluation e = parts.of_division(division, layout, set, p);
    return e.cost - 0.5 * e.gradient.dot(solve_symmetric(e.gauss_newton, e.gradient));
  };
  const double now = promised_cost(zone_of);
  PromisedMove best;
  for (std::size_t i = 0; i < tried.size(); ++i)
    if (const double gain = now - promised_cost(divisions[i + 1]); gain > best.gain) best = {tried[i], gain};
  if (!(best.gain > 0.0)) return std::nullopt;
  return best;
}

}  // namespace pliant
