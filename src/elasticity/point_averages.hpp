#pragma once

#include <span>
#include <vector>

#include "elasticity/body.hpp"

namespace pliant {

/// A number of each element as a smooth one at points: the mean of the elements about a node, by volume, then the mean
/// of the nodes about a point, by the magnitude of their weights there.
std::vector<double> averages_at(const Body& body, const Embedding& points, std::span<const double> of_elements);

/// The von Mises stress of a Cauchy stress [Pa].
double von_mises(const Matrix3& stress);

}  // namespace pliant
