#pragma once

#include "batch_motion/contact_kernels.hpp"
#include "batch_motion/solver_kernels.hpp"

namespace pliant::batch_motion {

/// start -> end (`Stepper::advance`). Members that have failed stay where they are.
struct Advance {
  StepNumbers step;
  const double *numbers, *way;
  double *x, *v;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Real = typename Lane::Real;
    const auto is_alive = lane.load(numbers, IsAlive) > Real(0.0);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = 3 * std::size_t(node) + i;
      const Real own = lane.load(x, k), speed = lane.load(v, k), d = lane.load(way, k);
      lane.store(x, k, select(is_alive, own + d, own));
      lane.store(v, k,
                 select(is_alive,
                        d * Real(1.0 / (step.theta * step.dt)) - speed * Real((1.0 - step.theta) / step.theta), speed));
    }
  }
};
struct CountSteps {
  double* numbers;

  template <class Lane>
  PLIANT_DEVICE void operator()(int, const Lane& lane) const {
    lane.store(numbers, Steps, lane.load(numbers, Steps) + lane.load(numbers, IsAlive));
  }
};

/// Right-hand side of the reverse sweep's equation, x_bar + v_bar / (theta dt), and where its solution is looked for
/// first: on the line through those of the last two steps.
struct AdjointRight {
  MeshView mesh;
  StepNumbers step;
  double onward;  ///< 1, or 0 where there was one step or none
  const double *x_bar, *v_bar;
  double *w, *before;  ///< in: of the last two steps; out: the guess, and the last one
  double* right;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Real = typename Lane::Real;
    const Real free = Real(mesh.held[node] ? 0.0 : 1.0), per = Real(1.0 / (step.theta * step.dt));
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = 3 * std::size_t(node) + i;
      lane.store(right, k, (lane.load(x_bar, k) + lane.load(v_bar, k) * per) * free);
      const Real last = lane.load(w, k), guess = last + (last - lane.load(before, k)) * Real(onward);
      lane.store(before, k, last);
      lane.store(w, k, guess * free);
    }
  }
};

/// Cotangents of a step's start, out of those of its end, and a node's part of the sums.
struct AdjointNodes {
  static constexpr int sums = 5;  // (M w) . way, (M w) . v, V w
  MeshView mesh;
  StepNumbers step;
  const double *members, *x, *v, *end, *w;
  const double *element_x_bar, *element_v_bar, *sample_x_bar, *sample_v_bar, *touched;
  double *x_bar, *v_bar, *sum;

  template <class Lane>
  PLIANT_DEVICE void operator()(int node, const Lane& lane) const {
    using Real = typename Lane::Real;
    const std::size_t n = 3 * std::size_t(node);
    Real inertia[3], values[sums], bar[3], speed_bar[3];
    for (Real& value : values) value = Real(0.0);
    mass_times(mesh, w, node, inertia, lane);
    const Real scale = lane.load(members, Density) * Real(1.0 / step.theta);
    for (std::size_t i = 0; i < 3; ++i) {
      values[0] += inertia[i] * (lane.load(end, n + i) - lane.load(x, n + i));
      values[1] += inertia[i] * lane.load(v, n + i);
      values[2 + i] = lane.load(w, n + i) * Real(mesh.nodal_volume[node]);
      bar[i] = lane.load(x_bar, n + i);
      speed_bar[i] = scale * inertia[i] - lane.load(v_bar, n + i) * Real((1.0 - step.theta) / step.theta);
    }
    add_corners(mesh, element_x_bar, 1.0, node, bar, lane);
    add_corners(mesh, element_v_bar, 1.0, node, speed_bar, lane);
    add_touches(mesh, touched, sample_x_bar, 1.0, node, bar, lane);
    add_touches(mesh, touched, sample_v_bar, 1.0, node, speed_bar, lane);
    for (std::size_t i = 0; i < 3; ++i) {
      lane.store(x_bar, n + i, bar[i]);
      lane.store(v_bar, n + i, speed_bar[i]);
    }
    for (std::size_t k = 0; k < sums; ++k) lane.store(sum, sums * std::size_t(node) + k, values[k]);
  }
};

/// Sums of so many columns over some items, one after the other.
struct SumItems {
  static constexpr int of_chunk = 64;
  int items, columns;
  const double* values;
  double* partial;

  int chunks() const { return (items + of_chunk - 1) / of_chunk; }
  template <class Lane>
  PLIANT_DEVICE void operator()(int index, const Lane& lane) const {
    using Real = typename Lane::Real;
    const int chunk = index / columns, column = index % columns, first = chunk * of_chunk;
    const int last = first + of_chunk < items ? first + of_chunk : items;
    Real sum = Real(0.0);
    for (int i = first; i < last; ++i)
      sum += lane.load(values, std::size_t(columns) * std::size_t(i) + std::size_t(column));
    lane.store(partial, std::size_t(index), sum);
  }
};

/// What a step adds to the gradient.
struct AddGradient {
  StepNumbers step;
  const double* members;
  int element_chunks, sample_chunks, node_chunks;
  const double *element_partial, *sample_partial, *node_partial;
  double* gradient;

  template <class Lane>
  PLIANT_DEVICE void operator()(int, const Lane& lane) const {
    using Real = typename Lane::Real;
    const auto sum = [&](const double* partial, int chunks, int columns, int column) {
      Real total = Real(0.0);
      for (int c = 0; c < chunks; ++c)
        total += lane.load(partial, std::size_t(columns) * std::size_t(c) + std::size_t(column));
      return total;
    };
    const auto add = [&](int number, const Real& value) {
      lane.store(gradient, std::size_t(number), lane.load(gradient, std::size_t(number)) + value);
    };
    add(ByLogModulus, sum(element_partial, element_chunks, 3, 0));
    add(ByPoissonsRatio, sum(element_partial, element_chunks, 3, 1));
    add(ByStiffnessDamping, sum(element_partial, element_chunks, 3, 2));
    for (int k = 0; k < 8; ++k) add(ByPlanePoint + k, sum(sample_partial, sample_chunks, 8, k));
    const Real by_way = sum(node_partial, node_chunks, 5, 0), density = lane.load(members, Density);
    add(ByMassDamping, -(density * by_way));
    Real by_density = sum(node_partial, node_chunks, 5, 1) * Real(1.0 / step.theta) -
                      (Real(1.0 / (step.theta * step.dt)) + lane.load(members, MassDamping)) * by_way;
    for (int i = 0; i < 3; ++i) {
      const Real volume = sum(node_partial, node_chunks, 5, 2 + i) * Real(step.dt);
      by_density += volume * lane.load(members, std::size_t(Gravity) + std::size_t(i));
      add(ByGravity + i, density * volume);
    }
    add(ByDensity, by_density);
  }
};

/// out += in, or out = in.
struct Copy {
  const double* in;
  double* out;
  template <class Lane>
  PLIANT_DEVICE void operator()(int i, const Lane& lane) const {
    lane.store(out, std::size_t(i), lane.load(in, std::size_t(i)));
  }
};
struct Add {
  const double* in;
  double* out;
  template <class Lane>
  PLIANT_DEVICE void operator()(int i, const Lane& lane) const {
    lane.store(out, std::size_t(i), lane.load(out, std::size_t(i)) + lane.load(in, std::size_t(i)));
  }
};
struct Zero {
  double* out;
  template <class Lane>
  PLIANT_DEVICE void operator()(int i, const Lane& lane) const {
    lane.store(out, std::size_t(i), typename Lane::Real(0.0));
  }
};
/// One member's numbers.
struct PutMember {
  const double* in;
  std::size_t member;
  double* out;
  template <class Lane>
  PLIANT_DEVICE void operator()(int i, const Lane& lane) const {
    lane.put(out, std::size_t(i), member, in[i]);
  }
};

}  // namespace pliant::batch_motion
