#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "command_line.hpp"
#include "commands.hpp"
#include "synthetic_recording.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string scene, out;
  std::optional<std::uint32_t> seed;
};

void run(const Arguments& arguments) {
  SyntheticScene scene = read_synthetic_scene(arguments.scene);
  if (arguments.seed) scene.seed = *arguments.seed;
  write_recording(arguments.out, scene);
  const auto counted = [](std::size_t count, const std::string& what, const std::string& more = "s") {
    return std::to_string(count) + " " + what + (count == 1 ? "" : more);
  };
  std::string made;
  const auto add = [&](std::size_t count, const std::string& what, const std::string& more = "s") {
    if (count > 0) made += (made.empty() ? "" : ", ") + counted(count, what, more);
  };
  add(std::size_t(scene.scene.timing.frame_count()), "frame");
  add(scene.cameras.size(), "camera");
  add(scene.markers ? scene.markers->points.size() : 0, "marker");
  add(scene.loads.size(), "load");
  add(scene.presses.size(), "press", "es");
  add(scene.indentations.size(), "force-depth curve");
  std::cout << arguments.out << ": " << made << "; seed " << scene.seed << "\nthe truth is in " << arguments.out
            << "/truth.json; next: pliant check " << arguments.out << "\n";
}

}  // namespace

void add_synth(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("synth", "Simulate a scene and make a recording of it whose truth is known");
  command.option("scene", arguments->scene, "scene file (docs/scene.md)").required().type_name("SCENE.toml");
  command.option("--out,-o", arguments->out, "folder for the capture").required().type_name("DIR");
  command.option("--seed", arguments->seed, "of the sensor's noise; instead of the scene's");
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
