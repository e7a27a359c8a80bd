#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace pliant {

/// How processes that carry out one task together exchange what they find. Each call is made by all of them, one call
/// at a time and in the same order.
class Communicator {
 public:
  Communicator() = default;
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;
  virtual ~Communicator() = default;

  virtual int rank() const = 0;  ///< of this process, 0..size - 1
  virtual int size() const = 0;  ///< processes, >= 1

  /// What every process hands in, by rank. Returns once all have; who waits leaves the processor to others.
  [[nodiscard]] virtual std::vector<std::string> all_gather(std::string own) = 0;

  /// The first so many of the processes by themselves, 1..size; null in the others.
  [[nodiscard]] virtual std::shared_ptr<Communicator> first(int count) = 0;

  /// The end of a process's part of the task, at which it exchanges nothing any more: the exit codes of all, by rank.
  /// @param patience  for the others to come to their end; nothing: as long as it takes
  /// Nothing where some did not: they wait for what this process will not hand in.
  [[nodiscard]] virtual std::optional<std::vector<int>> end(
      int exit_code, std::optional<std::chrono::milliseconds> patience = std::nullopt) = 0;

  /// Ends all processes at once, with that exit code.
  [[noreturn]] virtual void abort(int exit_code) = 0;
};

/// One process by itself.
class SingleProcess : public Communicator {
 public:
  int rank() const override { return 0; }
  int size() const override { return 1; }
  [[nodiscard]] std::vector<std::string> all_gather(std::string own) override { return {std::move(own)}; }
  [[nodiscard]] std::shared_ptr<Communicator> first(int) override { return std::make_shared<SingleProcess>(); }
  [[nodiscard]] std::optional<std::vector<int>> end(int exit_code, std::optional<std::chrono::milliseconds>) override {
    return std::vector<int>{exit_code};
  }
  [[noreturn]] void abort(int exit_code) override;
};

/// How this process was started, as a launcher of MPI (mpirun, mpiexec, srun) says in the environment.
struct Launch {
  int rank = 0, size = 1;  ///< of the processes started together; without a launcher 0 of 1
};
Launch launch_of_environment();

/// The environment, NAME=value, without what a launcher of MPI has put there: for a program that is to run by itself.
std::vector<std::string> environment_without_launch();

/// Whether this build can exchange anything with other processes: `-DPLIANT_WITH_MPI=ON`.
bool has_mpi();

/// The processes that a launcher has started together with this one; this one by itself where there are no others.
/// Called once in a process.
/// Throws InputError where there are others and the build has no MPI, or another one than the launcher.
std::shared_ptr<Communicator> launched_processes();

/// How many threads each process should use so that those on one machine share out the processors that they may run on;
/// >= 1.
int fair_threads(Communicator& communicator);

}  // namespace pliant
