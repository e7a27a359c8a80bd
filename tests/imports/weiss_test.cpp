// The layout of SparseSurfaceConstraints, written here as its reader takes it: matrices of OpenGL, depth of the buffer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "import_tools.hpp"

namespace pliant::weiss_import_test {

using namespace test;
using ::testing::HasSubstr;

constexpr int width = 48, height = 36;
constexpr double near_plane = 0.3, far_plane = 4.0;

// A camera of OpenGL: its axes in the world, and its projection.
struct GlCamera {
  RigidMotion pose;  // x right, y up, z backward
  Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d projection = Eigen::Matrix4d::Zero(), view = Eigen::Matrix4d::Identity();
    const double f = 1.0 / std::tan(0.4);
    projection(0, 0) = f * height / width, projection(1, 1) = f;
    projection(2, 2) = -(far_plane + near_plane) / (far_plane - near_plane);
    projection(2, 3) = -2 * far_plane * near_plane / (far_plane - near_plane);
    projection(3, 2) = -1;
    view.topLeftCorner<3, 3>() = pose.inverse().rotation;
    view.topRightCorner<3, 1>() = pose.inverse().translation;
    return projection * view;
  }
};

GlCamera camera() {
  return {{Eigen::AngleAxisd(0.7, Vector3(0.2, 1, 0.1).normalized()).toRotationMatrix(), Vector3(0.5, 0.8, 1.2)}};
}

void write_layout(const TemporaryFolder& folder, const GlCamera& gl, bool flip_y) {
  std::string numbers;
  const Eigen::Matrix4d m = gl.matrix();
  for (int k = 0; k < 16; ++k) numbers += (k > 0 ? ", " : "") + std::to_string(m(k % 4, k / 4));
  folder.write(
      "in/config.json",
      R"({"width": 48, "height": 36, "framerate": 40, "duration": 2, "cameras": [{"location": [0,0,0], "flipY": )" +
          std::string(flip_y ? "true" : "false") + R"(, "matrix": [)" + numbers + "]}]}");
  for (int frame = 0; frame < 2; ++frame) {
    Image<std::uint16_t> image(width, height);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        const double z = 1e-3 * ramp(u, v, frame);
        if (!(z > 0)) continue;
        const double ndc = (far_plane + near_plane) / (far_plane - near_plane) -
                           2 * far_plane * near_plane / ((far_plane - near_plane) * z);
        image(u, flip_y ? v : height - 1 - v) = std::uint16_t(std::lround(65535 * 0.5 * (ndc + 1)));
      }
    write_png(folder / ("in/cam0/depth" + std::to_string(frame) + ".png"), image);
  }
}

class WeissLayout : public ::testing::TestWithParam<bool> {};

TEST_P(WeissLayout, BecomesDepthsAndACameraInTheWorld) {
  const TemporaryFolder folder;
  const GlCamera gl = camera();
  write_layout(folder, gl, GetParam());
  EXPECT_EQ(import_format("", folder / "in").name, "weiss");
  const Capture capture = imported(folder / "in", folder / "out");
  expect_ramp(capture, 2, 0, 0, 3e-4f);
  EXPECT_NEAR(capture.scene.timing.frame_rate, 40.0, 1e-9);
  const PinholeCamera& seen = capture.depth.front().camera;
  EXPECT_NEAR((seen.camera_to_world.translation - gl.pose.translation).norm(), 0.0, 1e-4);
  EXPECT_NEAR((seen.camera_to_world.rotation - from_opengl_axes(gl.pose).rotation).norm(), 0.0, 1e-4);
  // A point of the world lands where OpenGL draws it.
  const Vector3 point = gl.pose(Vector3(0.1, 0.2, -1.0));
  const Eigen::Vector4d clip = gl.matrix() * point.homogeneous();
  const Vector3 pixel = seen.project(point);
  EXPECT_NEAR(pixel.x(), 0.5 * (clip.x() / clip.w() + 1) * width - 0.5, 1e-2);
  EXPECT_NEAR(pixel.y(), height - 0.5 - 0.5 * (clip.y() / clip.w() + 1) * height, 1e-2);
  EXPECT_NEAR(pixel.z(), 1.0, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(BothOrders, WeissLayout, ::testing::Bool());

TEST(WeissFolder, RefusesEightBitsAndOtherMatrices) {
  const TemporaryFolder folder;
  write_layout(folder, camera(), true);
  write_png(folder / "in/cam0/depth0.png", Image<Rgb>(width, height));
  EXPECT_THAT(complaint_of([&] { (void)read_weiss_folder(folder / "in", {}); }), HasSubstr("colourised depth"));
  GlCamera mirrored = camera();
  mirrored.pose.rotation.col(0) *= -1.0;
  write_layout(folder, mirrored, true);
  EXPECT_THAT(complaint_of([&] { (void)read_weiss_folder(folder / "in", {}); }), HasSubstr("mirrors"));
  folder.write("in/config.json", R"({"width": 48, "height": 36, "framerate": 40, "duration": 2, "cameras": [{}]})");
  EXPECT_THAT(complaint_of([&] { (void)read_weiss_folder(folder / "in", {}); }), HasSubstr("16 numbers"));
}

TEST(WeissFolder, RefusesValuesOfAnotherKind) {
  const TemporaryFolder folder;
  write_layout(folder, camera(), true);
  const std::string whole = read_file(folder / "in/config.json");
  const auto at = whole.find("\"matrix\"");
  ASSERT_NE(at, std::string::npos);
  std::string odd = whole;
  folder.write("in/config.json", odd.insert(at, R"("depthPath": 5, )"));
  EXPECT_THAT(complaint_of([&] { (void)read_weiss_folder(folder / "in", {}); }), HasSubstr("one %d"));
  odd = whole;
  folder.write("in/config.json", odd.insert(at, R"("flipY": "yes", )"));
  EXPECT_EQ(read_weiss_folder(folder / "in", {}).depth.size(), 1u);
  std::string object = R"({"width": 48, "height": 36, "framerate": 40, "duration": 2, "cameras": [{"matrix": {)";
  for (int i = 0; i < 16; ++i) object += (i > 0 ? ", \"" : "\"") + std::to_string(i) + "\": 1";
  folder.write("in/config.json", object + "}}]}");
  EXPECT_THAT(complaint_of([&] { (void)read_weiss_folder(folder / "in", {}); }), HasSubstr("16 numbers"));
}

}  // namespace pliant::weiss_import_test
