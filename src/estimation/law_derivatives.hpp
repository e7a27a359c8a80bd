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

}  // namespace pliant
