#include "solvers/conjugate_gradients.hpp"

namespace pliant {

SolveSummary PreconditionedConjugateGradients::solve(const BlockMatrix& A, LinearSolver& preconditioner,
                                                     const VectorX& b, VectorX& x, double tolerance,
                                                     int max_iterations) {
  SolveSummary summary;
  x.setZero(b.size());
  r_ = b;
  preconditioner.solve(r_, z_);
  p_ = z_;
  double rz = r_.dot(z_);
  const double norm = b.norm(), aim = tolerance * norm;
  while (summary.iterations < max_iterations) {
    A.multiply(p_, product_);
    const double curvature = p_.dot(product_);
    if (!(curvature > 0.0)) return summary;
    const double a = rz / curvature;
    x += a * p_;
    r_ -= a * product_;
    ++summary.iterations;
    if (const double left = r_.norm(); left <= aim) {
      summary.converged = true;
      summary.residual = norm > 0.0 ? left / norm : 0.0;
      return summary;
    }
    preconditioner.solve(r_, z_);
    const double next = r_.dot(z_);
    p_ = z_ + next / rz * p_;
    rz = next;
  }
  return summary;
}

}  // namespace pliant
