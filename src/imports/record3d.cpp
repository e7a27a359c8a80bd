// Record3D's .r3d: a zip archive with `metadata` (JSON) and rgbd/N.depth, float32 metres row by row in LZFSE, with
// rgbd/N.conf, one byte a pixel (0 low, 1, 2 high), likewise. K is of the colour image (w x h) and written column by
// column; `poses` are x, y, z, w of a quaternion and the shift, from ARKit's camera axes to a world whose y points up.
#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/lzfse.hpp"
#include "imports/zip_archive.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

using R3dJson = nlohmann::json;

std::vector<double> r3d_numbers(const R3dJson& json, const char* key, std::size_t count, const fs::path& place) {
  if (!json.contains(key)) refuse(place, "no `" + std::string(key) + "`", "the metadata of Record3D");
  std::vector<double> numbers;
  if (json[key].is_array())
    for (const R3dJson& item : json[key])
      if (item.is_number()) numbers.push_back(item.get<double>());
  if (json[key].is_number()) numbers.push_back(json[key].get<double>());
  if (numbers.size() < count)
    refuse(place, "`" + std::string(key) + "` has " + std::to_string(numbers.size()) + " numbers",
           std::to_string(count));
  return numbers;
}

int r3d_size(const R3dJson& json, const char* key, const fs::path& place) {
  const double value = r3d_numbers(json, key, 1, place)[0];
  if (!(value >= 1 && value <= 16384)) refuse(place, "`" + std::string(key) + "` is no size", "a number of pixels");
  return int(value);
}

Image<std::uint16_t> r3d_image(const ZipArchive& archive, int i, const PinholeCamera& camera) {
  const std::string name = "rgbd/" + std::to_string(i);
  const fs::path place = archive.file().string() + " (" + name + ".depth)";
  const std::size_t pixels = std::size_t(camera.width) * std::size_t(camera.height);
  const std::string depth = lzfse_decompressed(archive.read(name + ".depth"), 4 * pixels, place);
  if (depth.size() != 4 * pixels)
    refuse(place, std::to_string(depth.size()) + " bytes",
           std::to_string(4 * pixels) + ", of " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
               " numbers");
  std::string sure;
  if (archive.has(name + ".conf")) sure = lzfse_decompressed(archive.read(name + ".conf"), pixels, place);
  Image<std::uint16_t> image(camera.width, camera.height);
  for (std::size_t p = 0; p < pixels; ++p) {
    float metres = 0.0f;
    std::memcpy(&metres, depth.data() + 4 * p, 4);
    if (sure.size() != pixels || sure[p] != 0) image.pixels[p] = raw_depth(metres);
  }
  return image;
}

}  // namespace

bool is_record3d(const fs::path& source) { return source.extension() == ".r3d"; }

ImportedRecording read_record3d(const fs::path& source, const ImportOptions& /*options*/) {
  const auto archive = std::make_shared<const ZipArchive>(source);
  const fs::path place = source.string() + " (metadata)";
  const R3dJson json = R3dJson::parse(archive->read("metadata"), nullptr, false);
  if (json.is_discarded() || !json.is_object()) refuse(place, "no JSON object", "the metadata of Record3D");
  ImportedRecording recording;
  recording.name = source_name(source);
  DepthStream stream;
  stream.name = "iphone";
  const std::vector<double> K = r3d_numbers(json, "K", 9, place);
  PinholeCamera colour;
  colour.width = r3d_size(json, "w", place), colour.height = r3d_size(json, "h", place);
  colour.fx = K[0], colour.fy = K[4], colour.cx = K[6], colour.cy = K[7];
  if (!(colour.fx > 0 && colour.fy > 0)) refuse(place, "`K` without focal lengths", "fx, 0, 0, 0, fy, 0, cx, cy, 1");
  const int width = r3d_size(json, "dw", place), height = r3d_size(json, "dh", place);
  stream.camera = resized(colour, width, height);
  stream.depth_scale = units_of_metres;
  while (archive->has("rgbd/" + std::to_string(stream.image_count) + ".depth")) ++stream.image_count;
  if (stream.image_count == 0)
    refuse(source, "no depth image", "rgbd/0.depth and so on", "export the recording as .r3d, with LiDAR or TrueDepth");
  if (json.contains("frameTimestamps") && json["frameTimestamps"].is_array() && !json["frameTimestamps"].empty())
    stream.times = r3d_numbers(json, "frameTimestamps", std::size_t(stream.image_count), place);
  else
    stream.frame_rate = r3d_numbers(json, "fps", 1, place)[0];
  stream.times.resize(std::min(stream.times.size(), std::size_t(stream.image_count)));
  if (json.contains("poses") && json["poses"].is_array() && !json["poses"].empty()) {
    if (json["poses"].size() < std::size_t(stream.image_count))
      refuse(place, std::to_string(json["poses"].size()) + " poses", std::to_string(stream.image_count));
    for (int i = 0; i < stream.image_count; ++i) {
      const R3dJson one = {{"poses", json["poses"][std::size_t(i)]}};
      const std::vector<double> p = r3d_numbers(one, "poses", 7, place);
      const auto pose = motion_of({p[0], p[1], p[2], p[3]}, {p[4], p[5], p[6]});
      if (!pose) refuse(place, "pose " + std::to_string(i) + " is no rotation", "qx, qy, qz, qw, x, y, z");
      stream.poses.push_back(from_opengl_axes(*pose));
    }
    recording.gravity = Vector3(0.0, -9.81, 0.0);
  }
  stream.read = [archive, camera = stream.camera](int i) { return r3d_image(*archive, i, camera); };
  recording.depth.push_back(std::move(stream));
  recording.notes.push_back("readings of low confidence are left out");
  return recording;
}

}  // namespace pliant
