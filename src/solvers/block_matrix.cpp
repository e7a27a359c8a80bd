#include "solvers/block_matrix.hpp"

#include <algorithm>

#include "solvers/wide.hpp"

namespace pliant {

int BlockPattern::find(int row, int col) const {
  const auto begin = column.begin() + row_start[row], end = column.begin() + row_start[row + 1];
  const auto it = std::lower_bound(begin, end, col);
  return it != end && *it == col ? int(it - column.begin()) : -1;
}

BlockPattern BlockPattern::from_elements(int node_count, std::span<const int> nodes, int nodes_per_element) {
  std::vector<std::vector<int>> neighbours(node_count);
  for (std::size_t e = 0; e < nodes.size(); e += nodes_per_element)
    for (int a = 0; a < nodes_per_element; ++a)
      for (int b = 0; b < nodes_per_element; ++b) neighbours[nodes[e + a]].push_back(nodes[e + b]);
  BlockPattern pattern;
  pattern.rows = node_count;
  pattern.row_start.push_back(0);
  for (int row = 0; row < node_count; ++row) {
    auto& columns = neighbours[row];
    columns.push_back(row);
    std::sort(columns.begin(), columns.end());
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
    for (const int col : columns) {
      if (col == row) pattern.diagonal.push_back(int(pattern.column.size()));
      pattern.column.push_back(col);
    }
    pattern.row_start.push_back(int(pattern.column.size()));
  }
  return pattern;
}

BlockMatrix::BlockMatrix(std::shared_ptr<const BlockPattern> pattern)
    : pattern_(std::move(pattern)), values_(9 * std::size_t(pattern_->block_count()) + 3, 0.0) {}

void BlockMatrix::set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

void BlockMatrix::multiply(const VectorX& x, VectorX& y) const {
  y.resize(rows());
  const int* column = pattern_->column.data();
  for (int row = 0; row < pattern_->rows; ++row) {
    Wide<double> sum{};
    for (int b = pattern_->row_start[row]; b < pattern_->row_start[row + 1]; ++b) {
      const double* v = &x[3 * Eigen::Index(column[b])];
      sum += block_times(block(b), v[0], v[1], v[2]);
    }
    for (int d = 0; d < 3; ++d) y[3 * Eigen::Index(row) + d] = sum[d];
  }
}

void BlockMatrix::constrain(int node) {
  for (int b = pattern_->row_start[node]; b < pattern_->row_start[node + 1]; ++b) {
    std::fill_n(block(b), 9, 0.0);
    std::fill_n(block(pattern_->find(pattern_->column[b], node)), 9, 0.0);
  }
  double* d = block(pattern_->diagonal[node]);
  d[0] = d[4] = d[8] = 1.0;
}

}  // namespace pliant
