#include "elasticity/element_moduli.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "elasticity/modulus_field.hpp"
#include "support/bodies.hpp"

namespace pliant::element_moduli_test {
namespace {

struct TwoControls {
  std::shared_ptr<const Body> body;
  MotionLayout layout{{.moduli = 2}};
  VectorX theta = layout.zero();
  MatrixX covariance = MatrixX::Zero(2, 2);

  TwoControls() {
    Box box;
    box.extend(Vector3(0, 0, 0));
    box.extend(Vector3(1.0, 0.2, 0.2));
    Body of = make_body(make_tet_box(box, {8, 1, 1}, false));
    of.modulus = linear_field(of, Vector3::UnitX(), 2).field;
    body = std::make_shared<Body>(std::move(of));
    set(0, 2e4), set(1, 5e5);
    covariance << 0.04, -0.01, -0.01, 0.09;
  }
  void set(int control, double modulus) { theta[layout.youngs_moduli[std::size_t(control)]] = modulus; }
  ModulusStatistics statistics() const { return modulus_statistics(body, layout, theta, covariance); }
};

TEST(ModulusStatistics, DeviationsFollowTheFieldsDerivatives) {
  TwoControls scene;
  const ModulusStatistics s = scene.statistics();
  constexpr double step = 1e-5;
  MatrixX by_log(scene.body->element_count() + 1, 2);
  for (int k = 0; k < 2; ++k) {
    const double modulus = scene.theta[scene.layout.youngs_moduli[std::size_t(k)]];
    scene.set(k, modulus * std::exp(step));
    const ModulusStatistics above = scene.statistics();
    scene.set(k, modulus * std::exp(-step));
    const ModulusStatistics below = scene.statistics();
    scene.set(k, modulus);
    by_log.col(k) << (above.value - below.value) / (2 * step), (above.mean - below.mean) / (2 * step);
  }
  const VectorX variance = (by_log * scene.covariance * by_log.transpose()).diagonal();
  for (int e = 0; e < scene.body->element_count(); ++e)
    EXPECT_NEAR(s.std[e], std::sqrt(variance[e]), 1e-6 * s.value[e]) << e;
  EXPECT_NEAR(s.mean_std, std::sqrt(variance[scene.body->element_count()]), 1e-6 * s.mean);
  EXPECT_GT(s.mean, s.value.minCoeff());
  EXPECT_LT(s.mean, s.value.maxCoeff());
}

/// ln E of an element is linear in those of the controls: its deviation is exact, and that of E itself to first order.
TEST(ModulusStatistics, DeviationsAreThoseOfSampledControls) {
  TwoControls scene;
  const ModulusStatistics s = scene.statistics();
  const MatrixX factor = scene.covariance.llt().matrixL();
  const Eigen::Vector2d centre(std::log(2e4), std::log(5e5));
  constexpr int samples = 20000;
  const auto count = Eigen::Index(scene.body->element_count());
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  VectorX sum = VectorX::Zero(count), squares = sum;
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector2d z(normal(random), normal(random));
    const Eigen::Vector2d log_moduli = centre + factor * z;
    for (int k = 0; k < 2; ++k) scene.set(k, std::exp(log_moduli[k]));
    const VectorX log_value = scene.statistics().value.array().log();
    sum += log_value, squares += log_value.cwiseAbs2();
  }
  const double error = 4.0 / std::sqrt(2.0 * samples);  // of a sampled deviation, four of its own
  for (Eigen::Index e = 0; e < count; ++e) {
    const double mean = sum[e] / samples, sampled = std::sqrt(squares[e] / samples - mean * mean);
    EXPECT_NEAR(s.std[e] / s.value[e], sampled, error * sampled) << e;
    EXPECT_NEAR(mean, std::log(s.value[e]), 4.0 * sampled / std::sqrt(samples)) << e;
  }
  EXPECT_LT(s.std.minCoeff() / s.std.maxCoeff(), 0.5) << "it varies over the body";
}

TEST(ModulusStatistics, OneModulusIsItsOwnMean) {
  const auto body = test::box_body(Vector3(0.3, 0.2, 0.2), 0.1);
  const MotionLayout layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 3e4);
  const ModulusStatistics s = modulus_statistics(body, layout, theta, MatrixX::Constant(1, 1, 0.01));
  EXPECT_NEAR(s.mean, 3e4, 1e-8);
  EXPECT_NEAR(s.mean_std, 3e3, 1e-8);
  EXPECT_NEAR(s.std.minCoeff(), 3e3, 1e-8);
}

TEST(ModulusStatistics, WithoutACovarianceNothingIsSaidOfDeviations) {
  TwoControls scene;
  scene.covariance.resize(0, 0);
  EXPECT_EQ(scene.statistics().std.maxCoeff(), 0.0);
}

}  // namespace
}  // namespace pliant::element_moduli_test
