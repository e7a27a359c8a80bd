#include "geometry/obj.hpp"

// The library's own binary keeps single precision; compiled here it keeps what the file says.
#define TINYOBJLOADER_USE_DOUBLE
#define TINYOBJLOADER_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#include <tiny_obj_loader.h>
#pragma GCC diagnostic pop

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

bool holds_three_numbers(const std::string& text) {
  const char* at = text.c_str();
  for (int i = 0; i < 3; ++i) {
    char* end = nullptr;
    if (!std::isfinite(std::strtod(at, &end)) || end == at) return false;
    at = end;
  }
  return true;
}

// tinyobjloader reads what is not a number as 0; such a vertex must not pass.
void require_finite_vertices(const std::string& content, const fs::path& path) {
  std::istringstream lines(content);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number)
    if ((line.starts_with("v ") || line.starts_with("v\t")) && !holds_three_numbers(line.substr(2)))
      throw InputError({{path, number, 1},
                        "a vertex \"" + line.substr(0, 60) + "\"",
                        "three finite numbers",
                        "repair the mesh where it was exported"});
}

}  // namespace

TriangleMesh read_obj(const fs::path& path) {
  const std::string content = read_file(path);
  if (content.empty()) throw InputError({{path}, "the file is empty", "an OBJ mesh", ""});
  require_finite_vertices(content, path);
  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warnings, errors;
  std::istringstream stream(content);
  if (!tinyobj::LoadObj(&attributes, &shapes, &materials, &warnings, &errors, &stream, nullptr, true) ||
      !errors.empty())
    throw InputError(
        {{path}, "the file cannot be read as OBJ: " + errors, "", "repair the mesh where it was exported"});

  TriangleMesh mesh;
  for (std::size_t i = 0; i + 2 < attributes.vertices.size(); i += 3)
    mesh.vertices.emplace_back(attributes.vertices[i], attributes.vertices[i + 1], attributes.vertices[i + 2]);
  for (const tinyobj::shape_t& shape : shapes) {
    const auto& corners = shape.mesh.indices;
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      for (std::size_t k = 0; k < 3; ++k)
        require_vertex(corners[i + k].vertex_index, mesh.vertices.size(), "triangle " + std::to_string(i / 3), {path});
      mesh.triangles.push_back({corners[i].vertex_index, corners[i + 1].vertex_index, corners[i + 2].vertex_index});
    }
  }
  if (mesh.triangles.empty())
    throw InputError(
        {{path}, "the file has no faces", "a triangle mesh", "check that this is the OBJ file of the scan"});
  return mesh;
}

}  // namespace pliant
