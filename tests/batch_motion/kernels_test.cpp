#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <random>

#include "batch_motion/contact_kernels.hpp"
#include "batch_motion/rotation.hpp"
#include "elasticity/polar.hpp"
#include "motion/penalty.hpp"
#include "support/tolerance.hpp"

namespace pliant::batch_kernels_test {
namespace {

using test::tolerance;

/// Random gradients: turned and stretched, and every third one turned inside out.
std::vector<Matrix3> gradients() {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Matrix3> all;
  for (int k = 0; k < 60; ++k) {
    const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
    Matrix3 S = Matrix3::Identity();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j) S(i, j) += 0.2 * normal(random), S(j, i) = S(i, j);
    if (k % 3 == 2) S -= 1.2 * Vector3::UnitX() * Vector3::UnitX().transpose();
    all.push_back(q.normalized().toRotationMatrix() * S);
  }
  return all;
}

using Rows = std::array<double, 9>;
Rows rows_of(const Matrix3& A) {
  Rows rows;
  for (std::size_t k = 0; k < 9; ++k) rows[k] = A(Eigen::Index(k / 3), Eigen::Index(k % 3));
  return rows;
}

TEST(BatchKernels, RotationsAndTheirRatesAreThoseOfThePolarDecomposition) {
  int inverted = 0;
  for (const Matrix3& F : gradients()) {
    const Polar polar = polar_decomposition(F);
    const Rows rows = rows_of(F);
    double q[4] = {1, 0, 0, 0}, R[9], H[6];
    batch_motion::closest_rotation<double, bool>(rows.data(), q, R);
    const Rows truth = rows_of(polar.R);
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(R[k], truth[k], tolerance(1e-12) / polar.S.trace());
    batch_motion::rate_inverse<double, bool>(R, rows.data(), H);
    const Matrix3& inverse = polar.rate_inverse;
    const double expected[6] = {inverse(0, 0), inverse(0, 1), inverse(0, 2),
                                inverse(1, 1), inverse(1, 2), inverse(2, 2)};
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(H[k], expected[k], tolerance(1e-9) * (1.0 + inverse.norm()));
    inverted += F.determinant() < 0.0;
  }
  EXPECT_GT(inverted, 3);
}

TEST(BatchKernels, TheClosestRotationOfNothingIsTheIdentity) {
  const double F[9] = {};
  double q[4] = {1, 0, 0, 0}, R[9];
  batch_motion::closest_rotation<double, bool>(F, q, R);
  for (int k = 0; k < 9; ++k) EXPECT_EQ(R[k], k % 4 == 0 ? 1.0 : 0.0);
}

TEST(BatchKernels, PressureIsThePenaltys) {
  for (const auto onset : {Penalty::Onset::Softplus, Penalty::Onset::Quadratic}) {
    const Penalty penalty{3.0, 0.02, onset};
    batch_motion::StepNumbers step;
    step.smoothing = 0.02, step.is_quadratic = onset == Penalty::Onset::Quadratic;
    for (const double gap : {-0.5, -0.021, -0.01, 0.0, 0.003, 0.019, 0.1, 0.5}) {
      const Penalty::Value truth = penalty.pressure_at(gap);
      double pressure, slope, curvature;
      batch_motion::unit_pressure<batch_motion::DeviceLane>(step, gap, pressure, slope, curvature);
      EXPECT_NEAR(3.0 * pressure, truth.pressure, tolerance(1e-14));
      EXPECT_NEAR(3.0 * slope, truth.slope, tolerance(1e-14));
      EXPECT_NEAR(3.0 * curvature, truth.curvature, tolerance(1e-12));
    }
  }
}

}  // namespace
}  // namespace pliant::batch_kernels_test
