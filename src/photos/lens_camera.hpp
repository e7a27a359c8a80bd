#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"
#include "geometry/camera.hpp"

namespace pliant {

/// A calibrated photo camera: OpenCV's pinhole with a lens. Axes as in OpenCV (x right, y down, z forward); pixel
/// centres at whole numbers.
struct LensCamera {
  std::string name;
  int width = 0, height = 0;                    ///< [pixels]
  Matrix3 camera_matrix = Matrix3::Identity();  ///< [pixels]
  LensDistortion lens{};
  RigidMotion world_to_camera;  ///< [m]

  /// Where it stands in the world [m].
  Vector3 centre() const { return world_to_camera.inverse().translation; }
  /// Mean focal length [pixels].
  double focal_length() const { return 0.5 * (camera_matrix(0, 0) + camera_matrix(1, 1)); }
};

/// Reads a camera from OpenCV's YAML, XML or JSON (cv::FileStorage):
///   image_width, image_height, camera_matrix (3 x 3), distortion_coefficients (4, 5, 8, 12 or 14 numbers) and
///   either R (3 x 3, or a rotation vector of 3) and T (3): x_camera = R x_world + T,
///   or projection (3 x 4) = camera_matrix [R | T], of any scale.
/// @param extrinsics  the file with R and T or projection; may be the same
/// @param unit        of T [m]
/// Throws InputError with what is missing or makes no sense.
LensCamera read_lens_camera(const std::filesystem::path& calibration, const std::filesystem::path& extrinsics,
                            double unit = 1.0);

/// Writes the same keys, with R and T in metres; whole or not at all.
void write_lens_camera(const std::filesystem::path& path, const LensCamera& camera);

/// Pixels at which world points [m] are seen, through the lens. Points behind the camera come back as NaN.
std::vector<Vector2> project(const LensCamera& camera, std::span<const Vector3> points);
Vector2 project(const LensCamera& camera, const Vector3& point);

/// Where pixels would be were the lens without distortion: the same camera matrix, no coefficients. Pixels that no ray
/// through the lens reaches (a model beyond its range) come back as NaN.
std::vector<Vector2> without_lens(const LensCamera& camera, std::span<const Vector2> pixels);

/// Pixel without lens of a world point [m], and its derivative by the point (2 x 3 [pixels/m]) where one is asked for.
Vector2 project_without_lens(const LensCamera& camera, const Vector3& point,
                             Eigen::Matrix<double, 2, 3>* derivative = nullptr);

/// Direction in the world, not of unit length, of the ray through a pixel without lens.
Vector3 ray_of(const LensCamera& camera, const Vector2& pixel_without_lens);

}  // namespace pliant
