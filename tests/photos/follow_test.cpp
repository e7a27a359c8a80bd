#include "photos/follow.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>

namespace pliant::test::follow_test {
namespace {

/// A sheet of markers about 10 mm apart, irregular as painted by hand.
Points sheet(double jitter) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> part(-jitter, jitter);
  Points points(15 * 15, 3);
  for (int i = 0; i < 15; ++i)
    for (int j = 0; j < 15; ++j)
      points.row(15 * i + j) << 0.01 * (i + part(random)), 0.003 * part(random), 0.01 * (j + part(random));
  return points;
}

/// Pushed at the middle by `way` [m], and dragged along the sheet by half as much.
Points pushed(const Points& rest, double way) {
  Points out = rest;
  for (Eigen::Index i = 0; i < rest.rows(); ++i) {
    const Vector3 p = rest.row(i);
    const double bell = std::exp(-0.5 * (p - Vector3(0.07, 0.0, 0.07)).squaredNorm() / (0.028 * 0.028));
    out.row(i) += way * bell * Eigen::RowVector3d(0.4, -1.0, 0.3);
  }
  return out;
}

struct Shuffled {
  Points points;
  std::vector<int> marker_of;  // -1: a point that is no marker
};

Shuffled shuffled(const Points& points, const std::vector<bool>& hidden, int strays) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> part(0.0, 0.14);
  std::vector<int> order(std::size_t(points.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](int i) { return hidden[std::size_t(i)]; });
  order.insert(order.end(), std::size_t(strays), -1);
  std::shuffle(order.begin(), order.end(), random);
  Shuffled out{Points(Eigen::Index(order.size()), 3), order};
  for (std::size_t k = 0; k < order.size(); ++k)
    if (order[k] >= 0)
      out.points.row(Eigen::Index(k)) = points.row(order[k]);
    else
      out.points.row(Eigen::Index(k)) << part(random), -0.3 * part(random), part(random);
  return out;
}

struct Outcome {
  int right = 0, wrong = 0;
};

Outcome judge(const Followed& followed, const Shuffled& truth) {
  Outcome out;
  for (std::size_t i = 0; i < followed.candidate.size(); ++i)
    if (const int c = followed.candidate[i]; c >= 0)
      ++(truth.marker_of[std::size_t(c)] == int(i) ? out.right : out.wrong);
  return out;
}

TEST(FollowMarkers, DisplacementsOfSeveralSpacings) {
  const Points rest = sheet(0.25);
  const std::vector<bool> all_seen(std::size_t(rest.rows()), false);
  for (const double way : {0.005, 0.02, 0.035}) {
    const Shuffled seen = shuffled(pushed(rest, way), all_seen, 0);
    const Followed followed = follow_markers(rest, rest, seen.points);
    const Outcome outcome = judge(followed, seen);
    EXPECT_EQ(outcome.wrong, 0) << way;
    EXPECT_GE(outcome.right, 215) << way;
  }
}

/// Markers under the probe are hidden, and there are points that are none.
TEST(FollowMarkers, HiddenMarkersAndStrayPoints) {
  const Points rest = sheet(0.25);
  std::vector<bool> hidden(std::size_t(rest.rows()), false);
  for (Eigen::Index i = 0; i < rest.rows(); ++i)
    hidden[std::size_t(i)] = (rest.row(i) - Eigen::RowVector3d(0.07, 0, 0.07)).norm() < 0.018 || i % 17 == 0;
  const Shuffled seen = shuffled(pushed(rest, 0.03), hidden, 20);
  const Followed followed = follow_markers(rest, rest, seen.points);
  const Outcome outcome = judge(followed, seen);
  EXPECT_EQ(outcome.wrong, 0);
  const auto shown = std::ranges::count(hidden, false);
  EXPECT_GE(outcome.right, shown * 85 / 100);
  for (std::size_t i = 0; i < hidden.size(); ++i) EXPECT_TRUE(!hidden[i] || followed.candidate[i] == -1);
}

/// What was seen of hidden markers' neighbours says where they are.
TEST(FollowMarkers, ExpectsHiddenMarkersWhereTheyAre) {
  const Points rest = sheet(0.25), now = pushed(rest, 0.02);
  std::vector<bool> hidden(std::size_t(rest.rows()), false);
  hidden[112] = hidden[40] = true;
  const Followed followed = follow_markers(rest, rest, shuffled(now, hidden, 0).points);
  EXPECT_EQ(followed.expected.rows(), rest.rows());
  EXPECT_LT((followed.expected.row(112) - now.row(112)).norm(), 0.003);
  EXPECT_GT((rest.row(112) - now.row(112)).norm(), 0.015);
}

/// A turned sheet is followed from a prediction that turned with it.
TEST(FollowMarkers, GoesOnFromAPrediction) {
  const Points rest = sheet(0.25);
  const Matrix3 turn = Eigen::AngleAxisd(1.2, Vector3(1, 2, 1).normalized()).toRotationMatrix();
  const Points before = rest * turn.transpose(), now = pushed(rest, 0.012) * turn.transpose();
  const Shuffled seen = shuffled(now, std::vector<bool>(std::size_t(rest.rows()), false), 0);
  EXPECT_EQ(judge(follow_markers(rest, before, seen.points), seen).right, 225);
  EXPECT_EQ(judge(follow_markers(rest, rest, seen.points), seen).wrong, 0);
}

/// Two points that would both do: neither is taken.
TEST(FollowMarkers, DoesNotGuess) {
  const Points rest = sheet(0.25);
  Points twice(rest.rows() + 1, 3);
  twice.topRows(rest.rows()) = rest;
  twice.row(60) += Eigen::RowVector3d(0.0012, 0, 0);
  twice.row(rest.rows()) = rest.row(60) - Eigen::RowVector3d(0.0012, 0, 0);
  const Followed followed = follow_markers(rest, rest, twice);
  EXPECT_EQ(followed.candidate[60], -1);
  EXPECT_EQ(followed.unclear, 1);
  EXPECT_EQ(followed.followed_count(), 224);
}

TEST(FollowMarkers, RefusesWhatIsNotFinite) {
  Points rest = sheet(0.0), bad = rest;
  bad(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)follow_markers(rest, bad, rest), std::invalid_argument);
  EXPECT_THROW((void)follow_markers(rest, rest.topRows(4), rest), std::invalid_argument);
}

TEST(Agreement, KeepsWhatNoAttemptContradicts) {
  const Followed a{{0, 1, 2, -1}, 0, Points::Zero(4, 3)}, b{{0, 3, -1, -1}, 0, Points::Zero(4, 3)},
      c{{-1, 1, -1, 2}, 0, Points::Zero(4, 3)};
  EXPECT_EQ(agreement(std::vector{a, b}).candidate, (std::vector<int>{0, -1, 2, -1}));
  EXPECT_EQ(agreement(std::vector{a, b}).unclear, 1);
  EXPECT_EQ(agreement(std::vector{a, c}).candidate, (std::vector<int>{0, 1, -1, -1})) << "both want point 2";
}

TEST(Spacing, IsThatOfTheSheet) { EXPECT_NEAR(spacing_of(sheet(0.0)), 0.01, 1e-12); }

}  // namespace
}  // namespace pliant::test::follow_test
