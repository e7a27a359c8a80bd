#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

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
  return SignedDistance(centred_box(half), spacing,
                        [=](const Vector3& p) { return std::hypot(std::hypot(p.x(), p.z()) - major, p.y()) - minor; });
}

inline std::shared_ptr<const Body> torus_body(double major, double minor, double cell_size,
                                              const BodyOptions& options = {}) {
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
  return std::make_shared<Body>(
      make_body(make_hex_grid(distance, centred_box(half * (1.0 - 1e-9)), cell_size), options));
}

/// A box around the origin of structured tetrahedra, six a cell, with its inner nodes moved about so that no two
/// elements are congruent.
inline std::shared_ptr<const Body> tet_body(const Vector3& size, const Eigen::Vector3i& cells, bool quadratic,
                                            double distortion = 0.15, const BodyOptions& options = {}) {
  TetMesh mesh = make_tet_box(centred_box(0.5 * size), cells, false);
  const Vector3 cell = size.cwiseQuotient(cells.cast<double>());
  for (Eigen::Index n = 0; n < mesh.nodes.rows(); ++n)
    for (int d = 0; d < 3; ++d) {
      if (std::abs(std::abs(mesh.nodes(n, d)) - 0.5 * size[d]) < 1e-9 * size[d]) continue;  // faces stay plane
      mesh.nodes(n, d) += distortion * cell[d] * std::sin(7.0 * double(n) + 2.0 * d);
    }
  mesh = make_tet_mesh(std::move(mesh.nodes), std::move(mesh.tets));
  return std::make_shared<Body>(make_body(quadratic ? with_mid_nodes(mesh) : mesh, options));
}

/// One small body of every kind of element.
struct BodyKind {
  std::string name;
  std::function<std::shared_ptr<const Body>()> make;
  friend void PrintTo(const BodyKind& kind, std::ostream* out) { *out << kind.name; }
};
inline std::vector<BodyKind> body_kinds() {
  const auto torus = [](HexFormulation formulation) {
    return [formulation] { return torus_body(0.1, 0.04, 0.05, {formulation, MassKind::Consistent}); };
  };
  const auto box = [](bool quadratic) {
    return [quadratic] { return tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, quadratic); };
  };
  return {{"Hexahedra", torus(HexFormulation::IncompatibleModes)},
          {"TrilinearHexahedra", torus(HexFormulation::Trilinear)},
          {"Tetrahedra", box(false)},
          {"QuadraticTetrahedra", box(true)}};
}

/// Generic, but smooth and of moderate size: rotates, stretches, shears and bends.
inline Points deformed(const Points& rest, double amount, double rotation_angle = 1.9) {
  const double size = (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
  const Matrix3 R = Eigen::AngleAxisd(rotation_angle, Vector3(0.3, -0.8, 0.5).normalized()).toRotationMatrix();
  Points out(rest.rows(), 3);
  for (Eigen::Index n = 0; n < rest.rows(); ++n) {
    const Vector3 s = rest.row(n).transpose() / size;
    const Vector3 u(std::sin(3 * s.y()) + s.x() * s.z(), 0.7 * std::cos(2 * s.x() + s.z()) - 0.4 * s.y(),
                    s.x() * s.y() + 0.5 * s.z());
    out.row(n) = (size * (R * (s + amount * u)) + Vector3(0.01, -0.02, 0.03) * size).transpose();
  }
  return out;
}

}  // namespace pliant::test
