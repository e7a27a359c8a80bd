#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/communicator.hpp"

namespace pliant {

/// Processes that carry out one task together. Each goes the same way with the same numbers, does its share of the work
/// that is shared out, and takes from the others what they found. What only one of them can know, a signal or a
/// failure, is agreed on before any of them acts on it.
class ProcessGroup {
 public:
  /// @param asked  whether this process is asked to stop; from any thread; may be empty
  explicit ProcessGroup(std::shared_ptr<Communicator> communicator = std::make_shared<SingleProcess>(),
                        std::function<bool()> asked = {});

  int rank() const { return communicator_->rank(); }
  int size() const { return communicator_->size(); }
  bool is_alone() const { return size() == 1; }
  bool is_first() const { return rank() == 0; }  ///< the one that tells, draws and writes

  /// What each process makes of its share, by rank. An exception of one of them is thrown in all: Interrupted and
  /// InputError as such, others as std::runtime_error; of several that of the lowest rank.
  /// Throws std::runtime_error in all where they did not come here for the same.
  /// @param what  they came here for, with whatever should be the same in all
  [[nodiscard]] std::vector<std::string> gather(std::string_view what, const std::function<std::string()>& make);

  /// What the first process makes, in all.
  [[nodiscard]] std::string of_first(std::string_view what, const std::function<std::string()>& make);

  /// Whether one of them was asked to stop, as far as they know from each other: between two exchanges the same in all.
  /// Of one alone: whether it is asked.
  bool is_interrupted() const;
  /// The same after an exchange: where nothing else is exchanged for long.
  [[nodiscard]] bool agrees_to_stop();
  /// Whether this process is asked to stop: for a share of work, which may end early by throwing Interrupted.
  bool is_asked_to_stop() const { return asked_ && asked_(); }

 private:
  std::shared_ptr<Communicator> communicator_;
  std::function<bool()> asked_;
  bool is_interrupted_ = false;  // as agreed
};

/// How pieces of work are shared out: the largest first, each to whom has least so far.
/// @param work     of each piece, >= 0
/// @param workers  >= 1
/// @return         of each piece its worker, 0..workers - 1; of equals the lower number
[[nodiscard]] std::vector<int> shared_out(const std::vector<double>& work, int workers);

}  // namespace pliant
