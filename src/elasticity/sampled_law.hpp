#pragma once

#include "elasticity/material_law.hpp"

namespace pliant {

/// One element's stiffness as it was found under several deformations, interpolated in the space of strains
/// (Bickel 2009, eq. 8):
///   p(e) = c + sum_i w_i |e - e_i|,   sum_i w_i = 0,   p = (lambda, nu),
/// with the biharmonic kernel. The constant lets one sample be one stiffness, and with it the weights' sum vanishes, so
/// that p levels off far away.
struct StrainSamples {
  std::vector<Strain6> strains;                     ///< e_i
  std::vector<Eigen::Vector2d> weights;             ///< w_i [Pa], [-]
  Eigen::Vector2d constant{1.0, 0.0};               ///< c
  Eigen::Vector2d least{1.0, 0.0}, most{1.0, 0.0};  ///< of the samples that p was found from
};

/// The material of sampled stiffnesses. Eq. 8 alone has stress E(p(e)) e, whose work depends on the path of strains:
/// along some closed paths it gives energy. Here
///   W(e) = integral over t in (0, 1) of t e . E(p(t e)) e:
/// the work along the straight path from no strain to e. It is an energy, so no closed path gives or takes any;
/// and along every such straight path, stress does the work that eq. 8 says.
/// The norm of strains is that of energy, e . E e at the body's mean nu; so where stiffness depends on how much the
/// material is strained alone, stress is exactly E(p(e)) e.
/// Within the samples' range p is as interpolated; beyond it lambda levels off between half the least and twice the
/// greatest sampled one, and nu within (-1, 1/2): the material never turns soft beyond what was seen by more than that,
/// e . stress > 0 for every strain but for the error of the rule by which the integral is taken (five Gauss points),
/// and lambda_min |e|^2 <= 2 W <= lambda_max |e|^2 in the norm above (for constant nu). Nothing here can be estimated:
/// it is made from fits (`sample_material`).
class SampledLaw : public MaterialLaw {
 public:
  /// @param metric_nu  Poisson's ratio of the norm of strains
  SampledLaw(std::vector<StrainSamples> elements, double metric_nu);
  std::string name() const override { return "sampled"; }
  int element_count() const override { return int(elements_.size()); }
  void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const override;
  /// At zero strain.
  SmallStrainModuli small_strain(int element) const override;

  const StrainSamples& samples(int element) const { return elements_[std::size_t(element)].given; }
  double metric_nu() const { return metric_nu_; }
  /// (lambda, nu) at a strain.
  [[nodiscard]] Eigen::Vector2d interpolated(int element, const Strain6& strain) const;

 private:
  using Vector6 = Strain6;
  struct Element {
    StrainSamples given;
    std::vector<Vector6> centres;  // in the coordinates of the norm
  };
  std::vector<Element> elements_;
  double metric_nu_;
  Eigen::Matrix<double, 6, 6> to_metric_;  // from (xx, yy, zz, sqrt 2 xy, ...)
};

/// Stiffness of every element as one deformation of the whole body shows it.
struct MaterialSample {
  MatrixX strains;             ///< elements x 6: xx, yy, zz, xy, xz, yz
  std::vector<LambdaAlpha> p;  ///< one an element
};

struct BasisOptions {
  double tolerance = 0.02;  ///< of stress, relative to the greatest of the element's samples, > 0
  int max_samples = 12;     ///< an element, >= 1
};

struct SampledMaterial {
  std::shared_ptr<const SampledLaw> law;
  double mean_samples = 0.0;          ///< of an element
  std::vector<double> error_by_size;  ///< relative stress error with 1, 2, ... samples an element, root mean square
                                      ///< over elements and deformations: of E(p(e)) e
  double stress_misfit = 0.0;         ///< of the law's own stress in the end, relative to the greatest of the element's
                                      ///< samples by the tensors' norms, root mean square likewise
};

/// Chooses, element by element, few of the samples that reproduce all of them (section 4.2): first zero strain with the
/// mean stiffness of the smallest strains, then the one that is worst, until none is worse than the tolerance; with
/// each, the weights that fit all samples best. Samples count by their strain: an error of stress is what matters. In
/// the end the weights are those with which the stress of the law's energy comes closest to all samples'. Throws
/// std::invalid_argument where there are no samples.
SampledMaterial sample_material(const std::vector<MaterialSample>& samples, const BasisOptions& options = {});

}  // namespace pliant
