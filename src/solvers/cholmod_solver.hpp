#pragma once

#include "solvers/linear_solver.hpp"

namespace pliant {

/// CHOLMOD's supernodal Cholesky with the symbolic analysis kept between factorisations.
/// Throws std::invalid_argument in a build without it.
std::unique_ptr<LinearSolver> make_cholmod_solver(std::shared_ptr<const BlockPattern> pattern);

}  // namespace pliant
