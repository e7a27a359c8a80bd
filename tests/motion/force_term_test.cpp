// A new force of a scene joins the list at the end and gets the whole battery.
#include "elasticity/force_term.hpp"

#include "elasticity/corotated.hpp"
#include "motion/body_forces.hpp"
#include "motion/fixed_regions.hpp"
#include "motion/plane_contact.hpp"
#include "motion/pull.hpp"
#include "support/force_terms.hpp"

namespace pliant {
namespace {

using test::Family;
using test::ForceTerms;
using test::pulls;
using test::tolerance;

std::vector<int> range(int first, int count) {
  std::vector<int> all;
  for (int i = 0; i < count; ++i) all.push_back(first + i);
  return all;
}

const int first_of_more_moduli = theta::pull(pulls, 2);

std::shared_ptr<const Body> small_torus() { return test::torus_body(0.1, 0.04, 0.05); }

std::shared_ptr<const Body> with_three_moduli(Body body) {
  body.modulus.controls = 3;
  body.modulus.weights = (MatrixX::Random(body.element_count(), 3).array() + 1.5).matrix();
  for (int e = 0; e < body.element_count(); ++e) body.modulus.weights.row(e) /= body.modulus.weights.row(e).sum();
  return std::make_shared<Body>(std::move(body));
}

std::vector<Family> families() {
  std::vector<int> gravity = range(theta::gravity, 3);
  gravity.push_back(theta::density);
  const auto elastic = [](std::string name, std::function<std::shared_ptr<const Body>()> body,
                          std::vector<int> parameters) {
    return Family{std::move(name),      std::move(body), [](auto of) { return make_elasticity(of); }, true, true,
                  std::move(parameters)};
  };
  std::vector<Family> list;
  for (const test::BodyKind& kind : test::body_kinds())
    list.push_back(elastic("ElasticityOf" + kind.name, kind.make, {theta::youngs_modulus, theta::poissons_ratio}));
  for (const test::BodyKind& kind : test::body_kinds())
    list.push_back(
        elastic("ThreeModuliOf" + kind.name, [kind] { return with_three_moduli(*kind.make()); },
                {theta::youngs_modulus, theta::poissons_ratio, first_of_more_moduli, first_of_more_moduli + 1}));
  const auto box = [](bool quadratic) {
    return [quadratic] { return test::tet_body({0.24, 0.1, 0.24}, {3, 2, 3}, quadratic); };
  };
  const auto contact = [](auto body) { return std::make_unique<PlaneContact>(body, 1, ContactOptions{2e5, 0.01}); };
  list.push_back({"PlaneContactOfTetrahedra", box(false), contact, true, true, range(theta::plane_point(1), 6)});
  list.push_back(
      {"PlaneContactOfQuadraticTetrahedra", box(true), contact, true, true, range(theta::plane_point(1), 6)});
  const auto pull = [](auto body) {
    std::vector<int> held;
    std::vector<Vector3> all, there;
    for (int n = 0; n < body->node_count(); ++n) {
      all.push_back(body->nodes.row(n).transpose());
      if (body->nodes(n, 0) > body->nodes.col(0).minCoeff() + 0.03) continue;
      held.push_back(n);
      there.push_back(all.back());
    }
    return std::make_unique<Pull>(body, PullPoints{far_points(all, there, pulls), body->size()}, held,
                                  theta::pull(0, 2));
  };
  list.push_back({"Pull", box(true), pull, false, false, [] {
                    std::vector<int> all = range(theta::pull(0, 2), 3 * pulls);
                    return all.push_back(theta::youngs_modulus), all;
                  }()});
  list.push_back({"PullOfThreeModuli", [] { return with_three_moduli(*small_torus()); }, pull, false, false,
                  [] {
                    std::vector<int> all = range(theta::pull(0, 2), 3 * pulls + 2);
                    return all.push_back(theta::youngs_modulus), all;
                  }()});
  const std::vector<Family> others = {
      {"Gravity", small_torus, [](auto body) { return std::make_unique<Gravity>(*body); }, false, false, gravity},
      {"HungWeights", small_torus,
       [](auto body) {
         return std::make_unique<HungWeights>(
             *body, std::vector<HungWeight>{{Vector3(0.1, 0.0, 0.01), 0.2}, {Vector3(-0.12, 0.01, 0.0), 0.05}});
       },
       false, false, range(theta::gravity, 3)},
      {"PlaneContact", small_torus, contact, true, true, range(theta::plane_point(1), 6)},
      {"FixedRegions",
       small_torus,
       [](auto body) {
         const Matrix3 R = Eigen::AngleAxisd(0.8, Vector3(1, -1, 2).normalized()).toRotationMatrix();
         return std::make_unique<FixedRegions>(
             body, std::vector<Hold>{{[](const Vector3& p) { return p.x() > 0.07; }, R, Vector3(0.02, 0.01, -0.03)},
                                     {[](const Vector3& p) { return p.z() < -0.08; }}});
       },
       false,
       true,
       {theta::youngs_modulus, theta::poissons_ratio}}};
  list.insert(list.end(), others.begin(), others.end());
  return list;
}

INSTANTIATE_TEST_SUITE_P(All, ForceTerms, ::testing::ValuesIn(families()),
                         [](const auto& member) { return member.param.name; });

/// The battery's contact sees both sides of the switch, and pulls nowhere.
TEST(PlaneContact, PushesOutwardsOnBothSidesOfItsSwitch) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  PlaneContact contact(body, 0, {2e5, 0.001});
  VectorX theta = VectorX::Zero(theta::size(1));
  theta.segment<3>(theta::plane_normal(0)) = Vector3::UnitY();
  const Points& X = body->reference_positions();
  double last = 0.0;
  for (const double height : {-0.1, -0.045, -0.035, -0.02, 0.0}) {
    theta.segment<3>(theta::plane_point(0)) = Vector3(0, height, 0);
    contact.set_parameters(theta);
    contact.linearise(X);
    Points f = Points::Zero(X.rows(), 3);
    contact.add_force(X, f);
    EXPECT_EQ(contact.active_count() > 0, height > -0.08);
    EXPECT_GE(f.col(1).sum(), last);
    EXPECT_LT(std::abs(f.col(0).sum()) + std::abs(f.col(2).sum()), 1e-12 + 1e-12 * f.norm());
    last = f.col(1).sum();
  }
  // Half the torus under the plane: k times the volume of water displaced, over samples of area times depth.
  double depth = 0.0;
  for (const SurfacePoint& p : body->surface) depth += std::max(0.0, -p.position.y()) * p.area;
  EXPECT_NEAR(last, 2e5 * depth, 0.03 * last);
}

TEST(PlaneContact, RefusesNoStiffness) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  EXPECT_THROW(PlaneContact(body, 0, {0.0, 0.01}), std::invalid_argument);
  EXPECT_THROW(PlaneContact(body, 0, {1.0, 0.0}), std::invalid_argument);
}

TEST(FixedRegions, RefusesARegionBesideTheObject) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  EXPECT_ANY_THROW(FixedRegions(body, {{[](const Vector3& p) { return p.x() > 1.0; }}}));
}

TEST(Gravity, PullsWithTheWeight) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  Gravity gravity(*body);
  VectorX theta = VectorX::Zero(theta::size(0));
  theta[theta::density] = 80.0;
  theta.segment<3>(theta::gravity) = Vector3(1, -2, 3);
  gravity.set_parameters(theta);
  Points f = Points::Zero(body->node_count(), 3);
  gravity.add_force(body->reference_positions(), f);
  EXPECT_LT((f.colwise().sum().transpose() - 80.0 * body->volume() * Vector3(1, -2, 3)).norm(), tolerance(1e-12));
}

}  // namespace
}  // namespace pliant
