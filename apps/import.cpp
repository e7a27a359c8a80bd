#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "commands.hpp"
#include "imports/formats.hpp"
#include "imports/write_recording.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string source, out, from, surface, camera, background, time_unit, strain;
  std::vector<std::string> topics, kept;
  std::vector<double> up, contact;
  double mass = 0.0, density = 0.0, rate = 0.0, depth_scale = 0.0, fx = 0.0, fov = 0.0, threshold = 0.0, length = 0.0,
         area = 0.0, ball = 0.0, punch = 0.0, force_std = 0.0;
  int first = 0, last = -1, every = 1;
  bool compression = false, tension = false;
};

std::optional<double> given(double value) { return value > 0.0 ? std::optional(value) : std::nullopt; }

std::optional<Vector3> given(const std::vector<double>& values, const char* name) {
  if (values.empty()) return std::nullopt;
  const Vector3 v(values[0], values[1], values[2]);
  if (!v.allFinite()) refuse({}, std::string(name) + " is not finite", "X,Y,Z");
  return v;
}

CaptureFacts facts_of(const Arguments& arguments) {
  CaptureFacts facts;
  if (!arguments.surface.empty()) facts.surface = arguments.surface;
  facts.mass = given(arguments.mass), facts.density = given(arguments.density);
  facts.up = given(arguments.up, "--up");
  if (facts.up && !(facts.up->norm() > 0.0)) refuse({}, "--up is zero", "the direction away from the ground");
  facts.first = arguments.first, facts.every = arguments.every;
  if (arguments.last >= 0) facts.last = arguments.last;
  if (arguments.compression && arguments.tension) refuse({}, "both --compression and --tension", "one of the two");
  facts.is_compression = arguments.compression, facts.is_tension = arguments.tension;
  facts.kept = arguments.kept;
  facts.length = given(arguments.length), facts.area = given(arguments.area);
  if (arguments.ball > 0.0 && arguments.punch > 0.0) refuse({}, "both --ball and --punch", "one of the two");
  if (arguments.ball > 0.0) facts.probe = IndenterShape::Ball;
  if (arguments.punch > 0.0) facts.probe = IndenterShape::Punch;
  facts.probe_radius = arguments.ball + arguments.punch;
  facts.contact = given(arguments.contact, "--contact");
  facts.force_std = given(arguments.force_std);
  return facts;
}

ImportOptions options_of(const Arguments& arguments) {
  ImportOptions options;
  options.depth_scale = given(arguments.depth_scale), options.frame_rate = given(arguments.rate);
  if (!arguments.camera.empty()) options.camera = arguments.camera;
  if (!arguments.time_unit.empty()) options.time_unit = arguments.time_unit;
  options.topics = arguments.topics;
  options.fx = given(arguments.fx), options.field_of_view_deg = given(arguments.fov);
  if (!arguments.strain.empty() && arguments.strain != "strain" && arguments.strain != "percent" &&
      arguments.strain != "stretch")
    refuse({}, "--strain " + arguments.strain, "strain, percent or stretch");
  options.strain = arguments.strain;
  options.background = arguments.background, options.threshold = given(arguments.threshold);
  return options;
}

std::string lens_text(const RecordingCamera& camera) {
  const PinholeCamera& lens = camera.camera;
  return formatted("\"%s\", %d x %d pixels, fx %.2f, fy %.2f, cx %.2f, cy %.2f", camera.name.c_str(), lens.width,
                   lens.height, lens.fx, lens.fy, lens.cx, lens.cy);
}

void describe(const Capture& capture) {
  const std::vector<double>& times = capture.scene.timing.times;
  if (!times.empty())
    say("frames", formatted("%zu in %.3f s", times.size(), times.back()) +
                      (capture.scene.timing.frame_rate > 0.0 ? formatted(", %.4g Hz", capture.scene.timing.frame_rate)
                                                             : std::string(", each at its own time")));
  for (const DepthCamera& camera : capture.depth) {
    const LensDistortion& lens = camera.camera.lens;
    say("camera", lens_text(camera) + formatted(", %g units a metre", camera.depth_scale));
    if (lens.bends()) say("", formatted("a lens that bends: %zu coefficients", lens.coefficients().size()));
    if (!camera.moved.empty()) say("", "it moves: a pose for each image");
    if (camera.time_offset != 0.0) say("", formatted("its images are %.2f ms late", 1e3 * camera.time_offset));
  }
  for (const SilhouetteCamera& camera : capture.silhouettes) {
    say("camera", lens_text(camera) + ", masks");
    say("masks", "their outlines over pictures of the video: masks_overview.png");
  }
  for (const Indentation& test : capture.indentations) say("indentation", test.curve.filename().string());
  for (const MaterialCurve& test : capture.material_curves) say("curve", test.curve.filename().string());
  if (!capture.markers.empty()) say("markers", "markers.csv, at rest markers_rest.csv");
}

void run(const Arguments& arguments) {
  const ImportFormat& format = import_format(arguments.from, arguments.source);
  const CaptureFacts facts = facts_of(arguments);
  const ImportOptions options = options_of(arguments);
  ImportedRecording recording = format.read(arguments.source, options);
  if (options.frame_rate) {
    for (DepthStream& stream : recording.depth) stream.times.clear(), stream.frame_rate = *options.frame_rate;
    if (recording.masks) recording.masks->times.clear(), recording.masks->frame_rate = *options.frame_rate;
    if (recording.markers) recording.markers->frame_rate = options.frame_rate;
  }
  std::cout << recording.name << '\n';
  say("format", format.name + ", " + format.what);
  const ImportedCapture imported = write_recording(arguments.out, recording, facts, [](int done, int total) {
    stop_if_interrupted();
    show_progress("image", done, total);
  });
  describe(imported.capture);
  for (const std::string& note : imported.notes) say("note", note);
  std::cout << arguments.out << "/capture.toml is written; its first lines say what is still to be filled in\n";
}

std::string footer() {
  std::string text = "Formats:\n";
  for (const ImportFormat& format : import_formats())
    text += formatted("  %-14s", format.name.c_str()) + format.what + "\n";
  return text +
         "\nExamples:\n"
         "  pliant import fall.bag --surface bear.ply --mass 0.256 --up 0,-1,0 --out recordings/bear\n"
         "  pliant import frames --from images --camera camera.json --depth-scale 1000 --rate 30 --out "
         "recordings/bear\n"
         "  pliant import drop.mp4 --fov 62 --surface toy.ply --mass 0.08 --up 0,-1,0 --out recordings/toy\n"
         "  pliant import pull.csv --length 0.05 --area 4e-4 --out recordings/pull\n"
         "What each format holds, and what has to be said by hand: docs/imports.md.";
}

}  // namespace

void add_import(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("import", "Make a capture of a recording of another program or sensor");
  command.option("source", arguments->source, "file or folder of the recording").required().type_name("SOURCE");
  command.option("--out,-o", arguments->out, "folder for the capture").required().type_name("DIR");
  command.option("--from", arguments->from, "format, see below (default: by what the source looks like)")
      .type_name("FORMAT");
  command.option("--surface", arguments->surface, "closed mesh of the object at rest, in metres").type_name("FILE");
  command.option("--mass", arguments->mass, "of the object [kg]").positive().type_name("KG");
  command.option("--density", arguments->density, "of the object, in the place of --mass [kg/m^3]").positive();
  command.option("--up", arguments->up, "direction away from the ground, in world coordinates; gravity is 9.81 m/s^2")
      .expected(3)
      .delimiter(',')
      .type_name("X,Y,Z");
  command.option("--rate", arguments->rate, "frames a second, in the place of the recording's times [Hz]").positive();
  command.option("--time-unit", arguments->time_unit, "of times in files (default: what they or their steps say)")
      .one_of({"s", "ms", "us", "ns"});
  command.option("--depth-scale", arguments->depth_scale, "raw units of depth per metre, 1000 for millimetres")
      .positive()
      .type_name("UNITS");
  command.option("--camera", arguments->camera, "JSON file of the camera's intrinsics").type_name("FILE");
  command.option("--fx", arguments->fx, "focal length of a video's camera [pixels]").positive().type_name("PIXELS");
  command.option("--fov", arguments->fov, "its horizontal field of view, in the place of --fx [degrees]")
      .range(1.0, 175.0)
      .type_name("DEGREES");
  command
      .option(
          "--background", arguments->background,
          "of a video: plain, still, or a picture of the scene without the object (default: plain where the border is)")
      .type_name("WHAT");
  command
      .option("--threshold", arguments->threshold,
              "difference in colour from the background that is the object (default: found) [of 255 levels]")
      .range(1.0, 254.0)
      .type_name("LEVELS");
  command.option("--topic", arguments->topics, "depth images of a bag by their topic; once for each sensor")
      .one_value_a_use()
      .type_name("TOPIC");
  command.option("--first", arguments->first, "image that becomes frame 0").range(0, 1000000000);
  command.option("--last", arguments->last, "last image that is taken (default: all)").range(0, 1000000000);
  command.option("--every", arguments->every, "takes every N-th image").range(1, 1000000).type_name("N");
  command.option("--length", arguments->length, "of a specimen between the grips of a testing machine [m]").positive();
  command.option("--area", arguments->area, "cross section of the specimen at rest [m^2]").positive();
  command.flag("--compression", arguments->compression, "the specimen is compressed, whatever the machine's signs");
  command.flag("--tension", arguments->tension, "the specimen is pulled, whatever the machine's signs");
  command
      .option("--strain", arguments->strain,
              "what a machine's column of strains holds: strain (0 at rest), percent or stretch (1 at rest)")
      .type_name("WHAT");
  command
      .option("--keep", arguments->kept,
              "leaves as recorded: force-zero (the force at no extension), extension-zero (slack, absolute positions, "
              "air before contact) or break (rows behind it); may be repeated")
      .one_value_a_use()
      .type_name("WHAT");
  command.option("--ball", arguments->ball, "radius of a ball that a machine presses into the object [m]").positive();
  command.option("--punch", arguments->punch, "radius of a flat-ended punch [m]").positive();
  command.option("--contact", arguments->contact, "point of the surface that the probe touches first [m]")
      .expected(3)
      .delimiter(',')
      .type_name("X,Y,Z");
  command
      .option("--force-std", arguments->force_std,
              "standard deviation of a machine's force (default: what its curve shows) [N]")
      .positive();
  command.footer(footer());
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
