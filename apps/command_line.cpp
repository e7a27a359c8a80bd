#include "command_line.hpp"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <vector>

namespace pliant::apps {

Option& Option::required() { return option_->required(), *this; }
Option& Option::type_name(const std::string& name) { return option_->type_name(name), *this; }
Option& Option::expected(int count) { return option_->expected(count), *this; }
Option& Option::delimiter(char separator) { return option_->delimiter(separator), *this; }
Option& Option::one_value_a_use() { return option_->allow_extra_args(false), *this; }
Option& Option::show_default() { return option_->capture_default_str(), *this; }
Option& Option::hidden() { return option_->group(""), *this; }
Option& Option::range(int least, int greatest) { return option_->check(CLI::Range(least, greatest)), *this; }
Option& Option::range(double least, double greatest) { return option_->check(CLI::Range(least, greatest)), *this; }
Option& Option::positive() {
  const auto check = [](const std::string& text) {
    double number = 0.0;
    return CLI::detail::lexical_cast(text, number) && number > 0.0 ? std::string()
                                                                   : "`" + text + "` is not a number above 0";
  };
  return option_->check(CLI::Validator(check, "POSITIVE")), *this;
}
Option& Option::not_negative() { return option_->check(CLI::NonNegativeNumber), *this; }
Option& Option::one_of(std::initializer_list<const char*> words) {
  return option_->check(CLI::IsMember(std::vector<std::string>(words.begin(), words.end()))), *this;
}

template <class T>
Option Command::option(const std::string& names, T& value, const std::string& text) {
  return Option(app_->add_option(names, value, text));
}
template Option Command::option(const std::string&, std::string&, const std::string&);
template Option Command::option(const std::string&, int&, const std::string&);
template Option Command::option(const std::string&, double&, const std::string&);
template Option Command::option(const std::string&, std::optional<std::uint32_t>&, const std::string&);
template Option Command::option(const std::string&, std::vector<std::string>&, const std::string&);
template Option Command::option(const std::string&, std::vector<int>&, const std::string&);
template Option Command::option(const std::string&, std::vector<double>&, const std::string&);

Option Command::flag(const std::string& names, bool& value, const std::string& text) {
  return Option(app_->add_flag(names, value, text));
}

void Command::footer(const std::string& text) { app_->footer(text); }
void Command::callback(std::function<void()> run) { app_->callback(std::move(run)); }

CommandLine::CommandLine(const std::string& description, const std::string& version, const std::string& footer)
    : app_(std::make_unique<CLI::App>(description, "pliant")) {
  app_->set_version_flag("--version", version);
  app_->footer(footer);
  app_->require_subcommand(1);
}

CommandLine::~CommandLine() = default;

Command CommandLine::add_command(const std::string& name, const std::string& text) {
  return Command(app_->add_subcommand(name, text));
}

bool CommandLine::run(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_->exit(error) == 0;
  }
  return true;
}

}  // namespace pliant::apps
