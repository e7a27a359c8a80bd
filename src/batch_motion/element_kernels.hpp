#pragma once

#include "batch_motion/mesh_view.hpp"
#include "batch_motion/rotation.hpp"

namespace pliant::batch_motion {

/// Stiffness of elements of N nodes in their own frame for E = 1 Pa, of each member.
template <int N>
struct MemberStiffness;

/// Of hexahedra: the blocks (a, b), a <= b, of each class of elements, nine numbers each; of each member, or once for
/// all where they share Poisson's ratio.
template <>
struct MemberStiffness<8> {
  static constexpr int pairs = 36;
  const double *value, *change;  ///< [m], and derivative by Poisson's ratio
  const int* element_class;
  bool is_shared;

  static PLIANT_DEVICE int pair(int a, int b) { return a * 8 - a * (a - 1) / 2 + b - a; }

  template <bool shared, class Lane>
  static PLIANT_DEVICE typename Lane::Real entry(const double* array, std::size_t k, const Lane& lane) {
    if constexpr (shared)
      return typename Lane::Real(array[k]);
    else
      return lane.load(array, k);
  }

  /// y = K d of some vectors, 24 each, for the array's K, which may have to come from far and is read once for them.
  template <bool shared, int vectors, class Lane>
  PLIANT_DEVICE void multiply(const double* array, int element, const typename Lane::Real* d, typename Lane::Real* y,
                              const Lane& lane) const {
    using Real = typename Lane::Real;
    for (int k = 0; k < 24 * vectors; ++k) y[k] = Real(0.0);
    std::size_t k = 9 * pairs * std::size_t(element_class[element]);
    for (int a = 0; a < 8; ++a)
      for (int b = a; b < 8; ++b, k += 9) {
        Real K[9];
        for (int i = 0; i < 9; ++i) K[i] = entry<shared>(array, k + std::size_t(i), lane);
        for (int v = 0; v < 24 * vectors; v += 24) {
          const Real *da = d + v + 3 * a, *db = d + v + 3 * b;
          Real *ya = y + v + 3 * a, *yb = y + v + 3 * b;
          for (int i = 0; i < 3; ++i) ya[i] += K[3 * i] * db[0] + K[3 * i + 1] * db[1] + K[3 * i + 2] * db[2];
          if (a == b) continue;
          for (int j = 0; j < 3; ++j) yb[j] += K[j] * da[0] + K[3 + j] * da[1] + K[6 + j] * da[2];
        }
      }
  }
  /// y = K d of some vectors, 3 N each.
  template <int vectors, class Lane>
  PLIANT_DEVICE void times(const MeshView&, const double*, int element, const typename Lane::Real* d,
                           typename Lane::Real* y, const Lane& lane) const {
    if (is_shared)
      multiply<true, vectors>(value, element, d, y, lane);
    else
      multiply<false, vectors>(value, element, d, y, lane);
  }
  template <class Lane>
  PLIANT_DEVICE void change_times(const MeshView&, const double*, int element, const typename Lane::Real* d,
                                  typename Lane::Real* y, const Lane& lane) const {
    if (is_shared)
      multiply<true, 1>(change, element, d, y, lane);
    else
      multiply<false, 1>(change, element, d, y, lane);
  }
  /// Has a block that is needed soon brought near.
  template <class Lane>
  PLIANT_DEVICE void fetch(int element, int a, int b, const Lane& lane) const {
    if (is_shared) return;
    const int p = a <= b ? pair(a, b) : pair(b, a);
    lane.fetch(value, 9 * (pairs * std::size_t(element_class[element]) + std::size_t(p)), 9);
  }
  /// out += factor R K_ab R^T
  template <class Lane>
  PLIANT_DEVICE void add_block(const MeshView&, const double*, int element, int a, int b, const typename Lane::Real* R,
                               const typename Lane::Real& factor, typename Lane::Real* out, const Lane& lane) const {
    if (is_shared)
      add<true>(element, a, b, R, factor, out, lane);
    else
      add<false>(element, a, b, R, factor, out, lane);
  }
  template <bool shared, class Lane>
  PLIANT_DEVICE void add(int element, int a, int b, const typename Lane::Real* R, const typename Lane::Real& factor,
                         typename Lane::Real* out, const Lane& lane) const {
    using Real = typename Lane::Real;
    const bool is_upper = a <= b;
    const int p = is_upper ? pair(a, b) : pair(b, a);
    const std::size_t k = 9 * (pairs * std::size_t(element_class[element]) + std::size_t(p));
    const std::size_t row = is_upper ? 3 : 1, column = is_upper ? 1 : 3;
    Real half[9];  // factor R K
    for (int j = 0; j < 3; ++j) {
      Real K[3];
      for (int l = 0; l < 3; ++l)
        K[l] = factor * entry<shared>(value, k + row * std::size_t(l) + column * std::size_t(j), lane);
      for (int i = 0; i < 3; ++i) half[3 * i + j] = R[3 * i] * K[0] + R[3 * i + 1] * K[1] + R[3 * i + 2] * K[2];
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        out[3 * i + j] += half[3 * i] * R[3 * j] + half[3 * i + 1] * R[3 * j + 1] + half[3 * i + 2] * R[3 * j + 2];
  }
};

/// Of linear tetrahedra, which have one strain each:
///   K_ab = V (lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I),  K d = V (lambda tr(H) I + mu (H + H^T)) g
/// with H = sum_b d_b g_b^T.
template <>
struct MemberStiffness<4> {
  template <class Lane>
  PLIANT_DEVICE void stress_times(const MeshView& mesh, int element, const typename Lane::Real& lambda,
                                  const typename Lane::Real& mu, const typename Lane::Real* d,
                                  typename Lane::Real* y) const {
    using Real = typename Lane::Real;
    const double *g = mesh.gradient + 12 * std::size_t(element), volume = mesh.volume[element];
    Real H[9], T[9];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        H[3 * i + j] = d[i] * g[j] + d[3 + i] * g[3 + j] + d[6 + i] * g[6 + j] + d[9 + i] * g[9 + j];
    const Real trace = lambda * (H[0] + H[4] + H[8]);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        T[3 * i + j] = mu * (H[3 * i + j] + H[3 * j + i]);
        if (i == j) T[3 * i + j] += trace;
        T[3 * i + j] *= volume;
      }
    for (int a = 0; a < 4; ++a) pliant::batch_motion::times(T, g + 3 * a, y + 3 * a);
  }
  template <int vectors, class Lane>
  PLIANT_DEVICE void times(const MeshView& mesh, const double* members, int element, const typename Lane::Real* d,
                           typename Lane::Real* y, const Lane& lane) const {
    for (int v = 0; v < 12 * vectors; v += 12)
      stress_times<Lane>(mesh, element, lane.load(members, Lambda), lane.load(members, Mu), d + v, y + v);
  }
  template <class Lane>
  PLIANT_DEVICE void change_times(const MeshView& mesh, const double* members, int element,
                                  const typename Lane::Real* d, typename Lane::Real* y, const Lane& lane) const {
    stress_times<Lane>(mesh, element, lane.load(members, LambdaChange), lane.load(members, MuChange), d, y);
  }
  template <class Lane>
  PLIANT_DEVICE void fetch(int, int, int, const Lane&) const {}
  template <class Lane>
  PLIANT_DEVICE void add_block(const MeshView& mesh, const double* members, int element, int a, int b,
                               const typename Lane::Real* R, const typename Lane::Real& factor,
                               typename Lane::Real* out, const Lane& lane) const {
    using Real = typename Lane::Real;
    const double *ga = mesh.gradient + 12 * std::size_t(element) + 3 * a,
                 *gb = mesh.gradient + 12 * std::size_t(element) + 3 * b;
    const Real scale = factor * mesh.volume[element];
    const Real lambda = scale * lane.load(members, Lambda), mu = scale * lane.load(members, Mu);
    const double along = ga[0] * gb[0] + ga[1] * gb[1] + ga[2] * gb[2];
    Real ha[3], hb[3], la[3], ma[3];
    pliant::batch_motion::times(R, ga, ha);
    pliant::batch_motion::times(R, gb, hb);
    for (int i = 0; i < 3; ++i) la[i] = lambda * ha[i], ma[i] = mu * ha[i];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) out[3 * i + j] += la[i] * hb[j] + hb[i] * ma[j];
    for (int i = 0; i < 3; ++i) out[4 * i] += mu * along;
  }
};

/// Rotations of elements about x + lag v (`Elasticity`), from those at hand.
template <int N>
struct RotateElements {
  MeshView mesh;
  StepNumbers step;
  const double *x, *v;
  double *quaternion, *rotation;  ///< 4 and 9 an element

  template <class Lane>
  static PLIANT_DEVICE void gradient(const MeshView& mesh, double lag, const double* x, const double* v, int element,
                                     typename Lane::Real* F, const Lane& lane) {
    using Real = typename Lane::Real;
    for (int k = 0; k < 9; ++k) F[k] = Real(0.0);
    for (int a = 0; a < N; ++a) {
      const std::size_t corner = N * std::size_t(element) + std::size_t(a);
      const std::size_t node = std::size_t(mesh.connectivity[corner]);
      for (int i = 0; i < 3; ++i) {
        const std::size_t k = 3 * node + std::size_t(i);
        const Real p = lane.load(x, k) + Real(lag) * lane.load(v, k);
        for (int j = 0; j < 3; ++j) F[3 * i + j] += p * mesh.gradient[3 * corner + std::size_t(j)];
      }
    }
  }
  template <class Lane>
  PLIANT_DEVICE void operator()(int element, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real F[9], q[4], R[9];
    gradient(mesh, step.rotation_lag, x, v, element, F, lane);
    const std::size_t e = std::size_t(element);
    for (std::size_t k = 0; k < 4; ++k) q[k] = lane.load(quaternion, 4 * e + k);
    closest_rotation<Real, typename Lane::Mask>(F, q, R);
    for (std::size_t k = 0; k < 4; ++k) lane.store(quaternion, 4 * e + k, q[k]);
    for (std::size_t k = 0; k < 9; ++k) lane.store(rotation, 9 * e + k, R[k]);
  }
};

template <int N, class Lane>
PLIANT_DEVICE void load_rotation(const double* rotation, int element, typename Lane::Real* R, const Lane& lane) {
  for (std::size_t k = 0; k < 9; ++k) R[k] = lane.load(rotation, 9 * std::size_t(element) + k);
}

/// q = R^T z of an element's nodes relative to the first, z = x + s (end - x); and d = q - X.
template <int N, class Lane>
PLIANT_DEVICE void unrotate(const MeshView& mesh, const double* x, const double* end, const typename Lane::Real& s,
                            int element, const typename Lane::Real* R, typename Lane::Real* q, typename Lane::Real* d,
                            const Lane& lane) {
  using Real = typename Lane::Real;
  Real first[3];
  const int* nodes = mesh.connectivity + N * std::size_t(element);
  for (int a = 0; a < N; ++a) {
    Real z[3];
    for (int i = 0; i < 3; ++i) {
      const std::size_t k = 3 * std::size_t(nodes[a]) + std::size_t(i);
      z[i] = lane.load(x, k);
      if (end) z[i] += s * (lane.load(end, k) - z[i]);
      if (a == 0) first[i] = z[i];
      z[i] -= first[i];
    }
    transposed_times(R, z, q + 3 * a);
    for (int i = 0; i < 3; ++i)
      d[3 * a + i] = q[3 * a + i] - Real(mesh.rest[3 * std::size_t(nodes[a]) + std::size_t(i)] -
                                         mesh.rest[3 * std::size_t(nodes[0]) + std::size_t(i)]);
  }
}

/// R^T times a field at an element's nodes relative to the first.
template <int N, class Lane>
PLIANT_DEVICE void unrotate_field(const MeshView& mesh, const double* field, int element, const typename Lane::Real* R,
                                  typename Lane::Real* d, const Lane& lane) {
  using Real = typename Lane::Real;
  Real first[3];
  const int* nodes = mesh.connectivity + N * std::size_t(element);
  for (int a = 0; a < N; ++a) {
    Real z[3];
    for (int i = 0; i < 3; ++i) {
      z[i] = lane.load(field, 3 * std::size_t(nodes[a]) + std::size_t(i));
      if (a == 0) first[i] = z[i];
      z[i] -= first[i];
    }
    transposed_times(R, z, d + 3 * a);
  }
}
/// scale R y, 3 N an element.
template <int N, class Lane>
PLIANT_DEVICE void store_rotated(const typename Lane::Real* R, const typename Lane::Real* y,
                                 const typename Lane::Real& scale, int element, double* out, const Lane& lane) {
  using Real = typename Lane::Real;
  for (int a = 0; a < N; ++a) {
    Real f[3];
    times(R, y + 3 * a, f);
    for (int i = 0; i < 3; ++i)
      lane.store(out, 3 * (N * std::size_t(element) + std::size_t(a)) + std::size_t(i), scale * f[i]);
  }
}
/// What an element's stiffness is multiplied with in the step's matrix, dt s E.
template <class Lane>
PLIANT_DEVICE typename Lane::Real stiffness_factor(const MeshView& mesh, const StepNumbers& step, const double* members,
                                                   int element, const Lane& lane) {
  using Real = typename Lane::Real;
  return lane.load(members, YoungsModulus) * Real(mesh.relative_modulus[element]) *
         (Real(step.theta * step.dt) + lane.load(members, StiffnessDamping));
}

/// Elastic forces at the step's start, -E R K (R^T x - X), and the product of the elements' part of the step's matrix
/// with a vector, 3 N an element each [N], [N s].
template <int N>
struct ElementForces {
  MeshView mesh;
  StepNumbers step;
  MemberStiffness<N> stiffness;
  const double *members, *x, *way, *rotation;
  double *force, *product;

  template <class Lane>
  PLIANT_DEVICE void operator()(int element, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real R[9], q[3 * N], d[6 * N], y[6 * N];
    load_rotation<N>(rotation, element, R, lane);
    unrotate<N>(mesh, x, nullptr, Real(0.0), element, R, q, d, lane);
    unrotate_field<N>(mesh, way, element, R, d + 3 * N, lane);
    stiffness.template times<2>(mesh, members, element, d, y, lane);
    const Real scale = lane.load(members, YoungsModulus) * Real(-mesh.relative_modulus[element]);
    store_rotated<N>(R, y, scale, element, force, lane);
    store_rotated<N>(R, y + 3 * N, stiffness_factor(mesh, step, members, element, lane), element, product, lane);
  }
};

/// The product alone.
template <int N>
struct ElementProducts {
  MeshView mesh;
  StepNumbers step;
  MemberStiffness<N> stiffness;
  const double *members, *way, *rotation;
  double* product;

  template <class Lane>
  PLIANT_DEVICE void operator()(int element, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real R[9], d[3 * N], y[3 * N];
    load_rotation<N>(rotation, element, R, lane);
    unrotate_field<N>(mesh, way, element, R, d, lane);
    stiffness.template times<1>(mesh, members, element, d, y, lane);
    store_rotated<N>(R, y, stiffness_factor(mesh, step, members, element, lane), element, product, lane);
  }
};

/// What an element hands back in the reverse sweep (`Elasticity::add_force_adjoint`) for the cotangent dt w of its
/// force: of positions and velocities at the step's start, 3 N each, and of ln E, Poisson's ratio and the stiffness
/// damping.
template <int N>
struct ElementAdjoint {
  static constexpr int sums = 3;
  MeshView mesh;
  StepNumbers step;
  MemberStiffness<N> stiffness;
  const double *members, *x, *v, *end, *rotation, *w;
  double *x_bar, *v_bar, *sum;

  template <class Lane>
  PLIANT_DEVICE void operator()(int element, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real R[9], q[3 * N], d[6 * N], y[6 * N], F[9], inverse[6];
    Real *const c = d + 3 * N, *const k = y + 3 * N;
    load_rotation<N>(rotation, element, R, lane);
    const Real s = Real(step.theta) + lane.load(members, StiffnessDamping) * Real(1.0 / step.dt);
    unrotate<N>(mesh, x, end, s, element, R, q, d, lane);
    const int* nodes = mesh.connectivity + N * std::size_t(element);
    for (int a = 0; a < N; ++a) {
      Real own[3];
      for (int i = 0; i < 3; ++i) own[i] = Real(step.dt) * lane.load(w, 3 * std::size_t(nodes[a]) + std::size_t(i));
      transposed_times(R, own, c + 3 * a);
    }
    stiffness.template times<2>(mesh, members, element, d, y, lane);
    Real turn[3] = {Real(0.0), Real(0.0), Real(0.0)}, work = Real(0.0);
    for (int a = 0; a < N; ++a) {
      Real one[3], other[3];
      cross(q + 3 * a, k + 3 * a, one);
      cross(y + 3 * a, c + 3 * a, other);
      for (int i = 0; i < 3; ++i) turn[i] += one[i] - other[i];
      work += dot(c + 3 * a, y + 3 * a);
    }
    stiffness.change_times(mesh, members, element, d, y, lane);
    Real work_change = Real(0.0), damping = Real(0.0), rate[3];
    for (int a = 0; a < N; ++a) work_change += dot(c + 3 * a, y + 3 * a);
    RotateElements<N>::gradient(mesh, step.rotation_lag, x, v, element, F, lane);
    rate_inverse<Real, typename Lane::Mask>(R, F, inverse);
    symmetric_times(inverse, turn, rate);
    const Real E = lane.load(members, YoungsModulus) * Real(mesh.relative_modulus[element]);
    for (int a = 0; a < N; ++a) {
      const std::size_t corner = N * std::size_t(element) + std::size_t(a);
      Real own[3], lag[3], z_bar[3], lag_bar[3];
      cross(rate, mesh.gradient + 3 * corner, own);
      times(R, own, lag);
      times(R, k + 3 * a, z_bar);
      for (int i = 0; i < 3; ++i) {
        const std::size_t n = 3 * std::size_t(nodes[a]) + std::size_t(i), m = 3 * corner + std::size_t(i);
        z_bar[i] = -(E * z_bar[i]), lag_bar[i] = E * lag[i];
        damping += z_bar[i] * (lane.load(end, n) - lane.load(x, n));
        lane.store(x_bar, m, z_bar[i] + lag_bar[i]);
        lane.store(v_bar, m, Real(step.rotation_lag) * lag_bar[i]);
      }
    }
    const std::size_t own = sums * std::size_t(element);
    lane.store(sum, own, -(E * work));
    lane.store(sum, own + 1, -(E * work_change));
    lane.store(sum, own + 2, damping * Real(1.0 / step.dt));
  }
};

}  // namespace pliant::batch_motion
