#include "simulation/small_motions.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <random>

#include "base/error.hpp"
#include "base/points.hpp"
#include "elasticity/modes.hpp"
#include "motion/compliance.hpp"

namespace pliant {

namespace {

Points mass_product(const Body& body, double density, const Points& x) {
  Points product = Points::Zero(x.rows(), 3);
  body.add_mass_product(density, x, product);
  return product;
}

/// Subspace iteration (Bathe 1996, section 11.6) with masses of this density [kg/m^3].
std::vector<double> frequencies(const Body& body, Compliance& compliance, double density, int count) {
  constexpr int most_iterations = 60;
  const int size = 2 * count;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<Points> x(std::size_t(size), Points(body.node_count(), 3));
  for (Points& shape : x)
    for (Eigen::Index k = 0; k < shape.size(); ++k) shape.data()[k] = normal(random);
  VectorX lambda = VectorX::Zero(size);
  for (int i = 0; i < most_iterations; ++i) {
    std::vector<Points> masses, moved, masses_moved;
    for (const Points& shape : x) {
      masses.push_back(mass_product(body, density, shape));
      moved.push_back(compliance.displacements(masses.back()));
      masses_moved.push_back(mass_product(body, density, moved.back()));
    }
    MatrixX K(size, size), M(size, size);
    for (int a = 0; a < size; ++a)
      for (int b = 0; b < size; ++b) {
        K(a, b) = moved[std::size_t(a)].cwiseProduct(masses[std::size_t(b)]).sum();
        M(a, b) = moved[std::size_t(a)].cwiseProduct(masses_moved[std::size_t(b)]).sum();
      }
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixX> small(0.5 * (K + K.transpose()), 0.5 * (M + M.transpose()));
    for (int a = 0; a < size; ++a) {
      x[std::size_t(a)].setZero();
      for (int b = 0; b < size; ++b) x[std::size_t(a)] += small.eigenvectors()(b, a) * moved[std::size_t(b)];
    }
    const VectorX before = lambda;
    lambda = small.eigenvalues();
    if (((lambda - before).head(count).array().abs() < 1e-9 * lambda.head(count).array()).all()) break;
  }
  std::vector<double> hertz;
  for (int k = 0; k < count; ++k) hertz.push_back(std::sqrt(lambda[k]) / (2.0 * std::numbers::pi));
  return hertz;
}

}  // namespace

SimulationOptions elastic_alone(SimulationOptions options) {
  options.is_static = true;
  options.times = {0.0};
  options.blocks.planes.clear(), options.blocks.pulls.clear(), options.blocks.strengths.clear();
  options.further_forces.clear(), options.weights.clear(), options.loads.clear(), options.released_weights.clear();
  options.material.elastic = ElasticLaw::Corotated;
  for (Hold& hold : options.holds) hold.rotation.setIdentity(), hold.translation.setZero();
  return options;
}

SmallMotions small_motions(const std::shared_ptr<const Body>& body, const SimulationOptions& options,
                           const VectorX& theta, const Points& points, int count) {
  SmallMotions motions;
  const double density = theta[options.blocks.density];
  if (options.holds.empty()) {
    constexpr int rigid = 6;
    ModalAnalysis analysis(body, options.blocks, {});
    const Modes modes = analysis.lowest(theta, rigid + count);
    if (!modes.converged) throw InputError({{}, "the model's vibrations were not found: " + modes.failure, "", ""});
    for (int k = rigid; k < modes.count(); ++k) motions.frequencies.push_back(modes.frequency(k));
    return motions;
  }
  Compliance compliance(body, options, theta, body->nodes);
  if (!compliance.is_ready())
    throw InputError({{}, "the model's stiffness cannot be factorised", "regions that hold the whole object", ""});
  motions.frequencies = frequencies(*body, compliance, density, count);
  const Points gravity = theta.segment<3>(options.blocks.gravity).transpose().replicate(body->node_count(), 1);
  const Points moved =
      Embedding(*body, to_vectors(points)).positions(compliance.displacements(mass_product(*body, density, gravity)));
  motions.sag = std::sqrt(moved.rowwise().squaredNorm().maxCoeff());
  return motions;
}

}  // namespace pliant
