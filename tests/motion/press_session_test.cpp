#include "motion/press_session.hpp"

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
