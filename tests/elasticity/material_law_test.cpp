#include "elasticity/material_law.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "elasticity/mean_strain.hpp"
#include "elasticity/sampled_law.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::material_law_test {
namespace {

using test::tolerance;

LinearLaw linear_law(double E, double nu) {
  const LambdaAlpha p = lambda_alpha({E, nu});
  return LinearLaw(Eigen::RowVector2d(p.lambda, p.alpha));
}

/// Stress dW/dS of a law's first element at a strain.
Eigen::RowVectorXd stress_of(const MaterialLaw& law, const Eigen::RowVectorXd& strain) {
  PointStress at;
  law.stress(0, Matrix3::Identity() + tensor_of(strain.transpose()), false, at);
  return components_of(at.P).transpose();
}

/// Samples whose stress is no law's gradient, on top of Ogden's law.
std::shared_ptr<const MaterialLaw> sampled(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  MatrixX q(1, 3);
  q << 1000.0, 3.0, 0.25;
  std::vector<MaterialSample> samples(6);
  for (MaterialSample& sample : samples) {
    sample.strains.resize(1, 6);
    for (int k = 0; k < 6; ++k) sample.strains(0, k) = 0.15 * normal(random);
    const double stiffening = 1.0 + 8.0 * sample.strains.norm();
    sample.stresses = stress_of(linear_law(2000.0 * stiffening, 0.25 + 0.03 * normal(random)), sample.strains);
  }
  return sample_material(std::make_shared<OgdenLaw>(q), samples, {1e-3, 6}).law;
}

struct LawCase {
  std::string name;
  std::shared_ptr<const MaterialLaw> law;
  friend void PrintTo(const LawCase& c, std::ostream* out) { *out << c.name; }
};

std::vector<LawCase> laws() {
  MatrixX linear(1, 2), foam(1, 6), rubber(1, 3), cork(1, 3), gel(1, 2);
  const LambdaAlpha p = lambda_alpha({3000.0, 0.3});
  linear << p.lambda, p.alpha;
  foam << 800.0, 9.0, 0.2, 500.0, -6.0, 0.1;
  rubber << 1e5, 2.0, 0.49;
  cork << 1e5, -1.5, 0.0;
  gel << 1200.0, 2000.0;
  return {{"Linear", std::make_shared<LinearLaw>(linear)},
          {"Ogden", std::make_shared<OgdenLaw>(foam)},
          {"NearlyIncompressible", std::make_shared<OgdenLaw>(rubber)},
          {"WithoutPoissonsEffect", std::make_shared<OgdenLaw>(cork)},
          {"NeoHookean", std::make_shared<NeoHookeanLaw>(gel)},
          {"Sampled", sampled(3)}};
}

Matrix3 generic(double amount) {
  Matrix3 H;
  H << 0.3, -0.5, 0.2, 0.4, -0.6, 0.1, -0.2, 0.7, 0.5;
  return Eigen::AngleAxisd(1.3, Vector3(0.3, -0.8, 0.5).normalized()).toRotationMatrix() *
         (Matrix3::Identity() + amount * H);
}

VectorX vec(const Matrix3& m) { return Eigen::Map<const VectorX>(m.data(), 9); }

struct Law : ::testing::TestWithParam<LawCase> {
  PointStress at(const Matrix3& F, bool with_tangent = false) const {
    PointStress s;
    GetParam().law->stress(0, F, with_tangent, s);
    return s;
  }
};

TEST_P(Law, StressIsTheEnergysGradient) {
  for (const double amount : {0.02, 0.3}) {
    const Matrix3 F = generic(amount), dF = generic(0.9);
    const double derivative = at(F).P.cwiseProduct(dF).sum();
    const auto along = [&](double h) { return VectorX::Constant(1, at(F + h * dF).energy); };
    EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, derivative), 0.1), tolerance(1e-7));
  }
}

TEST_P(Law, TangentIsTheStressesDerivative) {
  std::vector<Matrix3> places = {generic(0.02), generic(0.3), Matrix3::Identity()};
  places.push_back(Vector3(1.2, 1.2, 0.9).asDiagonal());  // two stretches meet
  for (const Matrix3& F : places) {
    const PointStress s = at(F, true);
    for (int k = 0; k < 9; ++k) {
      Matrix3 dF = Matrix3::Zero();
      dF.data()[k] = 1.0;
      const Matrix3 local = s.left.transpose() * dF * s.right;
      const VectorX turned = s.tangent * vec(local);
      const Matrix3 dP = s.left * Eigen::Map<const Matrix3>(turned.data()) * s.right.transpose();
      const auto along = [&](double h) { return vec(at(F + h * dF).P); };
      EXPECT_LT(test::best_relative_error(along, vec(dP), 0.1), tolerance(3e-7)) << k;
    }
    EXPECT_LT((s.tangent - s.tangent.transpose()).norm(), tolerance(1e-12) * s.tangent.norm());
  }
}

TEST_P(Law, ParametersMoveTheStressAsTheirDerivativesSay) {
  const auto* table = dynamic_cast<const TabulatedLaw*>(GetParam().law.get());
  if (!table) GTEST_SKIP() << "nothing of it is estimated";
  const Matrix3 F = generic(0.3);
  std::vector<Matrix3> derivatives(table->parameter_names().size());
  table->parameter_derivatives(0, F, derivatives);
  for (std::size_t k = 0; k < derivatives.size(); ++k) {
    const auto along = [&](double h) {
      MatrixX changed = table->table();
      changed(0, Eigen::Index(k)) += h;
      PointStress s;
      if (table->name() == "linear")
        LinearLaw(changed).stress(0, F, false, s);
      else if (table->name() == "neo_hookean")
        NeoHookeanLaw(changed).stress(0, F, false, s);
      else
        OgdenLaw(changed).stress(0, F, false, s);
      return vec(s.P);
    };
    const double scale = 0.01 * std::max(1e-2, std::abs(table->table()(0, Eigen::Index(k))));
    EXPECT_LT(test::best_relative_error(along, vec(derivatives[k]), scale), tolerance(1e-7)) << k;
  }
}

TEST_P(Law, TangentDerivativeIsThatOfTheTangent) {
  const Matrix3 F = generic(0.3), dF = generic(0.9);
  const Matrix9 change = GetParam().law->tangent_derivative(0, F, dF);
  ASSERT_GT(change.norm(), 0.0);
  EXPECT_LT((change - change.transpose()).norm(), tolerance(1e-9) * change.norm());
  const auto along = [&](double h) -> VectorX { return world_tangent(at(F + h * dF, true)).reshaped(); };
  EXPECT_LT(test::best_relative_error(along, change.reshaped(), 0.1), tolerance(1e-7));
  EXPECT_TRUE(GetParam().law->tangent_derivative(0, F, Matrix3::Zero()).isZero(0.0));
  // The same along three directions in any order: it is the energy's third derivative.
  const Matrix3 A = generic(-0.4), B = generic(0.6);
  const double one = vec(A).dot(change * vec(B));
  const double other = vec(dF).dot(GetParam().law->tangent_derivative(0, F, A) * vec(B));
  EXPECT_NEAR(one, other, tolerance(1e-7) * change.norm() * A.norm() * B.norm());
}

TEST_P(Law, ParameterDerivativesChangeAsTheirDerivativesSay) {
  const MaterialLaw& law = *GetParam().law;
  const std::size_t count = law.parameter_names().size();
  if (count == 0) GTEST_SKIP() << "nothing of it is estimated";
  const Matrix3 F = generic(0.3), dF = generic(0.9);
  std::vector<Matrix3> changes(count), there(count);
  law.parameter_derivative_changes(0, F, dF, changes);
  for (std::size_t k = 0; k < count; ++k) {
    const auto along = [&](double h) {
      law.parameter_derivatives(0, F + h * dF, there);
      return vec(there[k]);
    };
    EXPECT_LT(test::best_relative_error(along, vec(changes[k]), 0.1), tolerance(1e-7)) << k;
  }
}

TEST_P(Law, IsTheSameInEveryRotatedFrame) {
  const Matrix3 F = generic(0.3), R = Eigen::AngleAxisd(2.1, Vector3(1, 2, -1).normalized()).toRotationMatrix();
  EXPECT_NEAR(at(R * F).energy, at(F).energy, tolerance(1e-12) * at(F).energy);
  EXPECT_LT((at(R * F).P - R * at(F).P).norm(), tolerance(1e-11) * at(F).P.norm());
}

TEST_P(Law, IsFreeOfStressAtRestAndLinearNearby) {
  EXPECT_NEAR(at(Matrix3::Identity()).P.norm(), 0.0, 1e-12);
  const SmallStrainModuli m = GetParam().law->small_strain(0);
  const LambdaAlpha p = lambda_alpha(m);
  const double h = 1e-6;
  Matrix3 strain;
  strain << 1.0, 0.3, -0.2, 0.3, -0.5, 0.4, -0.2, 0.4, 0.7;
  Matrix3 expected = (p.lambda - 2.0 * p.alpha) * strain;
  expected.diagonal().array() += p.alpha * strain.trace();
  const Matrix3 P = at(Matrix3::Identity() + h * strain).P / h;
  if (GetParam().name != "Sampled") {  // that is not isotropic
    EXPECT_LT((P - expected).norm(), tolerance(1e-3) * expected.norm());
  }
  // What is isotropic of the stiffness: 9 K of a change of volume, 3 K + 10 G over all strains of length 1.
  const double K = m.youngs_modulus / (3.0 * (1.0 - 2.0 * m.poissons_ratio)),
               G = m.youngs_modulus / (2.0 * (1.0 + m.poissons_ratio));
  const auto work = [&](const Matrix3& e) {
    return (at(Matrix3::Identity() + h * e).P - at(Matrix3::Identity() - h * e).P).cwiseProduct(e).sum() / (2.0 * h);
  };
  EXPECT_NEAR(work(Matrix3::Identity()), 9.0 * K, tolerance(1e-4) * K);
  double sum = 0.0;
  for (int k = 0; k < 6; ++k) sum += work(tensor_of(from_mandel(Strain6::Unit(k))));
  EXPECT_NEAR(sum, 3.0 * K + 10.0 * G, tolerance(1e-4) * (K + G));
}

TEST_P(Law, ClosedPathsOfStrainTakeAndGiveNoWork) {
  // A loop in the plane of two deformations, far beyond what was sampled; the trapezoidal rule is exact for periodic
  // smooth integrands.
  const Matrix3 A = generic(0.0).transpose() * generic(0.25) - Matrix3::Identity();
  Matrix3 B;
  B << -0.1, 0.3, 0.0, 0.1, 0.2, -0.2, 0.3, 0.0, 0.1;
  double work = 0.0, size = 0.0;
  const int steps = 4000;
  for (int k = 0; k < steps; ++k) {
    const double s = 2.0 * M_PI * k / steps;
    const Matrix3 F = Matrix3::Identity() + std::sin(s) * A + (1.0 - std::cos(s)) * 0.7 * B;
    const Matrix3 dF = (std::cos(s) * A + std::sin(s) * 0.7 * B) * (2.0 * M_PI / steps);
    const double part = at(F).P.cwiseProduct(dF).sum();
    work += part, size += std::abs(part);
  }
  EXPECT_LT(std::abs(work), tolerance(1e-7) * size);
}

INSTANTIATE_TEST_SUITE_P(All, Law, ::testing::ValuesIn(laws()), [](const auto& c) { return c.param.name; });

/// Deformations of all kinds, equal stretches, tiny and large ones among them, and two that no law knows.
std::vector<Matrix3> many_deformations() {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  std::vector<Matrix3> all = {Matrix3::Identity(),
                              1.5 * Matrix3::Identity(),
                              Vector3(2.0, 0.7, 2.0).asDiagonal(),
                              Vector3(1e-3, 1.0, 40.0).asDiagonal(),
                              Matrix3::Zero(),
                              Vector3(1.0, 1.0, -1.0).asDiagonal(),
                              Matrix3::Identity() + 1e-9 * Matrix3::Ones()};
  for (const double size : {1e-12, 1e-5, 0.1, 0.6})
    for (int k = 0; k < 5; ++k) {
      const Matrix3 R = Eigen::AngleAxisd(normal(random), Vector3(1.0, 2.0, -1.0).normalized()).matrix();
      all.emplace_back(R * (Matrix3::Identity() + size * Matrix3::NullaryExpr([&] { return normal(random); })));
      if (all.back().determinant() < 0.0) all.back().col(0) *= -1.0;
    }
  return all;
}

TEST(PrincipalStretches, FoundBesideEachOtherAreThoseOfEachAlone) {
  const std::vector<Matrix3> all = many_deformations();
  for (std::size_t first = 0; first < all.size(); first += 5) {
    std::vector<const Matrix3*> F;
    for (std::size_t k = first; k < std::min(first + 5, all.size()); ++k) F.push_back(&all[k]);
    std::vector<PrincipalStretches> found(F.size());
    PrincipalStretches::find(F, found);
    for (std::size_t k = 0; k < F.size(); ++k) {
      const PrincipalStretches alone(*F[k]);
      ASSERT_EQ(found[k].is_valid, alone.is_valid) << first + k;
      if (!alone.is_valid) continue;
      const PrincipalStretches& p = found[k];
      EXPECT_LT((p.stretch - alone.stretch).norm(), tolerance(1e-12) * alone.stretch.norm()) << first + k;
      EXPECT_LT((p.U * p.stretch.asDiagonal() * p.V.transpose() - *F[k]).norm(), tolerance(1e-14) * F[k]->norm());
      EXPECT_LT((p.V.transpose() * p.V - Matrix3::Identity()).norm(), tolerance(1e-14)) << first + k;
      EXPECT_TRUE(std::ranges::is_sorted(p.stretch)) << first + k;
    }
  }
}

TEST(OgdenLaw, StressesOfSeveralPointsAreThoseOfEach) {
  const OgdenLaw law(
      (MatrixX(2, 6) << 1500.0, 8.0, 0.2, 1500.0, -6.0, 0.15, 900.0, 3.0, 0.4, 100.0, -2.0, 0.0).finished());
  const std::vector<Matrix3> all = many_deformations();
  std::vector<PointStress> found(all.size());
  std::vector<DeformedPoint> points;
  for (std::size_t k = 0; k < all.size(); ++k) points.push_back({int(k % 2), &all[k], &found[k]});
  law.stresses(points, true);
  for (std::size_t k = 0; k < all.size(); ++k) {
    PointStress alone;
    law.stress(int(k % 2), all[k], true, alone);
    if (!std::isfinite(alone.energy)) {
      EXPECT_EQ(found[k].energy, alone.energy) << k;
      continue;
    }
    const Matrix9 tangent = world_tangent(alone);
    EXPECT_NEAR(found[k].energy, alone.energy, tolerance(1e-11) * alone.energy + 1e-18 * tangent.norm()) << k;
    EXPECT_LT((found[k].P - alone.P).norm(), tolerance(1e-11) * alone.P.norm() + 1e-14 * tangent.norm()) << k;
    EXPECT_LT((world_tangent(found[k]) - tangent).norm(), tolerance(1e-10) * tangent.norm()) << k;
  }
}

TEST(OgdenLaw, HasTheStressOfAUniaxialStretchByHand) {
  // Uniaxial stretch of one term with nu = 0: P = 2 mu / a (l^(a-1) - 1/l), by hand.
  MatrixX q(1, 3);
  q << 1000.0, 4.0, 0.0;
  const OgdenLaw law(q);
  PointStress s;
  law.stress(0, Vector3(1.5, 1.0, 1.0).asDiagonal(), false, s);
  EXPECT_NEAR(s.P(0, 0), 500.0 * (std::pow(1.5, 3) - 1.0 / 1.5), 1e-9);
  EXPECT_NEAR(s.P(1, 1), 0.0, 1e-10);
}

TEST(OgdenLaw, RefusesWhatIsNotAMaterial) {
  MatrixX q(1, 3);
  q << -1.0, 2.0, 0.3;
  EXPECT_THROW(OgdenLaw{q}, std::invalid_argument);
  q << 1.0, 2.0, 0.5;
  EXPECT_THROW(OgdenLaw{q}, std::invalid_argument);
}

TEST(OgdenLaw, HasNoElementsInsideOut) {
  PointStress s;
  laws()[1].law->stress(0, Vector3(1.0, 1.0, -0.5).asDiagonal(), true, s);
  EXPECT_EQ(s.energy, std::numeric_limits<double>::infinity());
}

TEST(NeoHookeanLaw, HasTheStressOfASimpleShearByHand) {
  // F = I + g e_x e_y^T keeps volumes: P = mu (F - cof F), so P_xy = mu g, P_yx = mu g and no other is left.
  MatrixX q(1, 2);
  q << 1000.0, 3000.0;
  const NeoHookeanLaw law(q);
  Matrix3 F = Matrix3::Identity();
  F(0, 1) = 0.4;
  PointStress s;
  law.stress(0, F, false, s);
  Matrix3 expected = Matrix3::Zero();
  expected(0, 1) = expected(1, 0) = 400.0;
  EXPECT_LT((s.P - expected).norm(), tolerance(1e-10));
  EXPECT_NEAR(s.energy, 0.5 * 1000.0 * 0.16, tolerance(1e-10));
}

/// One energy, whether it is that of an element's mean or of a point.
TEST(NeoHookeanLaw, IsThatOfTheMeanStrain) {
  const UnitLame lame = unit_lame(0.37);
  const NeoHookeanLaw law(MatrixX{{5.0 * lame.mu, 5.0 * lame.lambda}});
  Matrix3 F;
  F << 1.1, 0.3, -0.2, 0.1, 0.7, 0.25, -0.15, 0.2, 1.3;
  const Polar polar = polar_decomposition(F);
  const MeanStrainCorrection mean(F, polar, lame);
  const Matrix3 strain = polar.S - Matrix3::Identity();
  const Matrix3 corotated = polar.R * (2.0 * lame.mu * strain + lame.lambda * strain.trace() * Matrix3::Identity());
  PointStress s;
  law.stress(0, F, true, s);
  EXPECT_LT((s.P - 5.0 * (corotated + mean.stress())).norm(), tolerance(1e-12) * s.P.norm());
  EXPECT_NEAR(s.energy,
              5.0 * (mean.energy() + lame.mu * strain.squaredNorm() + 0.5 * lame.lambda * std::pow(strain.trace(), 2)),
              tolerance(1e-12));
}

TEST(NeoHookeanLaw, RefusesWhatIsNotAMaterial) {
  MatrixX q(1, 2);
  q << -1.0, 2.0;
  EXPECT_THROW(NeoHookeanLaw{q}, std::invalid_argument);
  q << 3.0, -2.0;
  EXPECT_THROW(NeoHookeanLaw{q}, std::invalid_argument);
  EXPECT_THROW(NeoHookeanLaw(MatrixX::Ones(1, 3)), std::invalid_argument);
}

TEST(LambdaAlpha, AndModuliAreTheSame) {
  const LambdaAlpha p = lambda_alpha({1234.0, 0.31});
  EXPECT_NEAR(moduli_of(p).youngs_modulus, 1234.0, 1e-9);
  EXPECT_NEAR(moduli_of(p).poissons_ratio, 0.31, 1e-12);
}

// ---- sampled

/// Strains of many directions, and the stresses that a law has there.
std::vector<MaterialSample> samples_of(const MaterialLaw& truth, int count, double size, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<MaterialSample> samples;
  while (int(samples.size()) < count) {
    Eigen::RowVectorXd strain(6);
    for (int k = 0; k < 6; ++k) strain[k] = normal(random);
    strain *= size * double(samples.size() + 1) / double(count) / strain.norm();
    samples.push_back({strain, stress_of(truth, strain)});
  }
  return samples;
}

std::shared_ptr<const TabulatedLaw> shared_law() {
  MatrixX q(1, 3);
  q << 1000.0, 3.0, 0.25;
  return std::make_shared<OgdenLaw>(q);
}

OgdenLaw foam() {
  MatrixX q(1, 6);
  q << 2500.0, 4.0, 0.3, 1500.0, -6.0, 0.1;
  return OgdenLaw(q);
}

double relative_error(const MaterialLaw& law, const MaterialLaw& truth, const Eigen::RowVectorXd& strain) {
  const Eigen::RowVectorXd expected = stress_of(truth, strain);
  return (stress_of(law, strain) - expected).norm() / expected.norm();
}

TEST(SampledLaw, MeetsItsSamplesAndWhatLiesBetweenThem) {
  const OgdenLaw truth = foam();
  const std::vector<MaterialSample> samples = samples_of(truth, 48, 0.4);
  const SampledMaterial material = sample_material(shared_law(), samples, {1e-3, 48});
  double greatest = 0.0;
  for (const MaterialSample& s : samples) greatest = std::max(greatest, s.stresses.norm());
  for (const MaterialSample& s : samples)
    EXPECT_LT((stress_of(*material.law, s.strains) - s.stresses).norm(), 0.01 * greatest);
  EXPECT_LT(material.stress_misfit, 0.004);
  // What no sample showed: better than the element's law alone, though six dimensions are wide.
  double error = 0.0, of_law = 0.0;
  for (const MaterialSample& s : samples_of(truth, 100, 0.3, 11)) {
    error += (stress_of(*material.law, s.strains) - s.stresses).squaredNorm();
    of_law += (stress_of(material.law->law(), s.strains) - s.stresses).squaredNorm();
  }
  EXPECT_LT(std::sqrt(error), 0.7 * std::sqrt(of_law));
}

/// A law of the same form finds its numbers, whatever the shared ones are, and goes on with them.
TEST(SampledLaw, HasAnElementsOwnNumbersWhereSamplesTell) {
  MatrixX q(1, 3);
  q << 2700.0, 8.0, 0.35;
  const OgdenLaw truth(q);
  const SampledMaterial material = sample_material(shared_law(), samples_of(truth, 30, 0.3));
  EXPECT_EQ(material.mean_samples, 0.0);
  EXPECT_LT((material.law->law().table() - q).cwiseQuotient(q).norm(), 0.03);
}

/// Twice as far as any sample: where stiffness that is interpolated levels off, the block would be much too soft.
TEST(SampledLaw, GoesOnBeyondItsSamples) {
  const OgdenLaw truth = foam();
  MatrixX q(1, 6);
  q << 1500.0, 3.0, 0.25, 1000.0, -4.0, 0.15;
  const SampledMaterial material = sample_material(std::make_shared<OgdenLaw>(q), samples_of(truth, 40, 0.2));
  for (const double pressed : {-0.3, -0.4, -0.45, 0.4}) {
    const Eigen::RowVectorXd strain = (Eigen::RowVectorXd(6) << 0.02, pressed, 0.01, 0.05, 0.0, 0.02).finished();
    const double error = relative_error(*material.law, truth, strain);
    EXPECT_LT(error, 0.12) << pressed;
    // With the secant stiffness of half that strain.
    const Eigen::RowVectorXd levelled = 2.0 * stress_of(truth, 0.5 * strain);
    const Eigen::RowVectorXd expected = stress_of(truth, strain);
    EXPECT_LT(error, 0.5 * (levelled - expected).norm() / expected.norm()) << pressed;
  }
}

TEST(SampledLaw, IsPassiveAndFadesFarFromItsSamples) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto law = std::dynamic_pointer_cast<const SampledLaw>(sampled(seed));
    const StressSamples& samples = law->samples(0);
    ASSERT_FALSE(samples.strains.empty());
    double greatest = 0.0;
    for (const Strain6& strain : samples.strains) greatest = std::max(greatest, strain.norm());
    for (int k = 0; k < 200; ++k) {
      Eigen::RowVectorXd strain(6);
      for (int i = 0; i < 6; ++i) strain[i] = normal(random) * (k % 2 ? 0.1 : 0.5);
      const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(tensor_of(strain.transpose()));
      if (eigen.eigenvalues()[0] < -0.9) continue;  // all but inside out
      const Strain6 all = to_mandel(stress_of(*law, strain).transpose()), e = to_mandel(strain.transpose());
      EXPECT_GT(all.dot(e), 0.0) << strain;
    }
    // Stress on top of the element's law falls with distance.
    for (int k = 0; k < 20; ++k) {
      const Matrix3 root = Matrix3::NullaryExpr([&] { return normal(random); });
      // Tension: no element turns inside out.
      const Eigen::RowVectorXd strain = components_of(root * root.transpose()).transpose();
      const auto on_top = [&](double size) {
        const Eigen::RowVectorXd at = size / strain.norm() * strain;
        return (stress_of(*law, at) - stress_of(law->law(), at)).norm();
      };
      EXPECT_LT(on_top(40.0 * greatest), 0.6 * on_top(20.0 * greatest));
    }
  }
}

TEST(SampledLaw, ErrorFallsAsTheBasisGrows) {
  const std::vector<MaterialSample> samples = samples_of(foam(), 30, 0.4);
  const SampledMaterial material = sample_material(shared_law(), samples, {1e-9, 10});
  ASSERT_EQ(material.error_by_size.size(), 11u);
  for (std::size_t k = 1; k <= 10; ++k) EXPECT_LT(material.error_by_size[k], 1.02 * material.error_by_size[k - 1]);
  EXPECT_LT(material.error_by_size[10], 0.5 * material.error_by_size[0]);
  EXPECT_THROW((void)sample_material(shared_law(), {}), std::invalid_argument);
}

/// At rest it is Young's modulus, however the object is turned; a linear law's stays so.
TEST_P(Law, TangentModulusBeginsAsYoungsModulus) {
  if (GetParam().name == "Sampled") GTEST_SKIP() << "not isotropic";
  const double E = GetParam().law->small_strain(0).youngs_modulus;
  Matrix3 F = generic(0.0);
  EXPECT_NEAR(tangent_modulus(*GetParam().law, 0, F), E, tolerance(1e-6) * E);
  if (GetParam().name != "Linear") return;
  F = generic(0.3);
  EXPECT_NEAR(tangent_modulus(*GetParam().law, 0, F), E, tolerance(1e-9) * E);
}

/// Stretched along one axis, free across: the slope of the force by the stretch, by central differences. Of isotropic
/// laws: another one shears.
TEST_P(Law, TangentModulusIsTheSlopeOfATensionTest) {
  if (GetParam().name == "Sampled") GTEST_SKIP() << "not isotropic";
  const auto pulled = [&](double stretch) {  // deformation without stress across
    const double nu = GetParam().law->small_strain(0).poissons_ratio;
    Vector3 across(stretch, std::pow(stretch, -nu), std::pow(stretch, -nu));
    for (int i = 0; i < 50; ++i) {
      const PointStress s = at(across.asDiagonal(), true);
      const Matrix9 tangent = world_tangent(s);
      Eigen::Matrix2d slope;
      slope << tangent(4, 4), tangent(4, 8), tangent(8, 4), tangent(8, 8);
      across.tail<2>() -= slope.inverse() * Eigen::Vector2d(s.P(1, 1), s.P(2, 2));
    }
    return across;
  };
  for (const double stretch : {0.8, 1.15}) {
    const auto force = [&](double l) { return at(pulled(l).asDiagonal()).P(0, 0); };
    const double h = 1e-5, slope = (force(stretch + h) - force(stretch - h)) / (2.0 * h);
    const Matrix3 turned = generic(0.0) * Matrix3(pulled(stretch).asDiagonal());
    EXPECT_NEAR(tangent_modulus(*GetParam().law, 0, turned), slope, tolerance(2e-5) * slope) << stretch;
  }
}

TEST_P(Law, AScaledOneIsAsMuchStiffer) {
  const auto scaled = scaled_law(GetParam().law, 2.5);
  const Matrix3 F = generic(0.2), dF = generic(0.9);
  const PointStress one = at(F, true);
  PointStress other;
  scaled->stress(0, F, true, other);
  EXPECT_NEAR(other.energy, 2.5 * one.energy, 1e-12 * std::abs(other.energy));
  EXPECT_LT((other.P - 2.5 * one.P).norm(), 1e-12 * other.P.norm());
  EXPECT_LT((world_tangent(other) - 2.5 * world_tangent(one)).norm(), 1e-12 * other.tangent.norm());
  EXPECT_LT((scaled->tangent_derivative(0, F, dF) - 2.5 * GetParam().law->tangent_derivative(0, F, dF)).norm(),
            1e-9 * one.tangent.norm());
  EXPECT_NEAR(scaled->small_strain(0).youngs_modulus, 2.5 * GetParam().law->small_strain(0).youngs_modulus, 1e-6);
  EXPECT_EQ(scaled_law(GetParam().law, 1.0), GetParam().law);
  EXPECT_THROW((void)scaled_law(GetParam().law, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::material_law_test
