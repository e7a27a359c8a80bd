#include <iostream>
#include <memory>
#include <string>

#include "base/files.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "live/live_page.hpp"
#include "simulation/strain_range.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string model, out;
};

int run(const Arguments& arguments) {
  LiveRecording recording;
  if (const auto strained = recorded_strain_range(arguments.model))
    recording.greatest_strain = strained->greatest_strain;
  write_file(arguments.out, live_page(load_model(arguments.model), recording));
  std::cout << arguments.out << " (opens in a browser, without a server)\n";
  return Fine;
}

}  // namespace

void add_live(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("live", "A page in which a fitted model can be pulled, poked and blown at");
  command.option("model", arguments->model, "model.toml of a fit").required().type_name("MODEL");
  command.option("--out,-o", arguments->out, "the page, one file").required().type_name("FILE.html");
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
