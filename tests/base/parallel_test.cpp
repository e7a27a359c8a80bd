#include "base/parallel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <vector>

namespace pliant::parallel_test {
namespace {

TEST(ParallelFor, TakesEachIndexOnce) {
  for (const int count : {0, 1, 2, 1000}) {
    std::vector<int> seen(std::size_t(count) + 5, 0);
    parallel_for(5, 5 + count, [&](int i) { ++seen[std::size_t(i)]; });
    for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], i < 5 ? 0 : 1) << i;
  }
}

TEST(ParallelFor, OfAnEmptyOrBackwardRangeIsNothing) {
  int calls = 0;
  parallel_for(3, 3, [&](int) { ++calls; });
  parallel_for(3, -2, [&](int) { ++calls; });
  parallel_ranges(7, 7, 4, [&](std::size_t, std::size_t) { ++calls; });
  parallel_ranges(7, 2, 4, [&](std::size_t, std::size_t) { ++calls; });
  parallel_tasks(0, [&](std::size_t) { ++calls; });
  EXPECT_EQ(calls, 0);
}

TEST(ParallelFor, CountsFromNegativeNumbers) {
  std::vector<int> seen(8, 0);
  parallel_for(-4, 4, [&](int i) { seen[std::size_t(i + 4)] = i; });
  EXPECT_EQ(seen, (std::vector<int>{-4, -3, -2, -1, 0, 1, 2, 3}));
}

TEST(Parts, AreTheWholeAndFollowFromTheCountAlone) {
  for (const std::size_t count :
       {std::size_t(0), std::size_t(1), Parts::least, Parts::least + 1, std::size_t(9'999'999)}) {
    const Parts parts(count);
    EXPECT_LE(parts.parts(), Parts::most);
    EXPECT_EQ(parts.parts() == 1, count <= Parts::least);
    std::size_t next = 0;
    for (std::size_t i = 0; i < parts.parts(); ++i) {
      EXPECT_EQ(parts.begin(i), next);
      next = parts.end(i);
    }
    EXPECT_EQ(next, count);
  }
  EXPECT_EQ(Parts(100, 10).parts(), 10u);
}

/// Numbers whose sum depends on the order in which they are added.
TEST(SumParts, AreTheSameForAnyNumberOfThreads) {
  const Parts parts(100'000);
  ASSERT_GT(parts.parts(), 10u);
  const auto sum = [&](int threads) {
    const ThreadLimit limit(threads);
    return sum_parts(parts, [](std::size_t first, std::size_t last) {
      double own = 0.0;
      for (std::size_t i = first; i < last; ++i) own += 1.0 / (1.0 + double(i * 7919 % 100'003));
      return own;
    });
  };
  const double alone = sum(1);
  EXPECT_GT(alone, 1.0);
  for (int repetition = 0; repetition < 20; ++repetition) {
    EXPECT_EQ(sum(2), alone);
    EXPECT_EQ(sum(4), alone);
  }
  std::vector<int> seen(100'000, 0);
  for_parts(parts, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) ++seen[i];
  });
  EXPECT_EQ(std::ranges::count(seen, 1), 100'000);
}

/// A loop inside a long task: who waits for it does not begin another task.
TEST(ParallelParts, RunInsideTasks) {
  std::vector<double> sums(8);
  parallel_tasks(sums.size(), [&](std::size_t task) {
    sums[task] =
        sum_parts(Parts(50'000), [&](std::size_t first, std::size_t last) { return double(task * (last - first)); });
  });
  for (std::size_t task = 0; task < sums.size(); ++task) EXPECT_EQ(sums[task], 50'000.0 * double(task));
}

TEST(ParallelRanges, AreTheWholeInPartsThatDoNotOverlap) {
  std::vector<int> seen(10'000, 0);
  parallel_ranges(17, seen.size(), 128, [&](std::size_t begin, std::size_t end) {
    EXPECT_LT(begin, end);
    for (std::size_t i = begin; i < end; ++i) ++seen[i];
  });
  for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], i < 17 ? 0 : 1) << i;
}

TEST(ParallelTasks, TakeEachIndexOnce) {
  std::vector<int> seen(50, 0);
  parallel_tasks(seen.size(), [&](std::size_t i) { ++seen[i]; });
  EXPECT_EQ(seen, std::vector<int>(50, 1));
}

TEST(ParallelLoops, ThrowOnWhatABodyThrows) {
  const auto fail = [](std::size_t i) {
    if (i == 3) throw std::out_of_range("three");
  };
  EXPECT_THROW(parallel_for(std::size_t(0), std::size_t(9), fail), std::out_of_range);
  EXPECT_THROW(parallel_tasks(9, fail), std::out_of_range);
}

TEST(ParallelLoops, RunInsideOneAnother) {
  std::vector<std::vector<int>> seen(20, std::vector<int>(30, 0));
  parallel_tasks(seen.size(), [&](std::size_t i) { parallel_for(0, 30, [&](int k) { seen[i][std::size_t(k)] = k; }); });
  for (const std::vector<int>& row : seen)
    for (int k = 0; k < 30; ++k) EXPECT_EQ(row[std::size_t(k)], k);
}

TEST(TaskGroup, HasDoneAllWhenWaitedFor) {
  std::vector<int> done(100, 0);
  TaskGroup group;
  for (std::size_t i = 0; i < done.size(); ++i) group.run([&done, i] { done[i] = int(i); });
  group.wait();
  for (std::size_t i = 0; i < done.size(); ++i) EXPECT_EQ(done[i], int(i));
}

TEST(TaskGroup, ThrowsOnWhatATaskThrows) {
  const auto run = [] {
    TaskGroup group;
    group.run([] { throw std::out_of_range("a task"); });
    group.wait();
  };
  EXPECT_THROW(run(), std::out_of_range);
}

TEST(TaskGroup, LeftByAnExceptionWaitsForWhatIsUnderWay) {
  std::atomic<int> begun = 0, ended = 0;
  const auto run = [&] {
    TaskGroup group;
    for (int i = 0; i < 20; ++i)
      group.run([&] {
        ++begun;
        ++ended;
      });
    throw std::logic_error("beside the tasks");
  };
  EXPECT_THROW(run(), std::logic_error);
  EXPECT_EQ(begun, ended);
}

TEST(ThreadLimit, OfOneLetsABodyWriteWhatAllShare) {
  const ThreadLimit one(1);
  std::vector<int> all;
  parallel_tasks(64, [&](std::size_t i) { all.push_back(int(i)); });
  EXPECT_EQ(all.size(), 64U);
}

}  // namespace
}  // namespace pliant::parallel_test
