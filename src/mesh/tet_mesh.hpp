#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "geometry/triangle_mesh.hpp"
#include "mesh/surface_point.hpp"
#include "mesh/tet_shape.hpp"

namespace pliant {

class TetTree;

/// Where a rest point lies: an element and barycentric coordinates of its corners, some of them negative where the
/// point lies outside every element.
struct TetPoint {
  int tet = -1;
  Barycentric barycentric = Barycentric::Zero();
};

/// A volume of linear or quadratic tetrahedra. Comes from the functions below and is not changed afterwards:
/// `boundary`, `surface` and `tree` follow from nodes and elements. Reading from several threads is safe.
struct TetMesh {
  Points nodes;                               ///< n x 3, rest positions [m]
  std::vector<std::array<int, 4>> tets;       ///< corners of each element, positively oriented
  std::vector<std::array<int, 6>> mid_nodes;  ///< of each element's edges 01 02 03 12 13 23; empty: linear elements

  std::vector<std::array<int, 3>>
      boundary;                         ///< corners of the faces of one element only, counter-clockwise from outside
  std::vector<SurfacePoint> surface;    ///< three a boundary face, exact there for quadratic polynomials
  std::shared_ptr<const TetTree> tree;  ///< bounding volumes, for `locate`

  int node_count() const { return int(nodes.rows()); }
  int tet_count() const { return int(tets.size()); }
  bool is_quadratic() const { return !mid_nodes.empty(); }
  double volume() const;  ///< [m^3], of curved elements too

  /// The element at a rest point [m]; a point outside every element is given to the nearest one, extrapolated.
  /// Curved elements are taken as the straight ones over their corners.
  [[nodiscard]] TetPoint locate(const Vector3& point) const;
};

/// A mesh of given nodes and elements.
/// Throws std::invalid_argument where an element names a node that is not there or has no positive volume, a face
/// belongs to more than two elements, a node belongs to none, or there are mid nodes for some elements only.
TetMesh make_tet_mesh(Points nodes, std::vector<std::array<int, 4>> tets,
                      std::vector<std::array<int, 6>> mid_nodes = {});

/// The same elements, quadratic with straight edges; nodes keep their numbers and mid nodes follow. A mesh that is
/// quadratic already comes back as it is.
TetMesh with_mid_nodes(const TetMesh& mesh);

/// The same elements with the boundary moved outwards, inwards where it is negative: nodes of faces that meet at an
/// edge go so far that each of the faces does, those inside as the ones around them, and mid nodes as their edges'
/// ends. Throws std::invalid_argument where an element is left without a positive volume.
/// @param offset  by which the boundary moves at a place of it [m]
TetMesh with_offset_boundary(const TetMesh& mesh, const std::function<double(const Vector3&)>& offset);

/// A box of nx x ny x nz cells of six tetrahedra each. Throws std::invalid_argument where the box is empty or a count
/// is below one.
TetMesh make_tet_box(const Box& box, const Eigen::Vector3i& cells, bool quadratic);

/// How the boundary of a mesh relates to the scan that it is made from.
enum class TetFit {
  Conforming,  ///< follows the scan, sharp edges kept
  Enclosing,   ///< lies outside the scan everywhere: for thin or detailed objects that coarse elements cannot follow
};

struct TetMeshOptions {
  double cell_size = 0.0;  ///< mean length of an element's edges [m], > 0
  bool quadratic = false;
  TetFit fit = TetFit::Conforming;
  double feature_angle_deg = 60.0;  ///< edges whose faces' normals differ by more are kept sharp, (0, 180]; 180: none
  std::vector<std::function<bool(const Vector3&)>> parts = {};  ///< of space, whose boundaries the faces follow
  std::function<double(const Vector3&)> offset = {};            ///< see `with_offset_boundary`; none: on the scan
};

/// Fills a closed surface with elements, by CGAL's Mesh_3 (Delaunay refinement, slivers removed). Conforming elements
/// are smaller than asked for where the scan would stick out of them by more than 0.3 of their size: in thin leaves and
/// stalks. The same input gives the same mesh.
TetMesh make_tet_mesh(const TriangleMesh& surface, const TetMeshOptions& options);

/// The object's longest edge, parallel to the axes, divided by a number of cells [m].
double default_tet_size(const TriangleMesh& surface, double cells_along_longest);

/// How well shaped the elements are, taken as straight ones over their corners.
struct TetQuality {
  double least_dihedral_deg = 0.0, greatest_dihedral_deg = 0.0;         ///< a regular tetrahedron has 70.5
  double least_volume = 0.0, mean_volume = 0.0, greatest_volume = 0.0;  ///< [m^3]
  int below_5_deg = 0, below_10_deg = 0;                                ///< elements with a smaller dihedral angle
  double least_radius_ratio = 0.0;  ///< 3 x in- over circumradius: 1 for a regular tetrahedron, 0 for a flat one
};
TetQuality quality(const TetMesh& mesh);

}  // namespace pliant
