#include "motion/rotation_strain_step.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>

#include "motion/simulation.hpp"
#include "support/bodies.hpp"

namespace pliant::rotation_strain_step_test {
namespace {

Box slender() {
  Box box;
  box.extend(Vector3(0, 0, 0));
  box.extend(Vector3(1.0, 0.2, 0.1));
  return box;
}

std::shared_ptr<const Body> bar(ElementKind kind) {
  if (kind == ElementKind::Hexahedron) return test::box_body(Vector3(1.0, 0.2, 0.1), 0.1);
  return std::make_shared<Body>(
      make_body(make_tet_box(slender(), {10, 2, 1}, kind == ElementKind::QuadraticTetrahedron)));
}

std::vector<int> nodes_where(const Body& body, const std::function<bool(const Vector3&)>& is_in) {
  std::vector<int> found;
  for (int n = 0; n < body.node_count(); ++n)
    if (is_in(body.nodes.row(n).transpose())) found.push_back(n);
  return found;
}

class TurningStepOf : public testing::TestWithParam<ElementKind> {};
INSTANTIATE_TEST_SUITE_P(Elements, TurningStepOf,
                         testing::Values(ElementKind::Hexahedron, ElementKind::Tetrahedron,
                                         ElementKind::QuadraticTetrahedron));

TEST_P(TurningStepOf, TurnsARigidBodyWithoutStretchingIt) {
  const auto body = bar(GetParam());
  RotationStrainStep step(body, SolverKind::Automatic);
  const double least = body->nodes.col(0).minCoeff(), height = body->nodes.col(2).minCoeff();
  const Vector3 about(least, 0.0, height), turn(0.0, 1.2, 0.0);
  ASSERT_TRUE(step.fix(
      nodes_where(*body, [&](const Vector3& p) { return std::abs(p.x() - least) + std::abs(p.z() - height) < 1e-9; })));
  Points d(body->node_count(), 3), turned = d, out = d;
  const Matrix3 R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  for (int n = 0; n < body->node_count(); ++n) {
    const Vector3 lever = body->nodes.row(n).transpose() - about;
    d.row(n) = turn.cross(lever).transpose();
    turned.row(n) = (about + R * lever).transpose();
  }
  EXPECT_NEAR(step.prepare(body->nodes, d), turn.norm(), 1e-9);
  step.move(1.0, out);
  EXPECT_LT((out - turned).rowwise().norm().maxCoeff(), 1e-5);
  EXPECT_GT((body->nodes + d - turned).rowwise().norm().maxCoeff(), 0.5) << "along straight lines";
}

TEST_P(TurningStepOf, IsTheDisplacementItselfUpToItsSquare) {
  const auto body = bar(GetParam());
  RotationStrainStep step(body, SolverKind::Automatic);
  const double least = body->nodes.col(0).minCoeff();
  const std::vector<int> held = nodes_where(*body, [&](const Vector3& p) { return p.x() < least + 1e-9; });
  ASSERT_TRUE(step.fix(held));
  Points d(body->node_count(), 3), out = d;
  for (int n = 0; n < body->node_count(); ++n) {
    const Vector3 p = body->nodes.row(n).transpose() - Vector3(least, 0, 0);
    d.row(n) = (p.x() * Vector3(p.y(), 0.3 * p.x(), std::sin(3.0 * p.x()))).transpose();
  }
  step.prepare(body->nodes, d);
  const auto beyond = [&](double share) {
    step.move(share, out);
    for (const int n : held) EXPECT_EQ(out.row(n), body->nodes.row(n));
    return (out - body->nodes - share * d).norm();
  };
  const double far = beyond(0.1), near = beyond(0.01);
  EXPECT_NEAR(std::log10(far / near), 2.0, 0.1);
}

TEST(RotationStrainStep, NeedsNodesThatAreFixed) {
  RotationStrainStep step(bar(ElementKind::Tetrahedron), SolverKind::Automatic);
  EXPECT_FALSE(step.fix({}));
  EXPECT_TRUE(step.fix({0, 1, 2}));
}

}  // namespace
}  // namespace pliant::rotation_strain_step_test
