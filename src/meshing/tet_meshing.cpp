#include <cmath>
#include <cstdio>

#include "base/disjoint_sets.hpp"
#include "base/error.hpp"
#include "base/points.hpp"
#include "geometry/mesh_io.hpp"
#include "mesh/tet_mesh.hpp"

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

#include <algorithm>
#include <map>
#include <utility>

#include "meshing/part_boundary.hpp"
#include "meshing/sharp_edges.hpp"
#include "meshing/tet_improve.hpp"
#include "meshing/volume_match.hpp"
#endif

namespace pliant {

namespace {

[[noreturn]] void refuse(const std::string& found, const std::string& expected, const std::string& advice) {
  throw InputError({{}, found, expected, advice});
}

}  // namespace

double default_tet_size(const TriangleMesh& surface, double cells_along_longest) {
  return bounding_box(surface).extent().maxCoeff() / cells_along_longest;
}

#ifdef PLIANT_WITH_CGAL

namespace {

constexpr double most_tets = 2e6;
constexpr double facet_tolerance = 0.1;  // of the cell size: how far faces may lie from the surface that is meshed
constexpr double first_gap = 0.2;        // of the cell size: between a scan and the surface that encloses it

namespace parameters = CGAL::parameters;
namespace processing = CGAL::Polygon_mesh_processing;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Polyhedron = CGAL::Mesh_polyhedron_3<Kernel>::type;
using ScanTree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_face_graph_triangle_primitive<Polyhedron>>>;
using ScanDomain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel>;
using GapDomain = CGAL::Labeled_mesh_domain_3<Kernel>;
template <class Domain>
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<typename CGAL::Mesh_triangulation_3<Domain>::type>;

}  // namespace

}  // namespace pliant

namespace CGAL {
// Before Mesh_3 throws, it writes what it has into the folder that the program happens to run in: not ours.
template <bool IsStreamable>
struct Dump_c3t3<pliant::Complex<pliant::ScanDomain>, IsStreamable> {
  void dump_c3t3(const pliant::Complex<pliant::ScanDomain>&, const std::string&) const {}
};
template <bool IsStreamable>
struct Dump_c3t3<pliant::Complex<pliant::GapDomain>, IsStreamable> {
  void dump_c3t3(const pliant::Complex<pliant::GapDomain>&, const std::string&) const {}
};
}  // namespace CGAL

namespace pliant {

namespace {

Kernel::Point_3 cgal(const Vector3& p) { return {p.x(), p.y(), p.z()}; }

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
    problems.push_back({{},
                        complaint,
                        "a closed, outward oriented surface without flat triangles",
                        report.is_closed_solid ? "repair the scan" : report.cure});
  throw InputError(problems);
}

void check_size(const TriangleMesh& surface, double cell_size) {
  const double longest = bounding_box(surface).extent().maxCoeff();
  if (cell_size > longest)
    refuse("tetrahedra of " + text_of(cell_size) + " m in an object of " + text_of(longest) + " m",
           "smaller ones than the object", "choose smaller cells");
  const double regular = std::pow(cell_size, 3) / (6.0 * std::sqrt(2.0));
  const double count = enclosed_volume(surface) / regular;
  if (count > most_tets)
    refuse("tetrahedra of " + text_of(cell_size) + " m would be about " + text_of(count),
           "at most " + text_of(most_tets), "choose larger cells");
}

Polyhedron polyhedron_of(const TriangleMesh& surface) {
  if (!processing::is_polygon_soup_a_polygon_mesh(surface.triangles))
    refuse("parts of the surface meet in a single vertex", "a surface that looks like a disc around each vertex",
           "repair the scan");
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

/// One vertex of each connected part of a surface: its shells, outer ones and those of cavities.
std::vector<Vector3> vertex_of_each_shell(const TriangleMesh& surface) {
  DisjointSets parts(surface.vertices.size());
  for (const auto& [a, b, c] : surface.triangles) parts.join(a, b), parts.join(a, c);
  std::map<int, Vector3> shells;
  for (const auto& triangle : surface.triangles)
    shells.try_emplace(parts.root(triangle[0]), surface.vertices[std::size_t(triangle[0])]);
  std::vector<Vector3> vertices;
  for (const auto& [shell, vertex] : shells) vertices.push_back(vertex);
  return vertices;
}

/// A length that is shorter about some places.
class LocalLength {
 public:
  explicit LocalLength(double everywhere) : everywhere_(everywhere) {}

  bool is_even() const { return places_.empty(); }
  double at(const Vector3& p) const {
    double length = everywhere_;
    for (const Place& place : places_)
      length = std::min(length, place.length + growth * std::max(0.0, (p - place.at).norm() - place.radius));
    return length;
  }
  void shorten(const Vector3& at, double radius, double to) { places_.push_back({at, radius, to}); }

 private:
  struct Place {
    Vector3 at;
    double radius, length;
  };
  static constexpr double growth = 0.3;  // a unit of distance
  double everywhere_;
  std::vector<Place> places_;
};

/// Lengths of edges, and how far faces may lie from the surface that is meshed [m].
struct LocalSizes {
  explicit LocalSizes(double cell_size) : edges(cell_size), gaps(facet_tolerance * cell_size) {}

  LocalLength edges, gaps;
};

/// Refines, takes over the cells inside and makes the worst of them better. Slivers are perturbed, not exuded: CGAL's
/// exudation depends on addresses.
/// @param scan  whose volume the elements shall have; none: they enclose it
template <class Domain>
TetMesh mesh_of(const Domain& domain, const TetMeshOptions& options, const LocalSizes& sizes, const ScanTree* scan) {
  using Triangulation = typename CGAL::Mesh_triangulation_3<Domain>::type;
  using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
  const double h = options.cell_size;
  const auto share = [](double of, const LocalLength& length) {
    return [of, &length](const typename Triangulation::Bare_point& p, int,
                         const typename Triangulation::Vertex::Index&) -> typename Triangulation::FT {
      return of * length.at({p.x(), p.y(), p.z()});
    };
  };
  const bool is_even = sizes.edges.is_even() && sizes.gaps.is_even();
  const Criteria criteria =
      is_even ? Criteria(parameters::edge_size = h, parameters::facet_angle = 25.0, parameters::facet_size = 0.6 * h,
                         parameters::facet_distance = facet_tolerance * h, parameters::cell_radius_edge_ratio = 2.0,
                         parameters::cell_size = 0.75 * h)
              : Criteria(parameters::edge_size = share(1.0, sizes.edges), parameters::facet_angle = 25.0,
                         parameters::facet_size = share(0.6, sizes.edges),
                         parameters::facet_distance = share(1.0, sizes.gaps), parameters::cell_radius_edge_ratio = 2.0,
                         parameters::cell_size = share(0.75, sizes.edges));
  CGAL::Mesh_error_code error = CGAL::CGAL_MESH_3_NO_ERROR;
  const std::size_t most_vertices = std::size_t(most_tets / 5.0);
  const auto complex = CGAL::make_mesh_3<Complex<Domain>>(
      domain, criteria, parameters::no_perturb(), parameters::no_exude(),
      parameters::mesh_3_options(parameters::maximal_number_of_vertices = most_vertices,
                                 parameters::pointer_to_error_code = &error));
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
  improve(points, tets, {.surface_tolerance = 0.2 * facet_tolerance * h});
  if (scan != nullptr)
    match_volume(points, tets, [&](const Vector3& p) -> Vector3 {
      const Kernel::Point_3 at = scan->closest_point(cgal(p));
      return {at.x(), at.y(), at.z()};
    });
  if (options.offset) {
    const TetMesh moved = with_offset_boundary(make_tet_mesh(to_points(points), tets), options.offset);
    for (std::size_t n = 0; n < points.size(); ++n) points[n] = moved.nodes.row(Eigen::Index(n));
  }
  for (const auto& part : options.parts) follow_part(points, tets, part, 0.2 * facet_tolerance * h);
  return make_tet_mesh(to_points(points), std::move(tets));
}

/// Where a scan sticks out of a mesh by more than its faces may lie off, and by how much, farthest first [m].
std::vector<std::pair<double, Vector3>> lost_places(const TriangleMesh& surface, const TetMesh& mesh,
                                                    const LocalSizes& sizes) {
  std::vector<std::pair<double, Vector3>> lost;
  for (const auto& [a, b, c] : surface.triangles) {
    const Vector3& p = surface.vertices[std::size_t(a)];
    const TetPoint in = mesh.locate(p);
    if (in.barycentric.minCoeff() >= 0.0) continue;
    const Barycentric inside = in.barycentric.cwiseMax(0.0) / in.barycentric.cwiseMax(0.0).sum();
    Vector3 nearest = Vector3::Zero();
    for (int k = 0; k < 4; ++k)
      nearest += inside[k] * mesh.nodes.row(mesh.tets[std::size_t(in.tet)][std::size_t(k)]).transpose();
    const double off = (p - nearest).norm();
    if (off > 3.0 * facet_tolerance * sizes.edges.at(p)) lost.emplace_back(off, p);
  }
  std::ranges::sort(lost, [](const auto& a, const auto& b) { return a.first > b.first; });
  return lost;
}

/// How thick a solid is behind each triangle, along its normal [m], with the triangle's middle.
std::vector<std::pair<double, Vector3>> thicknesses(const TriangleMesh& surface, const ScanTree& scan) {
  const double longest = bounding_box(surface).extent().norm();
  std::vector<std::pair<double, Vector3>> through;
  std::vector<ScanTree::Intersection_and_primitive_id<Kernel::Segment_3>::Type> hits;
  for (const auto& [a, b, c] : surface.triangles) {
    const Vector3 &p = surface.vertices[std::size_t(a)], &q = surface.vertices[std::size_t(b)],
                  &r = surface.vertices[std::size_t(c)];
    const Vector3 cross = (q - p).cross(r - p), middle = (p + q + r) / 3.0;
    if (!(cross.norm() > 0.0)) continue;
    const Vector3 inwards = -cross.normalized(), start = middle + 1e-6 * longest * inwards;
    hits.clear();
    scan.all_intersections(Kernel::Segment_3(cgal(start), cgal(middle + longest * inwards)), std::back_inserter(hits));
    double nearest = longest;
    for (const auto& hit : hits)
      if (const auto* at = boost::get<Kernel::Point_3>(&hit.first))
        nearest = std::min(nearest, (Vector3(at->x(), at->y(), at->z()) - middle).norm());
    through.emplace_back(nearest, middle);
  }
  return through;
}

/// Edges of three times the thickness where that is less than what is asked for, at the least a third of it: what is
/// thin bends, and the mesher does not find a leaf that is much thinner than elements are wide. Faces lie closer to a
/// stalk than its thickness: chords would take away from how stiff it is.
LocalSizes sizes_of_thin_parts(const TriangleMesh& surface, const ScanTree& scan, double cell_size) {
  constexpr double slenderness = 3.0, least = 1.0 / 3.0, gap = 0.12, enough = 0.8;
  std::vector<std::pair<double, Vector3>> through = thicknesses(surface, scan);
  std::ranges::sort(through, [](const auto& a, const auto& b) { return a.first < b.first; });
  LocalSizes sizes(cell_size);
  for (const auto& [thickness, place] : through) {
    const double size = std::max(slenderness * thickness, least * cell_size);
    if (size < enough * sizes.edges.at(place)) sizes.edges.shorten(place, 2.0 * size, size);
    const double from = std::max(thickness, least * cell_size / slenderness);
    if (gap * from < enough * sizes.gaps.at(place)) sizes.gaps.shorten(place, from, gap * from);
  }
  return sizes;
}

/// A mesh whose elements are smaller where larger ones would miss parts of the scan.
template <class Domain>
TetMesh mesh_of_all_parts(const Domain& domain, const TriangleMesh& surface, const ScanTree& scan,
                          const TetMeshOptions& options) {
  constexpr int most_rounds = 4;
  constexpr double shorter = 0.6;
  LocalSizes sizes = sizes_of_thin_parts(surface, scan, options.cell_size);
  TetMesh mesh = mesh_of(domain, options, sizes, &scan);
  for (int round = 0; round < most_rounds; ++round) {
    std::vector<std::pair<Vector3, double>> places;
    for (const auto& lost : lost_places(surface, mesh, sizes)) {
      const Vector3& place = lost.second;
      const double size = shorter * sizes.edges.at(place);
      const auto is_near = [&](const auto& other) { return (other.first - place).norm() < size; };
      if (std::ranges::none_of(places, is_near)) places.emplace_back(place, size);
    }
    if (places.empty()) break;
    for (const auto& [place, size] : places) sizes.edges.shorten(place, 2.0 * size, size);
    mesh = mesh_of(domain, options, sizes, &scan);
  }
  return mesh;
}

TetMesh conforming(const TriangleMesh& surface, const Polyhedron& scan, const TetMeshOptions& options) {
  if (processing::does_self_intersect(scan))
    refuse("the surface intersects itself", "a surface without intersections",
           "repair the scan, or let the elements enclose it");
  const std::vector<Vector3> shells = vertex_of_each_shell(surface);
  ScanDomain domain(scan);
  std::vector<std::vector<Kernel::Point_3>> lines;
  for (const std::vector<int>& line : sharp_lines(surface, options.feature_angle_deg, options.cell_size)) {
    lines.emplace_back();
    for (const int v : line) lines.back().push_back(cgal(surface.vertices[std::size_t(v)]));
  }
  domain.add_features(lines.begin(), lines.end());
  if (shells.size() > 1)  // the mesher might find only one of them by itself
    for (const Vector3& vertex : shells) domain.add_corner(cgal(vertex));
  const ScanTree tree(faces(scan).begin(), faces(scan).end(), scan);
  TetMesh mesh = mesh_of_all_parts(domain, surface, tree, options);
  for (const Vector3& vertex : shells) {
    double nearest = std::numeric_limits<double>::max();
    for (const SurfacePoint& p : mesh.surface) nearest = std::min(nearest, (p.position - vertex).norm());
    if (nearest > options.cell_size)
      refuse("a part of the surface is too small for tetrahedra of " + text_of(options.cell_size) + " m", "",
             "choose smaller cells");
  }
  return mesh;
}

/// True where no face of the boundary meets the scan and no shell of it lies outside: then none of its points does.
bool encloses(const TetMesh& mesh, const ScanTree& scan, const std::vector<Vector3>& shells) {
  const auto corner = [&](int n) { return cgal(mesh.nodes.row(n).transpose()); };
  for (const auto& [a, b, c] : mesh.boundary)
    if (scan.do_intersect(Kernel::Triangle_3(corner(a), corner(b), corner(c)))) return false;
  return std::ranges::all_of(shells, [&](const Vector3& v) { return mesh.locate(v).barycentric.minCoeff() > 0.0; });
}

TetMesh enclosing(const TriangleMesh& surface, const Polyhedron& scan, const TetMeshOptions& options) {
  const std::vector<Vector3> shells = vertex_of_each_shell(surface);
  const ScanTree tree(faces(scan).begin(), faces(scan).end(), scan);
  const CGAL::Side_of_triangle_mesh<Polyhedron, Kernel> side(tree);
  const Box box = bounding_box(surface);
  for (double gap = first_gap * options.cell_size; gap < options.cell_size; gap *= 1.5) {
    const auto beyond_gap = [&](const Kernel::Point_3& p) {
      const double outside = std::sqrt(tree.squared_distance(p)) - gap;
      return outside >= 0.0 && side(p) == CGAL::ON_BOUNDED_SIDE ? -outside : outside;
    };
    const double radius = 0.5 * box.extent().norm() + 2.0 * gap;
    const Kernel::Sphere_3 bound(cgal(0.5 * (box.min + box.max)), 1.1 * radius * radius);
    const double error = 0.01 * gap / radius;
    const GapDomain domain =
        GapDomain::create_implicit_mesh_domain(beyond_gap, bound, parameters::relative_error_bound = error);
    TetMesh mesh = mesh_of(domain, options, LocalSizes(options.cell_size), nullptr);
    if (encloses(mesh, tree, shells)) return mesh;
  }
  refuse("tetrahedra of " + text_of(options.cell_size) + " m do not enclose the surface", "", "choose smaller cells");
}

}  // namespace

TetMesh make_tet_mesh(const TriangleMesh& surface, const TetMeshOptions& options) {
  check_options(options);
  check_surface(surface);
  check_size(surface, options.cell_size);
  try {
    CGAL::get_default_random() = CGAL::Random(0);
    const Polyhedron scan = polyhedron_of(surface);
    const TetMesh mesh =
        options.fit == TetFit::Enclosing ? enclosing(surface, scan, options) : conforming(surface, scan, options);
    return options.quadratic ? with_mid_nodes(mesh) : mesh;
  } catch (const std::logic_error& error) {  // of CGAL, and of what it gave
    refuse(std::string("the mesher failed: ") + error.what(), "", "try another cell size, or repair the scan");
  }
}

#else

TetMesh make_tet_mesh(const TriangleMesh&, const TetMeshOptions&) {
  refuse("this program was built without a mesher for tetrahedra", "", "build it with -DPLIANT_WITH_CGAL=ON");
}

#endif

}  // namespace pliant
