#include "estimation/law_derivatives.hpp"

namespace pliant {

namespace {

/// Calls visit(nodes, handle, share, derivative) for the derivatives of the elements' dW/dx by theta: share times
/// `derivative` [N], 3 numbers a node, is what the parameter at `handle` changes of it at `nodes`.
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

}  // namespace

std::vector<Points> force_changes(const LawElasticity& elasticity, const PressedMaterial& material,
                                  const VectorX& theta, const LawNumbers& numbers, Eigen::Index rows) {
  std::vector<Points> changes(numbers.count(), Points::Zero(rows, 3));
  for_law_derivatives(elasticity, material, theta,
                      [&](std::span<const int> nodes, const ParameterHandle& at, double share, const auto& by) {
                        Points& change = changes[numbers[at]];
                        for (std::size_t a = 0; a < nodes.size(); ++a)
                          change.row(nodes[a]) -= share * by.template segment<3>(3 * Eigen::Index(a)).transpose();
                      });
  return changes;
}

void add_force_adjoint(const LawElasticity& elasticity, const PressedMaterial& material, const VectorX& theta,
                       const Points& w, VectorX& theta_bar) {
  for_law_derivatives(elasticity, material, theta,
                      [&](std::span<const int> nodes, const ParameterHandle& at, double share, const auto& by) {
                        double sum = 0.0;
                        for (std::size_t a = 0; a < nodes.size(); ++a)
                          sum -= w.row(nodes[a]).dot(by.template segment<3>(3 * Eigen::Index(a)));
                        theta_bar[at] += share * sum;
                      });
}

}  // namespace pliant
