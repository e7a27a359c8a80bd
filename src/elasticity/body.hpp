#pragma once

#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "elasticity/element_loop.hpp"
#include "elasticity/hex_element.hpp"
#include "mesh/hex_grid.hpp"
#include "mesh/tet_mesh.hpp"
#include "solvers/block_matrix.hpp"

namespace pliant {

/// Elements by their count of nodes.
enum class ElementKind : int { Tetrahedron = 4, Hexahedron = 8, QuadraticTetrahedron = 10 };

enum class MassKind {
  Consistent,
  Lumped,  ///< diagonal, scaled so that the mass is kept (Hinton, Rock, Zienkiewicz 1976): positive in cut cells and
           ///< for quadratic elements too
};

struct BodyOptions {
  HexFormulation formulation = HexFormulation::IncompatibleModes;
  MassKind mass = MassKind::Consistent;
};

/// How stiff each element is, as control moduli mixed in the logarithm:
///   ln E_e = ln r_e + sum_k w_ek ln E_k,   sum_k w_ek = 1.
/// One control modulus is a homogeneous object, regions are weights of 0 and 1, control points spread smoothly, and one
/// control modulus an element is a field that is free everywhere.
struct ModulusField {
  int controls = 1;              ///< m >= 1
  MatrixX weights;               ///< elements x m; empty where m = 1
  std::vector<double> relative;  ///< r_e [-], one an element
};

/// The elastic object, stress-free: nodes, elements and what does not change while it moves. Everything beyond this
/// module works with any kind of element.
struct Body {
  ElementKind kind = ElementKind::Hexahedron;
  std::variant<HexGrid, TetMesh> mesh;
  BodyOptions options;

  Points nodes;                        ///< n x 3, rest positions [m]
  std::vector<int> connectivity;       ///< nodes_per_element() nodes an element
  std::vector<double> element_volume;  ///< [m^3], of a cut cell its inside part
  std::vector<SurfacePoint> surface;   ///< samples of the surface, with areas: where contact acts
  ModulusField modulus;

  std::shared_ptr<const BlockPattern> pattern;
  std::shared_ptr<const std::vector<int>> blocks;  ///< where an element's N x N blocks are in the pattern, N^2 each
  std::shared_ptr<const ElementLoop> loop;         ///< over the elements, by several threads
  std::vector<double> mass;  ///< for unit density [m^3]: one number a block of the pattern, times the 3 x 3 identity
  Points mean_gradient;      ///< [1/m], of each element's nodes in turn: F_e = sum_a x_a g_a^T (Weiss 2020, eq. 30)
  std::vector<int> element_class;         ///< elements of one class share their stiffness; all full cells are class 0
  std::vector<int> class_representative;  ///< an element of each class

  int nodes_per_element() const { return int(kind); }
  int node_count() const { return int(nodes.rows()); }
  int element_count() const { return int(connectivity.size()) / nodes_per_element(); }
  std::span<const int> element(int e) const {
    return {connectivity.data() + std::size_t(e) * std::size_t(nodes_per_element()), std::size_t(nodes_per_element())};
  }
  auto gradients(int e) const {
    return mean_gradient.middleRows(Eigen::Index(e) * nodes_per_element(), nodes_per_element());
  }
  const Points& reference_positions() const { return nodes; }
  /// Where the nodes were in the scan [m], n x 3: the same, unless it was taken under load (`with_reference`).
  const Points& scanned_positions() const;
  /// Whether that is so.
  bool is_free_elsewhere() const { return nodes != scanned_positions(); }
  double volume() const;
  Vector3 centre_of_mass() const;  ///< in the scan [m]
  /// Longest edge of the nodes' box [m].
  double size() const;
  /// The hexahedral grid of a body made from one. Throws std::bad_variant_access for another.
  const HexGrid& grid() const { return std::get<HexGrid>(mesh); }

  /// out += scale M x for unit density, n x 3.
  void add_mass_product(double scale, const Points& x, Points& out) const;
};

Body make_body(HexGrid grid, const BodyOptions& options = {});
Body make_body(TetMesh mesh, const BodyOptions& options = {});

/// The same body, stress-free where `reference` has its nodes [m]. Its mass, its surface, and where points of the scan
/// lie in it stay as they are.
/// Throws std::invalid_argument for hexahedra, whose grid is regular when it is stress-free, and where an element has
/// no positive volume.
Body with_reference(const Body& body, Points reference);

/// Calls function.template operator()<N>() with the body's nodes per element as a constant, so that element loops are
/// unrolled for each kind.
template <class Function>
decltype(auto) with_node_count(const Body& body, Function&& function) {
  switch (body.kind) {
    case ElementKind::Tetrahedron:
      return function.template operator()<4>();
    case ElementKind::QuadraticTetrahedron:
      return function.template operator()<10>();
    case ElementKind::Hexahedron:
      break;
  }
  return function.template operator()<8>();
}

/// Stiffness of an element for E = 1 Pa, 3 N x 3 N [m], and its derivative by Poisson's ratio.
template <int N>
struct UnitStiffness {
  Eigen::Matrix<double, 3 * N, 3 * N> value, d_poissons_ratio;
};
template <int N>
UnitStiffness<N> unit_stiffness(const Body& body, int element, double poissons_ratio);

/// Points of the object as weighted sums of one element's nodes.
class Embedding {
 public:
  Embedding() = default;
  /// Points outside every element follow the nearest one, extrapolated.
  Embedding(const Body& body, const std::vector<Vector3>& rest_points);

  int point_count() const { return int(element_.size()); }
  int nodes_per_point() const { return stride_; }
  Vector3 position(int point, const Points& nodes) const {
    const int* n = nodes_.data() + std::size_t(point) * std::size_t(stride_);
    const double* w = weights_.data() + std::size_t(point) * std::size_t(stride_);
    Vector3 p = Vector3::Zero();
    for (int a = 0; a < stride_; ++a) p += w[a] * nodes.row(n[a]).transpose();
    return p;
  }
  /// m x 3 positions for n x 3 node positions.
  Points positions(const Points& nodes) const;
  /// nodes += the transpose applied to one point's vector.
  void add_transpose(int point, const Vector3& vector, Points& nodes) const {
    const int* n = nodes_.data() + std::size_t(point) * std::size_t(stride_);
    const double* w = weights_.data() + std::size_t(point) * std::size_t(stride_);
    for (int a = 0; a < stride_; ++a) nodes.row(n[a]) += w[a] * vector.transpose();
  }
  std::span<const int> nodes(int point) const {
    return {nodes_.data() + std::size_t(point) * std::size_t(stride_), std::size_t(stride_)};
  }
  std::span<const double> weights(int point) const {
    return {weights_.data() + std::size_t(point) * std::size_t(stride_), std::size_t(stride_)};
  }
  int element(int point) const { return element_[std::size_t(point)]; }

 private:
  int stride_ = 0;
  std::vector<int> element_, nodes_;
  std::vector<double> weights_;
};

/// Where block (a, b) of an element's N x N blocks goes in a matrix of another pattern that has the body's blocks among
/// others: N x N numbers an element, as `Body::blocks` has them for the body's own.
std::vector<int> element_blocks(const Body& body, const BlockPattern& pattern);

}  // namespace pliant
