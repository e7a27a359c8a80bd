#include "elasticity/hex_element.hpp"

#include <random>

#include "elasticity/body.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/eigenvalues.hpp"
#include "support/tolerance.hpp"

namespace pliant::hex_element_test {
namespace {

using test::tolerance;

constexpr double h = 0.05;
using Vector24 = Eigen::Matrix<double, 24, 1>;

/// A full cell, and cells cut by a sphere with neighbours' slivers merged into them.
std::vector<CellQuadrature> cells() {
  const HexGrid grid = test::sphere_grid(0.1, h, {}, Vector3(0.3, 0.1, 0.45));
  std::vector<CellQuadrature> list;
  for (int e = 0; e < grid.cell_count(); e += 5) list.push_back(grid.quadrature[e]);
  CellQuadrature full;
  for (const double x : {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)})
    for (const double y : {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)})
      for (const double z : {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)}) full.add(Vector3(x, y, z), 0.125);
  list.push_back(full);
  return list;
}

Vector24 nodal(const std::function<Vector3(const Vector3&)>& field) {
  Vector24 u;
  for (int a = 0; a < 8; ++a) u.segment<3>(3 * a) = field(h * Vector3(a & 1, a >> 1 & 1, a >> 2 & 1));
  return u;
}

class HexElement : public ::testing::TestWithParam<HexFormulation> {};

TEST_P(HexElement, HasSixRigidModesAndIsOtherwisePositive) {
  for (const CellQuadrature& q : cells()) {
    const Matrix24 K = hex_stiffness(q, h, 0.3, GetParam()).value;
    const double scale = K.norm();
    EXPECT_LT((K - K.transpose()).norm(), tolerance(1e-14) * scale);
    for (int d = 0; d < 3; ++d) {
      EXPECT_LT((K * nodal([&](const Vector3&) -> Vector3 { return Vector3::Unit(d); })).norm(),
                tolerance(1e-13) * scale);
      EXPECT_LT((K * nodal([&](const Vector3& p) -> Vector3 { return Vector3::Unit(d).cross(p) / h; })).norm(),
                tolerance(1e-13) * scale);
    }
    const VectorX eigenvalues = test::eigenvalues(K);
    EXPECT_GT(eigenvalues[0], -tolerance(1e-13) * scale);
    EXPECT_GT(eigenvalues[6], 1e-6 * scale) << "a zero-energy mode that is not rigid";
  }
}

TEST_P(HexElement, PatchTest) {
  Matrix3 gradient;
  gradient << 0.3, -0.2, 0.5, 0.1, -0.4, 0.25, 0.7, 0.35, 0.15;
  for (const double nu : {0.0, 0.3, 0.49}) {
    const UnitLame c = unit_lame(nu);
    const Matrix3 strain = 0.5 * (gradient + gradient.transpose());
    const Matrix3 stress = c.lambda * strain.trace() * Matrix3::Identity() + 2 * c.mu * strain;
    const Vector24 u = nodal([&](const Vector3& p) -> Vector3 { return gradient * p; });
    for (const CellQuadrature& q : cells()) {
      const Vector24 force = hex_stiffness(q, h, nu, GetParam()).value * u;
      const auto mean = hex_mean_gradients(q, h);
      const double volume = q.volume_fraction() * h * h * h;
      Vector24 expected;  // virtual work of a constant stress: V sigma grad N
      for (int a = 0; a < 8; ++a) expected.segment<3>(3 * a) = volume * stress * mean.row(a).transpose();
      ASSERT_GT(expected.norm(), 0.0);
      EXPECT_LT((force - expected).norm(), tolerance(1e-11) * expected.norm());
      EXPECT_NEAR(u.dot(force), volume * stress.cwiseProduct(strain).sum(), tolerance(1e-11) * std::abs(u.dot(force)));
    }
  }
}

TEST_P(HexElement, DerivativeByPoissonsRatioMatchesCentralDifferences) {
  for (const CellQuadrature& q : cells())
    for (const double nu : {0.1, 0.35, 0.48}) {
      const Matrix24 dK = hex_stiffness(q, h, nu, GetParam()).d_poissons_ratio;
      ASSERT_GT(dK.norm(), 0.0);
      const auto along = [&](double step) -> VectorX {
        return hex_stiffness(q, h, nu + step, GetParam()).value.reshaped();
      };
      EXPECT_LT(test::best_relative_error(along, dK.reshaped(), 0.1), tolerance(1e-8));
    }
}

INSTANTIATE_TEST_SUITE_P(Formulations, HexElement,
                         ::testing::Values(HexFormulation::IncompatibleModes, HexFormulation::Trilinear));

/// Energy of pure bending, u_x = x y, u_y = -x^2 / 2 about the cell's middle, over the beam's: 1 where nothing locks.
double bending_energy_ratio(HexFormulation formulation, double nu) {
  const Vector24 u = nodal([](const Vector3& p) {
    const Vector3 s = p - Vector3::Constant(0.5 * h);
    return Vector3(s.x() * s.y(), 0.0, 0.0);  // the parabola vanishes at the nodes up to a translation
  });
  const double exact = 0.5 * std::pow(h, 5) / 12.0 * 1.0;  // 1/2 E integral y^2, free to contract sideways
  return 0.5 * u.dot(hex_stiffness(cells().back(), h, nu, formulation).value * u) / exact;
}

TEST(HexFormulation, IncompatibleModesBendWithoutLocking) {
  for (const double nu : {0.0, 0.3, 0.49}) {
    // A plate's 1 / (1 - nu^2) at most: sideways the cell cannot take up the anticlastic curve at its nodes.
    EXPECT_GT(bending_energy_ratio(HexFormulation::IncompatibleModes, nu), 1.0 - 1e-9);
    EXPECT_LT(bending_energy_ratio(HexFormulation::IncompatibleModes, nu), 1.0 / (1.0 - nu * nu) + 1e-9);
    EXPECT_GT(bending_energy_ratio(HexFormulation::Trilinear, nu), 1.4);
  }
  EXPECT_GT(bending_energy_ratio(HexFormulation::Trilinear, 0.49), 10.0);
}

TEST(HexMass, IsTheVolumeAndReproducesMoments) {
  for (const CellQuadrature& q : cells()) {
    const Matrix8 M = hex_mass(q, h);
    const double volume = q.volume_fraction() * h * h * h;
    EXPECT_NEAR(M.sum(), volume, tolerance(1e-14) * h * h * h);
    EXPECT_LT((M - M.transpose()).norm(), tolerance(1e-18));
    Vector3 moment = Vector3::Zero(), first = Vector3::Zero();
    for (int a = 0; a < 8; ++a) moment += M.row(a).sum() * h * Vector3(a & 1, a >> 1 & 1, a >> 2 & 1);
    for (int n = 0; n < CellQuadrature::count; ++n) first += q.weights[n] * h * h * h * h * CellQuadrature::points()[n];
    EXPECT_LT((moment - first).norm(), tolerance(1e-14) * volume * h);
  }
}

TEST(HexMeanGradients, GiveTheMeanDeformationGradient) {
  Matrix3 F;
  F << 1.3, -0.2, 0.5, 0.1, 0.7, 0.25, 0.7, 0.35, 1.15;
  const Vector24 x = nodal([&](const Vector3& p) -> Vector3 { return F * p + Vector3(1, 2, 3); });
  for (const CellQuadrature& q : cells()) {
    const auto g = hex_mean_gradients(q, h);
    Matrix3 mean = Matrix3::Zero();
    for (int a = 0; a < 8; ++a) mean += x.segment<3>(3 * a) * g.row(a);
    EXPECT_LT((mean - F).norm(), tolerance(1e-11));
  }
}

TEST(UnitLame, DerivativesMatchCentralDifferences) {
  for (const double nu : {0.05, 0.3, 0.49}) {
    const UnitLame c = unit_lame(nu);
    const auto along = [&](double step) -> VectorX {
      const UnitLame d = unit_lame(nu + step);
      return Eigen::Vector2d(d.lambda, d.mu);
    };
    EXPECT_LT(test::best_relative_error(along, Eigen::Vector2d(c.d_lambda, c.d_mu), 0.1), tolerance(1e-9));
    EXPECT_NEAR(c.mu * (3 * c.lambda + 2 * c.mu) / (c.lambda + c.mu), 1.0, tolerance(1e-12))
        << "Young's modulus is one";
    EXPECT_NEAR(0.5 * c.lambda / (c.lambda + c.mu), nu, tolerance(1e-12));
  }
}

TEST(Body, MassIsDensityTimesVolumeConsistentAndLumped) {
  for (const MassKind kind : {MassKind::Consistent, MassKind::Lumped}) {
    BodyOptions options;
    options.mass = kind;
    const Body body = make_body(test::sphere_grid(0.1, 0.04, {}, Vector3(0.2, 0.1, 0.4)), options);
    const Points ones = Points::Ones(body.node_count(), 3);
    Points sum = Points::Zero(body.node_count(), 3);
    body.add_mass_product(2.0, ones, sum);
    EXPECT_NEAR(sum.col(0).sum(), 2.0 * body.volume(), tolerance(1e-13) * body.volume());
    int off_diagonal = 0;
    for (int row = 0; row < body.pattern->rows; ++row)
      for (int b = body.pattern->row_start[row]; b < body.pattern->row_start[row + 1]; ++b)
        if (body.pattern->column[b] != row) off_diagonal += body.mass[b] != 0.0;
    if (kind == MassKind::Lumped) {
      EXPECT_EQ(off_diagonal, 0);
      EXPECT_GT(sum.minCoeff(), 0.0) << "a lumped mass that is not positive";
    } else {
      EXPECT_GT(off_diagonal, 0);
    }
  }
}

}  // namespace
}  // namespace pliant::hex_element_test
