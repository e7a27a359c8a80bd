#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

#include "base/disjoint_sets.hpp"
#include "geometry/mesh_edges.hpp"
#include "geometry/mesh_io.hpp"

namespace pliant {

namespace {

std::string text_of(const Vector3& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g)", p.x(), p.y(), p.z());
  return text;
}

std::string counted(int count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

/// Counts edges that satisfy `is_wrong` and complains about them with the place of the first.
int count_edges(const TriangleMesh& mesh, const std::vector<EdgeUse>& uses,
                bool (*is_wrong)(std::span<const EdgeUse> edge), const char* one, const char* many,
                MeshReport& report) {
  int count = 0;
  std::string first;
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (is_wrong(edge) && count++ == 0)
      first = "vertices " + std::to_string(edge[0].low) + " and " + std::to_string(edge[0].high) + " of triangle " +
              std::to_string(edge.back().triangle) + " at " + text_of(mesh.vertices[std::size_t(edge[0].low)]);
  });
  if (count > 0) report.complaints.push_back(counted(count, one, many) + ", first between " + first);
  return count;
}

void examine_vertices(const TriangleMesh& mesh, MeshReport& report) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& triangle : mesh.triangles)
    for (const int v : triangle) used[v] = true;
  int first_bad = -1;
  for (int v = 0; v < int(mesh.vertices.size()); ++v) {
    if (!used[v]) ++report.unused_vertices;
    if (!mesh.vertices[v].allFinite() && report.non_finite_vertices++ == 0) first_bad = v;
    if (mesh.vertices[v].allFinite()) report.box.extend(mesh.vertices[v]);
  }
  if (report.non_finite_vertices > 0)
    report.complaints.push_back(counted(report.non_finite_vertices, "vertex is", "vertices are") +
                                " not finite, first vertex " + std::to_string(first_bad));
}

void examine_triangles(const TriangleMesh& mesh, MeshReport& report) {
  int first = -1;
  // Thinner than a part in 10^12 of the mesh's own size: an edge or a point, not a triangle.
  const double smallest_area = 1e-12 * report.box.extent().squaredNorm();
  for (int t = 0; t < int(mesh.triangles.size()); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vector3 cross = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    if (0.5 * cross.norm() > smallest_area) continue;
    if (report.degenerate_triangles++ == 0) first = t;
  }
  if (report.degenerate_triangles > 0)
    report.complaints.push_back(counted(report.degenerate_triangles, "triangle has", "triangles have") +
                                " no area, first triangle " + std::to_string(first) + " at " +
                                text_of(mesh.vertices[mesh.triangles[first][0]]));
}

int count_components(const TriangleMesh& mesh) {
  DisjointSets components(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) components.join(a, b), components.join(a, c);
  std::vector<bool> is_root(mesh.vertices.size(), false);
  for (const auto& triangle : mesh.triangles) is_root[components.root(triangle[0])] = true;
  return int(std::ranges::count(is_root, true));
}

void examine_edges(const TriangleMesh& mesh, MeshReport& report) {
  const std::vector<EdgeUse> uses = edge_uses(mesh);
  report.boundary_edges = count_edges(
      mesh, uses, [](std::span<const EdgeUse> edge) { return edge.size() == 1; },
      "edge belongs to one triangle only: the surface has a hole",
      "edges belong to one triangle only: the surface has holes", report);
  report.non_manifold_edges = count_edges(
      mesh, uses, [](std::span<const EdgeUse> edge) { return edge.size() > 2; },
      "edge is shared by more than two triangles", "edges are shared by more than two triangles", report);
  report.misoriented_edges = count_edges(
      mesh, uses,
      [](std::span<const EdgeUse> edge) { return edge.size() == 2 && edge[0].is_forward == edge[1].is_forward; },
      "edge joins triangles of opposite orientation", "edges join triangles of opposite orientation", report);
}

const char* cure_of(const MeshReport& report, bool closed) {
  if (report.has_shared_volume)
    return "unite the parts, in Python: import trimesh; trimesh.boolean.union(trimesh.load(\"OLD.ply\").split())"
           ".export(\"NEW.ply\") (pip install trimesh manifold3d scipy networkx); a part that is a cavity: "
           ".difference in the place of .union";
  return closed ? "check which part of the object the file holds"
                : "close holes and make orientations agree in a mesh editor";
}

/// "of 0.1 x 0.1 x 0.1 m about (0, 0.3, 0)"
std::string text_of(const Shell& shell) {
  char text[96];
  const Vector3 extent = shell.box.extent();
  std::snprintf(text, sizeof text, "of %.4g x %.4g x %.4g m about ", extent.x(), extent.y(), extent.z());
  return text + text_of(Vector3(0.5 * (shell.box.min + shell.box.max)));
}

/// Complains about the first two shells of a closed surface that share a volume: twice counted, it would be none.
void examine_shells(const TriangleMesh& mesh, MeshReport& report) {
  const std::vector<Shell> shells = shells_of(mesh);
  if (shells.size() < 2) return;
  const auto two = [&](const char* first, std::size_t i, const char* what, std::size_t j) {
    return first + text_of(shells[i]) + what + text_of(shells[j]);
  };
  std::vector<std::size_t> holder(shells.size(), shells.size());  // the smallest that each lies in
  const auto size = [&](std::size_t i) { return std::abs(shells[i].volume); };
  for (std::size_t i = 0; i < shells.size(); ++i)
    for (std::size_t j = 0; j < shells.size() && !report.has_shared_volume; ++j) {
      if (size(i) > size(j) || (size(i) == size(j) && i >= j)) continue;
      const bool is_inside = lies_in(mesh, shells[i], shells[j]);
      if (is_inside ? cut(mesh, shells[i], shells[j]) : share_volume(mesh, shells[i], shells[j])) {
        report.has_shared_volume = true;
        report.complaints.push_back(two("the part ", i, " cuts through the part ", j));
      } else if (is_inside && (holder[i] == shells.size() || size(j) < size(holder[i]))) {
        holder[i] = j;
      }
    }
  for (std::size_t i = 0; i < shells.size() && !report.has_shared_volume; ++i)
    if (holder[i] < shells.size() && (shells[i].volume > 0.0) == (shells[holder[i]].volume > 0.0)) {
      report.has_shared_volume = true;
      report.complaints.push_back(two("the part ", i, " lies in the part ", holder[i]) +
                                  ", and both face the same way: a cavity faces inwards");
    }
}

}  // namespace

MeshReport examine(const TriangleMesh& mesh) {
  MeshReport report;
  if (mesh.triangles.empty()) {
    report.complaints.push_back("the mesh has no triangles");
    return report;
  }
  examine_vertices(mesh, report);
  examine_triangles(mesh, report);
  examine_edges(mesh, report);
  report.components = count_components(mesh);
  report.volume = report.non_finite_vertices == 0 ? enclosed_volume(mesh) : 0.0;
  const bool closed = report.boundary_edges + report.non_manifold_edges + report.misoriented_edges == 0;
  if (closed && report.volume <= 0.0 && report.non_finite_vertices == 0)
    report.complaints.push_back(report.volume < 0.0 ? "the triangles face inwards: the enclosed volume is negative"
                                                    : "the surface encloses no volume");
  if (closed && report.non_finite_vertices == 0) examine_shells(mesh, report);
  report.cure = cure_of(report, closed);
  report.is_closed_solid =
      closed && !report.has_shared_volume && report.volume > 0.0 && report.non_finite_vertices == 0;
  return report;
}

}  // namespace pliant
