#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

// The command line of the program. CLI11 stays inside command_line.cpp: it is slow to compile.

namespace pliant::apps {

/// An argument or an option of a command. Its members say more about it, and return it.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option& required();
  /// The word that stands for the value in the help.
  Option& type_name(const std::string& name);
  /// How many values it has.
  Option& expected(int count);
  /// The character between its values, where they may be written as one word.
  Option& delimiter(char separator);
  /// Each use of the option takes one value; what follows is another argument.
  Option& one_value_a_use();
  /// The help shows the value that the variable has now.
  Option& show_default();
  /// The help does not name it.
  Option& hidden();
  /// @name Values that are allowed; others are bad usage
  /// @{
  Option& range(int least, int greatest);
  Option& range(double least, double greatest);
  Option& positive();
  Option& not_negative();
  Option& one_of(std::initializer_list<const char*> words);
  /// @}

 private:
  CLI::Option* option_;
};

/// A command of the program.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  /// @param names  "capture" for an argument, "--out,-o" for an option
  /// @param value  where the parsed value goes: a string, a number, an optional number, or a vector of them
  template <class T>
  Option option(const std::string& names, T& value, const std::string& text);
  Option flag(const std::string& names, bool& value, const std::string& text);
  /// Text below the help.
  void footer(const std::string& text);
  /// What the command does, once all options are read.
  void callback(std::function<void()> run);

 private:
  CLI::App* app_;
};

/// The program: one of its commands is given.
class CommandLine {
 public:
  CommandLine(const std::string& description, const std::string& version, const std::string& footer);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  Command add_command(const std::string& name, const std::string& text);
  /// Reads the arguments and runs the command that they name. Help, versions and complaints are written here.
  /// @return  whether the arguments make sense
  bool run(int argc, char** argv);

 private:
  std::unique_ptr<CLI::App> app_;
};

}  // namespace pliant::apps
