// The layout of SparseSurfaceConstraints (Weiss et al. 2020): config.json with width, height, framerate, duration and
// cameras, each with a matrix from the world to OpenGL's clip space (16 numbers, column by column) and a path of depth
// images, cam0/depth%d.png. Depths there are those of the depth buffer, 0 at the near plane and 1 at the far plane.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/json_values.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

using WeissJson = nlohmann::json;

// A camera's matrix taken apart: a pinhole, and w of clip space by the buffer's depth: w = b / (2 d - 1 - a).
struct ClipCamera {
  PinholeCamera camera;
  double a = 0.0, b = 0.0, scale = 1.0;  // scale: w of a metre along the axis
};

ClipCamera clip_camera(const Eigen::Matrix4d& m, int width, int height, const fs::path& file) {
  const auto fail = [&](const char* found) {
    refuse(file, found, "a perspective projection times a rigid motion, column by column");
  };
  if (!m.allFinite()) fail("a matrix with a number that is not finite");
  // To pixels of an image whose first row is the top one; pixel centres at whole numbers.
  Eigen::Matrix<double, 3, 4> P;
  P.row(0) = 0.5 * width * (m.row(0) + m.row(3)) - 0.5 * m.row(3);
  P.row(1) = (height - 0.5) * m.row(3) - 0.5 * height * (m.row(1) + m.row(3));
  P.row(2) = m.row(3);
  ClipCamera result;
  result.scale = P.row(2).head<3>().norm();
  if (!(result.scale > 0.0)) fail("a matrix that is no perspective");
  P /= result.scale;
  const Vector3 r3 = P.row(2).head<3>(), m1 = P.row(0).head<3>(), m2 = P.row(1).head<3>();
  PinholeCamera& camera = result.camera;
  camera.width = width, camera.height = height;
  camera.cx = m1.dot(r3), camera.cy = m2.dot(r3);
  const Vector3 x = m1 - camera.cx * r3, y = m2 - camera.cy * r3;
  camera.fx = x.norm(), camera.fy = y.norm();
  constexpr double square = 1e-3;
  if (!(camera.fx > 0.0 && camera.fy > 0.0) || std::abs(x.dot(y)) > square * camera.fx * camera.fy)
    fail("a matrix whose pixels are askew");
  Matrix3 R;
  R.row(0) = x / camera.fx, R.row(1) = y / camera.fy, R.row(2) = r3;
  if (R.determinant() < 0.0) fail("a matrix that mirrors");
  const Vector3 last = P.col(3);
  const Vector3 t((last.x() - camera.cx * last.z()) / camera.fx, (last.y() - camera.cy * last.z()) / camera.fy,
                  last.z());
  camera.camera_to_world = RigidMotion{R, t}.inverse();
  const Vector3 z = m.row(2).head<3>(), w = m.row(3).head<3>();
  result.a = z.dot(w) / w.squaredNorm();
  result.b = m(2, 3) - result.a * m(3, 3);
  if ((z - result.a * w).norm() > square * (1.0 + z.norm()) || !(std::abs(result.b) > 0.0))
    fail("a matrix whose depths are no perspective's");
  return result;
}

Image<std::uint16_t> clip_image(const fs::path& file, const ClipCamera& clip, bool is_top_down) {
  const Image<std::uint16_t> raw = read_raw_depth(file, clip.camera);
  Image<std::uint16_t> image(raw.width, raw.height);
  for (int v = 0; v < raw.height; ++v)
    for (int u = 0; u < raw.width; ++u) {
      const std::uint16_t value = raw(u, is_top_down ? v : raw.height - 1 - v);
      if (value == 0 || value == 65535) continue;  // nothing was seen up to the far plane
      const double w = clip.b / (2.0 * value / 65535.0 - 1.0 - clip.a);
      image(u, v) = raw_depth(float(w / clip.scale));
    }
  return image;
}

double weiss_number(const WeissJson& json, const char* key, const fs::path& file) {
  if (!json.contains(key) || !json[key].is_number()) refuse(file, "no number `" + std::string(key) + "`", "one");
  return json[key].get<double>();
}

}  // namespace

bool is_weiss_folder(const fs::path& source) {
  if (!is_file(source / "config.json")) return false;
  try {
    const WeissJson json = WeissJson::parse(read_file(source / "config.json"), nullptr, false);
    return json.is_object() && json.contains("cameras") && json.contains("framerate") && json.contains("duration");
  } catch (const InputError&) {
    return false;
  }
}

ImportedRecording read_weiss_folder(const fs::path& source, const ImportOptions& /*options*/) {
  const fs::path file = source / "config.json";
  const WeissJson json = WeissJson::parse(read_file(file), nullptr, false);
  if (json.is_discarded() || !json.is_object()) refuse(file, "no JSON object", "the configuration of a recording");
  const double width = weiss_number(json, "width", file), height = weiss_number(json, "height", file);
  const double duration = weiss_number(json, "duration", file), rate = weiss_number(json, "framerate", file);
  if (!(width >= 2 && height >= 2 && width <= largest_side && height <= largest_side && duration >= 1 &&
        duration <= 1e7 && rate > 0))
    refuse(file, "a size, duration or framerate that is none", "pixels, frames, and frames a second");
  ImportedRecording recording;
  recording.name = source_name(source);
  const WeissJson& cameras = value_at(json, "/cameras");
  if (!cameras.is_array() || cameras.empty()) refuse(file, "no camera", "`cameras` with a matrix each");
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const WeissJson& entry = cameras[i];
    Eigen::Matrix4d m;
    const WeissJson& numbers = value_at(entry, "/matrix");
    if (!numbers.is_array() || numbers.size() != 16 ||
        !std::ranges::all_of(numbers, [](const WeissJson& n) { return n.is_number(); }))
      refuse(file, "camera " + std::to_string(i) + " has no matrix of 16 numbers", "one");
    for (int k = 0; k < 16; ++k) m(k % 4, k / 4) = numbers[std::size_t(k)].get<double>();
    const ClipCamera clip = clip_camera(m, int(width), int(height), file);
    const std::string usual_path = "cam" + std::to_string(i) + "/depth%d.png";
    const FramePattern pattern{entry.contains("depthPath") ? text_at(entry, "/depthPath") : usual_path};
    if (!pattern.is_valid())
      refuse(file, "the path \"" + pattern.pattern + "\"", "one %d where the frame's number stands");
    DepthStream stream;
    stream.name = "cam" + std::to_string(i);
    stream.camera = clip.camera;
    stream.depth_scale = units_of_metres;
    stream.image_count = int(duration);
    stream.frame_rate = rate;
    stream.read = [source, pattern, clip, is_top_down = value_at(entry, "/flipY") != false](int frame) {
      return clip_image(source / pattern(frame), clip, is_top_down);
    };
    (void)stream.read(0);
    recording.depth.push_back(std::move(stream));
  }
  recording.gravity = Vector3(0.0, -9.81, 0.0);
  recording.notes.push_back("taken as metres, with gravity along -y: config.json says neither");
  return recording;
}

}  // namespace pliant
