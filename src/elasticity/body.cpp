#include "elasticity/body.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "elasticity/tet_element.hpp"

namespace pliant {

namespace {

bool is_full(const CellQuadrature& quadrature) {
  static const std::array<double, 3> gauss = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  for (int q = 0; q < CellQuadrature::count; ++q)
    if (std::abs(quadrature.weights[q] - gauss[q % 3] * gauss[q / 3 % 3] * gauss[q / 9]) > 1e-12) return false;
  return true;
}

/// Full cells are congruent and share a class; every other element has its own.
void classify(Body& body, const HexGrid* grid) {
  int full = -1;
  for (int e = 0; e < body.element_count(); ++e) {
    const bool shares = grid && is_full(grid->quadrature[std::size_t(e)]);
    if (shares && full >= 0) {
      body.element_class.push_back(full);
      continue;
    }
    body.element_class.push_back(int(body.class_representative.size()));
    if (shares) full = body.element_class.back();
    body.class_representative.push_back(e);
  }
}

template <class Matrix>
Matrix lumped(const Matrix& consistent) {
  Matrix diagonal = Matrix::Zero();
  diagonal.diagonal() = consistent.diagonal() * (consistent.sum() / consistent.trace());
  return diagonal;
}

/// What every kind shares, once nodes and connectivity are there.
/// @param mass       element -> N x N for unit density
/// @param gradients  element -> N x 3
template <int N, class Mass, class Gradients>
void finish(Body& body, Mass&& mass, Gradients&& gradients) {
  body.modulus.relative.assign(std::size_t(body.element_count()), 1.0);
  body.pattern = std::make_shared<BlockPattern>(BlockPattern::from_elements(body.node_count(), body.connectivity, N));
  body.blocks = std::make_shared<std::vector<int>>(element_blocks(body, *body.pattern));
  body.loop = std::make_shared<ElementLoop>(body.nodes, body.connectivity, N);
  body.mass.assign(std::size_t(body.pattern->block_count()), 0.0);
  body.mean_gradient.resize(Eigen::Index(body.connectivity.size()), 3);
  for (int e = 0; e < body.element_count(); ++e) {
    Eigen::Matrix<double, N, N> M = mass(e);
    if (body.options.mass == MassKind::Lumped) M = lumped(M);
    body.element_volume.push_back(M.sum());
    const int* blocks = body.blocks->data() + std::size_t(e) * (N * N);
    for (int a = 0; a < N; ++a)
      for (int b = 0; b < N; ++b) body.mass[std::size_t(blocks[N * a + b])] += M(a, b);
    body.mean_gradient.middleRows<N>(Eigen::Index(e) * N) = gradients(e);
  }
}

template <int N>
Eigen::Matrix<double, N, 3> rest_nodes(const Body& body, int e) {
  Eigen::Matrix<double, N, 3> X;
  for (int a = 0; a < N; ++a) X.row(a) = body.nodes.row(body.element(e)[a]);
  return X;
}

template <int N>
void finish_tetrahedra(Body& body) {
  finish<N>(
      body, [&](int e) { return tet_mass<N>(rest_nodes<N>(body, e)); },
      [&](int e) { return tet_mean_gradients<N>(rest_nodes<N>(body, e)); });
  classify(body, nullptr);
}

}  // namespace

const Points& Body::scanned_positions() const {
  return std::visit([](const auto& m) -> const Points& { return m.nodes; }, mesh);
}

double Body::volume() const {
  double sum = 0.0;
  for (const double v : element_volume) sum += v;
  return sum;
}

double Body::size() const { return (nodes.colwise().maxCoeff() - nodes.colwise().minCoeff()).maxCoeff(); }

Vector3 Body::centre_of_mass() const {
  Vector3 moment = Vector3::Zero();
  double total = 0.0;
  for (int row = 0; row < pattern->rows; ++row)
    for (int b = pattern->row_start[row]; b < pattern->row_start[row + 1]; ++b) {
      moment += mass[b] * scanned_positions().row(pattern->column[b]).transpose();
      total += mass[b];
    }
  return moment / total;
}

void Body::add_mass_product(double scale, const Points& x, Points& out) const {
  for_parts(Parts(std::size_t(pattern->rows)), [&](std::size_t first, std::size_t last) {
    for (int row = int(first); row < int(last); ++row) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (int b = pattern->row_start[row]; b < pattern->row_start[row + 1]; ++b)
        sum += mass[b] * x.row(pattern->column[b]);
      out.row(row) += scale * sum;
    }
  });
}

Body make_body(HexGrid grid, const BodyOptions& options) {
  Body body;
  body.kind = ElementKind::Hexahedron;
  body.options = options;
  body.nodes = grid.nodes;
  for (const auto& cell : grid.cells) body.connectivity.insert(body.connectivity.end(), cell.begin(), cell.end());
  body.surface = grid.surface;
  finish<8>(
      body, [&](int e) { return hex_mass(grid.quadrature[std::size_t(e)], grid.cell_size); },
      [&](int e) { return hex_mean_gradients(grid.quadrature[std::size_t(e)], grid.cell_size); });
  classify(body, &grid);
  body.mesh = std::move(grid);
  return body;
}

Body make_body(TetMesh mesh, const BodyOptions& options) {
  Body body;
  body.options = options;
  body.nodes = mesh.nodes;
  body.surface = mesh.surface;
  const bool quadratic = mesh.is_quadratic();
  body.kind = quadratic ? ElementKind::QuadraticTetrahedron : ElementKind::Tetrahedron;
  for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
    body.connectivity.insert(body.connectivity.end(), mesh.tets[e].begin(), mesh.tets[e].end());
    if (quadratic)
      body.connectivity.insert(body.connectivity.end(), mesh.mid_nodes[e].begin(), mesh.mid_nodes[e].end());
  }
  if (quadratic)
    finish_tetrahedra<10>(body);
  else
    finish_tetrahedra<4>(body);
  body.mesh = std::move(mesh);
  return body;
}

namespace {

template <int N>
void follow_reference(Body& body) {
  for (int e = 0; e < body.element_count(); ++e) {
    const auto X = rest_nodes<N>(body, e);
    body.element_volume[std::size_t(e)] = tet_mass<N>(X).sum();
    if (!(body.element_volume[std::size_t(e)] > 0.0))
      throw std::invalid_argument("with_reference: element " + std::to_string(e) + " has no positive volume");
    body.mean_gradient.middleRows<N>(Eigen::Index(e) * N) = tet_mean_gradients<N>(X);
  }
}

}  // namespace

Body with_reference(const Body& body, Points reference) {
  if (body.kind == ElementKind::Hexahedron)
    throw std::invalid_argument("with_reference: hexahedra are regular where they are stress-free");
  if (reference.rows() != body.nodes.rows())
    throw std::invalid_argument("with_reference: one position a node is needed");
  Body moved = body;
  moved.nodes = std::move(reference);
  if (moved.kind == ElementKind::Tetrahedron)
    follow_reference<4>(moved);
  else
    follow_reference<10>(moved);
  return moved;
}

template <int N>
UnitStiffness<N> unit_stiffness(const Body& body, int element, double poissons_ratio) {
  if constexpr (N == 8) {
    const HexGrid& grid = body.grid();
    const HexStiffness k =
        hex_stiffness(grid.quadrature[std::size_t(element)], grid.cell_size, poissons_ratio, body.options.formulation);
    return {k.value, k.d_poissons_ratio};
  } else {
    const auto k = tet_stiffness<N>(rest_nodes<N>(body, element), poissons_ratio);
    return {k.value, k.d_poissons_ratio};
  }
}
template UnitStiffness<4> unit_stiffness<4>(const Body&, int, double);
template UnitStiffness<8> unit_stiffness<8>(const Body&, int, double);
template UnitStiffness<10> unit_stiffness<10>(const Body&, int, double);

Embedding::Embedding(const Body& body, const std::vector<Vector3>& rest_points) : stride_(body.nodes_per_element()) {
  const auto add = [&](int element, const auto& weights) {
    const auto nodes = body.element(element);
    element_.push_back(element);
    nodes_.insert(nodes_.end(), nodes.begin(), nodes.end());
    weights_.insert(weights_.end(), weights.begin(), weights.end());
  };
  for (const Vector3& point : rest_points) {
    if (const auto* grid = std::get_if<HexGrid>(&body.mesh)) {
      const CellPoint at = grid->locate(point);
      add(at.cell, shape_functions(at.local));
    } else {
      const TetPoint at = std::get<TetMesh>(body.mesh).locate(point);
      if (body.kind == ElementKind::Tetrahedron)
        add(at.tet, tet_shape_functions<4>(at.barycentric));
      else
        add(at.tet, tet_shape_functions<10>(at.barycentric));
    }
  }
}

Points Embedding::positions(const Points& nodes) const {
  Points out(point_count(), 3);
  for (int p = 0; p < point_count(); ++p) out.row(p) = position(p, nodes).transpose();
  return out;
}

std::vector<int> element_blocks(const Body& body, const BlockPattern& pattern) {
  std::vector<int> blocks;
  blocks.reserve(body.connectivity.size() * std::size_t(body.nodes_per_element()));
  for (int e = 0; e < body.element_count(); ++e)
    for (const int a : body.element(e))
      for (const int b : body.element(e)) blocks.push_back(pattern.find(a, b));
  return blocks;
}

}  // namespace pliant
