#include "elasticity/polar.hpp"

#include <algorithm>
#include <random>

#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::polar_test {
namespace {

using test::tolerance;

Matrix3 random_matrix(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Matrix3 m;
  for (int i = 0; i < 9; ++i) m.data()[i] = uniform(random);
  return m;
}
Eigen::Quaterniond random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
}
/// R S with the given signed singular values.
Matrix3 with_stretches(const Vector3& s, std::mt19937& random) {
  const Matrix3 V = random_rotation(random).toRotationMatrix();
  return random_rotation(random).toRotationMatrix() * V * s.asDiagonal() * V.transpose();
}

/// Change of R for a change of F [-], 3 x 3.
Matrix3 rotation_derivative(const Polar& polar, const Matrix3& dF) {
  return polar.R * cross_matrix(rotation_rate(polar, dF));
}

/// Stretches of generic poses: near rest, large, squeezed, nearly inverted, inverted, inverted and large.
const std::vector<Vector3> stretches = {{1.0, 1.1, 0.9},  {3.0, 1.2, 0.4},  {0.9, 0.5, 0.05},   {1.2, 0.8, 0.001},
                                        {1.3, 0.8, -0.2}, {2.0, 1.5, -0.9}, {0.02, 0.03, 0.01}, {50.0, 30.0, 4.0}};

/// The closest rotation: R^T F symmetric, and tr(S) I - S positive, which no other stationary point has.
void expect_closest_rotation(const Matrix3& F, const Polar& polar) {
  EXPECT_LT((polar.R.transpose() * polar.R - Matrix3::Identity()).norm(), tolerance(1e-13));
  EXPECT_NEAR(polar.R.determinant(), 1.0, tolerance(1e-13));
  const Matrix3 S = polar.R.transpose() * F;
  EXPECT_LT((S - S.transpose()).norm(), tolerance(1e-13) * F.norm());
  EXPECT_LT((S - polar.S).norm(), tolerance(1e-13) * F.norm());
  const Matrix3 H = S.trace() * Matrix3::Identity() - 0.5 * (S + S.transpose());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix3>(H).eigenvalues().minCoeff(), -tolerance(1e-12) * F.norm());
  EXPECT_LT((polar.quaternion.toRotationMatrix() - polar.R).norm(), tolerance(1e-13));
}

TEST(Polar, IsTheClosestRotationInEveryPose) {
  std::mt19937 random(1);
  for (const Vector3& s : stretches)
    for (int trial = 0; trial < 20; ++trial) {
      const Matrix3 F = with_stretches(s, random);
      const Polar polar = polar_decomposition(F, random_rotation(random));  // any guess, also opposite ones
      expect_closest_rotation(F, polar);
      EXPECT_FALSE(polar.is_degenerate);
    }
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix3 F = random_matrix(random);
    expect_closest_rotation(F, polar_decomposition(F, random_rotation(random)));
  }
}

TEST(Polar, DoesNotDependOnTheGuess) {
  std::mt19937 random(2);
  for (const Vector3& s : stretches) {
    const Matrix3 F = with_stretches(s, random);
    const Polar first = polar_decomposition(F);
    for (int trial = 0; trial < 10; ++trial)
      EXPECT_LT((polar_decomposition(F, random_rotation(random)).R - first.R).norm(), tolerance(1e-12));
    EXPECT_LT((polar_decomposition(F, first.quaternion).R - first.R).norm(), tolerance(1e-13));
  }
}

/// Groups of several and what is left over, with every kind of pose beside every other.
TEST(Polar, ManyAreAsEachAlone) {
  std::mt19937 random(8);
  std::vector<Matrix3> gradients;
  for (int trial = 0; trial < 5; ++trial)
    for (const Vector3& s : stretches) gradients.push_back(with_stretches(s, random));
  gradients.push_back(Matrix3::Zero());
  gradients.push_back(Matrix3::Constant(std::numeric_limits<double>::quiet_NaN()));
  gradients.push_back(Vector3(1.0, 1.0, -1.0).asDiagonal());  // no unique rotation
  std::ranges::shuffle(gradients, random);
  for (const double distance : {0.0, 0.01, 0.5, 3.0}) {  // of the guess
    std::vector<Polar> polars(gradients.size());
    std::vector<Polar> alone;
    for (std::size_t i = 0; i < gradients.size(); ++i) {
      const Polar exact = polar_decomposition(gradients[i]);
      polars[i].quaternion = exact.quaternion * Eigen::AngleAxisd(distance, Vector3(1, -2, 2).normalized());
      alone.push_back(polar_decomposition(gradients[i], polars[i].quaternion));
    }
    polar_decompositions(gradients, polars);
    for (std::size_t i = 0; i < gradients.size(); ++i) {
      EXPECT_EQ(polars[i].is_degenerate, alone[i].is_degenerate) << gradients[i];
      if (!gradients[i].allFinite() || alone[i].is_degenerate) continue;
      expect_closest_rotation(gradients[i], polars[i]);
      EXPECT_LT((polars[i].R - alone[i].R).norm(), tolerance(1e-12));
      EXPECT_LT((polars[i].S - alone[i].S).norm(), tolerance(1e-13) * gradients[i].norm());
      EXPECT_LT((polars[i].rate_inverse - alone[i].rate_inverse).norm(),
                tolerance(1e-10) * alone[i].rate_inverse.norm());
    }
  }
}

TEST(Polar, RateInverseIsTheInverse) {
  std::mt19937 random(3);
  for (const Vector3& s : stretches) {
    const Polar polar = polar_decomposition(with_stretches(s, random));
    const Matrix3 H = polar.S.trace() * Matrix3::Identity() - polar.S;
    EXPECT_LT((polar.rate_inverse * H - Matrix3::Identity()).norm(), tolerance(1e-10));
  }
}

TEST(Polar, NeverThrowsAndMarksWhatHasNoUniqueRotation) {
  std::mt19937 random(4);
  for (const Vector3& s : {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(1.5, 1.0, -1.0)}) {
    const Polar polar = polar_decomposition(with_stretches(s, random));
    EXPECT_TRUE(polar.is_degenerate);
    EXPECT_NEAR(polar.R.determinant(), 1.0, tolerance(1e-13));
    EXPECT_TRUE(polar.rate_inverse.allFinite());
    EXPECT_TRUE(rotation_derivative(polar, random_matrix(random)).allFinite());
  }
  const Polar polar = polar_decomposition(Matrix3::Constant(std::nan("")));
  EXPECT_TRUE(polar.is_degenerate);
  EXPECT_EQ(polar.R, Matrix3::Identity());
}

TEST(Polar, RotationDerivativeMatchesCentralDifferencesInEveryPose) {
  std::mt19937 random(5);
  for (const Vector3& s : stretches)
    for (int trial = 0; trial < 5; ++trial) {
      const Matrix3 F = with_stretches(s, random), dF = s.norm() * random_matrix(random);
      const Matrix3 dR = rotation_derivative(polar_decomposition(F), dF);
      ASSERT_GT(dR.norm(), 1e-3) << "nothing turns: the test would prove nothing";
      const auto along = [&](double h) -> VectorX { return polar_decomposition(F + h * dF).R.reshaped(); };
      // Truncation h^2 against rounding 1e-16 / h: 1e-9 at the bottom.
      EXPECT_LT(test::best_relative_error(along, dR.reshaped(), 1e-2), tolerance(1e-7)) << s.transpose();
      VectorX wrong = dR.reshaped();
      wrong *= 1.001;
      EXPECT_GT(test::best_relative_error(along, wrong, 1e-2), 1e-4) << "the check would not see a wrong derivative";
    }
}

TEST(Polar, RateAdjointIsTheTransposeOfTheRate) {
  std::mt19937 random(6);
  for (const Vector3& s : stretches) {
    const Polar polar = polar_decomposition(with_stretches(s, random));
    const Matrix3 dF = random_matrix(random);
    const Vector3 w_bar = random_matrix(random).col(0), w = rotation_rate(polar, dF);
    ASSERT_GT(w.norm(), 0.0);
    EXPECT_NEAR(w.dot(w_bar), rotation_rate_adjoint(polar, w_bar).cwiseProduct(dF).sum(),
                tolerance(1e-13) * w.norm() * w_bar.norm());
  }
}

TEST(Polar, SymmetricChangesDoNotTurn) {
  std::mt19937 random(7);
  const Matrix3 A = random_matrix(random);
  const Polar polar = polar_decomposition(with_stretches(stretches[1], random));
  EXPECT_LT(rotation_derivative(polar, polar.R * (A + A.transpose())).norm(), tolerance(1e-14) * 10);
}

}  // namespace
}  // namespace pliant::polar_test
