#pragma once

#ifdef __AVX__
#include <immintrin.h>
#endif

#include <cstdint>

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
  typedef Number type __attribute__((vector_size(bytes), may_alias));
};

/// A number of each of `lane_width` members, in as many registers as that takes: two halves, one of them empty where
/// one register does. Every operation is one of each member alone.
template <class Number, std::size_t bytes = lane_width * sizeof(Number), bool fits = (bytes <= register_bytes)>
struct Registers {
  using Half = Registers<Number, bytes / 2>;
  static constexpr int numbers = int(bytes / sizeof(Number));
  Half low, high;

  PLIANT_DEVICE static Registers load(const Number* p) { return {Half::load(p), Half::load(p + numbers / 2)}; }
  PLIANT_DEVICE void store(Number* p) const { low.store(p), high.store(p + numbers / 2); }
  PLIANT_DEVICE static Registers all(Number value) { return {Half::all(value), Half::all(value)}; }
  PLIANT_DEVICE Number at(int i) const { return i < numbers / 2 ? low.at(i) : high.at(i - numbers / 2); }
  PLIANT_DEVICE void set(int i, Number value) {
    i < numbers / 2 ? low.set(i, value) : high.set(i - numbers / 2, value);
  }
  /// f of each register of these, of a and, where there are more, of b.
  template <class F, class A>
  PLIANT_DEVICE static Registers of(const F& f, const A& a) {
    return {Half::of(f, a.low), Half::of(f, a.high)};
  }
  template <class F, class A, class B>
  PLIANT_DEVICE static Registers of(const F& f, const A& a, const B& b) {
    return {Half::of(f, a.low, b.low), Half::of(f, a.high, b.high)};
  }
  template <class F, class A, class B, class C>
  PLIANT_DEVICE static Registers of(const F& f, const A& a, const B& b, const C& c) {
    return {Half::of(f, a.low, b.low, c.low), Half::of(f, a.high, b.high, c.high)};
  }
};
template <class Number, std::size_t bytes>
struct Registers<Number, bytes, true> {
  using Register = typename RegisterOf<Number, bytes>::type;
  static constexpr int numbers = int(bytes / sizeof(Number));
  Register own;

  PLIANT_DEVICE static Registers load(const Number* p) { return {*reinterpret_cast<const Register*>(p)}; }
  PLIANT_DEVICE void store(Number* p) const { *reinterpret_cast<Register*>(p) = own; }
  PLIANT_DEVICE static Registers all(Number value) { return {Register{} + value}; }
  PLIANT_DEVICE Number at(int i) const { return own[i]; }
  PLIANT_DEVICE void set(int i, Number value) { own[i] = value; }
  template <class F, class A>
  PLIANT_DEVICE static Registers of(const F& f, const A& a) {
    return {Register(f(a.own))};
  }
  template <class F, class A, class B>
  PLIANT_DEVICE static Registers of(const F& f, const A& a, const B& b) {
    return {Register(f(a.own, b.own))};
  }
  template <class F, class A, class B, class C>
  PLIANT_DEVICE static Registers of(const F& f, const A& a, const B& b, const C& c) {
    return {Register(f(a.own, b.own, c.own))};
  }
};

#define PLIANT_INLINE_LAMBDA __attribute__((always_inline))

template <class Number>
struct Pack {
  using Values = Registers<Number>;
  Values values;

  Pack() = default;
  PLIANT_DEVICE Pack(Number value) : values(Values::all(value)) {}
  PLIANT_DEVICE explicit Pack(const Values& own) : values(own) {}
  PLIANT_DEVICE Pack& operator+=(const Pack& b) { return *this = *this + b; }
  PLIANT_DEVICE Pack& operator-=(const Pack& b) { return *this = *this - b; }
  PLIANT_DEVICE Pack& operator*=(const Pack& b) { return *this = *this * b; }

#define PLIANT_PACK_OPERATOR(op)                                                                             \
  PLIANT_DEVICE friend Pack operator op(const Pack& a, const Pack& b) {                                      \
    return Pack(Values::of([](auto x, auto y) PLIANT_INLINE_LAMBDA { return x op y; }, a.values, b.values)); \
  }
  PLIANT_PACK_OPERATOR(+)
  PLIANT_PACK_OPERATOR(-)
  PLIANT_PACK_OPERATOR(*)
  PLIANT_PACK_OPERATOR(/)
#undef PLIANT_PACK_OPERATOR
  PLIANT_DEVICE friend Pack operator-(const Pack& a) {
    return Pack(Values::of([](auto x) PLIANT_INLINE_LAMBDA { return -x; }, a.values));
  }
};

/// A yes or no of each member: all bits set, or none.
struct PackMask {
  using Values = Registers<std::int64_t>;
  Values values;

  PackMask() = default;
  PLIANT_DEVICE PackMask(bool value) : values(Values::all(-std::int64_t(value))) {}
  PLIANT_DEVICE explicit PackMask(const Values& own) : values(own) {}
  PLIANT_DEVICE friend PackMask operator&(const PackMask& a, const PackMask& b) {
    return PackMask(Values::of([](auto x, auto y) PLIANT_INLINE_LAMBDA { return x & y; }, a.values, b.values));
  }
  PLIANT_DEVICE friend PackMask operator|(const PackMask& a, const PackMask& b) {
    return PackMask(Values::of([](auto x, auto y) PLIANT_INLINE_LAMBDA { return x | y; }, a.values, b.values));
  }
};

#define PLIANT_PACK_COMPARISON(op)                                                                             \
  PLIANT_DEVICE PackMask operator op(const Pack<double>& a, const Pack<double>& b) {                           \
    return PackMask(                                                                                           \
        PackMask::Values::of([](auto x, auto y) PLIANT_INLINE_LAMBDA { return x op y; }, a.values, b.values)); \
  }
PLIANT_PACK_COMPARISON(>)
PLIANT_PACK_COMPARISON(<)
PLIANT_PACK_COMPARISON(>=)
PLIANT_PACK_COMPARISON(<=)
#undef PLIANT_PACK_COMPARISON

PLIANT_DEVICE Pack<double> select(const PackMask& mask, const Pack<double>& a, const Pack<double>& b) {
  return Pack<double>(Registers<double>::of([](auto m, auto x, auto y) PLIANT_INLINE_LAMBDA { return m ? x : y; },
                                            mask.values, a.values, b.values));
}
PLIANT_DEVICE PackMask both(const PackMask& one, const PackMask& other) { return one & other; }
PLIANT_DEVICE PackMask negated(const PackMask& mask) {
  return PackMask(PackMask::Values::of([](auto x) PLIANT_INLINE_LAMBDA { return ~x; }, mask.values));
}
PLIANT_DEVICE int lane_count(const Pack<double>&) { return lane_width; }
PLIANT_DEVICE bool lane_of(const PackMask& mask, int lane) { return mask.values.at(lane) != 0; }
PLIANT_DEVICE double lane_of(const Pack<double>& value, int lane) { return value.values.at(lane); }
PLIANT_DEVICE void set_lane(Pack<double>& value, int lane, double number) { value.values.set(lane, number); }
PLIANT_DEVICE bool any(const PackMask& mask) {
  std::int64_t some = 0;
  for (int l = 0; l < lane_width; ++l) some |= mask.values.at(l);
  return some != 0;
}
PLIANT_DEVICE bool all(const PackMask& mask) { return !any(negated(mask)); }

#if defined(__AVX512F__)
PLIANT_DEVICE RegisterOf<double, 64>::type root_of(RegisterOf<double, 64>::type x) { return _mm512_sqrt_pd(x); }
#endif
#if defined(__AVX__)
PLIANT_DEVICE RegisterOf<double, 32>::type root_of(RegisterOf<double, 32>::type x) { return _mm256_sqrt_pd(x); }
#endif
PLIANT_DEVICE RegisterOf<double, 16>::type root_of(RegisterOf<double, 16>::type x) {
  return RegisterOf<double, 16>::type{std::sqrt(x[0]), std::sqrt(x[1])};
}
PLIANT_DEVICE Pack<double> root(const Pack<double>& value) {
  return Pack<double>(Registers<double>::of([](auto x) PLIANT_INLINE_LAMBDA { return root_of(x); }, value.values));
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
  Pack<float> c;
#if defined(__AVX512F__)
  c.values.own = __builtin_convertvector(value.values.own, RegisterOf<float, 32>::type);
#elif defined(__AVX__)
  typedef RegisterOf<float, 16>::type Four;
  c.values.own = __builtin_shufflevector(__builtin_convertvector(value.values.low.own, Four),
                                         __builtin_convertvector(value.values.high.own, Four), 0, 1, 2, 3, 4, 5, 6, 7);
#else
  for (int l = 0; l < lane_width; ++l) c.values.set(l, float(value.values.at(l)));
#endif
  return c;
}
PLIANT_DEVICE Pack<double> widen(const Pack<float>& value) {
  Pack<double> c;
#if defined(__AVX512F__)
  c.values.own = __builtin_convertvector(value.values.own, RegisterOf<double, 64>::type);
#elif defined(__AVX__)
  typedef RegisterOf<double, 32>::type Four;
  c.values.low.own =
      __builtin_convertvector(__builtin_shufflevector(value.values.own, value.values.own, 0, 1, 2, 3), Four);
  c.values.high.own =
      __builtin_convertvector(__builtin_shufflevector(value.values.own, value.values.own, 4, 5, 6, 7), Four);
#else
  for (int l = 0; l < lane_width; ++l) c.values.set(l, value.values.at(l));
#endif
  return c;
}

/// `lane_width` members a call.
struct HostLane {
  using Real = Pack<double>;
  using Single = Pack<float>;
  using Mask = PackMask;

  template <class Number>
  PLIANT_DEVICE Pack<Number> load(const Number* array, std::size_t i) const {
    return Pack<Number>(Pack<Number>::Values::load(array + lane_width * i));
  }
  template <class Number>
  PLIANT_DEVICE void store(Number* array, std::size_t i, const Pack<Number>& value) const {
    value.values.store(array + lane_width * i);
  }
  PLIANT_DEVICE void fetch(const double* array, std::size_t i, std::size_t count) const {
    for (std::size_t k = 0; k < count; ++k) __builtin_prefetch(array + lane_width * (i + k));
  }
  PLIANT_DEVICE void put(double* array, std::size_t i, std::size_t of, double value) const {
    array[lane_width * i + of] = value;
  }
};

}  // namespace pliant::batch_motion
