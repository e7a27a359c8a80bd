#pragma once

#include "solvers/block_matrix.hpp"

namespace pliant::test {

/// Every entry of a block matrix, read block by block.
inline MatrixX dense(const BlockMatrix& matrix) {
  const BlockPattern& pattern = matrix.pattern();
  MatrixX out = MatrixX::Zero(matrix.rows(), matrix.rows());
  for (int row = 0; row < pattern.rows; ++row)
    for (int b = pattern.row_start[row]; b < pattern.row_start[row + 1]; ++b)
      out.block<3, 3>(3 * row, 3 * pattern.column[b]) = Eigen::Map<const Matrix3>(matrix.block(b));
  return out;
}

}  // namespace pliant::test
