#pragma once

#include "batch_motion/mesh_view.hpp"
#include "batch_motion/small_matrix.hpp"

namespace pliant::batch_motion {

/// A sample of the surface and the plane about the predicted point y (`RigidContact`): at z its force is
/// (force + slope n . (z - y)) n - drag T (z - start), T = I - m m^T, m = n / |n|.
template <class Real>
struct Touch {
  Real n[3], axis[3];            // the plane's normal; of unit length
  Real from_plane[3];            // y less the plane's point [m]
  Real q[3];                     // start - y [m]
  Real force, slope, curvature;  // [N], [N/m], [N/m^2]; zero beyond the penalty's reach
  Real way[3], length, drag;     // T (y - start), sqrt(|way|^2 + s^2) [m]; mu force / length [N/m]
  Real axis_way, per_normal;     // m . (y - start), 1 / |n|
  bool is_felt;                  // by any member of the lane
};

/// Pressure [Pa] and its derivatives by the gap d [m] (`Penalty::pressure_at`), for a unit stiffness.
template <class Lane>
PLIANT_DEVICE void unit_pressure(const StepNumbers& step, const typename Lane::Real& d, typename Lane::Real& pressure,
                                 typename Lane::Real& slope, typename Lane::Real& curvature) {
  using Real = typename Lane::Real;
  const Real zero = Real(0.0), one = Real(1.0), s = Real(step.smoothing);
  if (step.is_quadratic) {
    const Real depth = s - d, per = Real(0.5 / step.smoothing);
    const auto is_deep = d < -s, is_near = d < s;
    pressure = select(is_deep, -d, select(is_near, Real(0.5) * per * depth * depth, zero));
    slope = select(is_deep, -one, select(is_near, -(depth * per), zero));
    curvature = select(is_deep, zero, select(is_near, per, zero));
    return;
  }
  const Real t = -d / s;
  const auto is_inside = t > zero;
  const Real decay = exponential(select(is_inside, -t, t));  // exp(-|t|)
  const Real sigmoid = select(is_inside, one, decay) / (one + decay);
  pressure = s * (select(is_inside, t, zero) + log_of_one_plus(decay));
  slope = -sigmoid;
  curvature = sigmoid * (one - sigmoid) / s;
}

template <int N, class Lane>
PLIANT_DEVICE Touch<typename Lane::Real> touch(const MeshView& mesh, const StepNumbers& step, const double* members,
                                               const double* x, const double* v, int sample, const Lane& lane) {
  using Real = typename Lane::Real;
  Touch<Real> c;
  Real start[3], y[3], gap = Real(0.0), squares = Real(0.0);
  for (int i = 0; i < 3; ++i) start[i] = y[i] = Real(0.0);
  for (int a = 0; a < N; ++a) {
    const std::size_t corner = N * std::size_t(sample) + std::size_t(a);
    const double weight = mesh.sample_weight[corner];
    for (int i = 0; i < 3; ++i) {
      const std::size_t k = 3 * std::size_t(mesh.sample_node[corner]) + std::size_t(i);
      const Real own = lane.load(x, k);
      start[i] += own * Real(weight);
      y[i] += (own + Real(step.contact_lag) * lane.load(v, k)) * Real(weight);
    }
  }
  for (int i = 0; i < 3; ++i) {
    c.n[i] = lane.load(members, std::size_t(PlaneNormal) + std::size_t(i));
    c.from_plane[i] = y[i] - lane.load(members, std::size_t(PlanePoint) + std::size_t(i));
    c.q[i] = start[i] - y[i];
    gap += c.n[i] * c.from_plane[i];
    squares += c.n[i] * c.n[i];
  }
  c.force = c.slope = c.curvature = c.drag = Real(0.0);
  const auto is_near = gap <= Real(step.reach);
  c.is_felt = any(is_near);
  if (!c.is_felt) return c;
  unit_pressure<Lane>(step, gap, c.force, c.slope, c.curvature);
  const Real scale = select(is_near, lane.load(members, ContactStiffness), Real(0.0)) * Real(mesh.sample_area[sample]);
  c.force *= scale, c.slope *= scale, c.curvature *= scale;
  if (!(step.friction_way > 0.0)) return c;
  c.per_normal = Real(1.0) / root(squares);
  for (int i = 0; i < 3; ++i) c.axis[i] = c.per_normal * c.n[i];
  c.axis_way = -dot(c.axis, c.q);
  for (int i = 0; i < 3; ++i) c.way[i] = -c.q[i] - c.axis_way * c.axis[i];
  c.length = root(dot(c.way, c.way) + Real(step.friction_way * step.friction_way));
  c.drag = lane.load(members, Friction) * c.force / c.length;
  return c;
}

/// Forces at the step's start, 3 a sample [N], and what of the step's matrix is the samples': slope and drag.
template <int N>
struct SampleForces {
  MeshView mesh;
  StepNumbers step;
  const double *members, *x, *v;
  double *force, *matrix;

  template <class Lane>
  PLIANT_DEVICE void operator()(int sample, const Lane& lane) const {
    using Real = typename Lane::Real;
    const Touch<Real> c = touch<N>(mesh, step, members, x, v, sample, lane);
    const std::size_t s = std::size_t(sample);
    const Real along = c.is_felt ? c.force + c.slope * dot(c.n, c.q) : Real(0.0);
    for (std::size_t i = 0; i < 3; ++i) lane.store(force, 3 * s + i, along * c.n[i]);
    lane.store(matrix, 2 * s, -c.slope);
    lane.store(matrix, 2 * s + 1, c.drag);
  }
};

/// The product of the samples' part of the step's matrix with a vector, 3 a sample [N s].
template <int N>
struct SampleProducts {
  MeshView mesh;
  StepNumbers step;
  const double *members, *matrix, *way;
  double* product;

  template <class Lane>
  PLIANT_DEVICE void operator()(int sample, const Lane& lane) const {
    using Real = typename Lane::Real;
    const std::size_t s = std::size_t(sample);
    const Real slope = lane.load(matrix, 2 * s), zero = Real(0.0);
    Real out[3] = {zero, zero, zero};
    if (any(slope > zero)) {
      Real u[3] = {zero, zero, zero}, n[3], squares = zero;
      for (int a = 0; a < N; ++a) {
        const std::size_t corner = N * s + std::size_t(a);
        for (int i = 0; i < 3; ++i)
          u[i] += lane.load(way, 3 * std::size_t(mesh.sample_node[corner]) + std::size_t(i)) *
                  Real(mesh.sample_weight[corner]);
      }
      for (int i = 0; i < 3; ++i)
        n[i] = lane.load(members, std::size_t(PlaneNormal) + std::size_t(i)), squares += n[i] * n[i];
      const Real scale = Real(step.dt * step.contact_weight), drag = scale * lane.load(matrix, 2 * s + 1);
      const Real along = (scale * slope - drag / squares) * dot(n, u);
      for (int i = 0; i < 3; ++i) out[i] = along * n[i] + drag * u[i];
    }
    for (std::size_t i = 0; i < 3; ++i) lane.store(product, 3 * s + i, out[i]);
  }
};

/// The reverse sweep (`RigidContact::add_force_adjoint` and `add_start_adjoint`) for the cotangent dt w of the force:
/// of positions and velocities at the step's start, 3 a sample each, and of the plane's point and normal, the friction
/// and the logarithm of the stiffness.
template <int N>
struct SampleAdjoint {
  static constexpr int sums = 8;
  MeshView mesh;
  StepNumbers step;
  const double *members, *x, *v, *end, *w;
  double *x_bar, *v_bar, *sum;

  template <class Lane>
  PLIANT_DEVICE void operator()(int sample, const Lane& lane) const {
    using Real = typename Lane::Real;
    const Touch<Real> c = touch<N>(mesh, step, members, x, v, sample, lane);
    const std::size_t s = std::size_t(sample);
    Real start_bar[3], y_bar[3], values[sums];
    for (int i = 0; i < 3; ++i) start_bar[i] = y_bar[i] = Real(0.0);
    for (Real& value : values) value = Real(0.0);
    if (c.is_felt) reverse(c, sample, start_bar, y_bar, values, lane);
    for (std::size_t i = 0; i < 3; ++i) {
      lane.store(x_bar, 3 * s + i, start_bar[i] + y_bar[i]);
      lane.store(v_bar, 3 * s + i, Real(step.contact_lag) * y_bar[i]);
    }
    for (std::size_t k = 0; k < sums; ++k) lane.store(sum, sums * s + k, values[k]);
  }

  /// @param start_bar  of what enters as the start and as z = start + weight (end - start)
  template <class Lane>
  PLIANT_DEVICE void reverse(const Touch<typename Lane::Real>& c, int sample, typename Lane::Real* start_bar,
                             typename Lane::Real* y_bar, typename Lane::Real* values, const Lane& lane) const {
    using Real = typename Lane::Real;
    Real b[3], way[3];  // dt w there, and end - start
    for (int i = 0; i < 3; ++i) b[i] = way[i] = Real(0.0);
    for (int a = 0; a < N; ++a) {
      const std::size_t corner = N * std::size_t(sample) + std::size_t(a);
      const double weight = mesh.sample_weight[corner];
      for (int i = 0; i < 3; ++i) {
        const std::size_t k = 3 * std::size_t(mesh.sample_node[corner]) + std::size_t(i);
        b[i] += lane.load(w, k) * Real(weight * step.dt);
        way[i] += (lane.load(end, k) - lane.load(x, k)) * Real(weight);
      }
    }
    Real q[3], moved[3];  // z - y, z - start
    for (int i = 0; i < 3; ++i) moved[i] = Real(step.contact_weight) * way[i], q[i] = c.q[i] + moved[i];
    const Real ahead = dot(c.n, q), along = dot(c.n, b), F = c.force + c.slope * ahead;
    Real gap_bar = (c.curvature * ahead + c.slope) * along, end_bar[3], normal_bar[3];
    for (int i = 0; i < 3; ++i) {
      end_bar[i] = c.slope * along * c.n[i];
      y_bar[i] = -end_bar[i];
      normal_bar[i] = F * b[i] + c.slope * along * q[i];
    }
    values[7] = F * along;
    if (step.friction_way > 0.0) {
      const Real across_b = dot(c.axis, b), normal_way = dot(c.axis, moved);
      Real slid[3], w_z[3], axis_bar[3];
      for (int i = 0; i < 3; ++i)
        slid[i] = moved[i] - normal_way * c.axis[i], w_z[i] = slid[i] + normal_way * c.axis[i];
      const Real drag_bar = -dot(slid, b), length_bar = -(drag_bar * c.drag / c.length);
      values[6] = drag_bar * c.force / c.length;
      values[7] += c.drag * drag_bar;
      gap_bar += drag_bar * lane.load(members, Friction) * c.slope / c.length;
      const Real by_start = drag_bar * c.drag / (c.length * c.length);
      for (int i = 0; i < 3; ++i) {
        const Real across = b[i] - across_b * c.axis[i];
        end_bar[i] -= c.drag * across;
        start_bar[i] += c.drag * across + by_start * c.way[i];
        y_bar[i] += length_bar / c.length * c.way[i];
        axis_bar[i] = c.drag * (normal_way * b[i] + across_b * w_z[i]) - length_bar * c.axis_way / c.length * c.way[i];
      }
      const Real inner = dot(c.axis, axis_bar);
      for (int i = 0; i < 3; ++i) normal_bar[i] += c.per_normal * (axis_bar[i] - inner * c.axis[i]);
    }
    for (int i = 0; i < 3; ++i) {
      const Real from_plane_bar = gap_bar * c.n[i];
      y_bar[i] += from_plane_bar;
      start_bar[i] += end_bar[i];
      values[i] = -from_plane_bar;
      values[3 + i] = normal_bar[i] + gap_bar * c.from_plane[i];
    }
  }
};

}  // namespace pliant::batch_motion
