#pragma once

#include <cstdio>
#include <exception>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

namespace pliant {

/// What an experiment's program is told on its command line, as KEY=VALUE.
using Choices = std::map<std::string, std::string>;

/// @param choices  all that there are, with their values where they are left out
/// Throws std::invalid_argument for another.
inline Choices read_choices(int argc, char** argv, Choices choices) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto equals = word.find('=');
    if (equals == std::string::npos || !choices.contains(word.substr(0, equals)))
      throw std::invalid_argument("\"" + word +
                                  "\" is not one of this program's choices; see its source in experiments");
    choices[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return choices;
}

/// A program that prints what `Experiment(choices).run()` gives, JSON.
template <class Experiment>
int run_experiment(const char* program, int argc, char** argv, Choices choices) {
  try {
    std::printf("%s\n", Experiment(read_choices(argc, argv, std::move(choices))).run().dump(1).c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 1;
  }
}

}  // namespace pliant
