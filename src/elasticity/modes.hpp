#pragma once

#include <memory>
#include <string>
#include <vector>

#include "elasticity/corotated.hpp"
#include "solvers/linear_solver.hpp"

namespace pliant {

/// Natural vibrations of a body about rest, K phi = lambda M phi, lowest first.
struct Modes {
  bool converged = false;
  std::string failure;          ///< why not, in words
  VectorX squared_frequencies;  ///< lambda = omega^2 [rad^2/s^2], ascending
  std::vector<Points> shapes;   ///< n x 3 each [1/sqrt(kg)]: phi_i^T M phi_j is 1 where i = j, else 0; held nodes are 0

  int count() const { return int(shapes.size()); }
  /// sqrt(lambda) / 2 pi [Hz]; 0 for a rigid motion whose lambda rounding has made negative.
  double frequency(int mode) const;
};

/// Modes of one body for several theta, sharing the symbolic factorisation. Lanczos's method on (K + s M)^-1 M with a
/// small positive s (Spectra), where K is the stiffness at rest without load and M the body's own mass, consistent or
/// lumped, times the density. Eigenvalues that occur several times (the two bendings of a square bar) are found as
/// often as they occur: what the method leaves out is looked for again, orthogonal to what it has found.
///
/// A body of which nothing is held has six rigid motions. They come first, with lambda zero up to rounding (of either
/// sign, some 1e-8 of the first vibration's or less) and shapes that are an arbitrary orthonormal basis of them;
/// `count` includes them.
class ModalAnalysis {
 public:
  /// @param held  nodes that do not move, in any order
  /// Throws InputError where a held node is not one of the body's.
  ModalAnalysis(std::shared_ptr<const Body> body, const MotionBlocks& blocks, std::vector<int> held);

  const Body& body() const { return *body_; }
  const std::vector<int>& held() const { return held_; }

  /// @param theta  moduli, Poisson's ratio and density count; damping and gravity do not
  /// @param count  from 1 to half of the unknowns that are not held
  /// Throws InputError where the count or the density cannot be. Where a factorisation or the iteration fails the
  /// result says so.
  Modes lowest(const VectorX& theta, int count);

  /// d lambda_i / d E_k = phi_i^T (dK/dE_k) phi_i [1/(s^2 Pa)], modes x control moduli, of modes of this theta
  /// (Hellmann 1937, Feynman 1939). Of an eigenvalue that occurs several times it is the derivative along the shape at
  /// hand, which the change of modulus may mix with its siblings: only their sum is then meaningful.
  MatrixX modulus_derivatives(const VectorX& theta, const Modes& modes);

  /// M x of this theta's density, n x 3; held nodes give 0.
  Points mass_product(const VectorX& theta, const Points& x) const;

 private:
  class Inverse;
  class Mass;
  bool factorise(const VectorX& theta);
  /// Adds up to `count` eigenvectors orthogonal to those there are. False where the iteration does not converge.
  bool extend(const VectorX& theta, int count, Modes& modes);
  VectorX gather(const Points& x) const;
  Points scatter(const double* x) const;

  std::shared_ptr<const Body> body_;
  MotionBlocks blocks_;
  std::vector<int> held_, free_;
  std::unique_ptr<Elasticity> elasticity_;
  BlockMatrix matrix_;  // K + s M, held nodes' rows and columns those of the identity
  std::unique_ptr<LinearSolver> solver_;
  double shift_ = 0.0;  // s [1/s^2]
};

/// The lowest modes of one body, once.
Modes modes(std::shared_ptr<const Body> body, const MotionBlocks& blocks, const VectorX& theta,
            const std::vector<int>& held, int count);

}  // namespace pliant
