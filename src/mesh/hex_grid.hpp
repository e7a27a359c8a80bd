#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "geometry/signed_distance.hpp"
#include "mesh/surface_point.hpp"

namespace pliant {

/// Local node a of a cell lies at (a & 1, a >> 1 & 1, a >> 2 & 1) of its unit cube.
/// Trilinear shape functions and their gradients in unit-cube coordinates; valid (as polynomials) outside [0,1]^3 too.
std::array<double, 8> shape_functions(const Vector3& local);
Eigen::Matrix<double, 8, 3> shape_gradients(const Vector3& local);

/// Quadrature of a cell's inside part: weights for the 3 x 3 x 3 Gauss points of the unit cube that integrate every
/// polynomial of degree <= 2 in each coordinate exactly over the inside part (moment fitting of Weiss 2020, eq. 26).
/// Weights can be negative; their sum is the inside volume divided by h^3.
struct CellQuadrature {
  static constexpr int count = 27;
  std::array<double, count> weights{};
  static const std::array<Vector3, count>& points();
  double volume_fraction() const;
  /// Adds the integral functional of one weighted point (unit-cube coordinates, may lie outside the cube).
  void add(const Vector3& local, double weight);
};

/// Where a rest point lies: cell and unit-cube coordinates (outside [0,1]^3 where the cell was extended over it).
struct CellPoint {
  int cell = -1;
  Vector3 local = Vector3::Zero();
};

/// A regular hexahedral grid over an object, cut by its surface.
/// Cells barely cut are merged: their inside part is integrated with a neighbour's (extrapolated) shape functions and
/// the cell itself has no unknowns, so that conditioning does not depend on where the grid lies.
struct HexGrid {
  double cell_size = 0.0;  ///< h [m]
  Vector3 origin;          ///< lattice point (0,0,0) [m]
  Eigen::Vector3i size;    ///< lattice points along each axis

  Points nodes;                             ///< n x 3, rest positions [m] of the nodes of active cells
  std::vector<std::array<int, 8>> cells;    ///< nodes of each active cell
  std::vector<Eigen::Vector3i> cell_index;  ///< lattice index of each active cell's lowest corner
  std::vector<CellQuadrature> quadrature;   ///< of each active cell, in units of h^3
  std::vector<SurfacePoint> surface;        ///< samples of the surface, about four a cut cell face

  std::vector<int> node_of_lattice;  ///< active node of a lattice point, -1: none
  std::vector<int> cell_of_lattice;  ///< active cell that stands for a lattice cell (itself or merged into), -1: none

  int node_count() const { return int(nodes.rows()); }
  int cell_count() const { return int(cells.size()); }
  int lattice(int i, int j, int k) const { return (k * size.y() + j) * size.x() + i; }
  int lattice(const Eigen::Vector3i& i) const { return lattice(i.x(), i.y(), i.z()); }
  int lattice_count() const { return size.prod(); }
  Vector3 lattice_position(int index) const {
    return origin + cell_size * Vector3(index % size.x(), index / size.x() % size.y(), index / (size.x() * size.y()));
  }
  double volume() const;

  /// The cell that represents a rest point; a point outside every cell is given to the nearest cell, extrapolated.
  [[nodiscard]] CellPoint locate(const Vector3& point) const;
};

/// Parts of a grid that are joined by whole faces of cells: one where nothing hangs by an edge or a corner alone, about
/// which it would turn freely.
int face_connected_parts(const HexGrid& grid);

struct HexGridOptions {
  double merge_below = 0.2;  ///< cells with a smaller inside fraction are merged with a neighbour; 0: none
  int subdivisions = 4;      ///< of a cut cell along each edge, for the integrals
  /// Of a rest position: cells with their middle in what is held are merged with each other, and others with others.
  std::function<bool(const Vector3&)> is_held = {};
};

/// @param cell_size  h [m]
/// @param shift      moves the lattice, in cells: tests slide the grid under the object
HexGrid make_hex_grid(const SignedDistance& distance, const Box& object, double cell_size,
                      const HexGridOptions& options = {}, const Vector3& shift = Vector3::Zero());

}  // namespace pliant
