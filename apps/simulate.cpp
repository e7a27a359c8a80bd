#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

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

void add_simulate(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("simulate", "Simulate a fitted model as its recording was");
  command->add_option("model", arguments->model, "model.toml of a fit")->required()->type_name("MODEL");
  command->add_option("--out,-o", arguments->out, "folder for trajectory.pvd and its frames")
      ->required()
      ->type_name("DIR");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
