#include "imports/recording.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace pliant {

namespace fs = std::filesystem;

std::uint16_t raw_depth(float metres) {
  const double units = double(metres) * units_of_metres;
  return units >= 0.5 && units < 65535.5 ? std::uint16_t(std::lround(units)) : std::uint16_t(0);
}

void refuse(const fs::path& file, std::string found, std::string expected, std::string advice) {
  throw InputError(Problem{{file}, std::move(found), std::move(expected), std::move(advice)});
}

void ask_for_scale(const fs::path& file, const std::string& why) {
  refuse(file, "depths of an unknown unit: " + why, "raw units per metre",
         "give --depth-scale, 1000 where a unit is a millimetre, 10000 where it is a tenth of one");
}

void refuse_colourised(const fs::path& file, const std::string& what) {
  refuse(file, "colourised depth: an image of " + what, "16-bit depth, raw units in one channel",
         "colours and 8 bits keep too little of the depth; record or export 16-bit depth");
}

Image<std::uint16_t> read_raw_depth(const fs::path& file, const PinholeCamera& camera) {
  const ImageHeader header = read_image_header(file);
  if (header.bits <= 8) {
    static constexpr const char* kinds[] = {"", "grey", "grey and alpha", "RGB", "RGBA"};
    refuse_colourised(file, std::to_string(header.bits) + "-bit " + kinds[header.channels]);
  }
  if (header.width != camera.width || header.height != camera.height)
    refuse(file, "an image of " + std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels",
           std::to_string(camera.width) + " x " + std::to_string(camera.height) + ", the camera's size",
           "use the intrinsics of this resolution");
  return read_depth_image(file);
}

RigidMotion from_opengl_axes(const RigidMotion& camera_to_world) {
  RigidMotion turned = camera_to_world;
  turned.rotation.col(1) *= -1.0;
  turned.rotation.col(2) *= -1.0;
  return turned;
}

std::optional<RigidMotion> motion_of(const Eigen::Vector4d& xyzw, const Vector3& shift) {
  const double length = xyzw.norm();
  if (!std::isfinite(length) || !(length > 1e-6) || !shift.allFinite()) return std::nullopt;
  const Eigen::Quaterniond q(xyzw[3] / length, xyzw[0] / length, xyzw[1] / length, xyzw[2] / length);
  return RigidMotion{q.toRotationMatrix(), shift};
}

PinholeCamera resized(const PinholeCamera& camera, int width, int height) {
  PinholeCamera result = camera;
  const double x = double(width) / camera.width, y = double(height) / camera.height;
  result.width = width, result.height = height;
  result.fx *= x, result.fy *= y;
  result.cx = (camera.cx + 0.5) * x - 0.5, result.cy = (camera.cy + 0.5) * y - 0.5;
  return result;
}

}  // namespace pliant
