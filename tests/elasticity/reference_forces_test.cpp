#include "elasticity/reference_forces.hpp"

#include <optional>
#include <string>
#include <tuple>

#include "elasticity/material.hpp"
#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::reference_forces_test {
namespace {

using test::tolerance;

/// Change of the forces for a change of X.
Points tangent_of(const ReferenceForces& forces, const Points& direction) {
  Points tangent = Points::Zero(direction.rows(), 3);
  const Points* along = &direction;
  Points* into = &tangent;
  forces.add_tangents({&along, 1}, {&into, 1});
  return tangent;
}

struct Of {
  std::string name;
  std::optional<LawForm> law;  ///< none: of the mean strain
  ElasticLaw mean_strain = ElasticLaw::Corotated;
  friend void PrintTo(const Of& of, std::ostream* out) { *out << of.name; }
};
const std::vector<Of> materials = {{"Corotated", std::nullopt},
                                   {"NeoHookeanMean", std::nullopt, ElasticLaw::NeoHookean},
                                   {"LinearLaw", LawForm{1, 0}},
                                   {"NeoHookean", LawForm{1, 0, 1, false, ElasticLaw::NeoHookean}},
                                   {"Ogden", LawForm{1, 2, 1, true}}};

/// Linear and quadratic tetrahedra of every material, half of them three times as stiff, bent in the world and free of
/// load elsewhere than in the scan.
struct Reference : ::testing::TestWithParam<std::tuple<Of, bool>> {
  Reference() {
    Body made = *test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, std::get<bool>(GetParam()));
    for (std::size_t e = 0; e < made.modulus.relative.size(); e += 2) made.modulus.relative[e] = 3.0;
    body = std::make_shared<Body>(std::move(made));
    ParameterLayout layout;
    blocks = add_motion_blocks(layout, {});
    material.elastic = std::get<Of>(GetParam()).mean_strain;
    if (const auto& form = std::get<Of>(GetParam()).law) material.elastic = LawLayout::of_motion(layout, blocks, *form);
    theta = VectorX::Zero(layout.size());
    blocks.set_moduli(theta, 3000.0);
    theta[blocks.poissons_ratio] = 0.35;
    for (const auto& [name, value] : std::initializer_list<std::pair<std::string, double>>{
             {"exponent_1", 5.0}, {"exponent_2", -4.0}, {"stiffness_ratio_2", 0.6}, {"poissons_ratio_2", 0.2}})
      if (layout.contains(name)) theta[layout.at(name)] = value;
    forces = material.make_reference_forces(body, blocks);
    forces->set_parameters(theta);
    X = test::deformed(body->nodes, 0.1, 0.2);
    x = test::deformed(body->nodes, 0.25, 1.7);
    direction = test::deformed(body->nodes, 0.3, -0.4);
  }
  Points force(const Points& reference) const {
    EXPECT_TRUE(forces->linearise(reference, x));
    Points f = Points::Zero(x.rows(), 3);
    forces->add_force(f);
    return f;
  }
  Material material;
  MotionBlocks blocks;
  std::shared_ptr<const Body> body;
  VectorX theta;
  std::unique_ptr<ReferenceForces> forces;
  Points X, x, direction;
};

/// The same law as that of the moving body, by other formulas.
TEST_P(Reference, ForcesAreThoseOfABodyWithThatReference) {
  for (const Points& reference : {body->nodes, X}) {
    const auto elasticity = material.make_elasticity(std::make_shared<Body>(with_reference(*body, reference)), blocks);
    elasticity->set_parameters(theta);
    elasticity->linearise(x);
    Points expected = Points::Zero(x.rows(), 3);
    elasticity->add_force(x, expected);
    ASSERT_GT(expected.norm(), 1.0);
    EXPECT_LT((force(reference) - expected).norm(), tolerance(1e-11) * expected.norm());
  }
  EXPECT_LT(force(x).norm(), tolerance(1e-9)) << "stress-free where it is";
}

TEST_P(Reference, TangentIsTheDerivativeAndMatrixAndAdjointAreIt) {
  (void)force(X);
  const Points tangent = tangent_of(*forces, direction);
  BlockMatrix matrix(body->pattern);
  forces->add_matrix(2.0, matrix);
  const Points w = test::deformed(body->nodes, 0.5, 2.9);
  Points adjoint = Points::Zero(x.rows(), 3);
  forces->add_adjoint(w, adjoint);
  const VectorX exact = flat(tangent);
  const MatrixX dense = test::dense(matrix);
  EXPECT_LT((dense * flat(direction) - 2.0 * exact).norm(), tolerance(1e-12) * exact.norm());
  EXPECT_LT((dense.transpose() * flat(w) - 2.0 * flat(adjoint)).norm(), tolerance(1e-12) * adjoint.norm());
  EXPECT_GT((dense - dense.transpose()).norm(), 1e-3 * dense.norm()) << "it is not symmetric";
  const auto along = [&](double step) -> VectorX { return flat(force(X + step * direction)); };
  EXPECT_LT(test::best_relative_error(along, exact, 0.1), tolerance(1e-8));
}

/// What moves rigidly in its reference has the same forces: rotations of X alone are rotations of nothing.
TEST_P(Reference, RigidMotionsOfTheReferenceChangeNothing) {
  const Points before = force(X);
  const Matrix3 R = Eigen::AngleAxisd(0.7, Vector3(1, 2, -1).normalized()).toRotationMatrix();
  const Points moved = (X * R.transpose()).rowwise() + Eigen::RowVector3d(0.1, -0.2, 0.3);
  EXPECT_LT((force(moved) - before).norm(), tolerance(1e-11) * before.norm());
}

TEST_P(Reference, AnElementInsideOutIsNoticed) {
  Points folded = X;
  folded.col(0) *= -1.0;
  EXPECT_FALSE(forces->linearise(folded, x));
  EXPECT_LT(forces->least_volume_ratio(), 0.0);
  EXPECT_THROW((void)with_reference(*body, folded), std::invalid_argument);
  EXPECT_TRUE(forces->linearise(1.1 * body->nodes, x));
  EXPECT_NEAR(forces->least_volume_ratio(), 1.331, tolerance(1e-12));
}

TEST_P(Reference, MassAndPlacesStayWithTheScan) {
  const Body moved = with_reference(*body, X);
  EXPECT_EQ(moved.mass, body->mass);
  EXPECT_EQ(moved.scanned_positions(), body->nodes);
  EXPECT_EQ(moved.reference_positions(), X);
  const std::vector<Vector3> points = {Vector3(0.05, 0.03, -0.02), Vector3(-0.12, 0.0, 0.07)};
  const Points at = Embedding(moved, points).positions(body->nodes);
  for (Eigen::Index i = 0; i < 2; ++i)
    EXPECT_LT((at.row(i).transpose() - points[std::size_t(i)]).norm(), tolerance(1e-14));
}

INSTANTIATE_TEST_SUITE_P(Tetrahedra, Reference, ::testing::Combine(::testing::ValuesIn(materials), ::testing::Bool()),
                         [](const auto& c) {
                           return std::get<Of>(c.param).name + (std::get<bool>(c.param) ? "Quadratic" : "Linear");
                         });

TEST(ReferenceForces, HexahedraTakeNoPart) {
  const auto body = test::box_body(Vector3(0.4, 0.2, 0.2), 0.1);
  EXPECT_THROW((void)ReferenceForces::make(body, MotionLayout(), ElasticLaw::NeoHookean), std::invalid_argument);
  const LawLayout law({1, 1});
  EXPECT_THROW((void)Material{law}.make_reference_forces(body, MotionLayout()), std::invalid_argument);
  EXPECT_THROW((void)with_reference(*body, body->nodes), std::invalid_argument);
}

/// Where p is not z the affine force counts: what stiffness damping makes of a step.
TEST(LawReferenceForces, TheMatrixIsTheTangentWhereTheLagPointIsElsewhere) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {2, 1, 1}, true);
  const LawLayout law({1, 0, 1, false, ElasticLaw::NeoHookean});
  VectorX theta(law.size());
  theta[law.modulus(0)] = 3000.0;
  theta[law.poissons_ratio()] = 0.35;
  const auto forces = Material{law}.make_reference_forces(body, MotionLayout());
  forces->set_parameters(theta);
  ASSERT_TRUE(forces->linearise(test::deformed(body->nodes, 0.1, 0.2), test::deformed(body->nodes, 0.3, 1.7),
                                test::deformed(body->nodes, 0.28, 1.75)));
  const Points direction = test::deformed(body->nodes, 0.3, -0.4);
  const Points tangent = tangent_of(*forces, direction);
  BlockMatrix matrix(body->pattern);
  forces->add_matrix(1.0, matrix);
  EXPECT_LT((test::dense(matrix) * flat(direction) - flat(tangent)).norm(), tolerance(1e-12) * tangent.norm());
}

/// The affine force of a step is that of the moving body with that reference, and its derivatives are exact.
TEST(MeanStrainReferenceForces, AreTheAffineForcesWhereTheLagPointIsElsewhere) {
  for (const bool quadratic : {false, true}) {
    const auto body = test::tet_body({0.2, 0.1, 0.12}, {2, 1, 1}, quadratic);
    const MotionLayout blocks;
    VectorX theta = blocks.zero();
    blocks.set_moduli(theta, 3000.0);
    theta[blocks.poissons_ratio] = 0.35;
    const Points X = test::deformed(body->nodes, 0.1, 0.2), p = test::deformed(body->nodes, 0.3, 1.7),
                 z = test::deformed(body->nodes, 0.28, 1.75), direction = test::deformed(body->nodes, 0.3, -0.4),
                 w = test::deformed(body->nodes, 0.5, 2.9);
    const Material material{ElasticLaw::NeoHookean};
    const auto forces = material.make_reference_forces(body, blocks);
    forces->set_parameters(theta);
    const auto force = [&](const Points& reference) {
      EXPECT_TRUE(forces->linearise(reference, p, z));
      Points f = Points::Zero(p.rows(), 3);
      forces->add_force(f);
      return f;
    };
    const auto elasticity = material.make_elasticity(std::make_shared<Body>(with_reference(*body, X)), blocks);
    elasticity->set_parameters(theta);
    elasticity->linearise(p);
    Points expected = Points::Zero(p.rows(), 3);
    elasticity->add_force(z, expected);
    EXPECT_LT((force(X) - expected).norm(), tolerance(1e-11) * expected.norm());
    const Points tangent = tangent_of(*forces, direction);
    Points adjoint = Points::Zero(p.rows(), 3);
    forces->add_adjoint(w, adjoint);
    EXPECT_NEAR(adjoint.cwiseProduct(direction).sum(), w.cwiseProduct(tangent).sum(),
                tolerance(1e-12) * w.norm() * tangent.norm());
    const VectorX exact = flat(tangent);
    const auto along = [&](double step) -> VectorX { return flat(force(X + step * direction)); };
    EXPECT_LT(test::best_relative_error(along, exact, 0.1), tolerance(1e-8));
  }
}

TEST(Material, NamesTheParametersThatItDependsOn) {
  ParameterLayout layout;
  const MotionBlocks blocks = add_motion_blocks(layout, {});
  const LawLayout law = LawLayout::of_motion(layout, blocks, {1, 1});
  const Material own{ElasticLaw::NeoHookean}, ogden{law},
      given{law_at(*test::tet_body({0.2, 0.1, 0.1}, {1, 1, 1}, false), LawLayout({1, 0}), Eigen::Vector2d(1e3, 0.3))};
  EXPECT_EQ(own.parameters(blocks), (std::vector<ParameterHandle>{blocks.youngs_moduli[0], blocks.poissons_ratio}));
  EXPECT_EQ(ogden.parameters(blocks),
            (std::vector<ParameterHandle>{blocks.youngs_moduli[0], blocks.poissons_ratio, layout.at("exponent_1")}));
  EXPECT_TRUE(given.parameters(blocks).empty());
}

}  // namespace
}  // namespace pliant::reference_forces_test
