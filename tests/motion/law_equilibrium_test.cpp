#include "elasticity/sampled_law.hpp"
#include "motion/contact_defaults.hpp"
#include "motion/equilibrium.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/samples.hpp"
#include "support/tolerance.hpp"

namespace pliant::law_equilibrium_test {
namespace {

using test::tolerance;

std::shared_ptr<const OgdenLaw> ogden(const Body& body, const std::vector<double>& parameters) {
  MatrixX q(body.element_count(), Eigen::Index(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) q.col(Eigen::Index(k)).setConstant(parameters[k]);
  return std::make_shared<OgdenLaw>(q);
}
const std::vector<double> foam = {1500.0, 8.0, 0.2, 1500.0, -6.0, 0.15};

std::vector<int> nodes_where(const Body& body, const std::function<bool(const Vector3&)>& is_there) {
  std::vector<int> nodes;
  for (int n = 0; n < body.node_count(); ++n)
    if (is_there(body.nodes.row(n).transpose())) nodes.push_back(n);
  return nodes;
}

/// A block on a floor that holds it, with a disc glued on top, or a ball above it.
struct Block {
  explicit Block(bool quadratic = false, bool bonded = true)
      : body(test::tet_body({0.2, 0.1, 0.2}, {8, 4, 8}, quadratic, 0.1)),
        held(nodes_where(*body, [](const Vector3& p) { return p.y() < -0.0499; })) {
    if (bonded) {
      contacts.push_back(
          RigidContact::bonded(*body, disc_samples(*body, {0.02, 0.05, -0.01}, 0.03), bond_stiffness(7000.0, 0.01)));
    } else {
      contacts.push_back(RigidContact::sliding(*body, boundary_samples(*body, 4), rigid_ball({0.01, 0.09, 0.0}, 0.04),
                                               Penalty{1e6, 5e-4, Penalty::Onset::Quadratic}));
    }
  }
  Equilibrium make(std::shared_ptr<const MaterialLaw> law = nullptr) const {
    return Equilibrium(body, law ? law : ogden(*body, foam), held, contacts);
  }
  std::shared_ptr<const Body> body;
  std::vector<int> held;
  std::vector<RigidContact> contacts;
};

TEST(LawEquilibrium, OfAStretchedBarIsTheLawsOwn) {
  // A bar between a sliding floor and a glued top would neck; hold only what a homogeneous stretch holds.
  const auto body = test::tet_body({0.1, 0.1, 0.1}, {3, 3, 3}, false);
  const double stretch = 0.6;
  std::vector<int> held;
  // All boundary nodes follow the analytic field, inner nodes must find it.
  const auto shared_law = ogden(*body, foam);
  const OgdenLaw& law = *shared_law;
  double lateral = 1.0;  // Newton for the free side's stress
  for (int k = 0; k < 50; ++k) {
    PointStress s, t;
    law.stress(0, Vector3(lateral, stretch, lateral).asDiagonal(), false, s);
    law.stress(0, Vector3(lateral + 1e-7, stretch, lateral + 1e-7).asDiagonal(), false, t);
    lateral -= s.P(0, 0) / ((t.P(0, 0) - s.P(0, 0)) / 1e-7);
  }
  // Only the ends' normal displacement is given: top and bottom nodes move along y, free sideways would need rollers,
  // so their sideways places are those of the stretch.
  held = nodes_where(*body, [](const Vector3& p) { return std::abs(p.y()) > 0.0499; });
  Equilibrium equilibrium(body, ogden(*body, foam), held, {});
  Placement placement = equilibrium.rest();
  for (const int n : held)
    placement.nodes.row(n) = body->nodes.row(n).cwiseProduct(Vector3(lateral, stretch, lateral).transpose());
  // From far: everything else still at rest.
  const SolveSummary summary = equilibrium.solve(placement);
  ASSERT_TRUE(summary.converged) << equilibrium.failure();
  const Points expected = body->nodes * Vector3(lateral, stretch, lateral).asDiagonal();
  EXPECT_LT((placement.nodes - expected).norm(), tolerance(1e-7) * expected.norm());
}

TEST(LawEquilibrium, BalancesTheForceOfABondedDisc) {
  for (const bool quadratic : {false, true}) {
    const Block block(quadratic);
    Equilibrium equilibrium = block.make();
    const Vector3 force(3.0, -20.0, 1.0);
    equilibrium.set_control(0, {ProbeControl::Kind::Force, force, {}, {}});
    Placement placement = equilibrium.rest();
    const SolveSummary summary = equilibrium.solve(placement);
    ASSERT_TRUE(summary.converged) << equilibrium.failure();
    EXPECT_LT((equilibrium.contact_force(0, placement) - force).norm(), tolerance(1e-6) * force.norm());
    EXPECT_LT(placement.translations(0, 1), -0.01);
    // The disc stays flat: its samples move as it does but for the springs' stretch, the most at its rim.
    const Embedding& points = equilibrium.contact(0).points();
    double slip = 0.0;
    for (int i = 0; i < points.point_count(); ++i)
      slip = std::max(slip, (points.position(i, placement.nodes) - points.position(i, block.body->nodes) -
                             placement.translations.row(0).transpose())
                                .norm());
    EXPECT_LT(slip, 0.25 * placement.translations.row(0).norm());
  }
}

TEST(LawEquilibrium, LedByPositionFeelsTheForceThatLeadsThere) {
  const Block block;
  Equilibrium by_force = block.make(), by_place = block.make();
  by_force.set_control(0, {ProbeControl::Kind::Force, {3.0, -20.0, 1.0}, {}, {}});
  Placement placement = by_force.rest();
  ASSERT_TRUE(by_force.solve(placement).converged);
  by_place.set_control(0, {ProbeControl::Kind::Position, {}, placement.translations.row(0).transpose(), {}});
  Placement other = by_place.rest();
  other.translations.setZero();
  ASSERT_TRUE(by_place.solve(other).converged) << by_place.failure();
  EXPECT_LT((other.nodes - placement.nodes).norm(), tolerance(1e-7) * placement.nodes.norm());
  EXPECT_LT((by_place.contact_force(0, other) - Vector3(3.0, -20.0, 1.0)).norm(), tolerance(1e-5));
}

TEST(LawEquilibrium, OfASlidingBallPushesAlongItsNormals) {
  const Block block(false, false);
  Equilibrium equilibrium = block.make();
  ProbeControl control{ProbeControl::Kind::Force, {0.0, -15.0, 0.0}, {}, Vector3(0.0, 1.0, 0.0)};
  equilibrium.set_control(0, control);
  Placement placement = equilibrium.rest();
  ASSERT_TRUE(equilibrium.solve(placement).converged) << equilibrium.failure();
  EXPECT_NEAR(equilibrium.contact_force(0, placement).y(), -15.0, tolerance(1e-4));
  EXPECT_LT(placement.translations(0, 1), -0.008);
  EXPECT_NEAR(placement.translations(0, 0), 0.0, 1e-4);  // the guide holds it against sideways forces
  // No sample lies deeper in the ball than pressure needs.
  const Embedding& points = equilibrium.contact(0).points();
  for (int i = 0; i < points.point_count(); ++i) {
    const Vector3 y = points.position(i, placement.nodes) - placement.translations.row(0).transpose();
    EXPECT_GT((y - Vector3(0.01, 0.09, 0.0)).norm(), 0.04 - 0.012);
  }
}

TEST(LawEquilibrium, OnARigidBodyInsideSlides) {
  // A shell around a fixed rigid core, pressed from the side: it slides on the core and does not enter it.
  const auto body = test::tet_body({0.12, 0.05, 0.12}, {6, 2, 6}, false, 0.05);
  const auto held = nodes_where(*body, [](const Vector3& p) { return p.x() < -0.0599; });
  std::vector<RigidContact> contacts;
  contacts.push_back(RigidContact::sliding(*body, boundary_samples(*body, 3),
                                           rigid_half_space({0.0, -0.025, 0.0}, {0.0, 1.0, 0.0}),
                                           Penalty{3e6, 2e-4, Penalty::Onset::Quadratic}));
  contacts.push_back(
      RigidContact::bonded(*body, disc_samples(*body, {0.02, 0.025, 0.0}, 0.02), bond_stiffness(7000.0, 0.01)));
  Equilibrium equilibrium(body, ogden(*body, foam), held, contacts);
  equilibrium.set_control(0, {ProbeControl::Kind::Position, {}, {}, {}});
  equilibrium.set_control(1, {ProbeControl::Kind::Force, {0.4, -3.0, 0.0}, {}, {}});
  Placement placement = equilibrium.rest();
  ASSERT_TRUE(equilibrium.solve(placement).converged) << equilibrium.failure();
  const Vector3 core = equilibrium.contact_force(0, placement);
  EXPECT_GT(core.y(), 1.0);          // it carries
  EXPECT_NEAR(core.x(), 0.0, 1e-9);  // without friction
  EXPECT_GT(placement.nodes.col(1).minCoeff(), -0.025 - 1e-3);
}

TEST(LawEquilibrium, WorkOfTheProbeIsWhatTheBodyStores) {
  // Led in and out along a path in small steps: work done is the change of energy, and what went in comes out.
  const Block block;
  Equilibrium equilibrium = block.make();
  Placement placement = equilibrium.rest();
  double work = 0.0, most = 0.0;
  Vector3 last_force = Vector3::Zero(), last_place = Vector3::Zero();
  const int steps = 48;
  for (int k = 1; k <= steps; ++k) {
    const double s = 2.0 * M_PI * k / steps;
    const Vector3 place = 0.012 * Vector3(0.5 * std::sin(s), std::cos(s) - 1.0, 0.4 * std::sin(2.0 * s));
    equilibrium.set_control(0, {ProbeControl::Kind::Position, {}, place, {}});
    ASSERT_TRUE(equilibrium.solve(placement).converged) << equilibrium.failure();
    const Vector3 force = equilibrium.contact_force(0, placement);
    work += 0.5 * (force + last_force).dot(place - last_place);
    last_force = force, last_place = place;
    const double stored = equilibrium.energies().elastic + equilibrium.energies().contact;
    most = std::max(most, stored);
    EXPECT_NEAR(work, stored, 0.01 * most + 1e-9);  // the trapezoidal rule's error
  }
  EXPECT_GT(most, 0.02);
  EXPECT_LT(std::abs(equilibrium.energies().total), tolerance(1e-9) * most);
}

/// The equilibrium under a force [N] on the first rigid body, from rest.
Placement pushed(Equilibrium& equilibrium, const Vector3& force) {
  equilibrium.set_control(0, {ProbeControl::Kind::Force, force, {}, {}});
  Placement placement = equilibrium.rest();
  EXPECT_TRUE(equilibrium.solve(placement).converged);
  return placement;
}

TEST(LawEquilibrium, ChangesWithForcesAsItsResponseSays) {
  const Block block;
  Equilibrium equilibrium = block.make();
  const Vector3 force(1.0, -15.0, 2.0), change(0.3, 0.5, -0.8);
  const Placement placement = pushed(equilibrium, force);
  ASSERT_TRUE(equilibrium.prepare_derivatives(placement));
  Points forces = Points::Zero(block.body->node_count() + 1, 3);
  forces.row(block.body->node_count()) = change.transpose();
  const VectorX derivative = flat(equilibrium.response(forces));
  const auto along = [&](double h) {
    const Placement p = pushed(equilibrium, force + h * change);
    VectorX all(derivative.size());
    all << VectorX(flat(p.nodes)), VectorX(flat(p.translations));
    return all;
  };
  EXPECT_LT(test::best_relative_error(along, derivative, 10.0), tolerance(1e-6));
}

TEST(LawEquilibrium, RespondsToSeveralChangesAsToEach) {
  const Block block;
  Equilibrium equilibrium = block.make();
  const Placement placement = pushed(equilibrium, Vector3(1.0, -15.0, 2.0));
  ASSERT_TRUE(equilibrium.prepare_derivatives(placement));
  std::vector<Points> changes(5, Points::Zero(block.body->node_count() + 1, 3));
  for (std::size_t c = 0; c < changes.size(); ++c)
    for (Eigen::Index i = 0; i < changes[c].size(); ++i)
      changes[c].data()[i] = std::sin(double(c) + double(i * i % 97));
  std::vector<Points> alone;
  for (const Points& forces : changes) alone.push_back(equilibrium.response(forces));
  equilibrium.respond(changes);
  for (std::size_t c = 0; c < changes.size(); ++c)
    EXPECT_LT((changes[c] - alone[c]).norm(), tolerance(1e-11) * alone[c].norm()) << c;
}

/// Terms are linearised where the last solve ended, which derivatives there need not do again, unless something has
/// changed since.
TEST(LawEquilibrium, DerivativesAreThoseOfTheLawAndTheLoadsOfNow) {
  const Block block;
  Equilibrium equilibrium = block.make();
  const Placement placement = pushed(equilibrium, Vector3(1.0, -15.0, 2.0));
  Points forces = Points::Zero(block.body->node_count() + 1, 3);
  forces(block.body->node_count(), 1) = 1.0;
  const auto response = [&] {
    EXPECT_TRUE(equilibrium.prepare_derivatives(placement));
    return equilibrium.response(forces);
  };
  const Points there = response();
  (void)equilibrium.elasticity().evaluate(block.body->nodes, true);  // elsewhere
  EXPECT_LT((response() - there).norm(), tolerance(1e-12) * there.norm());
  equilibrium.set_law(ogden(*block.body, {3000.0, 8.0, 0.2, 3000.0, -6.0, 0.15}));
  EXPECT_LT(response().norm(), 0.9 * there.norm()) << "a stiffer law";
}

TEST(LawEquilibrium, OfASampledMaterialIsFoundToo) {
  const Block block;
  std::vector<MaterialSample> samples;
  for (int k = 0; k < 4; ++k) {
    MatrixX strains = MatrixX::Zero(block.body->element_count(), 6);
    strains.col(1).setConstant(-0.05 * (k + 1));
    strains.col(3).setConstant(0.02 * k);
    samples.push_back(test::stiffening_sample(strains, 3000.0, 15.0, 0.25));
  }
  const auto law = sample_material(test::one_term_ogden(block.body->element_count(), 1200.0, 0.25), samples).law;
  Equilibrium equilibrium = block.make(law);
  MatrixX unstrained(block.body->element_count(), 2);
  const LambdaAlpha p = lambda_alpha({3000.0, 0.25});
  unstrained.rowwise() = Eigen::RowVector2d(p.lambda, p.alpha);
  const auto press = [&](std::shared_ptr<const MaterialLaw> of) {
    equilibrium.set_law(std::move(of));
    equilibrium.set_control(0, {ProbeControl::Kind::Force, {0.0, -20.0, 0.0}, {}, {}});
    Placement placement = equilibrium.rest();
    const SolveSummary summary = equilibrium.solve(placement);
    EXPECT_TRUE(summary.converged) << equilibrium.failure();
    EXPECT_LT(summary.residual, 1e-9);
    return -placement.translations(0, 1);
  };
  EXPECT_LT(press(law), 0.8 * press(std::make_shared<LinearLaw>(unstrained)));  // it stiffens
}

TEST(LawEquilibrium, SaysWhatIsWrong) {
  const Block block;
  Equilibrium loose(block.body, ogden(*block.body, foam), {}, block.contacts, {1e-9, 10, 1});
  loose.set_control(0, {ProbeControl::Kind::Force, {0.0, -5.0, 0.0}, {}, {}});
  Placement placement = loose.rest();
  EXPECT_FALSE(loose.solve(placement).converged);
  EXPECT_FALSE(loose.failure().empty());
}

}  // namespace
}  // namespace pliant::law_equilibrium_test
