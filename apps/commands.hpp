#pragma once

#include <string>

/// Commands of the program, one file each. A command registers itself and stores its exit code when it runs.
namespace pliant::apps {

class CommandLine;

/// Exit codes of every command.
enum ExitCode : int { Fine = 0, BadInput = 2, NotConverged = 3, WasInterrupted = 130 };

void add_batch(CommandLine& line, int& exit_code);
void add_ensemble(CommandLine& line, int& exit_code);
void add_check(CommandLine& line, int& exit_code);
void add_fit(CommandLine& line, int& exit_code);
void add_import(CommandLine& line, int& exit_code);
void add_live(CommandLine& line, int& exit_code);
void add_simulate(CommandLine& line, int& exit_code);
void add_track(CommandLine& line, int& exit_code);
void add_evaluate(CommandLine& line, int& exit_code);
void add_export(CommandLine& line, int& exit_code);
void add_press(CommandLine& line, int& exit_code);
void add_synth(CommandLine& line, int& exit_code);
void add_rest(CommandLine& line, int& exit_code);
void add_mesh(CommandLine& line, int& exit_code);
void add_new(CommandLine& line, int& exit_code);
void add_markers(CommandLine& line, int& exit_code);
void add_scan(CommandLine& line, int& exit_code);
void add_calibrate(CommandLine& line, int& exit_code);
void add_fuse(CommandLine& line, int& exit_code);
void add_place(CommandLine& line, int& exit_code);

/// Whether Ctrl-C was pressed. Long commands ask between steps.
bool is_interrupted();

/// Throws Interrupted if Ctrl-C was pressed.
void stop_if_interrupted();

/// From now on SIGTERM and SIGUSR1 ask to stop as Ctrl-C does: what mpirun and Slurm send.
void stop_on_termination();

/// What the program says of an exception, and how it ends.
struct Failure {
  int exit_code = 1;
  std::string message;
};
/// Of the exception that is being handled.
Failure failure_at_hand();

/// Shows "what 3/64" on the terminal's line of progress, on stderr; nothing where stderr is no terminal.
void show_progress(const char* what, int done, int total);

}  // namespace pliant::apps
