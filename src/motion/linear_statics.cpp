#include "motion/linear_statics.hpp"

#include <utility>

#include "elasticity/corotated.hpp"

namespace pliant {

LinearStatics::LinearStatics(const std::shared_ptr<const Body>& body, const std::vector<int>& held,
                             const MaterialBlocks& blocks, const VectorX& theta)
    : held_(held), matrix_(body->pattern) {
  const auto elasticity = make_elasticity(body, blocks);
  elasticity->set_parameters(theta);
  elasticity->linearise(body->reference_positions());
  matrix_.set_zero();
  elasticity->add_matrix(1.0, matrix_);
  for (const int node : held_) matrix_.constrain(node);
  SolverOptions direct;  // one matrix, many right-hand sides
  direct.kind = best_direct_kind();
  solver_ = make_linear_solver(body->pattern, direct);
  is_held_ = held_.size() >= 3 && solver_->factorise(matrix_);
}

double LinearStatics::greatest_displacement(Points force) const {
  for (const int node : held_) force.row(node).setZero();
  VectorX u = VectorX::Zero(force.size());
  (void)solver_->solve(flat(force), u);
  return as_points(std::as_const(u)).rowwise().norm().maxCoeff();
}

}  // namespace pliant
