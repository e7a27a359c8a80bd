#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// Sparsity of a symmetric matrix of 3 x 3 blocks: compressed rows, columns ascending, both triangles.
struct BlockPattern {
  int rows = 0;                ///< block rows (nodes)
  std::vector<int> row_start;  ///< rows + 1
  std::vector<int> column;     ///< one a block
  std::vector<int> diagonal;   ///< index of each row's diagonal block
  int block_count() const { return int(column.size()); }

  /// Index of block (row, col), -1 where it is not in the pattern.
  [[nodiscard]] int find(int row, int col) const;

  /// Pattern in which all nodes of an element meet. `nodes` lists `nodes_per_element` nodes an element.
  static BlockPattern from_elements(int node_count, std::span<const int> nodes, int nodes_per_element);
};

/// Symmetric sparse matrix of 3 x 3 blocks. Blocks are stored column by column (9 doubles), so that a block times a
/// vector is three wide multiply-adds.
class BlockMatrix {
 public:
  BlockMatrix() = default;
  explicit BlockMatrix(std::shared_ptr<const BlockPattern> pattern);

  const BlockPattern& pattern() const { return *pattern_; }
  std::shared_ptr<const BlockPattern> shared_pattern() const { return pattern_; }
  int rows() const { return 3 * pattern_->rows; }

  double* block(int index) { return &values_[9 * std::size_t(index)]; }
  const double* block(int index) const { return &values_[9 * std::size_t(index)]; }
  void set_zero();
  /// y = A x. Both 3 n.
  void multiply(const VectorX& x, VectorX& y) const;
  /// Replaces the rows and columns of a node by the identity.
  void constrain(int node);

 private:
  std::shared_ptr<const BlockPattern> pattern_;
  std::vector<double> values_;  // 9 a block, and three more so that wide loads may run over the end
};

}  // namespace pliant
