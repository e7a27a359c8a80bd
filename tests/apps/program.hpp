#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace pliant::test {

/// What a run of the program left behind.
struct ProgramRun {
  int exit_code = -1;
  std::string out, err;
};

/// Runs a program with its arguments, as a user's shell would.
/// @param at_text  once stderr holds it, `then` is called with the process; empty: never
inline ProgramRun run_words(const std::vector<std::string>& words, const std::string& at_text = "",
                            const std::function<void(pid_t)>& then = {}) {
  int out[2], err[2];
  if (::pipe(out) != 0 || ::pipe(err) != 0) throw std::runtime_error("no pipe");
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no fork");
  if (child == 0) {
    ::dup2(out[1], STDOUT_FILENO), ::dup2(err[1], STDERR_FILENO);
    for (const int end : {out[0], out[1], err[0], err[1]}) ::close(end);
    ::execvp(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(out[1]), ::close(err[1]);
  ProgramRun run;
  bool called = at_text.empty();
  pollfd ends[2] = {{out[0], POLLIN, 0}, {err[0], POLLIN, 0}};
  while (ends[0].fd >= 0 || ends[1].fd >= 0) {
    if (::poll(ends, 2, -1) < 0) break;
    for (int i = 0; i < 2; ++i) {
      if (ends[i].fd < 0 || ends[i].revents == 0) continue;
      char buffer[4096];
      const ssize_t got = ::read(ends[i].fd, buffer, sizeof buffer);
      if (got <= 0)
        ends[i].fd = -1;
      else
        (i == 0 ? run.out : run.err).append(buffer, std::size_t(got));
    }
    if (!called && run.err.find(at_text) != std::string::npos) called = true, then(child);
  }
  ::close(out[0]), ::close(err[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return run;
}

/// Runs the program under test.
/// @param interrupt_at  Ctrl-C is sent once stderr holds this text; empty: never
inline ProgramRun run_pliant(const std::vector<std::string>& arguments, const std::string& interrupt_at = "") {
  std::vector<std::string> words = {PLIANT_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run_words(words, interrupt_at, [](pid_t process) { ::kill(process, SIGINT); });
}

}  // namespace pliant::test
