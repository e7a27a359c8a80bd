#include "motion/fixed_regions.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "base/error.hpp"

namespace pliant {

namespace {

struct HeldSample {
  Vector3 local;
  Vector3 normal;  // zero for points inside
  double weight;   // [m^2] on the surface, [m^2] inside (volume / h)
};

using SamplesOfCell = std::map<std::pair<int, int>, std::vector<HeldSample>>;

SamplesOfCell collect(const Body& body, const std::vector<Hold>& holds) {
  SamplesOfCell samples;
  const HexGrid& grid = body.grid();
  for (int h = 0; h < int(holds.size()); ++h) {
    bool any = false;
    for (const SurfacePoint& point : grid.surface) {
      if (!holds[h].contains(point.position)) continue;
      const CellPoint at = grid.locate(point.position);
      samples[{h, at.cell}].push_back({at.local, point.normal, point.area});
      any = true;
    }
    // Inside, a regular set of points of equal weight: positive, as a penalty must be.
    constexpr int n = 4;
    for (int e = 0; e < grid.cell_count(); ++e) {
      const double share = grid.quadrature[e].volume_fraction() * grid.cell_size * grid.cell_size / (n * n * n);
      const Vector3 corner = grid.origin + grid.cell_size * grid.cell_index[e].cast<double>();
      for (int s = 0; s < n * n * n; ++s) {
        const Vector3 local = (Vector3(s % n, s / n % n, s / (n * n)).array() + 0.5) / n;
        if (!holds[h].contains(corner + grid.cell_size * local)) continue;
        samples[{h, e}].push_back({local, Vector3::Zero(), share});
        any = true;
      }
    }
    if (!any)
      throw InputError({{},
                        "held region " + std::to_string(h + 1) + " contains nothing of the object",
                        "",
                        "move it onto the object or make it larger"});
  }
  return samples;
}

}  // namespace

Hold part_of_the_way(const Hold& hold, double share, const Vector3& middle) {
  const Eigen::AngleAxisd turn(hold.rotation);
  const Matrix3 R = Eigen::AngleAxisd(share * turn.angle(), turn.axis()).toRotationMatrix();
  const Vector3 moved = share * (hold.rotation * middle + hold.translation - middle);
  return {hold.contains, R, middle + moved - R * middle};
}

namespace {

constexpr int fewest_nodes = 3;  // that can hold a body

std::vector<int> nodes_inside(const Body& body, const Hold& hold) {
  std::vector<int> nodes;
  for (int n = 0; n < body.node_count(); ++n)
    if (hold.contains(body.scanned_positions().row(n).transpose())) nodes.push_back(n);
  return nodes;
}

/// Nodes of the elements whose surface lies inside in part.
std::vector<int> nodes_around(const Body& body, const Hold& hold) {
  std::vector<Vector3> inside;
  for (const SurfacePoint& point : body.surface)
    if (hold.contains(point.position)) inside.push_back(point.position);
  const Embedding at(body, inside);
  std::vector<int> nodes;
  for (int p = 0; p < at.point_count(); ++p) nodes.insert(nodes.end(), at.nodes(p).begin(), at.nodes(p).end());
  return nodes;
}

}  // namespace

std::vector<int> held_nodes(const Body& body, const std::vector<Hold>& holds) {
  std::vector<int> nodes;
  for (const Hold& hold : holds) {
    std::vector<int> of_hold = nodes_inside(body, hold);
    if (int(of_hold.size()) < fewest_nodes) of_hold = nodes_around(body, hold);
    nodes.insert(nodes.end(), of_hold.begin(), of_hold.end());
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

FixedRegions::FixedRegions(std::shared_ptr<const Body> body, const std::vector<Hold>& holds,
                           const MaterialBlocks& blocks, double penalty)
    : body_(std::move(body)), holds_(holds), poissons_ratio_(blocks.poissons_ratio), modulus_(body_, blocks) {
  const double h = body_->grid().cell_size;
  for (const auto& [key, samples] : collect(*body_, holds)) {
    HeldCell held{key.second, key.first, Matrix24::Zero(), Matrix24::Zero(), {}, {}};
    for (const HeldSample& s : samples) {
      const auto N = shape_functions(s.local);
      const Eigen::Matrix<double, 8, 3> G = shape_gradients(s.local) / h;
      Eigen::Matrix<double, 3, 24> value, traction_lambda, traction_mu;
      for (int a = 0; a < 8; ++a) {
        const Vector3 g = G.row(a).transpose();
        value.block<3, 3>(0, 3 * a) = N[a] * Matrix3::Identity();
        traction_lambda.block<3, 3>(0, 3 * a) = s.normal * g.transpose();
        traction_mu.block<3, 3>(0, 3 * a) = g.dot(s.normal) * Matrix3::Identity() + g * s.normal.transpose();
      }
      const Matrix24 mass = value.transpose() * value;
      const Matrix24 consistency_lambda = traction_lambda.transpose() * value;
      const Matrix24 consistency_mu = traction_mu.transpose() * value;
      held.K_lambda += s.weight * (penalty / h * mass - consistency_lambda - consistency_lambda.transpose());
      held.K_mu += s.weight * (2.0 * penalty / h * mass - consistency_mu - consistency_mu.transpose());
    }
    cells_.push_back(held);
  }
}

void FixedRegions::set_parameters(const VectorX& parameters) {
  modulus_.set_parameters(parameters);
  const UnitLame c = unit_lame(parameters[poissons_ratio_]);
  for (HeldCell& held : cells_) {
    held.K = c.lambda * held.K_lambda + c.mu * held.K_mu;
    held.dK = c.d_lambda * held.K_lambda + c.d_mu * held.K_mu;
  }
}

FixedRegions::Vector24 FixedRegions::rotated_back(const HeldCell& held, const Points& vectors) const {
  const auto cell = body_->element(held.cell);
  Vector24 d;
  for (int a = 0; a < 8; ++a)
    d.segment<3>(3 * a) = holds_[held.hold].rotation.transpose() * vectors.row(cell[a]).transpose();
  return d;
}

FixedRegions::Vector24 FixedRegions::displacement(const HeldCell& held, const Points& z) const {
  const auto cell = body_->element(held.cell);
  const Hold& hold = holds_[held.hold];
  Vector24 d;
  for (int a = 0; a < 8; ++a)
    d.segment<3>(3 * a) = hold.rotation.transpose() * (z.row(cell[a]).transpose() - hold.translation) -
                          body_->nodes.row(cell[a]).transpose();
  return d;
}

void FixedRegions::add_force(const Points& z, Points& force) {
  for (const HeldCell& held : cells_) {
    const auto cell = body_->element(held.cell);
    const Vector24 f = -modulus_[held.cell] * (held.K * displacement(held, z));
    for (int a = 0; a < 8; ++a) force.row(cell[a]) += (holds_[held.hold].rotation * f.segment<3>(3 * a)).transpose();
  }
}

void FixedRegions::add_matrix(double scale, BlockMatrix& matrix) {
  for (const HeldCell& held : cells_) {
    const auto cell = body_->element(held.cell);
    const Matrix3& R = holds_[held.hold].rotation;
    const double factor = scale * modulus_[held.cell];
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b)
        Eigen::Map<Matrix3>(matrix.block(body_->pattern->find(cell[a], cell[b]))) +=
            factor * R * held.K.block<3, 3>(3 * a, 3 * b) * R.transpose();
  }
}

void FixedRegions::add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                                     Points& force) {
  const Points *lag = &d_lag, *at = &d_z;
  prepare_tangents(z, d_theta);
  add_force_tangents(z, {{&lag, 1}, {&at, 1}, d_theta}, {&force, 1});
}

void FixedRegions::prepare_tangents(const Points&, const Eigen::Ref<const MatrixX>& d_theta) {
  modulus_.set_changes(d_theta);
}

void FixedRegions::add_force_tangents(const Points& z, const ForceChanges& changes, std::span<Points> forces) {
  for (const HeldCell& held : cells_) {
    const auto cell = body_->element(held.cell);
    const Vector24 u = displacement(held, z), Ku = held.K * u, by_nu = held.dK * u;
    const double E = modulus_[held.cell];
    for (std::size_t c = 0; c < forces.size(); ++c) {
      const auto direction = Eigen::Index(c);
      const double d_log = modulus_.log_change(held.cell, changes.first + direction),
                   d_nu = changes.theta(Eigen::Index(poissons_ratio_), direction);
      const Vector24 df = -E * (d_log * Ku + held.K * rotated_back(held, *changes.z[c]) + d_nu * by_nu);
      for (int a = 0; a < 8; ++a)
        forces[c].row(cell[a]) += (holds_[held.hold].rotation * df.segment<3>(3 * a)).transpose();
    }
  }
}

void FixedRegions::add_force_adjoint(const Points& z, const Points& w, Points&, Points& z_bar, VectorX& theta_bar) {
  modulus_.begin_adjoint();
  for (const HeldCell& held : cells_) {
    const auto cell = body_->element(held.cell);
    const Vector24 u = displacement(held, z), c = rotated_back(held, w);
    const double E = modulus_[held.cell];
    const Vector24 Kc = held.K * c;
    for (int a = 0; a < 8; ++a)
      z_bar.row(cell[a]) -= E * (holds_[held.hold].rotation * Kc.segment<3>(3 * a)).transpose();
    modulus_.add_log_adjoint(held.cell, -E * Kc.dot(u));
    theta_bar[poissons_ratio_] -= E * c.dot(held.dK * u);
  }
  modulus_.end_adjoint(theta_bar);
}

}  // namespace pliant
