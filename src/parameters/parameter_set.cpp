#include "parameters/parameter_set.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/old_names.hpp"

namespace pliant {

namespace {

/// Two unit vectors that span a plane.
Eigen::Matrix<double, 3, 2> tangents_of(const Vector3& normal) {
  Eigen::Matrix<double, 3, 2> t;
  t.col(0) = normal.unitOrthogonal();
  t.col(1) = normal.cross(t.col(0));
  return t;
}

double logit_half(double nu) { return std::log(nu / (0.5 - nu)); }
double logistic_half(double p) { return 0.5 / (1.0 + std::exp(-p)); }

}  // namespace

bool is_modulus(const Parameter& p) { return p.role == Role::Material && p.unit == "Pa"; }

bool is_of_object(const Parameter& p) {
  return p.role == Role::Material || p.role == Role::Damping || p.role == Role::Inertia;
}

ParameterSet::ParameterSet(ParameterLayout layout, std::vector<Parameter> parameters, VectorX reference)
    : layout_(std::move(layout)), parameters_(std::move(parameters)), reference_(std::move(reference)) {
  if (reference_.size() != layout_.size())
    throw std::invalid_argument("the reference is not as long as the parameters' layout");
  for (Parameter& p : parameters_) p.role = layout_.block_of(p.at).role;
}

const Parameter* ParameterSet::find(const std::string& name) const {
  const std::string present = present_name(name);
  const auto it =
      std::find_if(parameters_.begin(), parameters_.end(), [&](const Parameter& p) { return p.name == present; });
  return it == parameters_.end() ? nullptr : &*it;
}

void ParameterSet::set_estimated(const std::string& name, bool estimated) {
  const Parameter* found = find(name);
  if (!found) throw std::invalid_argument("there is no parameter " + name);
  parameters_[std::size_t(found - parameters_.data())].estimated = estimated;
}

void ParameterSet::fix(const std::string& name, double value) {
  set_estimated(name, false);
  reference_[find(name)->at] = value;
}

void ParameterSet::set_joint_prior(const std::vector<std::string>& names, MatrixX precision) {
  joint_.clear();
  for (const std::string& name : names) {
    const Parameter* found = find(name);
    if (!found || found->transform != Transform::Logarithm)
      throw std::invalid_argument("there is no positive scalar " + name);
    joint_.push_back(int(found - parameters_.data()));
  }
  joint_precision_ = std::move(precision);
}

template <class Function>
void ParameterSet::for_each_estimated(Function&& function) const {
  int offset = 0;
  for (const Parameter& parameter : parameters_) {
    if (!parameter.estimated) continue;
    function(parameter, offset);
    offset += parameter.dimension();
  }
}

int ParameterSet::dimension() const {
  int sum = 0;
  for_each_estimated([&](const Parameter& parameter, int) { sum += parameter.dimension(); });
  return sum;
}

std::vector<std::string> ParameterSet::coordinate_names() const {
  std::vector<std::string> names;
  for_each_estimated([&](const Parameter& p, int) {
    if (p.is_scalar())
      names.push_back(p.name);
    else if (p.transform == Transform::Direction)
      for (const char* part : {".tilt_1", ".tilt_2"}) names.push_back(p.name + part);
    else if (p.transform == Transform::Strength)
      names.push_back(p.name + ".strength");
    else if (p.transform == Transform::Vector)
      for (const char* axis : {".x", ".y", ".z"}) names.push_back(p.name + axis);
    else
      for (const char* part : {".offset", ".tilt_1", ".tilt_2"}) names.push_back(p.name + part);
  });
  return names;
}

Eigen::Index ParameterSet::coordinate(const ParameterHandle& at) const {
  Eigen::Index found = -1;
  for_each_estimated([&](const Parameter& p, int first) {
    if (p.at == at) found = first;
  });
  if (found < 0) throw std::invalid_argument("no estimated parameter stands there");
  return found;
}

std::vector<const Parameter*> ParameterSet::coordinate_parameters() const {
  std::vector<const Parameter*> all;
  for_each_estimated([&](const Parameter& p, int) { all.insert(all.end(), std::size_t(p.dimension()), &p); });
  return all;
}

std::vector<Eigen::Index> ParameterSet::joint_coordinates() const {
  std::vector<int> place(parameters_.size(), -1);
  for_each_estimated([&](const Parameter& q, int at) { place[std::size_t(&q - parameters_.data())] = at; });
  std::vector<Eigen::Index> coordinates;
  for (const int number : joint_)
    if (place[std::size_t(number)] >= 0) coordinates.push_back(place[std::size_t(number)]);
  return coordinates;
}

VectorX ParameterSet::origin_of(const Parameter& parameter) const {
  if (parameter.origin.size() > 0) return parameter.origin;
  return reference_.segment(parameter.at, parameter.transform == Transform::PlanePosition ? 6 : 3);
}

VectorX ParameterSet::to_unconstrained(const VectorX& theta) const {
  VectorX p(dimension());
  for_each_estimated([&](const Parameter& q, int at) {
    const Eigen::Index i = q.at;
    switch (q.transform) {
      case Transform::Logarithm:
        p[at] = std::log(theta[i]);
        break;
      case Transform::InverseSinh:
        p[at] = std::asinh(theta[i] / q.scale);
        break;
      case Transform::LogitHalf:
        p[at] = logit_half(theta[i]);
        break;
      case Transform::Shift:
        p[at] = theta[i] / q.scale;
        break;
      case Transform::Vector:
        p.segment<3>(at) = theta.segment<3>(i) / q.scale;
        break;
      case Transform::Direction: {
        const Vector3 v0 = origin_of(q), v = theta.segment<3>(i);
        p.segment<2>(at) = tangents_of(v0.normalized()).transpose() * v / v.dot(v0.normalized());
        break;
      }
      case Transform::Strength:
        p[at] = std::log(theta.segment<3>(i).norm() / origin_of(q).norm());
        break;
      case Transform::PlanePosition: {
        const VectorX origin = origin_of(q);
        const Vector3 n0 = origin.tail<3>(), point = theta.segment<3>(i), n = theta.segment<3>(i + 3);
        p[at] = n0.dot(point - Vector3(origin.head<3>())) / q.scale;
        p.segment<2>(at + 1) = tangents_of(n0).transpose() * n / n.dot(n0);
        break;
      }
    }
  });
  return p;
}

VectorX ParameterSet::to_theta(const VectorX& p) const {
  VectorX theta = reference_;
  for_each_estimated([&](const Parameter& q, int at) {
    const Eigen::Index i = q.at;
    switch (q.transform) {
      case Transform::Logarithm:
        theta[i] = std::exp(p[at]);
        break;
      case Transform::InverseSinh:
        theta[i] = q.scale * std::sinh(p[at]);
        break;
      case Transform::LogitHalf:
        theta[i] = logistic_half(p[at]);
        break;
      case Transform::Shift:
        theta[i] = p[at] * q.scale;
        break;
      case Transform::Direction: {
        const Vector3 v0 = origin_of(q), n0 = v0.normalized();
        theta.segment<3>(i) = v0.norm() * (n0 + tangents_of(n0) * p.segment<2>(at)).normalized();
        break;
      }
      case Transform::Strength:  // along the direction that the numbers have by now
        theta.segment<3>(i) = origin_of(q).norm() * std::exp(p[at]) * Vector3(theta.segment<3>(i)).normalized();
        break;
      case Transform::Vector:
        theta.segment<3>(i) = p.segment<3>(at) * q.scale;
        break;
      case Transform::PlanePosition: {
        const VectorX origin = origin_of(q);
        const Vector3 n0 = origin.tail<3>();
        theta.segment<3>(i) = origin.head<3>() + p[at] * q.scale * n0;
        theta.segment<3>(i + 3) = (n0 + tangents_of(n0) * p.segment<2>(at + 1)).normalized();
        break;
      }
    }
  });
  return theta;
}

MatrixX ParameterSet::jacobian(const VectorX& p) const {
  MatrixX J = MatrixX::Zero(reference_.size(), dimension());
  for_each_estimated([&](const Parameter& q, int at) {
    const Eigen::Index i = q.at;
    switch (q.transform) {
      case Transform::Logarithm:
        J(i, at) = std::exp(p[at]);
        break;
      case Transform::InverseSinh:
        J(i, at) = q.scale * std::cosh(p[at]);
        break;
      case Transform::LogitHalf: {
        const double nu = logistic_half(p[at]);
        J(i, at) = nu * (1.0 - 2.0 * nu);
        break;
      }
      case Transform::Shift:
        J(i, at) = q.scale;
        break;
      case Transform::Direction: {
        const Vector3 v0 = origin_of(q), n0 = v0.normalized();
        const auto T = tangents_of(n0);
        const Vector3 m = n0 + T * p.segment<2>(at);
        const Vector3 n = m.normalized();
        J.block<3, 2>(i, at) = v0.norm() * (Matrix3::Identity() - n * n.transpose()) * T / m.norm();
        break;
      }
      case Transform::Strength:
        J.middleRows<3>(i) *= std::exp(p[at]);  // of what turns it
        J.block<3, 1>(i, at) = to_theta(p).segment<3>(i);
        break;
      case Transform::Vector:
        J.block<3, 3>(i, at) = q.scale * Matrix3::Identity();
        break;
      case Transform::PlanePosition: {
        const Vector3 n0 = origin_of(q).tail<3>();
        const auto T = tangents_of(n0);
        J.block<3, 1>(i, at) = q.scale * n0;
        const Vector3 m = n0 + T * p.segment<2>(at + 1);
        const Vector3 n = m.normalized();
        J.block<3, 2>(i + 3, at + 1) = (Matrix3::Identity() - n * n.transpose()) * T / m.norm();
        break;
      }
    }
  });
  return J;
}

VectorX ParameterSet::clamp(const VectorX& p) const {
  VectorX out = p;
  for_each_estimated([&](const Parameter& q, int at) {
    if (q.transform == Transform::Logarithm)
      out[at] = std::clamp(p[at], std::log(std::max(q.lower, 1e-300)), std::log(q.upper));
    else if (q.transform == Transform::InverseSinh)
      out[at] = std::clamp(p[at], std::asinh(q.lower / q.scale), std::asinh(q.upper / q.scale));
    else if (q.transform == Transform::LogitHalf)
      out[at] = std::clamp(p[at], logit_half(std::max(q.lower, 1e-4)), logit_half(std::min(q.upper, 0.4999)));
    else if (q.transform == Transform::Shift)
      out[at] = std::clamp(p[at], q.lower / q.scale, q.upper / q.scale);
  });
  return out;
}

VectorX ParameterSet::moved(const VectorX& p, const VectorX& step) const {
  VectorX to = p + step;
  for_each_estimated([&](const Parameter& q, int at) {
    constexpr double tangent_from = 0.5;  // a share of the inverse; beyond, the curve would leave for infinity
    if (!q.acts_by_inverse) return;
    const double bent = std::min(step[at], tangent_from);
    to[at] = p[at] - std::log(1.0 - bent) + (step[at] - bent) / (1.0 - tangent_from);
  });
  return clamp(to);
}

double ParameterSet::prior(const VectorX& p, VectorX* gradient, MatrixX* curvature) const {
  double sum = 0.0;
  if (gradient) gradient->setZero(p.size());
  if (curvature) curvature->setZero(p.size(), p.size());
  for_each_estimated([&](const Parameter& q, int at) {
    if (!std::isfinite(q.prior_std)) return;
    if (q.prior_shape.size() > 0) {
      const MatrixX root = q.prior_shape.inverse() / q.prior_std;
      const int n = q.dimension();
      const VectorX r = root * (p.segment(at, n) - q.prior_mean);
      sum += 0.5 * r.squaredNorm();
      if (gradient) gradient->segment(at, n) = root.transpose() * r;
      if (curvature) curvature->block(at, at, n, n) = root.transpose() * root;
      return;
    }
    for (int d = 0; d < q.dimension(); ++d) {
      const double t = (p[at + d] - q.prior_mean[d]) / q.prior_std;
      sum += 0.5 * t * t;
      if (gradient) (*gradient)[at + d] = t / q.prior_std;
      if (curvature) (*curvature)(at + d, at + d) = 1.0 / (q.prior_std * q.prior_std);
    }
  });
  if (joint_.empty()) return sum;
  const auto count = Eigen::Index(joint_.size());
  std::vector<int> place(parameters_.size(), -1);  // in p
  for_each_estimated([&](const Parameter& q, int at) { place[std::size_t(&q - parameters_.data())] = at; });
  VectorX t(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const int number = joint_[std::size_t(k)], at = place[std::size_t(number)];
    t[k] = at >= 0 ? p[at] : std::log(reference_[parameters_[std::size_t(number)].at]);
  }
  const VectorX slope = joint_precision_ * t;
  sum += 0.5 * t.dot(slope);
  for (Eigen::Index k = 0; k < count; ++k) {
    const int at = place[std::size_t(joint_[std::size_t(k)])];
    if (at < 0) continue;
    if (gradient) (*gradient)[at] += slope[k];
    for (Eigen::Index l = 0; curvature && l < count; ++l)
      if (const int other = place[std::size_t(joint_[std::size_t(l)])]; other >= 0)
        (*curvature)(at, other) += joint_precision_(k, l);
  }
  return sum;
}

}  // namespace pliant
