#pragma once

#include <memory>
#include <vector>

#include "base/parallel.hpp"
#include "base/types.hpp"
#include "solvers/block_matrix.hpp"

namespace pliant {

/// Square sparse matrix of 6 x 6 blocks between aggregates, which move rigidly: translation and rotation about the
/// aggregate's middle. Compressed rows, columns ascending.
struct RigidMatrix {
  using Block = Eigen::Matrix<double, 6, 6>;
  int rows = 0;
  std::vector<int> row_start, column, diagonal;
  std::vector<Block> values;
  [[nodiscard]] int find(int row, int col) const;  ///< of a block that is there
};

/// Groups of rows of a pattern that are near each other, from the pattern alone: whole neighbourhoods first, whose
/// leftovers join those that they meet most.
struct Aggregates {
  int count = 0;
  std::vector<int> of;                    ///< aggregate of each row
  std::vector<int> member_start, member;  ///< rows of each aggregate, ascending
  /// @param rings  how many rows, from one in its middle outwards, an aggregate reaches: 1 or 2
  Aggregates(const std::vector<int>& row_start, const std::vector<int>& column, int rings);
};

/// Corrects a residual of a body's matrix by rigid motions of parts of the body, which local preconditioners leave:
/// z += T C T^T r. T moves aggregates of some eighty nodes rigidly; C is one cycle of multigrid by smoothed aggregation
/// (Vanek, Mandel, Brezina 1996) for T^T A T, whose unknowns are six an aggregate. T itself is not smoothed: T^T A T
/// then costs two products with A, and takes a few hundredths of its memory. Aggregates follow from the pattern and are
/// kept; values are made anew for each matrix. One instance for one thread.
class CoarseSpace {
 public:
  explicit CoarseSpace(std::shared_ptr<const BlockPattern> pattern);
  ~CoarseSpace();
  CoarseSpace(const CoarseSpace&) = delete;
  CoarseSpace& operator=(const CoarseSpace&) = delete;

  /// Where rows are, n x 3 [m]; there may be fewer than rows, and none: those without a place are only translated.
  void set_positions(const Points& positions);
  /// T^T A T and all that follows from it. Rows that meet no other are left out: those held. False where it is not
  /// positive definite.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix);
  /// Where the entries of a vector are: number d of a row is entry first + row_stride row + stride d.
  struct Layout {
    std::size_t row_stride = 4, stride = 1, first = 0;
  };
  /// z += T C T^T r
  void add_correction(const std::vector<double>& r, std::vector<double>& z, const Layout& layout);

 private:
  struct Level;
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Vector3 lever(int row) const;
  void restrict(const std::vector<double>& r, const Layout& layout);
  void cycle(std::size_t level);

  std::shared_ptr<const BlockPattern> pattern_;
  Aggregates aggregates_;
  std::vector<float> lever_;    // of each row from its aggregate's middle, in units of length
  std::vector<char> is_alone_;  // rows that meet no other
  std::vector<std::unique_ptr<Level>> levels_;
  MatrixX dense_;  // Cholesky factor of the coarsest matrix
  VectorX dense_work_;
};

}  // namespace pliant
