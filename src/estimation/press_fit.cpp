#include "estimation/press_fit.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "base/error.hpp"
#include "estimation/field_choice.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/problem.hpp"

namespace pliant {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double outlier_scale = 6.0;  // deviations
constexpr std::array field_sizes = {4, 8, 16, 32};
constexpr double needed_evidence = 3.0;  // e^3 to 1

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// The deviation that residuals show, by the median of their sizes.
double robust_deviation(std::vector<double> residuals, double least) {
  for (double& r : residuals) r = std::abs(r);
  return std::max(least, 1.4826 * median(std::move(residuals)));
}

std::shared_ptr<const Body> with_field(const Body& body, ModulusField field) {
  auto copy = std::make_shared<Body>(body);
  copy->modulus = std::move(field);
  return copy;
}

/// The estimate with one term more, which begins small.
VectorX with_term(const PressTheta& from, const VectorX& theta) {
  const PressTheta to{from.controls, from.terms + 1};
  VectorX more = VectorX::Zero(to.size());
  more.head(2 + from.shapes()) = theta.head(2 + from.shapes());
  more.tail(from.controls - 1) = theta.tail(from.controls - 1);
  // The second term has the other sign, the third stiffens more than the first.
  more[to.exponent(to.terms - 1)] = to.terms % 2 == 0 ? -6.0 : 10.0;
  more[to.ratio(to.terms - 1)] = 0.2;
  return more;
}

class PressFit {
 public:
  PressFit(const Capture& capture, const PressFitOptions& options, const PressFitMonitor& monitor, PressFitState state)
      : capture_(capture), options_(options), monitor_(monitor), state_(std::move(state)) {
    if (const std::string wrong = options.validate(); !wrong.empty())
      throw InputError({{capture.file}, wrong, "", "see `pliant fit --help`"});
    if (!capture.surface)
      throw InputError({{capture.file},
                        "there is no scan of the object at rest ([object] surface)",
                        "a closed triangle mesh",
                        "scan the object and name the mesh in capture.toml"});
    Resolution resolution;
    resolution.cells = options.cells;
    resolution.element = options.quadratic ? ElementKind::QuadraticTetrahedron : ElementKind::Tetrahedron;
    std::vector<Vector3> control_points;
    const auto body = make_body_of(capture, SignedDistance(), resolution, control_points);
    scene_ = std::make_shared<PressScene>(make_press_scene(capture, body));
    for (int i = 0; i < int(scene_->presses.size()); ++i)
      if (scene_->presses[std::size_t(i)].role == "fit") fitted_.push_back(i);
    if (fitted_.empty())
      throw InputError({{capture.file}, "no press is to be fitted", "a block [[press]] whose role is \"fit\"", ""});
    regions_ = body->modulus.controls > 1;
    noise_ = options.noise > 0.0 ? options.noise : scene_->noise;
  }

  PressFitOutcome run() {
    outcome_.scene = scene_;
    const bool is_linear = options_.material == PressMaterial::Linear;
    const int first = is_linear ? 0 : options_.material == PressMaterial::Sampled ? 1 : std::max(1, options_.terms);
    if (!fit_first(is_linear ? 0 : std::min(first, 1))) return finish();
    if (options_.material == PressMaterial::Ogden) {
      for (int terms = 2; terms <= (options_.terms > 0 ? options_.terms : 3); ++terms)
        if (!fit_more_terms(terms)) break;
      if (!interrupted_ && !regions_) fit_fields();
    }
    if (!interrupted_ && options_.material == PressMaterial::Sampled) fit_samples();
    return finish();
  }

 private:
  struct Estimate {
    PressTheta layout;
    std::shared_ptr<const PressScene> scene;
    ParameterSet parameters;
    VectorX theta;
    CostEvaluation evaluation;
    double start_cost = 0.0, noise = 0.0;
    std::vector<Vector3> points;
    bool converged = false;
    std::string reason;
  };

  std::vector<std::string> names(int controls) const {
    if (regions_ || controls == 1) return modulus_names(capture_, controls);
    std::vector<std::string> all;
    for (int k = 0; k < controls; ++k) all.push_back("youngs_modulus@" + std::to_string(k + 1));
    return all;
  }

  ParameterSet parameters_of(const PressTheta& layout, const std::shared_ptr<const PressScene>& scene,
                             const std::vector<Vector3>& points) const {
    ParameterSet set = press_parameters(*scene->body, names(layout.controls), layout.terms, start_modulus());
    if (!points.empty())
      set.set_joint_prior(names(layout.controls),
                          field_precision(points, scene->body->size(), options_.modulus_variation));
    return set;
  }
  double start_modulus() const { return 2.0 * punch_modulus(*scene_, 0.3); }

  bool stop() { return interrupted_ = interrupted_ || (monitor_.interrupted && monitor_.interrupted()); }

  /// Minimises from theta; with the noise of its own residuals in the end. Nothing where it cannot be evaluated.
  std::optional<Estimate> minimised(const PressTheta& layout, std::shared_ptr<const PressScene> scene,
                                    const std::vector<Vector3>& points, const VectorX& theta,
                                    const std::string& stage) {
    Estimate e{layout, scene, parameters_of(layout, scene, points), theta, {}, 0.0, noise_, points, false, {}};
    PressObjective objective(scene, fitted_, layout, e.parameters, {noise_, outlier_scale});
    OptimiserOptions o;
    o.max_iterations = options_.max_iterations;
    OptimiserState from = state_.under_way;
    state_.under_way = {};
    if (from.p.size() != e.parameters.dimension()) from = {0, e.parameters.to_unconstrained(theta), {}};
    OptimiserSummary s;
    // Twice where the noise is not given: weights of outliers follow from it.
    for (int round = 0; round < (options_.noise > 0.0 ? 1 : 2) && !interrupted_; ++round) {
      s = minimise(objective, from, o, [&](const Iteration& i) {
        state_.under_way = i.state();
        report(stage, i.number, i.cost, objective, e.parameters.to_theta(i.p), layout);
        if (monitor_.on_state) monitor_.on_state(state_);
        return !stop();
      });
      if (!s.succeeded) break;
      if (options_.noise <= 0.0) noise_ = robust_deviation(objective.residuals(), 1e-6 * scene->body->size());
      objective.set_options({noise_, outlier_scale});
      from = {0, s.p, {}};
    }
    state_.under_way = {};
    if (!s.succeeded) {
      outcome_.notes.push_back(stage + ": " + s.reason);
      return std::nullopt;
    }
    const CostEvaluation begin = objective.evaluate(e.parameters.to_unconstrained(theta));
    if (begin.succeeded) e.start_cost = begin.cost;
    e.theta = e.parameters.to_theta(s.p);
    e.evaluation = objective.linearise(s.p);
    e.noise = noise_;
    e.converged = s.converged;
    e.reason = s.reason;
    if (!e.evaluation.succeeded) return std::nullopt;
    return e;
  }

  void report(const std::string& stage, int iteration, double cost, const PressObjective& objective,
              const VectorX& theta, const PressTheta& layout) {
    PressFitEvent event{stage, iteration, cost, 0.0, 0.0};
    const std::vector<double> residuals = objective.residuals();
    double sum = 0.0;
    for (const double r : residuals) sum += r * r;
    event.marker_rms = std::sqrt(3.0 * sum / double(std::max<std::size_t>(residuals.size(), 1)));
    double log = 0.0;
    for (int k = 0; k < layout.controls; ++k) log += std::log(theta[layout.modulus(k)]) / layout.controls;
    event.youngs_modulus = std::exp(log);
    if (monitor_.on_event) monitor_.on_event(event);
    outcome_.history.push_back(event);
  }

  /// What an interrupted fit had done of this form, if anything.
  const PressFitState::Done* done_before(int terms, int controls) const {
    const auto it =
        std::ranges::find_if(state_.done, [&](const auto& d) { return d.terms == terms && d.controls == controls; });
    return it == state_.done.end() ? nullptr : &*it;
  }

  void keep_state(const Estimate* e, const TriedLaw& tried) {
    outcome_.tried.push_back(tried);
    if (interrupted_ || done_before(tried.terms, tried.controls)) return;
    state_.done.push_back(
        {tried.terms, tried.controls, e ? e->theta : VectorX(), tried.cost, tried.evidence, noise_, tried.kept});
    if (monitor_.on_state) monitor_.on_state(state_);
  }

  std::optional<Estimate> estimate(const PressTheta& layout, const std::shared_ptr<const PressScene>& scene,
                                   const std::vector<Vector3>& points, const VectorX& start, const std::string& stage) {
    if (const auto* done = done_before(layout.terms, layout.controls)) {
      if (done->theta.size() == 0) return std::nullopt;
      noise_ = done->noise;
      Estimate e{
          layout,           scene, parameters_of(layout, scene, points), done->theta, {}, 0.0, noise_, points, true,
          "finished before"};
      PressObjective objective(scene, fitted_, layout, e.parameters, {noise_, outlier_scale});
      e.evaluation = objective.linearise(e.parameters.to_unconstrained(done->theta));
      if (!e.evaluation.succeeded) return std::nullopt;
      return e;
    }
    return minimised(layout, scene, points, start, stage);
  }

  bool fit_first(int terms) {
    const PressTheta layout{scene_->body->modulus.controls, terms};
    const VectorX start = parameters_of(layout, scene_, {}).reference();
    best_ = estimate(layout, scene_, {}, start, terms == 0 ? "linear" : "1 term");
    if (!best_) {
      outcome_.reason = outcome_.notes.empty() ? "the start cannot be evaluated" : outcome_.notes.back();
      return false;
    }
    keep_state(&*best_, {terms, layout.controls, best_->evaluation.cost, infinite, true});
    return !interrupted_;
  }

  bool fit_more_terms(int terms) {
    const Estimate before = *best_;
    const double noise = noise_;
    const PressTheta layout{before.layout.controls, terms};
    const auto next =
        estimate(layout, before.scene, {}, with_term(before.layout, before.theta), std::to_string(terms) + " terms");
    TriedLaw tried{terms, layout.controls, next ? next->evaluation.cost : infinite, -infinite, false};
    if (next) {
      // Half the BIC by residuals whose deviation is unknown: n/2 ln(sum r^2) + k/2 ln n.
      const double n = next->evaluation.independent_observations();
      const auto squares = [](const Estimate& e) {
        double sum = 0.0;
        for (const FrameFit& f : e.evaluation.frames) sum += f.track_sum_squares;
        return sum;
      };
      tried.evidence = 0.5 * n * std::log(squares(before) / squares(*next)) - 0.5 * 2.0 * std::log(n);
      tried.kept = options_.terms > 0 || tried.evidence > needed_evidence;
    }
    keep_state(next ? &*next : nullptr, tried);
    if (tried.kept)
      best_ = next;
    else
      noise_ = noise;
    return tried.kept && !interrupted_;
  }

  void fit_fields() {
    if (options_.control_points == 1) return;
    std::vector<int> sizes(field_sizes.begin(), field_sizes.end());
    if (options_.control_points > 1) sizes = {options_.control_points};
    for (const int size : sizes) {
      if (stop()) return;
      fit_field(size);  // a layer may need many points before any of them tells it from the next
    }
  }

  void fit_field(int size) {
    const Estimate before = *best_;
    const double noise = noise_;
    ControlledField field;
    try {
      field = harmonic_field(*before.scene->body, farthest_points(*before.scene->body, size));
    } catch (const InputError&) {
      return;  // more points than the mesh has places for
    }
    auto scene = std::make_shared<PressScene>(*before.scene);
    scene->body = with_field(*before.scene->body, field.field);
    const PressTheta layout{size, before.layout.terms};
    const MatrixX carried = carried_over(*scene->body, before.scene->body->modulus, scene->body->modulus);
    VectorX start = VectorX::Zero(layout.size()), logs{before.layout.controls};
    start.head(2 + layout.shapes()) = before.theta.head(2 + layout.shapes());
    for (int k = 0; k < before.layout.controls; ++k) logs[k] = std::log(before.theta[before.layout.modulus(k)]);
    const VectorX moduli = (carried * logs).array().exp();
    for (int k = 0; k < size; ++k) start[layout.modulus(k)] = moduli[k];
    TriedLaw tried{layout.terms, size, infinite, -infinite, false};
    std::optional<Estimate> next;
    const bool is_chosen = options_.control_points > 1;
    if (is_chosen || done_before(layout.terms, size) || promises(layout, scene, field.points, start, carried, tried)) {
      next = estimate(layout, scene, field.points, start, std::to_string(size) + " control points");
      if (next) {
        tried.cost = next->evaluation.cost;
        tried.evidence = log_bayes_factor(next->evaluation, next->parameters,
                                          next->parameters.to_unconstrained(next->theta), carried);
        tried.kept = is_chosen || tried.evidence > needed_evidence;
      }
    }
    keep_state(next ? &*next : nullptr, tried);
    if (tried.kept)
      best_ = next;
    else
      noise_ = noise;
  }

  /// Whether a step from where the coarser field is promises any evidence.
  bool promises(const PressTheta& layout, const std::shared_ptr<const PressScene>& scene,
                const std::vector<Vector3>& points, const VectorX& start, const MatrixX& carried, TriedLaw& tried) {
    const ParameterSet set = parameters_of(layout, scene, points);
    PressObjective objective(scene, fitted_, layout, set, {noise_, outlier_scale});
    const VectorX p = set.to_unconstrained(start);
    const CostEvaluation evaluation = objective.linearise(p);
    if (!evaluation.succeeded) return false;
    tried.cost = evaluation.cost;
    tried.evidence = log_bayes_factor(evaluation, set, p, carried);
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
    std::vector<PressSample>& samples = state_.samples;
    std::mutex mutex;
    // A few at a time, so that an interruption loses little.
    const std::size_t batch = 4;
    while (samples.size() < fitted_.size() && !stop()) {
      const std::size_t begin = samples.size(), end = std::min(begin + batch, fitted_.size());
      std::vector<PressSample> part(end - begin);
      tbb::parallel_for(begin, end, [&](std::size_t i) {
        SampleFitOptions own = options;
        const ObservedPress& seen = scene_->presses[std::size_t(fitted_[i])];
        // The misfit of one law for all is no noise: what a press' markers show by themselves is, where that is less.
        if (options_.noise <= 0.0)
          own.noise = std::min(noise_, std::max(marker_noise(seen), 1e-3 * seen.greatest_displacement));
        part[i - begin] = fit_sample(*scene_, fitted_[i], start, smoothness, own);
      });
      for (PressSample& sample : part) {
        PressFitEvent event{"press " + std::to_string(samples.size() + 1), sample.iterations, sample.weight, sample.rms,
                            start.youngs_modulus};
        if (monitor_.on_event) monitor_.on_event(event);
        outcome_.history.push_back(event);
        samples.push_back(std::move(sample));
      }
      if (monitor_.on_state) monitor_.on_state(state_);
    }
    outcome_.samples = samples;
    std::vector<MaterialSample> usable;
    for (std::size_t i = 0; i < samples.size(); ++i)
      if (samples[i].succeeded)
        usable.push_back(samples[i].sample);
      else
        outcome_.notes.push_back(fmt::format("{} takes no part in the sampled material: {}",
                                             scene_->presses[std::size_t(fitted_[i])].name, samples[i].failure));
    if (usable.empty()) return;
    outcome_.sampled = sample_material(usable, options_.basis);
  }

  PressFitOutcome finish() {
    outcome_.interrupted = interrupted_;
    if (!best_) return std::move(outcome_);
    Estimate& e = *best_;
    outcome_.scene = e.scene;
    outcome_.layout = e.layout;
    outcome_.theta = e.theta;
    outcome_.parameters = e.parameters;
    outcome_.parameters.set_reference(e.theta);
    outcome_.evaluation = e.evaluation;
    outcome_.noise = e.noise;
    outcome_.start_cost = e.start_cost;
    outcome_.control_points = e.points;
    outcome_.converged = e.converged && !interrupted_;
    outcome_.reason = interrupted_ ? "interrupted" : e.reason;
    outcome_.covariance = parameter_covariance(e.evaluation);
    outcome_.std = outcome_.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    const VectorX inverse = outcome_.std.cwiseMax(1e-300).cwiseInverse();
    outcome_.correlation = inverse.asDiagonal() * outcome_.covariance * inverse.asDiagonal();
    outcome_.law = press_law(*e.scene->body, e.layout, e.theta);
    if (outcome_.sampled) outcome_.law = outcome_.sampled->law;
    if (!interrupted_) outcome_.predictions = predict_presses(*e.scene, outcome_.law);
    outcome_.succeeded = true;
    return std::move(outcome_);
  }

  const Capture& capture_;
  PressFitOptions options_;
  const PressFitMonitor& monitor_;
  PressFitState state_;
  std::shared_ptr<const PressScene> scene_;
  std::vector<int> fitted_;
  bool regions_ = false, interrupted_ = false;
  double noise_ = 0.0;
  std::optional<Estimate> best_;
  PressFitOutcome outcome_;
};

}  // namespace

std::string PressFitOptions::validate() const {
  if (!(cells >= 2.0 && cells <= 64.0)) return "cells must lie in 2..64";
  if (terms < 0 || terms > 3) return "law_terms must lie in 1..3, or be 0: as many as the presses support";
  if (control_points < 0 || control_points > 500) return "control_points must lie in 1..500, or be auto";
  if (!(modulus_variation > 0.0 && modulus_variation <= 10.0)) return "modulus_variation must lie in (0, 10]";
  if (!(noise >= 0.0)) return "marker_noise must not be negative";
  if (max_iterations < 1) return "max_iterations must be at least 1";
  if (!(basis.tolerance > 0.0) || basis.max_samples < 1) return "basis_tolerance must be positive, basis_samples >= 1";
  return {};
}

PressFitOptions press_options(const FitOptions& options) {
  PressFitOptions o;
  o.material = options.material;
  o.cells = options.cells;
  o.quadratic = options.element == ElementKind::QuadraticTetrahedron;
  o.terms = options.law_terms;
  o.control_points = std::max(0, options.control_points);
  o.modulus_variation = options.modulus_variation;
  o.noise = options.marker_noise;
  o.max_iterations = options.max_iterations;
  o.basis = {options.basis_tolerance, options.basis_samples};
  return o;
}

PressFitOutcome fit_presses(const Capture& capture, const PressFitOptions& options, const PressFitMonitor& monitor,
                            PressFitState resume) {
  return PressFit(capture, options, monitor, std::move(resume)).run();
}

}  // namespace pliant
