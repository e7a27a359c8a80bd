#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "base/communicator.hpp"

namespace pliant::test {

/// Threads of one process that exchange what they find as processes do. Who waits for one that does not come fails.
class ThreadRank : public Communicator {
 public:
  static std::vector<std::shared_ptr<Communicator>> make(int size) {
    const auto meeting = std::make_shared<Meeting>(size), ends = std::make_shared<Meeting>(size);
    std::vector<std::shared_ptr<Communicator>> ranks;
    for (int rank = 0; rank < size; ++rank) ranks.push_back(std::make_shared<ThreadRank>(rank, meeting, ends));
    return ranks;
  }

  /// A place where as many meet, again and again.
  struct Meeting {
    explicit Meeting(int count) : size(count), handed(std::size_t(count)) {}
    const int size;
    std::mutex mutex;
    std::condition_variable all_are_here;
    std::vector<std::string> handed, out;
    std::map<int, std::pair<std::shared_ptr<Meeting>, std::shared_ptr<Meeting>>> parts;
    int here = 0;
    long round = 0;

    /// Nothing where they do not all come in time.
    std::optional<std::vector<std::string>> exchange(int rank, std::string own, std::chrono::milliseconds patience) {
      std::unique_lock lock(mutex);
      handed[std::size_t(rank)] = std::move(own);
      const long began = round;
      if (++here == size) {
        out = handed;
        here = 0, ++round;
        all_are_here.notify_all();
      } else if (!all_are_here.wait_for(lock, patience, [&] { return round != began; })) {
        return std::nullopt;
      }
      return out;
    }
  };

  ThreadRank(int rank, std::shared_ptr<Meeting> meeting, std::shared_ptr<Meeting> ends)
      : rank_(rank), meeting_(std::move(meeting)), ends_(std::move(ends)) {}

  int rank() const override { return rank_; }
  int size() const override { return meeting_->size; }
  [[nodiscard]] std::vector<std::string> all_gather(std::string own) override {
    auto all = meeting_->exchange(rank_, std::move(own), std::chrono::minutes(5));
    if (!all) throw std::logic_error("rank " + std::to_string(rank_) + " waits for one that does not come");
    return std::move(*all);
  }
  [[nodiscard]] std::shared_ptr<Communicator> first(int count) override {
    if (rank_ >= count) return nullptr;
    const std::lock_guard lock(meeting_->mutex);
    auto& [meeting, ends] = meeting_->parts[count];
    if (!meeting) meeting = std::make_shared<Meeting>(count), ends = std::make_shared<Meeting>(count);
    return std::make_shared<ThreadRank>(rank_, meeting, ends);
  }
  [[nodiscard]] std::optional<std::vector<int>> end(int exit_code,
                                                    std::optional<std::chrono::milliseconds> patience) override {
    const auto all =
        ends_->exchange(rank_, std::to_string(exit_code), patience.value_or(std::chrono::milliseconds(300000)));
    if (!all) return std::nullopt;
    std::vector<int> codes;
    for (const std::string& code : *all) codes.push_back(std::stoi(code));
    return codes;
  }
  [[noreturn]] void abort(int) override { throw std::logic_error("aborted"); }

 private:
  int rank_;
  std::shared_ptr<Meeting> meeting_, ends_;
};

/// Runs each rank in a thread of its own. Returns what each of them has thrown; null: nothing.
inline std::vector<std::exception_ptr> run_ranks(
    int size, const std::function<void(const std::shared_ptr<Communicator>&)>& rank) {
  std::vector<std::exception_ptr> thrown((std::size_t(size)));
  std::vector<std::thread> threads;
  for (const std::shared_ptr<Communicator>& communicator : ThreadRank::make(size))
    threads.emplace_back([&, communicator] {
      try {
        rank(communicator);
      } catch (...) {
        thrown[std::size_t(communicator->rank())] = std::current_exception();
      }
    });
  for (std::thread& thread : threads) thread.join();
  return thrown;
}

/// What an exception says; empty: there is none.
inline std::string what_of(const std::exception_ptr& thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace pliant::test
