#include "geometry/mesh_io.hpp"

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "base/files.hpp"
#include "geometry/obj.hpp"
#include "geometry/ply.hpp"
#include "geometry/stl.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

static_assert(std::endian::native == std::endian::little, "binary meshes are written as they lie in memory");

[[noreturn]] void fail_ending(const fs::path& path) {
  throw InputError({{path},
                    "a mesh file with the ending \"" + path.extension().string() + "\"",
                    ".ply, .obj or .stl",
                    "convert the mesh to one of these"});
}

const PlyProperty& face_indices(const PlyFile& ply, const fs::path& path) {
  const PlyElement* faces = ply.element("face");
  if (!faces || faces->count == 0)
    throw InputError({{path},
                      "the file has no faces: it is a point cloud",
                      "a triangle mesh",
                      "reconstruct a closed surface from the points first"});
  for (const char* name : {"vertex_indices", "vertex_index"})
    if (const PlyProperty* indices = faces->property(name); indices && indices->is_list) return *indices;
  throw InputError({{path}, "the faces have no list \"vertex_indices\"", "", "write the mesh with another program"});
}

TriangleMesh read_ply_mesh(const fs::path& path) {
  const PlyFile ply = read_ply(path);
  TriangleMesh mesh;
  mesh.vertices = ply_points(ply, path);
  const PlyProperty& indices = face_indices(ply, path);
  for (std::size_t face = 0; face + 1 < indices.offsets.size(); ++face) {
    const std::size_t begin = indices.offsets[face], end = indices.offsets[face + 1];
    for (std::size_t i = begin; i < end; ++i)
      require_vertex(indices.values[i], mesh.vertices.size(), "face " + std::to_string(face), {path});
    if (end - begin < 3)
      throw InputError({{path},
                        "face " + std::to_string(face) + " has " + std::to_string(end - begin) + " corners",
                        "three at least",
                        ""});
    for (std::size_t i = begin + 2; i < end; ++i)
      mesh.triangles.push_back({int(indices.values[begin]), int(indices.values[i - 1]), int(indices.values[i])});
  }
  return mesh;
}

template <class T>
void write_raw(std::ostream& stream, const T& value) {
  stream.write(reinterpret_cast<const char*>(&value), sizeof value);
}

void write_ply_mesh(std::ostream& stream, const TriangleMesh& mesh) {
  stream << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.size()
         << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << mesh.triangles.size()
         << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vector3& vertex : mesh.vertices)
    for (int axis = 0; axis < 3; ++axis) write_raw(stream, vertex[axis]);
  for (const auto& triangle : mesh.triangles) {
    write_raw(stream, std::uint8_t(3));
    for (const int v : triangle) write_raw(stream, std::int32_t(v));
  }
}

void write_obj_mesh(std::ostream& stream, const TriangleMesh& mesh) {
  char line[128];
  for (const Vector3& v : mesh.vertices) {
    std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", v.x(), v.y(), v.z());
    stream << line;
  }
  for (const auto& [a, b, c] : mesh.triangles) stream << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
}

void write_stl_mesh(std::ostream& stream, const TriangleMesh& mesh) {
  char heading[80] = "binary STL, metres";
  stream.write(heading, sizeof heading);
  write_raw(stream, std::uint32_t(mesh.triangles.size()));
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    for (const Vector3& v : {Vector3((q - p).cross(r - p).normalized()), p, q, r})
      for (int axis = 0; axis < 3; ++axis) write_raw(stream, float(v[axis]));
    write_raw(stream, std::uint16_t(0));
  }
}

}  // namespace

void require_vertex(double index, std::size_t vertex_count, const std::string& owner, const Place& place) {
  if (index >= 0 && index < double(vertex_count) && index == std::floor(index)) return;
  char text[64];
  std::snprintf(text, sizeof text, "%.10g", index);
  throw InputError({place, owner + " names vertex " + text,
                    vertex_count == 0 ? "some vertices" : "a whole number of 0 to " + std::to_string(vertex_count - 1),
                    "the file is damaged or was written by a faulty program"});
}

TriangleMesh read_mesh(const fs::path& path) {
  const std::string ending = ending_of(path);
  if (ending == ".ply") return read_ply_mesh(path);
  if (ending == ".obj") return read_obj(path);
  if (ending == ".stl") return read_stl(path);
  fail_ending(path);
}

void write_mesh(const fs::path& path, const TriangleMesh& mesh) {
  const std::string ending = ending_of(path);
  auto* write = ending == ".ply" ? write_ply_mesh : ending == ".obj" ? write_obj_mesh : write_stl_mesh;
  if (ending != ".ply" && ending != ".obj" && ending != ".stl") fail_ending(path);
  write_file(path, [&](std::ostream& stream) { write(stream, mesh); });
}

}  // namespace pliant
