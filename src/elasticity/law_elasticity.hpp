#pragma once

#include <functional>
#include <span>

#include "elasticity/corotated.hpp"
#include "elasticity/material_field.hpp"
#include "elasticity/material_law.hpp"

namespace pliant {

/// The forces of a body of tetrahedra made of any material law, integrated at the elements' quadrature points (one of a
/// linear element, four of a quadratic one):
///   f = -dW/dx,   W(x) = sum_q V_q W_e(F_q),   F_q = sum_a x_a g_a^T.
/// As a force term it is made affine by its stiffness without the negative eigenvalues of every point's tangent, K+:
///   f(z | p) = f(p) - K+(p) (z - p),
/// so that a step's symmetric matrix is positive. Fully implicit steps have z = p but for stiffness damping, which
/// moves z on and so acts by K+(p). All derivatives are exact, the lag matrix with them: by p they hold the law's third
/// derivative along z - p (`MaterialLaw::tangent_derivative`) and how the projection K+ turns with it (Daleckii and
/// Krein's formula; where an eigenvalue is zero the projection has a kink, and the derivative is one of both sides').
/// By where the nodes are stress-free all of volumes, gradients and both deformations follow.
/// A law out of a parameter vector (`MaterialField`) also has derivatives by that; one given as it is has none.
/// Where the law knows no such deformation the force is not a number, so that steps back off.
class LawElasticity : public Elasticity {
 public:
  /// @param pattern  of the matrices to come; null: the body's own. It may have more rows than the body has nodes.
  /// Throws std::invalid_argument for hexahedra, and for a law of another number of elements.
  static std::unique_ptr<LawElasticity> make(const std::shared_ptr<const Body>& body,
                                             std::shared_ptr<const MaterialLaw> law,
                                             const std::shared_ptr<const BlockPattern>& pattern = nullptr);
  /// The law follows from the parameter vector by this layout; `law` is null before the first `set_parameters`.
  /// Throws std::invalid_argument for hexahedra, and for a layout of another number of control moduli than the body's.
  static std::unique_ptr<LawElasticity> make(const std::shared_ptr<const Body>& body, const LawLayout& layout);

  const MaterialLaw& law() const { return *law_; }
  /// A law of the same elements in its place.
  void set_law(std::shared_ptr<const MaterialLaw> law) { law_ = std::move(law); }

  enum class Stiffness {
    Exact,     ///< d2W/dx2
    Positive,  ///< the same with the negative eigenvalues of every point's tangent left out
  };

  /// Energies and stresses at x, and tangents where asked for. Returns the energy [J], infinite where the law knows no
  /// such deformation somewhere.
  virtual double evaluate(const Points& x, bool with_tangent) = 0;
  /// gradient += dW/dx at the last `evaluate`.
  virtual void add_gradient(Points& gradient) const = 0;
  /// matrix += scale K there.
  virtual void add_stiffness(Stiffness which, double scale, BlockMatrix& matrix) const = 0;
  /// product += scale K d there, without the matrix; n x 3 each.
  virtual void add_product(Stiffness which, const Points& d, double scale, Points& product) const = 0;
  /// Gives, element by element, the derivatives of dW/dx by the law's parameters of that element, there.
  /// @param visit  (element, nodes, derivatives 3 N x parameters)
  using VisitDerivatives =
      std::function<void(int element, std::span<const int> nodes, const Eigen::Ref<const MatrixX>& derivatives)>;
  virtual void for_parameter_derivatives(const VisitDerivatives& visit) const = 0;
  /// Mean over each element's points of S - I, F = R S, there; elements x 6.
  virtual MatrixX strains() const = 0;

  /// From now on the nodes are stress-free here, n x 3 [m]. False, and nothing changes, where an element would have no
  /// positive volume at a quadrature point; `least_volume_ratio` is that of these positions all the same.
  [[nodiscard]] virtual bool set_reference_positions(const Points& reference) = 0;
  /// Smallest ratio of a quadrature point's volume to that in the body as it was given.
  virtual double least_volume_ratio() const = 0;
  /// matrix += scale times the derivative of the force by where the nodes are stress-free, p, z and theta staying as
  /// they are: what `add_reference_tangents` multiplies by. Not symmetric.
  virtual void add_reference_matrix(double scale, BlockMatrix& matrix) = 0;

 protected:
  explicit LawElasticity(std::shared_ptr<const MaterialLaw> law) : law_(std::move(law)) {}
  std::shared_ptr<const MaterialLaw> law_;
};

/// S - I of F = R S, as xx, yy, zz, xy, xz, yz.
Strain6 biot_strain(const Matrix3& F);

/// Volume-weighted mean of the small-strain Young's moduli of a law [Pa].
double mean_modulus(const Body& body, const MaterialLaw& law);

}  // namespace pliant
