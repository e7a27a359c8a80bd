#include "batch/worker.hpp"

#include "base/files.hpp"
#include "jobs/processes.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;
using JobEnd = BatchStatus::State;

constexpr int converged = 0, not_converged = 3, was_interrupted = 130;  // exit codes of a fit

/// A fit in a process of its own.
class FitProcess : public Job {
 public:
  FitProcess(const BatchJob& job, const WorkerOptions& options) : job_(job), options_(options) {}

  std::string key() const override { return job_.key; }
  bool has_ended() const override { return read_status(options_.batch, job_).has_value(); }
  std::vector<std::string> words(int threads) const override {
    make_folder(folder());
    std::vector<std::string> words = options_.program;
    words.insert(words.end(),
                 {"fit", job_.capture.string(), "--out", folder().string(), "--threads", std::to_string(threads)});
    words.insert(words.end(), options_.words.begin(), options_.words.end());
    if (is_file(folder() / "state.json")) words.push_back("--resume");
    return words;
  }
  fs::path messages() const override { return folder() / "messages.txt"; }
  Next end(const ProcessEnd& end) override {
    const std::optional<BatchStatus> status = status_of(end);
    if (!status) return Next::Open;
    write_status(options_.batch, job_, *status);
    if (options_.on_end) options_.on_end(job_, *status);
    return Next::Ended;
  }

 private:
  fs::path folder() const { return options_.batch / job_.name; }

  /// How the fit ended; nothing: it was interrupted, and is to be gone on with.
  std::optional<BatchStatus> status_of(const ProcessEnd& end) const {
    BatchStatus ended;
    ended.key = job_.key;
    if (end.has_timed_out) {
      ended.state = JobEnd::TimedOut;
      ended.reason = "longer than " + std::to_string(options_.timeout->count()) + " s";
      return ended;
    }
    if (end.signal != 0) {
      if (end.was_asked) return std::nullopt;
      ended.reason = "killed by signal " + std::to_string(end.signal);
      return ended;
    }
    switch (end.exit_code) {
      case converged:
        ended.state = JobEnd::Converged;
        return ended;
      case not_converged:
        ended.state = JobEnd::NotConverged;
        ended.reason = last_line(folder() / "log.txt");
        return ended;
      case was_interrupted:
        return std::nullopt;
      default:
        ended.reason = last_line(messages());
        if (ended.reason.empty()) ended.reason = "exit code " + std::to_string(end.exit_code);
        return ended;
    }
  }

  const BatchJob& job_;
  const WorkerOptions& options_;
};

}  // namespace

int work(const std::vector<BatchJob>& jobs, const WorkerOptions& options) {
  make_folder(options.batch);
  std::vector<std::unique_ptr<Job>> processes;
  for (const BatchJob& job : jobs) processes.push_back(std::make_unique<FitProcess>(job, options));
  ProcessOptions running;
  running.claims = options.batch / "claims";
  running.workers = options.workers, running.threads = options.threads;
  running.timeout = options.timeout, running.interrupted = options.interrupted;
  return run_processes(processes, running);
}

}  // namespace pliant
