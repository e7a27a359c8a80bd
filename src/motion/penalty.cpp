#include "motion/penalty.hpp"

#include <cmath>
#include <numbers>

namespace pliant {

namespace {

constexpr double softplus_reach = 30.0;  // smoothing lengths beyond which the softplus is below rounding

/// The integral of ln(1 + e^t) from minus infinity, for t <= 0: the dilogarithm -Li2(-e^t) by its series in
/// u = ln(1 + e^t) <= ln 2, u + u^2/4 + sum of B_2k u^(2k+1) / (2k+1)!.
double softplus_integral_below(double t) {
  const double u = std::log1p(std::exp(t)), square = u * u;
  // B_2k / (2k+1)!, k = 1..7
  constexpr double c[] = {1.0 / 36.0,        -1.0 / 3600.0,           1.0 / 211680.0,        -1.0 / 10886400.0,
                          1.0 / 526901760.0, -4.0647616451442255e-11, 8.9216910204564526e-13};
  double sum = 0.0;
  for (int k = 6; k >= 0; --k) sum = (sum + c[k]) * square;
  return u + 0.25 * square + u * sum;
}

/// The same for any t: F(t) = pi^2/6 + t^2/2 - F(-t).
double softplus_integral(double t) {
  if (t <= 0.0) return softplus_integral_below(t);
  return std::numbers::pi * std::numbers::pi / 6.0 + 0.5 * t * t - softplus_integral_below(-t);
}

}  // namespace

double Penalty::reach() const { return onset == Onset::Softplus ? softplus_reach * smoothing : smoothing; }

Penalty::Value Penalty::pressure_at(double d) const {
  Value v;
  const double k = stiffness, s = smoothing;
  if (onset == Onset::Softplus) {
    const double t = -d / s;
    const double sigmoid = t > 0.0 ? 1.0 / (1.0 + std::exp(-t)) : std::exp(t) / (1.0 + std::exp(t));
    const double softplus = t > 0.0 ? t + std::log1p(std::exp(-t)) : std::log1p(std::exp(t));
    v.pressure = k * s * softplus;
    v.slope = -k * sigmoid;
    v.curvature = k * sigmoid * (1.0 - sigmoid) / s;
  } else if (d < -s) {
    v.pressure = -k * d;
    v.slope = -k;
  } else if (d < s) {
    const double depth = s - d;
    v.pressure = k * depth * depth / (4.0 * s);
    v.slope = -k * depth / (2.0 * s);
    v.curvature = k / (2.0 * s);
  }
  return v;
}

Penalty::Value Penalty::at(double d) const {
  Value v = pressure_at(d);
  const double k = stiffness, s = smoothing;
  if (onset == Onset::Softplus) {
    v.energy = k * s * s * softplus_integral(-d / s);
  } else if (d < -s) {
    v.energy = k * (0.5 * d * d + s * s / 6.0);
  } else if (d < s) {
    const double depth = s - d;
    v.energy = k * depth * depth * depth / (12.0 * s);
  }
  return v;
}

}  // namespace pliant
