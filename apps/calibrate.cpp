#include "scan/calibrate.hpp"

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/files.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string capture, out, apply, reference;
  double ball = 0.0;
  int until = -1;
  bool keep_lenses = false;
};

constexpr double degree = std::numbers::pi / 180.0;

void report(const SensorCalibration& sensor, const char* what, nlohmann::ordered_json& json) {
  std::cout << "\n\"" << sensor.name << "\"" << (sensor.is_reference ? ", the reference" : "") << '\n';
  say("seen", formatted("%d %s", sensor.count, what));
  if (!sensor.is_reference) {
    say("pose", formatted("turned by %.3f degrees (+- %.3f), moved by %.2f mm (+- %.2f) there", sensor.turned / degree,
                          sensor.turn_std / degree, 1e3 * sensor.moved, 1e3 * sensor.shift_std));
    say("residual", formatted("%.2f mm rms before, %.2f mm after", 1e3 * sensor.rms_before, 1e3 * sensor.rms_after));
    if (sensor.time_offset_std)
      say("time offset", formatted("%.2f ms (+- %.2f)", 1e3 * sensor.time_offset, 1e3 * *sensor.time_offset_std));
  }
  const auto& k = sensor.lens.coefficients();
  if (sensor.lens_is_found) say("lens", formatted("k1 = %.4f (+- %.4f), k2 = %.4f", k[0], sensor.k1_std, k[1]));
  nlohmann::ordered_json own = {{"name", sensor.name}, {"reference", sensor.is_reference}};
  for (int i = 0; i < 3; ++i)
    own["camera_to_world"].push_back({sensor.camera_to_world.rotation(i, 0), sensor.camera_to_world.rotation(i, 1),
                                      sensor.camera_to_world.rotation(i, 2), sensor.camera_to_world.translation[i]});
  own["camera_to_world"].push_back({0.0, 0.0, 0.0, 1.0});
  own["distortion"] = k, own["time_offset"] = sensor.time_offset;
  own["turned"] = sensor.turned, own["moved"] = sensor.moved;
  own["turn_std"] = sensor.turn_std, own["shift_std"] = sensor.shift_std;
  if (sensor.time_offset_std) own["time_offset_std"] = *sensor.time_offset_std;
  own["lens_is_found"] = sensor.lens_is_found;
  if (sensor.lens_is_found) own["k1_std"] = sensor.k1_std;
  own["rms_before"] = sensor.rms_before, own["rms_after"] = sensor.rms_after, own["count"] = sensor.count;
  json["sensors"].push_back(own);
}

void run(const Arguments& arguments) {
  const Capture capture = read_capture(arguments.capture);
  std::cout << capture.name << '\n';
  CalibrationOptions options;
  options.reference = arguments.reference;
  options.finds_lenses = !arguments.keep_lenses;
  if (arguments.until >= 0) options.last_frame = arguments.until;
  const bool by_ball = arguments.ball > 0.0;
  const std::vector<SensorCalibration> sensors =
      by_ball ? calibrate_by_ball(capture, arguments.ball, options) : calibrate_by_object(capture, options);
  nlohmann::ordered_json json = {
      {"format", "calibration/1"}, {"capture", capture.name}, {"by", by_ball ? "ball" : "object"}};
  for (const SensorCalibration& sensor : sensors)
    report(sensor, by_ball ? "sights of the ball" : "points of the object at rest", json);
  const bool clocks = std::ranges::any_of(sensors, [](const auto& s) { return s.time_offset_std.has_value(); });
  if (!clocks && !capture.scene.timing.is_static)
    std::cout << "\nTime offsets are as in the capture: " << (by_ball ? "the ball hardly moved" : "nothing moved")
              << '\n';
  const Capture mended = as_seen_from(
      with_calibration(arguments.apply.empty() ? capture : read_capture(arguments.apply), sensors), arguments.out);
  write_file(fs::path(arguments.out) / "calibration.json", json.dump(2) + "\n");
  write_capture(arguments.out, mended, "Cameras calibrated by pliant from " + capture.name + ".");
  std::cout << '\n' << arguments.out << "/capture.toml has the calibrated cameras; its images stay where they are\n";
}

constexpr const char* footer = R"(Examples:
  pliant calibrate recordings/ball --ball 0.05 --out calibrated
  pliant calibrate recordings/ball --ball 0.05 --apply recordings/plant --out calibrated-plant
  pliant calibrate recordings/bear --out calibrated-bear

With --ball: a ball of that radius was moved about before the cameras. Poses and time offsets are those that make all of them see it in one
place; the reference keeps its own. Without: the object at rest is moved onto its scan, which tells poses alone.
k1 and k2 of the lenses are found where they clearly matter. The folder gets capture.toml and calibration.json (the figures).)";

}  // namespace

void add_calibrate(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("calibrate", "Find poses, clocks and lenses of several depth cameras");
  command.option("capture", arguments->capture, "the capture's folder, or its capture.toml").required();
  command.option("--out", arguments->out, "folder for capture.toml and calibration.json").required().type_name("DIR");
  command.option("--ball", arguments->ball, "radius of the ball that was moved about [m]").positive();
  command.option("--apply", arguments->apply, "another capture of the same cameras, to be written with what was found")
      .type_name("CAPTURE");
  command.option("--reference", arguments->reference, "camera whose pose and clock are kept (with --ball)");
  command.option("--until", arguments->until, "last frame in which the object rests (default: start_frame)")
      .range(0, 1000000000);
  command.flag("--keep-lenses", arguments->keep_lenses, "leave the lenses as the capture has them");
  command.footer(footer);
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
