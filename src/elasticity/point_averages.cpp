#include "elasticity/point_averages.hpp"

#include <cmath>

namespace pliant {

std::vector<double> averages_at(const Body& body, const Embedding& points, std::span<const double> of_elements) {
  std::vector<double> of_node(std::size_t(body.node_count()), 0.0), volume(of_node.size(), 0.0);
  for (int e = 0; e < body.element_count(); ++e) {
    const double size = body.element_volume[std::size_t(e)];
    for (const int node : body.element(e)) {
      of_node[std::size_t(node)] += size * of_elements[std::size_t(e)];
      volume[std::size_t(node)] += size;
    }
  }
  std::vector<double> averages(std::size_t(points.point_count()), 0.0);
  for (std::size_t i = 0; i < averages.size(); ++i) {
    const auto nodes = points.nodes(int(i));
    const auto weights = points.weights(int(i));
    double sum = 0.0, total = 0.0;
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      const auto n = std::size_t(nodes[a]);
      const double share = std::abs(weights[a]);
      sum += share * (volume[n] > 0.0 ? of_node[n] / volume[n] : 0.0);
      total += share;
    }
    averages[i] = total > 0.0 ? sum / total : 0.0;
  }
  return averages;
}

double von_mises(const Matrix3& stress) {
  const Matrix3 deviator = stress - stress.trace() / 3.0 * Matrix3::Identity();
  return std::sqrt(1.5) * deviator.norm();
}

}  // namespace pliant
