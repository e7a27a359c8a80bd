#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace pliant {

/// Where in a file something was found. `line` and `column` count from 1; 0 where a file has no lines.
struct Place {
  std::filesystem::path file;
  int line = 0;
  int column = 0;
};

/// "file:line:column", as far as known.
std::string to_string(const Place& place);

/// One thing that is wrong with an input.
struct Problem {
  Place place;
  std::string found;     ///< what is there, in words
  std::string expected;  ///< what should be there; may be empty
  std::string advice;    ///< what the user can do; may be empty
};

/// "file:line:column: found; expected ...; advice" on one line.
std::string to_string(const Problem& problem);

/// Input that cannot be used. Carries every problem found, not only the first.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Problem> problems);
  explicit InputError(Problem problem) : InputError(std::vector<Problem>{std::move(problem)}) {}
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

/// Thrown where long work notices that it is to end: Ctrl-C was pressed.
struct Interrupted : std::runtime_error {
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace pliant
