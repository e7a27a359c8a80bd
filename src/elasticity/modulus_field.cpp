#include "elasticity/modulus_field.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "base/error.hpp"

namespace pliant {

namespace {

ControlledField with_weights(const Body& body, MatrixX weights, std::vector<Vector3> points) {
  ControlledField out;
  out.field.relative = body.modulus.relative;
  out.field.controls = int(weights.cols());
  if (out.field.controls > 1) out.field.weights = std::move(weights);
  out.points = std::move(points);
  return out;
}

int nearest_node(const Body& body, const Vector3& point) {
  Eigen::Index nearest = 0;
  (body.nodes.rowwise() - point.transpose()).rowwise().squaredNorm().minCoeff(&nearest);
  return int(nearest);
}

/// Laplacian of the mesh: linear elements' gradients products for tetrahedra; nodes of a cell joined by its edges for
/// hexahedra (the lattice's seven-point stencil).
Eigen::SparseMatrix<double> laplacian(const Body& body) {
  std::vector<Eigen::Triplet<double>> entries;
  const auto join = [&](int a, int b, double weight) {
    entries.emplace_back(a, a, weight), entries.emplace_back(b, b, weight);
    entries.emplace_back(a, b, -weight), entries.emplace_back(b, a, -weight);
  };
  for (int e = 0; e < body.element_count(); ++e) {
    const auto nodes = body.element(e);
    if (body.kind == ElementKind::Hexahedron) {
      for (int a = 0; a < 8; ++a)
        for (const int bit : {1, 2, 4})
          if (!(a & bit)) join(nodes[a], nodes[a | bit], 1.0);
      continue;
    }
    if (body.kind == ElementKind::Tetrahedron) {
      const auto g = body.gradients(e);
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b)
          entries.emplace_back(nodes[a], nodes[b], body.element_volume[std::size_t(e)] * g.row(a).dot(g.row(b)));
      continue;
    }
    static constexpr std::array<std::array<int, 2>, 6> edges = {{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
    for (int m = 0; m < 6; ++m)  // corner - middle - corner along every edge
      for (const int end : edges[std::size_t(m)]) {
        const double length = (body.nodes.row(nodes[end]) - body.nodes.row(nodes[4 + m])).norm();
        join(nodes[end], nodes[4 + m], 1.0 / length);
      }
  }
  Eigen::SparseMatrix<double> L(body.node_count(), body.node_count());
  L.setFromTriplets(entries.begin(), entries.end());
  return L;
}

}  // namespace

Vector3 element_centre(const Body& body, int element) {
  Vector3 sum = Vector3::Zero();
  for (const int n : body.element(element)) sum += body.nodes.row(n).transpose();
  return sum / body.nodes_per_element();
}

ControlledField linear_field(const Body& body, const Vector3& axis, int count) {
  const VectorX along = body.nodes * axis;
  const double low = along.minCoeff(), high = along.maxCoeff();
  const Vector3 centre = body.centre_of_mass();
  std::vector<Vector3> points;
  for (int k = 0; k < count; ++k) {
    const double s = count == 1 ? 0.5 * (low + high) : low + (high - low) * k / (count - 1);
    points.emplace_back(centre + (s - centre.dot(axis)) * axis);
  }
  MatrixX weights = MatrixX::Zero(body.element_count(), count);
  for (int e = 0; e < body.element_count(); ++e) {
    const double s = std::clamp((element_centre(body, e).dot(axis) - low) / (high - low), 0.0, 1.0) * (count - 1);
    const int first = std::min(int(s), std::max(count - 2, 0));
    if (count == 1) {
      weights(e, 0) = 1.0;
      continue;
    }
    weights(e, first) = 1.0 - (s - first);
    weights(e, first + 1) = s - first;
  }
  return with_weights(body, std::move(weights), std::move(points));
}

ControlledField harmonic_field(const Body& body, const std::vector<Vector3>& points) {
  std::vector<int> control_of(std::size_t(body.node_count()), -1), unknown(std::size_t(body.node_count()), -1);
  for (std::size_t k = 0; k < points.size(); ++k) {
    int& slot = control_of[std::size_t(nearest_node(body, points[k]))];
    if (slot >= 0)
      throw InputError({{},
                        "control points " + std::to_string(slot + 1) + " and " + std::to_string(k + 1) +
                            " fall on one node of the mesh",
                        "points farther apart than the elements are large",
                        "use fewer control points or smaller elements"});
    slot = int(k);
  }
  int unknowns = 0;
  for (int n = 0; n < body.node_count(); ++n)
    if (control_of[std::size_t(n)] < 0) unknown[std::size_t(n)] = unknowns++;
  const Eigen::SparseMatrix<double> L = laplacian(body);
  std::vector<Eigen::Triplet<double>> inner;
  MatrixX right = MatrixX::Zero(unknowns, Eigen::Index(points.size()));
  for (int col = 0; col < L.outerSize(); ++col)
    for (Eigen::SparseMatrix<double>::InnerIterator it(L, col); it; ++it) {
      const int row = unknown[std::size_t(it.row())];
      if (row < 0) continue;
      if (control_of[std::size_t(col)] >= 0)
        right(row, control_of[std::size_t(col)]) -= it.value();
      else
        inner.emplace_back(row, unknown[std::size_t(col)], it.value());
    }
  Eigen::SparseMatrix<double> A(unknowns, unknowns);
  A.setFromTriplets(inner.begin(), inner.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(A);
  const MatrixX solved = factor.solve(right);
  MatrixX weights = MatrixX::Zero(body.element_count(), Eigen::Index(points.size()));
  for (int e = 0; e < body.element_count(); ++e)
    for (const int n : body.element(e)) {
      const double share = 1.0 / body.nodes_per_element();
      if (control_of[std::size_t(n)] >= 0)
        weights(e, control_of[std::size_t(n)]) += share;
      else
        weights.row(e) += share * solved.row(unknown[std::size_t(n)]);
    }
  return with_weights(body, std::move(weights), points);
}

ControlledField inverse_distance_field(const Body& body, const std::vector<Vector3>& points) {
  MatrixX weights(body.element_count(), Eigen::Index(points.size()));
  const double floor = 1e-12 * body.size() * body.size();
  for (int e = 0; e < body.element_count(); ++e) {
    const Vector3 centre = element_centre(body, e);
    for (std::size_t k = 0; k < points.size(); ++k)
      weights(e, Eigen::Index(k)) = 1.0 / ((points[k] - centre).squaredNorm() + floor);
    weights.row(e) /= weights.row(e).sum();
  }
  return with_weights(body, std::move(weights), points);
}

ControlledField extended_field(const Body& body, const std::vector<Vector3>& points, const MatrixX& weights) {
  // Least squares of |grad w|^2 and, much heavier, of what the points say.
  constexpr double heavy = 1e3;
  const Eigen::SparseMatrix<double> L = laplacian(body);
  const double stiff = heavy * L.diagonal().sum() / double(points.size());
  const Embedding embedding(body, points);
  std::vector<Eigen::Triplet<double>> entries;
  MatrixX right = MatrixX::Zero(body.node_count(), weights.cols());
  for (int i = 0; i < embedding.point_count(); ++i) {
    const auto nodes = embedding.nodes(i);
    const auto shares = embedding.weights(i);
    const Eigen::RowVectorXd told = weights.row(i) / weights.row(i).sum();
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      right.row(nodes[a]) += stiff * shares[a] * told;
      for (std::size_t b = 0; b < nodes.size(); ++b)
        entries.emplace_back(nodes[a], nodes[b], stiff * shares[a] * shares[b]);
    }
  }
  Eigen::SparseMatrix<double> A(body.node_count(), body.node_count());
  A.setFromTriplets(entries.begin(), entries.end());
  A += L;
  const MatrixX at_nodes = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(A).solve(right);
  MatrixX of_elements = MatrixX::Zero(body.element_count(), weights.cols());
  for (int e = 0; e < body.element_count(); ++e) {
    for (const int n : body.element(e)) of_elements.row(e) += at_nodes.row(n);
    of_elements.row(e) = of_elements.row(e).cwiseMax(0.0);  // points that contradict each other overshoot
    of_elements.row(e) /= of_elements.row(e).sum();
  }
  std::vector<Vector3> middles;
  for (Eigen::Index k = 0; k < weights.cols(); ++k) {
    Vector3 sum = Vector3::Zero();
    for (int e = 0; e < body.element_count(); ++e) sum += of_elements(e, k) * element_centre(body, e);
    middles.push_back(sum / std::max(of_elements.col(k).sum(), 1e-300));
  }
  return with_weights(body, std::move(of_elements), std::move(middles));
}

ControlledField region_field(const Body& body, const std::vector<std::function<bool(const Vector3&)>>& regions) {
  MatrixX weights = MatrixX::Zero(body.element_count(), Eigen::Index(regions.size()) + 1);
  for (int e = 0; e < body.element_count(); ++e) {
    const Vector3 centre = element_centre(body, e);
    const auto count = [&](const Vector3& p) {
      Eigen::Index owner = 0;
      for (std::size_t r = 0; r < regions.size(); ++r)
        if (regions[r](p)) owner = Eigen::Index(r) + 1;
      weights(e, owner) += 1.0;
    };
    count(centre);
    for (const int n : body.element(e))  // halfway to the nodes: a border along an element's face is no border in it
      count(0.5 * (centre + body.nodes.row(n).transpose()));
    weights.row(e) /= weights.row(e).sum();
  }
  return with_weights(body, std::move(weights), {});
}

std::vector<Vector3> farthest_points(const Body& body, int count) {
  std::vector<Vector3> points;
  VectorX distance = (body.nodes.rowwise() - body.centre_of_mass().transpose()).rowwise().squaredNorm();
  while (int(points.size()) < count) {
    Eigen::Index farthest = 0;
    distance.maxCoeff(&farthest);
    points.push_back(body.nodes.row(farthest).transpose());
    const VectorX to_this = (body.nodes.rowwise() - points.back().transpose()).rowwise().squaredNorm();
    distance = points.size() == 1 ? to_this : VectorX(distance.cwiseMin(to_this));
  }
  return points;
}

}  // namespace pliant
