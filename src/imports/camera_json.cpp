#include "imports/camera_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;
using CameraJson = nlohmann::json;

namespace {

constexpr const char* camera_names[] = {"camera_intrinsic.json", "intrinsic.json", "intrinsics.json", "camera.json",
                                        "config.json"};

// Numbers of an array, also of an array of arrays, row by row.
std::vector<double> flat_numbers(const CameraJson& value, const fs::path& file, const std::string& key) {
  std::vector<double> numbers;
  const auto add = [&](const CameraJson& v) {
    if (!v.is_number()) refuse(file, "`" + key + "` holds something else than numbers", "numbers, or rows of them");
    numbers.push_back(v.get<double>());
    if (!std::isfinite(numbers.back())) refuse(file, "`" + key + "` has a number that is not finite", "numbers");
  };
  if (!value.is_array()) return add(value), numbers;
  for (const CameraJson& row : value)
    if (row.is_array())
      for (const CameraJson& item : row) add(item);
    else
      add(row);
  return numbers;
}

const CameraJson* find_key(const CameraJson& json, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (const auto it = json.find(key); it != json.end()) return &*it;
  return nullptr;
}

double needed_number(const CameraJson& json, const fs::path& file, std::initializer_list<const char*> keys) {
  const CameraJson* value = find_key(json, keys);
  if (!value)
    refuse(file, "no `" + std::string(*keys.begin()) + "`", "width, height, fx, fy, cx and cy, or an intrinsic_matrix",
           "give another file with --camera");
  if (!value->is_number()) refuse(file, "`" + std::string(*keys.begin()) + "` is no number", "a number");
  return value->get<double>();
}

int needed_size(const CameraJson& json, const fs::path& file, std::initializer_list<const char*> keys) {
  const double size = needed_number(json, file, keys);
  if (!(size >= 1 && size <= largest_side) || size != std::floor(size))
    refuse(file, "`" + std::string(*keys.begin()) + "` is " + std::to_string(size), "a number of pixels");
  return int(size);
}

void read_matrix(const CameraJson& value, const char* key, bool is_by_columns, const fs::path& file,
                 PinholeCamera& camera) {
  const std::vector<double> m = flat_numbers(value, file, key);
  if (m.size() != 9)
    refuse(file, "`" + std::string(key) + "` has " + std::to_string(m.size()) + " numbers", "nine: 3 x 3");
  const auto at = [&](int row, int column) {
    return m[std::size_t(is_by_columns ? 3 * column + row : 3 * row + column)];
  };
  if (at(2, 2) != 1.0 || at(2, 0) != 0.0 || at(2, 1) != 0.0 || at(1, 0) != 0.0)
    refuse(file, "`" + std::string(key) + "` does not end in 0, 0, 1",
           is_by_columns ? "fx, 0, 0, 0, fy, 0, cx, cy, 1" : "fx, 0, cx, 0, fy, cy, 0, 0, 1",
           "Open3D's intrinsic_matrix is written column by column, K row by row");
  if (at(0, 1) != 0.0) refuse(file, "`" + std::string(key) + "` has skew", "pixels with right angles");
  camera.fx = at(0, 0), camera.fy = at(1, 1), camera.cx = at(0, 2), camera.cy = at(1, 2);
}

void read_pose(const CameraJson& value, const fs::path& file, PinholeCamera& camera) {
  const std::vector<double> m = flat_numbers(value, file, "camera_to_world");
  if (m.size() != 16)
    refuse(file, "`camera_to_world` has " + std::to_string(m.size()) + " numbers", "16: 4 x 4, row by row");
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) camera.camera_to_world.rotation(i, j) = m[4 * std::size_t(i) + std::size_t(j)];
    camera.camera_to_world.translation[i] = m[4 * std::size_t(i) + 3];
  }
  const Matrix3& r = camera.camera_to_world.rotation;
  constexpr double orthogonal = 1e-4;
  if ((r * r.transpose() - Matrix3::Identity()).norm() > orthogonal || r.determinant() < 0)
    refuse(file, "`camera_to_world` does not begin with a rotation", "a rigid motion, row by row");
}

}  // namespace

CameraFile read_camera_json(const fs::path& file) {
  const CameraJson whole = CameraJson::parse(read_file(file), nullptr, false);
  if (whole.is_discarded() || !whole.is_object())
    refuse(file, "no JSON object", "a JSON file of a camera's intrinsics", "the file may be cut short");
  const CameraJson* inner = find_key(whole, {"intrinsic", "depth_intrinsics"});
  const CameraJson& json = inner && inner->is_object() ? *inner : whole;
  CameraFile result;
  PinholeCamera& camera = result.camera;
  camera.width = needed_size(json, file, {"width"});
  camera.height = needed_size(json, file, {"height"});
  if (const CameraJson* matrix = find_key(json, {"intrinsic_matrix"})) {
    read_matrix(*matrix, "intrinsic_matrix", !(matrix->is_array() && !matrix->empty() && matrix->front().is_array()),
                file, camera);
  } else if (const CameraJson* K = find_key(json, {"K", "camera_matrix"})) {
    read_matrix(*K, json.contains("K") ? "K" : "camera_matrix", false, file, camera);
  } else {
    camera.fx = needed_number(json, file, {"fx"}), camera.fy = needed_number(json, file, {"fy"});
    camera.cx = needed_number(json, file, {"cx", "ppx"}), camera.cy = needed_number(json, file, {"cy", "ppy"});
  }
  if (!(camera.fx > 0 && camera.fy > 0) || !std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy))
    refuse(file, "a focal length that is not positive", "fx and fy in pixels");
  if (const CameraJson* lens = find_key(json, {"distortion", "coeffs", "dist_coeffs", "distortion_coefficients"})) {
    std::vector<double> k = flat_numbers(*lens, file, "distortion");
    if (!LensDistortion::takes(k.size()))
      refuse(file, std::to_string(k.size()) + " coefficients of distortion", LensDistortion::counts);
    if (std::ranges::any_of(k, [](double c) { return c != 0.0; })) camera.lens = LensDistortion(std::move(k));
  }
  for (const CameraJson* part : {&json, &whole}) {
    if (const CameraJson* scale = find_key(*part, {"depth_scale"}); scale && !result.depth_scale) {
      const double value = scale->is_number() ? scale->get<double>() : 0.0;
      if (!(value > 0) || !std::isfinite(value))
        refuse(file, "a `depth_scale` that is not positive", "units per metre");
      result.depth_scale = value < 1.0 ? 1.0 / value : value;
    }
    if (const CameraJson* rate = find_key(*part, {"fps", "frame_rate"}); rate && !result.frame_rate) {
      const double value = rate->is_number() ? rate->get<double>() : 0.0;
      if (!(value > 0) || !std::isfinite(value)) refuse(file, "an `fps` that is not positive", "frames a second");
      result.frame_rate = value;
    }
  }
  if (const CameraJson* pose = find_key(whole, {"camera_to_world"})) read_pose(*pose, file, camera);
  return result;
}

bool has_camera_json(const fs::path& folder) {
  return std::ranges::any_of(camera_names, [&](const char* name) { return is_file(folder / name); });
}

CameraFile camera_of_folder(const fs::path& folder, const ImportOptions& options) {
  if (options.camera) return read_camera_json(*options.camera);
  for (const char* name : camera_names)
    if (is_file(folder / name)) return read_camera_json(folder / name);
  refuse(folder, "no file of the camera's intrinsics", "camera_intrinsic.json, intrinsic.json or camera.json",
         R"(give --camera FILE with {"width": .., "height": .., "fx": .., "fy": .., "cx": .., "cy": ..})");
}

}  // namespace pliant
