#pragma once

namespace pliant {

/// A penalty against penetration: pressure as a function of the gap, with the energy that it stores.
struct Penalty {
  enum class Onset {
    Softplus,   ///< k s ln(1 + exp(-d / s)), the soft minimum of Weiss 2020, eq. 18: smooth, never quite zero
    Quadratic,  ///< 0 for d > s, k (s - d)^2 / (4 s) for |d| < s, -k d below: zero at a distance
  };
  double stiffness = 0.0;  ///< k, pressure for a penetration [Pa/m], > 0
  double smoothing = 0.0;  ///< s, length over which the pressure sets in [m], > 0
  Onset onset = Onset::Softplus;

  /// Of a gap d [m], negative inside.
  struct Value {
    double energy = 0.0;     ///< [J/m^2]
    double pressure = 0.0;   ///< -d energy / dd [Pa], >= 0
    double slope = 0.0;      ///< d pressure / dd [Pa/m], <= 0
    double curvature = 0.0;  ///< d2 pressure / dd2 [Pa/m^2], >= 0
  };
  [[nodiscard]] Value at(double gap) const;
  /// The same without the energy, which costs most of the softplus.
  [[nodiscard]] Value pressure_at(double gap) const;
  /// Gap beyond which the pressure is zero or below rounding [m].
  double reach() const;
};

}  // namespace pliant
