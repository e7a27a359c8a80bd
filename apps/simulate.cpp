#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "pictures/situation_output.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string model, out, situation, video;
  double duration = 0.0;  // [s]; 0: the file's
  bool ply = false, pictures = false;
};

int finish(const WrittenMotion& written, const std::optional<DeformationResult>& recorded, const std::string& out) {
  stop_if_interrupted();
  const RolloutSummary& summary = written.summary;
  if (!summary.succeeded) {
    std::cerr << "pliant: the simulation stopped in frame " << summary.frames << ": " << summary.failure << "\n";
    return NotConverged;
  }
  std::cout << summary.frames << " frames in " << out << "/trajectory.pvd (opens in ParaView); stress and strain in "
            << out << "/fields.html\n";
  say_if_extrapolated(recorded, written.strained);
  return Fine;
}

int run_situation(const Arguments& arguments) {
  const Model model = load_model(arguments.model);
  const std::optional<DeformationResult> recorded = recorded_strain_range(arguments.model);
  Situation situation = read_situation(arguments.situation);
  if (arguments.duration > 0.0) situation.duration = arguments.duration;
  SituationFiles files;
  files.folder = arguments.out, files.video = arguments.video;
  files.ply = arguments.ply, files.pictures = arguments.pictures;
  const WrittenMotion written = write_situation(model, situation, files, [](const char* what, int done, int total) {
    show_progress(what, done, total);
    return !is_interrupted();
  });
  const int code = finish(written, recorded, arguments.out);
  if (code == Fine && !arguments.video.empty()) std::cout << "video in " << arguments.video << "\n";
  return code;
}

int run(const Arguments& arguments) {
  if (!arguments.situation.empty()) return run_situation(arguments);
  if (!arguments.video.empty() || arguments.duration > 0.0 || arguments.ply || arguments.pictures)
    throw InputError({{},
                      "--video, --pictures, --ply or --duration without a situation",
                      "--situation FILE beside them",
                      "a file with `format = \"situation/1\"` alone is a situation: the model under gravity"});
  const Model model = load_model(arguments.model);
  const std::optional<DeformationResult> recorded = recorded_strain_range(arguments.model);
  return finish(write_simulation(model, arguments.out,
                                 [](int done, int total) {
                                   show_progress("simulated", done, total);
                                   return !is_interrupted();
                                 }),
                recorded, arguments.out);
}

}  // namespace

void add_simulate(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command =
      line.add_command("simulate", "Simulate a fitted model as its recording was, or in another situation");
  command.option("model", arguments->model, "model.toml of a fit").required().type_name("MODEL");
  command.option("--out,-o", arguments->out, "folder for trajectory.pvd and its frames").required().type_name("DIR");
  command.option("--situation", arguments->situation, "wind, rain, hands, led regions, obstacles, gravity over time")
      .type_name("FILE");
  command.option("--duration", arguments->duration, "of the situation, in place of the file's")
      .positive()
      .type_name("SECONDS");
  command.flag("--ply", arguments->ply, "also the surface of each frame: DIR/surface/*.ply");
  command.flag("--pictures", arguments->pictures, "also a picture of each frame: DIR/pictures/*.png");
  command.option("--video", arguments->video, "the pictures as a video, made by ffmpeg").type_name("FILE");
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
