#pragma once

#include <functional>

#include "elasticity/sampled_law.hpp"
#include "estimation/press_scene.hpp"

namespace pliant {

/// Smoothness of a field of one number an element: A = L^T L + a trace of the identity, L the umbrella operator of
/// Zhang 2004, (L p)_i = sum_j (p_i - p_j) over elements j that share a node with i (Bickel 2009, section 4.1).
class ElementSmoothness {
 public:
  explicit ElementSmoothness(const Body& body);
  ~ElementSmoothness();
  ElementSmoothness(ElementSmoothness&&) noexcept;
  int size() const;
  /// A x, A^-1 x for every column.
  [[nodiscard]] MatrixX times(const MatrixX& x) const;
  [[nodiscard]] MatrixX solve(const MatrixX& x) const;
  /// R^-1 x for A = R R^T.
  [[nodiscard]] MatrixX half_solve(const MatrixX& x) const;

 private:
  struct Factors;
  std::unique_ptr<Factors> factors_;
};

struct SampleFitOptions {
  double noise = 0.0;            ///< deviation of a coordinate [m], > 0: the misfit that is aimed at (Morozov 1966)
  int max_iterations = 15;       ///< >= 1
  double step_tolerance = 5e-3;  ///< of ln E and of Poisson's ratio's logit, > 0
};

/// Stiffness of every element that one press shows, and how its fit went.
struct PressSample {
  bool succeeded = false, converged = false;
  std::string failure;
  MaterialSample sample;              ///< (lambda, alpha) and strain of each element
  double weight = 0.0;                ///< gamma of eq. 9, for unknowns ln E and logit of nu, residuals in deviations
  double start_rms = 0.0, rms = 0.0;  ///< [m] a point
  int iterations = 0;
};

/// The field (lambda, alpha) of one press (Bickel 2009, eq. 9): the residuals over their noise, and gamma times the
/// smoothness of ln E and of Poisson's ratio's logit over (-0.5, 1/2): in these unknowns every field is admissible.
/// Levenberg-Marquardt. The Jacobian (appendix, but with the rotations' derivatives, at the exact equilibrium) comes by
/// the adjoint of each measured coordinate, or the tangent of each unknown, whichever are fewer. With A the smoothness,
/// steps follow from the matrix J A^-1 J^T of measurements alone. gamma is the greatest weight at which the linearised
/// misfit is what noise makes (discrepancy principle), or a tenth of what it was, anew in every iteration; where none
/// is, the least that is tried.
/// @param start  law of one E and one nu, which the field is smooth about
PressSample fit_sample(const PressScene& scene, int press, const SmallStrainModuli& start,
                       const ElementSmoothness& smoothness, const SampleFitOptions& options);

/// Jacobian of a press' coordinates [m] by the elements' ln E and logit of nu (2 T columns: first all ln E), at the
/// equilibrium of `body`.
enum class JacobianBy { Tangents, Adjoints };
MatrixX sample_jacobian(PressedBody& body, const Body& mesh, const LinearLaw& law, JacobianBy by);

/// Poisson's ratio's unconstrained number, nu in (-0.5, 0.5), and back.
double unconstrained_ratio(double nu);
double ratio_of(double unconstrained);

}  // namespace pliant
