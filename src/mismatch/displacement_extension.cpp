#include "mismatch/displacement_extension.hpp"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/box_tree.hpp"

namespace pliant {

/// A free node q takes from the known nodes k about it, with weights w_k that sum to one, where each would carry it:
///   g(q) = sum_k w_k (u_k + grad u_k . (q - X_k)).
struct DisplacementExtension::Operators {
  Eigen::SparseMatrix<double, Eigen::RowMajor> value;                    // free x known: w_k
  std::array<Eigen::SparseMatrix<double, Eigen::RowMajor>, 3> lever;     // free x known: w_k (q - X_k), an axis each
  std::array<Eigen::SparseMatrix<double, Eigen::RowMajor>, 3> gradient;  // known x known: du/dX, an axis each

  MatrixX carried(const MatrixX& known) const {
    MatrixX free = value * known;
    for (std::size_t d = 0; d < 3; ++d) free += lever[d] * (gradient[d] * known).eval();
    return free;
  }
  MatrixX carried_transpose(const MatrixX& free) const {
    MatrixX known = value.transpose() * free;
    for (std::size_t d = 0; d < 3; ++d) known += gradient[d].transpose() * (lever[d].transpose() * free).eval();
    return known;
  }
};

DisplacementExtension::~DisplacementExtension() = default;
DisplacementExtension::DisplacementExtension(DisplacementExtension&&) noexcept = default;

namespace {

namespace bg = boost::geometry;
using Tree = bg::index::rtree<std::pair<TreePoint, int>, bg::index::quadratic<8>>;
using Triplets = std::vector<Eigen::Triplet<double>>;

/// Known nodes that share a cell of the band with each, itself included.
std::vector<std::vector<int>> neighbours(const std::vector<std::array<int, 8>>& cells, const std::vector<int>& known_of,
                                         int known) {
  std::vector<std::vector<int>> around(static_cast<std::size_t>(known));
  for (const auto& cell : cells)
    for (const int a : cell)
      for (const int b : cell)
        if (known_of[std::size_t(a)] >= 0 && known_of[std::size_t(b)] >= 0)
          around[std::size_t(known_of[std::size_t(a)])].push_back(known_of[std::size_t(b)]);
  for (auto& list : around) {
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return around;
}

}  // namespace

DisplacementExtension::DisplacementExtension(const HexGrid& grid, const SignedDistance& distance, double band)
    : cell_size_(grid.cell_size),
      band_(band),
      body_nodes_(grid.node_count()),
      operators_(std::make_unique<Operators>()) {
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
          known_band_.push_back(count);
          known_body_.push_back(body_node);
        } else {
          free_band_.push_back(count);
        }
        ++count;
      }
  for (auto& cell : cells_)
    for (int& l : cell) l = node[l];
  rest_.resize(count, 3);
  for (int n = 0; n < count; ++n) rest_.row(n) = position(index[n]).transpose();

  row_of_band_.resize(std::size_t(count));
  for (std::size_t k = 0; k < known_band_.size(); ++k) row_of_band_[std::size_t(known_band_[k])] = int(k);
  for (std::size_t f = 0; f < free_band_.size(); ++f) row_of_band_[std::size_t(free_band_[f])] = -1 - int(f);
  std::vector<int> known_of(std::size_t(count), -1);
  for (std::size_t k = 0; k < known_band_.size(); ++k) known_of[std::size_t(known_band_[k])] = int(k);
  const auto knowns = Eigen::Index(known_band_.size()), frees = Eigen::Index(free_band_.size());
  const auto at = [&](int known) -> Vector3 { return rest_.row(known_band_[std::size_t(known)]).transpose(); };

  // The gradient at a known node is that of the affine motion which fits it and those about it best.
  std::array<Triplets, 3> gradient, lever;
  Triplets value;
  const auto around = neighbours(cells_, known_of, int(knowns));
  for (int k = 0; k < int(knowns); ++k) {
    const auto& near = around[std::size_t(k)];
    Vector3 middle = Vector3::Zero();
    for (const int n : near) middle += at(n) / double(near.size());
    Matrix3 spread = Matrix3::Zero();
    for (const int n : near) spread += (at(n) - middle) * (at(n) - middle).transpose();
    const Matrix3 inverse = spread.inverse();
    for (const int n : near) {
      const Vector3 share = inverse * (at(n) - middle);
      for (std::size_t d = 0; d < 3; ++d) gradient[d].emplace_back(k, n, share[Eigen::Index(d)]);
    }
  }

  // Those that are hardly farther than the nearest count; far out more of them, so that sides that face each other
  // blend.
  constexpr unsigned most = 24;
  std::vector<std::pair<TreePoint, int>> places;
  for (int k = 0; k < int(knowns); ++k) places.emplace_back(tree_point(at(k)), k);
  const Tree tree(places);
  for (int f = 0; f < int(frees); ++f) {
    const Vector3 q = rest_.row(free_band_[std::size_t(f)]).transpose();
    std::vector<int> near;
    for (auto it = tree.qbegin(bg::index::nearest(tree_point(q), most)); it != tree.qend(); ++it)
      near.push_back(it->second);
    std::ranges::sort(near);
    double nearest = std::numeric_limits<double>::infinity(), sum = 0.0;
    for (const int k : near) nearest = std::min(nearest, (at(k) - q).squaredNorm());
    const double width = grid.cell_size + 0.2 * std::sqrt(nearest);
    std::vector<double> weights;
    for (const int k : near)
      sum += weights.emplace_back(std::exp(-0.5 * ((at(k) - q).squaredNorm() - nearest) / (width * width)));
    for (std::size_t i = 0; i < near.size(); ++i) {
      const double w = weights[i] / sum;
      const Vector3 arm = q - at(near[i]);
      value.emplace_back(f, near[i], w);
      for (std::size_t d = 0; d < 3; ++d) lever[d].emplace_back(f, near[i], w * arm[Eigen::Index(d)]);
    }
  }
  const auto fill = [](auto& matrix, Eigen::Index rows, Eigen::Index cols, const Triplets& entries) {
    matrix.resize(rows, cols);
    matrix.setFromTriplets(entries.begin(), entries.end());
  };
  fill(operators_->value, frees, knowns, value);
  for (std::size_t d = 0; d < 3; ++d) {
    fill(operators_->lever[d], frees, knowns, lever[d]);
    fill(operators_->gradient[d], knowns, knowns, gradient[d]);
  }
}

Points DisplacementExtension::apply(const Points& u) const {
  MatrixX known(Eigen::Index(known_body_.size()), 3);
  for (std::size_t k = 0; k < known_body_.size(); ++k) known.row(Eigen::Index(k)) = u.row(known_body_[k]);
  const MatrixX free = operators_->carried(known);
  Points g(rest_.rows(), 3);
  for (std::size_t k = 0; k < known_band_.size(); ++k) g.row(known_band_[k]) = known.row(Eigen::Index(k));
  for (std::size_t f = 0; f < free_band_.size(); ++f) g.row(free_band_[f]) = free.row(Eigen::Index(f));
  return g;
}

DisplacementExtension::Fields DisplacementExtension::apply_at(std::span<const int> band_nodes, const Fields& u) const {
  Fields known(Eigen::Index(known_body_.size()), u.cols());
  for (std::size_t k = 0; k < known_body_.size(); ++k) known.row(Eigen::Index(k)) = u.row(known_body_[k]);
  std::array<Fields, 3> gradient;
  for (std::size_t d = 0; d < 3; ++d) gradient[d] = operators_->gradient[d] * known;
  Fields g = Fields::Zero(Eigen::Index(band_nodes.size()), u.cols());
  const auto add_row = [&](const auto& matrix, int row, const Fields& fields, Eigen::Index to) {
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(matrix, row); entry; ++entry)
      g.row(to) += entry.value() * fields.row(entry.col());
  };
  for (std::size_t i = 0; i < band_nodes.size(); ++i) {
    const int row = row_of_band_[std::size_t(band_nodes[i])];
    const auto to = Eigen::Index(i);
    if (row >= 0) {
      g.row(to) = known.row(row);
      continue;
    }
    add_row(operators_->value, -1 - row, known, to);
    for (std::size_t d = 0; d < 3; ++d) add_row(operators_->lever[d], -1 - row, gradient[d], to);
  }
  return g;
}

Points DisplacementExtension::apply_transpose(const Points& g) const {
  MatrixX free(Eigen::Index(free_band_.size()), 3);
  for (std::size_t f = 0; f < free_band_.size(); ++f) free.row(Eigen::Index(f)) = g.row(free_band_[f]);
  const MatrixX known = operators_->carried_transpose(free);
  Points u = Points::Zero(body_nodes_, 3);
  for (std::size_t k = 0; k < known_body_.size(); ++k)
    u.row(known_body_[k]) += g.row(known_band_[k]) + known.row(Eigen::Index(k));
  return u;
}

}  // namespace pliant
