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
#endif

namespace pliant::apps {

namespace {

struct Arguments {
  std::string session, out, example;
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

void make_example(const std::string& folder) {
  PhotoExampleOptions options;
  options.dots = 80;
  options.width = 1296;
  options.height = 864;
  options.depths = {0.012, 0.024};
  PhotoExample(options).write(folder);
  std::cout << folder
            << ": three cameras' photographs of a painted dome, at rest and under four presses\nthe truth is in "
            << folder << "/truth; next: pliant markers " << folder << " --out CAPTURE\n";
}

int run(const Arguments& arguments) {
  if (!arguments.example.empty()) {
    make_example(arguments.example);
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
  command.footer(footer);
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
