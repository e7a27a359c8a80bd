#include "elasticity/reference_forces.hpp"

#include "elasticity/corotated.hpp"
#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant {
namespace {

using test::tolerance;

/// Linear and quadratic tetrahedra of two materials, bent in the world and free of load elsewhere than in the scan.
struct Reference : ::testing::TestWithParam<bool> {
  Reference() {
    Body made = *test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, GetParam());
    for (std::size_t e = 0; e < made.modulus.relative.size(); e += 2) made.modulus.relative[e] = 3.0;
    body = std::make_shared<Body>(std::move(made));
    theta = layout.zero();
    layout.set_moduli(theta, 3000.0);
    theta[layout.poissons_ratio] = 0.35;
    forces = ReferenceForces::make(body, layout);
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
  MotionLayout layout;
  std::shared_ptr<const Body> body;
  VectorX theta;
  std::unique_ptr<ReferenceForces> forces;
  Points X, x, direction;
};

/// The same law as that of the moving body, by other formulas.
TEST_P(Reference, ForcesAreThoseOfABodyWithThatReference) {
  for (const Points& reference : {body->nodes, X}) {
    const auto elasticity = make_elasticity(std::make_shared<Body>(with_reference(*body, reference)), layout);
    elasticity->set_parameters(theta);
    elasticity->linearise(x);
    Points expected = Points::Zero(x.rows(), 3);
    elasticity->add_force(x, expected);
    ASSERT_GT(expected.norm(), 1.0);
    EXPECT_LT((force(reference) - expected).norm(), tolerance(1e-11) * expected.norm());
  }
  EXPECT_LT(force(x).norm(), tolerance(1e-9)) << "free of load where it is";
}

TEST_P(Reference, TangentIsTheDerivativeAndMatrixAndAdjointAreIt) {
  (void)force(X);
  Points tangent = Points::Zero(x.rows(), 3);
  forces->add_tangent(direction, tangent);
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

INSTANTIATE_TEST_SUITE_P(Tetrahedra, Reference, ::testing::Bool(),
                         [](const auto& quadratic) { return quadratic.param ? "quadratic" : "linear"; });

TEST(ReferenceForces, HexahedraTakeNoPart) {
  const auto body = test::box_body(Vector3(0.4, 0.2, 0.2), 0.1);
  EXPECT_THROW((void)ReferenceForces::make(body, MotionLayout()), std::invalid_argument);
  EXPECT_THROW((void)with_reference(*body, body->nodes), std::invalid_argument);
}

}  // namespace
}  // namespace pliant
