#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>

#include "base/error.hpp"
#include "capture/markers.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/followed.hpp"
#include "output/track_output.hpp"
#include "scan/scan_pose.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string capture, out, points;
  std::vector<std::string> settings;
  int points_per_frame = 5000;
  bool no_pictures = false;
};

void report_track(const Track& track, double seconds) {
  std::vector<double> rms;
  for (const TrackedFrame& f : track.frames)
    if (f.points > 0) rms.push_back(f.surface_rms);
  std::ranges::sort(rms);
  std::cout << "  " << track.frames.size() << " frames, " << track.body->node_count() << " nodes, "
            << track.surface.vertices.size() << " surface samples, " << seconds << " s (" << track.times.correspondence
            << " s correspondence, " << track.times.motion << " s motion, " << track.times.visibility
            << " s visibility)\n";
  if (!rms.empty())
    std::cout << "  points to the surface: median " << 1e3 * rms[rms.size() / 2] << " mm rms, worst frame "
              << 1e3 * rms.back() << " mm\n";
  if (!track.note.empty()) std::cout << "  note: " << track.note << "\n";
  if (track.lost_at) std::cout << "  the object was lost in frame " << *track.lost_at << "\n";
}

int run(const Arguments& arguments) {
  FitOptions options;
  for (const std::string& assignment : arguments.settings) set_fit_option(options, assignment);
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{}, wrong, "", "see `pliant fit --help`"});
  Capture capture = read_capture(arguments.capture);
  ObserveOptions observing;
  observing.max_points_per_frame = arguments.points_per_frame;
  const std::vector<ObservedFrame> observed =
      observe_placed(capture, observing, [](int done, int total) { show_progress("read", done, total); });
  stop_if_interrupted();
  MarkerPositions follow_these;
  if (!arguments.points.empty()) follow_these = read_marker_positions(arguments.points);
  std::vector<std::string> notes;
  const FollowedRecording recording({capture, observed}, options, notes);
  const auto begin = std::chrono::steady_clock::now();
  const VectorX& theta = recording.start();
  const Track found = recording.follow(theta, [](int done, int total) {
    show_progress("tracked", done, total);
    return !is_interrupted();
  });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::cout << capture.name << "\n";
  report_track(found, seconds);
  for (const std::string& note : notes) std::cout << "  note: " << note << "\n";
  write_track(arguments.out, capture, observed, found, recording.recording().blocks.motion, theta,
              !arguments.no_pictures, show_progress);
  if (!arguments.points.empty()) {
    std::vector<Vector3> rest;
    for (Eigen::Index i = 0; i < follow_these.positions.rows(); ++i)
      rest.push_back(follow_these.positions.row(i).transpose());
    write_marker_track(fs::path(arguments.out) / "points.csv", follow_these.ids,
                       follow(found, rest, capture.frame_count()));
  }
  std::cout << "Look at " << (fs::path(arguments.out) / "track.html").string() << "\n";
  if (is_interrupted()) return WasInterrupted;
  return found.lost_at ? NotConverged : Fine;
}

constexpr const char* footer =
    R"(Keys of --set are those of `pliant fit` that say how the object is simulated: cells, element, youngs_modulus,
poissons_ratio, mass_damping, stiffness_damping, density. None is needed: where the object is depends little on them.

Examples:
  pliant track recordings/plant --out plant-track
  pliant track recordings/plant --points leaf-tips.csv --out plant-track

The folder gets trajectory.pvd with frames/*.vtu (opens in ParaView), track.json and track.csv with the figures of each frame,
pictures/ with each frame's points over the surface, and track.html. Exit code 3: the object was lost.)";

}  // namespace

void add_track(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("track", "Follow a deforming object through point clouds, depth or markers");
  command.option("capture", arguments->capture, "folder with a capture.toml in it").required().type_name("CAPTURE");
  command.option("--set", arguments->settings, "one choice; may be given many times")
      .type_name("KEY=VALUE")
      .one_value_a_use();
  command
      .option("--points", arguments->points,
              "points of the object (CSV: id,x,y,z at rest) whose paths are written to points.csv")
      .type_name("FILE");
  command.option("--points-per-frame", arguments->points_per_frame, "an even subset of what was seen; 0: all")
      .not_negative()
      .show_default();
  command.flag("--no-pictures", arguments->no_pictures, "leave out pictures/ and the page's");
  command.option("--out,-o", arguments->out, "folder for the result").required().type_name("DIR");
  command.footer(footer);
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
