#include "geometry/stl.hpp"

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>
#include <string>
#include <tuple>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t heading_bytes = 84, facet_bytes = 50;

// Joins equal corners.
class CornerJoiner {
 public:
  explicit CornerJoiner(const fs::path& path) : path_(path) {}

  void add(const Vector3& corner, int line) {
    if (!corner.allFinite())
      throw InputError({{path_, line, 0},
                        "a corner of triangle " + std::to_string(mesh.triangles.size()) + " is not finite",
                        "numbers of metres",
                        "repair the mesh where it was exported"});
    const Vector3 key = corner + Vector3::Zero();  // -0 becomes 0
    const auto [found, is_new] = index_.try_emplace({key.x(), key.y(), key.z()}, int(mesh.vertices.size()));
    if (is_new) mesh.vertices.push_back(key);
    open_[count_++] = found->second;
    if (count_ == 3) {
      mesh.triangles.push_back(open_);
      count_ = 0;
    }
  }

  bool inside_triangle() const { return count_ != 0; }

  TriangleMesh mesh;

 private:
  const fs::path& path_;
  std::map<std::tuple<double, double, double>, int> index_;
  std::array<int, 3> open_{};
  std::size_t count_ = 0;
};

std::size_t promised_triangles(const std::string& content) {
  std::uint32_t count = 0;
  if (content.size() >= heading_bytes) std::memcpy(&count, content.data() + 80, 4);
  return count;
}

TriangleMesh read_binary(const std::string& content, const fs::path& path) {
  CornerJoiner joiner(path);
  for (std::size_t i = 0; i < promised_triangles(content); ++i)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      float xyz[3];
      std::memcpy(xyz, content.data() + heading_bytes + i * facet_bytes + 12 + corner * 12, 12);
      joiner.add({xyz[0], xyz[1], xyz[2]}, 0);
    }
  return std::move(joiner.mesh);
}

TriangleMesh read_text(const std::string& content, const fs::path& path) {
  CornerJoiner joiner(path);
  std::istringstream lines(content);
  std::string line;
  int number = 0;
  bool ended = false;
  while (std::getline(lines, line)) {
    ++number;
    std::istringstream words(line);
    std::string keyword, x, y, z;
    words >> keyword >> x >> y >> z;
    if (keyword == "endsolid") ended = true;
    if (keyword != "vertex") continue;
    char* ends[3];
    const Vector3 corner(std::strtod(x.c_str(), &ends[0]), std::strtod(y.c_str(), &ends[1]),
                         std::strtod(z.c_str(), &ends[2]));
    if (x.empty() || y.empty() || z.empty() || *ends[0] || *ends[1] || *ends[2])
      throw InputError({{path, number, 1}, "\"" + line.substr(0, 60) + "\"", "vertex and three numbers", ""});
    joiner.add(corner, number);
  }
  if (!ended || joiner.inside_triangle())
    throw InputError({{path, number, 0},
                      "the file ends without \"endsolid\"",
                      "a whole text STL",
                      "the file was cut short; write or copy it again"});
  return std::move(joiner.mesh);
}

}  // namespace

TriangleMesh read_stl(const fs::path& path) {
  const std::string content = read_file(path);
  if (content.empty()) throw InputError({{path}, "the file is empty", "an STL mesh", ""});
  const std::size_t promised = promised_triangles(content);
  // A binary heading may begin with "solid" too: its size tells.
  const bool is_binary = content.size() >= heading_bytes && content.size() == heading_bytes + promised * facet_bytes;
  if (!is_binary && !content.starts_with("solid"))
    throw InputError(
        {{path},
         std::to_string(content.size()) + " bytes, and the heading promises " + std::to_string(promised) + " triangles",
         "a text STL (\"solid …\") or " + std::to_string(heading_bytes + promised * facet_bytes) + " bytes",
         "the file was cut short or is no STL"});
  TriangleMesh mesh = is_binary ? read_binary(content, path) : read_text(content, path);
  if (mesh.triangles.empty()) throw InputError({{path}, "the file has no triangles", "a triangle mesh", ""});
  return mesh;
}

}  // namespace pliant
