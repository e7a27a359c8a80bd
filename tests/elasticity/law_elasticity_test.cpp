#include "elasticity/law_elasticity.hpp"

#include <array>

#include "elasticity/material.hpp"
#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::law_elasticity_test {
namespace {

using test::tolerance;

std::shared_ptr<const OgdenLaw> foam(const Body& body) {
  MatrixX q(body.element_count(), 6);
  for (Eigen::Index e = 0; e < q.rows(); ++e) q.row(e) << 800.0 + 5.0 * double(e), 7.0, 0.2, 500.0, -5.0, 0.1;
  return std::make_shared<OgdenLaw>(q);
}

/// Laws whose tangents stand in different frames: of principal stretches, the world's and that of the rotation.
std::vector<std::shared_ptr<const MaterialLaw>> laws_in_every_frame(const Body& body) {
  MatrixX moduli(body.element_count(), 2);
  for (Eigen::Index e = 0; e < moduli.rows(); ++e) moduli.row(e) << 1500.0 + 5.0 * double(e), 700.0;
  return {foam(body), std::make_shared<NeoHookeanLaw>(moduli), std::make_shared<LinearLaw>(moduli)};
}

struct LawForces : ::testing::TestWithParam<bool> {
  LawForces()
      : body(test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, GetParam())), term(LawElasticity::make(body, foam(*body))) {
    x = test::deformed(body->nodes, 0.25);
    d = test::deformed(body->nodes, 0.6, -0.7);
  }
  Points gradient(const Points& at) {
    term->evaluate(at, false);
    Points g = Points::Zero(at.rows(), 3);
    term->add_gradient(g);
    return g;
  }
  std::shared_ptr<const Body> body;
  std::unique_ptr<LawElasticity> term;
  Points x, d;
};

TEST_P(LawForces, AreTheEnergysGradient) {
  const double derivative = gradient(x).cwiseProduct(d).sum();
  const auto along = [&](double h) { return VectorX::Constant(1, term->evaluate(x + h * d, false)); };
  EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, derivative), 0.01), tolerance(1e-7));
}

TEST_P(LawForces, HaveTheirExactStiffness) {
  for (const auto& law : laws_in_every_frame(*body)) {
    SCOPED_TRACE(law->name());
    term->set_law(law);
    term->evaluate(x, true);
    BlockMatrix K(body->pattern);
    term->add_stiffness(LawElasticity::Stiffness::Exact, 1.0, K);
    VectorX product;
    K.multiply(VectorX(flat(d)), product);
    const auto along = [&](double h) { return VectorX(flat(gradient(x + h * d))); };
    EXPECT_LT(test::best_relative_error(along, product, 0.01), tolerance(1e-7));
    term->evaluate(x, true);
    BlockMatrix positive(body->pattern);
    term->add_stiffness(LawElasticity::Stiffness::Positive, 1.0, positive);
    for (const auto which : {LawElasticity::Stiffness::Exact, LawElasticity::Stiffness::Positive}) {
      BlockMatrix& matrix = which == LawElasticity::Stiffness::Exact ? K : positive;
      matrix.multiply(VectorX(flat(d)), product);
      Points without = Points::Zero(d.rows(), 3);
      term->add_product(which, d, 2.0, without);
      EXPECT_LT((flat(without) - 2.0 * product).norm(), tolerance(1e-12) * product.norm());
    }
    const MatrixX P = test::dense(positive);
    EXPECT_GT(P.selfadjointView<Eigen::Lower>().eigenvalues()[0], -tolerance(1e-9) * P.norm());
  }
}

TEST_P(LawForces, ChangeWithTheLawsParameters) {
  const auto law = foam(*body);
  gradient(x);
  for (int k = 0; k < 6; ++k) {
    Points derivative = Points::Zero(x.rows(), 3);
    term->for_parameter_derivatives([&](int e, std::span<const int> nodes, const Eigen::Ref<const MatrixX>& by) {
      for (std::size_t a = 0; a < nodes.size(); ++a)  // elements' own parameters change by different amounts
        derivative.row(nodes[a]) += (1.0 + 0.1 * e) * by.col(k).segment<3>(3 * Eigen::Index(a)).transpose();
    });
    const auto along = [&](double h) {
      MatrixX q = law->table();
      for (Eigen::Index e = 0; e < q.rows(); ++e) q(e, k) += h * (1.0 + 0.1 * double(e));
      term->set_law(std::make_shared<OgdenLaw>(q));
      const VectorX g = flat(gradient(x));
      term->set_law(law);
      return g;
    };
    EXPECT_LT(test::best_relative_error(along, flat(derivative), k % 3 == 0 ? 1.0 : 0.01), tolerance(1e-7)) << k;
    gradient(x);
  }
}

TEST_P(LawForces, PassThePatchTest) {
  // An affine deformation of a homogeneous body leaves no force inside.
  MatrixX q(body->element_count(), 3);
  q.rowwise() = Eigen::RowVector3d(1000.0, 6.0, 0.3);
  term->set_law(std::make_shared<OgdenLaw>(q));
  Matrix3 A;
  A << 1.2, 0.1, 0.0, -0.2, 0.9, 0.1, 0.1, 0.0, 1.1;
  const Points g = gradient(body->nodes * A.transpose());
  const Vector3 half(0.1, 0.05, 0.06);
  for (Eigen::Index n = 0; n < g.rows(); ++n) {
    const Vector3 X = body->nodes.row(n).transpose().cwiseAbs();
    if (((half - X).array() > 1e-9).all()) {
      EXPECT_LT(g.row(n).norm(), tolerance(1e-12) * g.norm());
    }
  }
}

TEST_P(LawForces, AsAForceTermAreAffineAboutTheLagPoint) {
  for (const auto& law : laws_in_every_frame(*body)) {
    SCOPED_TRACE(law->name());
    term->set_law(law);
    term->linearise(x);
    Points f = Points::Zero(x.rows(), 3), moved = f;
    term->add_force(x, f);
    EXPECT_LT((f + gradient(x)).norm(), tolerance(1e-12) * f.norm());
    term->linearise(x);
    const Points z = x + 1e-3 * d;
    term->add_force(z, moved);
    BlockMatrix K(body->pattern);
    term->add_matrix(1.0, K);
    VectorX product;
    K.multiply(VectorX(flat(d)), product);
    EXPECT_LT((flat(moved) - flat(f) + 1e-3 * product).norm(), tolerance(1e-10) * product.norm());
  }
}

INSTANTIATE_TEST_SUITE_P(Tetrahedra, LawForces, ::testing::Values(false, true),
                         [](const auto& c) { return c.param ? "Quadratic" : "Linear"; });

TEST(LawElasticity, OfTheLinearLawIsCorotatedElasticity) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, false);
  const LambdaAlpha p = lambda_alpha({3000.0, 0.35});
  MatrixX q(body->element_count(), 2);
  q.rowwise() = Eigen::RowVector2d(p.lambda, p.alpha);
  const auto by_law = LawElasticity::make(body, std::make_shared<LinearLaw>(q));
  const MotionLayout layout;
  const auto corotated = make_elasticity(body, layout);
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 3000.0);
  theta[layout.poissons_ratio] = 0.35;
  corotated->set_parameters(theta);
  const Points x = test::deformed(body->nodes, 0.25);
  Points f = Points::Zero(x.rows(), 3), g = f;
  corotated->linearise(x);
  corotated->add_force(x, f);
  by_law->linearise(x);
  by_law->add_force(x, g);
  EXPECT_LT((f - g).norm(), tolerance(1e-10) * f.norm());
  EXPECT_NEAR(by_law->energy(x), corotated->energy(x), tolerance(1e-10) * corotated->energy(x));
}

/// A law of which nothing is known but what it says.
class AnyLaw : public MaterialLaw {
 public:
  explicit AnyLaw(std::shared_ptr<const MaterialLaw> law) : law_(std::move(law)) {}
  std::string name() const override { return law_->name(); }
  int element_count() const override { return law_->element_count(); }
  void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const override {
    law_->stress(element, F, with_tangent, out);
  }
  SmallStrainModuli small_strain(int element) const override { return law_->small_strain(element); }
  bool is_isotropic() const override { return false; }

 private:
  std::shared_ptr<const MaterialLaw> law_;
};

/// Principal stretches, two or three of which may be the same.
class Projected : public ::testing::TestWithParam<Vector3> {};

TEST_P(Projected, StiffnessOfIsotropicLawsIsThatOfAnyLaw) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {1, 1, 1}, true);
  const Matrix3 U = Eigen::AngleAxisd(0.7, Vector3(1.0, -2.0, 0.5).normalized()).toRotationMatrix();
  const Matrix3 V = Eigen::AngleAxisd(-1.9, Vector3(0.3, 0.4, 2.0).normalized()).toRotationMatrix();
  const Matrix3 F = U * GetParam().asDiagonal() * V.transpose();
  const Points x = body->nodes * F.transpose();
  MatrixX two(body->element_count(), 2);
  two.rowwise() = Eigen::RowVector2d(900.0, 300.0);
  const std::array<std::shared_ptr<const MaterialLaw>, 3> laws = {std::make_shared<NeoHookeanLaw>(two),
                                                                  std::make_shared<LinearLaw>(two), foam(*body)};
  for (const auto& law : laws) {
    const auto stiffness = [&](const std::shared_ptr<const MaterialLaw>& of, LawElasticity::Stiffness which) {
      const auto term = LawElasticity::make(body, of);
      term->evaluate(x, true);
      BlockMatrix K(body->pattern);
      term->add_stiffness(which, 2.0, K);
      return test::dense(K);
    };
    using enum LawElasticity::Stiffness;
    ASSERT_TRUE(law->is_isotropic());
    const MatrixX any = stiffness(std::make_shared<AnyLaw>(law), Positive);
    EXPECT_LT((stiffness(law, Positive) - any).norm(), tolerance(1e-12) * any.norm()) << law->name();
    if (GetParam().minCoeff() < 0.9) {
      EXPECT_GT((stiffness(law, Exact) - any).norm(), 1e-3 * any.norm()) << law->name() << ": nothing is left out";
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Stretches, Projected,
                         ::testing::Values(Vector3(1.0, 1.0, 1.0), Vector3(0.7, 0.8, 1.1), Vector3(0.6, 0.6, 0.6),
                                           Vector3(0.8, 0.8, 1.3), Vector3(0.7, 0.9, 0.9), Vector3(1.2, 1.5, 1.5)));

TEST(LawElasticity, RefusesOtherBodies) {
  const auto hexahedra = test::box_body({0.1, 0.1, 0.1}, 0.05);
  MatrixX q(hexahedra->element_count(), 2);
  q.rowwise() = Eigen::RowVector2d(1000.0, 100.0);
  EXPECT_THROW(Material{std::shared_ptr<const MaterialLaw>()}.make_elasticity(
                   test::tet_body({0.2, 0.1, 0.1}, {1, 1, 1}, false), {}),
               std::invalid_argument);
  EXPECT_THROW(LawElasticity::make(hexahedra, std::make_shared<LinearLaw>(q)), std::invalid_argument);
  EXPECT_THROW(LawElasticity::make(test::tet_body({0.2, 0.1, 0.1}, {1, 1, 1}, false), std::make_shared<LinearLaw>(q)),
               std::invalid_argument);
}

}  // namespace
}  // namespace pliant::law_elasticity_test
