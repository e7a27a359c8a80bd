#pragma once

#include <memory>
#include <vector>

#include "elasticity/hex_element.hpp"
#include "geometry/hex_grid.hpp"
#include "solvers/block_matrix.hpp"

namespace pliant {

enum class MassKind {
  Consistent,
  Lumped,  ///< diagonal, scaled so that the mass is kept (Hinton, Rock, Zienkiewicz 1976): positive in cut cells too
};

struct BodyOptions {
  HexFormulation formulation = HexFormulation::IncompatibleModes;
  MassKind mass = MassKind::Consistent;
};

/// The elastic object, free of load: nodes, elements and what does not change while it moves.
struct Body {
  HexGrid grid;
  BodyOptions options;
  std::vector<double> relative_modulus;  ///< of each element, times the object's Young's modulus [-]

  std::shared_ptr<const BlockPattern> pattern;
  std::vector<double> mass;  ///< for unit density [m^3]: one number a block of the pattern, times the 3 x 3 identity
  std::vector<Eigen::Matrix<double, 8, 3>> mean_gradient;  ///< [1/m], of each element
  std::vector<int> element_class;  ///< elements of one class share their stiffness; all full cells are class 0
  std::vector<int> class_representative;  ///< an element of each class

  const Points& reference_positions() const { return grid.nodes; }
  int node_count() const { return grid.node_count(); }
  double volume() const { return grid.volume(); }
  Vector3 centre_of_mass() const;

  /// out += scale M x for unit density, n x 3.
  void add_mass_product(double scale, const Points& x, Points& out) const;
};

Body make_body(HexGrid grid, const BodyOptions& options = {});

/// Points of the object as weighted sums of nodes: rows of eight weights.
class Embedding {
 public:
  Embedding() = default;
  Embedding(const HexGrid& grid, const std::vector<Vector3>& rest_points);

  int point_count() const { return int(cell_.size()); }
  Vector3 position(int point, const Points& nodes) const {
    Vector3 p = Vector3::Zero();
    for (int a = 0; a < 8; ++a) p += weights_[point][a] * nodes.row(cells_[cell_[point]][a]).transpose();
    return p;
  }
  /// m x 3 positions for n x 3 node positions.
  Points positions(const Points& nodes) const;
  /// nodes += the transpose applied to one point's vector.
  void add_transpose(int point, const Vector3& vector, Points& nodes) const {
    for (int a = 0; a < 8; ++a) nodes.row(cells_[cell_[point]][a]) += weights_[point][a] * vector.transpose();
  }
  const std::array<int, 8>& nodes(int point) const { return cells_[cell_[point]]; }
  const std::array<double, 8>& weights(int point) const { return weights_[point]; }
  int cell(int point) const { return cell_[point]; }

 private:
  std::vector<std::array<int, 8>> cells_;
  std::vector<int> cell_;
  std::vector<std::array<double, 8>> weights_;
};

}  // namespace pliant
