#include "mismatch/point_tracks.hpp"

#include "mismatch/surface_constraints.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::point_tracks_test {
namespace {

using test::tolerance;

class Tracks : public ::testing::TestWithParam<test::BodyKind> {
 protected:
  Tracks() {
    for (int n = 0; n < body->node_count(); n += 7) rest.push_back(body->nodes.row(n).transpose());
  }
  std::shared_ptr<const Body> body = GetParam().make();
  std::vector<Vector3> rest;
};

TEST_P(Tracks, NodesAreFollowedExactlyAndRowsMayBeMissing) {
  const PointTracks tracks(*body, rest);
  const Points x = test::deformed(body->nodes, 0.3);
  std::vector<TrackObservation> seen;
  for (int i = 1; i < tracks.count(); i += 2) seen.push_back({i, Vector3(x.row(7 * i)) + Vector3(0, 0.5, 0), 1e-3});
  const Points r = tracks.residuals(seen, x);
  ASSERT_EQ(r.rows(), Eigen::Index(seen.size()));
  for (Eigen::Index i = 0; i < r.rows(); ++i)
    EXPECT_LT((r.row(i) - Eigen::RowVector3d(0, -0.5, 0)).norm(), tolerance(1e-9));
}

TEST_P(Tracks, AdjointIsTheTransposeOfTheTangentWhichIsTheDerivative) {
  const PointTracks tracks(*body, rest);
  const Points x = test::deformed(body->nodes, 0.3), d = test::deformed(body->nodes, 0.8, 0.4);
  const std::vector<TrackObservation> seen = {{0, Vector3::Zero(), 1.0}, {tracks.count() - 1, Vector3::Ones(), 1.0}};
  const Points tangent = tracks.tangent(seen, d);
  EXPECT_LT((tracks.residuals(seen, x + d) - tracks.residuals(seen, x) - tangent).norm(),
            tolerance(1e-12) * tangent.norm());
  const Points bar = Points::Random(2, 3);
  Points x_bar = Points::Zero(x.rows(), 3);
  tracks.add_adjoint(seen, bar, x_bar);
  EXPECT_NEAR(x_bar.cwiseProduct(d).sum(), bar.cwiseProduct(tangent).sum(), tolerance(1e-12) * tangent.norm());
}

INSTANTIATE_TEST_SUITE_P(Kinds, Tracks, ::testing::ValuesIn(test::body_kinds()),
                         [](const auto& kind) { return kind.param.name; });

/// The same surface mismatch serves tetrahedra: a lattice laid over them follows their nodes.
class SurfaceOverTetrahedra : public ::testing::TestWithParam<bool> {};

TEST_P(SurfaceOverTetrahedra, PointsMovedRigidlyWithTheBodyKeepTheirDistances) {
  const Vector3 size(0.2, 0.1, 0.12);
  const auto body = test::tet_body(size, {4, 2, 3}, GetParam());
  const Vector3 half = 0.5 * size;
  const auto distance =
      std::make_shared<SignedDistance>(test::centred_box(half + Vector3::Constant(0.06)), 0.004, [=](const Vector3& p) {
        const Vector3 q = p.cwiseAbs() - half;
        return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
      });
  const SurfaceConstraints constraints(body, distance, 0.03, 0.02);
  const Matrix3 R = Eigen::AngleAxisd(1.1, Vector3(1, 2, 2) / 3.0).toRotationMatrix();
  const Vector3 t(0.3, -0.2, 0.1);
  const Points moved = (body->nodes * R.transpose()).rowwise() + t.transpose();
  std::vector<SurfaceObservation> points;
  for (const double height : {-0.01, 0.0, 0.015})
    points.push_back({R * Vector3(0.03, half.y() + height, 0.01) + t, 1e-3});
  const auto matches = constraints.match(points, moved);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_GE(matches[i].cell, 0);
    EXPECT_NEAR(matches[i].distance, (R.transpose() * (points[i].position - t)).y() - half.y(), 1e-4);
  }
  const Points d = test::deformed(body->nodes, 0.4, 0.2);
  const VectorX tangent = constraints.tangents(matches, {&d, 1}).col(0), bar = VectorX::LinSpaced(3, 1.0, 2.0);
  EXPECT_NEAR(constraints.adjoint(matches, bar).cwiseProduct(d).sum(), bar.dot(tangent),
              tolerance(1e-11) * tangent.norm());
}

INSTANTIATE_TEST_SUITE_P(Orders, SurfaceOverTetrahedra, ::testing::Bool());

TEST(SurfaceLattice, NeedsACellSize) {
  const auto body = test::tet_body({0.2, 0.1, 0.1}, {2, 1, 1}, false);
  const auto distance = std::make_shared<SignedDistance>(test::sphere_distance(0.1, 0.01, 0.05));
  EXPECT_THROW(SurfaceConstraints(body, distance, 0.03), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::point_tracks_test
