#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "base/error.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#ifdef PLIANT_WITH_OPENCV
#include "photos/measure.hpp"
#include "photos/paint.hpp"
#include "synthesis/scene_motion.hpp"
#endif

namespace pliant::apps {

namespace {

struct Arguments {
  std::string session, out, example, scene;
};

#ifdef PLIANT_WITH_OPENCV

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

void say(const std::string& what, const std::string& text) {
  std::cout << formatted("%-13s", what.c_str()) << text << '\n';
}

void describe_rest(const PhotoSession& session, const MarkerMeasurement& measured) {
  const PhotoFigures& figures = measured.rest_figures;
  for (std::size_t c = 0; c < session.cameras.size(); ++c)
    say(c == 0 ? "cameras" : "", formatted("\"%s\" %d x %d, sees %d dots at rest", session.cameras[c].name.c_str(),
                                           session.cameras[c].width, session.cameras[c].height, figures.dots[c]));
  say("rest", formatted("%d markers, %.3f pixels rms between cameras, +- %.3g mm", figures.seen, figures.rms,
                        1e3 * figures.deviation));
  if (figures.ambiguous > 0)
    say("", formatted("note: %d dots are left out, as it is not clear which belong together", figures.ambiguous));
  constexpr double large = 0.1;  // [pixels]
  if (figures.greatest_bias > large)
    say("", formatted("note: dots are so large that their middles had to be corrected by up to %.2f pixels",
                      figures.greatest_bias));
}

void describe_press(const MeasuredPress& press) {
  const std::string name = formatted("press %d", press.press.number);
  if (!press.failure.empty()) {
    say(name, "left out: " + press.failure);
    return;
  }
  const PhotoFigures& figures = press.figures;
  say(name, formatted("%.3g N (+- %.2g), %d markers, %.3f pixels rms, +- %.3g mm; tip +- %.2g mm%s", press.force.force,
                      press.force.scatter, figures.seen, figures.rms, 1e3 * figures.deviation,
                      1e3 * press.probe.tip_sigma, press.press.role == "test" ? "; test" : ""));
  if (figures.ambiguous > 0)
    say("", formatted("note: %d markers are left out, as it is not clear which they are", figures.ambiguous));
}

// The object of a scene under its presses, as simulated.
PressedObject pressed_object(const std::string& file) {
  const SyntheticScene synthetic = read_synthetic_scene(file);
  const auto refuse = [&](std::size_t i, const char* found, const char* expected) {
    throw InputError(Problem{{file}, formatted("press %d ", int(i) + 1) + found, expected, "see docs/markers.md"});
  };
  if (synthetic.presses.empty())
    throw InputError(Problem{{file}, "no [[press]]", "a scene with presses", "see docs/scene.md"});
  for (std::size_t i = 0; i < synthetic.presses.size(); ++i) {
    const SyntheticPress& press = synthetic.presses[i];
    if (press.led != SyntheticPress::Led::Push) refuse(i, "is not led by `push`", "a force along the shaft alone");
    if (!press.glued) refuse(i, "slides", "glued = true");
    if (press.radius != synthetic.presses.front().radius) refuse(i, "has another radius", "one probe");
  }
  SyntheticScene presses = synthetic;  // alone: nothing else is photographed
  presses.scene.timing = {}, presses.scene.initial = {}, presses.pull.reset();
  presses.loads.clear(), presses.indentations.clear();
  const SceneMotion motion = simulate_scene(presses);
  PressedObject object{synthetic.name, {}, {}, synthetic.presses.front().radius};
  object.scene.object = synthetic.scene.object, object.scene.world = synthetic.scene.world;
  object.scene.fixed = synthetic.scene.fixed;
  for (std::size_t i = 0; i < motion.presses.size(); ++i) {
    const SceneMotion::Pressed& pressed = motion.presses[i];
    PressedObject::Press& press = object.presses.emplace_back();
    press.contact = synthetic.presses[i].at, press.direction = pressed.axis, press.shift = pressed.shift;
    press.force = pressed.force.dot(pressed.axis), press.role = synthetic.presses[i].role;
    press.contact_is_written = true;
    for (Eigen::Index v = 0; v < pressed.shape.vertices.rows(); ++v)
      press.vertices.emplace_back(pressed.shape.vertices.row(v));
  }
  return object;
}

void make_example(const std::string& folder, const std::string& scene) {
  PhotoExampleOptions options;
  options.dots = 80;
  options.width = 1296;
  options.height = 864;
  options.depths = {0.012, 0.024};
  if (!scene.empty()) {
    const PressedObject object = pressed_object(scene);
    const double size = bounding_box(*object.scene.object.surface).extent().maxCoeff();
    options.dots = 120, options.width = 1944, options.height = 1296;
    options.dot_diameter = size / 45.0;
    PhotoExample(options, object).write(folder);
    std::cout << folder << ": three cameras' photographs of \"" << object.name << "\", painted, at rest and under "
              << object.presses.size() << " presses\nthe truth is in " << folder << "/truth; next: pliant markers "
              << folder << " --out CAPTURE\n";
    return;
  }
  PhotoExample(options).write(folder);
  std::cout << folder
            << ": three cameras' photographs of a painted dome, at rest and under four presses\nthe truth is in "
            << folder << "/truth; next: pliant markers " << folder << " --out CAPTURE\n";
}

int run(const Arguments& arguments) {
  if (!arguments.example.empty()) {
    make_example(arguments.example, arguments.scene);
    return Fine;
  }
  if (arguments.session.empty() || arguments.out.empty())
    throw InputError(Problem{{}, "no session or no --out", "pliant markers SESSION --out CAPTURE", ""});
  const PhotoSession session = read_photo_session(arguments.session);
  const MarkerMeasurement measured = measure_markers(session, photographs_of(session), [](int done, int total) {
    stop_if_interrupted();
    show_progress("measuring photographs", done, total);
  });
  write_marker_capture(arguments.out, session, measured);
  std::cout << session.name << '\n';
  describe_rest(session, measured);
  bool all = true;
  for (const MeasuredPress& press : measured.presses) {
    describe_press(press);
    all = all && press.failure.empty();
  }
  std::cout << "\nnext: pliant check " << arguments.out << '\n';
  return all ? Fine : NotConverged;
}

#else

int run(const Arguments&) {
  throw InputError(Problem{
      {}, "this pliant was built without OpenCV, which `markers` needs", "", "build it with -DPLIANT_WITH_OPENCV=ON"});
}

#endif

constexpr const char* footer = R"(Examples:
  pliant markers session --out recording            then: pliant check recording
  pliant markers --example session                  photographs of a painted dome whose truth is known
  pliant markers --example session --scene scene.toml   the same of a scene's object under its presses

SESSION is a folder with a file markers.toml in it, or that file (docs/markers.md). The folder gets capture.toml,
markers_rest.csv, press/NNN.csv, standard deviations beside them (..._std.csv), and markers.json (the figures).
Returns 3 where a press had to be left out.)";

}  // namespace

void add_markers(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("markers", "Make a capture of presses from photographs of painted dots");
  command.option("session", arguments->session, "the session's folder, or its markers.toml").type_name("SESSION");
  command.option("--out", arguments->out, "folder for the capture").type_name("DIR");
  command.option("--example", arguments->example, "instead: write a session with known truth here").type_name("DIR");
  command.option("--scene", arguments->scene, "of the example: a scene whose presses are photographed (docs/scene.md)")
      .type_name("SCENE.toml");
  command.footer(footer);
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
