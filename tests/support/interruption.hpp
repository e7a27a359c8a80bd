#pragma once

#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "base/files.hpp"
#include "estimation/fit.hpp"
#include "estimation/fit_state.hpp"

namespace pliant::test {

/// Interrupts the fit that it watches, and keeps what that leaves to go on from. Outlives the monitor.
class Interruption {
 public:
  Interruption() = default;  ///< never
  /// At the first step of a stage.
  explicit Interruption(std::string stage) : stage_(std::move(stage)) {}
  /// As soon as such a state is saved.
  explicit Interruption(std::function<bool(const FitState&)> state) : state_(std::move(state)) {}

  /// At the given question whether it came, and ever after.
  explicit Interruption(int question) : question_(question) {}

  FitMonitor monitor() {
    FitMonitor monitor;
    monitor.on_event = [this](const FitEvent& event) {
      if (!stage_.empty() && event.stage == stage_) came_ = true;
    };
    monitor.on_state = [this](const FitState& state) {
      left_ = state;
      if (state_ && state_(state)) came_ = true;
    };
    monitor.interrupted = [this] {
      if (asked_++ == question_) came_ = true;
      return came_.load();
    };
    return monitor;
  }
  bool came() const { return came_; }
  int asked() const { return asked_; }  ///< questions so far
  /// As it is read back from a file.
  FitState left() const {
    const auto file = std::filesystem::temp_directory_path() / ("pliant.state." + std::to_string(::getpid()) + ".json");
    write_fit_state(file, left_, "key");
    FitState read = to_fit_state(read_file(file), file, "key");
    std::filesystem::remove(file);
    return read;
  }

 private:
  std::string stage_;
  std::function<bool(const FitState&)> state_;
  int question_ = -1;
  std::atomic<int> asked_ = 0;
  std::atomic<bool> came_ = false;
  FitState left_;
};

}  // namespace pliant::test
