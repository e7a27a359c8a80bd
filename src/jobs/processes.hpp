#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace pliant {

/// How the process of a job ended.
struct ProcessEnd {
  int exit_code = 0;           ///< where no signal killed it
  int signal = 0;              ///< that killed it; 0: none
  bool was_asked = false;      ///< to end, since the work was interrupted or took too long
  bool has_timed_out = false;  ///< it took too long
};

/// A piece of work for a process of its own, known by its key to all processes that share a folder.
class Job {
 public:
  Job() = default;
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;
  virtual ~Job() = default;

  /// Of the work as a whole: a name of a file.
  virtual std::string key() const = 0;
  /// Whether the work was done, by whom ever: what the shared folder says.
  virtual bool has_ended() const = 0;
  /// The program and its arguments, asked for just before it is started.
  virtual std::vector<std::string> words(int threads) const = 0;
  /// File for what the process says; its folder exists once `words` was asked for.
  virtual std::filesystem::path messages() const = 0;

  enum class Next {
    Ended,  ///< the work is done
    Open,   ///< it is not, and others may go on with it
    Again,  ///< it is not, and is gone on with at once
  };
  /// Takes note of how its process ended.
  virtual Next end(const ProcessEnd& end) = 0;
};

/// How jobs are run.
struct ProcessOptions {
  std::filesystem::path claims;                 ///< folder of the claims, on the file system that all share
  int workers = 1;                              ///< processes at once
  int threads = 0;                              ///< of each; 0: all processors divided among them
  std::optional<std::chrono::seconds> timeout;  ///< of one process; after it the process is asked to end
  std::function<bool()> interrupted;            ///< asked a few times a second; may be empty
};

/// Runs the jobs that have no end yet and that nobody else holds, each in a process of its own, until none is left that
/// it could take. Where it is interrupted or killed, so are its processes, and the jobs are left to others. Returns how
/// many jobs ended here. Throws InputError where a folder cannot be written or a program cannot be started.
int run_processes(const std::vector<std::unique_ptr<Job>>& jobs, const ProcessOptions& options);

/// Words that start the program that runs now again, for its own jobs.
std::vector<std::string> own_program();

/// The last line of a file that is not empty; nothing of a file that is not there.
std::string last_line(const std::filesystem::path& file);

}  // namespace pliant
