#include "capture/fuse.hpp"

#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string capture, out;
};

void run(const Arguments& arguments) {
  const Capture capture = read_capture(arguments.capture);
  std::cout << capture.name << '\n';
  const FusedClouds fused = fuse_clouds(arguments.out, capture, [](int done, int total) {
    stop_if_interrupted();
    show_progress("frame", done, total);
  });
  if (!fused.capture.clouds.empty()) {
    const int clouds = (capture.frame_count() - 1) / fused.every + 1;
    say("clouds", formatted("%d, %.0f points each, noise %.2g mm", clouds, double(fused.points) / clouds,
                            1e3 * fused.capture.clouds.front().noise.value_or(0.0)));
    if (fused.every > 1) say("", formatted("of every %d frames: others have no point of the object", fused.every));
    if (fused.greatest_delay > 0.0)
      say("", formatted("note: they mix what sensors took up to %.1f ms apart from their frame; a fit of the depth "
                        "images themselves takes each at its own time",
                        1e3 * fused.greatest_delay));
  }
  std::cout << arguments.out << "/capture.toml has the clouds and the other facts\n";
}

constexpr const char* footer = R"(Examples:
  pliant fuse recordings/plant --out recordings/plant-cloud
  pliant fuse calibrated --out fused

Depth images of several sensors, and clouds, become one cloud a frame in world coordinates: through each sensor's lens and pose, without
table, background, pixels at depth edges and points that stand alone. The folder gets clouds/, load/ and capture.toml.)";

}  // namespace

void add_fuse(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("fuse", "Fuse what several depth sensors saw into clouds");
  command.option("capture", arguments->capture, "the capture's folder, or its capture.toml").required();
  command.option("--out", arguments->out, "folder for capture.toml and the clouds").required().type_name("DIR");
  command.footer(footer);
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
