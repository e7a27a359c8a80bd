#pragma once

#include <functional>
#include <string>

#include "geometry/camera.hpp"
#include "parameters/layout.hpp"

namespace pliant {

/// How a sensor sees a point: along what errors of its readings move it.
struct Sight {
  Vector3 direction = Vector3::Zero();  ///< unit, from the sensor to the point, or out of an outline; zero: unknown
  double distance = 0.0;                ///< [m] from the sensor; 0: unknown
  Vector3 off_axis = Vector3::Zero();   ///< [m] from the sensor's optical axis to the point, across it
};

/// How a camera sees a point [m].
Sight sight_of(const PinholeCamera& camera, const Vector3& point);

/// What is wrong with where a sensor puts its points: a constant error of its range (light that enters the material
/// comes back late) or of its outlines (masks that reach beyond the object, or not as far), the shares by which its
/// ranges and the focal length that was taken for its own are too long, and a small rigid motion, that of its own pose
/// or of the scan:
///   p' = o + exp(turn) (p - (error + range_scale r) d + focal_error a - o) + shift,
/// with d the direction from the sensor to the point that it read, or out of the outline, r the distance, a the way
/// from the optical axis to that point, and o a fixed centre near the object.
class SensorCorrection {
 public:
  static constexpr int size = 9;  ///< error along d [m], turn [rad], shift [m], range scale and focal error [-]
  using Values = Eigen::Matrix<double, size, 1>;
  using Jacobian = Eigen::Matrix<double, 3, size>;

  SensorCorrection(const Vector3& centre, const Values& values);
  /// @param point [m]
  Vector3 apply(const Vector3& point, const Sight& sight) const;
  /// Derivative of the corrected point by the values.
  Jacobian jacobian(const Vector3& point, const Sight& sight) const;
  double error() const { return error_; }

 private:
  /// As the sensor would have read it, from the centre.
  Vector3 read(const Vector3& point, const Sight& sight) const;

  Vector3 centre_, turn_, shift_;
  double error_, range_scale_, focal_error_;
  Matrix3 rotation_;
};

/// Where the correction of one sensor stands in a parameter vector.
struct SensorBlocks {
  ParameterHandle error;        ///< [m], of its range or its outlines
  ParameterHandle turn;         ///< 3, [rad]
  ParameterHandle shift;        ///< 3, [m]
  ParameterHandle range_scale;  ///< [-]
  ParameterHandle focal_error;  ///< [-]

  std::vector<ParameterHandle> all() const { return {error, turn, shift, range_scale, focal_error}; }
  /// The sensor's rows of a matrix with one row a parameter: `SensorCorrection::size` of them.
  MatrixX rows(const MatrixX& parameters) const;
  SensorCorrection::Values values(const VectorX& theta) const;
  /// theta += values
  void add(const SensorCorrection::Values& values, VectorX& theta) const;
  /// The same blocks of another layout, where `there` says.
  SensorBlocks moved(const std::function<ParameterHandle(const ParameterHandle&)>& there) const;
};

/// Appends the blocks of a sensor's correction: "range_error@name" or what else its readings err by,
/// "sensor_turn@name", "sensor_shift@name", "range_scale@name", "focal_error@name".
/// Throws std::invalid_argument where they are there already.
SensorBlocks add_sensor_blocks(ParameterLayout& layout, const std::string& name,
                               const std::string& error = "range_error");

}  // namespace pliant
