#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "imports/recording.hpp"

namespace pliant {

/// What a JSON file says of a camera.
struct CameraFile {
  PinholeCamera camera;
  std::optional<double> depth_scale;  ///< raw units per metre
  std::optional<double> frame_rate;   ///< [Hz]
};

/// Reads intrinsics in one of these forms:
///   Open3D's PinholeCameraIntrinsic, and what its RealSense and Azure Kinect recorders write: width, height,
///   intrinsic_matrix (nine numbers, column by column), depth_scale, fps; or all that below "intrinsic";
///   plain numbers: width, height, fx, fy, and cx, cy or ppx, ppy;
///   a matrix K or camera_matrix, row by row, flat or nested.
/// Optional in each: distortion, coeffs or dist_coeffs (OpenCV's order), depth_scale (raw units per metre; a number
/// below 1 is metres per unit), fps, and camera_to_world, 4 x 4, row by row.
/// Throws InputError for a file that is no JSON, lacks a number, or has one that no camera has.
CameraFile read_camera_json(const std::filesystem::path& file);

/// The camera of a folder: `--camera`, else the file of a usual name in it (camera_intrinsic.json, intrinsic.json,
/// intrinsics.json, camera.json, config.json). Throws InputError where there is none.
CameraFile camera_of_folder(const std::filesystem::path& folder, const ImportOptions& options);

/// Whether the folder has such a file.
bool has_camera_json(const std::filesystem::path& folder);

}  // namespace pliant
