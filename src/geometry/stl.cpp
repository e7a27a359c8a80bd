#include "geometry/stl.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>

#include "base/files.hpp"
#include "geometry/mesh_io.hpp"

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

std::size_t promised_facets(std::string_view content) {
  std::uint32_t count = 0;
  if (content.size() >= heading_bytes) std::memcpy(&count, content.data() + 80, 4);
  return count;
}

TriangleMesh read_facets(std::string_view content, std::size_t count, const fs::path& path) {
  CornerJoiner joiner(path);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      float xyz[3];
      std::memcpy(xyz, content.data() + heading_bytes + i * facet_bytes + 12 + corner * 12, 12);
      joiner.add({xyz[0], xyz[1], xyz[2]}, 0);
    }
  return std::move(joiner.mesh);
}

/// Whether as many facets as the heading promises, or as the file holds, are the surface: those that close it.
/// Nothing where neither does.
std::optional<TriangleMesh> closed_of(std::string_view content, std::size_t promised, std::size_t held,
                                      const fs::path& path) {
  for (const std::size_t count : {promised, held}) try {
      TriangleMesh mesh = read_facets(content, count, path);
      if (!mesh.triangles.empty() && examine(mesh).boundary_edges == 0) return mesh;
    } catch (const InputError&) {  // what is behind the last facet is none
    }
  return std::nullopt;
}

/// Programs that write while they make facets leave the count at zero or at its greatest; others write their own words
/// behind the last facet.
TriangleMesh read_binary(std::string_view content, const fs::path& path) {
  const std::size_t promised = promised_facets(content);
  if (content.size() < heading_bytes)
    throw InputError({{path},
                      std::to_string(content.size()) + " bytes that are no text",
                      "an STL mesh of " + std::to_string(heading_bytes) + " bytes at least",
                      "the file was cut short or is no STL"});
  const std::size_t behind = content.size() - heading_bytes, held = behind / facet_bytes;
  const bool is_unknown = promised == 0 || promised == std::numeric_limits<std::uint32_t>::max();
  if (is_unknown && held > 0 && behind % facet_bytes == 0) return read_facets(content, held, path);
  if (promised > held)
    throw InputError(
        {{path},
         std::to_string(content.size()) + " bytes, which hold " + std::to_string(held) +
             " triangles, and the heading promises " + std::to_string(promised),
         "a text STL (\"solid …\") or " + std::to_string(heading_bytes + promised * facet_bytes) + " bytes",
         "the file was cut short or is no STL"});
  if (behind % facet_bytes != 0 || promised == held) return read_facets(content, promised, path);
  if (auto mesh = closed_of(content, promised, held, path)) return std::move(*mesh);
  throw InputError(
      {{path},
       "the heading promises " + std::to_string(promised) + " triangles, and the file holds " + std::to_string(held),
       "as many as it promises; neither number closes the surface",
       "write the file again, by meshio for example: meshio convert OLD.stl NEW.ply (pip install meshio)"});
}

std::string in_small_letters(std::string_view text) {
  std::string small(text);
  std::ranges::transform(small, small.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return small;
}

/// A binary heading may begin with "solid" too: text has "facet" or "endsolid" behind the name, and nothing but text
/// before that.
bool is_text(std::string_view content) {
  constexpr std::size_t most_heading = 2000;
  const std::string heading = in_small_letters(content.substr(0, most_heading));
  const std::size_t begin = heading.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos || heading.compare(begin, 5, "solid") != 0) return false;
  const std::size_t line = heading.find_first_of("\r\n", begin);
  const std::size_t next = line == std::string::npos ? line : heading.find_first_not_of(" \t\r\n", line);
  if (heading.find('\0') != std::string::npos) return false;
  return next == std::string::npos || heading.compare(next, 5, "facet") == 0 || heading.compare(next, 3, "end") == 0 ||
         heading.compare(next, 5, "solid") == 0;
}

TriangleMesh read_text(std::string_view content, const fs::path& path) {
  CornerJoiner joiner(path);
  int number = 0;
  bool ended = false;  // the last solid
  const auto fail = [&](const std::string& found, const char* expected, const char* advice) {
    throw InputError({{path, number, 1}, found, expected, advice});
  };
  for (std::size_t begin = 0, end = 0; begin < content.size(); begin = end + 1) {
    end = std::min(content.find('\n', begin), content.size());
    ++number;
    const std::string line(content.substr(begin, end - begin));
    std::istringstream words(line);
    std::string keyword, x, y, z;
    words >> keyword >> x >> y >> z;
    keyword = in_small_letters(keyword);
    if (keyword == "solid") ended = false;
    if (keyword == "endsolid" || (keyword == "end" && in_small_letters(x) == "solid")) ended = true;
    if ((keyword == "endfacet" || ended) && joiner.inside_triangle())
      fail("a facet without three corners", "three lines \"vertex\"", "write the file again");
    if (keyword != "vertex") continue;
    char* ends[3];
    const Vector3 corner(std::strtod(x.c_str(), &ends[0]), std::strtod(y.c_str(), &ends[1]),
                         std::strtod(z.c_str(), &ends[2]));
    if (x.empty() || y.empty() || z.empty() || *ends[0] || *ends[1] || *ends[2])
      fail("\"" + line.substr(0, 60) + "\"", "vertex and three numbers", "");
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
  std::string_view text = content;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // a mark of UTF-8
  // A binary file may look like text: its size tells.
  const std::size_t promised = promised_facets(content);
  const bool is_whole_binary = promised > 0 && content.size() == heading_bytes + promised * facet_bytes;
  TriangleMesh mesh = !is_whole_binary && is_text(text) ? read_text(text, path) : read_binary(content, path);
  if (mesh.triangles.empty()) throw InputError({{path}, "the file has no triangles", "a triangle mesh", ""});
  return mesh;
}

}  // namespace pliant
