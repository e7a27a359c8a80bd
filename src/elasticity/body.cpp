#include "elasticity/body.hpp"

#include <cmath>

namespace pliant {

namespace {

bool is_full(const CellQuadrature& quadrature) {
  static const std::array<double, 3> gauss = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  for (int q = 0; q < CellQuadrature::count; ++q)
    if (std::abs(quadrature.weights[q] - gauss[q % 3] * gauss[q / 3 % 3] * gauss[q / 9]) > 1e-12) return false;
  return true;
}

void classify(Body& body) {
  int full = -1;
  for (int e = 0; e < body.grid.cell_count(); ++e) {
    const bool shares = is_full(body.grid.quadrature[e]);
    if (shares && full >= 0) {
      body.element_class.push_back(full);
      continue;
    }
    body.element_class.push_back(int(body.class_representative.size()));
    if (shares) full = body.element_class.back();
    body.class_representative.push_back(e);
  }
}

Matrix8 lumped(const Matrix8& consistent) {
  const double total = consistent.sum();
  Matrix8 diagonal = Matrix8::Zero();
  diagonal.diagonal() = consistent.diagonal() * (total / consistent.trace());
  return diagonal;
}

}  // namespace

Vector3 Body::centre_of_mass() const {
  Vector3 moment = Vector3::Zero();
  double total = 0.0;
  for (int row = 0; row < pattern->rows; ++row)
    for (int b = pattern->row_start[row]; b < pattern->row_start[row + 1]; ++b) {
      moment += mass[b] * grid.nodes.row(pattern->column[b]).transpose();
      total += mass[b];
    }
  return moment / total;
}

void Body::add_mass_product(double scale, const Points& x, Points& out) const {
  for (int row = 0; row < pattern->rows; ++row) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (int b = pattern->row_start[row]; b < pattern->row_start[row + 1]; ++b)
      sum += mass[b] * x.row(pattern->column[b]);
    out.row(row) += scale * sum;
  }
}

Body make_body(HexGrid grid, const BodyOptions& options) {
  Body body;
  body.grid = std::move(grid);
  body.options = options;
  body.relative_modulus.assign(std::size_t(body.grid.cell_count()), 1.0);
  std::vector<int> nodes;
  for (const auto& cell : body.grid.cells) nodes.insert(nodes.end(), cell.begin(), cell.end());
  body.pattern = std::make_shared<BlockPattern>(BlockPattern::from_elements(body.grid.node_count(), nodes, 8));
  body.mass.assign(std::size_t(body.pattern->block_count()), 0.0);
  for (int e = 0; e < body.grid.cell_count(); ++e) {
    const CellQuadrature& inside = body.grid.quadrature[e];
    Matrix8 M = hex_mass(inside, body.grid.cell_size);
    if (options.mass == MassKind::Lumped) M = lumped(M);
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b)
        body.mass[body.pattern->find(body.grid.cells[e][a], body.grid.cells[e][b])] += M(a, b);
    body.mean_gradient.push_back(hex_mean_gradients(inside, body.grid.cell_size));
  }
  classify(body);
  return body;
}

Embedding::Embedding(const HexGrid& grid, const std::vector<Vector3>& rest_points) : cells_(grid.cells) {
  for (const Vector3& point : rest_points) {
    const CellPoint at = grid.locate(point);
    cell_.push_back(at.cell);
    weights_.push_back(shape_functions(at.local));
  }
}

Points Embedding::positions(const Points& nodes) const {
  Points out(point_count(), 3);
  for (int p = 0; p < point_count(); ++p) out.row(p) = position(p, nodes).transpose();
  return out;
}

}  // namespace pliant
