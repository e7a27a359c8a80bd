#pragma once

#include <stdexcept>

namespace CLI {
class App;
}

/// Commands of the program, one file each. A command registers itself and stores its exit code when it runs.
namespace pliant::apps {

/// Exit codes of every command.
enum ExitCode : int { Fine = 0, BadInput = 2, NotConverged = 3, WasInterrupted = 130 };

void add_check(CLI::App& app, int& exit_code);
void add_fit(CLI::App& app, int& exit_code);
void add_simulate(CLI::App& app, int& exit_code);
void add_track(CLI::App& app, int& exit_code);
void add_evaluate(CLI::App& app, int& exit_code);
void add_press(CLI::App& app, int& exit_code);
void add_synth(CLI::App& app, int& exit_code);
void add_rest(CLI::App& app, int& exit_code);
void add_mesh(CLI::App& app, int& exit_code);
void add_markers(CLI::App& app, int& exit_code);
void add_scan(CLI::App& app, int& exit_code);

/// Thrown where a command notices that the user pressed Ctrl-C.
struct Interrupted : std::runtime_error {
  Interrupted() : std::runtime_error("interrupted") {}
};

/// Whether Ctrl-C was pressed. Long commands ask between steps.
bool is_interrupted();

/// Throws Interrupted if Ctrl-C was pressed.
void stop_if_interrupted();

/// Shows "what 3/64" on the terminal's line of progress, on stderr; nothing where stderr is no terminal.
void show_progress(const char* what, int done, int total);

}  // namespace pliant::apps
