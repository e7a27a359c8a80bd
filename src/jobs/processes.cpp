#include "jobs/processes.hpp"

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

#include "base/communicator.hpp"
#include "base/error.hpp"
#include "base/files.hpp"
#include "jobs/claim.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int was_interrupted = 130;           // exit code
constexpr std::chrono::seconds patience{120};  // for a process that was asked to end
constexpr std::chrono::milliseconds between_looks{50};

/// A job's process.
struct Running {
  Job* job;
  Claim claim;
  pid_t process;
  Clock::time_point begin;
  bool was_asked = false, has_timed_out = false;
  Clock::time_point asked = {};
};

pid_t start(const Job& job, int threads) {
  std::vector<std::string> words = job.words(threads);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::vector<std::string> environment = environment_without_launch();  // the job is no part of what mpirun started
  std::vector<char*> variables;
  for (std::string& variable : environment) variables.push_back(variable.data());
  variables.push_back(nullptr);
  const std::string said = job.messages().string();
  int told[2];  // closed when the program is started; carries the error where it is not
  if (::pipe2(told, O_CLOEXEC) != 0) throw InputError({{words.front()}, "it cannot be started", "a pipe", ""});
  const pid_t parent = ::getpid(), process = ::fork();
  if (process == 0) {
    // Only what may be called between fork and exec. A group of its own: Ctrl-C in the terminal reaches the program
    // alone, which asks its processes; where it is killed the kernel asks them.
    ::setpgid(0, 0);
    ::signal(SIGINT, SIG_DFL);
    ::prctl(PR_SET_PDEATHSIG, SIGINT);
    if (::getppid() != parent) ::_exit(was_interrupted);
    const int nothing = ::open("/dev/null", O_RDONLY),
              messages = ::open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    ::dup2(nothing, STDIN_FILENO), ::dup2(messages, STDOUT_FILENO), ::dup2(messages, STDERR_FILENO);
    ::execvpe(arguments[0], arguments.data(), variables.data());
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
        {{words.front()}, std::string("it cannot be started: ") + std::strerror(error), "the program", ""});
  return process;
}

void ask_to_end(Running& running) {
  if (!running.was_asked) {
    ::kill(running.process, SIGINT);
    running.was_asked = true, running.asked = Clock::now();
  } else if (Clock::now() - running.asked > patience) {
    ::kill(running.process, SIGKILL);
  }
}

ProcessEnd end_of(const Running& running, int status) {
  ProcessEnd end;
  end.was_asked = running.was_asked, end.has_timed_out = running.has_timed_out;
  (WIFEXITED(status) ? end.exit_code : end.signal) = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
  return end;
}

}  // namespace

int run_processes(const std::vector<std::unique_ptr<Job>>& jobs, const ProcessOptions& options) {
  make_folder(options.claims);
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
      Job& job = *jobs[next++];
      if (job.has_ended()) continue;
      std::optional<Claim> claim = Claim::take(options.claims / job.key());
      if (!claim || job.has_ended()) continue;  // another has it, or had it
      const pid_t process = start(job, threads);
      running.push_back({&job, std::move(*claim), process, Clock::now()});
    }
    if (running.empty()) return ended_here;
    for (auto it = running.begin(); it != running.end();) {
      int status = 0;
      if (::waitpid(it->process, &status, WNOHANG) == it->process) {
        const Job::Next then = it->job->end(end_of(*it, status));
        if (then == Job::Next::Again && !is_ending) {
          it->process = start(*it->job, threads), it->begin = Clock::now();
          it->was_asked = it->has_timed_out = false;
          continue;
        }
        ended_here += then == Job::Next::Ended ? 1 : 0;
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

std::vector<std::string> own_program() {
  const fs::path self = fs::read_symlink("/proc/self/exe");
  if (self.filename().string().starts_with("python")) return {self.string(), "-m", "pliant"};
  return {self.string()};
}

std::string last_line(const fs::path& file) {
  if (!is_file(file)) return "";
  std::string text = read_file(file);
  const auto end = text.find_last_not_of(" \n\r");
  if (end == std::string::npos) return "";
  text.resize(end + 1);
  return text.substr(text.find_last_of("\n\r") + 1);
}

}  // namespace pliant
