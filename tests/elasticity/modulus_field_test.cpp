#include "elasticity/modulus_field.hpp"

#include "base/error.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::modulus_field_test {
namespace {

using test::tolerance;

class Field : public ::testing::TestWithParam<test::BodyKind> {
 protected:
  std::shared_ptr<const Body> body = GetParam().make();
  void expect_partition(const ControlledField& field, int controls) const {
    ASSERT_EQ(field.field.controls, controls);
    ASSERT_EQ(field.field.weights.rows(), body->element_count());
    for (int e = 0; e < body->element_count(); ++e) {
      EXPECT_NEAR(field.field.weights.row(e).sum(), 1.0, tolerance(1e-12)) << "element " << e;
      EXPECT_GE(field.field.weights.row(e).minCoeff(), -1e-12) << "element " << e;
    }
  }
};

TEST_P(Field, LinearWeightsReproduceTheCoordinate) {
  const ControlledField field = linear_field(*body, Vector3::UnitX(), 4);
  expect_partition(field, 4);
  for (int e = 0; e < body->element_count(); ++e) {
    double x = 0.0;
    for (int k = 0; k < 4; ++k) x += field.field.weights(e, k) * field.points[std::size_t(k)].x();
    EXPECT_NEAR(x, element_centre(*body, e).x(), tolerance(1e-12));
  }
}

TEST_P(Field, HarmonicWeightsObeyTheMaximumPrincipleAndFavourTheNearest) {
  const std::vector<Vector3> points = farthest_points(*body, 3);
  const ControlledField field = harmonic_field(*body, points);
  expect_partition(field, 3);
  for (std::size_t k = 0; k < points.size(); ++k) {
    Eigen::Index most = 0;
    field.field.weights.col(Eigen::Index(k)).maxCoeff(&most);
    const Vector3 centre = element_centre(*body, int(most));
    for (std::size_t other = 0; other < points.size(); ++other)
      if (other != k) {
        EXPECT_LT((centre - points[k]).norm(), (centre - points[other]).norm());
      }
  }
}

TEST_P(Field, InverseDistanceWeightsArePartitionsToo) {
  expect_partition(inverse_distance_field(*body, farthest_points(*body, 3)), 3);
}

TEST_P(Field, RegionsAreSharpAwayFromTheirBorder) {
  const auto right = [](const Vector3& p) { return p.x() > 0.0; };
  const ControlledField field = region_field(*body, {right});
  expect_partition(field, 2);
  int pure = 0;
  for (int e = 0; e < body->element_count(); ++e) {
    bool all_right = true, all_left = true;
    for (const int n : body->element(e)) (body->nodes(n, 0) > 0.0 ? all_left : all_right) = false;
    if (all_right || all_left) ++pure;
    if (all_right) {
      EXPECT_EQ(field.field.weights(e, 1), 1.0);
    }
    if (all_left) {
      EXPECT_EQ(field.field.weights(e, 0), 1.0);
    }
  }
  EXPECT_GT(pure, 0);
}

TEST_P(Field, WeightsAtPointsOfTheSurfaceFillTheInside) {
  // What is linear along x at the surface is so inside; given up to a factor at each point.
  const double low = body->nodes.col(0).minCoeff(), high = body->nodes.col(0).maxCoeff();
  std::vector<int> elements(std::size_t(body->node_count()), 0);
  for (const int n : body->connectivity) ++elements[std::size_t(n)];
  std::vector<Vector3> points;
  for (int n = 0; n < body->node_count(); ++n) {
    const Vector3 p = body->nodes.row(n).transpose();
    bool is_outside = body->kind == ElementKind::Hexahedron && elements[std::size_t(n)] < 8;
    for (int d = 0; d < 3; ++d)
      is_outside |= p[d] < body->nodes.col(d).minCoeff() + 1e-9 || p[d] > body->nodes.col(d).maxCoeff() - 1e-9;
    if (is_outside) points.push_back(p);
  }
  MatrixX weights(Eigen::Index(points.size()), 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double s = (points[i].x() - low) / (high - low), factor = 1.0 + double(i % 3);
    weights.row(Eigen::Index(i)) << factor * (1.0 - s), factor * s;
  }
  const ControlledField field = extended_field(*body, points, weights);
  ASSERT_EQ(field.field.controls, 2);
  for (int e = 0; e < body->element_count(); ++e) {
    double mean = 0.0;  // of the element's nodes, as weights are
    for (const int n : body->element(e)) mean += (body->nodes(n, 0) - low) / (high - low) / body->nodes_per_element();
    EXPECT_NEAR(field.field.weights(e, 1), mean, 0.01)
        << "the graph's Laplacian is not quite exact for linear functions";
    EXPECT_NEAR(field.field.weights.row(e).sum(), 1.0, 1e-12);
  }
  EXPECT_LT(field.points[0].x(), field.points[1].x());
}

TEST_P(Field, PointsOnOneNodeAreRefused) {
  const Vector3 p = body->nodes.row(0).transpose();
  EXPECT_THROW(harmonic_field(*body, {p, p}), InputError);
}

TEST_P(Field, FarthestPointsAreSpread) {
  const auto points = farthest_points(*body, 4);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT((points[i] - points[j]).norm(), 0.25 * body->size());
}

INSTANTIATE_TEST_SUITE_P(Kinds, Field, ::testing::ValuesIn(test::body_kinds()),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace pliant::modulus_field_test
