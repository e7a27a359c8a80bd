#include "estimation/stage_loop.hpp"

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "base/profile.hpp"
#include "estimation/fit_plan.hpp"

namespace pliant {

void StageLoop::execute() {
  while (!interrupted_) {
    const std::vector<StageChain> chains = next();
    if (chains.empty()) return;
    if (monitor_.has_others()) {  // what they exchange has an order
      for (const StageChain& chain : chains) run_chain(chain);
      continue;
    }
    parallel_tasks(chains.size(), [&](std::size_t i) { run_chain(chains[i]); });
  }
}

void StageLoop::run_chain(const StageChain& chain) {
  using Clock = std::chrono::steady_clock;
  VectorX theta;
  int counted = chain.front().iterations_before;
  for (Stage stage : chain) {
    if (is_interrupted()) {
      interrupted_ = true;
      return;
    }
    if (stage.from.empty()) stage.from = {theta};
    stage.iterations_before = counted;
    bool is_cut = false;
    StageRecord record;
    const auto begin = Clock::now();
    try {
      record = run_stage(stage, is_cut);
    } catch (const Interrupted&) {  // in the midst of a simulation: the state has where the optimiser stood
      interrupted_ = true;
      return;
    }
    if (is_cut) {
      const std::lock_guard lock(mutex_);
      interrupted_ = true;
      partial_.push_back(std::move(record));
      return;
    }
    if (Profile* profile = Profile::current())
      profile->add({stage.name, stage.id.start, record.iterations, record.elements, record.work,
                    std::chrono::duration<double>(Clock::now() - begin).count()});
    theta = record.theta, counted += counted_iterations(record);
    const bool ends = !record.succeeded && !is_help(stage.id.kind);
    keep(std::move(record));
    if (ends) return;
  }
}

void StageLoop::keep(StageRecord record) {
  const std::lock_guard lock(mutex_);
  if (state_.under_way && state_.under_way->id == record.id) state_.under_way.reset();
  state_.done.push_back(std::move(record));
  save();
}

void StageLoop::keep_under_way(const Stage& stage, OptimiserState optimiser) {
  state_.under_way = {stage.id, stage.from.front(), std::move(optimiser)};
  save();
}

void StageLoop::save() {
  if (monitor_.on_state) monitor_.on_state(whole_state());
}

void StageLoop::emit(FitEvent event) {
  const std::lock_guard lock(mutex_);
  if (monitor_.on_event) monitor_.on_event(event);
  outcome_.history.push_back(std::move(event));
}

}  // namespace pliant
