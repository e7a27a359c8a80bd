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

SensorCorrection::SensorCorrection(const Vector3& centre, const Values& values)
    : centre_(centre), turn_(values.segment<3>(1)), shift_(values.tail<3>()), error_(values[0]) {
  const double angle = turn_.norm();
  rotation_ = angle > 0.0 ? Eigen::AngleAxisd(angle, turn_ / angle).toRotationMatrix() : Matrix3(Matrix3::Identity());
}

Vector3 SensorCorrection::apply(const Vector3& point, const Vector3& view) const {
  return centre_ + rotation_ * (point - error_ * view - centre_) + shift_;
}

SensorCorrection::Jacobian SensorCorrection::jacobian(const Vector3& point, const Vector3& view) const {
  Jacobian J;
  J.col(0) = -rotation_ * view;
  J.middleCols<3>(1) = -rotation_ * cross_matrix(point - error_ * view - centre_) * right_jacobian(turn_);
  J.rightCols<3>().setIdentity();
  return J;
}

MatrixX SensorBlocks::rows(const MatrixX& parameters) const {
  MatrixX own(SensorCorrection::size, parameters.cols());
  own << parameters.row(error), parameters.middleRows<3>(turn), parameters.middleRows<3>(shift);
  return own;
}

SensorCorrection::Values SensorBlocks::values(const VectorX& theta) const {
  SensorCorrection::Values values;
  values << theta[error], theta.segment<3>(turn), theta.segment<3>(shift);
  return values;
}

void SensorBlocks::add(const SensorCorrection::Values& values, VectorX& theta) const {
  theta[error] += values[0];
  theta.segment<3>(turn) += values.segment<3>(1);
  theta.segment<3>(shift) += values.tail<3>();
}

SensorBlocks SensorBlocks::moved(const std::function<ParameterHandle(const ParameterHandle&)>& there) const {
  return {there(error), there(turn), there(shift)};
}

SensorBlocks add_sensor_blocks(ParameterLayout& layout, const std::string& name, const std::string& error) {
  SensorBlocks blocks;
  blocks.error = layout.add({error + "@" + name, "m", 1, Role::Sensor});
  blocks.turn = layout.add({"sensor_turn@" + name, "rad", 3, Role::Sensor});
  blocks.shift = layout.add({"sensor_shift@" + name, "m", 3, Role::Sensor});
  return blocks;
}

}  // namespace pliant
