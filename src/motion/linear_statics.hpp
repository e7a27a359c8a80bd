#pragma once

#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "parameters/motion_blocks.hpp"
#include "solvers/linear_solver.hpp"

namespace pliant {

/// Small displacements of a body from where it is stress-free. One factorisation, any number of loads.
class LinearStatics {
 public:
  /// @param held   nodes that stay where they are
  /// @param blocks  of the material in `theta`
  LinearStatics(const std::shared_ptr<const Body>& body, const std::vector<int>& held, const MaterialBlocks& blocks,
                const VectorX& theta);

  /// Whether the held nodes hold the body; only then are there displacements.
  bool is_held() const { return is_held_; }
  /// Of any node [m], for forces at the nodes, n x 3 [N].
  double greatest_displacement(Points force) const;

 private:
  std::vector<int> held_;
  BlockMatrix matrix_;
  std::unique_ptr<LinearSolver> solver_;
  bool is_held_ = false;
};

}  // namespace pliant
