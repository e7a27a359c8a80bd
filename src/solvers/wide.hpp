#pragma once

#include <cstring>

namespace pliant {

/// Four doubles or floats in one register, loaded from unaligned memory. A 3-vector uses the first three lanes; what
/// the fourth holds is never read.
template <class Real>
struct WideOf;
template <>
struct WideOf<double> {
  typedef double type __attribute__((vector_size(32)));
};
template <>
struct WideOf<float> {
  typedef float type __attribute__((vector_size(16)));
};
template <class Real>
using Wide = typename WideOf<Real>::type;

template <class Real>
inline Wide<Real> load_wide(const Real* p) {
  Wide<Real> w;
  std::memcpy(&w, p, sizeof w);
  return w;
}
template <class Real>
inline void store_wide(Real* p, Wide<Real> w) {
  std::memcpy(p, &w, sizeof w);
}

/// block (3 x 3, column by column) times (x0, x1, x2).
template <class Real>
inline Wide<Real> block_times(const Real* block, Real x0, Real x1, Real x2) {
  return load_wide(block) * x0 + load_wide(block + 3) * x1 + load_wide(block + 6) * x2;
}

}  // namespace pliant
