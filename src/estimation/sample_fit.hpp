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
  VectorX deviations;            ///< of each coordinate of the press' points [m], > 0
  bool is_scale_known = false;   ///< of the deviations; else they are known up to a factor
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
/// misfit is what noise makes (discrepancy principle, Morozov 1966), or, where the noise's scale is not known, that of
/// the greatest evidence; anew in every iteration, and no less than what brings the misfit to a tenth.
/// @param start  of every element, what the field is smooth about
PressSample fit_sample(const PressScene& scene, int press, const std::vector<SmallStrainModuli>& start,
                       const ElementSmoothness& smoothness, const SampleFitOptions& options);

/// Jacobian of a press' coordinates [m] by the elements' ln E and logit of nu (2 T columns: first all ln E), at the
/// equilibrium of `body`.
enum class JacobianBy { Tangents, Adjoints };
MatrixX sample_jacobian(PressedBody& body, const Body& mesh, const LinearLaw& law, JacobianBy by);

/// The linear law that comes closest to a law's stress at one deformation, element by element: least squares over
/// lambda ((1 - 2 nu) e + nu tr(e) I), held lightly to what the law is at rest.
/// @param strains  elements x 6: xx, yy, zz, xy, xz, yz, of S - I in the turning frame
std::vector<SmallStrainModuli> secant_moduli(const MaterialLaw& law, const MatrixX& strains);

/// Poisson's ratio's unconstrained number, nu in (-0.5, 0.5), and back.
double unconstrained_ratio(double nu);
double ratio_of(double unconstrained);

}  // namespace pliant
