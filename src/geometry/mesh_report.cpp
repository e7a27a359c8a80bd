#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <map>

#include "base/disjoint_sets.hpp"
#include "geometry/mesh_io.hpp"

namespace pliant {

namespace {

struct EdgeUse {
  int forward = 0, backward = 0;  // from the smaller vertex index to the larger, and against
  int triangle = 0;               // the last one that uses it
};

using Edges = std::map<std::pair<int, int>, EdgeUse>;

std::string text_of(const Vector3& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g)", p.x(), p.y(), p.z());
  return text;
}

std::string counted(int count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

Edges edges_of(const TriangleMesh& mesh) {
  Edges edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      if (a == b) continue;
      EdgeUse& use = edges[std::minmax(a, b)];
      ++(a < b ? use.forward : use.backward);
      use.triangle = int(t);
    }
  return edges;
}

// Counts edges that satisfy `is_wrong` and complains about them with the place of the first.
int count_edges(const TriangleMesh& mesh, const Edges& edges, bool (*is_wrong)(const EdgeUse&), const char* one,
                const char* many, MeshReport& report) {
  int count = 0;
  std::string first;
  for (const auto& [ends, use] : edges)
    if (is_wrong(use) && count++ == 0)
      first = "vertices " + std::to_string(ends.first) + " and " + std::to_string(ends.second) + " of triangle " +
              std::to_string(use.triangle) + " at " + text_of(mesh.vertices[ends.first]);
  if (count > 0) report.complaints.push_back(counted(count, one, many) + ", first between " + first);
  return count;
}

void examine_vertices(const TriangleMesh& mesh, MeshReport& report) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& triangle : mesh.triangles)
    for (const int v : triangle) used[v] = true;
  int first_unused = -1, first_bad = -1;
  for (int v = 0; v < int(mesh.vertices.size()); ++v) {
    if (!used[v] && report.unused_vertices++ == 0) first_unused = v;
    if (!mesh.vertices[v].allFinite() && report.non_finite_vertices++ == 0) first_bad = v;
    if (mesh.vertices[v].allFinite()) report.box.extend(mesh.vertices[v]);
  }
  if (report.non_finite_vertices > 0)
    report.complaints.push_back(counted(report.non_finite_vertices, "vertex is", "vertices are") +
                                " not finite, first vertex " + std::to_string(first_bad));
  if (report.unused_vertices > 0)
    report.complaints.push_back(counted(report.unused_vertices, "vertex is", "vertices are") +
                                " in no triangle, first vertex " + std::to_string(first_unused) + " at " +
                                text_of(mesh.vertices[first_unused]));
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
  const Edges edges = edges_of(mesh);
  report.boundary_edges = count_edges(
      mesh, edges, [](const EdgeUse& use) { return use.forward + use.backward == 1; },
      "edge belongs to one triangle only: the surface has a hole",
      "edges belong to one triangle only: the surface has holes", report);
  report.non_manifold_edges = count_edges(
      mesh, edges, [](const EdgeUse& use) { return use.forward + use.backward > 2; },
      "edge is shared by more than two triangles", "edges are shared by more than two triangles", report);
  report.misoriented_edges = count_edges(
      mesh, edges, [](const EdgeUse& use) { return use.forward + use.backward == 2 && use.forward != 1; },
      "edge joins triangles of opposite orientation", "edges join triangles of opposite orientation", report);
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
  report.is_closed_solid = closed && report.volume > 0.0 && report.non_finite_vertices == 0;
  return report;
}

}  // namespace pliant
