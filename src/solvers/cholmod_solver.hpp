#pragma once

#include "solvers/linear_solver.hpp"

namespace pliant {

/// CHOLMOD's supernodal Cholesky with the symbolic analysis kept between factorisations.
/// Throws std::invalid_argument in a build without it.
std::unique_ptr<LinearSolver> make_cholmod_solver(std::shared_ptr<const BlockPattern> pattern);

/// What the factor of a matrix of this pattern has, by symbolic analysis alone.
struct FactorCounts {
  double entries = 0.0;     ///< below and on the diagonal
  double operations = 0.0;  ///< floating-point, of the factorisation
};
/// Throws std::invalid_argument in a build without CHOLMOD.
FactorCounts count_factor(std::shared_ptr<const BlockPattern> pattern);

}  // namespace pliant
