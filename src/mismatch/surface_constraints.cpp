#include "mismatch/surface_constraints.hpp"

#include <cmath>
#include <stdexcept>

#include "base/points.hpp"
#include "geometry/box_tree.hpp"

namespace pliant {

namespace {

BoxTree cell_tree(const std::vector<std::array<int, 8>>& cells, const Points& lattice) {
  return box_tree(cells.size(), [&](std::size_t c) {
    Box box;
    for (const int n : cells[c]) box.extend(lattice.row(n).transpose());
    return box;
  });
}

/// The body's own grid, or one laid over another kind of body.
std::shared_ptr<const HexGrid> lattice_of(const std::shared_ptr<const Body>& body, const SignedDistance& distance,
                                          double cell_size) {
  if (body->kind == ElementKind::Hexahedron) return {body, &body->grid()};
  if (!(cell_size > 0.0)) throw std::invalid_argument("a lattice over tetrahedra needs a cell size");
  Box box;
  const Points& scanned = body->scanned_positions();
  for (Eigen::Index n = 0; n < scanned.rows(); ++n) box.extend(scanned.row(n).transpose());
  return std::make_shared<HexGrid>(make_hex_grid(distance, box, cell_size));
}

}  // namespace

double RobustLoss::value(double r) const {
  const double t = r / scale;
  if (std::abs(t) >= 1.0) return outlier();
  const double s = 1.0 - t * t;
  return outlier() * (1.0 - s * s * s);
}

double RobustLoss::weight(double r) const {
  const double t = r / scale;
  if (std::abs(t) >= 1.0) return 0.0;
  const double s = 1.0 - t * t;
  return s * s;
}

SurfaceConstraints::SurfaceConstraints(std::shared_ptr<const Body> body, std::shared_ptr<const SignedDistance> distance,
                                       double band, double cell_size)
    : body_(std::move(body)),
      distance_(std::move(distance)),
      grid_(lattice_of(body_, *distance_, cell_size)),
      extension_(*grid_, *distance_, band) {
  if (body_->kind == ElementKind::Hexahedron) return;
  lattice_in_body_ = Embedding(*body_, to_vectors(grid_->nodes));
}

Points SurfaceConstraints::extended(const Points& u) const {
  return extension_.apply(lattice_in_body_.point_count() > 0 ? lattice_in_body_.positions(u) : u);
}

Points SurfaceConstraints::extended_transpose(const Points& g) const {
  const Points on_lattice = extension_.apply_transpose(g);
  if (lattice_in_body_.point_count() == 0) return on_lattice;
  Points u = Points::Zero(body_->node_count(), 3);
  for (int p = 0; p < lattice_in_body_.point_count(); ++p)
    lattice_in_body_.add_transpose(p, on_lattice.row(p).transpose(), u);
  return u;
}

/// Newton's iteration for the local coordinates of a point in a deformed cell (Weiss 2020, algorithm 1).
bool SurfaceConstraints::pull_back(int cell, const Points& lattice, const Vector3& point, Vector3& local,
                                   Matrix3& jacobian) const {
  const auto& nodes = extension_.cells()[cell];
  const double size = extension_.cell_size();
  local.setConstant(0.5);
  for (int iteration = 0; iteration < 20; ++iteration) {
    const auto N = shape_functions(local);
    const auto G = shape_gradients(local);
    Vector3 residual = -point;
    jacobian.setZero();
    for (int a = 0; a < 8; ++a) {
      const Vector3 x = lattice.row(nodes[a]);
      residual += N[a] * x;
      jacobian.noalias() += x * G.row(a);
    }
    if (jacobian.determinant() < 1e-3 * size * size * size) return false;  // flat or inverted
    const Vector3 step = jacobian.inverse() * residual;
    if (residual.squaredNorm() < 1e-24 * size * size) break;
    local -= step;
    if ((local.array() - 0.5).abs().maxCoeff() > 2.0) return false;
  }
  return (local.array() > -1e-9).all() && (local.array() < 1.0 + 1e-9).all();
}

std::vector<PointMatch> SurfaceConstraints::match(std::span<const SurfaceObservation> points,
                                                  const Points& positions) const {
  const Points lattice = extension_.rest_positions() + extended(positions - body_->scanned_positions());
  const BoxTree tree = cell_tree(extension_.cells(), lattice);
  std::vector<PointMatch> matches(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    PointMatch& best = matches[i];
    const Vector3& p = points[i].position;
    const TreePoint at = tree_point(p);
    for (auto it = tree.qbegin(boost::geometry::index::intersects(at)); it != tree.qend(); ++it) {
      Vector3 local;
      Matrix3 jacobian;
      if (!pull_back(it->second, lattice, p, local, jacobian)) continue;
      const auto sample = distance_->sample(extension_.cell_corners()[it->second] + extension_.cell_size() * local);
      if (best.cell >= 0 && std::abs(sample.value) >= std::abs(best.distance)) continue;
      best.cell = it->second;
      best.distance = sample.value;
      best.direction = -extension_.cell_size() * (jacobian.transpose().inverse() * sample.gradient);
      best.stretch = best.direction.norm();
      best.weights = shape_functions(local);
    }
  }
  return matches;
}

MatrixX SurfaceConstraints::tangents(const std::vector<PointMatch>& matches,
                                     std::span<const Points> d_positions) const {
  const auto count = Eigen::Index(d_positions.size());
  MatrixX change = MatrixX::Zero(Eigen::Index(matches.size()), count);
  if (count == 0) return change;
  std::vector<int> row_of(std::size_t(extension_.rest_positions().rows()), -1), wanted;
  for (const PointMatch& m : matches) {
    if (m.cell < 0) continue;
    for (const int node : extension_.cells()[m.cell]) {
      int& row = row_of[std::size_t(node)];
      if (row >= 0) continue;
      row = int(wanted.size());
      wanted.push_back(node);
    }
  }
  const bool is_embedded = lattice_in_body_.point_count() > 0;
  DisplacementExtension::Fields u(is_embedded ? lattice_in_body_.point_count() : body_->node_count(), 3 * count);
  for (Eigen::Index c = 0; c < count; ++c) {
    const Points& d = d_positions[std::size_t(c)];
    u.middleCols<3>(3 * c) = is_embedded ? lattice_in_body_.positions(d) : d;
  }
  const DisplacementExtension::Fields g = extension_.apply_at(wanted, u);
  Eigen::RowVectorXd moved(3 * count);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const PointMatch& m = matches[i];
    if (m.cell < 0) continue;
    moved.setZero();
    for (int a = 0; a < 8; ++a) moved += m.weights[a] * g.row(row_of[std::size_t(extension_.cells()[m.cell][a])]);
    change.row(Eigen::Index(i)) = m.direction.transpose() * moved.reshaped(3, count);
  }
  return change;
}

Points SurfaceConstraints::adjoint(const std::vector<PointMatch>& matches, const VectorX& distance_bar) const {
  Points g_bar = Points::Zero(extension_.rest_positions().rows(), 3);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const PointMatch& m = matches[i];
    if (m.cell < 0 || distance_bar[Eigen::Index(i)] == 0.0) continue;
    for (int a = 0; a < 8; ++a)
      g_bar.row(extension_.cells()[m.cell][a]) +=
          distance_bar[Eigen::Index(i)] * m.weights[a] * m.direction.transpose();
  }
  return extended_transpose(g_bar);
}

}  // namespace pliant
