#include "estimation/fit_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimation/notes.hpp"
#include "estimation/scan_errors.hpp"

namespace pliant {

namespace {

bool is_pull(const Parameter& p) { return p.role == Role::Initial && p.is_auxiliary; }
bool is_of_start(const Parameter& p) { return p.role == Role::Initial || p.role == Role::Load; }

/// A stage that another one follows ends a standard deviation from its minimum, or where that gains little.
void is_intermediate(Stage& stage) { stage.promise_tolerance = 0.5, stage.cost_tolerance = 2e-3; }

bool ends_at_failure(const StageRecord& record) { return !record.succeeded && !is_help(record.id.kind); }

/// Failed, and nothing can follow.
bool has_failed(const std::vector<StageRecord>& done, StageKind kind) {
  return std::ranges::any_of(done, [&](const StageRecord& r) { return r.id.kind == kind && !r.succeeded; });
}

/// The stages of a chain that are not done; none where one has failed.
StageChain left_of(StageChain chain, const std::vector<StageRecord>& done) {
  std::size_t first = 0;
  const StageRecord* before = nullptr;
  for (; first < chain.size(); ++first) {
    const StageRecord* record = find_record(done, chain[first].id);
    if (!record) break;
    if (ends_at_failure(*record)) return {};
    before = record;
  }
  StageChain left(chain.begin() + std::ptrdiff_t(first), chain.end());
  if (!left.empty() && before) {
    left.front().from = {before->theta};
    left.front().iterations_before = chain.front().iterations_before;
    for (std::size_t i = 0; i < first; ++i)
      left.front().iterations_before += counted_iterations(*find_record(done, chain[i].id));
  }
  return left;
}

}  // namespace

bool shapes_law(const Parameter& p) { return p.role == Role::Material && p.unit != "Pa"; }

bool is_help(StageKind kind) { return kind == StageKind::Pose || kind == StageKind::Motion; }

bool is_on_full_grid(StageKind kind) {
  return kind == StageKind::Fine || kind == StageKind::Corrected || kind == StageKind::OffScan ||
         kind == StageKind::Finer;
}

int counted_iterations(const StageRecord& record) { return record.id.kind == StageKind::Pulls ? 0 : record.iterations; }

const StageRecord* find_record(const std::vector<StageRecord>& done, const StageId& id) {
  const auto it = std::ranges::find(done, id, &StageRecord::id);
  return it == done.end() ? nullptr : &*it;
}

const StageRecord* estimate_of(const PassState& state) {
  const StageRecord* last = nullptr;
  for (const StageRecord& r : state.done)
    if (is_on_full_grid(r.id.kind) && r.succeeded) last = &r;
  return last;
}

PassState begun_from(const PassState& state) {
  PassState begun = state;
  begun.under_way.reset();
  begun.begin = PassState::Beginning{estimate_of(state)->theta, 0, estimate_of(state)->scan_errors};
  for (const StageRecord& r : state.done)
    if (r.id.kind == StageKind::Fine || r.id.kind == StageKind::Corrected) begun.begin->stage = r.id.number;
  std::erase_if(begun.done, [](const StageRecord& r) {
    return is_on_full_grid(r.id.kind) || r.id.kind == StageKind::Pulls || r.id.kind == StageKind::Alternative ||
           r.id.kind == StageKind::ScanErrors || r.id.kind == StageKind::Resolution;
  });
  return begun;
}

std::vector<StageChain> FitPlan::next(const PassState& state) const {
  const Records& done = state.done;
  if (!state.begin) {
    if (!facts_.told_at_rest.empty() && !find_record(done, {StageKind::Pose})) return {{pose()}};
    if (StageChain chain = left_of(motion(0, beginning(done)), done); !chain.empty()) return {chain};
    const StageRecord* swung = find_record(done, {StageKind::Swing});
    if (facts_.is_scanned && !swung) return {{swing(before_starts(done))}};
    if (swung && swung->converged) {
      // The pose before a release was found for another stiffness, which sags otherwise: it is looked for anew.
      StageChain chain = left_of(motion(2, without_pulls(swung->theta)), done);
      if (!chain.empty()) return {chain};
    } else if (swung) {
      for (int i = 0; i < scan_count(); ++i)
        if (!find_record(done, {StageKind::Scan, 0, i})) return {{scan(i, before_starts(done))}};
    }
    if (std::vector<StageChain> starts = starts_left(done); !starts.empty()) return starts;
  }
  if (StageChain chain = left_of(fine(done, state.begin), done); !chain.empty()) return {chain};
  if (has_failed(done, StageKind::Fine)) return {};
  const StageRecord* first = estimate(done);
  if (first && facts_.options.correct && !find_record(done, {StageKind::Test})) return {{test(*first)}};
  if (StageChain chain = left_of(corrected(done, state.begin), done); !chain.empty()) return {chain};
  if (has_failed(done, StageKind::Corrected)) return {};
  if (const StageRecord* at = estimate(done); at && facts_.limits.ends_if_unexplained && !at->is_explained) return {};
  if (StageChain chain = off_scan(done); !chain.empty()) return {chain};
  if (StageChain chain = finer(done); !chain.empty()) return {chain};
  if (std::vector<StageChain> left = alternatives(done); !left.empty()) return left;
  return resolution(done);
}

Stage FitPlan::last_look(const PassState& state) const {
  StageChain chain = corrected(state.done, state.begin);
  if (chain.empty()) chain = fine(state.done, state.begin);
  Stage last = chain.back();
  last.from = {state.begin ? state.begin->theta : best_start(state.done).first};
  for (const StageRecord& r : state.done)
    if (r.id.kind == StageKind::Pulls || r.id.kind == StageKind::Fine) last.from = {r.theta};
  return last;
}

// Stages ----------------------------------------------------------------------------------------------------------

/// Poses that are told at rest are found there, and held while starts are followed: they are linear in what is seen, so
/// a motion that is still wrong would bend them by degrees. The last stage has them free, from there.
Stage FitPlan::pose() const {
  Stage stage{{StageKind::Pose}, "pose", facts_.coarse};
  stage.horizon.until = Horizon::Until::Start;
  stage.band = facts_.options.wide_band, stage.iterations = 20;
  stage.free = facts_.told_at_rest;
  stage.from = {facts_.parameters.reference()};
  stage.done_to = 0.01;
  return stage;
}

StageChain FitPlan::motion(int first, const VectorX& from) const {
  const std::vector<std::string> free = names(is_of_start);
  if (free.empty()) return {};
  StageChain chain;
  for (int i = 0; i < 2; ++i) {
    Stage stage{{StageKind::Motion, 0, first + i}, "motion", facts_.coarse};
    stage.horizon = {Horizon::Until::Beginning, i == 0 ? 1.0 / 8 : 1.0 / 4};
    stage.band = facts_.options.wide_band, stage.iterations = 12;
    is_intermediate(stage);
    stage.by_pose = i == 0;
    stage.free = free;
    stage.done_to = 0.05;
    chain.push_back(std::move(stage));
  }
  chain.front().from = {from};
  return chain;
}

Stage FitPlan::swing(const VectorX& from) const {
  Stage stage{{StageKind::Swing}, "swing", facts_.coarse};
  stage.from = {from};
  stage.done_from = stage.done_to = 0.05;
  return stage;
}

namespace {

/// Whether a part of the recording holds as much as what is compared of it at all. Its stage is left out; the others
/// keep their numbers, as passes over other spans take them over.
bool is_all_of_span(double part, const PlanFacts& facts) {
  return part < 1.0 && facts.options.span > 0.0 && part >= facts.options.span;
}

/// Swings out of step are as wrong as any other: the valley about the truth narrows as more of them are seen. Parts of
/// an object swing faster than all of it: where they have moduli of their own, the first frames come first.
std::vector<double> growing_horizon(const PlanFacts& facts) {
  if (!facts.swings) return {0.6, 1.0};
  if (facts.moduli.size() > 1) return {0.04, 0.07, 0.12, 0.25, 0.5, 1.0};
  return {0.12, 0.25, 0.5, 1.0};
}

/// Of the stages on the full grid; the last one is in the narrow band.
std::vector<double> fine_horizons(const PlanFacts& facts) {
  return facts.swings ? std::vector{0.25, 0.5, 1.0, 1.0} : std::vector{1.0, 1.0};
}

}  // namespace

/// Over decades from the softest on that may hold itself up.
Stage FitPlan::scan(int number, const VectorX& from) const {
  const FitOptions& options = facts_.options;
  Stage stage{{StageKind::Scan, 0, number}, "scan", facts_.coarse};
  stage.band = options.wide_band;
  stage.horizon.part = growing_horizon(facts_).front();
  stage.from = {with_friction(from, number)};
  const double g = std::max(facts_.gravity.vector(from).norm(), 0.1);
  const double softest = facts_.softest > 0.0 ? facts_.softest : from[facts_.density] * g * facts_.size;
  const int per_decade = options.scan_per_decade * (facts_.swings ? 2 : 1);
  for (int i = 0; i <= 4 * per_decade; ++i) stage.trials.push_back(softest * std::pow(10.0, double(i) / per_decade));
  stage.iterations_before = number * int(stage.trials.size());
  const double share = 0.1 / scan_count();
  stage.done_from = 0.05 + number * share, stage.done_to = stage.done_from + share;
  return stage;
}

StageChain FitPlan::start(int index, const Records& done) const {
  StageChain chain;
  const std::vector<double> horizons = growing_horizon(facts_);
  std::optional<StageId> pose;
  for (const StageRecord& r : done)
    if (r.id.kind == StageKind::Motion && r.succeeded && !names(is_pull).empty()) pose = r.id;
  for (std::size_t i = 0; i < horizons.size(); ++i) {
    const bool last = i + 1 == horizons.size();
    if (i > 0 && is_all_of_span(horizons[i], facts_)) continue;
    Stage stage{{StageKind::Coarse, index, int(i)}, "coarse", facts_.coarse};
    stage.horizon.part = horizons[i];
    stage.band = facts_.options.wide_band, stage.iterations = last ? 10 : 5;
    is_intermediate(stage);
    // Poisson's ratio is told from the rest only once the fit is close. Pulls beside several moduli would make up for
    // what these lack: the pose that they hold is known, and takes no tangents where it is given.
    stage.pose_of = pose;
    stage.free = names([&](const Parameter& p) { return !shapes_law(p) && !(pose && is_pull(p)); });
    stage.done_from = 0.15 + 0.3 * (last ? 0.4 : 0.0), stage.done_to = stage.done_from + 0.15;
    chain.push_back(std::move(stage));
  }
  chain.front().tries_moduli = facts_.swings && facts_.moduli.size() > 1;
  const std::vector<VectorX> found = found_starts(done);
  chain.front().from = {index < int(found.size()) ? found[std::size_t(index)] : drawn_start(index, done)};
  return chain;
}

/// Pulls that hold the pose before a release on one mesh bend another one otherwise: they are looked for anew, from
/// those at hand and from none.
Stage FitPlan::pulls(const VectorX& from, const Spacing& grid, int number) const {
  Stage stage{{StageKind::Pulls, 0, number}, "pulls", grid};
  stage.horizon.until = Horizon::Until::Start;
  stage.band = facts_.options.wide_band, stage.iterations = 24;
  stage.free = names(is_pull);
  stage.from = {from, without_pulls(from)};
  return stage;
}

/// Thin objects are meshed by their thickness, however few cells are asked for: starts were then followed on the full
/// grid already, and the last stage is enough. So it is where the best start explains what was seen.
StageChain FitPlan::fine(const Records& done, const std::optional<PassState::Beginning>& begin) const {
  const FitOptions& options = facts_.options;
  const Spacing grid{options.cells, options.steps};
  const std::vector<double> horizons = fine_horizons(facts_);
  const double share = 0.15 / double(horizons.size() - 1);
  const bool is_last_one_corrected = begin && !needed_corrections(done).empty();
  const auto [start, index] = best_start(done);
  const VectorX from = begin ? with_poses_at_rest(begin->theta, done) : without_vanished_dampings(start);
  const StageRecord* best = end_of_start(index, done);
  const bool is_explained = best && best->misfit < good_misfit && !facts_.swings;
  const bool is_close = facts_.coarse_is_as_fine || (!begin && is_explained);
  StageChain chain;
  if (!begin && !names(is_pull).empty()) chain.push_back(pulls(from, grid, 0));
  for (std::size_t i = 0; i < horizons.size(); ++i) {
    const bool is_narrow = i + 1 == horizons.size(), is_last_wide = i + 2 == horizons.size(),
               is_last = is_narrow && !is_last_one_corrected;
    if ((!is_last && is_close) || is_all_of_span(horizons[i], facts_) || (begin && int(i) < begin->stage)) continue;
    Stage stage{{StageKind::Fine, index, int(i)}, is_narrow ? "fine" : "fine, wide band", grid};
    stage.horizon.part = horizons[i];
    stage.band = is_narrow ? options.fine_band : options.wide_band;
    stage.iterations = is_narrow ? options.max_iterations : std::max(1, options.max_iterations / 4);
    if (!is_narrow) is_intermediate(stage);
    if (is_last_wide) stage.give_up_above = facts_.limits.wide_band_cost;
    stage.free = free_at_last(done);
    if (!is_narrow)
      for (const Parameter& p : facts_.parameters.parameters())
        if (is_pose_at_rest(p)) std::erase(stage.free, p.name);
    // Where swings may still be out of step, Poisson's ratio and exponents would make up for what others lack.
    if (facts_.swings && !is_last)
      for (const std::string& name : names(shapes_law)) std::erase(stage.free, name);
    if (i > 0 && !is_narrow && !is_last_wide)
      for (const std::string& name : names(is_pull)) std::erase(stage.free, name);
    stage.done_from = is_narrow ? 0.6 : 0.45 + share * double(i);
    stage.done_to = is_narrow ? 0.9 : stage.done_from + share;
    chain.push_back(std::move(stage));
  }
  if (!chain.empty() && chain.front().from.empty()) chain.front().from = {from};
  for (Stage& stage : chain)
    if (begin) stage.change.scan_errors = begin->scan_errors;
  return chain;
}

Stage FitPlan::test(const StageRecord& estimate) const {
  Stage stage{{StageKind::Test}, "test", {facts_.options.cells, facts_.options.steps}};
  stage.change.scan_errors = estimate.scan_errors;
  stage.band = facts_.options.fine_band;
  stage.from = {estimate.theta};
  stage.done_from = stage.done_to = 0.9;
  return stage;
}

StageChain FitPlan::corrected(const Records& done, const std::optional<PassState::Beginning>& begin) const {
  if (needed_corrections(done).empty()) return {};
  const StageRecord* fine = narrow(done);
  if (!fine && !begin) return {};
  const FitOptions& options = facts_.options;
  const int number = int(fine_horizons(facts_).size());
  Stage stage{{StageKind::Corrected, best_start(done).second, number}, "corrected", {options.cells, options.steps}};
  stage.band = options.fine_band, stage.iterations = options.max_iterations;
  stage.iterations_before = iterations_on_full_grid(done);
  stage.free = free_at_last(done);
  stage.from = {fine ? fine->theta : begin->theta};
  if (begin) stage.change.scan_errors = begin->scan_errors;
  stage.done_from = 0.9, stage.done_to = 1.0;
  return {stage};
}

/// Looks at the scan's errors and estimates off it in turns, until a look shows none that are worth it: the differences
/// of models are taken about the last estimate.
StageChain FitPlan::off_scan(const Records& done) const {
  constexpr int most_estimates = 2;
  if (!facts_.looks_at_scan_errors) return {};
  const FitOptions& options = facts_.options;
  for (int i = 0; i < most_estimates; ++i) {
    const StageRecord* at = estimate(done);
    if (!at) return {};
    Stage look{{StageKind::ScanErrors, at->id.start, i}, "errors of the scan", {options.cells, options.steps}};
    Stage off{{StageKind::OffScan, at->id.start, i}, "off the scan", {options.cells, options.steps}};
    const StageRecord *looked = find_record(done, look.id), *ended = find_record(done, off.id);
    look.change = surface(done);
    look.band = off.band = options.fine_band;
    look.free = off.free = free_at_last(done);
    look.done_from = look.done_to = off.done_from = off.done_to = 1.0;
    look.from = {at->theta};
    if (!looked) return {look};
    if (!looked->converged || (ended && !ended->succeeded)) return {};
    if (ended) continue;
    off.change.scan_errors = looked->scan_errors;
    if (i + 1 < most_estimates) is_intermediate(off);
    off.iterations = options.max_iterations;
    off.iterations_before = iterations_on_full_grid(done);
    off.give_up_above = at->cost + prior_of_scan_errors(at->scan_errors) - prior_of_scan_errors(looked->scan_errors);
    off.from = {at->theta, looked->theta};
    return {off};
  }
  return {};
}

/// The next repetition, from where the one before ended.
StageChain FitPlan::finer(const Records& done) const {
  const StageRecord* before = estimate(done);
  double from = 1.0;
  for (std::size_t i = 0; i < facts_.repetitions.size() && before; ++i) {
    const Spacing& grid = facts_.repetitions[i];
    const StageRecord* asked = find_record(done, {StageKind::Resolution, before->id.start, int(i)});
    if (facts_.repeats_by_need && !(asked && asked->converged)) return {};
    Stage stage{{StageKind::Finer, before->id.start, int(i)},
                grid.cells == facts_.options.cells ? in_three_digits(grid.steps) + " x steps"
                                                   : in_three_digits(grid.cells) + " cells",
                grid};
    stage.done_from = from, from = stage.done_to = from + work(grid);
    if (const StageRecord* record = find_record(done, stage.id)) {
      if (!record->succeeded) return {};
      before = record;
      continue;
    }
    stage.band = facts_.options.fine_band, stage.iterations = facts_.options.max_iterations;
    stage.free = free_at_last(done);
    StageChain chain;
    if (!names(is_pull).empty()) chain.push_back(pulls(before->theta, grid, int(i) + 1));
    for (Stage& s : chain) s.change = surface(done);
    stage.change = surface(done);
    chain.push_back(std::move(stage));
    if (chain.front().from.empty()) chain.front().from = {before->theta};
    chain.front().iterations_before = iterations_on_full_grid(done);
    return left_of(std::move(chain), done);
  }
  return {};
}

/// Those that are left, at the result; those beside the first one once that is done.
std::vector<StageChain> FitPlan::alternatives(const Records& done) const {
  const StageRecord* at = result(done);
  if (!at) return {};
  const Spacing own = spacing_of(*at);
  const StageRecord* first = find_record(done, {StageKind::Alternative, at->id.start, 0});
  std::vector<StageChain> left;
  for (std::size_t i = 0; i < facts_.alternatives.size(); ++i) {
    const Alternative& a = facts_.alternatives[i];
    Stage stage{{StageKind::Alternative, at->id.start, int(i)}, a.cause, {own.cells * a.cells, own.steps * a.steps}};
    stage.band = facts_.options.fine_band;
    stage.free = free_at_last(done);
    stage.alternative = a;
    stage.change = a.change;
    stage.change.scan_errors = surface(done).scan_errors;
    stage.done_from = stage.done_to = 1.0;
    if (find_record(done, stage.id) || (a.beside_the_first && !first)) continue;
    stage.from = {a.beside_the_first ? first->theta : at->theta};
    left.push_back({std::move(stage)});
  }
  return left;
}

std::vector<StageChain> FitPlan::resolution(const Records& done) const {
  const StageRecord* at = result(done);
  if (!at || !facts_.repeats_by_need) return {};
  const std::size_t next = repetitions(done).size();
  Stage stage{{StageKind::Resolution, at->id.start, int(next)}, "resolution", spacing_of(*at)};
  const bool has_failed = find_record(done, {StageKind::Finer, at->id.start, int(next)});
  if (next >= facts_.repetitions.size() || has_failed || find_record(done, stage.id)) return {};
  stage.band = facts_.options.fine_band;
  stage.change = surface(done);
  stage.free = free_at_last(done);
  stage.from = {at->theta};
  stage.done_from = stage.done_to = 1.0;
  return {{std::move(stage)}};
}

// What the records say ----------------------------------------------------------------------------------------------

VectorX FitPlan::beginning(const Records& done) const {
  const StageRecord* posed = find_record(done, {StageKind::Pose});
  return posed ? posed->theta : facts_.parameters.reference();
}

VectorX FitPlan::with_poses_at_rest(VectorX theta, const Records& done) const {
  for (const Parameter& p : facts_.parameters.parameters())
    if (is_pose_at_rest(p)) theta.segment<3>(p.at) = beginning(done).segment<3>(p.at);
  return theta;
}

VectorX FitPlan::without_vanished_dampings(VectorX theta) const {
  constexpr double nothing = 0.01, again = 0.1;  // times where they began
  for (const Parameter& p : facts_.parameters.parameters()) {
    if (!p.estimated || p.role != Role::Damping) continue;
    const double began = facts_.parameters.reference()[p.at];
    if (theta[p.at] < nothing * began) theta[p.at] = again * began;
  }
  return theta;
}

VectorX FitPlan::before_starts(const Records& done) const {
  const StageRecord* swung = find_record(done, {StageKind::Swing});
  const bool has_swung = swung && swung->converged;
  VectorX theta = has_swung ? without_pulls(swung->theta) : beginning(done);
  for (const int number : has_swung ? std::array{2, 3} : std::array{0, 1})
    if (const StageRecord* motion = find_record(done, {StageKind::Motion, 0, number})) theta = motion->theta;
  return theta;
}

const StageRecord* FitPlan::first_of_start(int index, const Records& done) const {
  return find_record(done, {StageKind::Coarse, index, 0});
}

const StageRecord* FitPlan::end_of_start(int index, const Records& done) const {
  return find_record(done, {StageKind::Coarse, index, int(growing_horizon(facts_).size()) - 1});
}

/// All over the first frames; then the best of them to its end, and those that are not given up, which stop where they
/// come into the valley of one that was followed. A single one is followed at once.
std::vector<StageChain> FitPlan::starts_left(const Records& done) const {
  std::vector<StageChain> first, rest;
  const auto cost_of_first = [&](const StageChain& chain) {
    const StageRecord* r = first_of_start(chain.front().id.start, done);
    return r ? r->cost : infinite;
  };
  const int count = start_count(done);
  for (int i = 0; i < count; ++i) {
    StageChain chain = left_of(start(i, done), done);
    if (chain.empty()) continue;
    if (count > 1 && !first_of_start(i, done)) {
      chain.resize(1);
      first.push_back(std::move(chain));
    } else if (why_given_up(i, done).empty()) {
      rest.push_back(std::move(chain));
    }
  }
  if (!first.empty()) return first;
  bool has_ended = false;
  for (int i = 0; i < count; ++i) has_ended = has_ended || end_of_start(i, done);
  if (has_ended || rest.size() < 2) return rest;
  return {*std::ranges::min_element(rest, {}, cost_of_first)};
}

VectorX FitPlan::relative_moduli(const Records& done) const {
  const StageRecord* swung = find_record(done, {StageKind::Swing});
  if (!swung || !swung->converged) return facts_.relative_moduli;
  const VectorX theta = before_starts(done);
  VectorX moduli{Eigen::Index(facts_.moduli.size())};
  for (std::size_t k = 0; k < facts_.moduli.size(); ++k) moduli[Eigen::Index(k)] = theta[facts_.moduli[k]];
  return moduli / moduli[0];
}

VectorX FitPlan::with_modulus(VectorX theta, double youngs_modulus, const Records& done) const {
  const VectorX moduli = youngs_modulus * relative_moduli(done);
  for (std::size_t k = 0; k < facts_.moduli.size(); ++k) theta[facts_.moduli[k]] = moduli[Eigen::Index(k)];
  return theta;
}

VectorX FitPlan::without_pulls(VectorX theta) const {
  for (const Parameter& p : facts_.parameters.parameters())
    if (p.estimated && is_pull(p)) theta.segment<3>(p.at) = p.scale * p.prior_mean;
  return theta;
}

std::pair<VectorX, int> FitPlan::best_start(const Records& done) const {
  const StageRecord* best = nullptr;
  for (int i = 0; i < start_count(done); ++i) {
    const StageRecord* r = end_of_start(i, done);
    if (r && r->succeeded && (!best || r->cost < best->cost)) best = r;
  }
  return best ? std::pair{best->theta, best->id.start} : std::pair{before_starts(done), 0};
}

std::vector<std::string> FitPlan::needed_corrections(const Records& done) const {
  const StageRecord* test = find_record(done, {StageKind::Test});
  return test ? test->corrected : std::vector<std::string>{};
}

ParameterSet FitPlan::estimated(const Records& done) const {
  ParameterSet set = facts_.parameters;
  for (const std::string& name : needed_corrections(done)) set.set_estimated(name, true);
  return set;
}

const StageRecord* FitPlan::narrow(const Records& done) const {
  const int number = int(fine_horizons(facts_).size()) - 1;
  const auto it = std::ranges::find_if(
      done, [&](const StageRecord& r) { return r.id.kind == StageKind::Fine && r.id.number == number; });
  return it == done.end() || !it->succeeded ? nullptr : &*it;
}

const StageRecord* FitPlan::estimate(const Records& done) const {
  const StageRecord* off = nullptr;
  for (const StageRecord& r : done)
    if (r.id.kind == StageKind::OffScan && r.succeeded) off = &r;
  if (off) return off;
  const auto it = std::ranges::find(done, StageKind::Corrected, [](const StageRecord& r) { return r.id.kind; });
  if (it != done.end()) return it->succeeded ? &*it : nullptr;
  return narrow(done);
}

ModelChange FitPlan::surface(const Records& done) const {
  const StageRecord* at = estimate(done);
  return {.scan_errors = at ? at->scan_errors : std::vector<double>()};
}

std::vector<const StageRecord*> FitPlan::repetitions(const Records& done) const {
  std::vector<const StageRecord*> all;
  for (const StageRecord& r : done)
    if (r.id.kind == StageKind::Finer && r.succeeded) all.push_back(&r);
  return all;
}

const StageRecord* FitPlan::result(const Records& done) const {
  const StageRecord* finest = estimate(done);
  for (const StageRecord* r : repetitions(done))
    if (finest && spacing_of(*r).cells > spacing_of(*finest).cells) finest = r;
  return finest;
}

Spacing FitPlan::spacing_of(const StageRecord& record) const {
  if (record.id.kind == StageKind::Finer) return facts_.repetitions[std::size_t(record.id.number)];
  return {facts_.options.cells, facts_.options.steps};
}

double FitPlan::work(const Spacing& s) const {
  return 0.3 * s.steps / facts_.options.steps * std::pow(s.cells / facts_.options.cells, 3);
}

std::vector<std::string> FitPlan::names(const std::function<bool(const Parameter&)>& matches) const {
  std::vector<std::string> all;
  for (const Parameter& p : facts_.parameters.parameters())
    if (p.estimated && !is_pose_at_rest(p) && matches(p)) all.push_back(p.name);
  return all;
}

bool FitPlan::is_pose_at_rest(const Parameter& p) const {
  return p.role == Role::Sensor && std::ranges::find(facts_.told_at_rest, p.name) != facts_.told_at_rest.end();
}

std::vector<std::string> FitPlan::free_at_last(const Records& done) const {
  std::vector<std::string> all;
  for (const Parameter& p : facts_.parameters.parameters())
    if (p.estimated) all.push_back(p.name);
  for (const std::string& name : needed_corrections(done)) all.push_back(name);
  return all;
}

int FitPlan::iterations_on_full_grid(const Records& done) const {
  int count = 0;
  for (const StageRecord& r : done)
    if (is_on_full_grid(r.id.kind)) count += r.iterations;
  return count;
}

}  // namespace pliant
