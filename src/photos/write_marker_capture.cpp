#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "base/files.hpp"
#include "capture/markers.hpp"
#include "photos/measure.hpp"

namespace pliant {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

void write_markers(const fs::path& folder, const std::string& name, const std::vector<std::string>& ids,
                   const MeasuredMarkers& markers) {
  MarkerPositions seen;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (const auto row = markers.positions.row(Eigen::Index(i)); row.allFinite()) {
      seen.positions.conservativeResize(seen.positions.rows() + 1, 3);
      seen.positions.bottomRows<1>() = row;
      seen.ids.push_back(ids[i]);
    }
  write_marker_positions(folder / (name + ".csv"), seen);
  write_file(folder / (name + "_std.csv"), [&](std::ostream& out) {
    out << "id,sx,sy,sz\n";
    for (std::size_t i = 0; i < ids.size(); ++i)
      if (const auto row = markers.deviations.row(Eigen::Index(i)); row.allFinite())
        out << fmt::format("{},{:.4g},{:.4g},{:.4g}\n", ids[i], row.x(), row.y(), row.z());
  });
}

std::string press_name(const MeasuredPress& press) { return fmt::format("press/{:03}", press.press.number); }

// What the presses that can be used were, with the files of their markers in `folder`.
Capture capture_of(const PhotoSession& session, const MarkerMeasurement& measurement, const fs::path& folder) {
  Capture capture;
  capture.name = session.name;
  capture.scene = session.scene;
  capture.scene.object.file = folder / ("rest" + session.scene.object.file.extension().string());
  for (const MeasuredPress& measured : measurement.presses) {
    if (!measured.failure.empty()) continue;
    Press& press = capture.presses.emplace_back();
    press.force = measured.force.force * measured.probe.direction;
    press.contact_centre = measured.contact;
    press.contact_radius = session.probe.radius;
    press.probe = Plane{measured.probe.tip, measured.probe.direction};
    press.markers = folder / (press_name(measured) + ".csv");
    press.markers_rest = folder / "markers_rest.csv";
    press.markers_std = folder / (press_name(measured) + "_std.csv");
    press.role = measured.press.role;
    press.glued = measured.press.glued.value_or(true);
  }
  return capture;
}

Json json_of(const PhotoFigures& figures) {
  return {{"dots", figures.dots},
          {"seen", figures.seen},
          {"ambiguous", figures.ambiguous},
          {"rms_pixels", figures.rms},
          {"noise_factor", figures.noise_factor},
          {"deviation", figures.deviation},
          {"greatest_centre_correction_pixels", figures.greatest_bias},
          {"seconds", figures.seconds}};
}

Json json_of(const PhotoSession& session, const MarkerMeasurement& measurement) {
  Json json = {{"format", "markers/1"}, {"name", session.name}, {"markers", measurement.ids.size()}};
  for (const LensCamera& camera : session.cameras) json["cameras"].push_back(camera.name);
  json["rest"] = json_of(measurement.rest_figures);
  for (const MeasuredPress& press : measurement.presses) {
    Json own = json_of(press.figures);
    own["number"] = press.press.number;
    own["force"] = press.force.force;
    own["force_scatter"] = press.force.scatter;
    own["force_samples"] = press.force.samples;
    if (press.failure.empty())
      own["probe_deviation"] = press.probe.tip_sigma;
    else
      own["failure"] = press.failure;
    json["presses"].push_back(own);
  }
  return json;
}

}  // namespace

void write_marker_capture(const fs::path& folder, const PhotoSession& session, const MarkerMeasurement& measurement) {
  std::vector<Problem> failures;
  for (const MeasuredPress& press : measurement.presses)
    if (!press.failure.empty())
      failures.push_back({{session.file}, fmt::format("press {}: {}", press.press.number, press.failure), "", ""});
  if (failures.size() == measurement.presses.size()) {
    failures.push_back({{session.file}, "no press can be used", "one at least", ""});
    throw InputError(std::move(failures));
  }
  const Capture capture = capture_of(session, measurement, folder);
  write_file(capture.scene.object.file, read_file(session.scene.object.file));
  write_markers(folder, "markers_rest", measurement.ids, measurement.rest);
  for (const MeasuredPress& press : measurement.presses)
    if (press.failure.empty()) write_markers(folder, press_name(press), measurement.ids, press.markers);
  write_file(folder / "markers.json", json_of(session, measurement).dump(2) + "\n");
  write_capture(folder, capture);
}

}  // namespace pliant
