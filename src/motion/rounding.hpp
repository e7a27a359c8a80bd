#pragma once

#include <cmath>
#include <limits>

#include "solvers/block_matrix.hpp"

namespace pliant {

/// Norm of the residual [N] that positions rounded to double precision leave about an equilibrium by themselves, by the
/// stiffness's diagonal: of stiff bodies under small loads it is more than any tolerance relative to the load.
/// @param stiffness  [N/m]; of a step's equation, whose residual is a momentum, [kg]
/// @param size       longest edge of the body [m]
inline double rounding_of_residual(const BlockMatrix& stiffness, double size) {
  double squares = 0.0;
  for (const int diagonal : stiffness.pattern().diagonal)
    for (int d = 0; d < 3; ++d) squares += std::pow(stiffness.block(diagonal)[4 * d], 2);
  return std::sqrt(squares) * size * std::numeric_limits<double>::epsilon();
}

}  // namespace pliant
