#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "base/files.hpp"
#include "capture/new_capture.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "imports/camera_json.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string folder, name, surface;
  double mass = 0.0, density = 0.0, rate = 0.0, fx = 0.0, fy = 0.0, cx = -1.0, cy = -1.0, fov = 0.0, depth_scale = 0.0;
  int start_frame = -1;
  std::vector<double> up;
};

std::optional<double> given(double value, double none = 0.0) {
  return value > none ? std::optional(value) : std::nullopt;
}

NewCaptureFacts facts_of(const Arguments& arguments) {
  NewCaptureFacts facts;
  facts.name = arguments.name;
  facts.mass = given(arguments.mass), facts.density = given(arguments.density);
  facts.frame_rate = given(arguments.rate);
  facts.fx = given(arguments.fx), facts.fy = given(arguments.fy);
  facts.cx = given(arguments.cx, -1.0), facts.cy = given(arguments.cy, -1.0);
  facts.field_of_view_deg = given(arguments.fov);
  facts.depth_scale = given(arguments.depth_scale);
  if (!arguments.surface.empty()) facts.surface = arguments.surface;
  if (arguments.up.size() == 3) facts.up = Vector3(arguments.up[0], arguments.up[1], arguments.up[2]).normalized();
  if (arguments.start_frame >= 0) facts.start_frame = arguments.start_frame;
  return facts;
}

/// What a camera's file in the folder says (docs/imports.md), where the user says nothing.
void take_camera_file(const fs::path& folder, NewCaptureFacts& facts) {
  if (!has_camera_json(folder)) return;
  const CameraFile file = camera_of_folder(folder, {});
  if (!facts.fx && !facts.field_of_view_deg) {
    facts.fx = file.camera.fx, facts.fy = file.camera.fy;
    facts.cx = file.camera.cx, facts.cy = file.camera.cy;
  }
  if (!facts.depth_scale) facts.depth_scale = file.depth_scale;
  if (!facts.frame_rate) facts.frame_rate = file.frame_rate;
}

/// Asks for a number above 0 until there is one; nothing at the end of the input.
std::optional<double> answer(const std::string& question) {
  for (std::string line; std::cout << question << ": " << std::flush, std::getline(std::cin, line);) {
    try {
      std::size_t end = 0;
      const double value = std::stod(line, &end);
      if (line.find_first_not_of(" \t", end) == std::string::npos && value > 0.0 && std::isfinite(value)) return value;
    } catch (const std::exception&) {
    }
    std::cout << "a number above 0 is wanted\n";
  }
  return std::nullopt;
}

/// What is missing, by its option.
std::optional<double>* place_of(const MissingFact& missing, NewCaptureFacts& facts) {
  const auto is = [&](const char* option) { return missing.option.starts_with(option); };
  return is("--mass")          ? &facts.mass
         : is("--rate")        ? &facts.frame_rate
         : is("--fx")          ? &facts.fx
         : is("--depth-scale") ? &facts.depth_scale
                               : nullptr;
}

/// Asks on a terminal for what is missing.
void ask(const NewCapture& made, NewCaptureFacts& facts) {
  for (const MissingFact& missing : made.missing) {
    if (std::optional<double>* value = place_of(missing, facts)) {
      *value = answer(missing.question);
      if (!*value) return;
    } else if (missing.option.starts_with("--surface")) {
      std::string line;
      std::cout << missing.question << ": " << std::flush;
      if (!std::getline(std::cin, line)) return;
      facts.surface = line;
    }
  }
}

void refuse_what_is_missing(const fs::path& folder, const NewCapture& made) {
  if (made.missing.empty()) return;
  std::vector<Problem> problems;
  for (const MissingFact& missing : made.missing)
    problems.push_back({{folder}, "not said: " + missing.question, missing.option, ""});
  throw InputError(problems);
}

void run(const Arguments& arguments) {
  const fs::path folder = arguments.folder, file = folder / "capture.toml";
  if (fs::exists(file))
    throw InputError({{file}, "it is there already", "a folder without one", "look at it with `pliant check`"});
  if (arguments.mass > 0.0 && arguments.density > 0.0)
    throw InputError({{}, "both --mass and --density", "one of the two", "keep what was measured"});
  const FolderSurvey survey = survey_folder(folder);
  NewCaptureFacts facts = facts_of(arguments);
  take_camera_file(folder, facts);
  NewCapture made = new_capture(folder, survey, facts);
  if (!made.missing.empty() && ::isatty(STDIN_FILENO) != 0) {
    ask(made, facts);
    made = new_capture(folder, survey, facts);
  }
  refuse_what_is_missing(folder, made);
  if (!made.capture.depth.empty()) {
    DepthCamera& camera = made.capture.depth.front();
    camera.images.pattern = renumbered(folder, survey.depth.front(), "depth_from_zero");
    if (camera.masks)
      for (const NumberedFiles& files : survey.pictures)
        if (files.pattern == camera.masks->pattern)
          camera.masks->pattern = renumbered(folder, files, "masks_from_zero");
  } else {
    made.capture.clouds.front().points.pattern = renumbered(folder, survey.clouds.front(), "clouds_from_zero");
  }
  write_capture(folder, made.capture, "Facts about this recording: docs/formats.md says what else may stand here.");
  for (const std::string& sentence : made.seen) std::cout << sentence << "\n";
  std::cout << "written: " << file.string() << "; look at it, then: pliant check " << folder.string() << "\n";
}

}  // namespace

void add_new(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("new", "Write a capture.toml for the depth images or clouds in a folder");
  command.option("folder", arguments->folder, "folder with what was recorded").required().type_name("FOLDER");
  command.option("--name", arguments->name, "of the recording, for reports; the folder's where left out");
  command.option("--mass", arguments->mass, "of the object").positive().type_name("KG");
  command.option("--density", arguments->density, "of the object, in the place of its mass")
      .positive()
      .type_name("KG/M3");
  command.option("--rate", arguments->rate, "frames a second").positive().type_name("HZ");
  command.option("--fx", arguments->fx, "focal length of the depth camera").positive().type_name("PIXELS");
  command.option("--fy", arguments->fy, "the same along a column; fx where left out").positive().type_name("PIXELS");
  command.option("--cx", arguments->cx, "principal point; the middle of the image where left out").type_name("PIXELS");
  command.option("--cy", arguments->cy, "the same along a column").type_name("PIXELS");
  command.option("--fov", arguments->fov, "horizontal field of view, in the place of fx")
      .range(1.0, 175.0)
      .type_name("DEGREES");
  command.option("--depth-scale", arguments->depth_scale, "raw units of a depth image in a metre; 1000: millimetres")
      .positive()
      .type_name("UNITS");
  command.option("--surface", arguments->surface, "closed mesh of the object at rest, relative to FOLDER")
      .type_name("FILE");
  command
      .option("--up", arguments->up, "upwards in the camera's axes (x right, y down, z forward); of clouds in theirs")
      .expected(3)
      .delimiter(',')
      .type_name("X,Y,Z");
  command.option("--start-frame", arguments->start_frame, "first frame in which the object moves freely")
      .not_negative()
      .type_name("FRAME");
  command.footer(R"(Examples:
  pliant new recordings/bear                                          asks for what the files do not show
  pliant new recordings/bear --mass 0.25 --rate 30 --fov 69 --depth-scale 1000

It looks for 16-bit depth images (PNG, PGM) or clouds (PLY, PCD) with numbers in their names, a closed mesh of the object at rest,
masks and a background, and for the floor in the first depth image. What it assumes it says, and stands in FOLDER/capture.toml.)");
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
