#pragma once

#include <functional>
#include <string>

#include "parameters/layout.hpp"

namespace pliant {

/// What is wrong with where a sensor puts its points: a constant error of its range (light that enters the material
/// comes back late) or of its outlines (masks that reach beyond the object, or not as far), and a small rigid motion,
/// that of its own pose or of the scan:
///   p' = o + exp(turn) (p - error d - o) + shift,
/// with d the direction from the sensor to the point, or out of the outline, and o a fixed centre near the object.
class SensorCorrection {
 public:
  static constexpr int size = 7;  ///< error along d [m], turn [rad], shift [m]
  using Values = Eigen::Matrix<double, size, 1>;
  using Jacobian = Eigen::Matrix<double, 3, size>;

  SensorCorrection(const Vector3& centre, const Values& values);
  /// @param point [m]
  /// @param view  unit direction along which the sensor errs; zero where there is none
  Vector3 apply(const Vector3& point, const Vector3& view) const;
  /// Derivative of the corrected point by the values.
  Jacobian jacobian(const Vector3& point, const Vector3& view) const;
  double error() const { return error_; }

 private:
  Vector3 centre_, turn_, shift_;
  double error_;
  Matrix3 rotation_;
};

/// Where the correction of one sensor stands in a parameter vector.
struct SensorBlocks {
  ParameterHandle error;  ///< [m], of its range or its outlines
  ParameterHandle turn;   ///< 3, [rad]
  ParameterHandle shift;  ///< 3, [m]

  std::vector<ParameterHandle> all() const { return {error, turn, shift}; }
  /// The sensor's rows of a matrix with one row a parameter: `SensorCorrection::size` of them.
  MatrixX rows(const MatrixX& parameters) const;
  SensorCorrection::Values values(const VectorX& theta) const;
  /// theta += values
  void add(const SensorCorrection::Values& values, VectorX& theta) const;
  /// The same blocks of another layout, where `there` says.
  SensorBlocks moved(const std::function<ParameterHandle(const ParameterHandle&)>& there) const;
};

/// Appends the blocks of a sensor's correction: "range_error@name" or what else its readings err by,
/// "sensor_turn@name", "sensor_shift@name". Throws std::invalid_argument where they are there already.
SensorBlocks add_sensor_blocks(ParameterLayout& layout, const std::string& name,
                               const std::string& error = "range_error");

}  // namespace pliant
