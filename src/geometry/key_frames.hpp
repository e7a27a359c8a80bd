#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <stdexcept>
#include <vector>

#include "geometry/camera.hpp"

namespace pliant {

/// N numbers at given instants, and smoothly between them: monotone cubics (Fritsch and Carlson 1980), which overshoot
/// no key and stand still at the first and the last. Before the first and after the last they stay.
template <int N>
class KeyFrames {
 public:
  using Value = Eigen::Matrix<double, N, 1>;
  struct Key {
    double time;  ///< [s]
    Value value;
  };

  /// Always zero.
  KeyFrames() : KeyFrames(Value(Value::Zero())) {}
  /// Always the same.
  explicit KeyFrames(const Value& value) : KeyFrames(std::vector<Key>{{0.0, value}}) {}
  /// Throws std::invalid_argument where there is no key, or times do not increase.
  explicit KeyFrames(std::vector<Key> keys) : keys_(std::move(keys)), slopes_(keys_.size(), Value(Value::Zero())) {
    if (keys_.empty()) throw std::invalid_argument("key frames need a key");
    for (std::size_t k = 1; k < keys_.size(); ++k)
      if (!(keys_[k].time > keys_[k - 1].time)) throw std::invalid_argument("times of key frames must increase");
    for (std::size_t k = 1; k + 1 < keys_.size(); ++k)
      for (int i = 0; i < N; ++i) slopes_[k][i] = slope_at(k, i);
  }

  const std::vector<Key>& keys() const { return keys_; }

  /// @param time  [s]
  Value at(double time) const {
    if (time <= keys_.front().time) return keys_.front().value;
    if (time >= keys_.back().time) return keys_.back().value;
    const auto after = std::ranges::upper_bound(keys_, time, {}, &Key::time);
    const auto k = std::size_t(after - keys_.begin()) - 1;
    const double h = keys_[k + 1].time - keys_[k].time, s = (time - keys_[k].time) / h, r = 1.0 - s;
    return (1.0 + 2.0 * s) * r * r * keys_[k].value + s * r * r * h * slopes_[k] +
           s * s * (3.0 - 2.0 * s) * keys_[k + 1].value - s * s * r * h * slopes_[k + 1];
  }

 private:
  /// Weighted harmonic mean of the slopes on both sides; zero where they differ in sign.
  double slope_at(std::size_t k, int i) const {
    const double before = keys_[k].time - keys_[k - 1].time, after = keys_[k + 1].time - keys_[k].time;
    const double left = (keys_[k].value[i] - keys_[k - 1].value[i]) / before;
    const double right = (keys_[k + 1].value[i] - keys_[k].value[i]) / after;
    if (left * right <= 0.0) return 0.0;
    const double w_left = 2.0 * after + before, w_right = after + 2.0 * before;
    return (w_left + w_right) / (w_left / left + w_right / right);
  }

  std::vector<Key> keys_;
  std::vector<Value> slopes_;  // [1/s]
};

/// The rotation about a vector by its length [rad].
inline Matrix3 rotation_of(const Vector3& turn) {
  const double angle = turn.norm();
  return angle > 0.0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Matrix3(Matrix3::Identity());
}

/// A rigid motion over time: a shift [m] and a turn about a centre that moves along.
class KeyedMotion {
 public:
  /// Stays where it is.
  KeyedMotion() = default;
  /// @param centre  about which it turns, where the shift is zero [m]
  /// @param keys    shift [m], then rotation vector [rad]: turns of any number of revolutions about one axis are exact
  KeyedMotion(const Vector3& centre, KeyFrames<6> keys) : centre_(centre), keys_(std::move(keys)) {}

  /// From where points are for a zero shift and turn to where they are at a time [s].
  RigidMotion at(double time) const {
    const Eigen::Matrix<double, 6, 1> value = keys_.at(time);
    RigidMotion motion;
    motion.rotation = rotation_of(value.tail<3>());
    motion.translation = centre_ + value.head<3>() - motion.rotation * centre_;
    return motion;
  }

 private:
  Vector3 centre_ = Vector3::Zero();
  KeyFrames<6> keys_;
};

}  // namespace pliant
