#pragma once

#include <cmath>
#include <cstddef>

// What the kernels of this module are written in: numbers of one member, or of several side by side. A kernel is a
// template over its lane: on a device each thread has one member and `DeviceLane`'s numbers are plain doubles; on the
// host `HostLane` (host_lane.hpp) has `lane_width` members in wide registers. Arrays have the member as their fastest
// index, so that a lane loads what lies beside each other in both cases.

#ifdef __CUDACC__
#define PLIANT_DEVICE __host__ __device__ __forceinline__
#else
#define PLIANT_DEVICE __attribute__((always_inline)) inline
#endif

namespace pliant::batch_motion {

/// Members side by side on the host.
inline constexpr int lane_width = 8;

// Of plain numbers what host_lane.hpp has of wide ones.
PLIANT_DEVICE double select(bool mask, double a, double b) { return mask ? a : b; }
PLIANT_DEVICE bool any(bool mask) { return mask; }
PLIANT_DEVICE bool all(bool mask) { return mask; }
PLIANT_DEVICE bool negated(bool mask) { return !mask; }
PLIANT_DEVICE bool both(bool one, bool other) { return one && other; }
PLIANT_DEVICE int lane_count(double) { return 1; }
PLIANT_DEVICE double lane_of(double value, int) { return value; }
PLIANT_DEVICE bool lane_of(bool mask, int) { return mask; }
PLIANT_DEVICE void set_lane(double& value, int, double number) { value = number; }
PLIANT_DEVICE double root(double value) { return sqrt(value); }
PLIANT_DEVICE double exponential(double value) { return exp(value); }
PLIANT_DEVICE double log_of_one_plus(double value) { return log1p(value); }
PLIANT_DEVICE float narrow(double value) { return float(value); }
PLIANT_DEVICE double widen(float value) { return double(value); }

/// One member a thread.
struct DeviceLane {
  using Real = double;
  using Single = float;
  using Mask = bool;
  std::size_t stride;  ///< members of all arrays
  std::size_t member;

  PLIANT_DEVICE double load(const double* array, std::size_t i) const { return array[i * stride + member]; }
  PLIANT_DEVICE float load(const float* array, std::size_t i) const { return array[i * stride + member]; }
  PLIANT_DEVICE void store(double* array, std::size_t i, double value) const { array[i * stride + member] = value; }
  PLIANT_DEVICE void store(float* array, std::size_t i, float value) const { array[i * stride + member] = value; }
  /// Has some numbers that are needed soon brought near.
  PLIANT_DEVICE void fetch(const double*, std::size_t, std::size_t) const {}
  /// Sets one member's number.
  PLIANT_DEVICE void put(double* array, std::size_t i, std::size_t of, double value) const {
    if (of == member) array[i * stride + member] = value;
  }
};

}  // namespace pliant::batch_motion
