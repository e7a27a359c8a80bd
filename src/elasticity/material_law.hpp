#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/types.hpp"
#include "elasticity/polar.hpp"

namespace pliant {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
/// Symmetric strains or stresses as xx, yy, zz, xy, xz, yz (Bickel 2009, section 3.2): tensor components, no factor 2.
using Strain6 = Eigen::Matrix<double, 6, 1>;

/// The entries of a matrix, column by column; a view of it.
inline auto vec(const Matrix3& m) { return Eigen::Map<const Vector9>(m.data()); }

/// What a deformed point of the material stores and how hard it pulls back.
struct PointStress {
  double energy = 0.0;  ///< [J/m^3] of the stress-free volume; infinite where the law admits no such deformation
  Matrix3 P = Matrix3::Zero();  ///< first Piola-Kirchhoff stress dW/dF [Pa]
  Matrix3 left, right;          ///< rotations of the frame below
  Matrix9 tangent;              ///< d(left^T P right) / d(left^T F right) [Pa], columns of F first; symmetric
};

/// Small-strain constants of an isotropic material.
struct SmallStrainModuli {
  double youngs_modulus, poissons_ratio;  ///< [Pa], [-]
};

/// A point of an element at a deformation gradient, and where its stress goes.
struct DeformedPoint {
  int element;
  const Matrix3* F;
  PointStress* stress;
};

/// An elastic material: energy of the deformation gradient F, the same in every rotated frame. Every element has its
/// own parameters q, some of which may vary over a body. All laws here have an energy, so that no closed path of
/// deformations gives or takes work. Reading from several threads is safe.
class MaterialLaw {
 public:
  virtual ~MaterialLaw() = default;
  virtual std::string name() const = 0;
  virtual int element_count() const = 0;
  /// Energy, stress and, where asked for, tangent of an element at F.
  virtual void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const = 0;
  /// The same of several points, which may cost less than one by one, up to rounding.
  virtual void stresses(std::span<const DeformedPoint> points, bool with_tangent) const {
    for (const DeformedPoint& p : points) stress(p.element, *p.F, with_tangent, *p.stress);
  }
  virtual SmallStrainModuli small_strain(int element) const = 0;
  /// Whether the energy follows from the principal stretches alone.
  virtual bool is_isotropic() const { return true; }
  /// Whether tangents stand in the frame of the principal stretches: `left` and `right` are U and V of F.
  virtual bool has_principal_frame() const { return false; }

  /// Numbers q of an element that can be estimated; none where `parameter_names` is empty.
  virtual std::vector<std::string> parameter_names() const { return {}; }
  /// dP / dq_k at F [Pa per unit of q_k].
  virtual void parameter_derivatives(int element, const Matrix3& F, std::span<Matrix3> out) const {
    (void)element, (void)F, (void)out;
  }

  /// Change of the tangent dP/dF, columns of F first, in the frame of the world [Pa], for a change dF [-]; symmetric.
  /// Laws that do not have it in closed form take central differences of fourth order of their tangent, whose error is
  /// about 1e-11 of it; NaN where the law knows no deformation beside F.
  virtual Matrix9 tangent_derivative(int element, const Matrix3& F, const Matrix3& dF) const;
  /// Changes of `parameter_derivatives`, likewise.
  virtual void parameter_derivative_changes(int element, const Matrix3& F, const Matrix3& dF,
                                            std::span<Matrix3> out) const;
};

/// F = U diag(stretch) V^T with rotations U and V, stretches ascending.
struct PrincipalStretches {
  PrincipalStretches() = default;
  explicit PrincipalStretches(const Matrix3& F);
  /// Of up to so many deformations beside each other, by Jacobi's rotations in the lanes of wide registers.
  static constexpr std::size_t lanes = 8;
  static void find(std::span<const Matrix3* const> F, std::span<PrincipalStretches> out);

  Vector3 stretch = Vector3::Ones();
  Matrix3 U = Matrix3::Identity(), V = Matrix3::Identity();
  bool is_valid = false;  ///< J > 0 and no stretch is lost to rounding; else there is none of the others
};

/// Turns a tangent given in the frame of `left` and `right` into that of the world.
Matrix9 world_tangent(const PointStress& stress);

/// Young's modulus at a deformation F = R U [Pa]: the slope of the Biot stress dW/dU by a further strain along the
/// principal direction of the greatest strain |U - I|, the stress in all other directions staying as it is. Of a linear
/// law it is Young's modulus whatever the strain. Not a number where the law knows no such deformation.
double tangent_modulus(const MaterialLaw& law, int element, const Matrix3& F);
/// The same of a tangent dP/dF [Pa] in the frame of the world, columns of F first, at F = R S.
double tangent_modulus(const Matrix9& tangent, const Polar& polar);

/// A law whose energy is another's times a factor > 0: everything is as much stiffer. It has no parameters of its own.
std::shared_ptr<const MaterialLaw> scaled_law(std::shared_ptr<const MaterialLaw> law, double factor);

/// Laws whose parameters stand in a table: elements x parameters.
class TabulatedLaw : public MaterialLaw {
 public:
  int element_count() const override { return int(table_.rows()); }
  const MatrixX& table() const { return table_; }
  /// The same law of other elements. Throws std::invalid_argument for inadmissible numbers.
  [[nodiscard]] virtual std::shared_ptr<TabulatedLaw> with_table(MatrixX table) const = 0;
  /// @param table  elements x `parameter_names().size()`. Throws std::invalid_argument for inadmissible numbers.
  void set_table(MatrixX table);

 protected:
  virtual void check(const MatrixX& table) const = 0;
  MatrixX table_;
};

/// Linear elasticity in a frame that turns along (Bickel 2009, eq. 1-7): with F = R S and the strain e = S - I,
///   W = e . E e / 2,   E = lambda G + alpha H,
/// which in tensors is (lambda - 2 alpha) e + alpha tr(e) I: alpha is Lame's first parameter, lambda - 2 alpha twice
/// the shear modulus. (G and H as printed belong to engineering shear strains, 2 e_xy.) q = (lambda, alpha) [Pa].
class LinearLaw : public TabulatedLaw {
 public:
  explicit LinearLaw(MatrixX table) { set_table(std::move(table)); }
  std::shared_ptr<TabulatedLaw> with_table(MatrixX table) const override {
    return std::make_shared<LinearLaw>(std::move(table));
  }
  std::string name() const override { return "linear"; }
  std::vector<std::string> parameter_names() const override { return {"lambda", "alpha"}; }
  void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const override;
  void parameter_derivatives(int element, const Matrix3& F, std::span<Matrix3> out) const override;
  SmallStrainModuli small_strain(int element) const override;

 protected:
  void check(const MatrixX& table) const override;
};

/// (lambda, alpha) of Young's modulus and Poisson's ratio (eq. 6), and back.
struct LambdaAlpha {
  double lambda, alpha;
};
LambdaAlpha lambda_alpha(const SmallStrainModuli& moduli);
SmallStrainModuli moduli_of(const LambdaAlpha& p);

/// Ogden's law for compressible foams and rubbers (Ogden 1972; Storakers 1986), of N terms:
///   W = sum_i 2 mu_i / a_i^2 [l1^a_i + l2^a_i + l3^a_i - 3 + (J^(-a_i b_i) - 1) / b_i],   b_i = nu_i / (1 - 2 nu_i)
/// with the principal stretches l and J = l1 l2 l3. The small-strain shear modulus is the sum of mu_i, and nu_i the
/// Poisson's ratio of a term. With mu_i > 0 every term is convex in the logarithmic strains, so stress never falls as
/// strain grows (Hill's stability). Negative exponents stiffen in compression, exponents above 2 in tension.
/// q = (mu_1 [Pa], a_1 [-], nu_1 [-], mu_2, ...).
class OgdenLaw : public TabulatedLaw {
 public:
  explicit OgdenLaw(MatrixX table) { set_table(std::move(table)); }
  std::shared_ptr<TabulatedLaw> with_table(MatrixX table) const override {
    return std::make_shared<OgdenLaw>(std::move(table));
  }
  std::string name() const override { return "ogden"; }
  bool has_principal_frame() const override { return true; }
  int terms() const { return int(table_.cols()) / 3; }
  std::vector<std::string> parameter_names() const override;
  void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const override;
  void stresses(std::span<const DeformedPoint> points, bool with_tangent) const override;
  void parameter_derivatives(int element, const Matrix3& F, std::span<Matrix3> out) const override;
  Matrix9 tangent_derivative(int element, const Matrix3& F, const Matrix3& dF) const override;
  SmallStrainModuli small_strain(int element) const override;

 protected:
  void check(const MatrixX& table) const override;

 private:
  void stress_of(int element, const PrincipalStretches& p, bool with_tangent, PointStress& out) const;
};

/// The compressible neo-Hookean law (Smith, de Goes, Kim 2018 without their barrier at the origin), at every point what
/// `MeanStrainCorrection` is in the mean of an element: with J = det F and Lame's constants at rest,
///   W = mu / 2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu) / 2 (J - 1)^2.
/// Its moduli at rest are exactly mu and lambda. It is smooth at all deformations, those that turn the material inside
/// out among them. All of it, its third derivative too, is in closed form. q = (mu, lambda) [Pa].
class NeoHookeanLaw : public TabulatedLaw {
 public:
  explicit NeoHookeanLaw(MatrixX table) { set_table(std::move(table)); }
  std::shared_ptr<TabulatedLaw> with_table(MatrixX table) const override {
    return std::make_shared<NeoHookeanLaw>(std::move(table));
  }
  std::string name() const override { return "neo_hookean"; }
  std::vector<std::string> parameter_names() const override { return {"mu", "lambda"}; }
  void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const override;
  void parameter_derivatives(int element, const Matrix3& F, std::span<Matrix3> out) const override;
  Matrix9 tangent_derivative(int element, const Matrix3& F, const Matrix3& dF) const override;
  void parameter_derivative_changes(int element, const Matrix3& F, const Matrix3& dF,
                                    std::span<Matrix3> out) const override;
  SmallStrainModuli small_strain(int element) const override;

 protected:
  void check(const MatrixX& table) const override;
};

/// Stress and, where asked for, tangent of an energy of the strain e = S - I in the frame of R, F = R S.
/// @param T  dW/de [Pa], symmetric
/// @param C  d2W/de2 [Pa] in Mandel's components (xx, yy, zz, sqrt 2 xy, sqrt 2 xz, sqrt 2 yz), symmetric; null: stress
///           alone
void set_strain_stress(const Polar& polar, const Matrix3& T, const Matrix6* C, PointStress& out);
/// Adds them to the stress and, where there is a C, to the tangent of another energy at the same F, which then stands
/// in the frame of R.
void add_strain_stress(const Polar& polar, const Matrix3& T, const Matrix6* C, PointStress& out);

/// The law of a name ("linear", "neo_hookean", "ogden") and a table; null for other names. Throws
/// std::invalid_argument for inadmissible numbers.
std::shared_ptr<TabulatedLaw> tabulated_law(const std::string& name, MatrixX table);

/// Symmetric strains or stresses as tensors; and in Mandel's components, in which the product of two is that of the
/// tensors: xx, yy, zz, sqrt 2 xy, sqrt 2 xz, sqrt 2 yz.
Matrix3 tensor_of(const Strain6& components);
Strain6 components_of(const Matrix3& tensor);
Strain6 to_mandel(const Strain6& components);
Strain6 from_mandel(const Strain6& mandel);

}  // namespace pliant
