#include "estimation/press_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/curve_fit.hpp"
#include "estimation/field_choice.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/notes.hpp"
#include "estimation/problem.hpp"

namespace pliant {

namespace {

constexpr double outlier_scale = 6.0;  // deviations
constexpr std::array field_sizes = {4, 8, 16, 32};
constexpr double needed_evidence = 3.0;  // e^3 to 1
constexpr int most_zones = 8, most_passes = 4, brief_iterations = 8;
constexpr double least_gain = 0.03;  // by a zone more, of the squares of the residuals

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// The deviation that residuals show, by the median of their sizes; the least where there are none.
double robust_deviation(std::vector<double> residuals, double least) {
  if (residuals.empty()) return least;
  for (double& r : residuals) r = std::abs(r);
  return std::max(least, 1.4826 * median(std::move(residuals)));
}

std::shared_ptr<const Body> with_field(const Body& body, ModulusField field) {
  auto copy = std::make_shared<Body>(body);
  copy->modulus = std::move(field);
  return copy;
}

/// Sum of the squares of all residuals [m^2]: of markers as they are, of curves over their standard deviations and
/// times the square of `noise`.
double squares_of(const CostEvaluation& evaluation, double noise) {
  double sum = 0.0;
  for (const FrameFit& f : evaluation.frames) sum += f.tracks > 0 ? f.track_sum_squares : 2.0 * f.cost * noise * noise;
  return sum;
}

/// Every control and law as it is.
std::vector<int> as_they_are(const LawForm& form) {
  std::vector<int> like;
  for (int k = 0; k < form.controls; ++k) like.push_back(k);
  return like;
}

/// The estimate with one term more in each law, which begins small.
VectorX with_term(const LawLayout& from, const VectorX& theta, const LawLayout& to) {
  VectorX more = carry_law(from, theta, to, as_they_are(to.form()));
  const int added = to.form().terms - 1;
  for (int law = 0; law < to.form().laws; ++law) {
    // The second term has the other sign, the third stiffens more than the first.
    more[to.exponent(added, law)] = added == 1 ? -6.0 : 10.0;
    more[to.stiffness_ratio(added, law)] = 0.2;
    more[to.poissons_ratio(added, law)] = theta[from.poissons_ratio(0, law)];
  }
  return more;
}

class PressFit {
 public:
  PressFit(const Capture& capture, const FitOptions& options, const FitMonitor& monitor, FitState state)
      : capture_(capture), options_(options), monitor_(monitor), all_state_(std::move(state)) {
    if (!all_state_.law) all_state_.law.emplace();
    if (const std::string wrong = options.validate(); !wrong.empty())
      throw InputError({{capture.file}, wrong, "", "see `pliant fit --help`"});
    if (!capture.scene.object.surface)
      throw InputError({{capture.file},
                        "there is no scan of the object at rest ([object] surface)",
                        "a closed triangle mesh",
                        "scan the object and name the mesh in capture.toml"});
    Resolution resolution;
    resolution.cells = options.cells;
    resolution.element = options.element.value_or(ElementKind::Tetrahedron);
    std::vector<Vector3> control_points;
    const auto body = make_body_of(capture.scene, SignedDistance(), resolution, control_points);
    scene_ = std::make_shared<PressScene>(make_press_scene(capture, body));
    for (int i = 0; i < int(scene_->presses.size()); ++i)
      if (scene_->presses[std::size_t(i)].role == "fit") fitted_.push_back(i);
    if (fitted_.empty() && !scene_->static_tests().any_to_fit())
      throw InputError({{capture.file},
                        "no static test is to be fitted",
                        "a block [[press]], [[indentation]], [[grip]] or [[material_curve]] whose role is \"fit\"",
                        ""});
    if (fitted_.empty() && options.material == MaterialKind::Sampled)
      throw InputError({{capture.file},
                        "material=sampled and no press to fit",
                        "blocks [[press]], whose markers show where the object is how stiff",
                        "leave out material, or choose ogden, neo_hookean or linear"});
    regions_ = body->modulus.controls > 1;
    noise_ = options.marker_noise > 0.0 ? options.marker_noise : scene_->noise;
  }

  FitOutcome run() {
    const bool has_two_numbers =
        options_.material == MaterialKind::Linear || options_.material == MaterialKind::NeoHookean;
    if (!fit_first(has_two_numbers ? 0 : 1)) return finish();
    if (options_.material == MaterialKind::Ogden || options_.material == MaterialKind::Automatic) {
      fit_terms(2);
      if (regions_)
        fit_laws_of_regions();
      else
        fit_zones();
      fit_terms(3);  // an object of several materials looks like one of more terms
      if (!regions_ && best_->layout.form().laws == 1) fit_fields();
    }
    if (!interrupted_ && options_.material == MaterialKind::Sampled) fit_samples();
    return finish();
  }

 private:
  struct Estimate {
    LawLayout layout;
    std::shared_ptr<const PressScene> scene;
    ParameterSet parameters;
    VectorX theta;
    CostEvaluation evaluation;
    double start_cost = 0.0, noise = 0.0;
    std::vector<Vector3> points;
    std::vector<ZoneCut> cuts;
    bool converged = false;
    std::string reason;
  };
  enum class Effort { Full, Brief };  // brief: the noise stays, a few iterations
  /// A form of the law before it is fitted.
  struct Form {
    LawLayout layout;
    std::shared_ptr<const PressScene> scene;
    std::vector<Vector3> points = {};  // of a field
    std::vector<ZoneCut> cuts = {};    // of zones
  };

  LawLayout layout_of(const LawForm& form) const {
    return LawLayout(form, regions_ ? modulus_names(capture_, form.controls) : std::vector<std::string>{});
  }

  ParameterSet parameters_of(const Form& form) const {
    ParameterSet set = zone_parameters(form.layout, start_modulus(), options_.modulus_variation);
    if (const auto known = known_poissons_ratio(options_))
      for (const Parameter& p : set.parameters())
        if (p.transform == Transform::LogitHalf) set.fix(p.name, *known);
    if (!form.points.empty())
      set.set_joint_prior(form.layout.modulus_names(),
                          field_precision(form.points, form.scene->body->size(), options_.modulus_variation));
    return set;
  }
  double start_modulus() const { return (fitted_.empty() ? 1.0 : 2.0) * punch_modulus(*scene_, 0.3); }

  bool stop() { return interrupted_ = interrupted_ || (monitor_.interrupted && monitor_.interrupted()); }

  /// Minimises from theta; with the noise of its own residuals in the end. Nothing where it cannot be evaluated.
  std::optional<Estimate> minimised(const Form& form, const VectorX& theta, const std::string& stage,
                                    Effort effort = Effort::Full) {
    const bool is_brief = effort == Effort::Brief;
    Estimate e = begun(form, theta);
    std::optional<PressObjective> objective;
    OptimiserOptions o;
    o.max_iterations = is_brief ? brief_iterations : options_.max_iterations;
    o.damps_long_steps = true;
    OptimiserState from;
    if (!is_brief) from = std::exchange(search().under_way, {}), search().cuts = form.cuts;
    if (from.p.size() != e.parameters.dimension()) from = {0, e.parameters.to_unconstrained(theta), {}};
    OptimiserSummary s;
    // Twice: contact is as stiff, and outliers weigh as little, as the law and the noise at the beginning say.
    for (int round = 0; round < (is_brief ? 1 : 2) && !interrupted_; ++round) {
      std::optional<PressObjective> next(objective_of(e));
      const OptimiserSummary done = minimise(next->cost(), from, o, [&](const Iteration& i) {
        report(stage, i.number, i.cost, *next, e.parameters.to_theta(i.p), form.layout);
        if (!is_brief) keep_under_way(i.state(), form.cuts);
        return !stop();
      });
      if (round > 0 && !done.succeeded) break;  // the first round stands
      s = done;
      objective.emplace(std::move(*next));
      if (!s.succeeded) break;
      e.parameters.set_reference(e.parameters.to_theta(s.p));
      if (!is_brief && options_.marker_noise <= 0.0)
        noise_ = robust_deviation(objective->residuals(), 1e-6 * scene_->body->size());
      objective->set_options({noise_, outlier_scale});
      from = {0, s.p, {}};
    }
    if (!is_brief) search().under_way = {}, search().cuts.clear();
    if (!s.succeeded) {
      if (!is_brief) outcome_.notes.push_back(stage + ": " + s.reason);
      return std::nullopt;
    }
    const CostEvaluation begin = objective->evaluate(e.parameters.to_unconstrained(theta));
    if (begin.succeeded) e.start_cost = begin.cost;
    e.theta = e.parameters.to_theta(s.p);
    e.evaluation = objective->linearise(s.p);
    e.noise = noise_;
    e.converged = s.converged;
    e.reason = s.reason;
    if (!e.evaluation.succeeded) return std::nullopt;
    return e;
  }

  void keep_under_way(OptimiserState state, const std::vector<ZoneCut>& cuts) {
    search().under_way = std::move(state);
    search().cuts = cuts;
    save();
  }

  void report(const std::string& stage, int iteration, double cost, const PressObjective& objective,
              const VectorX& theta, const LawLayout& layout) {
    FitEvent event;
    event.kind = StageKind::Law, event.stage = stage, event.iteration = iteration, event.cost = cost;
    event.theta = theta, event.layout = std::make_shared<ParameterLayout>(layout.layout());
    const std::vector<double> residuals = objective.residuals();
    double sum = 0.0;
    for (const double r : residuals) sum += r * r;
    event.marker_rms = std::sqrt(3.0 * sum / double(std::max<std::size_t>(residuals.size(), 1)));
    double log = 0.0;
    const int controls = layout.form().controls;
    for (int k = 0; k < controls; ++k) log += std::log(theta[layout.modulus(k)]) / controls;
    event.youngs_modulus = std::exp(log);
    emit(std::move(event));
  }

  Estimate begun(const Form& form, const VectorX& theta) const {
    Estimate e{form.layout, form.scene, parameters_of(form), theta, {}, 0.0, noise_, form.points, form.cuts, false, {}};
    e.parameters.set_reference(theta);  // contact is as stiff as the law there asks for
    return e;
  }
  PressObjective objective_of(const Estimate& e) const {
    return {e.scene, fitted_, e.layout, e.parameters, {noise_, outlier_scale}};
  }

  /// What an interrupted fit had done of this form, if anything.
  const FitState::LawSearch::Done* done_before(const LawForm& form) const {
    const auto it =
        std::ranges::find(search().done, form, [](const FitState::LawSearch::Done& d) { return d.tried.form; });
    return it == search().done.end() ? nullptr : &*it;
  }

  /// Keeps the estimate as the best, where it is that, and writes down that it was tried.
  void conclude(std::optional<Estimate> next, const TriedLaw& tried, double noise_before,
                const std::vector<ZoneCut>& cuts = {}) {
    law_.tried.push_back(tried);
    if (!interrupted_ && !done_before(tried.form)) {
      search().done.push_back({tried, cuts, next ? next->theta : VectorX(), noise_});
      save();
    }
    if (tried.kept)
      best_ = std::move(next);
    else
      noise_ = noise_before;
  }

  std::optional<Estimate> estimate(const Form& form, const VectorX& start, const std::string& stage) {
    const auto* done = done_before(form.layout.form());
    if (!done) return minimised(form, start, stage);
    if (done->theta.size() == 0) return std::nullopt;
    noise_ = done->noise;
    Estimate e = begun(form, done->theta);
    e.converged = true;
    e.reason = "finished before";
    e.evaluation = objective_of(e).linearise(e.parameters.to_unconstrained(done->theta));
    if (!e.evaluation.succeeded) return std::nullopt;
    return e;
  }

  bool fit_first(int terms) {
    const bool is_neo_hookean = options_.material == MaterialKind::NeoHookean;
    const LawForm law{scene_->body->modulus.controls, terms, 1, false,
                      is_neo_hookean ? TwoNumberLaw::NeoHookean : TwoNumberLaw::Linear};
    const Form form{layout_of(law), scene_};
    const char* const stage = terms > 0 ? "1 term" : is_neo_hookean ? "neo-Hookean" : "linear";
    auto first = estimate(form, scaled(form, parameters_of(form).reference()), stage);
    if (terms == 1 && scene_->static_tests().any_to_fit() && !done_before(form.layout.form()) && !stop())
      try_other_sign(form, first);
    if (!first) {
      outcome_.reason = outcome_.notes.empty() ? "the start cannot be evaluated" : outcome_.notes.back();
      return false;
    }
    const TriedLaw tried{form.layout.form(), first->evaluation.cost, infinite, true};
    conclude(std::move(first), tried, noise_);
    return !interrupted_;
  }

  /// Where forces were measured at given depths: the start with the moduli that fit them best, whatever else the law
  /// has. Steps of all its numbers at once would make exponents pay for a wrong scale.
  VectorX scaled(const Form& form, const VectorX& start) {
    if (!scene_->static_tests().any_to_fit() || done_before(form.layout.form())) return start;
    Estimate e = begun(form, start);
    const std::vector<Parameter> all = e.parameters.parameters();
    for (const Parameter& p : all)
      if (p.unit != "Pa") e.parameters.set_estimated(p.name, false);
    PressObjective objective = objective_of(e);
    OptimiserOptions o;
    o.max_iterations = brief_iterations;
    const OptimiserSummary s = minimise(objective.cost(), {0, e.parameters.to_unconstrained(start), {}}, o,
                                        [&](const Iteration&) { return !stop(); });
    return s.succeeded ? e.parameters.to_theta(s.p) : start;
  }

  /// Curves of growing load fit exponents of either sign, each in a valley of its own: keeps the better.
  void try_other_sign(const Form& form, std::optional<Estimate>& first) {
    const double noise = noise_;
    VectorX start = parameters_of(form).reference();
    start[form.layout.exponent(0)] *= -2.0;
    auto other = minimised(form, scaled(form, start), "1 term");
    if (other && (!first || squares_of(other->evaluation, noise) < squares_of(first->evaluation, noise)))
      first = std::move(other);
    else
      noise_ = noise;
  }

  /// More terms, or Poisson's ratios of their own for them. False where that is not kept.
  bool fit_freer(const LawLayout& layout, const VectorX& start, const std::string& stage) {
    const double noise = noise_;
    const Form form{layout, best_->scene, best_->points, best_->cuts};
    auto next = estimate(form, start, stage);
    TriedLaw tried{layout.form(), next ? next->evaluation.cost : infinite, -infinite, false};
    if (next) {
      // Half the BIC by residuals whose deviation is unknown: n/2 ln(sum r^2) + k/2 ln n.
      const double n = next->evaluation.independent_observations();
      const auto more = double(next->parameters.dimension() - best_->parameters.dimension());
      tried.evidence =
          0.5 * n * std::log(squares_of(best_->evaluation, noise_) / squares_of(next->evaluation, noise_)) -
          0.5 * more * std::log(n);
      tried.kept = (options_.law_terms > 0 && layout.form().terms > best_->layout.form().terms) ||
                   tried.evidence > needed_evidence;
    }
    conclude(std::move(next), tried, noise, form.cuts);
    return tried.kept && !interrupted_;
  }

  void fit_terms(int most) {
    if (options_.law_terms > 0) most = std::min(most, options_.law_terms);
    while (best_->layout.form().terms < most && !stop()) {
      LawForm form = best_->layout.form();
      ++form.terms;
      if (std::ranges::find(law_.tried, form, &TriedLaw::form) != law_.tried.end()) break;
      const std::string stage = std::to_string(form.terms) + " terms";
      const LawLayout layout = layout_of(form);
      if (!fit_freer(layout, with_term(best_->layout, best_->theta, layout), stage)) break;
      if (form.own_ratios || known_poissons_ratio(options_) || stop()) continue;
      form.own_ratios = true;
      const LawLayout apart = layout_of(form);
      fit_freer(apart, carry_law(best_->layout, best_->theta, apart, as_they_are(form)), stage + " apart");
    }
  }

  std::shared_ptr<const PressScene> with_zones(const std::vector<ZoneCut>& cuts) const {
    auto scene = std::make_shared<PressScene>(*scene_);
    const std::vector<int> zone_of = zones_after(zone_coordinates(*scene_->body), cuts);
    scene->body = with_field(*scene_->body, zone_field(scene_->body->modulus, zone_of, int(cuts.size()) + 1));
    return scene;
  }

  void fit_zones() {
    if (!scene_->static_tests().curves.empty()) return;  // of a specimen: the object is of one material
    const int most = options_.law_zones > 0 ? options_.law_zones : options_.control_points > 1 ? 1 : most_zones;
    for (int zones = 2; zones <= most; ++zones)
      if (stop() || !fit_zone(zones)) return;
  }

  /// One zone more than there are. False where that is not kept.
  bool fit_zone(int zones) {
    const bool is_chosen = options_.law_zones > 0;
    const LawForm form{zones, best_->layout.form().terms, zones, best_->layout.form().own_ratios};
    const LawLayout layout = layout_of(form);
    std::optional<PromisedCut> promised;
    std::vector<ZoneCut> cuts = best_->cuts;
    const FitState::LawSearch::Done* done = done_before(form);
    if (done && !done->cuts.empty()) {
      cuts = done->cuts;
    } else if (done) {
      law_.tried.push_back(done->tried);
      return false;
    } else if (search().under_way.p.size() > 0 && int(search().cuts.size()) == zones - 1) {
      cuts = search().cuts;
    } else {
      PressObjective objective = objective_of(*best_);
      promised = most_promising_cut(objective, *best_->scene, best_->layout, best_->theta, best_->cuts,
                                    options_.modulus_variation);
      if (promised) cuts.push_back(promised->cut);
      if (!promised || (!is_chosen && promised->evidence < needed_evidence)) {
        conclude({}, {form, infinite, promised ? promised->evidence : -infinite, false}, noise_);
        return false;
      }
    }
    const double noise = noise_;
    const int from = cuts.back().zone;
    auto next = estimate({layout, with_zones(cuts), {}, cuts}, with_zone(best_->layout, best_->theta, layout, from),
                         std::to_string(zones) + " zones");
    TriedLaw tried{layout.form(), infinite, -infinite, false};
    if (next) {
      if (!done) move_cuts(*next);
      cuts = next->cuts;
      tried.cost = next->evaluation.cost;
      tried.evidence = zone_evidence(next->evaluation, next->parameters, next->parameters.to_unconstrained(next->theta),
                                     layout, from, options_.modulus_variation);
      tried.kept = is_chosen ||
                   (tried.evidence > needed_evidence &&
                    squares_of(next->evaluation, noise_) < (1.0 - least_gain) * squares_of(best_->evaluation, noise_));
    }
    conclude(std::move(next), tried, noise, cuts);
    return tried.kept;
  }

  /// Moves cuts one after the other to where they fit better, as long as that gains something.
  void move_cuts(Estimate& e) {
    const std::string stage = std::to_string(e.layout.form().controls) + " zones";
    const double start_cost = e.start_cost;
    const auto keep = [&] { keep_under_way({0, e.parameters.to_unconstrained(e.theta), {}}, e.cuts); };
    keep();
    bool any = false;
    for (int pass = 0, gained = 1; pass < most_passes && gained > 0; ++pass) {
      gained = 0;
      for (std::size_t c = 0; c < e.cuts.size() && !stop(); ++c) {
        PressObjective objective = objective_of(e);
        const auto move = best_move(objective, *e.scene, e.layout, e.theta, e.cuts, c, options_.modulus_variation);
        if (!move || move->gain < needed_evidence) continue;
        Form form{e.layout, nullptr, {}, e.cuts};
        form.cuts[c].at = move->at;
        form.scene = with_zones(form.cuts);
        auto moved = minimised(form, e.theta, stage, Effort::Brief);
        if (interrupted_ || !moved || moved->evaluation.cost > e.evaluation.cost - needed_evidence) continue;
        e = std::move(*moved);
        keep();
        ++gained;
      }
      any = any || gained > 0;
    }
    if (interrupted_) return;  // to be gone on with
    if (any) {
      if (auto converged = minimised({e.layout, e.scene, {}, e.cuts}, e.theta, stage))
        e = std::move(*converged);
      else
        noise_ = e.noise;
    }
    e.start_cost = start_cost;
    search().under_way = {}, search().cuts.clear();
  }

  /// A law of its own for each region, against one shape of the law for all.
  void fit_laws_of_regions() {
    if (options_.law_zones == 1 || stop()) return;
    const double noise = noise_;
    const LawForm& one = best_->layout.form();
    const LawLayout layout = layout_of({one.controls, one.terms, one.controls, one.own_ratios});
    const VectorX start = carry_law(best_->layout, best_->theta, layout, as_they_are(layout.form()));
    auto next = estimate({layout, best_->scene}, start, "a law a region");
    TriedLaw tried{layout.form(), infinite, -infinite, false};
    if (next) {
      tried.cost = next->evaluation.cost;
      tried.evidence =
          own_laws_evidence(next->evaluation, next->parameters, next->parameters.to_unconstrained(next->theta), layout,
                            options_.modulus_variation);
      tried.kept = options_.law_zones > 1 || tried.evidence > needed_evidence;
    }
    conclude(std::move(next), tried, noise);
  }

  void fit_fields() {
    if (options_.control_points == 1 || !scene_->static_tests().curves.empty()) return;
    std::vector<int> sizes(field_sizes.begin(), field_sizes.end());
    if (options_.control_points > 1) sizes = {options_.control_points};
    for (const int size : sizes) {
      if (stop()) return;
      fit_field(size);  // a layer may need many points before any of them tells it from the next
    }
  }

  void fit_field(int size) {
    const double noise = noise_;
    ControlledField field;
    try {
      field = harmonic_field(*best_->scene->body, farthest_points(*best_->scene->body, size));
    } catch (const InputError&) {
      return;  // more points than the mesh has places for
    }
    auto scene = std::make_shared<PressScene>(*best_->scene);
    scene->body = with_field(*best_->scene->body, field.field);
    const LawForm& before = best_->layout.form();
    const LawLayout layout = layout_of({size, before.terms, 1, before.own_ratios});
    const Form form{layout, scene, field.points};
    const MatrixX carried = carried_over(*scene->body, best_->scene->body->modulus, scene->body->modulus);
    VectorX start = carry_law(best_->layout, best_->theta, layout, std::vector<int>(std::size_t(size), 0));
    VectorX logs{before.controls};
    for (int k = 0; k < before.controls; ++k) logs[k] = std::log(best_->theta[best_->layout.modulus(k)]);
    const VectorX moduli = (carried * logs).array().exp();
    for (int k = 0; k < size; ++k) start[layout.modulus(k)] = moduli[k];
    TriedLaw tried{layout.form(), infinite, -infinite, false};
    std::optional<Estimate> next;
    const bool is_chosen = options_.control_points > 1;
    if (const auto* done = done_before(layout.form()); done && done->theta.size() == 0) tried = done->tried;
    if (is_chosen || done_before(layout.form()) || promises(form, start, carried, tried)) {
      next = estimate(form, start, std::to_string(size) + " control points");
      if (next) {
        tried.cost = next->evaluation.cost;
        tried.evidence = log_bayes_factor(next->evaluation, next->parameters,
                                          next->parameters.to_unconstrained(next->theta), carried);
        tried.kept = is_chosen || tried.evidence > needed_evidence;
      }
    }
    conclude(std::move(next), tried, noise);
  }

  /// Whether a step from where the coarser field is promises any evidence.
  bool promises(const Form& form, const VectorX& start, const MatrixX& carried, TriedLaw& tried) {
    const Estimate e = begun(form, start);
    PressObjective objective = objective_of(e);
    const VectorX p = e.parameters.to_unconstrained(start);
    const CostEvaluation evaluation = objective.linearise(p);
    if (!evaluation.succeeded) return false;
    tried.cost = evaluation.cost;
    tried.evidence = log_bayes_factor(evaluation, e.parameters, p, carried);
    return tried.evidence > 0.0;
  }

  void fit_samples() {
    const auto law = press_law(*best_->scene->body, best_->layout, best_->theta);
    // Each press shows its own mean stiffness: smooth about what the law of all has near rest.
    const SmallStrainModuli start{mean_modulus(*scene_->body, *law), best_->theta[best_->layout.poissons_ratio()]};
    const ElementSmoothness smoothness(*scene_->body);
    SampleFitOptions options;
    options.noise = noise_;
    options.max_iterations = options_.max_iterations;
    std::vector<PressSample>& samples = search().samples;
    std::mutex mutex;
    // A few at a time, so that an interruption loses little.
    const std::size_t batch = 4;
    while (samples.size() < fitted_.size() && !stop()) {
      const std::size_t begin = samples.size(), end = std::min(begin + batch, fitted_.size());
      std::vector<PressSample> part(end - begin);
      parallel_for(begin, end, [&](std::size_t i) {
        SampleFitOptions own = options;
        const ObservedPress& seen = scene_->presses[std::size_t(fitted_[i])];
        // The misfit of one law for all is no noise: what a press' markers show by themselves is, where that is less.
        if (options_.marker_noise <= 0.0)
          own.noise = std::min(noise_, std::max(marker_noise(seen), 1e-3 * seen.greatest_displacement));
        part[i - begin] = fit_sample(*scene_, fitted_[i], start, smoothness, own);
      });
      for (PressSample& sample : part) {
        FitEvent event;
        event.kind = StageKind::Sample, event.stage = "press " + std::to_string(samples.size() + 1);
        event.iteration = sample.iterations, event.cost = sample.weight, event.marker_rms = sample.rms;
        event.youngs_modulus = start.youngs_modulus;
        emit(std::move(event));
        samples.push_back(std::move(sample));
      }
      save();
    }
    law_.samples = samples;
    std::vector<MaterialSample> usable;
    for (std::size_t i = 0; i < samples.size(); ++i)
      if (samples[i].succeeded)
        usable.push_back(samples[i].sample);
      else
        outcome_.notes.push_back(fmt::format("{} takes no part in the sampled material: {}",
                                             scene_->presses[std::size_t(fitted_[i])].name, samples[i].failure));
    if (usable.empty()) return;
    law_.sampled = sample_material(usable, {options_.basis_tolerance, options_.basis_samples});
  }

  FitOutcome finish() {
    outcome_.interrupted = interrupted_;
    outcome_.cells = options_.cells;
    if (!best_) return std::move(outcome_);
    Estimate& e = *best_;
    law_.scene = e.scene, law_.layout = e.layout, law_.noise = e.noise, law_.cuts = e.cuts;
    law_.law = press_law(*e.scene->body, e.layout, e.theta);
    if (law_.sampled) law_.law = law_.sampled->law;
    if (!interrupted_) law_.predictions = predict_presses(*e.scene, law_.law);
    outcome_.theta = e.theta;
    outcome_.parameters = e.parameters;
    outcome_.parameters.set_reference(e.theta);
    outcome_.evaluation = e.evaluation;
    outcome_.start_cost = e.start_cost, outcome_.final_cost = e.evaluation.cost;
    outcome_.converged = e.converged && !interrupted_;
    outcome_.reason = interrupted_ ? "interrupted" : e.reason;
    add_uncertainty(outcome_);
    outcome_.recordings.push_back(as_recording(e.scene->body, e.layout, outcome_));
    outcome_.recordings.back().discretisation.control_points = e.points;
    for (std::string& note : unused_choices(options_, false, true)) outcome_.notes.push_back(std::move(note));
    add_law_notes(outcome_.notes, law_, capture_);
    outcome_.law = std::move(law_);
    return std::move(outcome_);
  }

  FitState::LawSearch& search() { return *all_state_.law; }
  const FitState::LawSearch& search() const { return *all_state_.law; }
  void save() {
    if (monitor_.on_state) monitor_.on_state(all_state_);
  }
  void emit(FitEvent event) {
    if (monitor_.on_event) monitor_.on_event(event);
    outcome_.history.push_back(std::move(event));
  }

  const Capture& capture_;
  FitOptions options_;
  const FitMonitor& monitor_;
  FitState all_state_;
  std::shared_ptr<const PressScene> scene_;
  std::vector<int> fitted_;
  bool regions_ = false, interrupted_ = false;
  double noise_ = 0.0;
  std::optional<Estimate> best_;
  LawOutcome law_;
  FitOutcome outcome_;
};

/// What presses do not know is refused; what they merely do not use is told (`unused_choices`).
void require_known(const Capture& capture, const FitOptions& options) {
  const auto refuse = [&](const char* what, const char* advice) {
    throw InputError({{capture.file}, what, "a fit of one capture's presses", advice});
  };
  if (options.element == ElementKind::Hexahedron)
    refuse("element=hexahedra: presses are met by tetrahedra, which follow the shape",
           "leave out element, or choose tetrahedra or quadratic_tetrahedra");
  if (options.refine > 1) refuse("presses and --refine", "fit with other `cells` and compare");
  for (const auto& [name, choice] : options.parameters)
    if (name != "poissons_ratio" || !choice.start || choice.estimated != false)
      refuse("choices about single parameters, of which fits of static tests know a given Poisson's ratio alone",
             "leave them out, or give poissons_ratio and poissons_ratio.estimate=false");
}

}  // namespace

std::optional<double> known_poissons_ratio(const FitOptions& options) {
  const auto known = options.parameters.find("poissons_ratio");
  if (known == options.parameters.end() || !known->second.start || known->second.estimated != false)
    return std::nullopt;
  return (*known->second.start)[0];
}

RecordingOutcome as_recording(const std::shared_ptr<const Body>& body, const LawLayout& layout,
                              const FitOutcome& outcome) {
  RecordingOutcome recording;
  recording.discretisation.body = recording.rest_body = body;
  MaterialBlocks& material = recording.discretisation.simulation.blocks;
  material.youngs_moduli.clear();
  for (int k = 0; k < layout.form().controls; ++k) material.youngs_moduli.push_back(layout.modulus(k));
  recording.theta = outcome.theta;
  recording.evaluation = outcome.evaluation;
  return recording;
}

FitOutcome fit_presses(const Capture& capture, const FitOptions& options, const FitMonitor& monitor, FitState resume) {
  require_known(capture, options);
  if (is_of_material_curves(capture)) return fit_material_curves(capture, options);
  return PressFit(capture, options, monitor, std::move(resume)).run();
}

}  // namespace pliant
