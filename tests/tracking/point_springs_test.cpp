#include "tracking/point_springs.hpp"

#include "support/force_terms.hpp"

namespace pliant::point_springs_test {
namespace {

using test::Family;
using test::ForceTerms;
using test::tolerance;

/// Springs of points on the surface, some without stiffness, some without a normal.
struct Springs {
  Springs(const Body& body, double t) : tangential(t) {
    std::vector<Vector3> at;
    for (std::size_t i = 0; i < body.surface.size(); i += 3) at.push_back(body.surface[i].position);
    points = Embedding(body, at);
    const auto n = Eigen::Index(at.size());
    stiffness.resize(n);
    targets.resize(n, 3), normals.resize(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double phase = 1.7 * double(i);
      stiffness[i] = i % 5 == 0 ? 0.0 : 40.0 * (1.5 + std::sin(phase));
      targets.row(i) = (at[std::size_t(i)] + 0.05 * Vector3(std::sin(phase), std::cos(2.0 * phase), 0.3)).transpose();
      const Vector3 normal(std::cos(phase), 0.4, std::sin(3.0 * phase));
      normals.row(i) = (i % 7 == 0 ? 0.0 : 1.0) * normal.normalized().transpose();
    }
  }
  std::unique_ptr<PointSprings> make(const Body& body) const {
    auto term = std::make_unique<PointSprings>(body, points);
    term->set(stiffness, targets, normals, tangential);
    return term;
  }
  double energy(const Points& x) const {
    double sum = 0.0;
    for (int i = 0; i < points.point_count(); ++i) {
      const Vector3 stretch = targets.row(i).transpose() - points.position(i, x);
      const Vector3 n = normals.row(i).transpose();
      const double along = n.dot(stretch);
      sum += 0.5 * stiffness[i] *
             (n.isZero(0.0) ? stretch.squaredNorm()
                            : tangential * stretch.squaredNorm() + (1.0 - tangential) * along * along);
    }
    return sum;
  }

  double tangential;
  Embedding points;
  VectorX stiffness;
  Points targets, normals;
};

std::vector<Family> families() {
  std::vector<Family> list;
  for (const test::BodyKind& kind : test::body_kinds())
    for (const double t : {1.0, 0.1})
      list.push_back({"SpringsOn" + kind.name + (t < 1.0 ? "Sliding" : ""), kind.make,
                      [t](const auto& body, const MotionBlocks&) { return Springs(*body, t).make(*body); }, false, true,
                      [](const MotionBlocks&) { return std::vector<ParameterHandle>(); }});
  return list;
}

INSTANTIATE_TEST_SUITE_P(PointSprings, ForceTerms, ::testing::ValuesIn(families()),
                         [](const auto& member) { return member.param.name; });

TEST(PointSprings, ForceIsMinusTheGradientOfTheirEnergy) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, true);
  for (const double t : {0.0, 0.3, 1.0}) {
    const Springs springs(*body, t);
    const Points x = test::deformed(body->reference_positions(), 0.1), d = test::deformed(x, 0.7, 0.4);
    Points f = Points::Zero(x.rows(), 3);
    springs.make(*body)->add_force(x, f);
    const auto along = [&](double s) -> VectorX { return VectorX::Constant(1, -springs.energy(x + s * d)); };
    const VectorX work = VectorX::Constant(1, f.cwiseProduct(d).sum());
    EXPECT_LT(test::best_relative_error(along, work, 1.0), tolerance(1e-9)) << t;
    EXPECT_GT(test::best_relative_error(along, 1.001 * work, 1.0), 1e-4) << "a wrong force would pass";
  }
}

/// A surface may slide along itself, not leave what was seen.
TEST(PointSprings, SlideAlongTheSurfaceOnly) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, false);
  PointSprings springs(*body, Embedding(*body, {{0.0, 0.05, 0.0}}));
  const Points x = body->reference_positions();
  const auto pull = [&](const Vector3& towards, double tangential) -> Vector3 {
    springs.set(VectorX::Constant(1, 10.0), Points(Vector3(Vector3(0.0, 0.05, 0.0) + towards).transpose()),
                Points(Vector3::UnitY().transpose()), tangential);
    Points f = Points::Zero(x.rows(), 3);
    springs.add_force(x, f);
    return f.colwise().sum();
  };
  EXPECT_LT((pull({0.0, 0.01, 0.0}, 0.2) - Vector3(0.0, 0.1, 0.0)).norm(), tolerance(1e-14));
  EXPECT_LT((pull({0.01, 0.0, 0.0}, 0.2) - Vector3(0.02, 0.0, 0.0)).norm(), tolerance(1e-14));
  EXPECT_LT((pull({0.01, 0.0, -0.01}, 1.0) - Vector3(0.1, 0.0, -0.1)).norm(), tolerance(1e-14));
  springs.clear();
  Points f = Points::Zero(x.rows(), 3);
  springs.add_force(x, f);
  EXPECT_EQ(f.norm(), 0.0);
}

TEST(PointSprings, RefuseWrongNumbers) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, false);
  PointSprings springs(*body, Embedding(*body, {Vector3::Zero(), Vector3(0.05, 0, 0)}));
  const VectorX k = VectorX::Ones(2);
  const Points p = Points::Zero(2, 3);
  EXPECT_NO_THROW(springs.set(k, p, p, 1.0));
  EXPECT_THROW(springs.set(VectorX::Ones(3), p, p, 1.0), std::invalid_argument);
  EXPECT_THROW(springs.set(k, Points::Zero(1, 3), p, 1.0), std::invalid_argument);
  EXPECT_THROW(springs.set(k, p, Points::Zero(3, 3), 1.0), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::point_springs_test
