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
