#include "estimation/sample_fit.hpp"

#include "support/derivatives.hpp"
#include "support/presses.hpp"
#include "support/tolerance.hpp"

namespace pliant::sample_fit_test {
namespace {

using test::tolerance;

std::shared_ptr<const LinearLaw> linear(const Body& body, double E, double nu, double slope = 0.0) {
  MatrixX table(body.element_count(), 2);
  for (int e = 0; e < body.element_count(); ++e) {
    double y = 0.0;
    for (const int n : body.element(e)) y += 0.25 * body.nodes(n, 1);
    const LambdaAlpha p = lambda_alpha({E * std::exp(slope * y), nu});
    table.row(e) << p.lambda, p.alpha;
  }
  return std::make_shared<LinearLaw>(table);
}

TEST(SampleJacobian, IsTheSameByTangentsAndAdjointsAndMatchesCentralDifferences) {
  const test::PressedBlock block({3, 2, 3});
  const auto law = linear(*block.body, 9000.0, 0.25, 4.0);
  const PressScene scene = block.scene({{{0.02, 0.05, 0.0}, {1.0, -12.0, 0.0}}}, law);
  PressedBody body(scene, 0, law, 9000.0);
  ASSERT_TRUE(body.solve().converged);
  ASSERT_TRUE(body.equilibrium().prepare_derivatives(body.placement()));
  const MatrixX by_tangents = sample_jacobian(body, *block.body, *law, JacobianBy::Tangents);
  const MatrixX by_adjoints = sample_jacobian(body, *block.body, *law, JacobianBy::Adjoints);
  EXPECT_LT((by_tangents - by_adjoints).norm(), tolerance(1e-9) * by_tangents.norm());
  const int count = block.body->element_count();
  for (const int column : {0, 17, count + 5, 2 * count - 3}) {
    const int e = column % count;
    const auto along = [&](double h) {
      MatrixX table = law->table();
      const SmallStrainModuli m = law->small_strain(e);
      const LambdaAlpha p = column < count
                                ? lambda_alpha({m.youngs_modulus * std::exp(h), m.poissons_ratio})
                                : lambda_alpha({m.youngs_modulus, ratio_of(unconstrained_ratio(m.poissons_ratio) + h)});
      table.row(e) << p.lambda, p.alpha;
      PressedBody changed(scene, 0, std::make_shared<LinearLaw>(table), 9000.0);
      EXPECT_TRUE(changed.solve().converged);
      return VectorX(flat(changed.points()));
    };
    EXPECT_LT(test::best_relative_error(along, by_tangents.col(column), 1.0), tolerance(1e-5)) << column;
  }
}

TEST(ElementSmoothness, IsItsOwnInverseAndCostsConstantsLittle) {
  const test::PressedBlock block({3, 2, 3});
  const ElementSmoothness smooth(*block.body);
  const VectorX x = VectorX::LinSpaced(smooth.size(), -1.0, 1.0).array().sin();
  EXPECT_LT((smooth.solve(smooth.times(x)) - x).norm(), tolerance(1e-8) * x.norm());
  EXPECT_NEAR(MatrixX(smooth.half_solve(x)).squaredNorm(), x.dot(VectorX(smooth.solve(x))),
              tolerance(1e-8) * x.dot(VectorX(smooth.solve(x))));
  const VectorX ones = VectorX::Ones(smooth.size());
  EXPECT_LT(ones.dot(VectorX(smooth.times(ones))), 1e-3 * x.dot(VectorX(smooth.times(x))));
}

TEST(PressSample, FindsAStiffnessThatVariesAndStopsAtTheNoise) {
  const test::PressedBlock block({4, 3, 4});
  const auto law = linear(*block.body, 9000.0, 0.25, 6.0);  // 1.8 times stiffer at the top than at the bottom
  const double noise = 1e-4;
  const PressScene scene = block.scene({{{0.0, 0.05, 0.0}, {1.0, -15.0, 0.0}}}, law, noise);
  const ElementSmoothness smooth(*block.body);
  const PressSample sample = fit_sample(scene, 0, {6000.0, 0.3}, smooth, {noise});
  ASSERT_TRUE(sample.succeeded) << sample.failure;
  EXPECT_LT(sample.rms, 1.15 * std::sqrt(3.0) * noise);
  EXPECT_GT(sample.rms, 0.6 * std::sqrt(3.0) * noise);  // no noise is fitted
  EXPECT_GT(sample.start_rms, 5.0 * sample.rms);
  EXPECT_GT(sample.weight, 0.0);
  // Under the disc, where the press strains the block, its mean stiffness.
  double sum = 0.0, truth = 0.0, weight = 0.0;
  for (int e = 0; e < block.body->element_count(); ++e) {
    const double w = sample.sample.strains.row(e).norm();
    sum += w * std::log(moduli_of(sample.sample.p[std::size_t(e)]).youngs_modulus);
    truth += w * std::log(law->small_strain(e).youngs_modulus);
    weight += w;
    EXPECT_LT(sample.sample.p[std::size_t(e)].alpha, 0.5 * sample.sample.p[std::size_t(e)].lambda);
  }
  EXPECT_NEAR((sum - truth) / weight, 0.0, 0.1);
}

}  // namespace
}  // namespace pliant::sample_fit_test
