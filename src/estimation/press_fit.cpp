#include "estimation/press_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/alternative.hpp"
#include "estimation/curve_fit.hpp"
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
#include "estimation/stage_loop.hpp"

namespace pliant {

namespace {

std::shared_ptr<const Body> with_field(const Body& body, ModulusField field) {
  auto copy = std::make_shared<Body>(body);
  copy->modulus = std::move(field);
  return copy;
}

/// Carries out a `LawPlan` on the static tests of one capture.
class LawRun : StageLoop {
 public:
  /// Throws InputError where the capture cannot be fitted, with the reason.
  LawRun(const Capture& capture, const FitOptions& options, const FitMonitor& monitor, FitState state)
      : StageLoop(options, monitor, std::move(state.pass)),
        capture_(capture),
        cells_(resolution_of_tests(capture, options).cells),
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
  /// The object on its mesh, and all its tests.
  PressScene scene_at(double cells) const {
    Resolution resolution = resolution_of_tests(capture_, options_);
    resolution.cells = cells;
    std::vector<Vector3> control_points;
    return make_press_scene(capture_, make_body_of(capture_.scene, SignedDistance(), resolution, control_points));
  }

  std::shared_ptr<const PressScene> scene_to_fit() {
    if (!capture_.scene.object.surface)
      throw InputError({{capture_.file},
                        "there is no scan of the object at rest ([object] surface)",
                        "a closed triangle mesh",
                        "scan the object and name the mesh in capture.toml"});
    auto scene = std::make_shared<PressScene>(scene_at(cells_));
    for (int i = 0; i < int(scene->presses.size()); ++i)
      if (is_fitted(scene->presses[std::size_t(i)].role)) fitted_.push_back(i);
    if (fitted_.empty() && !scene->static_tests().any_to_fit())
      throw InputError({{capture_.file},
                        "no static test is to be fitted",
                        "a block [[press]], [[indentation]], [[grip]] or [[material_curve]] whose role is \"fit\"",
                        ""});
    if (fitted_.empty() && options_.material == MaterialKind::Sampled)
      throw InputError({{capture_.file},
                        "material=sampled and no press to fit",
                        "blocks [[press]], whose markers show where the object is how stiff",
                        "leave out material, or choose ogden, neo_hookean or linear"});
    return scene;
  }

  LawFacts facts() const {
    LawFacts f;
    f.options = options_;
    const int controls = scene_->body->modulus.controls;
    if (controls > 1) f.modulus_names = modulus_names(capture_, controls);
    f.start_modulus = (fitted_.empty() ? 1.0 : 2.0) * punch_modulus(*scene_, 0.3);
    f.noise = options_.marker_noise > 0.0 ? options_.marker_noise : scene_->noise;
    f.size = scene_->body->size();
    f.presses = int(fitted_.size());
    f.has_curves = scene_->static_tests().any_to_fit();
    f.is_specimen = !scene_->static_tests().curves.empty();
    return f;
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
  PressObjective objective_of(const Form& form, const MarkerNoise& noise) const {
    return {form.scene, fitted_, form.layout, form.parameters, {noise, judgement.press_outlier}, placements_};
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
    OptimiserState from{0, form.parameters.to_unconstrained(theta), {}};
    if (const StageUnderWay* left = task.is_brief ? nullptr : under_way(stage.id)) from = left->optimiser;
    OptimiserSummary s;
    // Twice: contact is as stiff, and outliers weigh as little, as the law and the noise at the beginning say.
    for (int round = 0; round < (task.is_brief ? 1 : 2) && !is_cut; ++round) {
      std::optional<PressObjective> next(objective_of(form, noise));
      const OptimiserSummary done = minimise(next->cost(), from, o, [&](const Iteration& i) {
        report(stage, i, *next, form);
        if (!task.is_brief) keep_under_way(stage, i.state());
        return !(is_cut = is_cut || is_interrupted());
      });
      is_cut = is_cut || done.interrupted;
      if (round > 0 && !done.succeeded) break;  // the first round stands
      s = done;
      objective.emplace(std::move(*next));
      placements_ = objective->placements();
      if (!s.succeeded) break;
      form.parameters.set_reference(form.parameters.to_theta(s.p));
      if (!task.is_brief && options_.marker_noise <= 0.0) noise = objective->own_noise(1e-6 * scene_->body->size());
      objective->set_options({noise, judgement.press_outlier});
      from = {0, s.p, {}};
    }
    record.reason = s.reason;
    record.iterations = s.iterations;
    if (!s.succeeded) {
      if (!task.is_brief) outcome_.notes.push_back(stage.name + ": " + s.reason);
      return record;
    }
    const CostEvaluation begin = objective->evaluate(form.parameters.to_unconstrained(theta));
    record.start_cost = begin.succeeded ? begin.cost : 0.0;
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
    for (std::size_t f = fitted_.size(); f < evaluation.frames.size(); ++f)  // presses come first, a frame each
      found.stated_cost += evaluation.frames[f].cost;
    found.track_squares = objective.weighed_squares();
    found.deviation = fitted_.empty() ? found.noise.at_rest : objective.typical_deviation();
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

  StageRecord find_cut(const Stage& stage) const {
    StageRecord record = begun(stage);
    const LawTask& task = *stage.law;
    const Form form = form_at(task.shape, record.from);
    PressObjective objective = objective_of(form, task.noise);
    const auto promised = most_promising_cut(objective, *form.scene, form.layout, record.from, task.shape.cuts,
                                             options_.modulus_variation);
    record.succeeded = promised.has_value();
    if (promised) record.law->cut = promised->cut, record.law->evidence = promised->evidence;
    return record;
  }

  StageRecord find_move(const Stage& stage) const {
    StageRecord record = begun(stage);
    const LawTask& task = *stage.law;
    const Form form = form_at(task.shape, record.from);
    PressObjective objective = objective_of(form, task.noise);
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
  StageRecord find_points(const Stage& stage) const {
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
    PressObjective objective = objective_of(form, task.noise);
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
    if (form.scene->dead_load().cwiseAbs().maxCoeff() > 0.0) {
      auto heavier = std::make_shared<PressScene>(*form.scene);
      heavier->density *= 1.0 + judgement.given_density;
      const CostEvaluation e =
          objective_of({form.layout, std::move(heavier), form.parameters}, task.noise).linearise(p);
      if (e.succeeded) record.shifts.push_back({cause_mass, gauss_newton_shift(e, largest_shift)});
    }
    if (capture_.scene.object.volume) return record;  // its mesh is as it was given
    try {
      form.scene = scene_of(task.shape, std::make_shared<PressScene>(scene_at(cells_ / Refinement::mesh_ratio)));
    } catch (const InputError& error) {  // too coarse for the object, or for what is pressed of it
      record.reason = error.what();
      return record;
    }
    PressObjective objective(form.scene, fitted_, form.layout, form.parameters, {task.noise, judgement.press_outlier});
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
      sampling_.emplace(scene_, fitted_, BasisOptions{options_.basis_tolerance, options_.basis_samples},
                        options_.marker_noise > 0.0, std::move(sampled_));
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
                                             scene_->presses[std::size_t(fitted_[i])].name, law.samples[i].failure));
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
    outcome_.cells = cells_;
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
    outcome_.theta = best.theta;
    outcome_.parameters = form.parameters;
    const auto ended = ended_.find(best.id.number);
    outcome_.evaluation =
        ended != ended_.end()
            ? std::move(ended->second)
            : objective_of(form, best.found.noise).linearise(form.parameters.to_unconstrained(best.theta));
    outcome_.start_cost = best.start_cost, outcome_.final_cost = best.cost;
    outcome_.converged = best.converged && !interrupted_;
    outcome_.reason = interrupted_ ? "interrupted" : best.reason;
    std::vector<ModelShift> shifts =
        shifts_of_forms(outcome_.parameters, best.layout.mean_modulus(best.theta), standing.tried);
    const VectorX own = gauss_newton_shift(outcome_.evaluation, largest_shift);
    for (const ModelShift& s : standing.shifts)
      shifts.push_back(
          {s.cause, (s.cause == cause_mesh ? judgement.size_of_coarser_mesh.value : 1.0) * (s.shift - own)});
    if (!standing.untried.empty())
      outcome_.notes.push_back("How much the estimate depends on the mesh could not be seen: " + standing.untried +
                               ".");
    add_uncertainty(
        outcome_, shifts,
        options_.alternatives ? unmodelled_std(outcome_.parameters, outcome_.theta, MeasuredAs::Tested) : VectorX(),
        agreements_of(*form.scene, fitted_, outcome_.evaluation, options_.marker_noise));
    outcome_.recordings.push_back(as_recording(form.scene->body, form.layout, outcome_));
    outcome_.recordings.back().discretisation.control_points = best.shape.points;
    for (std::string& note : unused_choices(options_, false, true)) outcome_.notes.push_back(std::move(note));
    add_law_notes(outcome_, law, capture_);
    outcome_.law = std::move(law);
    return std::move(outcome_);
  }

  const Capture& capture_;
  double cells_;
  std::vector<int> fitted_;  // numbers of presses
  std::shared_ptr<const PressScene> scene_;
  PressSampling::State sampled_;  // of a fit that was interrupted, until it goes on
  std::optional<PressSampling> sampling_;
  LawPlan plan_;
  std::map<int, CostEvaluation> ended_;    // of this run, by the stage's number
  PressObjective::Placements placements_;  // of the stage that was minimised last: equilibria of the next are near
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

Resolution resolution_of_tests(const Capture& capture, const FitOptions& options) {
  const bool is_chosen = options.element || capture.scene.object.volume;
  Resolution resolution;
  resolution.cells = is_chosen ? options.cells : options.cells / Refinement::mesh_ratio;
  resolution.element =
      options.element.value_or(is_chosen ? ElementKind::Tetrahedron : ElementKind::QuadraticTetrahedron);
  return resolution;
}

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
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{capture.file}, wrong, "", "see `pliant fit --help`"});
  require_known(capture, options);
  if (is_of_material_curves(capture)) return fit_material_curves(capture, options);
  return LawRun(capture, options, monitor, std::move(resume)).run();
}

}  // namespace pliant
