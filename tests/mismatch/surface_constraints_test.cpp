#include "mismatch/surface_constraints.hpp"

#include <numbers>
#include <random>

#include "support/bodies.hpp"
#include "support/convergence.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::surface_constraints_test {
namespace {

using test::tolerance;

constexpr double major = 0.1, minor = 0.04, band = 0.03;

struct Torus {
  explicit Torus(double cell, double spacing = 0.004)
      : body(test::torus_body(major, minor, cell)),
        distance(std::make_shared<SignedDistance>(test::torus_distance(major, minor, spacing, 0.1))),
        constraints(body, distance, band) {}
  const Points& X() const { return body->reference_positions(); }
  std::shared_ptr<const Body> body;
  std::shared_ptr<const SignedDistance> distance;
  SurfaceConstraints constraints;
};

/// Points `away` from the torus along its normal.
std::vector<Vector3> torus_points(double away, int count, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(0.0, 6.283185307179586);
  std::vector<Vector3> points;
  for (int n = 0; n < count; ++n) {
    const double a = angle(random), b = angle(random), r = minor + away;
    const double ring = major + r * std::cos(b);
    points.emplace_back(ring * std::cos(a), r * std::sin(b), ring * std::sin(a));
  }
  return points;
}

Vector3 bent(const Vector3& p, double angle = 1.2) {
  Points one(1, 3);
  one.row(0) = p.transpose();
  const Matrix3 R = Eigen::AngleAxisd(angle, Vector3(0.3, -0.8, 0.5).normalized()).toRotationMatrix();
  const Vector3 s = p / major;
  return R * (p + 0.1 * major * Vector3(std::sin(s.y() + 0.5 * s.z()), 0.5 * s.x() * s.z(), std::cos(s.x()))) +
         Vector3(0.02, 0.1, -0.03);
}
Points bent(const Points& X) {
  Points x(X.rows(), 3);
  for (Eigen::Index n = 0; n < X.rows(); ++n) x.row(n) = bent(Vector3(X.row(n).transpose())).transpose();
  return x;
}

std::vector<SurfaceObservation> observed(const std::vector<Vector3>& points) {
  std::vector<SurfaceObservation> list;
  for (const Vector3& p : points) list.push_back({p, 1e-3});
  return list;
}

TEST(DisplacementExtension, ContinuesAffineMotionExactly) {
  const Torus torus(0.04);
  const DisplacementExtension& E = torus.constraints.extension();
  ASSERT_GT(E.rest_positions().rows(), torus.X().rows()) << "there is no band";
  Matrix3 A;
  A << 0.2, -1.3, 0.4, 1.1, -0.6, 0.3, -0.2, 0.5, 0.7;  // a large turn and stretch
  const Eigen::RowVector3d b(0.1, -0.2, 0.3);
  const Points u = (torus.X() * A.transpose()).rowwise() + b;
  const Points expected = (E.rest_positions() * A.transpose()).rowwise() + b;
  EXPECT_LT((E.apply(u) - expected).cwiseAbs().maxCoeff(), tolerance(1e-12));
}

TEST(DisplacementExtension, KeepsTheBodysOwnDisplacementsAndStaysWithinTheirRange) {
  const Torus torus(0.04);
  const DisplacementExtension& E = torus.constraints.extension();
  const Points u = bent(torus.X()) - torus.X(), g = E.apply(u);
  int own = 0;
  for (Eigen::Index m = 0; m < g.rows(); ++m)
    for (Eigen::Index n = 0; n < u.rows(); ++n)
      if ((E.rest_positions().row(m) - torus.X().row(n)).norm() < 1e-9) {
        ++own;
        EXPECT_EQ((g.row(m) - u.row(n)).norm(), 0.0);
      }
  EXPECT_EQ(own, u.rows());
  EXPECT_LT(g.cwiseAbs().maxCoeff(), 2.0 * u.cwiseAbs().maxCoeff());
}

TEST(DisplacementExtension, TransposeIsTheAdjoint) {
  const Torus torus(0.04);
  const DisplacementExtension& E = torus.constraints.extension();
  const Points u = test::deformed(torus.X(), 0.4), g = test::deformed(E.rest_positions(), -0.3, 0.4);
  const double one = E.apply(u).cwiseProduct(g).sum(), other = E.apply_transpose(g).cwiseProduct(u).sum();
  ASSERT_NE(one, 0.0);
  EXPECT_NEAR(one, other, tolerance(1e-12) * E.apply(u).norm() * g.norm());
}

TEST(SurfaceConstraints, PointsOnTheDeformedSurfaceHaveNoDistance) {
  const std::vector<double> cells = {0.04, 0.028, 0.02};
  const std::vector<Vector3> rest = torus_points(0.0, 400);
  std::vector<Vector3> points;
  for (const Vector3& p : rest) points.push_back(bent(p));
  std::vector<double> errors;
  for (const double cell : cells) {
    const Torus torus(cell, 0.0015);
    const auto matches = torus.constraints.match(observed(points), bent(torus.X()));
    double sum = 0.0;
    for (const PointMatch& m : matches) {
      ASSERT_GE(m.cell, 0);
      sum += m.distance * m.distance;
    }
    errors.push_back(std::sqrt(sum / double(matches.size())));
  }
  RecordProperty("rms", std::to_string(errors[0]) + " .. " + std::to_string(errors[2]));
  RecordProperty("order", std::to_string(test::fitted_order(cells, errors)));
  EXPECT_LT(errors.back(), 2e-3 * major);
  EXPECT_GT(test::fitted_order(cells, errors), 1.5);  // trilinear cells: two
}

TEST(SurfaceConstraints, ARigidlyMovedBodyKeepsTrueDistances) {
  const Torus torus(0.04, 0.002);
  const Matrix3 R = Eigen::AngleAxisd(2.3, Vector3(0.2, 1.0, -0.7).normalized()).toRotationMatrix();
  const Eigen::RowVector3d t(0.4, -0.1, 0.2);
  const Points moved = (torus.X() * R.transpose()).rowwise() + t;
  for (const double away : {-0.02, -0.005, 0.0, 0.01, 0.025}) {
    std::vector<Vector3> points = torus_points(away, 100);
    for (Vector3& p : points) p = R * p + t.transpose();
    for (const PointMatch& m : torus.constraints.match(observed(points), moved)) {
      ASSERT_GE(m.cell, 0);
      EXPECT_NEAR(m.distance, away, tolerance(1e-4));  // spacing^2 / (4 radius), of the distance's own grid
      EXPECT_NEAR(m.stretch, 1.0, tolerance(0.05));    // spacing / (2 radius)
    }
  }
}

/// Where parts of a body are turned against each other by far, each carries the band beside it along: were
/// displacements to die out in the band, it would fold into the body, and points a little outside would lie in no cell.
TEST(SurfaceConstraints, ATwistedBarKeepsItsBand) {
  const double length = 0.14, half = 0.01, cell = 0.005, reach = 0.015;
  const auto body = test::box_body({length, 2 * half, 2 * half}, cell);
  const auto distance = std::make_shared<SignedDistance>(
      test::centred_box({0.5 * length + 0.03, half + 0.03, half + 0.03}), 0.001, [=](const Vector3& p) {
        const Vector3 q = p.cwiseAbs() - Vector3(0.5 * length, half, half);
        return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
      });
  const SurfaceConstraints constraints(body, distance, reach);
  const auto twisted = [&](const Vector3& p) -> Vector3 {
    return Eigen::AngleAxisd(std::numbers::pi * p.x() / length, Vector3::UnitX()) * p;
  };
  Points positions = body->reference_positions();
  for (Eigen::Index n = 0; n < positions.rows(); ++n)
    positions.row(n) = twisted(positions.row(n).transpose()).transpose();
  for (const double away : {-0.003, 0.0005, 0.002, 0.008}) {
    std::vector<Vector3> points;
    for (double x = -0.45 * length; x < 0.45 * length; x += 0.0031)
      for (const double side : {-0.6, 0.1, 0.5}) points.push_back(twisted({x, side * half, half + away}));
    for (const PointMatch& m : constraints.match(observed(points), positions)) {
      ASSERT_GE(m.cell, 0) << away;
      // A cell turns by 6.4 degrees from end to end; far out, places so far apart are blended.
      EXPECT_NEAR(m.distance, away, tolerance(2e-4 + 0.05 * std::abs(away)));
    }
  }
}

TEST(SurfaceConstraints, StretchTurnsRestDistancesIntoTrueOnes) {
  const Torus torus(0.04, 0.002);
  const double s = 1.6;
  std::vector<Vector3> points = torus_points(0.01, 100);
  for (Vector3& p : points) p *= s;
  for (const PointMatch& m : torus.constraints.match(observed(points), s * torus.X()))
    EXPECT_NEAR(m.distance / m.stretch, s * 0.01, tolerance(5e-4));
}

TEST(SurfaceConstraints, PointsBeyondTheBandAreNotMatched) {
  const Torus torus(0.04);
  const std::vector<Vector3> far = {Vector3(0.5, 0, 0), Vector3(0, 0.3, 0), Vector3(-1, -1, -1)};
  for (const PointMatch& m : torus.constraints.match(observed(far), torus.X())) EXPECT_EQ(m.cell, -1);
  // Within it every point is.
  for (const PointMatch& m : torus.constraints.match(observed(torus_points(0.95 * band, 300)), torus.X()))
    EXPECT_GE(m.cell, 0);
  const auto matches = torus.constraints.match(observed(far), torus.X());
  const Points d = torus.X();
  EXPECT_EQ(torus.constraints.tangents(matches, {&d, 1}).norm(), 0.0);
  EXPECT_EQ(torus.constraints.adjoint(matches, VectorX::Ones(3)).norm(), 0.0);
}

/// Distances of a point in every deformed cell that contains it, found without any tree.
std::vector<double> distances_in_all_cells(const Torus& torus, const Points& positions, const Vector3& point) {
  const DisplacementExtension& E = torus.constraints.extension();
  const Points x = E.rest_positions() + E.apply(positions - torus.X());
  std::vector<double> found;
  for (std::size_t c = 0; c < E.cells().size(); ++c) {
    Vector3 local = Vector3::Constant(0.5);
    Matrix3 J;
    bool usable = true;
    for (int iteration = 0; iteration < 30 && usable; ++iteration) {
      const auto N = shape_functions(local);
      const auto G = shape_gradients(local);
      Vector3 r = -point;
      J.setZero();
      for (int a = 0; a < 8; ++a) {
        const Vector3 at = x.row(E.cells()[c][a]);
        r += N[a] * at;
        J += at * G.row(a);
      }
      usable = J.determinant() > 1e-3 * std::pow(E.cell_size(), 3) && (local.array() - 0.5).abs().maxCoeff() < 2.0;
      local -= J.inverse() * r;
    }
    if (!usable || (local.array() < 0.0).any() || (local.array() > 1.0).any()) continue;
    found.push_back(torus.distance->value(E.cell_corners()[c] + E.cell_size() * local));
  }
  return found;
}

TEST(SurfaceConstraints, FindsEveryCellAndTakesTheSmallestDistanceWhereTheBodyMeetsItself) {
  const Torus torus(0.04);
  Points folded = torus.X();  // the two sides of the ring are pushed into each other
  for (Eigen::Index n = 0; n < folded.rows(); ++n) folded(n, 0) -= 0.09 * std::tanh(folded(n, 0) / 0.05);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Vector3> points;
  for (int n = 0; n < 400; ++n)
    points.emplace_back(0.07 * uniform(random), 0.05 * uniform(random), 0.1 * uniform(random));
  const auto matches = torus.constraints.match(observed(points), folded);
  int several = 0, found = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto all = distances_in_all_cells(torus, folded, points[i]);
    if (all.empty()) continue;
    ++found;
    ASSERT_GE(matches[i].cell, 0) << points[i].transpose();
    const auto by_size = [](double a, double b) { return std::abs(a) < std::abs(b); };
    const double least = *std::min_element(all.begin(), all.end(), by_size),
                 most = *std::max_element(all.begin(), all.end(), by_size);
    several += std::abs(most) > std::abs(least) + 1e-4;
    EXPECT_NEAR(std::abs(matches[i].distance), std::abs(least), tolerance(1e-8));
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(several, 20) << "no point lies in two parts of the body: the test would prove nothing";
}

TEST(SurfaceConstraints, TangentMatchesCentralDifferencesAndAdjointTheTangent) {
  const Torus torus(0.04, 0.002);
  const Points x = bent(torus.X()), direction = test::deformed(torus.X(), 0.8, 0.5);
  std::vector<Vector3> points = torus_points(0.007, 60);
  for (Vector3& p : points) p = bent(p);
  points.emplace_back(9, 9, 9);  // and one that matches nothing
  const auto seen = observed(points);
  const auto matches = torus.constraints.match(seen, x);
  const VectorX tangent = torus.constraints.tangents(matches, {&direction, 1}).col(0);
  ASSERT_GT(tangent.head(60).cwiseAbs().minCoeff(), 0.0);
  EXPECT_EQ(tangent[60], 0.0);
  const auto along = [&](double h) {
    VectorX d(61);
    const auto moved = torus.constraints.match(seen, x + h * direction);
    for (int i = 0; i <= 60; ++i) d[i] = moved[std::size_t(i)].distance;
    return d;
  };
  EXPECT_LT(test::best_relative_error(along, tangent, 1e-3), tolerance(1e-6));
  EXPECT_GT(test::best_relative_error(along, 1.01 * tangent, 1e-3), 1e-3) << "a wrong derivative would pass";
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  VectorX bar(61);
  for (double& b : bar) b = normal(random);
  const Points x_bar = torus.constraints.adjoint(matches, bar);
  EXPECT_NEAR(bar.dot(tangent), x_bar.cwiseProduct(direction).sum(), tolerance(1e-12) * bar.norm() * tangent.norm());
}

TEST(SurfaceConstraints, TangentsOfSeveralDirectionsAreThoseOfTheWholeExtension) {
  const Torus torus(0.04, 0.002);
  const DisplacementExtension& E = torus.constraints.extension();
  const Points x = bent(torus.X());
  std::vector<Vector3> points = torus_points(0.007, 60);
  for (Vector3& p : points) p = bent(p);
  points.emplace_back(9, 9, 9);
  const auto matches = torus.constraints.match(observed(points), x);
  const std::vector<Points> directions = {test::deformed(torus.X(), 0.8, 0.5), test::deformed(torus.X(), -0.3, 0.2)};
  const MatrixX tangents = torus.constraints.tangents(matches, directions);
  ASSERT_EQ(tangents.rows(), 61);
  ASSERT_EQ(tangents.cols(), 2);
  for (int c = 0; c < 2; ++c) {
    const Points g = E.apply(directions[std::size_t(c)]);
    for (int i = 0; i < 60; ++i) {
      const PointMatch& m = matches[std::size_t(i)];
      Vector3 moved = Vector3::Zero();
      for (int a = 0; a < 8; ++a) moved += m.weights[a] * g.row(E.cells()[m.cell][a]).transpose();
      EXPECT_NEAR(tangents(i, c), m.direction.dot(moved), tolerance(1e-12)) << i;
    }
  }
  EXPECT_GT((tangents.col(0) - tangents.col(1)).norm(), 1e-3);
  EXPECT_EQ(torus.constraints.tangents(matches, {}).cols(), 0);
}

TEST(RobustLoss, IsHalfTheSquareNearZeroAndConstantBeyondItsScale) {
  const RobustLoss loss{0.02};
  EXPECT_NEAR(loss.value(1e-4), 0.5e-8, 1e-12);
  EXPECT_EQ(loss.value(0.0), 0.0);
  EXPECT_EQ(loss.value(0.02), loss.outlier());
  EXPECT_EQ(loss.value(-5.0), loss.outlier());
  EXPECT_EQ(loss.derivative(0.021), 0.0);
  EXPECT_DOUBLE_EQ(loss.outlier(), 0.02 * 0.02 / 6.0);
  double last = 0.0;
  for (double r = 0.0; r < 0.03; r += 1e-4) {
    EXPECT_GE(loss.value(r), last) << "a point that leaves must never lower the cost";
    EXPECT_DOUBLE_EQ(loss.value(-r), loss.value(r));
    last = loss.value(r);
  }
}

TEST(RobustLoss, DerivativeMatchesDifferencesAndIsContinuousAtTheEdge) {
  const RobustLoss loss{0.02};
  for (const double r : {-0.015, -0.003, 0.001, 0.01, 0.019}) {
    const auto along = [&](double h) { return VectorX::Constant(1, loss.value(r + h)); };
    EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, loss.derivative(r)), 1e-2), tolerance(1e-7));
  }
  const double h = 1e-7;
  EXPECT_NEAR(loss.value(0.02 - h), loss.value(0.02 + h), 1e-15);
  EXPECT_NEAR(loss.derivative(0.02 - h), loss.derivative(0.02 + h), 1e-10);
  EXPECT_NEAR((loss.derivative(0.02 - h) - loss.derivative(0.02 - 2 * h)) / h, 0.0, 1e-3);
}

}  // namespace
}  // namespace pliant::surface_constraints_test
