#include "mismatch/sensor_correction.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace pliant {

namespace {

/// d exp(w) = exp(w) [J dw]_x with J the right Jacobian of the rotation group.
Matrix3 right_jacobian(const Vector3& w) {
  const double a2 = w.squaredNorm(), a = std::sqrt(a2);
  const Matrix3 W = cross_matrix(w);
  const double first = a < 1e-4 ? 0.5 - a2 / 24.0 : (1.0 - std::cos(a)) / a2;
  const double second = a < 1e-4 ? 1.0 / 6.0 - a2 / 120.0 : (a - std::sin(a)) / (a2 * a);
  return Matrix3::Identity() - first * W + second * W * W;
}

}  // namespace

Sight sight_of(const PinholeCamera& camera, const Vector3& point) {
  const Vector3 way = point - camera.camera_to_world.translation, axis = camera.camera_to_world.rotation.col(2);
  return {way.normalized(), way.norm(), way - axis.dot(way) * axis};
}

SensorCorrection::SensorCorrection(const Vector3& centre, const Values& values)
    : centre_(centre),
      turn_(values.segment<3>(1)),
      shift_(values.segment<3>(4)),
      error_(values[0]),
      range_scale_(values[7]),
      focal_error_(values[8]) {
  const double angle = turn_.norm();
  rotation_ = angle > 0.0 ? Eigen::AngleAxisd(angle, turn_ / angle).toRotationMatrix() : Matrix3(Matrix3::Identity());
}

Vector3 SensorCorrection::read(const Vector3& point, const Sight& sight) const {
  return point - (error_ + range_scale_ * sight.distance) * sight.direction + focal_error_ * sight.off_axis - centre_;
}

Vector3 SensorCorrection::apply(const Vector3& point, const Sight& sight) const {
  return centre_ + rotation_ * read(point, sight) + shift_;
}

SensorCorrection::Jacobian SensorCorrection::jacobian(const Vector3& point, const Sight& sight) const {
  Jacobian J;
  J.col(0) = -rotation_ * sight.direction;
  J.middleCols<3>(1) = -rotation_ * cross_matrix(read(point, sight)) * right_jacobian(turn_);
  J.middleCols<3>(4).setIdentity();
  J.col(7) = sight.distance * J.col(0);
  J.col(8) = rotation_ * sight.off_axis;
  return J;
}

MatrixX SensorBlocks::rows(const MatrixX& parameters) const {
  MatrixX own(SensorCorrection::size, parameters.cols());
  own << parameters.row(error), parameters.middleRows<3>(turn), parameters.middleRows<3>(shift),
      parameters.row(range_scale), parameters.row(focal_error);
  return own;
}

SensorCorrection::Values SensorBlocks::values(const VectorX& theta) const {
  SensorCorrection::Values values;
  values << theta[error], theta.segment<3>(turn), theta.segment<3>(shift), theta[range_scale], theta[focal_error];
  return values;
}

void SensorBlocks::add(const SensorCorrection::Values& values, VectorX& theta) const {
  theta[error] += values[0];
  theta.segment<3>(turn) += values.segment<3>(1);
  theta.segment<3>(shift) += values.segment<3>(4);
  theta[range_scale] += values[7];
  theta[focal_error] += values[8];
}

SensorBlocks SensorBlocks::moved(const std::function<ParameterHandle(const ParameterHandle&)>& there) const {
  return {there(error), there(turn), there(shift), there(range_scale), there(focal_error)};
}

SensorBlocks add_sensor_blocks(ParameterLayout& layout, const std::string& name, const std::string& error) {
  SensorBlocks blocks;
  blocks.error = layout.add({error + "@" + name, "m", 1, Role::Sensor});
  blocks.turn = layout.add({"sensor_turn@" + name, "rad", 3, Role::Sensor});
  blocks.shift = layout.add({"sensor_shift@" + name, "m", 3, Role::Sensor});
  blocks.range_scale = layout.add({"range_scale@" + name, "1", 1, Role::Sensor});
  blocks.focal_error = layout.add({"focal_error@" + name, "1", 1, Role::Sensor});
  return blocks;
}

}  // namespace pliant
