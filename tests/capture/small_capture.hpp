#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include "capture/capture.hpp"
#include "capture/depth_frame.hpp"
#include "capture/image_io.hpp"
#include "capture/point_cloud.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"
#include "temporary_folder.hpp"

namespace pliant::test {

/// A small valid recording: a box of 0.2 m, seen from the front by one camera of 80 x 60 pixels a metre away, falls
/// towards a floor 0.4 m below it. y points down. Tests edit its text, or remove files, and see what is said.
class SmallCapture {
 public:
  static constexpr int width = 80, height = 60, frames = 4;
  static constexpr double focal = 80.0, floor = 0.5, near_face = 0.9, wall = 2.0;

  SmallCapture() {
    write_mesh(folder / "rest.ply", box_mesh(Vector3::Constant(-0.1), Vector3::Constant(0.1)));
    for (int frame = 0; frame < frames; ++frame) {
      const double fallen = 0.02 * frame * frame;
      write_png(folder / ("front/00000" + std::to_string(frame) + ".png"), depth_image(fallen));
      write_png(folder / ("front/mask_00000" + std::to_string(frame) + ".png"), mask_image(fallen));
    }
    write_png(folder / "front/background.png", depth_image(1e3));
    folder.write("markers_rest.csv", "id,x,y,z\n0,0,0,-0.1\n7,0.05,0,0.1\n");
    folder.write("markers.csv", "frame,id,x,y,z\n0,0,0,0,-0.1\n2,7,0.05,0.08,0.1\n");
    write_points(folder / "load.ply", std::vector<Vector3>{{0, 0, -0.1}});
    folder.write("held.txt", "0\n1\n");
    text = R"(format = "capture/1"
name = "box"

[object]
surface = "rest.ply"
mass = 0.8

[world]
gravity = [0.0, 9.81, 0.0]

[timing]
frame_rate = 60.0
frame_count = 4
start_frame = 1

[[plane]]
point = [0.0, 0.5, 0.0]
normal = [0.0, -2.0, 0.0]

[[region]]
name = "left"
half_space = { point = [0, 0, 0], normal = [-1, 0, 0] }

[[depth]]
name = "front"
width = 80
height = 60
fx = 80.0
fy = 80.0
cx = 39.5
cy = 29.5
camera_to_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]]
images = "front/%06d.png"
depth_scale = 1000.0
masks = "front/mask_%06d.png"
noise = 0.002
)";
  }

  /// Replaces the first occurrence; the text must be there.
  SmallCapture& edit(std::string_view from, std::string_view to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
    return *this;
  }
  SmallCapture& append(std::string_view more) {
    text += more;
    return *this;
  }
  Capture read() const {
    folder.write("capture.toml", text);
    return read_capture(folder.path());
  }
  /// The line of the text in which `part` stands, from 1; 0 where it does not.
  int line_of(std::string_view part) const {
    const auto at = text.find(part);
    return at == std::string::npos ? 0 : 1 + int(std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n'));
  }

  /// Exact depth [mm] of the box, the floor and a wall.
  static Image<std::uint16_t> depth_image(double fallen) {
    Image<std::uint16_t> image(width, height);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) image(u, v) = std::uint16_t(std::lround(1e3 * depth_at(u, v, fallen)));
    return image;
  }
  static Image<std::uint8_t> mask_image(double fallen) {
    Image<std::uint8_t> image(width, height);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) image(u, v) = on_box(u, v, fallen) ? 255 : 0;
    return image;
  }

  TemporaryFolder folder;
  std::string text;

 private:
  static bool on_box(int u, int v, double fallen) {
    const double x = (u - 39.5) / focal * near_face, y = (v - 29.5) / focal * near_face - fallen;
    return std::abs(x) < 0.1 && std::abs(y) < 0.1;
  }
  static double depth_at(int u, int v, double fallen) {
    if (on_box(u, v, fallen)) return near_face;
    const double slope = (v - 29.5) / focal;
    return slope > 0 ? std::min(wall, floor / slope) : wall;
  }
};

}  // namespace pliant::test
