#include "photos/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/primitives.hpp"

namespace pliant::test::probe_test {
namespace {

using testing::HasSubstr;

const ProbeShape shape{0.06, 0.05, 0.006};

Sighting at(const Vector3& place) {
  Sighting s;
  s.dots = {0, 0, 0};
  s.position = place;
  s.covariance = 1e-10 * Matrix3::Identity();  // 0.01 mm
  return s;
}

TEST(FindProbe, TipLiesBeyondTheNearerDot) {
  const TriangleMesh ball = make_sphere(0.05, 3);
  const Vector3 down(0.6, -0.8, 0.0), tip(0.0, 0.04, 0.01);
  const std::vector<Sighting> dots = {at(tip - 0.11 * down), at(tip - 0.05 * down), at(Vector3(0.3, 0.3, 0.3))};
  const FoundProbe found = find_probe(dots, shape, ball, 2.0);
  ASSERT_TRUE(found.pose) << found.failure;
  EXPECT_LT((found.pose->tip - tip).norm(), 1e-12);
  EXPECT_LT((found.pose->direction - down).norm(), 1e-12);
  // sqrt((1 + 5/6)^2 + (5/6)^2) times the factor
  EXPECT_NEAR(found.pose->tip_sigma, 2.0 * 2.0138 * 1e-5, 1e-8);
}

TEST(FindProbe, SaysWhyThereIsNone) {
  const TriangleMesh ball = make_sphere(0.05, 2);
  const Vector3 a(0, 0.1, 0), b(0, 0.16, 0), c(0.06, 0.1, 0);
  EXPECT_THAT(find_probe(std::vector{at(a)}, shape, ball, 1.0).failure, HasSubstr("only 1 of"));
  EXPECT_THAT(find_probe(std::vector{at(a), at(1.05 * b)}, shape, ball, 1.0).failure,
              HasSubstr("60.0 mm apart; the nearest to it are 68.0 mm"));
  EXPECT_THAT(find_probe(std::vector{at(a), at(b), at(c)}, shape, ball, 1.0).failure, HasSubstr("2 pairs"));
}

TEST(ContactOf, IsWhereTheAxisEnters) {
  const TriangleMesh box = make_box(Vector3(0.2, 0.1, 0.2), 0.05);
  const Vector3 down(0.6, -0.8, 0.0);
  const Vector3 pushed_in = Vector3(0.01, 0.05, 0.02) + 0.07 * down;  // below the middle, nearer to the bottom
  EXPECT_LT((*contact_of({pushed_in, down, 0.0}, box, 0.2) - Vector3(0.01, 0.05, 0.02)).norm(), 1e-12);
  const Vector3 pulled = Vector3(0.01, 0.05, 0.02) - 0.03 * down;
  EXPECT_LT((*contact_of({pulled, down, 0.0}, box, 0.2) - Vector3(0.01, 0.05, 0.02)).norm(), 1e-12);
  EXPECT_FALSE(contact_of({pulled, down, 0.0}, box, 0.02));
  EXPECT_FALSE(contact_of({Vector3(0.5, 0.2, 0.0), Vector3(0, -1, 0), 0.0}, box, 1.0));
}

}  // namespace
}  // namespace pliant::test::probe_test
