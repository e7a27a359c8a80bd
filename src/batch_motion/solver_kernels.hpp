#pragma once

#include "batch_motion/matrix_kernels.hpp"

// Conjugate gradients with the symmetric Gauss-Seidel preconditioner in Eisenstat's form (Eisenstat 1981): with the
// matrix scaled so that it is I + L + L^T, the preconditioned one is P^-1 (I + L + L^T) P^-T, P = I + L, and
//   P^-1 (I + L + L^T) P^-T p = t + P^-1 (p - t),   t = P^-T p,
// so that an iteration reads L twice, as a product alone would. It runs in single precision, on a residual that is
// measured in double precision, element by element, and scaled to length one, and is begun again until that residual is
// small enough. The matrix itself is nowhere.

namespace pliant::batch_motion {

/// Rows of one array, a number of each member.
enum SolverNumber : int {
  IsAlive,       // 1, or 0 of a member that has failed or is none
  IsOpen,        // 1 while its equation is to be solved further
  IsIterating,   // 1 while conjugate gradients go on
  RightSquares,  // |b|^2
  Squares,       // |b - A x|^2
  Scale,         // |b - A x|
  Rho,           // squares of the preconditioned residual
  Target,        // of them
  Alpha,
  Beta,
  Iterations,  // of the last equation
  AllIterations,
  Refinements,  // of the last equation
  Steps,        // that were taken
  solver_number_count
};

/// Sums over the rows of a chunk, one after the other.
template <class Lane, class Body>
PLIANT_DEVICE void each_row(const MeshView& mesh, int chunk, const Body& body) {
  const int first = chunk * mesh.chunk_rows, end = first + mesh.chunk_rows;
  const int last = end < mesh.nodes ? end : mesh.nodes;
  for (int k = 3 * first; k < 3 * last; ++k) body(std::size_t(k));
}

/// r = b - A x in double precision, out of the products of elements and samples with x.
struct Residual {
  MeshView mesh;
  StepNumbers step;
  const double *members, *right, *x, *element_product, *sample_product, *touched;
  double* residual;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real inertia[3], sum[3];
    const Real free = Real(mesh.held[node] ? 0.0 : 1.0), mass = mass_factor(step, members, lane);
    mass_times(mesh, x, node, inertia, lane);
    for (int i = 0; i < 3; ++i) sum[i] = lane.load(right, 3 * std::size_t(node) + std::size_t(i)) - mass * inertia[i];
    add_corners(mesh, element_product, -1.0, node, sum, lane);
    add_touches(mesh, touched, sample_product, -1.0, node, sum, lane);
    for (int i = 0; i < 3; ++i) lane.store(residual, 3 * std::size_t(node) + std::size_t(i), sum[i] * free);
  }
};

/// Squares of the residual and of the right-hand side, of each chunk.
struct ResidualSquares {
  MeshView mesh;
  const double *right, *residual;
  double* partial;  ///< 2 a chunk

  template <class Lane>
  PLIANT_DEVICE void operator()(int chunk, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real b = Real(0.0), r = Real(0.0);
    each_row<Lane>(mesh, chunk, [&](std::size_t k) {
      const Real own = lane.load(right, k), left = lane.load(residual, k);
      b += own * own, r += left * left;
    });
    lane.store(partial, 2 * std::size_t(chunk), b);
    lane.store(partial, 2 * std::size_t(chunk) + 1, r);
  }
};

template <class Lane>
PLIANT_DEVICE typename Lane::Real sum_chunks(const MeshView& mesh, const double* partial, int columns, int column,
                                             const Lane& lane) {
  typename Lane::Real sum = lane.load(partial, std::size_t(column));
  for (int c = 1; c < mesh.chunks; ++c)
    sum += lane.load(partial, std::size_t(columns) * std::size_t(c) + std::size_t(column));
  return sum;
}

/// Whether each member's equation is solved, and how far conjugate gradients are to go otherwise.
struct JudgeResidual {
  MeshView mesh;
  const double* partial;
  double* numbers;
  double tolerance;        ///< of |b - A x| / |b|
  double least_reduction;  ///< of one run of conjugate gradients: single precision takes it no further
  bool is_first;

  template <class Lane>
  PLIANT_DEVICE void operator()(int, const Lane& lane) const {
    using Real = typename Lane::Real;
    const Real zero = Real(0.0), one = Real(1.0);
    const Real b = sum_chunks(mesh, partial, 2, 0, lane), r = sum_chunks(mesh, partial, 2, 1, lane);
    const Real goal = Real(tolerance * tolerance) * b;
    if (is_first) {
      lane.store(numbers, IsOpen, lane.load(numbers, IsAlive));
      lane.store(numbers, Iterations, zero);
      lane.store(numbers, Refinements, zero);
    }
    const auto is_open = both(both(lane.load(numbers, IsOpen) > zero, negated(r <= goal)), r < Real(1e300));
    const auto is_solved = (r <= goal);
    // A member that is neither solved nor open any more has failed: its residual is no number.
    lane.store(numbers, IsAlive, select(is_open | is_solved, lane.load(numbers, IsAlive), zero));
    lane.store(numbers, IsOpen, select(is_open, one, zero));
    lane.store(numbers, IsIterating, select(is_open, one, zero));
    lane.store(numbers, RightSquares, b);
    lane.store(numbers, Squares, r);
    lane.store(numbers, Scale, select(is_open, root(r), one));
    // Half of what is asked for: the preconditioned residual's length is not quite that of the residual.
    const Real asked = Real(0.25) * goal / r, least = Real(least_reduction * least_reduction);
    lane.store(numbers, Target, select(is_open, select(asked > least, asked, least), zero));
    lane.store(numbers, Refinements, lane.load(numbers, Refinements) + select(is_open, one, zero));
  }
};

/// What a member's residual is scaled to, G r / |r|: where conjugate gradients begin.
struct NarrowResidual {
  const double *residual, *numbers;
  const float* pivot;
  float* out;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Single = typename Lane::Single;
    using Real = typename Lane::Real;
    Single r[3], y[3], G[6];
    const std::size_t k = 3 * std::size_t(node);
    const Real scale = Real(1.0) / lane.load(numbers, Scale);
    for (std::size_t i = 0; i < 3; ++i) r[i] = narrow(lane.load(residual, k + i) * scale);
    load_pivot(pivot, node, G, lane);
    pivot_times(G, r, y);
    for (std::size_t i = 0; i < 3; ++i) lane.store(out, k + i, y[i]);
  }
};

/// out = P^-1 (a - b), P = I + L, rows in order; b may be none.
struct ForwardSweep {
  MeshView mesh;
  const float *scaled, *a, *b;
  float* out;

  template <class Lane>
  PLIANT_DEVICE void gather(int row, const Lane& lane) const {
    using Single = typename Lane::Single;
    Single sum[3];
    const std::size_t r = 3 * std::size_t(row);
    for (std::size_t i = 0; i < 3; ++i) {
      sum[i] = lane.load(a, r + i);
      if (b) sum[i] -= lane.load(b, r + i);
    }
    for (int k = mesh.row_start[row]; k < mesh.row_start[row + 1]; ++k) {
      const std::size_t block = 9 * std::size_t(k), column = 3 * std::size_t(mesh.column[k]);
      const Single v0 = lane.load(out, column), v1 = lane.load(out, column + 1), v2 = lane.load(out, column + 2);
      for (std::size_t i = 0; i < 3; ++i)
        sum[i] -= lane.load(scaled, block + 3 * i) * v0 + lane.load(scaled, block + 3 * i + 1) * v1 +
                  lane.load(scaled, block + 3 * i + 2) * v2;
    }
    for (std::size_t i = 0; i < 3; ++i) lane.store(out, r + i, sum[i]);
  }
};

/// t = P^-T p, rows from the last to the first. `gather` reads p; `scatter` finds it in t.
struct BackwardSweep {
  MeshView mesh;
  const float *scaled, *p;
  float* t;

  template <class Lane>
  PLIANT_DEVICE void gather(int row, const Lane& lane) const {
    using Single = typename Lane::Single;
    Single sum[3];
    const std::size_t r = 3 * std::size_t(row);
    for (std::size_t i = 0; i < 3; ++i) sum[i] = lane.load(p, r + i);
    for (int k = mesh.upper_start[row]; k < mesh.upper_start[row + 1]; ++k) {
      const std::size_t block = 9 * std::size_t(mesh.upper_block[k]), column = 3 * std::size_t(mesh.upper_column[k]);
      const Single v0 = lane.load(t, column), v1 = lane.load(t, column + 1), v2 = lane.load(t, column + 2);
      for (std::size_t i = 0; i < 3; ++i)
        sum[i] -= lane.load(scaled, block + i) * v0 + lane.load(scaled, block + 3 + i) * v1 +
                  lane.load(scaled, block + 6 + i) * v2;
    }
    for (std::size_t i = 0; i < 3; ++i) lane.store(t, r + i, sum[i]);
  }
  template <class Lane>
  PLIANT_DEVICE void scatter(int row, const Lane& lane) const {
    using Single = typename Lane::Single;
    const std::size_t r = 3 * std::size_t(row);
    const Single v0 = lane.load(t, r), v1 = lane.load(t, r + 1), v2 = lane.load(t, r + 2);
    for (int k = mesh.row_start[row]; k < mesh.row_start[row + 1]; ++k) {
      const std::size_t block = 9 * std::size_t(k), column = 3 * std::size_t(mesh.column[k]);
      for (std::size_t i = 0; i < 3; ++i)
        lane.store(
            t, column + i,
            lane.load(t, column + i) - (lane.load(scaled, block + i) * v0 + lane.load(scaled, block + 3 + i) * v1 +
                                        lane.load(scaled, block + 6 + i) * v2));
    }
  }
};

/// p = r and t = r, x = 0, and the squares of r, of a chunk.
struct BeginGradients {
  MeshView mesh;
  const float* r;
  float *p, *t, *x;
  double* partial;

  template <class Lane>
  PLIANT_DEVICE void operator()(int chunk, const Lane& lane) const {
    using Single = typename Lane::Single;
    Single sum = Single(0.0f);
    each_row<Lane>(mesh, chunk, [&](std::size_t k) {
      const Single own = lane.load(r, k);
      sum += own * own;
      lane.store(p, k, own);
      lane.store(t, k, own);
      lane.store(x, k, Single(0.0f));
    });
    lane.store(partial, std::size_t(chunk), widen(sum));
  }
};
struct BeginNumbers {
  MeshView mesh;
  const double* partial;
  double* numbers;

  template <class Lane>
  PLIANT_DEVICE void operator()(int, const Lane& lane) const {
    const auto rho = sum_chunks(mesh, partial, 1, 0, lane);
    lane.store(numbers, Rho, rho);
    lane.store(numbers, Target, lane.load(numbers, Target) * rho);
  }
};

/// p . q, q = t + s, of a chunk.
struct Curvature {
  MeshView mesh;
  const float *p, *t, *s;
  double* partial;

  template <class Lane>
  PLIANT_DEVICE void operator()(int chunk, const Lane& lane) const {
    using Single = typename Lane::Single;
    Single sum = Single(0.0f);
    each_row<Lane>(mesh, chunk, [&](std::size_t k) { sum += lane.load(p, k) * (lane.load(t, k) + lane.load(s, k)); });
    lane.store(partial, std::size_t(chunk), widen(sum));
  }
};
struct StepLength {
  MeshView mesh;
  const double* partial;
  double* numbers;

  template <class Lane>
  PLIANT_DEVICE void operator()(int, const Lane& lane) const {
    using Real = typename Lane::Real;
    const Real curvature = sum_chunks(mesh, partial, 1, 0, lane), going = lane.load(numbers, IsIterating);
    lane.store(numbers, Alpha, select(going > Real(0.0), lane.load(numbers, Rho) / curvature, Real(0.0)));
    lane.store(numbers, Iterations, lane.load(numbers, Iterations) + going);
    lane.store(numbers, AllIterations, lane.load(numbers, AllIterations) + going);
  }
};

/// x += alpha t, r -= alpha (t + s), and the squares of r, of a chunk. Members that do not go on have an alpha of zero.
struct UpdateSolution {
  MeshView mesh;
  const double* numbers;
  const float *t, *s;
  float *x, *r;
  double* partial;

  template <class Lane>
  PLIANT_DEVICE void operator()(int chunk, const Lane& lane) const {
    using Single = typename Lane::Single;
    const Single alpha = narrow(lane.load(numbers, Alpha));
    Single sum = Single(0.0f);
    each_row<Lane>(mesh, chunk, [&](std::size_t k) {
      const Single along = lane.load(t, k), left = lane.load(r, k) - alpha * (along + lane.load(s, k));
      lane.store(x, k, lane.load(x, k) + alpha * along);
      lane.store(r, k, left);
      sum += left * left;
    });
    lane.store(partial, std::size_t(chunk), widen(sum));
  }
};
struct NextDirection {
  MeshView mesh;
  const double* partial;
  double* numbers;
  double most_iterations;

  template <class Lane>
  PLIANT_DEVICE void operator()(int, const Lane& lane) const {
    using Real = typename Lane::Real;
    const Real zero = Real(0.0), rho = sum_chunks(mesh, partial, 1, 0, lane), before = lane.load(numbers, Rho);
    const auto goes_on = both(both(lane.load(numbers, IsIterating) > zero, rho > lane.load(numbers, Target)),
                              lane.load(numbers, Iterations) < Real(most_iterations));
    lane.store(numbers, IsIterating, select(goes_on, Real(1.0), zero));
    lane.store(numbers, Beta, select(goes_on, rho / before, zero));
    lane.store(numbers, Rho, rho);
  }
};

/// p = r + beta p, and the same in t.
struct UpdateDirection {
  MeshView mesh;
  const double* numbers;
  const float* r;
  float *p, *t;

  template <class Lane>
  PLIANT_DEVICE void operator()(int chunk, const Lane& lane) const {
    using Single = typename Lane::Single;
    const Single beta = narrow(lane.load(numbers, Beta));
    each_row<Lane>(mesh, chunk, [&](std::size_t k) {
      const Single next = lane.load(r, k) + beta * lane.load(p, k);
      lane.store(p, k, next);
      lane.store(t, k, next);
    });
  }
};

/// The solution in double precision: x += |r| G^T y. Members that are solved have y = 0 and stay as they are.
struct AddCorrection {
  const double* numbers;
  const float *pivot, *y;
  double* x;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Single = typename Lane::Single;
    using Real = typename Lane::Real;
    Single own[3], out[3], G[6];
    const std::size_t k = 3 * std::size_t(node);
    const Real scale = lane.load(numbers, Scale), zero = Real(0.0);
    const auto is_open = lane.load(numbers, IsOpen) > zero;
    for (std::size_t i = 0; i < 3; ++i) own[i] = lane.load(y, k + i);
    load_pivot(pivot, node, G, lane);
    pivot_transposed_times(G, own, out);
    for (std::size_t i = 0; i < 3; ++i) {
      const Real before = lane.load(x, k + i);
      lane.store(x, k + i, select(is_open, before + scale * widen(out[i]), before));
    }
  }
};

/// Members whose equation is still open after the last refinement, or took too many iterations, have failed.
struct JudgeMembers {
  double* numbers;

  template <class Lane>
  PLIANT_DEVICE void operator()(int, const Lane& lane) const {
    using Real = typename Lane::Real;
    const auto is_open = lane.load(numbers, IsOpen) > Real(0.0);
    lane.store(numbers, IsAlive, select(is_open, Real(0.0), lane.load(numbers, IsAlive)));
  }
};

}  // namespace pliant::batch_motion
