// Where bodies are stress-free that sag as they were scanned.
#include "motion/reference_shape.hpp"

#include "base/error.hpp"
#include "support/derivatives.hpp"
#include "support/hanging.hpp"
#include "support/tolerance.hpp"

namespace pliant::reference_shape_test {
namespace {

using test::tolerance;
using test::hanging::edge;
using test::hanging::Hanging;
using test::hanging::length;

/// A clamped bar as it sags under its own weight: its load-free shape is straight, and known.
struct Sagging : Hanging {
  /// @param law  of the bar; null: corotated linear elasticity
  Sagging(bool quadratic, double youngs_modulus, const LawForm* law = nullptr,
          ElasticLaw elastic_law = ElasticLaw::NeoHookean)
      : Hanging(test::tet_body({length, edge, edge}, Eigen::Vector3i(24, 2, 2) / (quadratic ? 2 : 1), quadratic, 0.0)) {
    options.material.elastic = elastic_law;
    if (law) set_law(*law);
    layout.set_moduli(theta, youngs_modulus);
    straight = body->nodes;
    sagged = positions(theta);
    TetMesh mesh = std::get<TetMesh>(body->mesh);
    scanned = std::make_shared<Body>(make_body(make_tet_mesh(sagged, mesh.tets, mesh.mid_nodes)));
    // The mass is that of the scan; given that of the straight bar, the two problems are each other's inverse.
    Body weighed = *scanned;
    weighed.mass = body->mass;
    scanned = std::make_shared<Body>(std::move(weighed));
    held = held_nodes(*body, options.holds);
  }
  /// Its numbers follow the motion's blocks, which stay where they are.
  void set_law(const LawForm& form) {
    ParameterLayout all = layout.layout();
    options.material.elastic = LawLayout::of_motion(all, layout, form);
    theta = carry(layout.layout(), theta, all, VectorX::Zero(all.size()));
    for (int i = 0; i < form.terms; ++i) theta[options.material.law_layout()->exponent(i)] = i == 0 ? 8.0 : -5.0;
    for (int i = 1; i < form.terms; ++i) theta[options.material.law_layout()->stiffness_ratio(i)] = 0.7;
  }
  Points straight, sagged;
  std::shared_ptr<const Body> scanned;
  std::vector<int> held;
};

class ReferenceShapes : public ::testing::TestWithParam<bool> {};

TEST_P(ReferenceShapes, ASaggingBarWasStraight) {
  for (const auto& [youngs_modulus, law] :
       {std::pair(3e7, ElasticLaw::NeoHookean), {3e6, ElasticLaw::NeoHookean}, {3e6, ElasticLaw::Corotated}}) {
    const Sagging scene(GetParam(), youngs_modulus, nullptr, law);
    const double sag = (scene.sagged - scene.straight).rowwise().norm().maxCoeff();
    ASSERT_GT(sag, 0.02 * length);
    ReferenceShapeSolver solver(scene.scanned, scene.held, scene.options.material, scene.layout);
    const ReferenceShape shape = solver.find(scene.theta, scan_load(*scene.scanned, scene.layout, scene.theta, {}));
    ASSERT_TRUE(shape.found) << shape.reason;
    EXPECT_LT(shape.residual, 1e-7);
    EXPECT_EQ(shape.carried, 1.0);
    EXPECT_LT((shape.X - scene.straight).rowwise().norm().maxCoeff(), 1e-5 * length) << "sag " << sag;
  }
}

/// So was one of any other law.
TEST_P(ReferenceShapes, ASaggingBarOfALawWasStraight) {
  for (const LawForm& law : {LawForm{1, 0, 1, false, ElasticLaw::NeoHookean}, LawForm{1, 2}}) {
    const Sagging scene(GetParam(), 2e6, &law);
    const double sag = (scene.sagged - scene.straight).rowwise().norm().maxCoeff();
    ASSERT_GT(sag, 0.1 * length);
    ReferenceShapeSolver solver(scene.scanned, scene.held, scene.options.material, scene.layout);
    const Points load = scan_load(*scene.scanned, scene.layout, scene.theta, {});
    const ReferenceShape shape = solver.find(scene.theta, load);
    ASSERT_TRUE(shape.found) << shape.reason;
    EXPECT_LT((shape.X - scene.straight).rowwise().norm().maxCoeff(), 1e-5 * length) << "sag " << sag;
    VectorX soft = scene.theta;
    soft[scene.layout.youngs_moduli[0]] = 1e4;
    EXPECT_THAT(solver.find(soft, load).reason, ::testing::HasSubstr("carries"));
  }
}

/// Under its weight the body that was found sags back into the scan.
TEST_P(ReferenceShapes, TheShapeSagsBackIntoTheScan) {
  Sagging scene(GetParam(), 1e6);
  ReferenceShapeSolver solver(scene.scanned, scene.held, scene.options.material, scene.layout);
  const ReferenceShape shape = solver.find(scene.theta, scan_load(*scene.scanned, scene.layout, scene.theta, {}));
  ASSERT_TRUE(shape.found) << shape.reason;
  scene.body = std::make_shared<Body>(with_reference(*scene.scanned, shape.X));
  scene.options.holds = {{[&](const Vector3& p) { return p.x() < -0.5 * length + 1e-6; }}};
  const Points again = scene.positions(scene.theta);
  EXPECT_LT((again - scene.sagged).rowwise().norm().maxCoeff(), 1e-6 * length);
}

/// A material too soft for any shape to hold the scan is refused, with what it can carry.
TEST_P(ReferenceShapes, AMaterialThatCannotCarryTheBodyIsNamed) {
  const Sagging scene(GetParam(), 1e6);
  const ParameterHandle modulus = scene.layout.youngs_moduli[0];
  VectorX soft = scene.theta;
  soft[modulus] = 3e4;
  ReferenceShapeSolver solver(scene.scanned, scene.held, scene.options.material, scene.layout);
  const Points load = scan_load(*scene.scanned, scene.layout, soft, {});
  const ReferenceShape shape = solver.find(soft, load);
  EXPECT_FALSE(shape.found);
  EXPECT_THAT(shape.reason, ::testing::HasSubstr("carries"));
  EXPECT_LT(shape.carried, 1.0);
  ASSERT_GT(shape.carried, 0.0);
  VectorX enough = soft;
  enough[modulus] /= 0.9 * shape.carried;
  EXPECT_TRUE(solver.find(enough, load).found) << enough[modulus];
  VectorX little = soft;
  little[modulus] *= 0.94 / shape.carried;
  EXPECT_FALSE(solver.find(little, load).found) << little[modulus];
  EXPECT_LT(shape.iterations, 130);  // a few for each part of the load that is tried, not many for one that is hopeless
}

TEST_P(ReferenceShapes, TangentAndAdjointAreTheDerivative) {
  const Sagging scene(GetParam(), 6e5);
  ReferenceShapeOptions options;
  options.tolerance = 1e-12;
  ReferenceShapeSolver solver(scene.scanned, scene.held, scene.options.material, scene.layout, options);
  const Points load = scan_load(*scene.scanned, scene.layout, scene.theta, {});
  const Points d_load = test::deformed(load, 0.3, 0.8) * 0.1;
  const auto along = [&](double step) -> VectorX {
    const ReferenceShape shape = solver.find(scene.theta, load + step * d_load);
    EXPECT_TRUE(shape.found) << shape.reason;
    return flat(shape.X);
  };
  const ReferenceShape shape = solver.find(scene.theta, load);
  ASSERT_TRUE(shape.found);
  ASSERT_TRUE(solver.prepare_derivatives(scene.theta, shape.X));
  const Points tangent = solver.tangent(d_load);
  const Points X_bar = test::deformed(scene.sagged, 0.5, 2.9);
  const double by_adjoint = solver.adjoint(X_bar).cwiseProduct(d_load).sum(),
               by_tangent = X_bar.cwiseProduct(tangent).sum();
  EXPECT_NEAR(by_adjoint, by_tangent, tolerance(1e-8) * std::abs(by_tangent));
  EXPECT_LT(test::best_relative_error(along, flat(tangent), 1.0), tolerance(1e-5));
}

INSTANTIATE_TEST_SUITE_P(Tetrahedra, ReferenceShapes, ::testing::Bool(),
                         [](const auto& quadratic) { return quadratic.param ? "quadratic" : "linear"; });

TEST(ReferenceShape, WhatNothingHoldsIsRefused) {
  const Sagging scene(false, 1e6);
  EXPECT_THROW(ReferenceShapeSolver(scene.scanned, {}, scene.options.material, scene.layout), InputError);
}

/// So stiff that rounding in its own forces is more than a millionth of its weight: what they move is told apart.
TEST(ReferenceShape, ThatRoundingAloneKeepsFromBalanceIsFound) {
  const Sagging scene(true, 1e15);
  ReferenceShapeSolver solver(scene.scanned, scene.held, scene.options.material, scene.layout);
  const Points load = scan_load(*scene.scanned, scene.layout, scene.theta, {});
  const ReferenceShape first = solver.find(scene.theta, load);
  ASSERT_TRUE(first.found) << first.reason;
  EXPECT_GT(first.residual, 1e-6) << "or this shows nothing";
  EXPECT_LT(first.iterations, 12);
  EXPECT_LT((first.X - scene.straight).rowwise().norm().maxCoeff(), 1e-9 * length);
  VectorX other = scene.theta;
  other[scene.layout.youngs_moduli[0]] *= 0.5;
  const ReferenceShape from_first = solver.find(other, load, &first.X);
  ASSERT_TRUE(from_first.found) << from_first.reason;
  EXPECT_LT(from_first.iterations, 12);
}

/// The rivals find the same shape where they find one.
TEST(ReferenceShape, OtherSchemesAgree) {
  const Sagging scene(false, 3e6);
  const Points load = scan_load(*scene.scanned, scene.layout, scene.theta, {});
  for (const auto scheme : {ReferenceScheme::VirtualForce, ReferenceScheme::Newton}) {
    ReferenceShapeOptions options;
    options.scheme = scheme;
    options.tolerance = 1e-8;
    options.max_iterations = 3000;
    ReferenceShapeSolver solver(scene.scanned, scene.held, scene.options.material, scene.layout, options);
    const ReferenceShape shape = solver.find(scene.theta, load);
    ASSERT_TRUE(shape.found) << shape.reason;
    EXPECT_LT((shape.X - scene.straight).rowwise().norm().maxCoeff(), 1e-4 * length);
  }
}

}  // namespace
}  // namespace pliant::reference_shape_test
