#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace pliant::test {

/// What a run of the program left behind.
struct ProgramRun {
  int exit_code = -1;
  std::string out, err;
};

/// Runs the program under test with these arguments, as a user's shell would.
/// @param interrupt_at  Ctrl-C is sent once stderr holds this text; empty: never
inline ProgramRun run_pliant(const std::vector<std::string>& arguments, const std::string& interrupt_at = "") {
  int out[2], err[2];
  if (::pipe(out) != 0 || ::pipe(err) != 0) throw std::runtime_error("no pipe");
  std::vector<char*> argv = {const_cast<char*>(PLIANT_PROGRAM)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no fork");
  if (child == 0) {
    ::dup2(out[1], STDOUT_FILENO), ::dup2(err[1], STDERR_FILENO);
    for (const int end : {out[0], out[1], err[0], err[1]}) ::close(end);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(out[1]), ::close(err[1]);
  ProgramRun run;
  bool sent = interrupt_at.empty();
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
    if (!sent && run.err.find(interrupt_at) != std::string::npos) sent = ::kill(child, SIGINT) == 0;
  }
  ::close(out[0]), ::close(err[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return run;
}

}  // namespace pliant::test
