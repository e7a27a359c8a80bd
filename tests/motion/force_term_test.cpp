// One battery for every force of a scene: a new member of the family joins the list at the end and gets all of it.
#include "elasticity/force_term.hpp"

#include "elasticity/corotated.hpp"
#include "motion/body_forces.hpp"
#include "motion/fixed_regions.hpp"
#include "motion/plane_contact.hpp"
#include "motion/pull.hpp"
#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant {
namespace {

using test::tolerance;

std::vector<int> range(int first, int count) {
  std::vector<int> all;
  for (int i = 0; i < count; ++i) all.push_back(first + i);
  return all;
}

constexpr int pulls = 2;
const int first_of_more_moduli = theta::pull(pulls, 2);

std::shared_ptr<const Body> small_torus() { return test::torus_body(0.1, 0.04, 0.05); }

struct Family {
  std::string name;
  std::function<std::shared_ptr<const Body>()> body;
  std::function<std::unique_ptr<ForceTerm>(std::shared_ptr<const Body>)> make;
  bool depends_on_lag, depends_on_position;
  std::vector<int> parameters;  ///< of theta that it depends on
};

void PrintTo(const Family& family, std::ostream* out) { *out << family.name; }

struct ForceTerms : ::testing::TestWithParam<Family> {
  ForceTerms() : body(GetParam().body()), term(GetParam().make(body)) {
    theta.setZero(theta::size(2, body->modulus.controls, pulls));
    theta.segment<6>(theta::pull(0, 2)) << 0.1, -0.2, 0.05, 0.02, 0.15, -0.1;
    theta.tail(body->modulus.controls - 1).setLinSpaced(2000.0, 5000.0);
    theta[theta::youngs_modulus] = 3000.0;
    theta[theta::poissons_ratio] = 0.35;
    theta[theta::mass_damping] = 0.4;
    theta[theta::stiffness_damping] = 0.002;
    theta[theta::density] = 120.0;
    theta.segment<3>(theta::gravity) = Vector3(0.3, -9.7, 0.2);
    theta.segment<3>(theta::plane_normal(0)) = Vector3::UnitX();
    theta.segment<3>(theta::plane_point(0)) = Vector3(-1, 0, 0);
    theta.segment<3>(theta::plane_normal(1)) = Vector3(0.2, 0.9, -0.3).normalized();
    theta.segment<3>(theta::plane_point(1)) = Vector3(0.01, 0.0, -0.02);  // through the middle: gaps of both signs
    lag = test::deformed(body->reference_positions(), 0.3);
    z = test::deformed(body->reference_positions(), 0.28, 1.93);
    d_lag = test::deformed(body->reference_positions(), 0.6, -0.7);
    d_z = test::deformed(body->reference_positions(), 0.9, 0.6);
  }

  Points force(const Points& at_lag, const Points& at_z, const VectorX& at_theta) {
    term->set_parameters(at_theta);
    term->linearise(at_lag);
    Points f = Points::Zero(at_z.rows(), 3);
    term->add_force(at_z, f);
    return f;
  }
  Points tangent(const Points& change_lag, const Points& change_z, const VectorX& change_theta) {
    term->set_parameters(theta);
    term->linearise(lag);
    Points df = Points::Zero(z.rows(), 3);
    term->add_force_tangent(z, change_lag, change_z, change_theta, df);
    return df;
  }
  Points none() const { return Points::Zero(z.rows(), 3); }

  std::shared_ptr<const Body> body;
  std::unique_ptr<ForceTerm> term;
  VectorX theta;
  Points lag, z, d_lag, d_z;
};

// Bottom of the V of central differences: truncation h^2 against rounding 1e-16 / h.
constexpr double difference_error = 1e-7;

TEST_P(ForceTerms, AddsToWhatIsThere) {
  const Points f = force(lag, z, theta);
  ASSERT_GT(f.norm(), 0.0);
  Points twice = f;
  term->add_force(z, twice);
  EXPECT_LT((twice - 2 * f).norm(), tolerance(1e-14) * f.norm());
}

TEST_P(ForceTerms, MatrixIsMinusTheDerivativeByPosition) {
  const VectorX change = flat(Points(force(lag, z + d_z, theta) - force(lag, z, theta)));
  BlockMatrix K(body->pattern);
  term->add_matrix(3.0, K);
  const MatrixX dense = test::dense(K);
  EXPECT_LE((dense - dense.transpose()).norm(), tolerance(1e-13) * dense.norm());
  ASSERT_EQ(change.norm() > 0.0, GetParam().depends_on_position);
  EXPECT_LE((dense * flat(d_z) + 3.0 * change).norm(), tolerance(1e-10) * change.norm());  // affine: rounding alone
}

TEST_P(ForceTerms, TangentByLagPoint) {
  const Points df = tangent(d_lag, none(), VectorX::Zero(theta.size()));
  ASSERT_EQ(df.norm() > 0.0, GetParam().depends_on_lag);
  if (!GetParam().depends_on_lag) return;
  const auto along = [&](double s) -> VectorX { return flat(force(lag + s * d_lag, z, theta)); };
  EXPECT_LT(test::best_relative_error(along, flat(df), 0.1), tolerance(difference_error));
  EXPECT_GT(test::best_relative_error(along, 1.001 * flat(df), 0.1), 1e-4) << "a wrong derivative would pass";
}

TEST_P(ForceTerms, TangentByPosition) {
  const Points df = tangent(none(), d_z, VectorX::Zero(theta.size()));
  const Points difference = force(lag, z + d_z, theta) - force(lag, z, theta);
  EXPECT_LE((df - difference).norm(), tolerance(1e-10) * difference.norm());
}

TEST_P(ForceTerms, TangentByEveryParameter) {
  const auto& active = GetParam().parameters;
  for (int i = 0; i < theta.size(); ++i) {
    const VectorX direction = VectorX::Unit(theta.size(), i);
    const Points df = tangent(none(), none(), direction);
    const bool is_active = std::find(active.begin(), active.end(), i) != active.end();
    ASSERT_EQ(df.norm() > 0.0, is_active) << "theta[" << i << "]";
    const double step = 0.1 * std::max(std::abs(theta[i]), 0.05);
    if (!is_active) {
      EXPECT_EQ((force(lag, z, theta + step * direction) - force(lag, z, theta)).norm(), 0.0) << "theta[" << i << "]";
      continue;
    }
    const auto along = [&](double s) -> VectorX { return flat(force(lag, z, theta + s * direction)); };
    EXPECT_LT(test::best_relative_error(along, flat(df), step), tolerance(difference_error)) << "theta[" << i << "]";
  }
}

TEST_P(ForceTerms, AdjointIsTheTransposeOfTheTangent) {
  term->set_parameters(theta);
  term->linearise(lag);
  const Points w = test::deformed(body->reference_positions(), -0.8, 2.9);
  Points lag_bar = none(), z_bar = none();
  VectorX theta_bar = VectorX::Zero(theta.size());
  term->add_force_adjoint(z, w, lag_bar, z_bar, theta_bar);
  const VectorX zero = VectorX::Zero(theta.size());
  const auto expect_same = [&](double by_adjoint, const Points& df, const char* what) {
    EXPECT_LE(std::abs(by_adjoint - w.cwiseProduct(df).sum()), tolerance(1e-12) * w.norm() * df.norm()) << what;
  };
  expect_same(lag_bar.cwiseProduct(d_lag).sum(), tangent(d_lag, none(), zero), "lag");
  expect_same(z_bar.cwiseProduct(d_z).sum(), tangent(none(), d_z, zero), "z");
  for (int i = 0; i < theta.size(); ++i)
    expect_same(theta_bar[i], tangent(none(), none(), VectorX::Unit(theta.size(), i)), "theta");
  // It adds: a second call doubles.
  term->add_force_adjoint(z, w, lag_bar, z_bar, theta_bar);
  expect_same(0.5 * z_bar.cwiseProduct(d_z).sum(), tangent(none(), d_z, zero), "z, twice");
}

/// The lag point's share, as a matrix.
TEST_P(ForceTerms, LagMatrixIsMinusTheDerivativeByLagPoint) {
  term->set_parameters(theta);
  const auto product = [&](const Points& at_lag, const Points& at_z) {
    term->linearise(at_lag);
    BlockMatrix K(body->pattern);
    term->add_lag_matrix(at_z, 3.0, K);
    VectorX y;
    K.multiply(flat(d_lag), y);
    return y;
  };
  // Contact gives its share where it is needed, with the lag point at z itself: there is none.
  const bool is_elastic = GetParam().name.starts_with("ElasticityOf") || GetParam().name.starts_with("ThreeModuliOf");
  const Points& at_lag = is_elastic ? lag : z;
  const VectorX y = product(at_lag, z);
  term->linearise(at_lag);
  Points df = none();
  term->add_force_tangent(z, d_lag, none(), VectorX::Zero(theta.size()), df);
  EXPECT_EQ(df.norm() > 0.0, is_elastic);
  EXPECT_LE((y + 3.0 * flat(df)).norm(), tolerance(1e-11) * df.norm());
}

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
