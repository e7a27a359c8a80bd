#pragma once

#include "estimation/press_trial.hpp"

namespace pliant {

/// Calls visit(nodes, handle, share, derivative) for the derivatives of the elements' dW/dx by theta, at the last
/// `evaluate` of the elasticity: share times `derivative` [N], 3 numbers a node, is what the parameter at `handle`
/// changes of the forces on `nodes`.
template <class Visit>
void for_law_derivatives(const LawElasticity& elasticity, const PressedMaterial& material, const VectorX& theta,
                         const Visit& visit) {
  const LawLayout& layout = material.layout();
  elasticity.for_parameter_derivatives([&](int e, std::span<const int> nodes, const Eigen::Ref<const MatrixX>& by_q) {
    const VectorX own = element_numbers(material.body(), layout, theta, e);
    const MatrixX by = by_q * law_parameter_derivatives(layout.form(), own);
    for (const auto& [number, at, share] : number_shares(material.body(), layout, theta, own, e))
      visit(nodes, at, share, by.col(number));
  });
}

/// Numbers of a law among those of a parameter vector, each with its place in the law's order.
struct LawNumbers {
  /// @param size  of the parameter vector
  LawNumbers(const LawLayout& layout, Eigen::Index size) : place(std::size_t(size), -1) {
    for (const ParameterHandle& number : layout.all()) {
      place[std::size_t(number.first)] = int(rows.size());
      rows.push_back(number.first);
    }
  }
  std::size_t count() const { return rows.size(); }
  std::size_t operator[](const ParameterHandle& number) const { return std::size_t(place[std::size_t(number.first)]); }

  std::vector<int> place;          ///< of each number of the parameter vector; -1: none of the law's
  std::vector<Eigen::Index> rows;  ///< in the parameter vector, of each number of the law
};

}  // namespace pliant
