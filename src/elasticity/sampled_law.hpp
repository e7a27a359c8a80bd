#pragma once

#include "elasticity/material_law.hpp"

namespace pliant {

/// What samples say of one element's stress beyond a law of few numbers: a field of stress over strain that is the
/// gradient of an energy, with the biharmonic kernel |e - e_i| of Bickel 2009 (eq. 8), its tip rounded:
///   W(e) = sum_i v_i . d_i / rho_i,   d_i = e - e_i,   rho_i^2 = |d_i|^2 + width^2,
/// so the stress is sum_i (I / rho_i - d_i d_i^T / rho_i^3) v_i. These functions are a positive definite basis: any
/// stresses at any strains can be met. Far from all samples the stress falls like 1 / |e|, and the energy is bounded.
struct StressSamples {
  double width = 1.0;            ///< > 0
  std::vector<Strain6> strains;  ///< e_i
  std::vector<Strain6> weights;  ///< v_i [Pa]
};

/// The material of sampled stresses (after Bickel 2009): every element has a law of few numbers, its own, and on top of
/// it what is left of its samples (`StressSamples`). Between samples that is interpolation in the space of strains;
/// far beyond them it fades, and the law goes on: it stiffens as the element's samples stiffened. Stress is the
/// gradient of an energy, so no closed path of strains gives or takes work.
/// Eq. 8 of the paper interpolates stiffness, stress E(p(e)) e, which has no energy, and which levels off beyond the
/// samples whatever they say.
/// At rest there is no stress: a sample at no strain takes away what the others have there. Nothing here can be
/// estimated: it is made from fits (`sample_material`).
class SampledLaw : public MaterialLaw {
 public:
  /// Throws std::invalid_argument where the law and the samples are of different numbers of elements, or a width is
  /// not positive.
  SampledLaw(std::shared_ptr<const TabulatedLaw> law, std::vector<StressSamples> elements);
  std::string name() const override { return "sampled"; }
  int element_count() const override { return int(elements_.size()); }
  void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const override;
  /// Of the isotropic stiffness that is closest to that at rest.
  SmallStrainModuli small_strain(int element) const override;
  bool is_isotropic() const override { return false; }  // the samples lie where they lie

  const TabulatedLaw& law() const { return *law_; }
  const StressSamples& samples(int element) const { return elements_[std::size_t(element)].given; }

 private:
  struct Element {
    StressSamples given;
    std::vector<Strain6> centres, weights;  // in Mandel's components, the first at no strain
  };
  std::shared_ptr<const TabulatedLaw> law_;
  std::vector<Element> elements_;
};

/// Stress of every element as one deformation of the whole body shows it.
struct MaterialSample {
  MatrixX strains;   ///< elements x 6: xx, yy, zz, xy, xz, yz of S - I, F = R S
  MatrixX stresses;  ///< [Pa] likewise, dW/dS
};

struct BasisOptions {
  double tolerance = 0.02;  ///< of stress, relative to the greatest of the element's samples, > 0
  int max_samples = 12;     ///< an element, >= 1
};

struct SampledMaterial {
  std::shared_ptr<const SampledLaw> law;
  double mean_samples = 0.0;          ///< of an element
  std::vector<double> error_by_size;  ///< relative stress error with 0, 1, ... samples an element, root mean square
                                      ///< over elements and deformations
  double stress_misfit = 0.0;  ///< of the law's stress in the end, relative to the greatest of the element's samples
                               ///< by the tensors' norms, root mean square likewise
};

/// Makes a material of samples, element by element. First the numbers of the element's own law: the shared law's, as
/// far as the samples do not say otherwise (least squares of stress, held to the shared numbers). Then few of the
/// samples, which reproduce what that law leaves of all of them (section 4.2): the one that is worst, until none is
/// worse than the tolerance, and with each the weights that meet all samples best. How closely they are met in the end
/// follows from how far they contradict each other (evidence, MacKay 1992). What would make
/// the material turn soft, along the straight path through a sample up to three times its strain, is taken back.
/// @param shared  the law of all elements. Throws std::invalid_argument where there are no samples.
SampledMaterial sample_material(const std::shared_ptr<const TabulatedLaw>& shared,
                                const std::vector<MaterialSample>& samples, const BasisOptions& options = {});

}  // namespace pliant
