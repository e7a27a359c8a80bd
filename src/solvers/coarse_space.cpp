#include "solvers/coarse_space.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>

namespace pliant {

namespace {

constexpr int dense_rows = 40;  // aggregates whose matrix is factorised as a whole
constexpr double ridge = 1e-9;  // of the diagonal: aggregates of nodes in a line turn about it freely

using Block6 = RigidMatrix::Block;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Motion of a part at d from the middle of what moves rigidly: translation + rotation x d, and the same rotation.
Block6 rigid_motion(const Vector3& d) {
  Block6 T = Block6::Identity();
  T.topRightCorner<3, 3>() = -cross_matrix(d);
  return T;
}

/// Columns of each row, by marking who was seen.
class ColumnSet {
 public:
  explicit ColumnSet(int columns) : seen_(std::size_t(columns), -1) {}
  void begin(int row) { row_ = row, columns_.clear(); }
  void add(int column) {
    if (seen_[column] == row_) return;
    seen_[column] = row_;
    columns_.push_back(column);
  }
  const std::vector<int>& sorted() {
    std::ranges::sort(columns_);
    return columns_;
  }

 private:
  std::vector<int> seen_, columns_;
  int row_ = -1;
};

int find_column(const std::vector<int>& row_start, const std::vector<int>& column, int row, int col) {
  const auto begin = column.begin() + row_start[row], end = column.begin() + row_start[row + 1];
  return int(std::lower_bound(begin, end, col) - column.begin());
}

/// Blocks of a matrix that need not be square.
struct RigidMap {
  std::vector<int> row_start, column;
  std::vector<Block6> values;
  int find(int row, int col) const { return find_column(row_start, column, row, col); }
};

}  // namespace

int RigidMatrix::find(int row, int col) const { return find_column(row_start, column, row, col); }

Aggregates::Aggregates(const std::vector<int>& row_start, const std::vector<int>& column, int rings) {
  const int rows = int(row_start.size()) - 1;
  of.assign(std::size_t(rows), -1);
  const auto each_neighbour = [&](int row, const auto& body) {
    for (int b = row_start[row]; b < row_start[row + 1]; ++b) body(column[b]);
  };
  const auto is_free = [&](int row) { return of[row] < 0; };
  std::vector<int> front, next;
  for (int root = 0; root < rows; ++root) {  // whole neighbourhoods first
    bool all_free = is_free(root);
    each_neighbour(root, [&](int n) { all_free = all_free && is_free(n); });
    if (!all_free) continue;
    of[root] = count;
    front.assign(1, root);
    for (int ring = 0; ring < rings; ++ring) {
      next.clear();
      for (const int row : front)
        each_neighbour(row, [&](int n) {
          if (is_free(n)) of[n] = count, next.push_back(n);
        });
      front.swap(next);
    }
    ++count;
  }
  // What is left joins the aggregate that it meets most, from those nearest to aggregates outwards.
  for (bool any = true; any;) {
    any = false;
    front.clear();
    for (int row = 0; row < rows; ++row) {
      if (!is_free(row)) continue;
      int best = -1, most = 0;
      each_neighbour(row, [&](int n) {
        const int other = of[n];
        if (other < 0 || other >= count) return;
        int meets = 0;
        each_neighbour(row, [&](int m) { meets += of[m] == other; });
        if (meets > most) most = meets, best = other;
      });
      if (best < 0) continue;
      front.push_back(row), front.push_back(best);
    }
    for (std::size_t i = 0; i < front.size(); i += 2) of[front[i]] = front[i + 1], any = true;
  }
  for (int row = 0; row < rows; ++row)  // parts that are smaller than a neighbourhood
    if (is_free(row)) of[row] = count++;
  member_start.assign(std::size_t(count) + 1, 0);
  for (const int aggregate : of) ++member_start[aggregate + 1];
  for (int a = 0; a < count; ++a) member_start[a + 1] += member_start[a];
  member.resize(std::size_t(rows));
  std::vector<int> at(member_start.begin(), member_start.end() - 1);
  for (int row = 0; row < rows; ++row) member[at[of[row]]++] = row;
}

/// One matrix of the hierarchy and what leads to the next one.
struct CoarseSpace::Level {
  RigidMatrix A;
  std::vector<Vector3> middle;             // of each row
  std::vector<Block6> inverse;             // of each diagonal block
  std::vector<Vector6> b, x, work;         // right-hand side, solution
  std::unique_ptr<Aggregates> aggregates;  // null: the coarsest
  RigidMap P, AP;                          // smoothed prolongation from the next level, and A P

  /// Pattern of the next level's matrix and of the maps to it.
  RigidMatrix coarsen(int rings) {
    aggregates = std::make_unique<Aggregates>(A.row_start, A.column, rings);
    ColumnSet columns(aggregates->count);
    const auto spread = [&](const auto& row_start, const auto& column, const auto& via, RigidMap& out) {
      out.row_start.assign(1, 0);
      out.column.clear();
      for (int i = 0; i + 1 < int(row_start.size()); ++i) {
        columns.begin(i);
        for (int k = row_start[i]; k < row_start[i + 1]; ++k) via(column[k], [&](int c) { columns.add(c); });
        const auto& all = columns.sorted();
        out.column.insert(out.column.end(), all.begin(), all.end());
        out.row_start.push_back(int(out.column.size()));
      }
      out.values.resize(out.column.size());
      columns = ColumnSet(aggregates->count);
    };
    spread(
        A.row_start, A.column, [&](int j, const auto& add) { add(aggregates->of[j]); }, P);
    spread(
        A.row_start, A.column,
        [&](int j, const auto& add) {
          for (int p = P.row_start[j]; p < P.row_start[j + 1]; ++p) add(P.column[p]);
        },
        AP);
    RigidMatrix next;
    next.rows = aggregates->count;
    next.row_start.assign(1, 0);
    std::vector<std::vector<int>> rows(std::size_t(next.rows));
    for (int i = 0; i < A.rows; ++i)
      for (int p = P.row_start[i]; p < P.row_start[i + 1]; ++p) {
        auto& row = rows[P.column[p]];
        row.insert(row.end(), AP.column.begin() + AP.row_start[i], AP.column.begin() + AP.row_start[i + 1]);
      }
    for (int row = 0; row < next.rows; ++row) {
      auto& all = rows[row];
      std::ranges::sort(all);
      all.erase(std::unique(all.begin(), all.end()), all.end());
      for (const int c : all) {
        if (c == row) next.diagonal.push_back(int(next.column.size()));
        next.column.push_back(c);
      }
      next.row_start.push_back(int(next.column.size()));
    }
    next.values.resize(next.column.size());
    return next;
  }

  void prepare() {
    inverse.resize(std::size_t(A.rows));
    for (auto* v : {&b, &x, &work}) v->assign(std::size_t(A.rows), Vector6::Zero());
  }

  /// Raises what is singular, and inverts the diagonal blocks.
  [[nodiscard]] bool invert_diagonal() {
    for (int i = 0; i < A.rows; ++i) {
      Block6& D = A.values[A.diagonal[i]];
      for (int d = 0; d < 6; ++d) D(d, d) += D(d, d) == 0.0 ? 1.0 : ridge * std::abs(D(d, d));
      const Eigen::LLT<Block6> factor(D);
      if (factor.info() != Eigen::Success) return false;
      inverse[i] = factor.solve(Block6::Identity());
    }
    return true;
  }

  /// Largest eigenvalue of D^-1 A, from below, by a few powers.
  double spectral_radius() {
    constexpr int powers = 8;
    for (int i = 0; i < A.rows; ++i)
      for (int d = 0; d < 6; ++d) x[i][d] = std::sin(1.0 + 3.0 * i + 7.0 * d);
    double radius = 1.0;
    for (int k = 0; k < powers; ++k) {
      double before = 0.0, after = 0.0;  // in the norm of D
      for (int i = 0; i < A.rows; ++i) {
        Vector6 sum = Vector6::Zero();
        for (int c = A.row_start[i]; c < A.row_start[i + 1]; ++c) sum.noalias() += A.values[c] * x[A.column[c]];
        work[i].noalias() = inverse[i] * sum;
        before += x[i].dot(A.values[A.diagonal[i]] * x[i]);
        after += x[i].dot(sum);
      }
      radius = after / before;
      double norm = 0.0;
      for (const Vector6& v : work) norm += v.squaredNorm();
      norm = 1.0 / std::sqrt(norm);
      for (int i = 0; i < A.rows; ++i) x[i] = norm * work[i];
    }
    return radius;
  }

  /// P = (1 - w D^-1 A) T, then the next level's matrix P^T A P.
  void project(Level& next) {
    constexpr double above_estimate = 1.05;  // powers approach the radius from below
    const double relaxation = 4.0 / 3.0 / (above_estimate * spectral_radius());
    const auto zero = [](std::vector<Block6>& values) { std::ranges::fill(values, Block6::Zero()); };
    zero(P.values), zero(AP.values), zero(next.A.values);
    const auto& of = aggregates->of;
    const auto motion = [&](int row) { return rigid_motion(middle[row] - next.middle[of[row]]); };
    for (int i = 0; i < A.rows; ++i) {
      for (int c = A.row_start[i]; c < A.row_start[i + 1]; ++c) {
        const int j = A.column[c];
        P.values[P.find(i, of[j])].noalias() += A.values[c] * motion(j);
      }
      for (int p = P.row_start[i]; p < P.row_start[i + 1]; ++p) {
        Block6& own = P.values[p];
        own = -relaxation * (inverse[i] * own);
        if (P.column[p] == of[i]) own += motion(i);
      }
    }
    for (int i = 0; i < A.rows; ++i) {
      for (int c = A.row_start[i]; c < A.row_start[i + 1]; ++c) {
        const int j = A.column[c];
        for (int p = P.row_start[j]; p < P.row_start[j + 1]; ++p)
          AP.values[AP.find(i, P.column[p])].noalias() += A.values[c] * P.values[p];
      }
      for (int p = P.row_start[i]; p < P.row_start[i + 1]; ++p)
        for (int q = AP.row_start[i]; q < AP.row_start[i + 1]; ++q)
          next.A.values[next.A.find(P.column[p], AP.column[q])].noalias() += P.values[p].transpose() * AP.values[q];
    }
  }

  /// One sweep of Gauss and Seidel.
  void relax(bool forwards) {
    for (int k = 0; k < A.rows; ++k) {
      const int i = forwards ? k : A.rows - 1 - k;
      Vector6 left = b[i];
      for (int c = A.row_start[i]; c < A.row_start[i + 1]; ++c)
        if (A.column[c] != i) left.noalias() -= A.values[c] * x[A.column[c]];
      x[i].noalias() = inverse[i] * left;
    }
  }
};

CoarseSpace::~CoarseSpace() = default;

CoarseSpace::CoarseSpace(std::shared_ptr<const BlockPattern> pattern)
    : pattern_(std::move(pattern)),
      aggregates_(pattern_->row_start, pattern_->column, 2),
      lever_(3 * std::size_t(pattern_->rows), 0.0f),
      is_alone_(std::size_t(pattern_->rows), 0) {
  auto first = std::make_unique<Level>();
  RigidMatrix& A = first->A;
  A.rows = aggregates_.count;
  A.row_start.assign(1, 0);
  ColumnSet columns(A.rows);
  for (int a = 0; a < A.rows; ++a) {
    columns.begin(a);
    for (int m = aggregates_.member_start[a]; m < aggregates_.member_start[a + 1]; ++m) {
      const int row = aggregates_.member[m];
      for (int b = pattern_->row_start[row]; b < pattern_->row_start[row + 1]; ++b)
        columns.add(aggregates_.of[pattern_->column[b]]);
    }
    for (const int c : columns.sorted()) {
      if (c == a) A.diagonal.push_back(int(A.column.size()));
      A.column.push_back(c);
    }
    A.row_start.push_back(int(A.column.size()));
  }
  A.values.resize(A.column.size());
  levels_.push_back(std::move(first));
  while (levels_.back()->A.rows > dense_rows) {
    auto next = std::make_unique<Level>();
    next->A = levels_.back()->coarsen(1);
    if (next->A.rows == levels_.back()->A.rows) break;  // parts that nothing joins
    levels_.push_back(std::move(next));
  }
  for (auto& level : levels_) {
    level->prepare();
    level->middle.assign(std::size_t(level->A.rows), Vector3::Zero());
  }
}

void CoarseSpace::set_positions(const Points& positions) {
  const int placed = std::min(int(positions.rows()), pattern_->rows);
  std::vector<Vector3>& middle = levels_.front()->middle;
  for (int a = 0; a < aggregates_.count; ++a) {
    Vector3 sum = Vector3::Zero();
    int count = 0;
    const auto each = [&](const auto& body) {
      for (int m = aggregates_.member_start[a]; m < aggregates_.member_start[a + 1]; ++m)
        if (const int row = aggregates_.member[m]; row < placed) body(row);
    };
    each([&](int row) { sum += positions.row(row).transpose(), ++count; });
    middle[a] = sum / std::max(1, count);
    each([&](int row) {
      for (int d = 0; d < 3; ++d)
        lever_[3 * std::size_t(row) + std::size_t(d)] = float(positions(row, d) - middle[a][d]);
    });
  }
  for (std::size_t l = 0; l + 1 < levels_.size(); ++l) {
    const Aggregates& group = *levels_[l]->aggregates;
    for (int a = 0; a < group.count; ++a) {
      Vector3 sum = Vector3::Zero();
      const int begin = group.member_start[a], end = group.member_start[a + 1];
      for (int m = begin; m < end; ++m) sum += levels_[l]->middle[group.member[m]];
      levels_[l + 1]->middle[a] = sum / (end - begin);
    }
  }
}

Vector3 CoarseSpace::lever(int row) const {
  const float* d = &lever_[3 * std::size_t(row)];
  return {d[0], d[1], d[2]};
}

bool CoarseSpace::factorise(const BlockMatrix& matrix) {
  const BlockPattern& pattern = *pattern_;
  const std::size_t rows = std::size_t(pattern.rows);
  for_parts(Parts(rows), [&](std::size_t first, std::size_t last) {
    for (std::size_t row = first; row < last; ++row) {
      bool alone = true;
      for (int b = pattern.row_start[row]; b < pattern.row_start[row + 1] && alone; ++b) {
        if (pattern.column[b] == int(row)) continue;
        const double* v = matrix.block(b);
        for (int k = 0; k < 9; ++k) alone = alone && v[k] == 0.0;
      }
      is_alone_[row] = alone && pattern.row_start[row + 1] - pattern.row_start[row] > 1;
    }
  });
  RigidMatrix& A = levels_.front()->A;
  for_parts(Parts(std::size_t(A.rows), 64), [&](std::size_t first, std::size_t last) {
    for (int a = int(first); a < int(last); ++a) {
      for (int c = A.row_start[a]; c < A.row_start[a + 1]; ++c) A.values[c].setZero();
      for (int m = aggregates_.member_start[a]; m < aggregates_.member_start[a + 1]; ++m) {
        const int i = aggregates_.member[m];
        if (is_alone_[i]) continue;
        const Matrix3 Wi = -cross_matrix(lever(i));
        for (int b = pattern.row_start[i]; b < pattern.row_start[i + 1]; ++b) {
          const int j = pattern.column[b];
          if (is_alone_[j]) continue;
          const Eigen::Map<const Matrix3> own(matrix.block(b));
          const Matrix3 AW = -own * cross_matrix(lever(j));
          Block6& sum = A.values[A.find(a, aggregates_.of[j])];
          sum.topLeftCorner<3, 3>() += own;
          sum.topRightCorner<3, 3>() += AW;
          sum.bottomLeftCorner<3, 3>().noalias() += Wi.transpose() * own;
          sum.bottomRightCorner<3, 3>().noalias() += Wi.transpose() * AW;
        }
      }
    }
  });
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    if (!levels_[l]->invert_diagonal()) return false;
    if (l + 1 < levels_.size()) levels_[l]->project(*levels_[l + 1]);
  }
  const RigidMatrix& last = levels_.back()->A;
  if (last.rows > dense_rows) return true;
  dense_.setZero(6 * last.rows, 6 * last.rows);
  dense_work_.resize(6 * last.rows);
  for (int i = 0; i < last.rows; ++i)
    for (int c = last.row_start[i]; c < last.row_start[i + 1]; ++c)
      dense_.block<6, 6>(6 * i, 6 * last.column[c]) = last.values[c];
  return Eigen::internal::llt_inplace<double, Eigen::Lower>::blocked(dense_) == -1;
}

void CoarseSpace::restrict(const std::vector<double>& r, const Layout& layout) {
  std::vector<Vector6>& b = levels_.front()->b;
  for_parts(Parts(std::size_t(aggregates_.count), 64), [&](std::size_t first, std::size_t last) {
    for (std::size_t a = first; a < last; ++a) {
      Vector6 sum = Vector6::Zero();
      for (int m = aggregates_.member_start[a]; m < aggregates_.member_start[a + 1]; ++m) {
        const int row = aggregates_.member[m];
        if (is_alone_[row]) continue;
        const double* entry = &r[layout.first + layout.row_stride * std::size_t(row)];
        const Vector3 own(entry[0], entry[layout.stride], entry[2 * layout.stride]);
        sum.head<3>() += own;
        sum.tail<3>() += lever(row).cross(own);
      }
      b[a] = sum;
    }
  });
}

void CoarseSpace::cycle(std::size_t l) {
  Level& level = *levels_[l];
  const RigidMatrix& A = level.A;
  if (l + 1 == levels_.size() && A.rows > dense_rows) return level.relax(true);  // exact: the matrix is diagonal
  if (l + 1 == levels_.size()) {
    for (int i = 0; i < A.rows; ++i) dense_work_.segment<6>(6 * i) = level.b[i];
    dense_.triangularView<Eigen::Lower>().solveInPlace(dense_work_);
    dense_.triangularView<Eigen::Lower>().transpose().solveInPlace(dense_work_);
    for (int i = 0; i < A.rows; ++i) level.x[i] = dense_work_.segment<6>(6 * i);
    return;
  }
  std::ranges::fill(level.x, Vector6::Zero());
  level.relax(true);
  Level& next = *levels_[l + 1];
  std::ranges::fill(next.b, Vector6::Zero());
  for (int i = 0; i < A.rows; ++i) {
    Vector6 left = level.b[i];
    for (int c = A.row_start[i]; c < A.row_start[i + 1]; ++c) left.noalias() -= A.values[c] * level.x[A.column[c]];
    for (int p = level.P.row_start[i]; p < level.P.row_start[i + 1]; ++p)
      next.b[level.P.column[p]].noalias() += level.P.values[p].transpose() * left;
  }
  cycle(l + 1);
  for (int i = 0; i < A.rows; ++i)
    for (int p = level.P.row_start[i]; p < level.P.row_start[i + 1]; ++p)
      level.x[i].noalias() += level.P.values[p] * next.x[level.P.column[p]];
  level.relax(false);
}

void CoarseSpace::add_correction(const std::vector<double>& r, std::vector<double>& z, const Layout& layout) {
  restrict(r, layout);
  cycle(0);
  const std::vector<Vector6>& x = levels_.front()->x;
  for_parts(Parts(std::size_t(pattern_->rows)), [&](std::size_t first, std::size_t last) {
    for (std::size_t row = first; row < last; ++row) {
      if (is_alone_[row]) continue;
      const Vector6& motion = x[aggregates_.of[row]];
      const Vector3 moved = motion.head<3>() + motion.tail<3>().cross(lever(int(row)));
      for (std::size_t d = 0; d < 3; ++d)
        z[layout.first + layout.row_stride * row + layout.stride * d] += moved[Eigen::Index(d)];
    }
  });
}

}  // namespace pliant
