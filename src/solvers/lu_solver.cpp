#include "solvers/lu_solver.hpp"

#include <Eigen/SparseCore>
#ifdef PLIANT_WITH_CHOLMOD
#include <umfpack.h>
#else
#include <Eigen/SparseLU>
#endif
#include <utility>

#include "solvers/blas.hpp"

namespace pliant {

namespace {

/// The matrix' transpose, column by column: rows of blocks stored one after the other.
Eigen::SparseMatrix<double> transposed_of(const BlockPattern& pattern) {
  Eigen::SparseMatrix<double> t(3 * pattern.rows, 3 * pattern.rows);
  std::vector<int> sizes;
  for (int row = 0; row < pattern.rows; ++row)
    for (int i = 0; i < 3; ++i) sizes.push_back(3 * (pattern.row_start[row + 1] - pattern.row_start[row]));
  t.reserve(sizes);
  for (int row = 0; row < pattern.rows; ++row)
    for (int i = 0; i < 3; ++i)
      for (int b = pattern.row_start[row]; b < pattern.row_start[row + 1]; ++b)
        for (int j = 0; j < 3; ++j) t.insert(3 * pattern.column[b] + j, 3 * row + i) = 1.0;
  t.makeCompressed();
  return t;
}

}  // namespace

#ifdef PLIANT_WITH_CHOLMOD

struct LuSolver::Factors {
  explicit Factors(std::shared_ptr<const BlockPattern> p) : pattern(std::move(p)), transposed(transposed_of(*pattern)) {
    umfpack_di_defaults(control);
    umfpack_di_defaults(without_refinement);
    without_refinement[UMFPACK_IRSTEP] = 0;
    umfpack_di_symbolic(size(), size(), transposed.outerIndexPtr(), transposed.innerIndexPtr(), transposed.valuePtr(),
                        &symbolic, control, nullptr);
  }
  ~Factors() {
    umfpack_di_free_symbolic(&symbolic);
    umfpack_di_free_numeric(&numeric);
  }
  Factors(const Factors&) = delete;
  Factors& operator=(const Factors&) = delete;
  int size() const { return int(transposed.rows()); }
  bool factorise() {
    const BlasCall blas;
    umfpack_di_free_numeric(&numeric);
    return umfpack_di_numeric(transposed.outerIndexPtr(), transposed.innerIndexPtr(), transposed.valuePtr(), symbolic,
                              &numeric, control, nullptr) == UMFPACK_OK;
  }
  VectorX solve(const VectorX& b, bool of_transposed, Refined refined) const {
    VectorX x(b.size());
    const BlasCall blas;
    const double* how = refined == Refined::Yes ? control : without_refinement;
    // What is stored is the transpose already.
    umfpack_di_solve(of_transposed ? UMFPACK_A : UMFPACK_At, transposed.outerIndexPtr(), transposed.innerIndexPtr(),
                     transposed.valuePtr(), x.data(), b.data(), numeric, how, nullptr);
    return x;
  }

  std::shared_ptr<const BlockPattern> pattern;
  Eigen::SparseMatrix<double> transposed;
  double control[UMFPACK_CONTROL] = {}, without_refinement[UMFPACK_CONTROL] = {};
  void *symbolic = nullptr, *numeric = nullptr;
};

#else

struct LuSolver::Factors {
  explicit Factors(std::shared_ptr<const BlockPattern> p) : pattern(std::move(p)), transposed(transposed_of(*pattern)) {
    plain.analyzePattern(transposed.transpose());
    other.analyzePattern(transposed);
  }
  bool factorise() {
    plain.factorize(transposed.transpose());
    other.factorize(transposed);
    return plain.info() == Eigen::Success && other.info() == Eigen::Success;
  }
  VectorX solve(const VectorX& b, bool of_transposed, Refined) const {
    return of_transposed ? VectorX(other.solve(b)) : VectorX(plain.solve(b));
  }

  std::shared_ptr<const BlockPattern> pattern;
  Eigen::SparseMatrix<double> transposed;
  Eigen::SparseLU<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int> > plain, other;
};

#endif

LuSolver::LuSolver(std::shared_ptr<const BlockPattern> pattern)
    : factors_(std::make_unique<Factors>(std::move(pattern))) {}
LuSolver::~LuSolver() = default;
LuSolver::LuSolver(LuSolver&&) noexcept = default;

bool LuSolver::factorise(const BlockMatrix& matrix) {
  const BlockPattern& pattern = *factors_->pattern;
  double* values = factors_->transposed.valuePtr();
  for (int row = 0; row < pattern.rows; ++row)
    for (int i = 0; i < 3; ++i)
      for (int b = pattern.row_start[row]; b < pattern.row_start[row + 1]; ++b)
        for (int j = 0; j < 3; ++j) *values++ = matrix.block(b)[3 * j + i];
  return factors_->factorise();
}

VectorX LuSolver::solve(const VectorX& b, Refined refined) const { return factors_->solve(b, false, refined); }
VectorX LuSolver::solve_transposed(const VectorX& b, Refined refined) const {
  return factors_->solve(b, true, refined);
}

}  // namespace pliant
