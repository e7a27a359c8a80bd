#pragma once

#include <span>
#include <vector>

#include "estimation/cost.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// By how far the surface of an object lies outside its scan [m]: a Gaussian field of a few independent standard normal
/// coefficients. The first is what the whole surface has in common, as the cover of plush; the others are what is
/// smooth: kernels about places that are spread over the scan, made independent. Either has half of the variance.
class ScanErrors {
 public:
  static constexpr int count = 1 + 16;  ///< of coefficients
  /// @param deviation     of the scan along its normals [m]
  /// @param size          of the object [m]
  /// @param coefficients  `count` of them
  ScanErrors(const TriangleMesh& scan, double deviation, double size, std::span<const double> coefficients);
  /// @param p  a place of the scan [m]
  double operator()(const Vector3& p) const;

 private:
  double common_ = 0.0, inverse_square_ = 0.0;
  std::vector<Vector3> places_;
  VectorX weights_;
};

/// -ln of the prior density of coefficients, but for a constant.
double prior_of_scan_errors(std::span<const double> coefficients);

/// One Gauss-Newton step of an estimate together with the errors of the scan, and what is left open after it.
struct ScanErrorStep {
  std::vector<double> coefficients;  ///< after it, of `most_deviations` at most
  VectorX shift;                     ///< of the unconstrained estimate
  double promise = 0.0;              ///< by how much the cost falls, with the prior of the coefficients
  /// How far the estimate follows each coefficient, one column each: by as much as a scan errs, whatever the residuals
  /// say of it. What else a model lacks looks like errors of the scan too, so that these are told less well than noise
  /// alone would have it.
  MatrixX follows;
};

inline constexpr double most_deviations = 2.5;  ///< of a coefficient from none

/// The step from an evaluation with the rows of its residuals and their derivatives. Residuals by coefficients are
/// differences between models whose surfaces lie elsewhere and one that lies where the evaluation's does, all at the
/// same estimate; it may be the evaluation's own or a coarser one. One that could not be simulated tells nothing.
/// @param about         of the model that others lie beside
/// @param moved         one a coefficient, which is larger by `width` there
/// @param coefficients  of `at`
ScanErrorStep scan_error_step(const CostEvaluation& at, const CostEvaluation& about,
                              std::span<const CostEvaluation> moved, double width,
                              std::span<const double> coefficients);

}  // namespace pliant
