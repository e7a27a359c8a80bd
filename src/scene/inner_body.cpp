#include "scene/inner_body.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "geometry/mesh_io.hpp"
#include "geometry/solid_surface.hpp"
#include "geometry/surface_distance.hpp"
#include "scene/region.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr const char *sliding = "sliding", *glued = "glued";  // contact

std::string inner_name(std::size_t number) { return fmt::format("inner_{}.ply", number); }

/// Part of a body's surface that lies within a solid, [0, 1]. What lies as near the solid's own surface as a coarse
/// mesh of a cavity may be off says nothing.
double share_within(const TriangleMesh& body, const TriangleMesh& solid) {
  constexpr std::size_t most_points = 128;
  constexpr double depth = 1e-3, doubt = 0.01;  // under the body's surface, and to the solid's, of their sizes
  const double below = depth * bounding_box(body).extent().maxCoeff();
  const std::size_t count = std::min(most_points, body.triangles.size());
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [a, b, c] = body.triangles[i * body.triangles.size() / count];
    const Vector3 &p = body.vertices[std::size_t(a)], &q = body.vertices[std::size_t(b)],
                  &r = body.vertices[std::size_t(c)];
    points.push_back((p + q + r) / 3.0 - below * (q - p).cross(r - p).normalized());
  }
  const std::vector<double> distances = distances_to_surface(solid, points);
  const double near = doubt * bounding_box(solid).extent().maxCoeff();
  int within = 0, counted = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (distances[i] < near) continue;
    ++counted;
    within += winding_number(solid, points[i]) > 0.5;
  }
  return counted > 0 ? double(within) / double(counted) : 0.0;
}

bool touches(const TriangleMesh& body, const TriangleMesh& object) {
  constexpr double near = 0.02;  // of the object's size
  const std::vector<double> distances = distances_to_surface(body, object.vertices);
  return std::ranges::min(distances) <= near * bounding_box(object).extent().maxCoeff();
}

void append_reversed(TriangleMesh& surface, const TriangleMesh& body) {
  const int first = int(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(), body.vertices.begin(), body.vertices.end());
  for (const auto& [a, b, c] : body.triangles) surface.triangles.push_back({first + a, first + c, first + b});
}

}  // namespace

InnerBody read_inner(TomlTable& block, const NamedFiles& files) {
  InnerBody body;
  if (read_choice(block, "contact", {sliding, glued}) == glued) body.contact = InnerBody::Contact::Glued;
  const auto file = read_path(block, "surface", files);
  if (!file) return body;
  body.file = *file;
  read_file_of(block, "surface", *file, [&](const fs::path& path) {
    body.surface = read_surface(path);
    const MeshReport report = examine(body.surface);
    if (report.is_closed_solid) return;
    block.context().reject(block.key_of("surface"), report.complaints.front(),
                           "a closed surface of the rigid body, facing outwards", report.cure);
  });
  return body;
}

void cut_out_inner_bodies(TomlContext& context, Scene& scene) {
  constexpr double slack = 0.02;  // of the body: what rounding and coarse meshes may put on the wrong side
  if (!scene.object.surface || scene.object.surface->triangles.empty()) return;
  TriangleMesh& object = *scene.object.surface;
  for (std::size_t i = 0; i < scene.inner.size(); ++i) {
    InnerBody& body = scene.inner[i];
    const std::string key = fmt::format("inner[{}]", i);
    if (!context.is_sound(key) || body.surface.triangles.empty()) continue;
    const double share = share_within(body.surface, object);
    if (share > 1.0 - slack && scene.object.volume) {
      context.reject(key, "a rigid body in the middle of tetrahedra", "a volume mesh with room for it",
                     "cut the body out of the volume mesh, or name a `surface` in its place");
    } else if (share > 1.0 - slack) {
      append_reversed(object, body.surface);
      body.is_cut_out = true;
    } else if (share > slack) {
      context.reject(
          key, fmt::format("a rigid body with {:.0f} % of its surface in the object", 100.0 * share),
          "one inside the object, or one that touches it from outside",
          "cut the body out of the object's surface in a mesh editor; is it in metres, in world coordinates?");
    } else if (!touches(body.surface, object)) {
      context.reject(key, "a rigid body that touches the object nowhere", "one inside the object or right under it",
                     "give it in metres, in world coordinates, where the object is at rest");
    }
  }
}

TriangleMesh scanned_surface(TriangleMesh surface, const std::vector<InnerBody>& inner) {
  for (const InnerBody& body : inner) {
    if (!body.is_cut_out) continue;
    surface.vertices.resize(surface.vertices.size() - body.surface.vertices.size());
    surface.triangles.resize(surface.triangles.size() - body.surface.triangles.size());
  }
  return surface;
}

void write_inner_blocks(std::ostream& out, const Scene& scene) {
  for (std::size_t i = 0; i < scene.inner.size(); ++i)
    out << "[[inner]]\nsurface = " << toml_text(inner_name(i)) << "   # rigid, where it is at rest\ncontact = "
        << toml_text(scene.inner[i].contact == InnerBody::Contact::Glued ? glued : sliding) << "\n\n";
}

void write_inner_files(const fs::path& folder, const Scene& scene) {
  for (std::size_t i = 0; i < scene.inner.size(); ++i) write_mesh(folder / inner_name(i), scene.inner[i].surface);
}

}  // namespace pliant
