#pragma once

#include <span>

namespace pliant {

/// How far a measured coordinate of a marker errs: sqrt((w a)^2 + (b u)^2), with w the marker's own weight (of stated
/// deviations; else 1) and u how far the marker has moved [m].
struct MarkerNoise {
  double at_rest = 0.0;  ///< a, standard deviation of a coordinate where nothing has moved [m], >= 0
  double growth = 0.0;   ///< b, its growth with displacement [-], >= 0

  // NOLINTNEXTLINE(google-explicit-constructor): one deviation for all markers is the common case
  MarkerNoise(double deviation_at_rest = 0.0, double with_displacement = 0.0)
      : at_rest(deviation_at_rest), growth(with_displacement) {}
  /// [m]
  double deviation(double weight, double displacement) const;
  bool operator==(const MarkerNoise&) const = default;
};

/// The noise that residuals show: a and b of the greatest likelihood of Student's distribution with four degrees of
/// freedom, which bears outliers, its scale told as the deviation of normal residuals. Noise that grows is told only
/// where the likelihood gains more than Schwarz's criterion asks of one number.
/// @param residuals      [m], one a coordinate
/// @param weights        w, one a coordinate, > 0
/// @param displacements  u [m], one a coordinate, >= 0
/// @param least          a is no less [m], > 0; what comes back where there are no residuals
MarkerNoise robust_noise(std::span<const double> residuals, std::span<const double> weights,
                         std::span<const double> displacements, double least);

}  // namespace pliant
