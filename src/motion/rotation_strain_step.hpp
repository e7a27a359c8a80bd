#pragma once

#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "solvers/linear_solver.hpp"

namespace pliant {

/// Moves a body by a displacement whose gradient turns its parts, instead of stretching them as straight lines do: an
/// element with the displacement gradient D (about where it is now) turns by exp(skew D) and strains by sym D. The
/// positions fit those of all elements best, in least squares (rotation-strain coordinates, Huang 2011). Of small
/// displacements d it is x + d up to their square, so that Newton's method keeps its order; slender bodies bend far in
/// few steps.
class RotationStrainStep {
 public:
  RotationStrainStep(std::shared_ptr<const Body> body, SolverKind kind);

  /// Nodes that go along straight lines, the held ones. False where there is none: nothing then says where to.
  [[nodiscard]] bool fix(const std::vector<int>& nodes);

  /// The farthest that a part turns [rad] for
  /// @param x, d  positions and displacement, n x 3 [m]
  double prepare(const Points& x, const Points& d);
  /// @param share  of the prepared displacement
  /// @param out    positions [m]
  void move(double share, Points& out);

 private:
  /// A part of an element, of which the gradient is taken: sum_a x_a g_a^T.
  struct Part {
    int element;
    double volume;     // [m^3]
    Points gradients;  // g_a [1/m]
    Matrix3 F, D;      // deformation gradient, and the displacement's gradient about where the part is now
    Vector3 turn;      // axial vector of skew D [rad]
  };
  void divide(int element);

  std::shared_ptr<const Body> body_;
  std::vector<Part> parts_;
  std::unique_ptr<LinearSolver> solver_;
  BlockMatrix laplacian_, constrained_;
  std::vector<int> fixed_;
  bool is_ready_ = false;
  Points x_, d_, excess_;
  VectorX correction_;
};

}  // namespace pliant
