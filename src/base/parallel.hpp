#pragma once

#include <concepts>
#include <cstddef>
#include <functional>
#include <memory>

namespace pliant {

// Parallel loops whose results do not depend on the number of threads: each index writes only what is its own, and sums
// over indices are taken afterwards, in order. Built without PLIANT_WITH_TBB the loops are serial.

/// Calls body(begin, end) on parts of [first, last) that together are the whole, on several threads, in any order.
/// Returns when all are done. An exception of a body ends the loop and is thrown on.
/// @param grain  parts of up to this size are not divided further, >= 1
void parallel_ranges(std::size_t first, std::size_t last, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body);

/// Calls body(i) once for each i of [first, last), as `parallel_ranges` does: a thread takes several indices at a time.
template <std::integral Index, std::invocable<Index> Body>
void parallel_for(Index first, Index last, const Body& body) {
  if (first >= last) return;
  parallel_ranges(0, std::size_t(last - first), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(Index(first + Index(i)));
  });
}

/// Calls body(i) once for each i of [0, count), each a task of its own: for few indices of much and uneven work.
void parallel_tasks(std::size_t count, const std::function<void(std::size_t)>& body);

/// Most threads that parallel loops use.
int thread_count();

/// Runs body. Where a thread waits within it for tasks, it takes up none but those that were begun within it: what it
/// waits for is not held up by longer ones.
void run_isolated(const std::function<void()>& body);

/// Tasks that run beside the thread that starts them.
class TaskGroup {
 public:
  TaskGroup();
  TaskGroup(const TaskGroup&) = delete;
  TaskGroup& operator=(const TaskGroup&) = delete;
  /// Drops tasks that have not begun, and waits for the others.
  ~TaskGroup();

  void run(std::function<void()> task);
  /// Returns when all tasks are done; throws on what one of them has thrown.
  void wait();

 private:
  struct Tasks;
  std::unique_ptr<Tasks> tasks_;
};

/// While it lives, parallel loops use at most so many threads.
class ThreadLimit {
 public:
  /// @param threads  >= 1
  explicit ThreadLimit(int threads);
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;
  ~ThreadLimit();

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

}  // namespace pliant
