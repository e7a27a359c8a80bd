#pragma once

#ifdef __AVX__
#include <immintrin.h>
#endif

#include <cstdint>
#include <cstring>

#include "batch_motion/lane.hpp"

namespace pliant::batch_motion {

/// Bytes of the processor's widest registers.
#if defined(__AVX512F__)
inline constexpr std::size_t register_bytes = 64;
#elif defined(__AVX__)
inline constexpr std::size_t register_bytes = 32;
#else
inline constexpr std::size_t register_bytes = 16;
#endif

template <class Number, std::size_t bytes>
struct RegisterOf {
  typedef Number type __attribute__((vector_size(bytes)));
};

/// A number of each of `lane_width` members, in as many registers as that takes. Every operation is one of each member
/// alone.
template <class Number>
struct Pack {
  static constexpr std::size_t all_bytes = lane_width * sizeof(Number);
  static constexpr std::size_t bytes = all_bytes < register_bytes ? all_bytes : register_bytes;
  static constexpr std::size_t parts = all_bytes / bytes, of_part = bytes / sizeof(Number);
  using Register = typename RegisterOf<Number, bytes>::type;
  Register part[parts];

  Pack() = default;
  PLIANT_DEVICE Pack(Number value) {
    for (Register& p : part) p = Register{} + value;
  }
  PLIANT_DEVICE Pack& operator+=(const Pack& b) { return *this = *this + b; }
  PLIANT_DEVICE Pack& operator-=(const Pack& b) { return *this = *this - b; }
  PLIANT_DEVICE Pack& operator*=(const Pack& b) { return *this = *this * b; }

#define PLIANT_PACK_OPERATOR(op)                                                           \
  PLIANT_DEVICE friend Pack operator op(const Pack& a, const Pack& b) {                    \
    Pack c;                                                                                \
    for (std::size_t i = 0; i < parts; ++i) c.part[i] = a.part[i] op b.part[i];            \
    return c;                                                                              \
  }
  PLIANT_PACK_OPERATOR(+)
  PLIANT_PACK_OPERATOR(-)
  PLIANT_PACK_OPERATOR(*)
  PLIANT_PACK_OPERATOR(/)
#undef PLIANT_PACK_OPERATOR
  PLIANT_DEVICE friend Pack operator-(const Pack& a) {
    Pack c;
    for (std::size_t i = 0; i < parts; ++i) c.part[i] = -a.part[i];
    return c;
  }
};

/// A yes or no of each member: all bits set, or none.
struct PackMask {
  using Bits = Pack<std::int64_t>;
  static constexpr std::size_t parts = Bits::parts;
  Bits::Register part[parts];

  PackMask() = default;
  PLIANT_DEVICE PackMask(bool value) {
    for (auto& p : part) p = Bits::Register{} - std::int64_t(value);
  }
  PLIANT_DEVICE friend PackMask operator&(const PackMask& a, const PackMask& b) {
    PackMask c;
    for (std::size_t i = 0; i < parts; ++i) c.part[i] = a.part[i] & b.part[i];
    return c;
  }
  PLIANT_DEVICE friend PackMask operator|(const PackMask& a, const PackMask& b) {
    PackMask c;
    for (std::size_t i = 0; i < parts; ++i) c.part[i] = a.part[i] | b.part[i];
    return c;
  }
};

#define PLIANT_PACK_COMPARISON(op)                                                         \
  PLIANT_DEVICE PackMask operator op(const Pack<double>& a, const Pack<double>& b) {       \
    PackMask c;                                                                            \
    for (std::size_t i = 0; i < PackMask::parts; ++i) c.part[i] = a.part[i] op b.part[i];  \
    return c;                                                                              \
  }
PLIANT_PACK_COMPARISON(>)
PLIANT_PACK_COMPARISON(<)
PLIANT_PACK_COMPARISON(>=)
PLIANT_PACK_COMPARISON(<=)
#undef PLIANT_PACK_COMPARISON

PLIANT_DEVICE Pack<double> select(const PackMask& mask, const Pack<double>& a, const Pack<double>& b) {
  Pack<double> c;
  for (std::size_t i = 0; i < PackMask::parts; ++i) c.part[i] = mask.part[i] ? a.part[i] : b.part[i];
  return c;
}
PLIANT_DEVICE PackMask negated(const PackMask& mask) {
  PackMask c;
  for (std::size_t i = 0; i < PackMask::parts; ++i) c.part[i] = ~mask.part[i];
  return c;
}
PLIANT_DEVICE int lane_count(const Pack<double>&) { return lane_width; }
PLIANT_DEVICE bool lane_of(const PackMask& mask, int lane) {
  return mask.part[std::size_t(lane) / PackMask::Bits::of_part][std::size_t(lane) % PackMask::Bits::of_part] != 0;
}
PLIANT_DEVICE double lane_of(const Pack<double>& value, int lane) {
  return value.part[std::size_t(lane) / Pack<double>::of_part][std::size_t(lane) % Pack<double>::of_part];
}
PLIANT_DEVICE void set_lane(Pack<double>& value, int lane, double number) {
  value.part[std::size_t(lane) / Pack<double>::of_part][std::size_t(lane) % Pack<double>::of_part] = number;
}
PLIANT_DEVICE bool any(const PackMask& mask) {
  PackMask::Bits::Register bits = mask.part[0];
  for (std::size_t i = 1; i < PackMask::parts; ++i) bits |= mask.part[i];
  std::int64_t some = 0;
  for (std::size_t l = 0; l < PackMask::Bits::of_part; ++l) some |= bits[l];
  return some != 0;
}
PLIANT_DEVICE bool all(const PackMask& mask) { return !any(negated(mask)); }

PLIANT_DEVICE Pack<double> root(const Pack<double>& value) {
  Pack<double> c;
  for (std::size_t i = 0; i < Pack<double>::parts; ++i) {
#if defined(__AVX512F__)
    c.part[i] = Pack<double>::Register(_mm512_sqrt_pd(__m512d(value.part[i])));
#elif defined(__AVX__)
    c.part[i] = Pack<double>::Register(_mm256_sqrt_pd(__m256d(value.part[i])));
#else
    for (std::size_t l = 0; l < Pack<double>::of_part; ++l) c.part[i][l] = std::sqrt(value.part[i][l]);
#endif
  }
  return c;
}
// One after the other: the members' numbers then do not depend on who stands beside them.
PLIANT_DEVICE Pack<double> exponential(const Pack<double>& value) {
  Pack<double> c;
  for (int l = 0; l < lane_width; ++l) set_lane(c, l, std::exp(lane_of(value, l)));
  return c;
}
PLIANT_DEVICE Pack<double> log_of_one_plus(const Pack<double>& value) {
  Pack<double> c;
  for (int l = 0; l < lane_width; ++l) set_lane(c, l, std::log1p(lane_of(value, l)));
  return c;
}

PLIANT_DEVICE Pack<float> narrow(const Pack<double>& value) {
  typedef typename RegisterOf<float, Pack<double>::of_part * sizeof(float)>::type Half;
  Half halves[Pack<double>::parts];
  for (std::size_t i = 0; i < Pack<double>::parts; ++i) halves[i] = __builtin_convertvector(value.part[i], Half);
  Pack<float> c;
  std::memcpy(&c, halves, sizeof c);
  return c;
}
PLIANT_DEVICE Pack<double> widen(const Pack<float>& value) {
  typedef typename RegisterOf<float, Pack<double>::of_part * sizeof(float)>::type Half;
  Half halves[Pack<double>::parts];
  std::memcpy(halves, &value, sizeof value);
  Pack<double> c;
  for (std::size_t i = 0; i < Pack<double>::parts; ++i)
    c.part[i] = __builtin_convertvector(halves[i], Pack<double>::Register);
  return c;
}

/// `lane_width` members a call.
struct HostLane {
  using Real = Pack<double>;
  using Single = Pack<float>;
  using Mask = PackMask;

  template <class Number>
  PLIANT_DEVICE Pack<Number> load(const Number* array, std::size_t i) const {
    Pack<Number> value;
    std::memcpy(&value, array + lane_width * i, sizeof value);
    return value;
  }
  template <class Number>
  PLIANT_DEVICE void store(Number* array, std::size_t i, const Pack<Number>& value) const {
    std::memcpy(array + lane_width * i, &value, sizeof value);
  }
  PLIANT_DEVICE void put(double* array, std::size_t i, std::size_t of, double value) const {
    array[lane_width * i + of] = value;
  }
};

}  // namespace pliant::batch_motion
