#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "base/types.hpp"

namespace pliant {

using Vector2 = Eigen::Vector2d;

/// A lens that does not keep straight lines straight: OpenCV's model, of rays through (x, y, 1) in the camera's axes.
///   x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2
///   r^4 y' = y ( ... )                                                        + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 +
///   s4 r^4
/// and, with 14 coefficients, seen on a sensor that is tilted by tau_x and tau_y.
class LensDistortion {
 public:
  LensDistortion() = default;
  /// @param coefficients  k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]] [-]; none: a straight lens
  /// Throws std::invalid_argument for another number of them than 0, 4, 5, 8, 12 or 14, or one that is not finite.
  explicit LensDistortion(std::vector<double> coefficients);

  /// Whether there are so many coefficients of the model.
  static bool takes(std::size_t count);
  static constexpr const char* counts = "4, 5, 8, 12 or 14";

  const std::vector<double>& coefficients() const { return coefficients_; }
  bool bends() const { return bends_; }

  /// (x', y') of (x, y), and its derivative (2 x 2) where one is asked for. Beyond `reach` the model folds back; what
  /// lies there goes on outwards from it.
  Vector2 distorted(const Vector2& straight, Eigen::Matrix2d* derivative = nullptr) const;

  /// (x, y) of (x', y') by Newton's method; not a number where no ray within `reach` comes out there.
  Vector2 straight(const Vector2& distorted) const;

  /// Radius of (x, y) up to which what lies farther out is seen farther out; at most 10, 84 degrees.
  double reach() const { return reach_; }

  bool operator==(const LensDistortion& other) const { return coefficients_ == other.coefficients_; }

 private:
  enum : std::size_t { K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4, TauX, TauY };
  struct Radial {
    double factor, slope;  ///< of r^2, and its derivative by r^2
  };
  Radial radial(double r2) const;
  Vector2 within_reach(const Vector2& p, Eigen::Matrix2d* derivative) const;

  std::vector<double> coefficients_;
  std::array<double, 14> c_{};
  Matrix3 tilt_ = Matrix3::Identity();
  double reach_ = 10.0;
  bool bends_ = false, is_tilted_ = false;
};

}  // namespace pliant
