#pragma once

#include "estimation/press_trial.hpp"

namespace pliant {

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

/// Changes of the elastic forces -dW/dx on the nodes by each of the law's numbers, at the last `evaluate` of the
/// elasticity.
/// @param rows  of each: the nodes', and as many zeros below as are wanted
std::vector<Points> force_changes(const LawElasticity& elasticity, const PressedMaterial& material,
                                  const VectorX& theta, const LawNumbers& numbers, Eigen::Index rows);

/// Adds to `theta_bar` the cotangent of theta for the cotangent `w` of those forces, which may have more rows.
void add_force_adjoint(const LawElasticity& elasticity, const PressedMaterial& material, const VectorX& theta,
                       const Points& w, VectorX& theta_bar);

}  // namespace pliant
