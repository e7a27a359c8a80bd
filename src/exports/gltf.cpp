#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>

#include "base/files.hpp"
#include "exports/formats.hpp"
#include "exports/moving_surface.hpp"

namespace pliant {

namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "glTF's numbers are little endian");

/// Numbers of the standard (glTF 2.0, sections 3.6.2 and 3.7.2).
constexpr int float_numbers = 5126, unsigned_numbers = 5125, of_vertices = 34962, of_indices = 34963;

/// The one binary buffer of a file, and what its parts are.
class Buffer {
 public:
  /// Appends numbers and returns their accessor.
  /// @param type    "SCALAR" or "VEC3"
  /// @param target  what a view is for; 0: not said
  template <class Number>
  int add(const std::vector<Number>& numbers, const char* type, int component, int target, bool tells_range) {
    const std::size_t width = std::strcmp(type, "VEC3") == 0 ? 3 : 1;
    Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", numbers.size() * sizeof(Number)}};
    if (target > 0) view["target"] = target;
    views_.push_back(std::move(view));
    Json accessor = {{"bufferView", views_.size() - 1},
                     {"componentType", component},
                     {"count", numbers.size() / width},
                     {"type", type}};
    if (tells_range) {
      std::vector<Number> low(width, std::numeric_limits<Number>::max()),
          high(width, std::numeric_limits<Number>::lowest());
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        low[i % width] = std::min(low[i % width], numbers[i]);
        high[i % width] = std::max(high[i % width], numbers[i]);
      }
      accessor["min"] = low, accessor["max"] = high;
    }
    accessors_.push_back(std::move(accessor));
    const auto* begin = reinterpret_cast<const char*>(numbers.data());
    bytes_.insert(bytes_.end(), begin, begin + numbers.size() * sizeof(Number));
    return int(accessors_.size()) - 1;
  }
  const std::vector<char>& bytes() const { return bytes_; }
  const Json& views() const { return views_; }
  const Json& accessors() const { return accessors_; }

 private:
  std::vector<char> bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

std::vector<float> floats(const Points& points) {
  std::vector<float> numbers;
  for (Eigen::Index n = 0; n < points.rows(); ++n)
    for (int d = 0; d < 3; ++d) numbers.push_back(float(points(n, d)));
  return numbers;
}

std::vector<float> floats(const std::vector<double>& values) { return {values.begin(), values.end()}; }

/// Frames are morph targets of the first one; each is shown alone at its time, and blended into the next between.
Json scene_of(const std::string& name, const MovingSurface& moving, Buffer& buffer) {
  std::vector<std::uint32_t> corners;
  for (const std::array<int, 3>& triangle : moving.triangles)
    for (const int vertex : triangle) corners.push_back(std::uint32_t(vertex));
  const int indices = buffer.add(corners, "SCALAR", unsigned_numbers, of_indices, false);
  const int positions = buffer.add(floats(moving.frames.front()), "VEC3", float_numbers, of_vertices, true);
  const std::size_t targets = moving.frames.size() - 1;
  Json morphs = Json::array();
  for (std::size_t k = 1; k <= targets; ++k)
    morphs.push_back({{"POSITION", buffer.add(floats(moving.frames[k] - moving.frames.front()), "VEC3", float_numbers,
                                              of_vertices, true)}});
  Json primitive = {{"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"material", 0}};
  if (targets > 0) primitive["targets"] = std::move(morphs);
  Json mesh = {{"name", name}, {"primitives", Json::array({std::move(primitive)})}};
  if (targets > 0) mesh["weights"] = std::vector<float>(targets, 0.0F);
  Json scene = {
      {"asset", {{"version", "2.0"}, {"generator", "pliant"}}},
      {"scene", 0},
      {"scenes", Json::array({{{"nodes", {0}}}})},
      {"nodes", Json::array({{{"name", name}, {"mesh", 0}}})},
      {"materials",
       Json::array(
           {{{"name", "object"},
             {"pbrMetallicRoughness",
              {{"baseColorFactor", {0.80, 0.45, 0.30, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.8}}}}})},
      {"meshes", Json::array({std::move(mesh)})}};
  if (targets > 0) {
    std::vector<float> weights(moving.frames.size() * targets, 0.0F);
    for (std::size_t k = 1; k <= targets; ++k) weights[k * targets + k - 1] = 1.0F;
    const int times = buffer.add(floats(moving.times), "SCALAR", float_numbers, 0, true);
    const int values = buffer.add(weights, "SCALAR", float_numbers, 0, false);
    scene["animations"] =
        Json::array({{{"name", "motion"},
                      {"samplers", Json::array({{{"input", times}, {"output", values}, {"interpolation", "LINEAR"}}})},
                      {"channels", Json::array({{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}})}}});
  }
  return scene;
}

void write_number(std::ostream& out, std::size_t number) {
  const auto value = std::uint32_t(number);
  out.write(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

/// One binary file (`.glb`): a header, the scene as JSON padded with spaces, the buffer padded with zeros.
std::vector<std::string> write_gltf(const Model& model, const std::filesystem::path& folder,
                                    const ExportProgress& progress) {
  constexpr std::size_t magic = 0x46546C67, version = 2, json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;
  const MovingSurface moving = moving_surface(model, progress);
  if (moving.frames.empty()) return {};
  Buffer buffer;
  Json scene = scene_of(model.name, moving, buffer);
  std::string bytes(buffer.bytes().begin(), buffer.bytes().end());
  bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
  scene["accessors"] = buffer.accessors(), scene["bufferViews"] = buffer.views();
  scene["buffers"] = Json::array({{{"byteLength", bytes.size()}}});
  std::string text = scene.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t length = 12 + 8 + text.size() + 8 + bytes.size();
  if (length > std::numeric_limits<std::uint32_t>::max())
    throw std::runtime_error("the motion is longer than a .glb file can hold: four gigabytes");
  write_file(folder / "model.glb", [&](std::ostream& out) {
    for (const std::size_t number : {magic, version, length, text.size(), json_chunk}) write_number(out, number);
    out << text;
    for (const std::size_t number : {bytes.size(), binary_chunk}) write_number(out, number);
    out << bytes;
  });
  return {"model.glb"};
}

}  // namespace pliant
