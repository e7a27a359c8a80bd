#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "parameters/layout.hpp"

namespace pliant {

/// How a physical value becomes unconstrained numbers of order one.
enum class Transform {
  Logarithm,      ///< positive scalars: p = ln(value)
  InverseSinh,    ///< scalars from 0 on: p = asinh(value / scale), linear below the scale and logarithmic beyond
  LogitHalf,      ///< Poisson's ratio in (0, 1/2): p = ln(nu / (1/2 - nu))
  Shift,          ///< a scalar of any sign: p = value / scale
  Vector,         ///< three numbers: p = value / scale
  Direction,      ///< three numbers whose length is known: p are two tilts about the origin's direction [rad]
  Strength,       ///< three numbers, behind what turns them: p = ln(their length / the origin's)
  PlanePosition,  ///< three numbers: shift along the origin's normal / scale, then two tilts of the normal [rad]
};

/// One estimable quantity of the scenes, a scalar, a vector or a plane.
struct Parameter {
  std::string name;  ///< as in result.json
  std::string unit;
  Transform transform = Transform::Logarithm;
  ParameterHandle at;  ///< its numbers; a plane's point, followed by its normal
  double scale =
      1.0;  ///< [unit] of an unconstrained step of one: of vectors, planes, shifts, and near 0 of `InverseSinh`
  double lower = 0.0;  ///< bounds of a scalar's value
  double upper = std::numeric_limits<double>::infinity();
  bool estimated = false;
  /// Normal prior in the unconstrained numbers, around `prior_mean`; infinite: none.
  double prior_std = std::numeric_limits<double>::infinity();
  VectorX prior_mean = {};
  /// Of a vector's prior: symmetric, its deviations are `prior_std` times this; empty: alike in all directions.
  MatrixX prior_shape = {};
  /// About what a plane (point, normal) or a direction moves; empty: the set's reference.
  VectorX origin = {};
  /// Whether it only stands for something else: forces for whoever held the object, parts of a scan's error. Of no
  /// interest one by one.
  bool is_auxiliary = false;
  /// Of a logarithm: what is observed follows the inverse of the value (a compliance, in series with others), so that
  /// a step is one of the inverse. Estimates, priors and deviations stay those of the logarithm.
  bool acts_by_inverse = false;
  /// How well it is known where it is not estimated, if somebody stated that: deviation of each unconstrained number;
  /// 0: it is exact.
  std::optional<double> given_std = {};
  Role role = Role::Material;  ///< that of its block; a `ParameterSet` sets it

  bool is_scalar() const { return transform < Transform::Vector; }
  int dimension() const {
    if (is_scalar() || transform == Transform::Strength) return 1;
    return transform == Transform::Direction ? 2 : 3;
  }
};

/// Whether a parameter is an elastic modulus [Pa].
bool is_modulus(const Parameter& parameter);
/// Whether a parameter belongs to the object itself: what all recordings of it have in common.
bool is_of_object(const Parameter& parameter);

/// The estimated parameters of a layout as one unconstrained vector p, with its map to the physical parameter vector
/// theta.
class ParameterSet {
 public:
  ParameterSet() = default;
  /// @param parameters  with handles of the layout
  /// @param reference   theta of everything that is not estimated
  /// Throws std::invalid_argument where the reference is not as long as the layout, or a handle is not of it.
  ParameterSet(ParameterLayout layout, std::vector<Parameter> parameters, VectorX reference);

  const ParameterLayout& layout() const { return layout_; }
  const std::vector<Parameter>& parameters() const { return parameters_; }
  const Parameter* find(const std::string& name) const;
  /// Chooses whether a parameter is estimated. Throws std::invalid_argument for an unknown name.
  void set_estimated(const std::string& name, bool estimated);
  /// Leaves a scalar at a value. Throws std::invalid_argument for an unknown name.
  void fix(const std::string& name, double value);
  const VectorX& reference() const { return reference_; }
  void set_reference(const VectorX& theta) { reference_ = theta; }
  /// A normal prior on the logarithms of several positive scalars together, beside their own priors: about zero, or,
  /// where `precision` gives a common factor no weight, on their ratios alone. Those that are not estimated stay at the
  /// reference. Throws std::invalid_argument for an unknown name or another kind of parameter.
  /// @param precision  names x names, symmetric, not negative
  void set_joint_prior(const std::vector<std::string>& names, MatrixX precision);
  const MatrixX& joint_precision() const { return joint_precision_; }  ///< empty: there is no joint prior
  /// Numbers of p of the estimated parameters of the joint prior, in its order.
  std::vector<Eigen::Index> joint_coordinates() const;

  int dimension() const;
  /// Name of each number of p: "youngs_modulus", "linear_velocity.x", "plane.tilt_1", ...
  std::vector<std::string> coordinate_names() const;
  /// The first number of p of the estimated parameter that stands at a handle. Throws std::invalid_argument where none
  /// does.
  Eigen::Index coordinate(const ParameterHandle& at) const;
  /// The parameter that each number of p belongs to.
  std::vector<const Parameter*> coordinate_parameters() const;

  [[nodiscard]] VectorX to_unconstrained(const VectorX& theta) const;
  [[nodiscard]] VectorX to_theta(const VectorX& p) const;
  /// d theta / d p, theta_size x dimension.
  [[nodiscard]] MatrixX jacobian(const VectorX& p) const;
  /// Moves p into the bounds.
  [[nodiscard]] VectorX clamp(const VectorX& p) const;

  /// Where a step leads from p, within the bounds: p + step to first order, along a curve where the parameter acts by
  /// its inverse.
  [[nodiscard]] VectorX moved(const VectorX& p, const VectorX& step) const;

  /// Negative logarithm of the priors (up to a constant), its gradient and its curvature.
  double prior(const VectorX& p, VectorX* gradient = nullptr, MatrixX* curvature = nullptr) const;

 private:
  /// Point and normal of a plane's origin, or a direction's vector.
  VectorX origin_of(const Parameter& parameter) const;
  template <class Function>
  void for_each_estimated(Function&& function) const;

  ParameterLayout layout_;
  std::vector<Parameter> parameters_;
  VectorX reference_;
  std::vector<int> joint_;  // numbers of the parameters of the joint prior
  MatrixX joint_precision_;
};

}  // namespace pliant
