// Divided differences and third derivatives where stretches meet, where differences of differences would lose all
// digits.
#include "elasticity/third_derivatives.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "support/tolerance.hpp"

namespace pliant::third_derivatives_test {
namespace {

using test::tolerance;

OddPowers power(double exponent) {
  OddPowers f;
  f.add(2.0, exponent);
  return f;
}

/// Powers whose divided differences are known: of x^5 they are sums of all products of their order, of 1 / x products.
TEST(OddPowers, DividedDifferencesAreExactHoweverCloseThePointsAre) {
  for (const double x : {1.3, -0.7})
    for (const double y_gap : {0.0, 1e-14, 1e-9, 1e-5, 3e-4, 8e-4, 1e-2, 0.4, -2.0})
      for (const double z_gap : {0.0, 1e-12, -1e-6, 2e-4, -5e-4, 2e-3, -1e-2, 0.3, -2.1}) {
        const double y = x * (1.0 + y_gap), z = x * (1.0 + z_gap);
        double of_fifth = 0.0, pair = 0.0;  // complete homogeneous polynomials
        for (int i = 0; i <= 3; ++i)
          for (int j = 0; i + j <= 3; ++j) of_fifth += std::pow(x, i) * std::pow(y, j) * std::pow(z, 3 - i - j);
        for (int i = 0; i <= 4; ++i) pair += std::pow(x, i) * std::pow(y, 4 - i);
        const double size = std::pow(std::max({std::abs(x), std::abs(y), std::abs(z)}), 3);
        EXPECT_NEAR(power(5.0).divided(x, y), 2.0 * pair, tolerance(1e-12) * pair) << y_gap;
        EXPECT_NEAR(power(5.0).divided(x, y, z), 2.0 * of_fifth, tolerance(1e-11) * size) << y_gap << " " << z_gap;
        const double inverse = 1.0 / (x * y * z);
        EXPECT_NEAR(power(-1.0).divided(x, y), -2.0 / (x * y), tolerance(1e-12) / std::abs(x * y));
        EXPECT_NEAR(power(-1.0).divided(x, y, z), 2.0 * inverse, tolerance(1e-11) * std::abs(inverse));
        EXPECT_EQ(power(5.0).divided(x, y, z), power(5.0).divided(z, x, y)) << "in any order";
      }
  EXPECT_DOUBLE_EQ(power(2.5)(-1.7), -power(2.5)(1.7));
}

/// Against differences of the tangent, with two or three stretches the same or nearly so.
TEST(OgdenLaw, TangentChangesSmoothlyWhereStretchesMeet) {
  MatrixX table(1, 6);
  table << 800.0, 9.0, 0.2, 500.0, -6.0, 0.1;
  const OgdenLaw law(table);
  const Matrix3 U = Eigen::AngleAxisd(0.8, Vector3(1, 2, -1).normalized()).toRotationMatrix(),
                V = Eigen::AngleAxisd(-1.1, Vector3(0.3, -1, 0.5).normalized()).toRotationMatrix();
  Matrix3 dF;
  dF << 0.3, -0.7, 0.2, 0.5, 0.1, -0.4, -0.6, 0.9, 0.25;
  for (const Vector3& stretch :
       {Vector3(1, 1, 1), Vector3(1.2, 1.2, 0.8), Vector3(1.2, 1.2 + 1e-9, 0.8), Vector3(0.9, 0.9 + 1e-5, 0.9 - 1e-4),
        Vector3(1.1, 1.1 + 3e-4, 1.1 + 1e-3), Vector3(1.4, 1.1, 0.7)}) {
    const Matrix3 F = U * stretch.asDiagonal() * V.transpose();
    const Matrix9 change = law.tangent_derivative(0, F, dF);
    const Matrix9 by_differences = law.MaterialLaw::tangent_derivative(0, F, dF);
    EXPECT_LT((change - by_differences).norm(), tolerance(1e-6) * change.norm()) << stretch.transpose();
    EXPECT_LT((change - change.transpose()).norm(), tolerance(1e-11) * change.norm()) << stretch.transpose();
  }
  EXPECT_TRUE(law.tangent_derivative(0, -Matrix3::Identity(), dF).hasNaN()) << "no such deformation is known";
}

}  // namespace
}  // namespace pliant::third_derivatives_test
