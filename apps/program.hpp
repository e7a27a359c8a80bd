#pragma once

namespace pliant::apps {

/// The command line program: reads its arguments, runs one command and returns the exit code. The first Ctrl-C asks the
/// command to stop where its files are whole, the second ends the process at once.
int run_program(int argc, char** argv);

}  // namespace pliant::apps
