#include <iostream>
#include <memory>
#include <string>

#include "command_line.hpp"
#include "commands.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/trajectory.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string model, out;
};

int run(const Arguments& arguments) {
  const Model model = load_model(arguments.model);
  const ModelScene scene = make_scene(model);
  const RolloutSummary summary =
      write_trajectory(arguments.out, scene.body, scene.simulation, scene.theta, [](int done, int total) {
        show_progress("simulated", done, total);
        return !is_interrupted();
      });
  stop_if_interrupted();
  if (!summary.succeeded) {
    std::cerr << "pliant: the simulation stopped in frame " << summary.frames << ": " << summary.failure << "\n";
    return NotConverged;
  }
  std::cout << summary.frames << " frames in " << arguments.out << "/trajectory.pvd (opens in ParaView)\n";
  return Fine;
}

}  // namespace

void add_simulate(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("simulate", "Simulate a fitted model as its recording was");
  command.option("model", arguments->model, "model.toml of a fit").required().type_name("MODEL");
  command.option("--out,-o", arguments->out, "folder for trajectory.pvd and its frames").required().type_name("DIR");
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
