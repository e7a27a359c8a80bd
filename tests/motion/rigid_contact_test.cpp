#include "motion/rigid_contact.hpp"

#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::rigid_contact_test {
namespace {

using test::tolerance;

struct ShapeCase {
  std::string name;
  std::shared_ptr<const RigidShape> shape;
  friend void PrintTo(const ShapeCase& c, std::ostream* out) { *out << c.name; }
};
std::vector<ShapeCase> shapes() {
  return {{"HalfSpace", rigid_half_space({0.0, 0.01, 0.0}, {0.2, 1.0, -0.1})},
          {"Ball", rigid_ball({0.01, 0.02, -0.01}, 0.03)},
          {"Capsule", rigid_capsule({-0.05, 0.01, 0.0}, {0.04, -0.02, 0.03}, 0.02)},
          {"Punch", rigid_punch({0.0, 0.01, 0.0}, {0.1, -1.0, 0.2}, 0.025, 0.004)}};
}

struct Shape : ::testing::TestWithParam<ShapeCase> {};

TEST_P(Shape, HasAUnitGradientAndTheDerivativesItSays) {
  const RigidShape& shape = *GetParam().shape;
  int smooth = 0;
  for (int k = 0; k < 60; ++k) {
    const Vector3 p(0.05 * std::sin(3.1 * k), 0.05 * std::sin(1.7 * k + 1.0), 0.05 * std::cos(2.3 * k));
    const RigidShape::Sample s = shape.sample(p);
    EXPECT_NEAR(s.gradient.norm(), 1.0, 1e-12);
    const Vector3 direction = Vector3(0.3, -0.5, 0.8).normalized();
    const double h = 1e-6;
    const RigidShape::Sample a = shape.sample(p - h * direction), b = shape.sample(p + h * direction);
    if ((a.hessian - b.hessian).norm() > 1e-2 * (1.0 + s.hessian.norm())) continue;  // an edge in between
    ++smooth;
    EXPECT_NEAR((b.distance - a.distance) / (2 * h), s.gradient.dot(direction), 1e-8);
    EXPECT_LT(((b.gradient - a.gradient) / (2 * h) - s.hessian * direction).norm(), 1e-6 * (1.0 + s.hessian.norm()));
    const Vector3 foot = p - s.distance * s.gradient;  // the nearest point lies on the surface
    if (s.distance > 0.0) {
      EXPECT_NEAR(shape.sample(foot).distance, 0.0, 1e-12);
    }
  }
  EXPECT_GT(smooth, 40);
}
INSTANTIATE_TEST_SUITE_P(All, Shape, ::testing::ValuesIn(shapes()), [](const auto& c) { return c.param.name; });

TEST(RigidGrid, IsTheMeshsDistanceAndItsOutside) {
  const SignedDistance ball = test::sphere_distance(0.03, 0.002, 0.02);
  const Vector3 p(0.01, 0.035, 0.0);
  EXPECT_NEAR(rigid_grid(ball)->sample(p).distance, p.norm() - 0.03, 1e-4);
  EXPECT_NEAR(rigid_grid(ball, true)->sample(p).distance, 0.03 - p.norm(), 1e-4);
}

TEST(RigidSmoothGrid, IsTheMeshsDistanceWithSmoothDerivatives) {
  const double radius = 0.03;
  const auto shape = rigid_smooth_grid(test::sphere_distance(radius, 0.001, 0.02));
  for (int k = 0; k < 60; ++k) {
    const Vector3 way = Vector3(std::sin(3.1 * k), std::sin(1.7 * k + 1.0), std::cos(2.3 * k)).normalized();
    const Vector3 p = (radius + 0.005 * std::sin(5.0 * k)) * way, direction = Vector3(0.3, -0.5, 0.8).normalized();
    const RigidShape::Sample s = shape->sample(p);
    EXPECT_NEAR(s.distance, p.norm() - radius, 1e-6);
    EXPECT_LT((s.gradient - way).norm(), 1e-3);
    EXPECT_LT((s.hessian - (Matrix3::Identity() - way * way.transpose()) / p.norm()).norm(), 1.0);
    const double h = 1e-6;
    const RigidShape::Sample a = shape->sample(p - h * direction), b = shape->sample(p + h * direction);
    EXPECT_NEAR((b.distance - a.distance) / (2 * h), s.gradient.dot(direction), 1e-7);
    EXPECT_LT(((b.gradient - a.gradient) / (2 * h) - s.hessian * direction).norm(), 1e-4 * s.hessian.norm());
  }
  const Vector3 far(0.2, 0.0, 0.0);
  EXPECT_NEAR(shape->sample(far).distance, 0.17, 1e-3);
}

TEST(RigidContact, TouchesAtRestWithoutPressure) {
  // Faces of coarse elements lie inside a ball that their nodes lie on: without more they would be pressed at rest.
  const auto body = test::tet_body({0.1, 0.02, 0.1}, {3, 1, 3}, false);
  const auto ball = rigid_ball({0.0, -0.11, 0.0}, 0.103);
  RigidContact contact =
      RigidContact::sliding(*body, boundary_samples(*body, 2), ball, Penalty{1e6, 1e-4, Penalty::Onset::Quadratic});
  EXPECT_GT(contact.force(body->nodes, Vector3::Zero()).y(), 1.0);
  contact.touch_at_rest();
  EXPECT_LT(contact.force(body->nodes, Vector3::Zero()).norm(), tolerance(1e-12)) << "rounding alone";
  Points lower = body->nodes;
  lower.col(1).array() -= 1e-3;
  const double force = contact.force(lower, Vector3::Zero()).y();
  EXPECT_GT(force, 1.0);
  // The same way once more meets the full stiffness of what touches.
  lower.col(1).array() -= 1e-3;
  EXPECT_GT(contact.force(lower, Vector3::Zero()).y(), 1.8 * force);
  contact.linearise(lower);
  Points forces = Points::Zero(body->node_count(), 3);
  contact.add_force(lower, forces);
  EXPECT_NEAR(forces.col(1).sum(), contact.force(lower, Vector3::Zero()).y(), tolerance(1e-12) * 1e3);
  EXPECT_THROW(RigidContact::bonded(*body, boundary_samples(*body, 1), 1e3).touch_at_rest(), std::invalid_argument);
}

TEST(DiscSamples, CoverTheDiscWhateverTheMesh) {
  for (const int cells : {2, 5}) {
    const auto body = test::tet_body({0.2, 0.1, 0.2}, {cells, 2, cells}, false);
    const ContactSamples s = disc_samples(*body, {0.03, 0.05, -0.02}, 0.025);
    double area = 0.0;
    for (std::size_t i = 0; i < s.rest.size(); ++i) {
      area += s.area[i];
      EXPECT_NEAR(s.rest[i].y(), 0.05, 1e-12);
      EXPECT_LE((s.rest[i] - Vector3(0.03, 0.05, -0.02)).norm(), 0.025);
    }
    EXPECT_NEAR(area, M_PI * 0.025 * 0.025, 0.02 * area);
    EXPECT_GT(s.rest.size(), 200u);
  }
}

TEST(DiscSamples, StayOnTheirSideOfAThinSheet) {
  const auto body = test::tet_body({0.2, 0.004, 0.2}, {8, 1, 8}, false);
  for (const Vector3& p : disc_samples(*body, {0.0, 0.002, 0.0}, 0.02).rest) EXPECT_GT(p.y(), 0.0);
}

TEST(BoundarySamples, AddUpToTheSurface) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, true);
  const ContactSamples s = boundary_samples(*body, 3);
  double area = 0.0;
  for (const double a : s.area) area += a;
  EXPECT_NEAR(area, 2 * (0.2 * 0.1 + 0.2 * 0.12 + 0.1 * 0.12), 1e-12);
  EXPECT_EQ(s.rest.size(), 9 * std::get<TetMesh>(body->mesh).boundary.size());
}

struct Contact : ::testing::TestWithParam<bool> {
  Contact() : body(test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, false)), contact(make()) {}
  RigidContact make() const {
    const ContactSamples s = disc_samples(*body, {0.0, 0.05, 0.0}, 0.03);
    if (GetParam()) return RigidContact::bonded(*body, s, 1e5);
    return RigidContact::sliding(*body, s, rigid_ball({0.0, 0.07, 0.0}, 0.0225),
                                 Penalty{1e5, 0.004, Penalty::Onset::Quadratic});
  }
  std::shared_ptr<const Body> body;
  RigidContact contact;
};

TEST_P(Contact, PotentialHasItsDerivatives) {
  int touching = 0;
  for (int i = 0; i < contact.points().point_count(); i += 7) {
    const Vector3 y = contact.points().position(i, body->nodes) + Vector3(0.001, 0.0005, -0.002);
    const auto p = contact.potential(i, y, false);
    if (p.energy == 0.0) continue;
    ++touching;
    const Vector3 d(0.4, -0.8, 0.3);
    const auto energy = [&](double h) { return VectorX::Constant(1, contact.potential(i, y + h * d, false).energy); };
    const auto gradient = [&](double h) { return VectorX(contact.potential(i, y + h * d, false).gradient); };
    EXPECT_LT(test::best_relative_error(energy, VectorX::Constant(1, p.gradient.dot(d)), 0.01), tolerance(1e-7));
    EXPECT_LT(test::best_relative_error(gradient, p.hessian * d, 0.01), tolerance(1e-6));
    const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(contact.potential(i, y, true).hessian);
    EXPECT_GE(eigen.eigenvalues()[0], -1e-9 * eigen.eigenvalues()[2]);
  }
  EXPECT_GT(touching, 5);
}

TEST_P(Contact, ForceIsThatOfAllSamples) {
  const Vector3 u(0.002, -0.004, 0.001);
  Points pushed = Points::Zero(body->node_count(), 3);
  for (int i = 0; i < contact.points().point_count(); ++i)
    contact.points().add_transpose(
        i, -contact.potential(i, contact.points().position(i, body->nodes) - u, true).gradient, pushed);
  EXPECT_LT((contact.force(body->nodes, u) - pushed.colwise().sum().transpose()).norm(), 1e-12 * pushed.norm());
  EXPECT_LT(contact.force(body->nodes, u).y(), 0.0);  // pressed from above
}
INSTANTIATE_TEST_SUITE_P(Kinds, Contact, ::testing::Values(true, false),
                         [](const auto& c) { return c.param ? "Bonded" : "Sliding"; });

}  // namespace
}  // namespace pliant::rigid_contact_test
