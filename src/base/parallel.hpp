#pragma once

#include <algorithm>
#include <array>
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

/// Runs body. Where a thread waits within it for tasks, it takes up none but those that were begun within it: what it
/// waits for is not held up by longer ones.
void run_isolated(const std::function<void()>& body);

/// Calls part(i) once for each i of [0, count), on several threads. A thread that waits for the others takes up nothing
/// but parts of this loop, so that it may run inside tasks that are long themselves.
void parallel_parts(std::size_t count, const std::function<void(std::size_t)>& part);

/// How [0, count) is cut for loops over large arrays: by the count alone, never by the number of threads, so that sums
/// taken part by part are the same for any. Short arrays are one part, which the calling thread walks through.
struct Parts {
  static constexpr std::size_t least = 4096, most = 512;  ///< indices in a part; parts
  explicit Parts(std::size_t indices, std::size_t smallest = least)
      : count(indices), size(std::max(smallest, (indices + most - 1) / most)) {}
  std::size_t parts() const { return std::max<std::size_t>(1, (count + size - 1) / size); }
  std::size_t begin(std::size_t part) const { return part * size; }
  std::size_t end(std::size_t part) const { return std::min(count, (part + 1) * size); }
  std::size_t count, size;
};

/// Calls body(begin, end) for each part.
template <class Body>
void for_parts(const Parts& parts, const Body& body) {
  if (parts.parts() == 1) return body(std::size_t(0), parts.count);
  parallel_parts(parts.parts(), [&](std::size_t i) { body(parts.begin(i), parts.end(i)); });
}

/// Sum of body(begin, end) over the parts, taken in order.
template <class Body>
double sum_parts(const Parts& parts, const Body& body) {
  if (parts.parts() == 1) return body(std::size_t(0), parts.count);
  std::array<double, Parts::most> sums;
  parallel_parts(parts.parts(), [&](std::size_t i) { sums[i] = body(parts.begin(i), parts.end(i)); });
  double sum = 0.0;
  for (std::size_t i = 0; i < parts.parts(); ++i) sum += sums[i];
  return sum;
}

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
