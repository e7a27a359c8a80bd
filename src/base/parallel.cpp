#include "base/parallel.hpp"

#ifdef PLIANT_WITH_TBB
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>
#endif
#include <utility>

namespace pliant {

#ifdef PLIANT_WITH_TBB

void parallel_ranges(std::size_t first, std::size_t last, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) {
  if (first >= last) return;
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(first, last, grain), [&](const Range& range) { body(range.begin(), range.end()); });
}

void parallel_tasks(std::size_t count, const std::function<void(std::size_t)>& body) {
  tbb::parallel_for(std::size_t(0), count, body, tbb::simple_partitioner());
}

void run_isolated(const std::function<void()>& body) { tbb::this_task_arena::isolate(body); }

void parallel_parts(std::size_t count, const std::function<void(std::size_t)>& part) {
  run_isolated([&] { tbb::parallel_for(std::size_t(0), count, part); });
}

struct TaskGroup::Tasks {
  tbb::task_group group;
};

TaskGroup::TaskGroup() : tasks_(std::make_unique<Tasks>()) {}

TaskGroup::~TaskGroup() {
  tasks_->group.cancel();
  try {
    tasks_->group.wait();
  } catch (...) {  // who did not wait does not ask
  }
}

void TaskGroup::run(std::function<void()> task) { tasks_->group.run(std::move(task)); }
void TaskGroup::wait() { tasks_->group.wait(); }

struct ThreadLimit::Control {
  tbb::global_control limit;
};

ThreadLimit::ThreadLimit(int threads)
    : control_(new Control{{tbb::global_control::max_allowed_parallelism, std::size_t(threads)}}) {}

#else

void parallel_ranges(std::size_t first, std::size_t last, std::size_t,
                     const std::function<void(std::size_t, std::size_t)>& body) {
  if (first < last) body(first, last);
}

void parallel_tasks(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

void run_isolated(const std::function<void()>& body) { body(); }

void parallel_parts(std::size_t count, const std::function<void(std::size_t)>& part) {
  for (std::size_t i = 0; i < count; ++i) part(i);
}

struct TaskGroup::Tasks {};

TaskGroup::TaskGroup() = default;
TaskGroup::~TaskGroup() = default;
void TaskGroup::run(std::function<void()> task) { task(); }
void TaskGroup::wait() {}

struct ThreadLimit::Control {};

ThreadLimit::ThreadLimit(int) {}

#endif

ThreadLimit::~ThreadLimit() = default;

}  // namespace pliant
