#include "motion/press_session.hpp"

#include <numbers>

#include "base/error.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::press_session_test {
namespace {

using test::tolerance;

struct Session : ::testing::Test {
  Session() : body(test::tet_body({0.2, 0.1, 0.2}, {8, 4, 8}, false, 0.1)) {
    MatrixX q(body->element_count(), 6);
    q.rowwise() = (Eigen::RowVectorXd(6) << 1500.0, 8.0, 0.2, 1500.0, -6.0, 0.15).finished();
    law = std::make_shared<OgdenLaw>(q);
    for (int n = 0; n < body->node_count(); ++n)
      if (body->nodes(n, 1) < -0.0499) options.held.push_back(n);
  }
  PressSession make(ProbeKind kind) const { return {body, law, {kind, {0.01, 0.05, 0.0}, 0.03, {}}, options}; }
  std::shared_ptr<const Body> body;
  std::shared_ptr<const MaterialLaw> law;
  PressSessionOptions options;
};

TEST_F(Session, SmallMovesTakeFewIterations) {
  for (const ProbeKind kind : {ProbeKind::BondedDisc, ProbeKind::Punch, ProbeKind::Ball}) {
    PressSession session = make(kind);
    int most = 0;
    for (int k = 1; k <= 20; ++k) {
      const SolveSummary s = session.move_to({0.0, -0.0007 * k, 0.0});
      ASSERT_TRUE(s.converged) << session.failure();
      most = std::max(most, s.iterations);
      EXPECT_LT(s.residual, 1e-6);
    }
    EXPECT_LE(most, kind == ProbeKind::BondedDisc ? 5 : 15);
    EXPECT_LT(session.force().y(), -2.0);
  }
}

TEST_F(Session, GoingOnAsBeforeTakesFewerIterationsToTheSameEquilibria) {
  for (const ProbeKind kind : {ProbeKind::BondedDisc, ProbeKind::Ball}) {
    PressSession goes_on = make(kind), begins_anew = make(kind);
    int going_on = 0, anew = 0;
    for (int k = 1; k <= 40; ++k) {  // in and out again, with a pause
      const double depth = 0.0007 * (k <= 20 ? k : std::min(20, 41 - k));
      const Vector3 place(0.2 * depth, -depth, 0.0);
      const SolveSummary further = goes_on.move_to(place);
      begins_anew.start_from(begins_anew.nodes());
      const SolveSummary fresh = begins_anew.move_to(place);
      ASSERT_TRUE(further.converged && fresh.converged) << goes_on.failure() << begins_anew.failure();
      going_on += further.iterations, anew += fresh.iterations;
      EXPECT_LT((goes_on.force() - begins_anew.force()).norm(), tolerance(1e-5) * goes_on.force().norm());
    }
    EXPECT_LT(going_on, 0.7 * anew);
  }
}

TEST_F(Session, TurnsToAndFroEndWhereADirectTurnDoes) {
  PressSession turned = make(ProbeKind::BondedDisc), direct = make(ProbeKind::BondedDisc);
  const ProbeMove on{ProbeMove::By::Displacement, {0.0, -0.004, 0.0}, {0.0, 0.1, 0.0}};
  const ProbeMove back{ProbeMove::By::Displacement, {0.0, -0.004, 0.0}, {0.0, -0.1, 0.0}};
  for (const ProbeMove& move : {on, back}) ASSERT_TRUE(turned.lead({move}).converged);
  ASSERT_TRUE(direct.lead({back}).converged);
  EXPECT_LT((turned.nodes() - direct.nodes()).rowwise().norm().maxCoeff(), 1e-5 * body->size());
}

TEST_F(Session, PushingAndMovingAgree) {
  PressSession by_force = make(ProbeKind::BondedDisc), by_place = make(ProbeKind::BondedDisc);
  ASSERT_TRUE(by_force.push({1.0, -12.0, 0.0}).converged);
  ASSERT_TRUE(by_place.move_to(by_force.displacement()).converged);
  EXPECT_LT((by_place.force() - Vector3(1.0, -12.0, 0.0)).norm(), tolerance(1e-3));
}

TEST_F(Session, AFailedPushLeavesTheLastEquilibrium) {
  PressSession session = make(ProbeKind::BondedDisc);
  ASSERT_TRUE(session.push({0.0, -5.0, 0.0}).converged);
  const Points before = session.nodes();
  EXPECT_FALSE(session.push({0.0, std::nan(""), 0.0}).converged);
  EXPECT_FALSE(session.failure().empty());
  EXPECT_EQ(session.nodes(), before);
}

TEST_F(Session, ASecondProbeIsFeltByTheFirst) {
  const ProbeOptions left{ProbeKind::BondedDisc, {-0.05, 0.05, 0.0}, 0.03, {}};
  ProbeOptions right = left;
  right.centre.x() = 0.05;
  PressSession both(body, law, std::vector<ProbeOptions>{left, right}, options), alone(body, law, left, options);
  const ProbeMove in{ProbeMove::By::Displacement, {0.0, -0.01, 0.0}, Vector3::Zero()};
  ASSERT_TRUE(alone.lead({in}).converged);
  ASSERT_TRUE(both.lead({in, in}).converged) << both.failure();
  EXPECT_NEAR(both.force(0).y() / both.force(1).y(), 1.0, 0.02) << "the mesh is not quite symmetric";
  EXPECT_LT(both.force(0).y() + both.force(1).y(), 1.2 * alone.force().y()) << "more than one probe presses";
  EXPECT_GT(both.force(0).x(), 0.01 * std::abs(both.force(0).y())) << "each holds what the other pushes away";
  EXPECT_THROW((void)both.lead({in}), std::invalid_argument);
}

TEST_F(Session, ProbesPullAsTheyPush) {
  PressSession session = make(ProbeKind::BondedDisc);
  ASSERT_TRUE(session.move_to({0.0, 1e-5, 0.0}).converged);
  const double pull = session.force().y();
  ASSERT_TRUE(session.move_to({0.0, -1e-5, 0.0}).converged);
  EXPECT_NEAR(session.force().y() / pull, -1.0, 1e-2) << "small strains have one stiffness";
  ASSERT_TRUE(session.push({0.0, 6.0, 0.0}).converged);
  EXPECT_GT(session.displacement().y(), 0.002);
  PressSession sliding = make(ProbeKind::Punch);
  ASSERT_TRUE(sliding.move_to({0.0, 0.002, 0.0}).converged);
  EXPECT_LT(sliding.force().norm(), tolerance(1e-9)) << "what slides lifts off";
}

TEST_F(Session, ATurnedDiscTwistsTheObject) {
  PressSession session = make(ProbeKind::BondedDisc);
  constexpr double angle = 0.1;
  for (int k = 1; k <= 4; ++k)
    ASSERT_TRUE(session.lead({{ProbeMove::By::Displacement, Vector3::Zero(), {0.0, 0.25 * k * angle, 0.0}}}).converged);
  const Vector3 about(0.01, 0.05, 0.0);
  double turned = 0.0, spread = 0.0;
  for (int n = 0; n < body->node_count(); ++n) {
    const Vector3 arm = body->nodes.row(n).transpose() - about,
                  way = (session.nodes() - body->nodes).row(n).transpose();
    if (std::abs(arm.y()) > 1e-3 || arm.norm() > 0.026) continue;
    turned += arm.cross(way).y(), spread += arm.squaredNorm();
  }
  EXPECT_NEAR(turned / spread, angle, 0.3 * angle) << "the patch under it turns along, its bond gives a little";
  EXPECT_LT(session.force().norm(), 0.3) << "a turn pushes nowhere";
  ASSERT_TRUE(session.lead({ProbeMove{}}).converged);
  EXPECT_LT((session.nodes() - body->nodes).rowwise().norm().maxCoeff(), 1e-6) << "turned back, all is as it was";
}

TEST_F(Session, ACapsuleAndItsMeshAgree) {
  const Vector3 down(0.0, -1.0, 0.0), rod(0.06, 0.0, 0.0);
  constexpr double radius = 0.02;
  const ProbeOptions capsule{ProbeKind::Capsule, {0.0, 0.05, 0.0}, radius, down, rod};
  ProbeOptions shape = capsule;
  shape.kind = ProbeKind::Shape;
  const Vector3 middle = shape.centre - radius * down;
  shape.shape = rigid_capsule(middle - 0.5 * rod, middle + 0.5 * rod, radius);
  PressSession one(body, law, capsule, options), other(body, law, shape, options);
  const ProbeMove move{ProbeMove::By::Displacement, 0.01 * down, {0.0, 0.5, 0.0}};
  ASSERT_TRUE(one.lead({move}).converged) << one.failure();
  ASSERT_TRUE(other.lead({move}).converged) << other.failure();
  EXPECT_LT((one.force() - other.force()).norm(), tolerance(1e-6) * one.force().norm());
  EXPECT_LT(one.force().y(), -1.0);
  // The block is square, so a quarter turn of the rod about the middle presses as hard.
  PressSession across(body, law, capsule, options), along(body, law, capsule, options);
  ASSERT_TRUE(along.move_to(0.008 * down).converged);
  ASSERT_TRUE(across.lead({{ProbeMove::By::Displacement, 0.008 * down, {0.0, 0.5 * std::numbers::pi, 0.0}}}).converged);
  EXPECT_NEAR(across.force().y() / along.force().y(), 1.0, 0.03);
}

TEST_F(Session, AProbeInTheAirIsRefused) {
  EXPECT_THROW(PressSession(body, law, {ProbeKind::BondedDisc, {0.0, 0.3, 0.0}, 0.03, {}}, options), InputError);
}

TEST(SurfaceFollower, FollowsAffineDeformationsExactlyAndOthersSmoothly) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {4, 3, 3}, false);
  std::vector<Vector3> points;
  for (double a = -0.1; a <= 0.1; a += 0.005) points.emplace_back(a, 0.05, 0.3 * a);
  const SurfaceFollower follower(*body, points);
  Matrix3 A;
  A << 1.2, 0.1, 0.0, -0.2, 0.9, 0.1, 0.1, 0.0, 1.1;
  const Points moved = follower.positions(body->nodes * A.transpose());
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_LT((moved.row(Eigen::Index(i)).transpose() - A * points[i]).norm(), tolerance(1e-12));
  // A smooth bend is followed to the second order of the elements' size, without jumps between neighbours.
  Points bent = body->nodes;
  bent.col(1).array() += 2.0 * bent.col(0).array().square();
  const Points curve = follower.positions(bent);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_NEAR(curve(Eigen::Index(i), 1), 0.05 + 2.0 * points[i].x() * points[i].x(), 0.004);
}

}  // namespace
}  // namespace pliant::press_session_test
