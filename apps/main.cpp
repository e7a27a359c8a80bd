#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>

#include "base/error.hpp"
#include "commands.hpp"

namespace pliant::apps {

namespace {

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free);

// The first Ctrl-C asks the command to stop where its files are whole, the second stops at once.
void on_interrupt(int) {
  if (interrupted.exchange(true)) ::_exit(WasInterrupted);
}

constexpr const char* footer = R"(Examples:
  pliant check recordings/bear              what was recorded, and what can be estimated from it
  pliant check recordings/bear --out look   the same, with pictures and point clouds in the folder look

A capture is a folder with a file capture.toml in it (docs/formats.md).
Exit codes: 0 fine, 2 bad usage or input, 3 not converged, 130 interrupted.)";

int run(int argc, char** argv) {
  CLI::App app{"pliant turns a recording of a soft object into an elastic model.", "pliant"};
  app.set_version_flag("--version", "pliant " PLIANT_VERSION);
  app.footer(footer);
  app.require_subcommand(1);
  int exit_code = Fine;
  add_check(app, exit_code);
  add_scan(app, exit_code);
  add_markers(app, exit_code);
  add_fit(app, exit_code);
  add_simulate(app, exit_code);
  add_track(app, exit_code);
  add_evaluate(app, exit_code);
  add_press(app, exit_code);
  add_synth(app, exit_code);
  add_rest(app, exit_code);
  add_mesh(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? Fine : BadInput;
  }
  return exit_code;
}

}  // namespace

bool is_interrupted() { return interrupted; }

void stop_if_interrupted() {
  if (interrupted) throw Interrupted();
}

void show_progress(const char* what, int done, int total) {
  static const bool is_terminal = ::isatty(STDERR_FILENO) != 0;
  if (!is_terminal) return;
  std::fprintf(stderr, "\r%s %d/%d%s", what, done, total, done == total ? "\n" : "");
  std::fflush(stderr);
}

}  // namespace pliant::apps

int main(int argc, char** argv) {
  using namespace pliant::apps;
  std::signal(SIGINT, on_interrupt);
  try {
    return run(argc, argv);
  } catch (const Interrupted&) {
    std::cerr << "pliant: interrupted\n";
    return WasInterrupted;
  } catch (const pliant::InputError& error) {
    std::cerr << error.what() << '\n';
    return BadInput;
  } catch (const std::exception& error) {
    std::cerr << "pliant: " << error.what() << '\n';
    return 1;
  }
}
