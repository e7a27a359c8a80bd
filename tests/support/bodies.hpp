#pragma once

#include <cmath>
#include <memory>

#include "elasticity/body.hpp"

namespace pliant::test {

inline Box centred_box(const Vector3& half) {
  Box box;
  box.extend(-half);
  box.extend(half);
  return box;
}

/// Distance to a torus around the y axis, resampled at `spacing`.
inline SignedDistance torus_distance(double major, double minor, double spacing, double margin) {
  const Vector3 half(major + minor + margin, minor + margin, major + minor + margin);
  return SignedDistance(centred_box(half), spacing, [=](const Vector3& p) {
    return std::hypot(std::hypot(p.x(), p.z()) - major, p.y()) - minor;
  });
}

inline std::shared_ptr<const Body> torus_body(double major, double minor, double cell_size, const BodyOptions& options = {}) {
  const SignedDistance distance = torus_distance(major, minor, cell_size / 6, 3 * cell_size);
  const Box box = centred_box(Vector3(major + minor, minor, major + minor));
  return std::make_shared<Body>(make_body(make_hex_grid(distance, box, cell_size), options));
}

inline SignedDistance sphere_distance(double radius, double spacing, double margin) {
  return SignedDistance(centred_box(Vector3::Constant(radius + margin)), spacing,
                        [=](const Vector3& p) { return p.norm() - radius; });
}

inline HexGrid sphere_grid(double radius, double cell_size, const HexGridOptions& options = {},
                           const Vector3& shift = Vector3::Zero(), double spacing = 0.0) {
  const SignedDistance distance = sphere_distance(radius, spacing > 0.0 ? spacing : cell_size / 6, 3 * cell_size);
  return make_hex_grid(distance, centred_box(Vector3::Constant(radius)), cell_size, options, shift);
}

/// A box around the origin whose faces lie on lattice planes where `cell_size` divides its edges.
inline std::shared_ptr<const Body> box_body(const Vector3& size, double cell_size, const BodyOptions& options = {}) {
  const Vector3 half = 0.5 * size;
  // The surface lies a trace outside, so that every lattice point on a face is inside and edges stay sharp.
  const double trace = 1e-7 * cell_size;
  Box covered = centred_box(half + Vector3::Constant(3 * cell_size));
  const SignedDistance distance(covered, cell_size / 4, [=](const Vector3& p) {
    const Vector3 q = p.cwiseAbs() - half;
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - trace;
  });
  return std::make_shared<Body>(make_body(make_hex_grid(distance, centred_box(half * (1.0 - 1e-9)), cell_size), options));
}

/// Generic, but smooth and of moderate size: rotates, stretches, shears and bends.
inline Points deformed(const Points& rest, double amount, double rotation_angle = 1.9) {
  const double size = (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
  const Matrix3 R = Eigen::AngleAxisd(rotation_angle, Vector3(0.3, -0.8, 0.5).normalized()).toRotationMatrix();
  Points out(rest.rows(), 3);
  for (Eigen::Index n = 0; n < rest.rows(); ++n) {
    const Vector3 s = rest.row(n).transpose() / size;
    const Vector3 u(std::sin(3 * s.y()) + s.x() * s.z(), 0.7 * std::cos(2 * s.x() + s.z()) - 0.4 * s.y(), s.x() * s.y() + 0.5 * s.z());
    out.row(n) = (size * (R * (s + amount * u)) + Vector3(0.01, -0.02, 0.03) * size).transpose();
  }
  return out;
}

}  // namespace pliant::test
