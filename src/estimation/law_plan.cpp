#include "estimation/law_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/judgement.hpp"
#include "estimation/press_fit.hpp"

namespace pliant {

namespace {

constexpr std::array field_sizes = {4, 8, 16, 32};
constexpr int most_zones = 8, most_passes = 4, brief_iterations = 8;
constexpr int most_rounds = 4;
constexpr double least_round_gain = 0.05;  // of the cost, for which another round is worth its time

/// Every control and law as it is.
std::vector<int> as_they_are(const LawForm& form) {
  std::vector<int> like;
  for (int k = 0; k < form.controls; ++k) like.push_back(k);
  return like;
}

/// The estimate with one term more in each law, which begins small.
/// @param ratio  of its stiffness to the first term's
VectorX with_term(const LawLayout& from, const VectorX& theta, const LawLayout& to, double exponent, double ratio) {
  VectorX more = carry_law(from, theta, to, as_they_are(to.form()));
  const int added = to.form().terms - 1;
  for (int law = 0; law < to.form().laws; ++law) {
    more[to.exponent(added, law)] = exponent;
    more[to.stiffness_ratio(added, law)] = ratio;
    more[to.poissons_ratio(added, law)] = theta[from.poissons_ratio(0, law)];
  }
  return more;
}

/// A cube under homogeneous strain may hardly change its volume: nothing locks. Exponents keep the sign that all of
/// those have that they begin from.
ParameterSet of_curves(const ParameterSet& set, const std::vector<double>& exponents) {
  constexpr double greatest_poissons_ratio = 0.4999, least_exponent = 0.1;
  const bool are_positive = std::ranges::all_of(exponents, [](double exponent) { return exponent > 0.0; });
  std::vector<Parameter> list = set.parameters();
  for (Parameter& p : list) {
    if (p.transform == Transform::LogitHalf) p.upper = greatest_poissons_ratio;
    if (p.transform == Transform::Shift && are_positive) p.lower = least_exponent;
  }
  return {set.layout(), std::move(list), set.reference()};
}

}  // namespace

LawLayout LawFacts::layout(const LawForm& form) const { return LawLayout(form, modulus_names); }

ParameterSet LawFacts::parameters(const LawShape& shape) const {
  const LawLayout own = layout(shape.form);
  ParameterSet set = zone_parameters(own, start_modulus, options.modulus_variation);
  if (const auto known = known_poissons_ratio(options))
    for (const Parameter& p : set.parameters())
      if (p.transform == Transform::LogitHalf) set.fix(p.name, *known);
  if (are_curves()) set = of_curves(set, curve_exponents);
  if (!shape.points.empty())
    set.set_joint_prior(own.modulus_names(), field_precision(shape.points, size, options.modulus_variation));
  return set;
}

/// Goes through the decisions of the search, each by the records of the stages before it, up to the first stage that
/// has none. Every function that asks for stages returns false there, or where the search is at its end.
class LawPlan::Replay {
 public:
  Replay(const LawFacts& facts, const std::vector<StageRecord>& done) : facts_(facts), done_(done) {
    now_.noise = facts.noise;
  }

  Standing run() {
    search();
    if (now_.best && !is_pending() && options().alternatives && !facts_.are_curves()) try_alternatives();
    return std::move(now_);
  }

 private:
  const FitOptions& options() const { return facts_.options; }
  Estimate& best() { return *now_.best; }
  const Estimate& best() const { return *now_.best; }

  void search() {
    const MaterialKind material = options().material;
    const bool has_two_numbers = material == MaterialKind::Linear || material == MaterialKind::NeoHookean;
    if (!fit_first(has_two_numbers ? 0 : 1)) return;
    if (material == MaterialKind::Ogden || material == MaterialKind::Automatic) {
      fit_terms(2);
      if (facts_.modulus_names.empty())
        fit_zones();
      else
        fit_laws_of_regions();
      fit_terms(3);  // an object of several materials looks like one of more terms
      if (facts_.modulus_names.empty() && best().shape.form.laws == 1) fit_fields();
    }
    if (material == MaterialKind::Sampled) {
      fit_terms(2);
      sample();
    }
  }

  /// Rounds of the presses' own fields, as long as one brings the material closer to the markers.
  void sample() {
    for (int round = 0; round < most_rounds; ++round) {
      const StageRecord* record = nullptr;
      for (int begin = 0; begin < facts_.presses; begin += int(samples_a_stage)) {
        record = ask(task_stage(StageKind::Sample));
        if (!record) return;
      }
      if (!record || !record->converged || record->cost > (1.0 - least_round_gain) * record->start_cost) return;
    }
  }

  void try_alternatives() {
    const StageRecord* moved = ask(task_stage(StageKind::Alternative, best().shape, best().theta, "alternatives"));
    if (!moved) return;
    now_.shifts = moved->shifts;
    now_.untried = moved->reason;
  }

  /// The record of a stage; null where it is next, or another is.
  const StageRecord* ask(Stage stage) {
    if (now_.next) return nullptr;
    stage.id.number = int(asked_);
    if (asked_ == done_.size()) {
      now_.next = std::move(stage);
      return nullptr;
    }
    const StageRecord& record = done_[asked_++];
    if (record.id != stage.id || !record.law)
      throw InputError({{},
                        "the stages of the interrupted fit are not those of these recordings and choices",
                        "\"" + stage.name + "\" as number " + std::to_string(asked_) + ", not \"" + record.name + "\"",
                        "leave out --resume to start anew"});
    return &record;
  }

  Stage task_stage(StageKind kind, const LawShape& shape = {}, VectorX from = {}, std::string name = {}) const {
    Stage stage;
    stage.id.kind = kind, stage.name = std::move(name);
    stage.from = {std::move(from)};
    stage.iterations = (facts_.are_curves() ? 8 : 1) * options().max_iterations;  // theirs cost nothing
    stage.law = LawTask{shape, now_.noise};
    return stage;
  }

  /// Minimises from theta; nothing where it is next, or cannot be evaluated (`failed`).
  std::optional<Estimate> estimate(const LawShape& shape, const VectorX& from, const std::string& name,
                                   LawTask::Evidence evidence = LawTask::Evidence::None, int cut = 0,
                                   bool is_brief = false, double cost_to_reach = infinite) {
    Stage stage = task_stage(StageKind::Law, shape, from, name);
    LawTask& task = *stage.law;
    task.evidence = evidence, task.cut = cut, task.is_brief = is_brief, task.cost_to_reach = cost_to_reach;
    if (is_brief) stage.iterations = brief_iterations;
    if (evidence == LawTask::Evidence::Field) task.before = best().shape;
    const StageRecord* record = ask(std::move(stage));
    if (!record) return std::nullopt;
    now_.noise = record->law->noise;
    if (!record->succeeded) return std::nullopt;
    return Estimate{shape,        facts_.layout(shape.form), record->theta,  record->id,  record->from,
                    record->cost, record->converged,         record->reason, *record->law};
  }

  bool is_pending() const { return now_.next.has_value(); }

  /// Keeps the estimate as the best, where it is that, and writes down that it was tried.
  void conclude(std::optional<Estimate> next, const TriedLaw& tried, const MarkerNoise& noise_before) {
    if (is_pending()) return;
    now_.tried.push_back(tried);
    if (next) now_.tried.back().youngs_modulus = next->layout.mean_modulus(next->theta);
    if (tried.kept)
      now_.best = std::move(next);
    else
      now_.noise = noise_before;
  }

  bool fit_first(int terms) {
    const bool is_neo_hookean = options().material == MaterialKind::NeoHookean;
    const LawShape shape{
        {facts_.controls(), terms, 1, false, is_neo_hookean ? ElasticLaw::NeoHookean : ElasticLaw::Corotated}};
    const char* const name = terms > 0 ? "1 term" : is_neo_hookean ? "neo-Hookean" : "linear";
    std::vector<VectorX> starts = {facts_.parameters(shape).reference()};
    if (terms == 1) {
      const Eigen::Index exponent = facts_.layout(shape.form).exponent(0);
      std::vector<double> exponents = facts_.curve_exponents;
      // Curves of growing load fit exponents of either sign.
      if (exponents.empty() && facts_.has_curves) exponents = {starts[0][exponent], -2.0 * starts[0][exponent]};
      starts.resize(std::max<std::size_t>(exponents.size(), 1), starts[0]);
      for (std::size_t i = 0; i < exponents.size(); ++i) starts[i][exponent] = exponents[i];
    }
    std::optional<Estimate> first = estimate_from(shape, starts, name);
    if (!first) return false;
    const TriedLaw tried{shape.form, first->cost, infinite, true};
    conclude(std::move(first), tried, now_.noise);
    return !is_pending();
  }

  /// Where forces were measured at given depths: the start with the moduli that fit them best, whatever else the law
  /// has. Steps of all its numbers at once would make exponents pay for a wrong scale.
  VectorX scaled(const LawShape& shape, const VectorX& start, const std::string& name) {
    if (!facts_.has_curves) return start;
    Stage stage = task_stage(StageKind::Scale, shape, start, name);
    stage.iterations = brief_iterations;
    const StageRecord* record = ask(std::move(stage));
    return record && record->succeeded ? record->theta : start;
  }

  /// From each of the starts, each in a valley of its own; that with the least squares. Nothing where the next one is
  /// not known yet: the first form of all is the best that there is until then.
  /// @param is_compared  with the best by its squares: a start may end where the evidence is sure to rule the form out
  std::optional<Estimate> estimate_from(const LawShape& shape, const std::vector<VectorX>& starts,
                                        const std::string& name, bool is_compared = false) {
    std::optional<Estimate> found;
    for (const VectorX& start : starts) {
      const MarkerNoise noise = now_.noise;
      std::optional<Estimate> next =
          estimate(shape, now_.best ? start : scaled(shape, start, name), name, LawTask::Evidence::None, 0, false,
                   is_compared ? cost_to_reach(shape) : infinite);
      if (is_pending()) {
        if (!now_.best) now_.best = std::move(found);
        return std::nullopt;
      }
      if (next && (!found || squares_below(*next, *found)))
        found = std::move(next);
      else
        now_.noise = noise;
    }
    return found;
  }

  static bool squares_below(const Estimate& a, const Estimate& b) {
    return a.found.squares(b.found.deviation) < b.found.squares(b.found.deviation);
  }

  /// Half of what Schwarz's criterion asks of a form of the law for the numbers that it has more than the best.
  double price(double more) const { return 0.5 * more * std::log(best().found.observations); }

  /// The cost above which a form is ruled out (`fit_freer`), with the noise at hand, if it is the best one's: half the
  /// squares, about.
  double cost_to_reach(const LawShape& shape) const {
    if (facts_.are_curves() || !(now_.noise == best().found.noise)) return infinite;
    const double more = double(facts_.parameters(shape).dimension() - best().found.dimension);
    const double gain = price(more) - judgement.strong_evidence;  // of n/2 ln(sum r^2)
    return best().cost * std::exp(-2.0 * gain / best().found.observations);
  }

  /// More terms, or Poisson's ratios of their own for them. False where that is not kept.
  bool fit_freer(const LawForm& form, const std::vector<VectorX>& starts, const std::string& name) {
    const MarkerNoise noise = now_.noise;
    LawShape shape = best().shape;
    shape.form = form;
    const bool is_chosen = options().law_terms > 0 && form.terms > best().shape.form.terms;
    std::optional<Estimate> next = estimate_from(shape, starts, name, !is_chosen);
    TriedLaw tried{form, next ? next->cost : infinite, -infinite, false};
    if (next) {
      // Half the BIC by residuals whose deviation is unknown: n/2 ln(sum r^2) + k/2 ln n.
      const double deviation = next->found.deviation;
      const double n = next->found.observations;
      const auto more = double(next->found.dimension - best().found.dimension);
      tried.evidence =
          0.5 * n * std::log(best().found.squares(deviation) / next->found.squares(deviation)) - price(more);
      tried.kept = is_chosen || tried.evidence > judgement.strong_evidence;
    }
    conclude(std::move(next), tried, noise);
    return tried.kept && !is_pending();
  }

  void fit_terms(int most) {
    if (options().law_terms > 0) most = std::min(most, options().law_terms);
    while (best().shape.form.terms < most && !is_pending()) {
      LawForm form = best().shape.form;
      ++form.terms;
      if (std::ranges::find(now_.tried, form, &TriedLaw::form) != now_.tried.end()) break;
      const std::string name = std::to_string(form.terms) + " terms";
      std::vector<VectorX> starts;
      for (const double exponent : exponents_of_more(form.terms))
        starts.push_back(
            with_term(best().layout, best().theta, facts_.layout(form), exponent, facts_.are_curves() ? 0.03 : 0.2));
      if (!fit_freer(form, starts, name)) break;
      if (form.own_ratios || known_poissons_ratio(options())) continue;
      form.own_ratios = true;
      fit_freer(form, {carry_law(best().layout, best().theta, facts_.layout(form), as_they_are(form))},
                name + " apart");
    }
  }

  /// Where the exponent of one term more begins. The second has the other sign, or, where forces at given depths tell
  /// how an object stiffens, is steeper than the first; the third stiffens more than the first.
  std::vector<double> exponents_of_more(int terms) const {
    if (facts_.are_curves()) return facts_.curve_exponents;
    if (terms > 2) return {10.0};
    if (facts_.has_curves) return {-6.0, 14.0};
    return {-6.0};
  }

  void fit_zones() {
    if (facts_.is_specimen) return;
    const int most = options().law_zones > 0 ? options().law_zones : options().control_points > 1 ? 1 : most_zones;
    for (int zones = 2; zones <= most; ++zones)
      if (is_pending() || !fit_zone(zones)) return;
  }

  /// One zone more than there are. False where that is not kept.
  bool fit_zone(int zones) {
    const bool is_chosen = options().law_zones > 0;
    const std::string name = std::to_string(zones) + " zones";
    LawShape shape{{zones, best().shape.form.terms, zones, best().shape.form.own_ratios}, {}, best().shape.cuts};
    const StageRecord* promised = ask(task_stage(StageKind::Cut, best().shape, best().theta, name));
    if (!promised) return false;
    if (!promised->succeeded || (!is_chosen && promised->law->evidence < judgement.strong_evidence)) {
      conclude({}, {shape.form, infinite, promised->succeeded ? promised->law->evidence : -infinite, false},
               now_.noise);
      return false;
    }
    shape.cuts.push_back(*promised->law->cut);
    const MarkerNoise noise = now_.noise;
    const int from = shape.cuts.back().zone;
    std::optional<Estimate> next =
        estimate(shape, with_zone(best().layout, best().theta, facts_.layout(shape.form), from), name,
                 LawTask::Evidence::Zone, from);
    TriedLaw tried{shape.form, infinite, -infinite, false};
    if (next) {
      move_cuts(*next, from, name);
      tried.cost = next->cost;
      tried.evidence = next->found.evidence;
      tried.kept = is_chosen || is_of_parts(tried.evidence, *next);
      // While its cuts move, it is the best already where it will be kept as it is.
      if (is_pending() && tried.kept) now_.best = next;
    }
    conclude(std::move(next), tried, noise);
    return tried.kept && !is_pending();
  }

  /// Moves cuts one after the other to where they fit better, as long as that gains something.
  void move_cuts(Estimate& e, int split, const std::string& name) {
    const VectorX from = e.from;
    bool any = false;
    for (int pass = 0, gained = 1; pass < most_passes && gained > 0; ++pass) {
      gained = 0;
      for (std::size_t c = 0; c < e.shape.cuts.size(); ++c) {
        Stage stage = task_stage(StageKind::Move, e.shape, e.theta, name);
        stage.law->cut = int(c);
        const StageRecord* move = ask(std::move(stage));
        if (!move) return;
        if (!move->succeeded || move->law->evidence < judgement.strong_evidence) continue;
        LawShape shape = e.shape;
        shape.cuts[c].at = move->law->cut->at;
        std::optional<Estimate> moved = estimate(shape, e.theta, name, LawTask::Evidence::Zone, split, true);
        if (is_pending()) return;
        if (!moved || moved->cost > e.cost - judgement.strong_evidence) continue;
        e = std::move(*moved);
        e.from = from;
        ++gained;
      }
      any = any || gained > 0;
    }
    if (!any) return;
    const MarkerNoise noise = now_.noise;
    if (std::optional<Estimate> converged = estimate(e.shape, e.theta, name, LawTask::Evidence::Zone, split))
      e = std::move(*converged);
    else
      now_.noise = noise;
    e.from = from;
  }

  /// A law of its own for each region, against one shape of the law for all.
  void fit_laws_of_regions() {
    if (options().law_zones == 1 || is_pending()) return;
    const MarkerNoise noise = now_.noise;
    const LawForm& one = best().shape.form;
    const LawShape shape{{one.controls, one.terms, one.controls, one.own_ratios}};
    const VectorX start = carry_law(best().layout, best().theta, facts_.layout(shape.form), as_they_are(shape.form));
    std::optional<Estimate> next = estimate(shape, start, "a law a region", LawTask::Evidence::OwnLaws);
    TriedLaw tried{shape.form, infinite, -infinite, false};
    if (next) {
      tried.cost = next->cost;
      tried.evidence = next->found.evidence;
      tried.kept = options().law_zones > 1 || tried.evidence > judgement.strong_evidence;
    }
    conclude(std::move(next), tried, noise);
  }

  void fit_fields() {
    if (options().control_points == 1 || facts_.is_specimen) return;
    std::vector<int> sizes(field_sizes.begin(), field_sizes.end());
    if (options().control_points > 1) sizes = {options().control_points};
    for (const int size : sizes) {
      if (is_pending()) return;
      fit_field(size);  // a layer may need many points before any of them tells it from the next
    }
  }

  void fit_field(int size) {
    const MarkerNoise noise = now_.noise;
    const bool is_chosen = options().control_points > 1;
    const LawForm& before = best().shape.form;
    LawShape shape{{size, before.terms, 1, before.own_ratios}};
    const std::string name = std::to_string(size) + " control points";
    Stage points = task_stage(StageKind::ControlPoints, shape, best().theta, name);
    points.law->before = best().shape;
    const StageRecord* promised = ask(std::move(points));
    if (!promised || promised->law->points.empty()) return;
    shape.points = promised->law->points;
    TriedLaw tried{shape.form, promised->cost, promised->law->evidence, false};
    std::optional<Estimate> next;
    if (is_chosen || tried.evidence > 0.0) {
      next = estimate(shape, promised->theta, name, LawTask::Evidence::Field);
      if (next) {
        tried.cost = next->cost;
        tried.evidence = next->found.evidence;
        tried.kept = is_chosen || is_of_parts(tried.evidence, *next);
      }
    }
    conclude(std::move(next), tried, noise);
  }

  /// Whether moduli of their own for parts of the object have the evidence, and take enough off the squares of the
  /// residuals: what a law or a mesh lacks is no noise, and many markers make evidence of little.
  bool is_of_parts(double evidence, const Estimate& next) {
    if (evidence <= judgement.evidence_of_parts) return false;
    const double deviation = best().found.deviation;
    const double gain = best().shape.form.controls > 1 ? judgement.gain_of_zone : judgement.gain_of_second_modulus;
    return next.found.squares(deviation) < (1.0 - gain) * best().found.squares(deviation);
  }

  const LawFacts& facts_;
  const std::vector<StageRecord>& done_;
  std::size_t asked_ = 0;
  Standing now_;
};

LawPlan::Standing LawPlan::after(const std::vector<StageRecord>& done) const { return Replay(facts_, done).run(); }

}  // namespace pliant
