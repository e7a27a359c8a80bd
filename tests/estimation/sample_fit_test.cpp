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
  // Ogden's law, changed in every element otherwise.
  const int count = block.body->element_count();
  const auto about = std::make_shared<OgdenLaw>(MatrixX(Eigen::RowVector3d(3600.0, 6.0, 0.25).replicate(count, 1)));
  MatrixX table(count, 2);
  for (int e = 0; e < count; ++e) table.row(e) << 1.0 + 0.3 * std::sin(e), 0.25 + 0.1 * std::cos(3.0 * e);
  const auto law =
      std::make_shared<ChangedLaw>(about, std::vector<SmallStrainModuli>(std::size_t(count), {9500.0, 0.2}), table);
  const PressScene scene = block.scene({{{0.02, 0.05, 0.0}, {1.0, -12.0, 0.0}}}, law);
  PressedBody body(scene, 0, law, 9000.0);
  ASSERT_TRUE(body.solve().converged);
  ASSERT_TRUE(body.equilibrium().prepare_derivatives(body.placement()));
  const MatrixX by_tangents = sample_jacobian(body, *block.body, *law, JacobianBy::Tangents);
  const MatrixX by_adjoints = sample_jacobian(body, *block.body, *law, JacobianBy::Adjoints);
  EXPECT_LT((by_tangents - by_adjoints).norm(), tolerance(1e-9) * by_tangents.norm());
  for (const int column : {0, 17, count + 5, 2 * count - 3}) {
    const int e = column % count;
    const auto along = [&](double h) {
      MatrixX moved = table;
      if (column < count)
        moved(e, 0) *= std::exp(h);
      else
        moved(e, 1) = ratio_of(unconstrained_ratio(moved(e, 1)) + h);
      PressedBody changed(scene, 0, law->with_table(moved), 9000.0);
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

/// Deviations that are known, and such that are wrong by a factor that the fit does not know.
class PressSamples : public testing::TestWithParam<std::pair<double, bool>> {};
INSTANTIATE_TEST_SUITE_P(All, PressSamples,
                         testing::Values(std::pair(1.0, true), std::pair(1.0, false), std::pair(20.0, false)));

TEST_P(PressSamples, FindAStiffnessThatVariesAndStopAtTheNoise) {
  const auto [unit, is_known] = GetParam();
  const test::PressedBlock block({4, 3, 4});
  const auto law = linear(*block.body, 9000.0, 0.25, 6.0);  // 1.8 times stiffer at the top than at the bottom
  const double noise = 1e-4;
  const PressScene scene = block.scene({{{0.0, 0.05, 0.0}, {1.0, -15.0, 0.0}}}, law, noise);
  const ElementSmoothness smooth(*block.body);
  SampleFitOptions options;
  options.deviations = VectorX::Constant(3 * Eigen::Index(scene.presses[0].rest.size()), unit * noise);
  options.is_scale_known = is_known;
  const auto start = linear(*block.body, 6000.0, 0.3);
  const MatrixX unstrained = MatrixX::Zero(block.body->element_count(), 6);
  const PressSample sample = fit_sample(scene, 0, start, unstrained, smooth, options);
  ASSERT_TRUE(sample.succeeded) << sample.failure;
  // The weight of the evidence trusts smoothness further than the misfit asks: truth is straight over the height.
  EXPECT_LT(sample.rms, (is_known ? 1.15 : 1.4) * std::sqrt(3.0) * noise) << sample.iterations << " iterations";
  EXPECT_GT(sample.rms, 0.6 * std::sqrt(3.0) * noise);  // no noise is fitted
  EXPECT_GT(sample.start_rms, 5.0 * sample.rms);
  EXPECT_GT(sample.weight, 0.0);
  // Under the disc, where the press strains the block, its mean stiffness.
  double sum = 0.0, truth = 0.0, weight = 0.0;
  for (int e = 0; e < block.body->element_count(); ++e) {
    const double w = sample.sample.strains.row(e).norm();
    const SmallStrainModuli found =
        secant_moduli(tensor_of(sample.sample.strains.row(e).transpose()),
                      tensor_of(sample.sample.stresses.row(e).transpose()), start->small_strain(e));
    sum += w * std::log(found.youngs_modulus);
    truth += w * std::log(law->small_strain(e).youngs_modulus);
    weight += w;
  }
  EXPECT_NEAR((sum - truth) / weight, 0.0, 0.1);
}

TEST(SecantModuli, AreALinearLawsOwnAndThoseOfAPullInAnotherLaw) {
  MatrixX strains(3, 6);
  strains << 0.2, -0.05, 0.01, 0.03, -0.1, 0.02,  //
      0.0, 0.0, 0.0, 0.0, 0.0, 0.0,               //
      0.1, 0.1, 0.1, 0.0, 0.0, 0.0;
  const LinearLaw linear(MatrixX::Ones(3, 1) * Eigen::RowVector2d(9000.0, 2400.0));
  for (const SmallStrainModuli& m : secant_moduli(linear, strains)) {
    EXPECT_NEAR(m.youngs_modulus, moduli_of({9000.0, 2400.0}).youngs_modulus, 1e-6);
    EXPECT_NEAR(m.poissons_ratio, 2400.0 / 9000.0, 1e-9);
  }
  // Of Ogden's law, the linear law has its stress where that is a multiple of strain and of its trace.
  const OgdenLaw ogden(MatrixX::Ones(1, 1) * Eigen::RowVector3d(2000.0, 6.0, 0.3));
  const double l = 1.15;
  const double side = std::pow(l, -0.3);
  MatrixX pulled = MatrixX::Zero(1, 6);
  pulled.row(0).head<3>() << l - 1.0, side - 1.0, side - 1.0;
  const SmallStrainModuli secant = secant_moduli(ogden, pulled)[0];
  PointStress point;
  ogden.stress(0, Vector3(l, side, side).asDiagonal(), false, point);
  const LambdaAlpha p = lambda_alpha(secant);
  const Vector3 strain = pulled.row(0).head<3>().transpose();
  const Vector3 stress = (p.lambda - 2.0 * p.alpha) * strain + p.alpha * strain.sum() * Vector3::Ones();
  EXPECT_LT((stress - point.P.diagonal()).norm(), 0.05 * point.P.norm());  // held lightly to the law at rest
  EXPECT_GT(secant.youngs_modulus, 1.1 * ogden.small_strain(0).youngs_modulus);
}

}  // namespace
}  // namespace pliant::sample_fit_test
