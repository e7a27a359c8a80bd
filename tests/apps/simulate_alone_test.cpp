// `pliant simulate` without the rest of the program: what it links is enough to simulate a model.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "command_line.hpp"
#include "commands.hpp"
#include "geometry/primitives.hpp"
#include "model/model.hpp"
#include "temporary_folder.hpp"

// What main.cpp gives to commands.
namespace pliant::apps {
bool is_interrupted() { return false; }
void stop_if_interrupted() {}
void show_progress(const char*, int, int) {}
}  // namespace pliant::apps

namespace pliant::test {
namespace {

TEST(SimulateAlone, WritesAModelsTrajectory) {
  const TemporaryFolder folder;
  Model model;
  model.name = "ball";
  model.scene.object.surface = make_sphere(0.05, 3);
  model.scene.object.density = 100.0, model.scene.object.mass = 0.05;
  model.scene.world.gravity = Vector3(0, -9.81, 0);
  model.scene.timing = evenly_timed(60.0, 3);
  model.youngs_modulus = 3000.0, model.poissons_ratio = 0.3, model.cell_size = 0.02, model.substeps = 4;
  save_model(folder.path(), model);
  apps::CommandLine line("simulate alone", "", "");
  int exit_code = -1;
  apps::add_simulate(line, exit_code);
  std::vector<std::string> words = {"pliant", "simulate", (folder / "model.toml").string(), "--out",
                                    (folder / "out").string()};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  EXPECT_TRUE(line.run(int(arguments.size()), arguments.data()));
  EXPECT_EQ(exit_code, apps::Fine);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/trajectory.pvd"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out/frames/000002.vtu"));
}

}  // namespace
}  // namespace pliant::test
