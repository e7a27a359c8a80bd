#include "mismatch/displacement_extension.hpp"

#include <Eigen/SparseCholesky>
#include <cmath>

namespace pliant {

struct DisplacementExtension::Factor {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> laplacian;  // free x free
  Eigen::SparseMatrix<double> coupling;                          // free x known
  MatrixX harmonic(const MatrixX& known) const { return laplacian.solve(coupling * known); }
  MatrixX harmonic_transpose(const MatrixX& free) const { return coupling.transpose() * laplacian.solve(free); }
};

DisplacementExtension::~DisplacementExtension() = default;
DisplacementExtension::DisplacementExtension(DisplacementExtension&&) noexcept = default;

namespace {

MatrixX affine_basis(const Points& positions, const std::vector<int>& nodes, const Vector3& centre, double scale) {
  MatrixX basis(Eigen::Index(nodes.size()), 4);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    basis.row(Eigen::Index(i)) << 1.0, (positions.row(nodes[i]) - centre.transpose()) / scale;
  return basis;
}

}  // namespace

DisplacementExtension::DisplacementExtension(const HexGrid& grid, const SignedDistance& distance, double band)
    : cell_size_(grid.cell_size), band_(band), body_nodes_(grid.node_count()), factor_(std::make_unique<Factor>()) {
  const int margin = int(std::ceil(band / grid.cell_size)) + 1;
  const Eigen::Vector3i size = grid.size.array() + 2 * margin;
  const auto lattice = [&](const Eigen::Vector3i& i) { return (i.z() * size.y() + i.y()) * size.x() + i.x(); };
  const auto position = [&](const Eigen::Vector3i& i) -> Vector3 {
    return grid.origin + grid.cell_size * (i.array() - margin).cast<double>().matrix();
  };
  const auto in_grid = [&](const Eigen::Vector3i& i) {
    const Eigen::Vector3i g = i.array() - margin;
    return (g.array() >= 0).all() && (g.array() < grid.size.array()).all() ? grid.lattice(g) : -1;
  };

  std::vector<int> node(std::size_t(size.prod()), -1);
  const double reach = band + 0.5 * std::sqrt(3.0) * grid.cell_size;
  for (int z = 0; z + 1 < size.z(); ++z)
    for (int y = 0; y + 1 < size.y(); ++y)
      for (int x = 0; x + 1 < size.x(); ++x) {
        const Eigen::Vector3i corner(x, y, z);
        const Vector3 low = position(corner);
        const int g = in_grid(corner);
        const bool active = g >= 0 && grid.cell_of_lattice[g] >= 0;
        if (!active && distance.value(low + Vector3::Constant(0.5 * grid.cell_size)) > reach) continue;
        std::array<int, 8> cell;
        for (int a = 0; a < 8; ++a) cell[a] = lattice(corner + Eigen::Vector3i(a & 1, a >> 1 & 1, a >> 2 & 1));
        for (const int l : cell) node[l] = 0;
        cells_.push_back(cell);
        cell_corners_.push_back(low);
      }

  int count = 0;
  std::vector<Eigen::Vector3i> index;
  std::vector<int> role;  // position among the known or the free
  for (int z = 0; z < size.z(); ++z)
    for (int y = 0; y < size.y(); ++y)
      for (int x = 0; x < size.x(); ++x) {
        const Eigen::Vector3i i(x, y, z);
        if (node[lattice(i)] < 0) continue;
        node[lattice(i)] = count;
        index.push_back(i);
        const int g = in_grid(i);
        const int body_node = g >= 0 ? grid.node_of_lattice[g] : -1;
        if (body_node >= 0) {
          role.push_back(int(known_band_.size()));
          known_band_.push_back(count);
          known_body_.push_back(body_node);
        } else {
          role.push_back(-1 - int(free_band_.size()));
          free_band_.push_back(count);
        }
        ++count;
      }
  for (auto& cell : cells_)
    for (int& l : cell) l = node[l];
  rest_.resize(count, 3);
  for (int n = 0; n < count; ++n) rest_.row(n) = position(index[n]).transpose();

  std::vector<Eigen::Triplet<double>> laplacian, coupling;
  for (std::size_t f = 0; f < free_band_.size(); ++f) {
    const Eigen::Vector3i at = index[free_band_[f]];
    double degree = 0.0;
    for (int side = 0; side < 6; ++side) {
      Eigen::Vector3i next = at;
      next[side / 2] += side % 2 ? 1 : -1;
      if ((next.array() < 0).any() || (next.array() >= size.array()).any()) continue;
      const int n = node[lattice(next)];
      if (n < 0) continue;
      degree += 1.0;
      if (role[n] >= 0)
        coupling.emplace_back(int(f), role[n], 1.0);
      else
        laplacian.emplace_back(int(f), -1 - role[n], -1.0);
    }
    laplacian.emplace_back(int(f), int(f), degree);
  }
  const auto frees = Eigen::Index(free_band_.size()), knowns = Eigen::Index(known_band_.size());
  Eigen::SparseMatrix<double> L(frees, frees);
  L.setFromTriplets(laplacian.begin(), laplacian.end());
  factor_->coupling.resize(frees, knowns);
  factor_->coupling.setFromTriplets(coupling.begin(), coupling.end());
  factor_->laplacian.compute(L);

  const Vector3 centre = grid.nodes.colwise().mean().transpose();
  const double scale = std::sqrt((grid.nodes.rowwise() - centre.transpose()).squaredNorm() / double(body_nodes_));
  const MatrixX inside = affine_basis(rest_, known_band_, centre, scale);
  const MatrixX outside = affine_basis(rest_, free_band_, centre, scale);
  affine_fit_ = (inside.transpose() * inside).inverse() * inside.transpose();
  affine_rest_ = outside - factor_->harmonic(inside);
}

Points DisplacementExtension::apply(const Points& u) const {
  MatrixX known(Eigen::Index(known_body_.size()), 3);
  for (std::size_t k = 0; k < known_body_.size(); ++k) known.row(Eigen::Index(k)) = u.row(known_body_[k]);
  const MatrixX free = factor_->harmonic(known) + affine_rest_ * (affine_fit_ * known);
  Points g(rest_.rows(), 3);
  for (std::size_t k = 0; k < known_band_.size(); ++k) g.row(known_band_[k]) = known.row(Eigen::Index(k));
  for (std::size_t f = 0; f < free_band_.size(); ++f) g.row(free_band_[f]) = free.row(Eigen::Index(f));
  return g;
}

Points DisplacementExtension::apply_transpose(const Points& g) const {
  MatrixX free(Eigen::Index(free_band_.size()), 3);
  for (std::size_t f = 0; f < free_band_.size(); ++f) free.row(Eigen::Index(f)) = g.row(free_band_[f]);
  const MatrixX known = factor_->harmonic_transpose(free) + affine_fit_.transpose() * (affine_rest_.transpose() * free);
  Points u = Points::Zero(body_nodes_, 3);
  for (std::size_t k = 0; k < known_body_.size(); ++k)
    u.row(known_body_[k]) += g.row(known_band_[k]) + known.row(Eigen::Index(k));
  return u;
}

}  // namespace pliant
