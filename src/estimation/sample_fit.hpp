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

/// A law whose stiffness is changed, element by element, by q = (factor, nu):
///   W = factor (W_about + e . (E(nu) - E(nu_0)) e / 2),
/// with the linear law E of one Young's modulus. Its stress is that of the law that it is about, and more only as far
/// as it was changed: what a linear law cannot say of a deformation is not lost.
class ChangedLaw : public TabulatedLaw {
 public:
  /// @param secant  of each element: Young's modulus and Poisson's ratio nu_0 at which the change begins
  ChangedLaw(std::shared_ptr<const MaterialLaw> about, std::vector<SmallStrainModuli> secant, MatrixX table);
  std::shared_ptr<TabulatedLaw> with_table(MatrixX table) const override {
    return std::make_shared<ChangedLaw>(about_, secant_, std::move(table));
  }
  std::string name() const override { return "changed"; }
  std::vector<std::string> parameter_names() const override { return {"factor", "poissons_ratio"}; }
  void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const override;
  void parameter_derivatives(int element, const Matrix3& F, std::span<Matrix3> out) const override;
  /// Of the law that it is about.
  SmallStrainModuli small_strain(int element) const override;

 protected:
  void check(const MatrixX& table) const override;

 private:
  std::shared_ptr<const MaterialLaw> about_;
  std::vector<SmallStrainModuli> secant_;
};

struct SampleFitOptions {
  VectorX deviations;            ///< of each coordinate of the press' points [m], > 0
  bool is_scale_known = false;   ///< of the deviations; else they are known up to a factor
  int max_iterations = 15;       ///< >= 1
  double step_tolerance = 5e-3;  ///< of ln factor and of Poisson's ratio's logit, > 0
};

/// Stress of every element that one press shows, and how its fit went.
struct PressSample {
  bool succeeded = false, converged = false;
  std::string failure;
  MaterialSample sample;  ///< strain and stress of each element
  double weight = 0.0;    ///< gamma of eq. 9, for unknowns ln factor and logit of nu, residuals in deviations
  double start_rms = 0.0, rms = 0.0;  ///< [m] a point
  int iterations = 0;
};

/// The field of stiffness of one press (Bickel 2009, eq. 9): the residuals over their noise, and gamma times the
/// smoothness of ln factor and of Poisson's ratio's logit over (-0.5, 1/2), the unknowns of a `ChangedLaw`. The paper's
/// fields are linear laws: two numbers, which have not the stress of most laws at a large strain, so that a press'
/// samples contradict each other though no marker errs. Here they are changes of a law that is known already.
/// Levenberg-Marquardt. The Jacobian (appendix, but with the rotations' derivatives, at the exact equilibrium) comes by
/// the adjoint of each measured coordinate, or the tangent of each unknown, whichever are fewer. With A the smoothness,
/// steps follow from the matrix J A^-1 J^T of measurements alone. gamma is the greatest weight at which the linearised
/// misfit is what noise makes (discrepancy principle, Morozov 1966), or, where the noise's scale is not known, that of
/// the greatest evidence; anew in every iteration, and no less than what brings the misfit to a tenth.
/// @param about    what the field is smooth about: there the changes begin
/// @param strains  of the elements under the press in that law: elements x 6
PressSample fit_sample(const PressScene& scene, int press, const std::shared_ptr<const MaterialLaw>& about,
                       const MatrixX& strains, const ElementSmoothness& smoothness, const SampleFitOptions& options);

/// Jacobian of a press' coordinates [m] by the elements' ln factor and logit of nu (2 T columns: first all factors), at
/// the equilibrium of `body`, whose law is that one.
enum class JacobianBy { Tangents, Adjoints };
MatrixX sample_jacobian(PressedBody& body, const Body& mesh, const ChangedLaw& law, JacobianBy by);

/// The linear law that comes closest to a law's stress at one deformation, element by element: least squares over
/// lambda ((1 - 2 nu) e + nu tr(e) I), held lightly to what the law is at rest.
/// @param strains  elements x 6: xx, yy, zz, xy, xz, yz, of S - I in the corotated frame
std::vector<SmallStrainModuli> secant_moduli(const MaterialLaw& law, const MatrixX& strains);

/// That of one element: of a strain and its stress dW/dS [Pa].
SmallStrainModuli secant_moduli(const Matrix3& strain, const Matrix3& stress, const SmallStrainModuli& at_rest);

/// Stress dW/dS of every element at its strain: elements x 6 [Pa]. Not finite where the law knows no such strain.
MatrixX stresses_of(const MaterialLaw& law, const MatrixX& strains);

/// Poisson's ratio's unconstrained number, nu in (-0.5, 0.5), and back.
double unconstrained_ratio(double nu);
double ratio_of(double unconstrained);

}  // namespace pliant
