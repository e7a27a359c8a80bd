#pragma once

#include "elasticity/element_moduli.hpp"
#include "elasticity/force_term.hpp"
#include "elasticity/mean_strain.hpp"
#include "elasticity/polar.hpp"

namespace pliant {

/// Corotated linear elasticity with one rotation an element (Wang 2015, eq. 1; Weiss 2020, eq. 31):
///   f(z | p) = - sum_e R_e(p) K_e (R_e(p)^T z - X).
class Elasticity : public ForceTerm {
 public:
  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::Blended; }

  /// Elastic energy [J] of the positions with the rotations of the lag point; of the neo-Hookean law, whose mean strain
  /// is the lag point's, only where the positions are that point.
  virtual double energy(const Points& z) const = 0;
  /// Mean Cauchy stress of an element at the lag point, P F^T / det F [Pa]; not a number where the law knows no such
  /// deformation. Safe from several threads.
  virtual Matrix3 cauchy_stress(int element) const = 0;
  /// Young's modulus of an element at its mean deformation at the lag point [Pa] (`tangent_modulus` of its law). Safe
  /// from several threads.
  virtual double tangent_modulus(int element) const = 0;
  /// Rotations at the next lag point are looked for from where another elasticity of the body had them last.
  void look_for_rotations_from(const Elasticity& other) { polar_ = other.polar_; }
  /// Of an element at the lag point.
  const Polar& rotation(int element) {
    find_rotations();
    return polar_[std::size_t(element)];
  }

 protected:
  /// Sets `polar_` about the lag point, where linearising did not.
  virtual void find_rotations() {}
  std::vector<Polar> polar_;
};

/// The elasticity of any kind of body, its parameters in these blocks. With a neo-Hookean law the stress of each
/// element's mean deformation at the lag point is that law's, and what its deformation departs from the mean stays
/// linear in the turning frame,
///   f(z | p) = - sum_e R_e(p) K_e (R_e(p)^T z - X) + V_e P_e(F_e(p), F_e(z) - F_e(p)) g_a,
/// with P_e of `MeanStrainCorrection`; the term's matrix is symmetric and positive.
/// Throws std::invalid_argument where there is not one block for each control of the body's field of moduli.
std::unique_ptr<Elasticity> make_elasticity(std::shared_ptr<const Body> body, const MaterialBlocks& blocks,
                                            ElasticLaw law = ElasticLaw::Corotated);

}  // namespace pliant
