#include "elasticity/body_fields.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "base/parallel.hpp"

namespace pliant {

BodyFields body_fields(const Body& body, Elasticity& elasticity, const Points& positions) {
  const auto count = std::size_t(body.element_count());
  BodyFields fields;
  fields.strain.resize(count), fields.stress.resize(count);
  for (std::vector<double>* values : {&fields.von_mises, &fields.greatest_strain, &fields.tangent_modulus})
    values->resize(count);
  elasticity.linearise(positions);
  for (std::size_t e = 0; e < count; ++e) {
    const Polar& polar = elasticity.rotation(int(e));
    fields.strain[e] = polar.R * (polar.S - Matrix3::Identity()) * polar.R.transpose();
    fields.greatest_strain[e] = greatest_strain(polar.S);
  }
  parallel_for(0, int(count), [&](int element) {
    const auto e = std::size_t(element);
    fields.stress[e] = elasticity.cauchy_stress(element);
    fields.von_mises[e] = von_mises(fields.stress[e]);
    fields.tangent_modulus[e] = elasticity.tangent_modulus(element);
  });
  return fields;
}

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

double greatest_strain(const Matrix3& S) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> strain(Matrix3(S - Matrix3::Identity()), Eigen::EigenvaluesOnly);
  return strain.eigenvalues().cwiseAbs().maxCoeff();
}

Matrix3 cauchy_stress(const MaterialLaw& law, int element, const Matrix3& F) {
  PointStress at;
  law.stress(element, F, false, at);
  if (!std::isfinite(at.energy)) return Matrix3::Constant(std::numeric_limits<double>::quiet_NaN());
  return at.P * F.transpose() / F.determinant();
}

}  // namespace pliant
