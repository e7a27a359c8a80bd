#include "program.hpp"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>

#include "base/error.hpp"
#include "command_line.hpp"
#include "commands.hpp"

namespace pliant::apps {

namespace {

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free);

// The first Ctrl-C asks the command to stop where its files are whole, the second stops at once.
void on_interrupt(int) {
  if (interrupted.exchange(true)) ::_exit(WasInterrupted);
}

// What launchers of several processes send: once or more often, it asks.
void on_termination(int) { interrupted = true; }

constexpr const char* footer = R"(Examples:
  pliant check recordings/bear              what was recorded, and what can be estimated from it
  pliant check recordings/bear --out look   the same, with pictures and point clouds in the folder look

A capture is a folder with a file capture.toml in it (docs/formats.md).
Exit codes: 0 fine, 2 bad usage or input, 3 not converged, 130 interrupted.)";

constexpr const char* first_steps =
    R"(pliant turns a recording of a soft object into an elastic model. Three commands do most of it:

  pliant check RECORDING                      what was recorded, and what can be estimated from it
  pliant fit RECORDING --out DIR              stiffness and damping with intervals, and the model: DIR/report.html
  pliant live DIR/model.toml --out PAGE.html  a page in which the model can be pulled, poked and thrown

A recording is a folder with a capture.toml in it: `pliant new FOLDER` writes one for what lies there.
`pliant --help` lists all commands, `pliant COMMAND --help` explains one.
)";

int run(int argc, char** argv) {
  if (argc < 2) {
    std::cout << first_steps;
    return Fine;
  }
  const std::string commit = PLIANT_COMMIT;  // none of an archive of the sources
  CommandLine line("pliant turns a recording of a soft object into an elastic model.",
                   "pliant " PLIANT_VERSION + (commit.empty() ? "" : " (" + commit + ")"), footer);
  int exit_code = Fine;
  add_new(line, exit_code);
  add_import(line, exit_code);
  add_check(line, exit_code);
  add_calibrate(line, exit_code);
  add_fuse(line, exit_code);
  add_scan(line, exit_code);
  add_place(line, exit_code);
  add_markers(line, exit_code);
  add_fit(line, exit_code);
  add_batch(line, exit_code);
  add_simulate(line, exit_code);
  add_ensemble(line, exit_code);
  add_live(line, exit_code);
  add_track(line, exit_code);
  add_evaluate(line, exit_code);
  add_export(line, exit_code);
  add_press(line, exit_code);
  add_synth(line, exit_code);
  add_rest(line, exit_code);
  add_mesh(line, exit_code);
  if (!line.run(argc, argv)) return BadInput;
  return exit_code;
}

}  // namespace

bool is_interrupted() { return interrupted; }

void stop_if_interrupted() {
  if (interrupted) throw Interrupted();
}

void stop_on_termination() {
  for (const int signal : {SIGTERM, SIGUSR1}) std::signal(signal, on_termination);
}

Failure failure_at_hand() {
  try {
    throw;
  } catch (const Interrupted&) {
    return {WasInterrupted, "pliant: interrupted"};
  } catch (const InputError& error) {
    return {BadInput, error.what()};
  } catch (const std::exception& error) {
    return {1, std::string("pliant: ") + error.what()};
  }
}

void show_progress(const char* what, int done, int total) {
  static const bool is_terminal = ::isatty(STDERR_FILENO) != 0;
  if (!is_terminal) return;
  std::fprintf(stderr, "\r%s %d/%d%s", what, done, total, done == total ? "\n" : "");
  std::fflush(stderr);
}

int run_program(int argc, char** argv) {
  std::signal(SIGINT, on_interrupt);
  try {
    return run(argc, argv);
  } catch (...) {
    const Failure failure = failure_at_hand();
    std::cerr << failure.message << '\n';
    return failure.exit_code;
  }
}

}  // namespace pliant::apps
