#pragma once

#include "elasticity/sampled_law.hpp"

namespace pliant::test {

/// Ogden's law of one term, the same in all elements; exponent 3.
inline std::shared_ptr<const TabulatedLaw> one_term_ogden(int elements, double mu, double nu) {
  return std::make_shared<OgdenLaw>(MatrixX(Eigen::RowVector3d(mu, 3.0, nu).replicate(elements, 1)));
}

/// Stress of linear laws whose Young's modulus grows with the strain's norm: E (1 + growth |e|).
inline MaterialSample stiffening_sample(const MatrixX& strains, double youngs_modulus, double growth, double nu) {
  MaterialSample sample{strains, MatrixX(strains.rows(), 6)};
  for (Eigen::Index e = 0; e < strains.rows(); ++e) {
    const Matrix3 strain = tensor_of(strains.row(e).transpose());
    const LambdaAlpha p = lambda_alpha({youngs_modulus * (1.0 + growth * strain.norm()), nu});
    Matrix3 stress = (p.lambda - 2.0 * p.alpha) * strain;
    stress.diagonal().array() += p.alpha * strain.trace();
    sample.stresses.row(e) = components_of(stress).transpose();
  }
  return sample;
}

}  // namespace pliant::test
