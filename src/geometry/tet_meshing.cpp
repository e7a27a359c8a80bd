#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "base/error.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/tet_mesh.hpp"

#ifdef PLIANT_WITH_CGAL
#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>
#include <CGAL/Random.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/make_mesh_3.h>
#endif

namespace pliant {

namespace {

constexpr double most_tets = 2e6;

[[noreturn]] void refuse(const std::string& found, const std::string& expected, const std::string& advice) {
  throw InputError({{}, found, expected, advice});
}

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

void check_options(const TetMeshOptions& options) {
  if (!(options.cell_size > 0.0) || !std::isfinite(options.cell_size))
    refuse("tetrahedra of " + text_of(options.cell_size) + " m", "a positive edge length", "");
  if (!(options.feature_angle_deg > 0.0 && options.feature_angle_deg <= 180.0))
    refuse("a feature angle of " + text_of(options.feature_angle_deg) + " degrees", "more than 0, at most 180", "");
}

void check_surface(const TriangleMesh& surface) {
  const MeshReport report = examine(surface);
  if (report.is_closed_solid && report.degenerate_triangles == 0) return;
  std::vector<Problem> problems;
  for (const std::string& complaint : report.complaints)
    problems.push_back({{}, complaint, "a closed, outward oriented surface without flat triangles", "repair the scan"});
  throw InputError(problems);
}

void check_size(const TriangleMesh& surface, double cell_size) {
  const double longest = bounding_box(surface).extent().maxCoeff();
  if (cell_size > longest)
    refuse("tetrahedra of " + text_of(cell_size) + " m in an object of " + text_of(longest) + " m", "smaller ones than the object",
           "choose smaller cells");
  const double regular = std::pow(cell_size, 3) / (6.0 * std::sqrt(2.0));
  const double count = enclosed_volume(surface) / regular;
  if (count > most_tets)
    refuse("tetrahedra of " + text_of(cell_size) + " m would be about " + text_of(count), "at most " + text_of(most_tets),
           "choose larger cells");
}

/// Finds where elements have to keep an edge of the scan. Edges at which the surface folds back onto itself are faults of a
/// scan, edges that end in the middle of the surface separate nothing, and parts much smaller than an element need no
/// edges of their own.
class SharpEdges {
 public:
  SharpEdges(const TriangleMesh& surface, double angle_deg, double cell_size) : surface_(surface), angle_deg_(angle_deg) {
    mark();
    do drop_loose_ends();
    while (drop_small_patches(0.25 * cell_size * cell_size));
  }

  /// Lines from corner to corner, or closed: first and last vertex are the same.
  std::vector<std::vector<int>> lines() const {
    std::map<int, std::vector<int>> neighbours;
    for (const auto& [ends, edge] : edges_)
      if (edge.is_sharp) {
        neighbours[ends.first].push_back(ends.second);
        neighbours[ends.second].push_back(ends.first);
      }
    std::set<std::pair<int, int>> walked;
    std::vector<std::vector<int>> all;
    const auto walk = [&](int from, int to) {
      if (!walked.insert(std::minmax(from, to)).second) return;
      all.push_back({from, to});
      while (to != all.back().front() && !is_corner(to, neighbours.at(to))) {
        const auto& next = neighbours.at(to);
        to = next[0] == all.back().end()[-2] ? next[1] : next[0];
        walked.insert(std::minmax(all.back().back(), to));
        all.back().push_back(to);
      }
    };
    for (const auto& [vertex, others] : neighbours)
      if (is_corner(vertex, others))
        for (const int other : others) walk(vertex, other);
    for (const auto& [vertex, others] : neighbours) walk(vertex, others.front());  // what is left are closed lines
    return all;
  }

 private:
  struct Edge {
    std::array<int, 2> triangles = {-1, -1};
    bool is_sharp = false;
  };
  static constexpr double fold_deg = 150.0;

  Vector3 area_vector(int t) const {
    const auto& [a, b, c] = surface_.triangles[std::size_t(t)];
    const auto& v = surface_.vertices;
    return 0.5 * (v[std::size_t(b)] - v[std::size_t(a)]).cross(v[std::size_t(c)] - v[std::size_t(a)]);
  }

  static double angle_deg(const Vector3& a, const Vector3& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
  }

  void mark() {
    for (int t = 0; t < int(surface_.triangles.size()); ++t)
      for (int k = 0; k < 3; ++k) {
        const auto& triangle = surface_.triangles[std::size_t(t)];
        Edge& edge = edges_[std::minmax(triangle[k], triangle[(k + 1) % 3])];
        edge.triangles[edge.triangles[0] >= 0] = t;
      }
    for (auto& [ends, edge] : edges_) {
      const double angle = angle_deg(area_vector(edge.triangles[0]), area_vector(edge.triangles[1]));
      edge.is_sharp = angle > angle_deg_ && angle < fold_deg;
    }
  }

  void drop_loose_ends() {
    std::vector<int> degree(surface_.vertices.size(), 0);
    for (const auto& [ends, edge] : edges_)
      if (edge.is_sharp) ++degree[std::size_t(ends.first)], ++degree[std::size_t(ends.second)];
    for (bool changed = true; changed;) {
      changed = false;
      for (auto& [ends, edge] : edges_) {
        if (!edge.is_sharp || (degree[std::size_t(ends.first)] > 1 && degree[std::size_t(ends.second)] > 1)) continue;
        --degree[std::size_t(ends.first)], --degree[std::size_t(ends.second)];
        edge.is_sharp = false;
        changed = true;
      }
    }
  }

  /// Patches are what sharp edges bound. Returns true where something was dropped.
  bool drop_small_patches(double least_area) {
    std::vector<int> parent(surface_.triangles.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](int t) {
      while (parent[std::size_t(t)] != t) t = parent[std::size_t(t)] = parent[std::size_t(parent[std::size_t(t)])];
      return std::size_t(t);
    };
    for (const auto& [ends, edge] : edges_)
      if (!edge.is_sharp) parent[root(edge.triangles[0])] = int(root(edge.triangles[1]));
    std::vector<double> area(parent.size(), 0.0);
    for (int t = 0; t < int(parent.size()); ++t) area[root(t)] += area_vector(t).norm();
    bool dropped = false;
    for (auto& [ends, edge] : edges_) {
      if (!edge.is_sharp || std::min(area[root(edge.triangles[0])], area[root(edge.triangles[1])]) >= least_area) continue;
      edge.is_sharp = false;
      dropped = true;
    }
    return dropped;
  }

  /// Where lines meet or one turns as sharply as surfaces have to.
  bool is_corner(int vertex, const std::vector<int>& others) const {
    if (others.size() != 2) return true;
    const auto at = [&](int v) -> const Vector3& { return surface_.vertices[std::size_t(v)]; };
    return angle_deg(at(vertex) - at(others[0]), at(others[1]) - at(vertex)) > angle_deg_;
  }

  const TriangleMesh& surface_;
  double angle_deg_;
  std::map<std::pair<int, int>, Edge> edges_;
};

}  // namespace

double default_tet_size(const TriangleMesh& surface, double cells_along_longest) {
  return bounding_box(surface).extent().maxCoeff() / cells_along_longest;
}

#ifdef PLIANT_WITH_CGAL

namespace {

namespace parameters = CGAL::parameters;
namespace processing = CGAL::Polygon_mesh_processing;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Polyhedron = CGAL::Mesh_polyhedron_3<Kernel>::type;
using ScanDomain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel>;
using GapDomain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Primitive = CGAL::AABB_face_graph_triangle_primitive<Polyhedron>;
using ScanTree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 cgal(const Vector3& p) { return {p.x(), p.y(), p.z()}; }

Polyhedron polyhedron_of(const TriangleMesh& surface) {
  if (!processing::is_polygon_soup_a_polygon_mesh(surface.triangles))
    refuse("parts of the surface meet in a single vertex", "a surface that looks like a disc around each vertex", "repair the scan");
  std::vector<Kernel::Point_3> points;  // of the vertices that a triangle uses
  std::vector<int> point_of_vertex(surface.vertices.size(), -1);
  auto triangles = surface.triangles;
  for (auto& triangle : triangles)
    for (int& vertex : triangle) {
      int& point = point_of_vertex[std::size_t(vertex)];
      if (point < 0) {
        point = int(points.size());
        points.push_back(cgal(surface.vertices[std::size_t(vertex)]));
      }
      vertex = point;
    }
  Polyhedron polyhedron;
  processing::polygon_soup_to_polygon_mesh(points, triangles, polyhedron);
  std::size_t number = 0;  // CGAL orders what it visits by these, and without them by addresses
  for (auto v = polyhedron.vertices_begin(); v != polyhedron.vertices_end(); ++v) v->set_time_stamp(number++);
  for (auto f = polyhedron.facets_begin(); f != polyhedron.facets_end(); ++f) f->set_time_stamp(number++);
  for (auto h = polyhedron.halfedges_begin(); h != polyhedron.halfedges_end(); ++h) h->set_time_stamp(number++);
  return polyhedron;
}

template <class Domain>
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<typename CGAL::Mesh_triangulation_3<Domain>::type>;

/// Refines, removes slivers, and takes over the cells inside.
template <class Domain, class Criteria>
TetMesh mesh_of(const Domain& domain, const Criteria& criteria) {
  CGAL::Mesh_error_code error = CGAL::CGAL_MESH_3_NO_ERROR;
  const std::size_t most_vertices = std::size_t(most_tets / 5.0);
  const auto complex = CGAL::make_mesh_3<Complex<Domain>>(
      domain, criteria, parameters::perturb(), parameters::no_exude(),
      parameters::mesh_3_options(parameters::maximal_number_of_vertices = most_vertices, parameters::pointer_to_error_code = &error));
  if (error == CGAL::CGAL_MESH_3_MAXIMAL_NUMBER_OF_VERTICES_REACHED)
    refuse("more than " + text_of(most_tets) + " tetrahedra", "fewer", "choose larger cells");

  std::map<typename Complex<Domain>::Vertex_handle, int> number;
  std::vector<Vector3> points;
  std::vector<std::array<int, 4>> tets;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    tets.emplace_back();
    for (int a = 0; a < 4; ++a) {
      const auto vertex = cell->vertex(a);
      const auto [entry, is_new] = number.try_emplace(vertex, int(points.size()));
      if (is_new) points.emplace_back(vertex->point().x(), vertex->point().y(), vertex->point().z());
      tets.back()[a] = entry->second;
    }
  }
  if (tets.empty()) refuse("no tetrahedron lies inside the object", "", "choose smaller cells");
  Points nodes(Eigen::Index(points.size()), 3);
  for (std::size_t n = 0; n < points.size(); ++n) nodes.row(Eigen::Index(n)) = points[n].transpose();
  return make_tet_mesh(std::move(nodes), std::move(tets));
}

TetMesh conforming(const TriangleMesh& surface, const Polyhedron& scan, const TetMeshOptions& options) {
  if (processing::does_self_intersect(scan))
    refuse("the surface intersects itself", "a surface without intersections", "repair the scan, or let the elements enclose it");
  const double h = options.cell_size;
  ScanDomain domain(scan);
  std::vector<std::vector<Kernel::Point_3>> polylines;
  for (const std::vector<int>& line : SharpEdges(surface, options.feature_angle_deg, h).lines()) {
    polylines.emplace_back();
    for (const int v : line) polylines.back().push_back(cgal(surface.vertices[std::size_t(v)]));
  }
  domain.add_features(polylines.begin(), polylines.end());
  const CGAL::Mesh_criteria_3<CGAL::Mesh_triangulation_3<ScanDomain>::type> criteria(
      parameters::edge_size = h, parameters::facet_angle = 25.0, parameters::facet_size = 0.6 * h,
      parameters::facet_distance = 0.1 * h, parameters::cell_radius_edge_ratio = 2.0, parameters::cell_size = 0.75 * h);
  return mesh_of(domain, criteria);
}

}  // namespace

TetMesh make_tet_mesh(const TriangleMesh& surface, const TetMeshOptions& options) {
  check_options(options);
  check_surface(surface);
  check_size(surface, options.cell_size);
  CGAL::get_default_random() = CGAL::Random(0);
  const Polyhedron scan = polyhedron_of(surface);
  const TetMesh mesh = conforming(surface, scan, options);
  return options.quadratic ? with_mid_nodes(mesh) : mesh;
}

#else

TetMesh make_tet_mesh(const TriangleMesh&, const TetMeshOptions&) {
  refuse("this program was built without a mesher for tetrahedra", "", "build it with -DPLIANT_WITH_CGAL=ON");
}

#endif

}  // namespace pliant
