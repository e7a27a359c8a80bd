#include "estimation/press_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numeric>
#include <utility>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/alternative.hpp"
#include "estimation/field_choice.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/judgement.hpp"
#include "estimation/law_plan.hpp"
#include "estimation/law_zones.hpp"
#include "estimation/notes.hpp"
#include "estimation/press_objective.hpp"
#include "estimation/problem.hpp"
#include "estimation/refinement.hpp"
#include "estimation/specimens.hpp"
#include "estimation/stage_loop.hpp"

namespace pliant {

namespace {

std::shared_ptr<const Body> with_field(const Body& body, ModulusField field) {
  auto copy = std::make_shared<Body>(body);
  copy->modulus = std::move(field);
  return copy;
}

/// Carries out a `LawPlan` on the static tests of captures.
class LawRun : StageLoop {
 public:
  /// Throws InputError where a capture cannot be fitted, with the reason.
  LawRun(const std::vector<const Capture*>& captures, const FitOptions& options, const FitMonitor& monitor,
         FitState state)
      : StageLoop(options, monitor, std::move(state.pass)),
        captures_(captures),
        specimens_(specimens_of(captures, options)),
        scene_(scene_to_fit()),
        sampled_(state.sampled ? std::move(*state.sampled) : PressSampling::State()),
        plan_(facts()) {}

  FitOutcome run() {
    execute();
    std::vector<StageRecord> done = state_.done;
    for (StageRecord& r : partial_)
      if (r.id.kind == StageKind::Law && r.succeeded) done.push_back(std::move(r));
    return finish(plan_.after(done));
  }

 private:
  const Capture& first() const { return *captures_.front(); }

  std::shared_ptr<const PressScene> scene_to_fit() const {
    for (std::size_t i = 0; i < captures_.size(); ++i) {
      const TestedSpecimen& s = specimens_[i];
      if (s.presses.empty() && !s.scene->static_tests().any_to_fit())
        throw InputError({{captures_[i]->file},
                          "no static test is to be fitted",
                          "a block [[press]], [[indentation]], [[grip]] or [[material_curve]] whose role is \"fit\"",
                          ""});
      if (s.scene->body->modulus.controls != specimens_.front().scene->body->modulus.controls)
        throw InputError(
            {{captures_[i]->file},
             fmt::format("the object has {} moduli, by its regions", s.scene->body->modulus.controls),
             fmt::format("those of the first capture, {}", specimens_.front().scene->body->modulus.controls),
             "name the same materials in every capture"});
    }
    if (options_.material == MaterialKind::Sampled && specimens_.size() > 1)
      throw InputError({{captures_[1]->file},
                        "material=sampled and several captures",
                        "the presses of one object",
                        "fit one of them, or choose ogden, neo_hookean or linear"});
    if (options_.material == MaterialKind::Sampled && specimens_.front().presses.empty())
      throw InputError({{first().file},
                        "material=sampled and no press to fit",
                        "blocks [[press]], whose markers show where the object is how stiff",
                        "leave out material, or choose ogden, neo_hookean or linear"});
    return specimens_.front().scene;
  }

  LawFacts facts() const {
    LawFacts f;
    f.options = options_;
    const int controls = scene_->body->modulus.controls;
    if (controls > 1) f.modulus_names = modulus_names(first(), controls);
    f.start_modulus = (specimens_.front().presses.empty() ? 1.0 : 2.0) * punch_modulus(*scene_, 0.3);
    f.noise = options_.marker_noise > 0.0 ? options_.marker_noise : scene_->noise;
    f.size = scene_->body->size();
    f.presses = press_count();
    f.is_specimen = specimens_.size() > 1;
    for (const TestedSpecimen& s : specimens_) {
      f.has_curves = f.has_curves || s.scene->static_tests().any_to_fit();
      f.is_specimen = f.is_specimen || !s.scene->static_tests().curves.empty();
    }
    const auto has_curves_alone = [](const Capture* capture) { return is_of_material_curves(*capture); };
    if (std::ranges::all_of(captures_, has_curves_alone)) f.curve_exponents = curve_exponents();
    return f;
  }

  /// Exponents that terms of a specimen's law begin from. Pulled along one axis alone, a term with a negative exponent
  /// -a does what one with a / 2 does, by the sides' stretch; pulled along two it is another material by far.
  std::vector<double> curve_exponents() const {
    bool is_only_pulled = true, has_modulus = false;
    for (const TestedSpecimen& s : specimens_)
      for (const ObservedCurve& curve : s.scene->static_tests().curves) {
        if (!is_fitted(curve.role)) continue;
        has_modulus = has_modulus || !secant_moduli(curve.test).empty();
        is_only_pulled = is_only_pulled && curve.test.mode == TestMode::Uniaxial &&
                         std::ranges::all_of(curve.test.stretch, [](double stretch) { return stretch >= 1.0; });
      }
    if (!has_modulus)
      throw InputError({{first().file},
                        "no stress of the stress-strain curves has the sign of its strain",
                        "stress-strain curves of an elastic material",
                        "stretches are 1 and shears 0 at rest; tension is positive"});
    std::vector<double> exponents = {1.2, 3.0, 7.0, 15.0, 30.0};
    if (!is_only_pulled) exponents.insert(exponents.end(), {-1.2, -3.0, -7.0, -15.0, -30.0});
    return exponents;
  }

  int press_count() const {
    int count = 0;
    for (const TestedSpecimen& s : specimens_) count += int(s.presses.size());
    return count;
  }

  std::vector<StageChain> next() override {
    const LawPlan::Standing standing = plan_.after(state_.done);
    if (!standing.next) return {};
    if (standing.next->id.kind == StageKind::Sample && !standing.best) return {};
    return {{*standing.next}};
  }

  FitState whole_state() const override {
    FitState state{state_, {}, {}, {}};
    if (sampling_) state.sampled = sampling_->state();
    return state;
  }

  StageRecord run_stage(const Stage& stage, bool& is_cut) override {
    const bool looks = stage.id.kind == StageKind::Cut || stage.id.kind == StageKind::Move ||
                       stage.id.kind == StageKind::ControlPoints;
    if (!looks) looking_.reset();  // factors take much memory
    switch (stage.id.kind) {
      case StageKind::Scale:
        return scale(stage, is_cut);
      case StageKind::Cut:
        return find_cut(stage);
      case StageKind::Move:
        return find_move(stage);
      case StageKind::ControlPoints:
        return find_points(stage);
      case StageKind::Sample:
        return sample(stage);
      case StageKind::Alternative:
        return try_alternatives(stage, is_cut);
      default:
        return minimise_law(stage, is_cut);
    }
  }

  // A form of the law on the object --------------------------------------------------------------------------------

  std::shared_ptr<const PressScene> scene_of(const LawShape& shape) const { return scene_of(shape, scene_); }
  static std::shared_ptr<const PressScene> scene_of(const LawShape& shape,
                                                    const std::shared_ptr<const PressScene>& on) {
    if (shape.points.empty() && shape.cuts.empty()) return on;
    auto scene = std::make_shared<PressScene>(*on);
    const Body& body = *on->body;
    scene->body = with_field(body, shape.points.empty()
                                       ? zone_field(body.modulus, zones_after(zone_coordinates(body), shape.cuts),
                                                    int(shape.cuts.size()) + 1)
                                       : harmonic_field(body, shape.points).field);
    return scene;
  }

  struct Form {
    LawLayout layout;
    std::shared_ptr<const PressScene> scene;
    ParameterSet parameters;
  };
  /// Contact is as stiff as the law at theta asks for.
  Form form_at(const LawShape& shape, const VectorX& theta) const {
    Form form{plan_.facts().layout(shape.form), scene_of(shape), plan_.facts().parameters(shape)};
    form.parameters.set_reference(theta);
    return form;
  }
  std::vector<TestedSpecimen> specimens(const Form& form) const {
    std::vector<TestedSpecimen> all = specimens_;
    all.front().scene = form.scene;
    return all;
  }
  PressObjective objective_of(const Form& form, const MarkerNoise& noise) const {
    return {specimens(form), form.layout, form.parameters, {noise, judgement.press_outlier}, placements_};
  }
  /// The same for stages that only look at what other forms of a law promise, one after the other from one estimate:
  /// where contacts and noise are those of the last of them, its equilibria and solvers are those of this one.
  PressObjective& objective_to_look(const Form& form, const MarkerNoise& noise) {
    constexpr double same = 1e-9;  // but for rounding, of another form
    const Body& body = *form.scene->body;
    const double modulus = mean_modulus(body, *press_law(body, form.layout, form.parameters.reference()));
    if (looking_ && looking_->noise == noise && std::abs(modulus - looking_->modulus) < same * modulus)
      looking_->objective.set_form(form.scene->body, form.layout, form.parameters);
    else
      looking_.emplace(Looking{objective_of(form, noise), noise, modulus});
    return looking_->objective;
  }
  MatrixX carried(const LawShape& before, const PressScene& scene) const {
    return carried_over(*scene.body, scene_of(before)->body->modulus, scene.body->modulus);
  }

  static StageRecord begun(const Stage& stage) {
    StageRecord record{stage.id, stage.name, stage.from.front(), stage.from.front()};
    record.start_cost = record.cost = infinite;
    record.law.emplace().noise = stage.law->noise;
    return record;
  }

  // Stages -----------------------------------------------------------------------------------------------------------

  /// With the noise of its own residuals in the end.
  StageRecord minimise_law(const Stage& stage, bool& is_cut) {
    const LawTask& task = *stage.law;
    StageRecord record = begun(stage);
    MarkerNoise& noise = record.law->noise;
    const VectorX& theta = record.from;
    Form form = form_at(task.shape, theta);
    std::optional<PressObjective> objective;
    OptimiserOptions o;
    o.max_iterations = stage.iterations;
    o.damps_long_steps = true;
    if (plan_.facts().are_curves())
      o.step_tolerance = 1e-6, o.cost_tolerance = 1e-8;  // flat valleys, cheap steps
    else
      o.growth_of_max_step = 8.0;
    OptimiserState from{0, form.parameters.to_unconstrained(theta), {}};
    if (const StageUnderWay* left = task.is_brief ? nullptr : under_way(stage.id)) from = left->optimiser;
    OptimiserSummary s;
    // Twice: contact is as stiff, and outliers weigh as little, as the law and the noise at the beginning say.
    for (int round = 0; round < (task.is_brief ? 1 : 2) && !is_cut; ++round) {
      std::optional<PressObjective> next(objective_of(form, noise));
      o.cost_to_reach = round == 0 ? task.cost_to_reach : infinite;
      const OptimiserSummary done = minimise(next->cost(), from, o, [&](const Iteration& i) {
        report(stage, i, *next, form);
        if (!task.is_brief) keep_under_way(stage, i.state());
        return !(is_cut = is_cut || is_interrupted());
      });
      is_cut = is_cut || done.interrupted;
      if (round == 0) record.start_cost = done.start_cost;
      if (round > 0 && !done.succeeded) break;  // the first round stands
      s = done;
      objective.emplace(std::move(*next));
      placements_ = objective->placements();
      if (!s.succeeded) break;
      form.parameters.set_reference(form.parameters.to_theta(s.p));
      if (s.is_out_of_reach) break;
      if (!task.is_brief && options_.marker_noise <= 0.0) noise = objective->own_noise(1e-6 * scene_->body->size());
      objective->set_options({noise, judgement.press_outlier});
      from = {0, s.p, {}};
    }
    record.reason = s.reason;
    record.iterations = s.iterations;
    if (!s.succeeded) {
      const bool is_one_of_many = task.is_brief || plan_.facts().are_curves();
      if (!is_one_of_many) outcome_.notes.push_back(stage.name + ": " + s.reason);
      return record;
    }
    record.theta = form.parameters.to_theta(s.p);
    record.converged = s.converged;
    CostEvaluation evaluation = objective->linearise(s.p);
    if (!evaluation.succeeded) return record;
    record.succeeded = true;
    record.cost = evaluation.cost;
    find_out(record, task, form, *objective, evaluation);
    ended_[stage.id.number] = std::move(evaluation);
    return record;
  }

  void find_out(StageRecord& record, const LawTask& task, const Form& form, const PressObjective& objective,
                const CostEvaluation& evaluation) const {
    LawFinding& found = *record.law;
    const int presses = press_count();
    for (std::size_t f = std::size_t(presses); f < evaluation.frames.size(); ++f)  // presses come first, a frame each
      found.stated_cost += evaluation.frames[f].cost;
    found.track_squares = objective.weighed_squares();
    found.deviation = presses == 0 ? 1.0 : objective.typical_deviation();
    found.observations = evaluation.independent_observations();
    found.dimension = form.parameters.dimension();
    const VectorX p = form.parameters.to_unconstrained(record.theta);
    const double variation = options_.modulus_variation;
    switch (task.evidence) {
      case LawTask::Evidence::None:
        break;
      case LawTask::Evidence::Zone:
        found.evidence = zone_evidence(evaluation, form.parameters, p, form.layout, task.cut, variation);
        break;
      case LawTask::Evidence::OwnLaws:
        found.evidence = own_laws_evidence(evaluation, form.parameters, p, form.layout, variation);
        break;
      case LawTask::Evidence::Field:
        found.evidence = log_bayes_factor(evaluation, form.parameters, p, carried(task.before, *form.scene));
        break;
    }
  }

  void report(const Stage& stage, const Iteration& i, const PressObjective& objective, const Form& form) {
    FitEvent event;
    event.kind = stage.id.kind, event.stage = stage.name, event.iteration = i.number, event.cost = i.cost;
    event.theta = form.parameters.to_theta(i.p);
    event.layout = std::make_shared<ParameterLayout>(form.layout.layout());
    const std::vector<double> residuals = objective.residuals();
    double sum = 0.0;
    for (const double r : residuals) sum += r * r;
    event.marker_rms = std::sqrt(3.0 * sum / double(std::max<std::size_t>(residuals.size(), 1)));
    event.youngs_modulus = form.layout.mean_modulus(event.theta);
    emit(std::move(event));
  }

  /// The moduli alone.
  StageRecord scale(const Stage& stage, bool& is_cut) {
    StageRecord record = begun(stage);
    Form form = form_at(stage.law->shape, record.from);
    const std::vector<Parameter> all = form.parameters.parameters();
    for (const Parameter& p : all)
      if (p.unit != "Pa") form.parameters.set_estimated(p.name, false);
    PressObjective objective = objective_of(form, stage.law->noise);
    OptimiserOptions o;
    o.max_iterations = stage.iterations;
    const OptimiserSummary s = minimise(objective.cost(), {0, form.parameters.to_unconstrained(record.from), {}}, o,
                                        [&](const Iteration&) { return !is_interrupted(); });
    is_cut = s.interrupted;
    placements_ = objective.placements();
    record.succeeded = s.succeeded, record.converged = s.converged, record.reason = s.reason;
    record.iterations = s.iterations;
    if (s.succeeded) record.theta = form.parameters.to_theta(s.p), record.cost = s.evaluation.cost;
    return record;
  }

  StageRecord find_cut(const Stage& stage) {
    StageRecord record = begun(stage);
    const LawTask& task = *stage.law;
    const Form form = form_at(task.shape, record.from);
    PressObjective& objective = objective_to_look(form, task.noise);
    const auto promised = most_promising_cut(objective, *form.scene, form.layout, record.from, task.shape.cuts,
                                             options_.modulus_variation);
    record.succeeded = promised.has_value();
    if (promised) record.law->cut = promised->cut, record.law->evidence = promised->evidence;
    return record;
  }

  StageRecord find_move(const Stage& stage) {
    StageRecord record = begun(stage);
    const LawTask& task = *stage.law;
    const Form form = form_at(task.shape, record.from);
    PressObjective& objective = objective_to_look(form, task.noise);
    const auto move = best_move(objective, *form.scene, form.layout, record.from, task.shape.cuts,
                                std::size_t(task.cut), options_.modulus_variation);
    record.succeeded = move.has_value();
    if (!move) return record;
    record.law->cut = task.shape.cuts[std::size_t(task.cut)];
    record.law->cut->at = move->at, record.law->evidence = move->gain;
    return record;
  }

  /// Where a field's control points lie, its parameters as the coarser form has them, and what a step from there
  /// promises, where that decides whether it is fitted.
  StageRecord find_points(const Stage& stage) {
    StageRecord record = begun(stage);
    const LawTask& task = *stage.law;
    LawShape shape = task.shape;
    const LawLayout from = plan_.facts().layout(task.before.form), to = plan_.facts().layout(shape.form);
    std::shared_ptr<const PressScene> scene;
    record.law->evidence = -infinite;
    try {
      shape.points = farthest_points(*scene_->body, shape.form.controls);
      scene = scene_of(shape);
    } catch (const InputError&) {
      record.reason = "more points than the mesh has places for";
      return record;
    }
    record.law->points = shape.points;
    const MatrixX M = carried(task.before, *scene);
    record.theta = carry_law(from, record.from, to, std::vector<int>(std::size_t(shape.form.controls), 0));
    VectorX logs{task.before.form.controls};
    for (int k = 0; k < task.before.form.controls; ++k) logs[k] = std::log(record.from[from.modulus(k)]);
    const VectorX moduli = (M * logs).array().exp();
    for (int k = 0; k < shape.form.controls; ++k) record.theta[to.modulus(k)] = moduli[k];
    if (options_.control_points > 1) return record;
    const Form form = form_at(shape, record.theta);
    PressObjective& objective = objective_to_look(form, task.noise);
    const VectorX p = form.parameters.to_unconstrained(record.theta);
    const CostEvaluation evaluation = objective.linearise(p);
    if (!(record.succeeded = evaluation.succeeded)) return record;
    record.cost = evaluation.cost;
    record.law->evidence = log_bayes_factor(evaluation, form.parameters, p, M);
    return record;
  }

  /// Where the estimate goes on a coarser mesh, and as the object weighs more than was given; contacts and noise as
  /// they are.
  StageRecord try_alternatives(const Stage& stage, bool& is_cut) const {
    constexpr int iterations = 3;
    StageRecord record = begun(stage);
    record.succeeded = true;
    const LawTask& task = *stage.law;
    Form form = form_at(task.shape, record.from);
    const VectorX p = form.parameters.to_unconstrained(record.from);
    std::vector<TestedSpecimen> heavier = specimens(form);
    bool has_weight = false;
    for (std::size_t i = 0; i < heavier.size(); ++i) {
      const double deviation = captures_[i]->scene.object.relative_mass_std().value_or(judgement.given_density);
      auto scene = std::make_shared<PressScene>(*heavier[i].scene);
      has_weight = has_weight || (deviation > 0.0 && scene->dead_load().cwiseAbs().maxCoeff() > 0.0);
      scene->density *= 1.0 + deviation;
      heavier[i].scene = std::move(scene);
    }
    const PressTrialOptions as_found{task.noise, judgement.press_outlier};
    if (has_weight) {
      PressObjective objective(heavier, form.layout, form.parameters, as_found, placements_);
      const CostEvaluation e = objective.linearise(p);
      if (e.succeeded) record.shifts.push_back({cause_mass, gauss_newton_shift(e, largest_shift)});
    }
    const auto has_own_mesh = [](const Capture* c) { return c->scene.object.volume.has_value(); };
    if (std::ranges::all_of(captures_, has_own_mesh)) return record;  // each is as it was given
    std::vector<TestedSpecimen> coarser;
    try {
      coarser = specimens_of(captures_, options_, 1.0 / Refinement::mesh_ratio);
      coarser.front().scene = scene_of(task.shape, coarser.front().scene);
    } catch (const InputError& error) {  // too coarse for the object, or for what is pressed of it
      record.reason = error.what();
      return record;
    }
    PressObjective objective(coarser, form.layout, form.parameters, as_found);
    const MovedEstimate moved =
        move_estimate(objective.cost(), form.parameters, iterations, [&] { return !is_interrupted(); });
    is_cut = moved.summary.interrupted;
    record.iterations = moved.summary.iterations;
    if (!moved.summary.succeeded)
      record.reason = moved.summary.reason;
    else
      record.shifts.push_back({cause_mesh, moved.shift(p)});
    return record;
  }

  StageRecord sample(const Stage& stage) {
    StageRecord record = begun(stage);
    record.succeeded = true;
    const LawPlan::Estimate best = *plan_.after(state_.done).best;
    const auto law = press_law(*scene_of(best.shape)->body, best.layout, best.theta);
    PressSampling& presses = sampling();
    const std::size_t begin = presses.state().under.size();
    std::size_t number = 0;
    for (const PressSample& s : presses.sample(samples_a_stage, law, stage.law->noise, stage.iterations)) {
      FitEvent event;
      event.kind = StageKind::Sample, event.stage = fmt::format("press {}", begin + ++number);
      event.iteration = s.iterations, event.cost = s.weight, event.marker_rms = s.rms;
      event.youngs_modulus = mean_modulus(*scene_->body, *law);
      emit(std::move(event));
      record.iterations += s.iterations;
    }
    if (!presses.is_round_done()) return record;
    const PressSampling::Round round = presses.conclude(law, stage.law->noise);
    record.start_cost = round.cost_before, record.cost = round.cost, record.converged = round.is_kept;
    return record;
  }

  PressSampling& sampling() {
    if (!sampling_)
      sampling_.emplace(scene_, specimens_.front().presses,
                        BasisOptions{options_.basis_tolerance, options_.basis_samples}, options_.marker_noise > 0.0,
                        std::move(sampled_));
    return *sampling_;
  }

  // What came out ----------------------------------------------------------------------------------------------------

  void add_sampled(LawOutcome& law, const std::shared_ptr<const TabulatedLaw>& shared) {
    if (options_.material != MaterialKind::Sampled) return;
    law.samples = sampling().state().kept;
    law.sampled = sampling().material(shared);
    for (std::size_t i = 0; i < law.samples.size(); ++i)
      if (!law.samples[i].succeeded)
        outcome_.notes.push_back(fmt::format("{} takes no part in the sampled material: {}",
                                             scene_->presses[std::size_t(specimens_.front().presses[i])].name,
                                             law.samples[i].failure));
    if (!law.sampled && !interrupted_)
      outcome_.notes.emplace_back(
          "No material that is interpolated between the presses comes closer to their markers than the law that they "
          "share: that law stands.");
  }

  /// Why no form of the law could be fitted: the first of those that were tried.
  std::string why_none_stands() const {
    const auto failed = std::ranges::find_if(
        state_.done, [](const StageRecord& r) { return r.id.kind == StageKind::Law && !r.reason.empty(); });
    return failed == state_.done.end() ? "the start cannot be evaluated" : failed->name + ": " + failed->reason;
  }

  FitOutcome finish(const LawPlan::Standing& standing) {
    outcome_.interrupted = interrupted_;
    const Resolution resolution = resolution_of_tests(first(), options_);
    outcome_.cells = resolution.cells;
    if (!standing.best) {
      outcome_.reason = interrupted_ ? "interrupted" : why_none_stands();
      return std::move(outcome_);
    }
    const LawPlan::Estimate& best = *standing.best;
    const Form form = form_at(best.shape, best.theta);
    LawOutcome law;
    law.scene = form.scene, law.layout = form.layout, law.noise = best.found.noise, law.cuts = best.shape.cuts;
    law.tried = standing.tried;
    const std::shared_ptr<const TabulatedLaw> shared = press_law(*form.scene->body, form.layout, best.theta);
    add_sampled(law, shared);
    law.law = shared;
    if (law.sampled) law.law = law.sampled->law;
    if (!interrupted_) law.predictions = predict_presses(*form.scene, law.law);
    for (std::size_t i = 1; i < specimens_.size(); ++i) {
      const std::shared_ptr<const PressScene>& scene = specimens_[i].scene;
      law.others.push_back({scene, press_law(*scene->body, form.layout, best.theta), {}});
      if (!interrupted_) law.others.back().predictions = predict_presses(*scene, law.others.back().law);
    }
    outcome_.used = with_law(options_, form.layout.form(), !best.shape.points.empty());
    outcome_.used.cells = resolution.cells, outcome_.used.element = resolution.element;
    if (law.sampled) outcome_.used.material = MaterialKind::Sampled;
    outcome_.theta = best.theta;
    outcome_.parameters = form.parameters;
    const auto ended = ended_.find(best.id.number);
    outcome_.evaluation =
        ended != ended_.end()
            ? std::move(ended->second)
            : objective_of(form, best.found.noise).linearise(form.parameters.to_unconstrained(best.theta));
    const CostEvaluation begin =
        objective_of(form, best.found.noise).evaluate(form.parameters.to_unconstrained(best.from));
    outcome_.start_cost = begin.succeeded ? begin.cost : 0.0, outcome_.final_cost = best.cost;
    outcome_.converged = best.converged && !interrupted_;
    outcome_.reason = interrupted_ ? "interrupted" : best.reason;
    std::vector<ModelShift> shifts =
        shifts_of_forms(outcome_.parameters, best.layout.mean_modulus(best.theta), standing.tried);
    const VectorX own = gauss_newton_shift(outcome_.evaluation, largest_shift);
    for (const ModelShift& s : standing.shifts)
      shifts.push_back(
          {s.cause, (s.cause == cause_mesh ? judgement.size_of_coarser_mesh.value : 1.0) * (s.shift - own)});
    if (!standing.untried.empty()) outcome_.notes.push_back(note_of_untried("mesh", standing.untried));
    const std::vector<TestedSpecimen> all = specimens(form);
    for (std::size_t i = 0; i < all.size(); ++i)
      outcome_.recordings.push_back(as_recording(all[i].scene->body, form.layout, outcome_, int(i)));
    outcome_.recordings.front().discretisation.control_points = best.shape.points;
    add_uncertainty(outcome_, shifts, floor_of_tests(outcome_, options_),
                    agreements_of(all, outcome_.evaluation, options_.marker_noise));
    for (std::string& note : unused_choices(options_, false, true)) outcome_.notes.push_back(std::move(note));
    add_law_notes(outcome_, law, first());
    outcome_.law = std::move(law);
    return std::move(outcome_);
  }

  std::vector<const Capture*> captures_;
  std::vector<TestedSpecimen> specimens_;    // of each capture
  std::shared_ptr<const PressScene> scene_;  // of the first
  PressSampling::State sampled_;             // of a fit that was interrupted, until it goes on
  std::optional<PressSampling> sampling_;
  LawPlan plan_;
  std::map<int, CostEvaluation> ended_;    // of this run, by the stage's number
  PressObjective::Placements placements_;  // of the stage that was minimised last: equilibria of the next are near
  struct Looking {
    PressObjective objective;
    MarkerNoise noise;
    double modulus = 0.0;  // that contacts are stiff about [Pa]
  };
  std::optional<Looking> looking_;  // of the last stage, where it only looked
};

/// What presses do not know is refused; what they merely do not use is told (`unused_choices`).
void require_known(const Capture& capture, const FitOptions& options) {
  const auto refuse = [&](const char* what, const char* advice) {
    throw InputError({{capture.file}, what, "a fit of static tests", advice});
  };
  if (options.element == ElementKind::Hexahedron)
    refuse("element=hexahedra: presses are met by tetrahedra, which follow the shape",
           "leave out element, or choose tetrahedra or quadratic_tetrahedra");
  if (options.refine > 1) refuse("presses and --refine", "fit with other `cells` and compare");
  if (options.law_terms > 0 &&
      (options.material == MaterialKind::Linear || options.material == MaterialKind::NeoHookean))
    refuse("law_terms: they are of Ogden's law, and another one is chosen",
           "leave out law_terms, or choose material=ogden");
  if (is_of_material_curves(capture) && (options.law_zones > 1 || options.control_points > 1))
    refuse("a material that differs over the object, and stress-strain curves alone, which are of one material",
           "leave out law_zones and control_points");
  for (const auto& [name, choice] : options.parameters)
    if (name != "poissons_ratio" || !choice.start || choice.estimated != false)
      refuse("choices about single parameters, of which fits of static tests know a given Poisson's ratio alone",
             "leave them out, or give poissons_ratio and poissons_ratio.estimate=false");
}

}  // namespace

FitOptions with_law(FitOptions options, const LawForm& form, bool is_field) {
  options.material = form.terms > 0                               ? MaterialKind::Ogden
                     : form.two_numbers == ElasticLaw::NeoHookean ? MaterialKind::NeoHookean
                                                                  : MaterialKind::Linear;
  options.law_terms = form.terms;
  options.law_zones = is_field ? 1 : form.controls;
  options.control_points = is_field ? form.controls : 1;
  return options;
}

VectorX floor_of_tests(const FitOutcome& outcome, const JudgementOptions& options) {
  return options.alternatives ? unmodelled_std(outcome.parameters, outcome.theta, MeasuredAs::Tested) : VectorX();
}

std::vector<ModelShift> shifts_of_forms(const ParameterSet& parameters, double youngs_modulus,
                                        const std::vector<TriedLaw>& tried) {
  double farthest = 0.0;
  for (const TriedLaw& t : tried)
    if (!t.kept && t.evidence > -judgement.strong_evidence && t.youngs_modulus > 0.0)
      if (const double shift = std::log(t.youngs_modulus / youngs_modulus); std::abs(shift) > std::abs(farthest))
        farthest = shift;
  if (farthest == 0.0) return {};
  VectorX shift = VectorX::Zero(parameters.dimension());
  const std::vector<const Parameter*> of = parameters.coordinate_parameters();
  for (std::size_t i = 0; i < of.size(); ++i)
    if (of[i]->unit == "Pa" && of[i]->transform == Transform::Logarithm) shift[Eigen::Index(i)] = farthest;
  return {{"form of the law", shift}};
}

std::optional<double> known_poissons_ratio(const FitOptions& options) {
  const auto known = options.parameters.find("poissons_ratio");
  if (known == options.parameters.end() || !known->second.start || known->second.estimated != false)
    return std::nullopt;
  return (*known->second.start)[0];
}

RecordingOutcome as_recording(const std::shared_ptr<const Body>& body, const LawLayout& layout,
                              const FitOutcome& outcome, int specimen) {
  RecordingOutcome recording;
  recording.discretisation.body = recording.rest_body = body;
  MaterialBlocks& material = recording.discretisation.simulation.blocks;
  material.youngs_moduli.clear();
  for (int k = 0; k < layout.form().controls; ++k) material.youngs_moduli.push_back(layout.modulus(k));
  recording.theta = outcome.theta;
  recording.evaluation = outcome.evaluation;
  std::erase_if(recording.evaluation.frames, [&](const FrameFit& f) { return f.recording != specimen; });
  return recording;
}

namespace {

/// Static tests that are to be predicted, read before the fit that this might else lose.
/// Throws InputError where the capture cannot be read, or the choices ask for a material that differs over an object.
std::shared_ptr<PressScene> scene_held_out(const Capture& capture, const FitOptions& options) {
  if (options.material == MaterialKind::Sampled || options.law_zones > 1 || options.control_points > 1)
    throw InputError({{capture.file},
                      "a material that differs over the fitted object, and --hold-out",
                      "a law for all of it, which another object can have",
                      "leave out --hold-out, or choose material=ogden and law_zones=1"});
  return std::make_shared<PressScene>(*specimens_of({&capture}, options, 1.0, true).front().scene);
}

/// What a fitted law predicts of static tests that took no part; a note where it differs over its object.
void predict_held_out(const Capture& capture, const std::shared_ptr<PressScene>& scene, FitOutcome& outcome) {
  const LawLayout& layout = outcome.law->layout;
  if (layout.form().controls > 1 || layout.form().laws > 1) {
    outcome.notes.push_back(
        "What was held out is not predicted: the material differs over the fitted object; `law_zones=1` and "
        "`control_points=1` keep it even.");
    return;
  }
  std::vector<int> all(scene->presses.size());
  std::iota(all.begin(), all.end(), 0);
  StaticTests tests = scene->static_tests();
  const auto set_roles = [&](const char* role) {
    for (ObservedPress& press : scene->presses) press.role = role;
    for (ObservedIndentation& test : tests.indentations) test.role = role;
    for (ObservedGrip& test : tests.grips) test.role = role;
    for (ObservedCurve& curve : tests.curves) curve.role = role;
    scene->tests = std::make_shared<StaticTests>(tests);
  };
  set_roles("fit");
  PressObjective objective({{scene, all}}, layout, outcome.parameters, {outcome.law->noise, judgement.press_outlier});
  outcome.held_out = {capture.name, capture.sha256,
                      objective.evaluate(outcome.parameters.to_unconstrained(outcome.theta))};
  set_roles("test");
  TestedObject object{scene, press_law(*scene->body, layout, outcome.theta), {}};
  object.predictions = predict_presses(*scene, object.law);
  outcome.law->others.push_back(std::move(object));
}

}  // namespace

FitOutcome fit_presses(const std::vector<const Capture*>& captures, const FitOptions& options,
                       const FitMonitor& monitor, FitState resume, const Capture* held_out) {
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{captures.front()->file}, wrong, "", "see `pliant fit --help`"});
  require_known(*captures.front(), options);
  const std::shared_ptr<PressScene> unseen = held_out ? scene_held_out(*held_out, options) : nullptr;
  FitOutcome outcome = LawRun(captures, options, monitor, std::move(resume)).run();
  if (unseen && outcome.law && !outcome.interrupted) predict_held_out(*held_out, unseen, outcome);
  return outcome;
}

}  // namespace pliant
