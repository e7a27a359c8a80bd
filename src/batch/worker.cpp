#include "batch/worker.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <list>
#include <thread>

#include "base/error.hpp"
#include "base/files.hpp"
#include "batch/claim.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using JobEnd = BatchStatus::State;

constexpr int converged = 0, not_converged = 3, was_interrupted = 130;  // exit codes of a fit
constexpr std::chrono::seconds patience{120};                           // for a fit that was asked to end
constexpr std::chrono::milliseconds between_looks{50};

/// A fit that runs.
struct Running {
  const BatchJob* job;
  Claim claim;
  pid_t process;
  Clock::time_point begin;
  bool was_asked = false, has_timed_out = false;
  Clock::time_point asked = {};
};

pid_t start(const WorkerOptions& options, const BatchJob& job, int threads) {
  const fs::path out = options.batch / job.name;
  make_folder(out);
  std::vector<std::string> words = options.program;
  words.insert(words.end(), {"fit", job.capture.string(), "--out", out.string(), "--threads", std::to_string(threads)});
  words.insert(words.end(), options.words.begin(), options.words.end());
  if (is_file(out / "state.json")) words.push_back("--resume");
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const std::string said = (out / "messages.txt").string();
  int told[2];  // closed when the program is started; carries the error where it is not
  if (::pipe2(told, O_CLOEXEC) != 0)
    throw InputError({{options.program.front()}, "it cannot be started", "a pipe", ""});
  const pid_t parent = ::getpid(), process = ::fork();
  if (process == 0) {
    // Only what may be called between fork and exec. A group of its own: Ctrl-C in the terminal reaches the batch
    // alone, which asks its fits; where the batch is killed the kernel asks them.
    ::setpgid(0, 0);
    ::signal(SIGINT, SIG_DFL);
    ::prctl(PR_SET_PDEATHSIG, SIGINT);
    if (::getppid() != parent) ::_exit(was_interrupted);
    const int nothing = ::open("/dev/null", O_RDONLY),
              messages = ::open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    ::dup2(nothing, STDIN_FILENO), ::dup2(messages, STDOUT_FILENO), ::dup2(messages, STDERR_FILENO);
    ::execvp(arguments[0], arguments.data());
    const int error = errno;
    (void)!::write(told[1], &error, sizeof error);
    ::_exit(127);
  }
  ::close(told[1]);
  int error = process < 0 ? errno : 0;
  if (process > 0 && ::read(told[0], &error, sizeof error) > 0) ::waitpid(process, nullptr, 0);
  ::close(told[0]);
  if (error != 0)
    throw InputError(
        {{options.program.front()}, std::string("it cannot be started: ") + std::strerror(error), "the program", ""});
  return process;
}

/// The last line that is not empty.
std::string last_line(const fs::path& file) {
  if (!is_file(file)) return "";
  std::string text = read_file(file);
  const auto end = text.find_last_not_of(" \n\r");
  if (end == std::string::npos) return "";
  text.resize(end + 1);
  return text.substr(text.find_last_of("\n\r") + 1);
}

/// How a fit ended; nothing: it was interrupted, and is to be gone on with.
std::optional<BatchStatus> status_of(const WorkerOptions& options, const Running& running, int status) {
  BatchStatus ended;
  ended.key = running.job->key;
  const fs::path out = options.batch / running.job->name;
  const std::string said = last_line(out / "messages.txt");
  if (running.has_timed_out) {
    ended.state = JobEnd::TimedOut;
    ended.reason = "longer than " + std::to_string(options.timeout->count()) + " s";
    return ended;
  }
  if (!WIFEXITED(status)) {
    if (running.was_asked) return std::nullopt;
    ended.reason = "killed by signal " + std::to_string(WTERMSIG(status));
    return ended;
  }
  switch (WEXITSTATUS(status)) {
    case converged:
      ended.state = JobEnd::Converged;
      return ended;
    case not_converged:
      ended.state = JobEnd::NotConverged;
      ended.reason = last_line(out / "log.txt");
      return ended;
    case was_interrupted:
      return std::nullopt;
    default:
      ended.reason = said.empty() ? "exit code " + std::to_string(WEXITSTATUS(status)) : said;
      return ended;
  }
}

void ask_to_end(Running& running) {
  if (!running.was_asked) {
    ::kill(running.process, SIGINT);
    running.was_asked = true, running.asked = Clock::now();
  } else if (Clock::now() - running.asked > patience) {
    ::kill(running.process, SIGKILL);
  }
}

}  // namespace

int work(const std::vector<BatchJob>& jobs, const WorkerOptions& options) {
  const fs::path claims = options.batch / "claims";
  make_folder(options.batch), make_folder(claims);
  const int processors = std::max(1, int(std::thread::hardware_concurrency()));
  const int threads = options.threads > 0 ? options.threads : std::max(1, processors / options.workers);
  std::list<Running> running;
  int ended_here = 0;
  std::size_t next = 0;
  const auto interrupted = [&] { return options.interrupted && options.interrupted(); };
  bool is_ending = false;
  while (true) {
    is_ending = is_ending || interrupted();
    while (!is_ending && next < jobs.size() && int(running.size()) < options.workers) {
      const BatchJob& job = jobs[next++];
      if (read_status(options.batch, job)) continue;
      std::optional<Claim> claim = Claim::take(claims / job.key);
      if (!claim || read_status(options.batch, job)) continue;  // another has it, or had it
      const pid_t process = start(options, job, threads);
      running.push_back({&job, std::move(*claim), process, Clock::now()});
    }
    if (running.empty()) return ended_here;
    for (auto it = running.begin(); it != running.end();) {
      int status = 0;
      if (::waitpid(it->process, &status, WNOHANG) == it->process) {
        if (const auto ended = status_of(options, *it, status)) {
          write_status(options.batch, *it->job, *ended);
          ++ended_here;
          if (options.on_end) options.on_end(*it->job, *ended);
        }
        it = running.erase(it);
        continue;
      }
      if (options.timeout && !it->has_timed_out && Clock::now() - it->begin > *options.timeout)
        it->has_timed_out = true;
      if (is_ending || it->has_timed_out) ask_to_end(*it);
      ++it;
    }
    std::this_thread::sleep_for(between_looks);
  }
}

}  // namespace pliant
