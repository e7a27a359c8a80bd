#pragma once

#include <fmt/format.h>

#include <filesystem>

#include "capture/capture.hpp"
#include "capture/markers.hpp"
#include "model/vtu.hpp"
#include "support/presses.hpp"

namespace pliant::test {

/// Writes presses of a block as a capture: the block's own mesh, and a file of markers for each press.
/// @param tests  so many of the last presses are for testing only
inline std::filesystem::path write_press_capture(const std::filesystem::path& folder, const PressScene& scene,
                                                 int tests) {
  VtuGrid grid;
  grid.kind = VtuCell::Tetrahedron;
  grid.points = scene.body->nodes;
  grid.connectivity = scene.body->connectivity;
  write_vtu(folder / "block.vtu", grid);
  Capture capture;
  capture.name = "pressed block";
  capture.scene.object.volume.emplace();
  capture.scene.object.file = folder / "block.vtu";
  capture.scene.object.density = scene.density;
  capture.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
  capture.scene.fixed = {{RegionBox{{-1.0, -1.0, -1.0}, {1.0, -0.0499, 1.0}}, std::nullopt}};
  const auto write_markers = [&](const std::string& name, const std::vector<Vector3>& places, std::size_t count) {
    MarkerPositions markers;
    markers.positions.resize(Eigen::Index(count), 3);
    for (std::size_t m = 0; m < count; ++m) {
      markers.ids.push_back(std::to_string(m));
      markers.positions.row(Eigen::Index(m)) = places[m].transpose();
    }
    write_marker_positions(folder / name, markers);
  };
  for (std::size_t i = 0; i < scene.presses.size(); ++i) {
    const ObservedPress& press = scene.presses[i];
    const std::size_t count = press.rest.size() - (press.has_probe ? 1 : 0);  // the probe's pose is not told
    if (i == 0) write_markers("rest.csv", press.rest, count);
    write_markers(fmt::format("press{}.csv", i + 1), press.loaded, count);
    Press written = scene.facts[i];
    written.force = press.force;
    written.probe.reset();
    written.markers = folder / fmt::format("press{}.csv", i + 1);
    written.markers_rest = folder / "rest.csv";
    written.role = int(scene.presses.size() - i) <= tests ? "test" : "fit";
    written.glued = true;
    capture.presses.push_back(std::move(written));
  }
  write_capture(folder, capture);
  return folder / "capture.toml";
}

}  // namespace pliant::test
