#include "elasticity/material_field.hpp"

#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::material_field_test {
namespace {

using test::tolerance;

/// A body of `controls` control moduli whose elements mix them all.
std::shared_ptr<const Body> mixed_body(int controls) {
  Body body = *test::tet_body({0.2, 0.1, 0.12}, {2, 1, 1}, false);
  body.modulus.controls = controls;
  if (controls > 1) {
    body.modulus.weights = MatrixX::Zero(body.element_count(), controls);
    for (int e = 0; e < body.element_count(); ++e)
      for (int k = 0; k < controls; ++k) body.modulus.weights(e, k) = 1.5 + std::sin(1.0 + 2.0 * e + 5.0 * k);
    for (int e = 0; e < body.element_count(); ++e) body.modulus.weights.row(e) /= body.modulus.weights.row(e).sum();
  }
  for (std::size_t e = 0; e < body.modulus.relative.size(); ++e) body.modulus.relative[e] = 1.0 + 0.05 * double(e);
  return std::make_shared<Body>(std::move(body));
}

struct Fields : ::testing::TestWithParam<LawForm> {
  Fields() {
    theta = VectorX::Zero(layout.size());
    for (const ParameterHandle& at : layout.all()) {
      const std::string& name = layout.layout().block_of(at).name;
      const double shift = 0.03 * double(at.first);
      theta[at] = name.starts_with("youngs")     ? 3000.0 * (1.0 + shift)
                  : name.starts_with("poisson")  ? 0.25 + 0.1 * shift
                  : name.starts_with("exponent") ? 4.0 + shift
                                                 : 0.5 + shift;
    }
    field.set_parameters(theta);
  }
  VectorX table(const VectorX& at) {
    const MatrixX q = law_at(*body, layout, at)->table().transpose();
    return q.reshaped();
  }
  std::shared_ptr<const Body> body = mixed_body(GetParam().controls);
  LawLayout layout{GetParam()};
  MaterialField field{body, layout};
  VectorX theta;
};

TEST_P(Fields, ChangeAsTheTableDoesWithEveryParameter) {
  for (const ParameterHandle& at : layout.all()) {
    const VectorX direction = VectorX::Unit(theta.size(), at.first);
    field.set_changes(direction);
    ASSERT_TRUE(field.has_changes());
    VectorX change(table(theta).size());
    for (int e = 0; e < body->element_count(); ++e)
      change.segment(e * field.law()->table().cols(), field.law()->table().cols()) = field.change(e);
    ASSERT_GT(change.norm(), 0.0);
    const auto along = [&](double h) { return table(theta + h * direction); };
    EXPECT_LT(test::best_relative_error(along, change, 0.1 * theta[at]), tolerance(1e-7))
        << layout.layout().block_of(at).name;
  }
  field.set_changes(VectorX::Zero(theta.size()));
  EXPECT_FALSE(field.has_changes());
}

TEST_P(Fields, AdjointIsTheTransposeOfTheTangent) {
  const auto q = field.law()->table().cols();
  const VectorX w = table(theta).array().sin();
  VectorX theta_bar = VectorX::Ones(theta.size());  // it adds
  field.begin_adjoint();
  for (int e = 0; e < body->element_count(); ++e) field.adjoint(e) += w.segment(e * q, q);
  field.end_adjoint(theta_bar);
  for (const ParameterHandle& at : layout.all()) {
    field.set_changes(VectorX::Unit(theta.size(), at.first));
    double by_tangent = 0.0, size = 0.0;
    for (int e = 0; e < body->element_count(); ++e) {
      by_tangent += field.change(e).dot(w.segment(e * q, q));
      size += field.change(e).norm();
    }
    EXPECT_NEAR(theta_bar[at] - 1.0, by_tangent, tolerance(1e-12) * (1.0 + size * w.norm()));
  }
}

TEST_P(Fields, AreComputedAnewWhereTheLawsNumbersChange) {
  const auto before = field.law();
  field.set_parameters(theta);
  EXPECT_EQ(field.law(), before);
  VectorX other = theta;
  other[layout.modulus(0)] *= 2.0;
  field.set_parameters(other);
  EXPECT_NE(field.law(), before);
  EXPECT_EQ((field.law()->table() - law_at(*body, layout, other)->table()).norm(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Forms, Fields,
                         ::testing::Values(LawForm{1, 0}, LawForm{1, 0, 1, false, ElasticLaw::NeoHookean},
                                           LawForm{3, 0, 3, false, ElasticLaw::NeoHookean}, LawForm{1, 1},
                                           LawForm{3, 2}, LawForm{2, 2, 2, true}),
                         [](const auto& c) {
                           const LawForm& f = c.param;
                           return (f.terms > 0                              ? "Ogden" + std::to_string(f.terms)
                                   : f.two_numbers == ElasticLaw::Corotated ? "Linear"
                                                                            : "NeoHookean") +
                                  "Of" + std::to_string(f.controls) + "Controls" + std::to_string(f.laws) + "Laws";
                         });

TEST(MaterialField, OfTheNeoHookeanLawHasItsModuliAtRest) {
  const auto body = mixed_body(1);
  const LawLayout layout({1, 0, 1, false, ElasticLaw::NeoHookean});
  VectorX theta(2);
  theta[layout.modulus(0)] = 4000.0;
  theta[layout.poissons_ratio()] = 0.4;
  MaterialField field(body, layout);
  field.set_parameters(theta);
  const SmallStrainModuli m = field.law()->small_strain(3);
  EXPECT_NEAR(m.youngs_modulus, 4000.0 * body->modulus.relative[3], tolerance(1e-9));
  EXPECT_NEAR(m.poissons_ratio, 0.4, tolerance(1e-12));
}

TEST(MaterialField, RefusesAnotherNumberOfControls) {
  EXPECT_THROW(MaterialField(mixed_body(2), LawLayout({3, 1})), std::invalid_argument);
}

TEST(LawLayouts, OfAMotionShareItsModuliAndPoissonsRatio) {
  ParameterLayout all;
  const MotionBlocks blocks = add_motion_blocks(all, {.moduli = 2});
  const int before = all.size();
  const LawLayout one = LawLayout::of_motion(all, blocks, {1, 2});
  EXPECT_EQ(one.form().controls, 2);
  EXPECT_EQ(one.modulus(1), blocks.youngs_moduli[1]);
  EXPECT_EQ(one.poissons_ratio(1), blocks.poissons_ratio);
  EXPECT_EQ(one.stiffness_ratio(1), all.at("stiffness_ratio_2"));
  EXPECT_EQ(all.size(), before + 3);
  EXPECT_THROW(LawLayout::of_motion(all, blocks, {1, 1}), std::invalid_argument) << "exponent_1 is taken";
  ParameterLayout others;
  const MotionBlocks three = add_motion_blocks(others, {.moduli = 3});
  const LawLayout own = LawLayout::of_motion(others, three, {3, 1, 3});
  EXPECT_EQ(own.poissons_ratio(0, 0), three.poissons_ratio);
  EXPECT_EQ(own.poissons_ratio(0, 2), others.at("poissons_ratio@3"));
  EXPECT_EQ(own.exponent(0, 1), others.at("exponent_1@2"));
  EXPECT_THROW(LawLayout::of_motion(others, three, {3, 1, 2}), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::material_field_test
