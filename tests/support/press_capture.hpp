#pragma once

#include <fmt/format.h>

#include <filesystem>

#include "base/files.hpp"
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
  std::string text = fmt::format(
      "format = \"capture/1\"\nname = \"pressed block\"\n[object]\nvolume_mesh = \"block.vtu\"\ndensity = {}\n"
      "[world]\ngravity = [0.0, -9.81, 0.0]\n"
      "[[fixed]]\nbox = {{ min = [-1.0, -1.0, -1.0], max = [1.0, -0.0499, 1.0] }}\n",
      scene.density);
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
    const Vector3 &f = press.force, &c = scene.facts[i].contact_centre;
    text += fmt::format(
        "[[press]]\nforce = [{}, {}, {}]\ncontact = {{ centre = [{}, {}, {}], radius = {} }}\n"
        "markers = \"press{}.csv\"\nmarkers_rest = \"rest.csv\"\nrole = \"{}\"\n",
        f.x(), f.y(), f.z(), c.x(), c.y(), c.z(), scene.facts[i].contact_radius, i + 1,
        int(scene.presses.size() - i) <= tests ? "test" : "fit");
  }
  write_file(folder / "capture.toml", text);
  return folder / "capture.toml";
}

}  // namespace pliant::test
