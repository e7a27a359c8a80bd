#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "base/files.hpp"
#include "capture/markers.hpp"
#include "capture/toml_facts.hpp"
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

void write_press(std::ostream& out, const MeasuredPress& press, const PhotoSession& session) {
  const Vector3 force = press.force.force * press.probe.direction;
  out << "[[press]]\nforce = " << toml_text(force) << "   # N, "
      << fmt::format("{:.4g} along the probe", press.force.force)
      << "\ncontact = { centre = " << toml_text(press.contact) << ", radius = " << toml_text(session.probe.radius)
      << " }\nprobe = { point = " << toml_text(press.probe.tip) << ", normal = " << toml_text(press.probe.direction)
      << " }\nmarkers = " << toml_text(press_name(press) + ".csv")
      << "\nmarkers_rest = \"markers_rest.csv\"\nrole = " << toml_text(press.press.role) << "\n";
  if (press.press.glued) out << "glued = " << (*press.press.glued ? "true" : "false") << "\n";
  out << "\n";
}

void write_capture_toml(std::ostream& out, const PhotoSession& session, const MarkerMeasurement& measurement,
                        const std::string& surface) {
  out << "format = \"capture/1\"\nname = " << toml_text(session.name)
      << "\n\n[object]\nsurface = " << toml_text(surface) << "\n";
  if (session.mass) out << "mass = " << toml_text(*session.mass) << "   # kg\n";
  if (session.density) out << "density = " << toml_text(*session.density) << "   # kg/m^3\n";
  out << "shape_is = " << toml_text(session.shape_is) << "\n\n[world]\ngravity = " << toml_text(session.gravity)
      << "   # m/s^2\n\n";
  for (std::size_t i = 0; i < session.fixed.size(); ++i)
    write_toml(out, session.fixed[i], fmt::format("fixed_{}.txt", i));
  for (const MeasuredPress& press : measurement.presses)
    if (press.failure.empty()) write_press(out, press, session);
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
  const std::string surface = "rest" + session.surface_file.extension().string();
  write_file(folder / surface, read_file(session.surface_file));
  for (std::size_t i = 0; i < session.fixed.size(); ++i)
    if (const auto* list = std::get_if<RegionVertices>(&session.fixed[i].region))
      write_file(folder / fmt::format("fixed_{}.txt", i), [&](std::ostream& out) {
        for (const int index : list->indices) out << index << '\n';
      });
  write_markers(folder, "markers_rest", measurement.ids, measurement.rest);
  for (const MeasuredPress& press : measurement.presses)
    if (press.failure.empty()) write_markers(folder, press_name(press), measurement.ids, press.markers);
  write_file(folder / "markers.json", json_of(session, measurement).dump(2) + "\n");
  write_file(folder / "capture.toml",
             [&](std::ostream& out) { write_capture_toml(out, session, measurement, surface); });
}

}  // namespace pliant
