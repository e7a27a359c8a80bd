#pragma once

#include <span>

#include "elasticity/element_moduli.hpp"
#include "elasticity/mean_strain.hpp"
#include "elasticity/polar.hpp"

namespace pliant {

/// Elastic forces of tetrahedra as a function of where their nodes are stress-free, the deformed positions z and the
/// lag point p of those forces being known. Those of a material law are `LawElasticity`'s (`Material`), corotated
/// ones (Wang 2015, eq. 1 and appendix)
///   f_a = -E_e R integral of C : (R^T F - I) g_a,   F = sum_b z_b g_b^T,  R the rotation of F_p = sum_b p_b (mean
///   g_b)^T,
/// of a neo-Hookean mean strain also -E_e V P(F_p, F_z - F_p) mean g_a (`MeanStrainCorrection`), where volumes,
/// gradients g and rotations all follow from X. Hexahedra do not take part: their grid is regular when it is
/// stress-free. Positions and forces are n x 3 [m], [N].
class ReferenceForces {
 public:
  /// Corotated ones, and those of the law of the mean strain. Throws std::invalid_argument for a body of hexahedra.
  static std::unique_ptr<ReferenceForces> make(std::shared_ptr<const Body> body, const MaterialBlocks& blocks,
                                               ElasticLaw law);
  /// Kelvin-Voigt damping (`make_viscous_forces`), z being velocities [m/s]:
  ///   f_a = -beta E_e F integral of C : (F^T D) g_a,   D = sum_b z_b g_b^T,  F = sum_b p_b (mean g_b)^T.
  /// Throws as the one above.
  static std::unique_ptr<ReferenceForces> make_viscous(std::shared_ptr<const Body> body, const MaterialBlocks& blocks,
                                                       ParameterHandle stiffness_damping);
  virtual ~ReferenceForces() = default;

  virtual void set_parameters(const VectorX& theta) = 0;
  /// Fixes X, p and z; the calls below refer to them. False where an element of X has no positive volume somewhere.
  /// Forces are not numbers where a law knows no such deformation.
  [[nodiscard]] virtual bool linearise(const Points& X, const Points& p, const Points& z) = 0;
  /// At rest both are x.
  [[nodiscard]] bool linearise(const Points& X, const Points& x) { return linearise(X, x, x); }
  /// force += f
  virtual void add_force(Points& force) const = 0;
  /// matrix += scale df/dX, which is not symmetric.
  virtual void add_matrix(double scale, BlockMatrix& matrix) const = 0;
  /// force += df for changes of X, each into its own force; as many of the one as of the other
  virtual void add_tangents(std::span<const Points* const> d_references, std::span<Points* const> forces) const = 0;
  /// The cotangent of X for the cotangent `w` of f is added.
  virtual void add_adjoint(const Points& w, Points& reference_bar) const = 0;
  /// From the reference to p, of an element as a whole; not of viscous ones.
  virtual const Matrix3& rotation(int element) const = 0;
  /// Smallest ratio of a volume at a quadrature point to that in the body as it was given.
  virtual double least_volume_ratio() const = 0;
};

}  // namespace pliant
