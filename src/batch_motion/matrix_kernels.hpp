#pragma once

#include "batch_motion/element_kernels.hpp"

namespace pliant::batch_motion {

/// Mass times a field, for unit density [m^3 times the field's unit].
template <class Lane>
PLIANT_DEVICE void mass_times(const MeshView& mesh, const double* field, int node, typename Lane::Real* out,
                              const Lane& lane) {
  using Real = typename Lane::Real;
  const auto add = [&](double mass, int column) {
    for (int i = 0; i < 3; ++i) out[i] += lane.load(field, 3 * std::size_t(column) + std::size_t(i)) * Real(mass);
  };
  for (int i = 0; i < 3; ++i) out[i] = Real(0.0);
  for (int k = mesh.row_start[node]; k < mesh.row_start[node + 1]; ++k) add(mesh.mass[k], mesh.column[k]);
  add(mesh.mass[mesh.lower_blocks + node], node);
  for (int k = mesh.upper_start[node]; k < mesh.upper_start[node + 1]; ++k)
    add(mesh.mass[mesh.upper_block[k]], mesh.upper_column[k]);
}

/// rho (1/(theta dt) + alpha)
template <class Lane>
PLIANT_DEVICE typename Lane::Real mass_factor(const StepNumbers& step, const double* members, const Lane& lane) {
  using Real = typename Lane::Real;
  return lane.load(members, Density) * (Real(1.0 / (step.theta * step.dt)) + lane.load(members, MassDamping));
}

/// Whether a sample at a node is touched, a number of each member that is not zero where it is.
struct TouchedNodes {
  MeshView mesh;
  const double* sample_matrix;
  double* touched;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real slopes = Real(0.0);
    for (int k = mesh.touch_start[node]; k < mesh.touch_start[node + 1]; ++k)
      slopes += lane.load(sample_matrix, 2 * std::size_t(mesh.touch_sample[k]));
    lane.store(touched, std::size_t(node), slopes);
  }
};
/// sum += factor times what samples at a node give it, 3 a sample.
template <class Lane>
PLIANT_DEVICE void add_touches(const MeshView& mesh, const double* touched, const double* values, double factor,
                               int node, typename Lane::Real* sum, const Lane& lane) {
  using Real = typename Lane::Real;
  if (!any(lane.load(touched, std::size_t(node)) > Real(0.0))) return;
  for (int k = mesh.touch_start[node]; k < mesh.touch_start[node + 1]; ++k)
    for (int i = 0; i < 3; ++i)
      sum[i] += lane.load(values, 3 * std::size_t(mesh.touch_sample[k]) + std::size_t(i)) *
                Real(factor * mesh.touch_weight[k]);
}
/// sum += factor times what elements give a node, 3 a corner.
template <class Lane>
PLIANT_DEVICE void add_corners(const MeshView& mesh, const double* values, double factor, int node,
                               typename Lane::Real* sum, const Lane& lane) {
  using Real = typename Lane::Real;
  for (int k = mesh.corner_start[node]; k < mesh.corner_start[node + 1]; ++k)
    for (int i = 0; i < 3; ++i)
      sum[i] += lane.load(values, 3 * std::size_t(mesh.corner[k]) + std::size_t(i)) * Real(factor);
}

/// dt v, where a step's solution is looked for first.
struct FirstWay {
  MeshView mesh;
  StepNumbers step;
  const double* v;
  double* way;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    const double scale = mesh.held[node] ? 0.0 : step.dt;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = 3 * std::size_t(node) + i;
      lane.store(way, k, lane.load(v, k) * typename Lane::Real(scale));
    }
  }
};

/// The step's right-hand side (Weiss 2020, eq. 14), M v / theta + dt sum of f(x).
struct StepRight {
  MeshView mesh;
  StepNumbers step;
  const double *members, *v, *element_force, *sample_force, *touched;
  double* right;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Real = typename Lane::Real;
    const double free = mesh.held[node] ? 0.0 : 1.0;
    Real force[3], inertia[3];
    const Real density = lane.load(members, Density), weight = density * Real(mesh.nodal_volume[node]);
    for (int i = 0; i < 3; ++i) force[i] = weight * lane.load(members, std::size_t(Gravity) + std::size_t(i));
    add_corners(mesh, element_force, 1.0, node, force, lane);
    add_touches(mesh, touched, sample_force, 1.0, node, force, lane);
    mass_times(mesh, v, node, inertia, lane);
    const Real scale = density * Real(1.0 / step.theta);
    for (int i = 0; i < 3; ++i) {
      const std::size_t k = 3 * std::size_t(node) + std::size_t(i);
      lane.store(right, k, (force[i] * Real(step.dt) + scale * inertia[i]) * Real(free));
    }
  }
};

/// A block of the step's matrix, (1/(theta dt) + alpha) rho M + dt sum of s K: those below the diagonal, then those on
/// it. Rows and columns of held nodes are the identity's.
template <int N>
struct StepMatrix {
  MeshView mesh;
  StepNumbers step;
  MemberStiffness<N> stiffness;
  const double *members, *rotation, *sample_matrix;

  template <class Lane>
  PLIANT_DEVICE void find(int block, int row, int column, typename Lane::Real* A, const Lane& lane) const {
    using Real = typename Lane::Real;
    for (int k = 0; k < 9; ++k) A[k] = Real(0.0);
    if (mesh.held[row] || mesh.held[column]) {
      for (int i = 0; i < 3; ++i) A[4 * i] = Real(row == column ? 1.0 : 0.0);
      return;
    }
    add_elements(block, A, lane);
    add_samples(block, A, lane);
    const Real mass = mass_factor(step, members, lane) * Real(mesh.mass[block]);
    for (int i = 0; i < 3; ++i) A[4 * i] += mass;
  }
  template <class Lane>
  PLIANT_DEVICE void add_elements(int block, typename Lane::Real* A, const Lane& lane) const {
    using Real = typename Lane::Real;
    for (int p = mesh.part_start[block]; p < mesh.part_start[block + 1]; ++p) {
      const int element = mesh.part_element[p], corners = mesh.part_corners[p];
      Real R[9];
      constexpr int ahead = 4;  // the list has so many more parts at its end
      const int corners_ahead = mesh.part_corners[p + ahead];
      stiffness.fetch(mesh.part_element[p + ahead], corners_ahead / N, corners_ahead % N, lane);
      load_rotation<N>(rotation, element, R, lane);
      stiffness.add_block(mesh, members, element, corners / N, corners % N, R,
                          stiffness_factor(mesh, step, members, element, lane), A, lane);
    }
  }
  template <class Lane>
  PLIANT_DEVICE void add_samples(int block, typename Lane::Real* A, const Lane& lane) const {
    using Real = typename Lane::Real;
    if (mesh.pair_start[block] == mesh.pair_start[block + 1]) return;
    Real slope = Real(0.0), drag = Real(0.0), n[3], squares = Real(0.0);
    for (int p = mesh.pair_start[block]; p < mesh.pair_start[block + 1]; ++p) {
      const std::size_t sample = std::size_t(mesh.pair_sample[p]);
      slope += lane.load(sample_matrix, 2 * sample) * Real(mesh.pair_weight[p]);
      if (step.friction_way > 0.0) drag += lane.load(sample_matrix, 2 * sample + 1) * Real(mesh.pair_weight[p]);
    }
    for (int i = 0; i < 3; ++i)
      n[i] = lane.load(members, std::size_t(PlaneNormal) + std::size_t(i)), squares += n[i] * n[i];
    const Real scale = Real(step.dt * step.contact_weight);
    slope *= scale, drag *= scale;
    const Real along = slope - drag / squares;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) A[3 * i + j] += along * n[i] * n[j];
    for (int i = 0; i < 3; ++i) A[4 * i] += drag;
  }
};

/// G = C^-1 of each diagonal block C C^T, lower triangular: 00 10 11 20 21 22. Not a number where the block is not
/// positive definite.
template <int N>
struct DiagonalFactor {
  StepMatrix<N> of;
  float* pivot;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real A[9];
    of.find(of.mesh.lower_blocks + node, node, node, A, lane);
    const Real one = Real(1.0), a = one / root(A[0]), b = A[3] * a, c = A[6] * a;
    const Real d = one / root(A[4] - b * b), e = (A[7] - c * b) * d, f = one / root(A[8] - c * c - e * e);
    const Real G[6] = {a, -(b * a * d), d, (b * e * d - c) * a * f, -(e * d * f), f};
    for (std::size_t k = 0; k < 6; ++k) lane.store(pivot, 6 * std::size_t(node) + k, narrow(G[k]));
  }
};

template <class Lane>
PLIANT_DEVICE void load_pivot(const float* pivot, int node, typename Lane::Single* G, const Lane& lane) {
  for (std::size_t k = 0; k < 6; ++k) G[k] = lane.load(pivot, 6 * std::size_t(node) + k);
}
/// G v and G^T v.
template <class Number>
PLIANT_DEVICE void pivot_times(const Number* G, const Number* v, Number* out) {
  out[0] = G[0] * v[0];
  out[1] = G[1] * v[0] + G[2] * v[1];
  out[2] = G[3] * v[0] + G[4] * v[1] + G[5] * v[2];
}
template <class Number>
PLIANT_DEVICE void pivot_transposed_times(const Number* G, const Number* v, Number* out) {
  out[0] = G[0] * v[0] + G[1] * v[1] + G[3] * v[2];
  out[1] = G[2] * v[1] + G[4] * v[2];
  out[2] = G[5] * v[2];
}

/// L_ij = G_i A_ij G_j^T below the diagonal, in single precision: of the matrix whose diagonal blocks are the identity.
template <int N>
struct ScaledBlock {
  StepMatrix<N> of;
  const float* pivot;
  float* scaled;

  template <class Lane>
  PLIANT_DEVICE void operator()(int block, const Lane& lane) const {
    using Single = typename Lane::Single;
    const int row = of.mesh.row[block], column = of.mesh.column[block];
    typename Lane::Real A[9];
    of.find(block, row, column, A, lane);
    Single own[6], other[6], half[9];
    load_pivot(pivot, row, own, lane);
    load_pivot(pivot, column, other, lane);
    for (int j = 0; j < 3; ++j) {
      const Single a[3] = {narrow(A[j]), narrow(A[3 + j]), narrow(A[6 + j])};
      Single out[3];
      pivot_times(own, a, out);
      for (int i = 0; i < 3; ++i) half[3 * i + j] = out[i];
    }
    for (std::size_t i = 0; i < 3; ++i) {
      Single out[3];
      pivot_times(other, half + 3 * i, out);
      for (std::size_t j = 0; j < 3; ++j) lane.store(scaled, 9 * std::size_t(block) + 3 * i + j, out[j]);
    }
  }
};

}  // namespace pliant::batch_motion
