#include "solvers/multigrid_solver.hpp"

namespace pliant {

MultigridSolver::MultigridSolver(std::shared_ptr<const BlockPattern> pattern, const SolverOptions& options)
    : IterativeSolver(std::move(pattern), options), coarse_(pattern_) {}

std::string MultigridSolver::name() const { return "conjugate gradients, multigrid by aggregation of rigid motions"; }

std::unique_ptr<LinearSolver> MultigridSolver::clone() const {
  return std::make_unique<MultigridSolver>(pattern_, options_);
}

bool MultigridSolver::factorise(const BlockMatrix& matrix) {
  return IterativeSolver::factorise(matrix) && coarse_.factorise(matrix);
}

void MultigridSolver::precondition(const std::vector<double>& r, std::vector<double>& z) {
  IterativeSolver::precondition(r, z);
  coarse_.add_correction(r, z, {});
}

void MultigridSolver::precondition_lanes(const std::vector<double>& r, std::vector<double>& z,
                                         std::vector<float>& work) {
  IterativeSolver::precondition_lanes(r, z, work);
  for (std::size_t lane = 0; lane < lanes; ++lane)
    coarse_.add_correction(r, z, {.row_stride = 3 * lanes, .stride = lanes, .first = lane});
}

}  // namespace pliant
