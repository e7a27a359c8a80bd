#include "estimation/bounded_step.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/dense.hpp"

namespace pliant {

BoundedStep step_within_bounds(const ParameterSet& parameters, const VectorX& p, const VectorX& g, const MatrixX& H) {
  std::vector<Eigen::Index> free(std::size_t(p.size()));
  std::iota(free.begin(), free.end(), 0);
  BoundedStep bounded{VectorX::Zero(p.size()), {}};
  VectorX& step = bounded.step;
  std::vector<Eigen::Index>& held = bounded.held;
  const VectorX scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();  // pulls and dampings differ by 1e10
  const MatrixX scaled = scale.asDiagonal() * H * scale.asDiagonal();
  while (!free.empty()) {
    const VectorX pull = g(free) + H(free, held) * step(held);
    step(free) = -scale(free).cwiseProduct(
        solve_symmetric(MatrixX(scaled(free, free)), VectorX(scale(free).cwiseProduct(pull))));
    const VectorX moved = parameters.clamp(p + step) - p;
    const auto is_cut = [&](Eigen::Index i) { return std::abs(moved[i]) < (1.0 - 1e-9) * std::abs(step[i]); };
    const auto pushes_itself = [&](Eigen::Index i) { return is_cut(i) && g[i] * step[i] < 0.0; };
    const bool any_itself = std::ranges::any_of(free, pushes_itself);
    const auto kept = std::stable_partition(free.begin(), free.end(),
                                            [&](Eigen::Index i) { return any_itself ? pushes_itself(i) : is_cut(i); });
    if (kept == free.begin()) return bounded;
    for (auto i = free.begin(); i != kept; ++i) step[*i] = moved[*i];
    held.insert(held.end(), free.begin(), kept);
    free.erase(free.begin(), kept);
  }
  return bounded;
}

}  // namespace pliant
