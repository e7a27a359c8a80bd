#pragma once

#include <memory>
#include <span>
#include <vector>

#include "mesh/hex_grid.hpp"

namespace pliant {

/// Carries the displacement of the body's nodes out into a band around it (Weiss 2020, section 4.3): g = E u, E linear,
/// fixed and built once. Inside it is the nodes' own. Departing from the paper, which solves Laplace's equation
/// outside, each place there moves along with the affine motion of the body next to it: a part that has turned keeps
/// true distances in its band. Displacements that die out would fold the band into a part that has turned against the
/// rest by more than about a quarter, and points seen a little outside of it would lie nowhere.
class DisplacementExtension {
 public:
  /// Displacements side by side, x y z of each, one row a node.
  using Fields = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// @param band  how far from the surface the extension reaches [m], > 0
  DisplacementExtension(const HexGrid& grid, const SignedDistance& distance, double band);
  ~DisplacementExtension();
  DisplacementExtension(DisplacementExtension&&) noexcept;

  const Points& rest_positions() const { return rest_; }                   ///< m x 3 [m], of the band's lattice nodes
  const std::vector<std::array<int, 8>>& cells() const { return cells_; }  ///< of the band, inside ones included
  const std::vector<Vector3>& cell_corners() const { return cell_corners_; }  ///< rest position of local node 0
  double cell_size() const { return cell_size_; }
  double band() const { return band_; }

  /// g = E u: n x 3 at the body's nodes to m x 3 at the band's.
  [[nodiscard]] Points apply(const Points& u) const;
  /// Rows of E U for several displacements side by side: n x 3 q at the body's nodes to one row a band node asked for.
  /// What points lie in is a small part of a wide band.
  [[nodiscard]] Fields apply_at(std::span<const int> band_nodes, const Fields& u) const;
  /// E^T g: m x 3 to n x 3.
  [[nodiscard]] Points apply_transpose(const Points& g) const;

 private:
  struct Operators;
  double cell_size_, band_;
  int body_nodes_;
  Points rest_;
  std::vector<std::array<int, 8>> cells_;
  std::vector<Vector3> cell_corners_;
  std::vector<int> known_band_, known_body_;  // band nodes that are body nodes, and which
  std::vector<int> free_band_;                // the others
  std::vector<int> row_of_band_;  // of each band node: its row among the known ones, or -1 - among the others
  std::unique_ptr<Operators> operators_;
};

}  // namespace pliant
