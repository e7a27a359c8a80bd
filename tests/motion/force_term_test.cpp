// A new force of a scene joins the list at the end and gets the whole battery.
#include "elasticity/force_term.hpp"

#include "elasticity/corotated.hpp"
#include "elasticity/law_elasticity.hpp"
#include "elasticity/sampled_law.hpp"
#include "elasticity/viscous_forces.hpp"
#include "motion/body_forces.hpp"
#include "motion/fixed_regions.hpp"
#include "motion/pull.hpp"
#include "motion/rigid_contact.hpp"
#include "support/force_terms.hpp"
#include "support/samples.hpp"

namespace pliant::force_term_test {
namespace {

using test::Family;
using test::ForceTerms;
using test::pulls;
using test::tolerance;
using Handles = std::vector<ParameterHandle>;

Handles of_material(const MotionBlocks& blocks) {
  Handles all = blocks.youngs_moduli;
  return all.push_back(blocks.poissons_ratio), all;
}
Handles of_damped_material(const MotionBlocks& blocks) {
  Handles all = of_material(blocks);
  return all.push_back(blocks.stiffness_damping), all;
}
Handles of_plane(const MotionBlocks& blocks) { return {blocks.planes[1].whole(), blocks.contact_stiffness}; }
Handles of_rough_plane(const MotionBlocks& blocks) {
  return {blocks.planes[1].whole(), blocks.planes[1].friction, blocks.contact_stiffness};
}
Handles of_nothing(const MotionBlocks&) { return {}; }
Handles of_pulls(const MotionBlocks& blocks) {
  Handles all = blocks.pulls;
  all.insert(all.end(), blocks.youngs_moduli.begin(), blocks.youngs_moduli.end());
  return all;
}
Handles of_law(const test::SceneBlocks& blocks) { return blocks.law.all(); }
Handles of_weight(const MotionBlocks& blocks) { return {blocks.density, blocks.gravity}; }
Handles of_gravity(const MotionBlocks& blocks) { return {blocks.gravity}; }

std::shared_ptr<const Body> small_torus() { return test::torus_body(0.1, 0.04, 0.05); }

std::shared_ptr<const Body> with_three_moduli(Body body) {
  body.modulus.controls = 3;
  body.modulus.weights = (MatrixX::Random(body.element_count(), 3).array() + 1.5).matrix();
  for (int e = 0; e < body.element_count(); ++e) body.modulus.weights.row(e) /= body.modulus.weights.row(e).sum();
  return std::make_shared<Body>(std::move(body));
}

/// Stiffness that was sampled under a few strains, stiffer the greater they are.
std::shared_ptr<const MaterialLaw> sampled(const Body& body) {
  MatrixX strains(body.element_count(), 6);
  std::vector<MaterialSample> samples;
  for (int k = 0; k < 4; ++k) {
    for (int e = 0; e < body.element_count(); ++e)
      for (int i = 0; i < 6; ++i) strains(e, i) = 0.1 * k * std::sin(1.0 + e + 3.1 * i + 7.3 * k);
    samples.push_back(test::stiffening_sample(strains, 3000.0, 5.0, 0.3));
  }
  return sample_material(test::one_term_ogden(body.element_count(), 1000.0, 0.3), samples, {1e-6, 4}).law;
}

/// Every law, on linear and quadratic tetrahedra: of one modulus, of three, of three laws.
void add_laws(std::vector<Family>& list) {
  struct Form {
    std::string name;
    int moduli;
    LawForm form;
  };
  const std::vector<Form> forms = {{"LinearLaw", 1, {1, 0}},
                                   {"NeoHookeanLaw", 1, {1, 0, 1, false, ElasticLaw::NeoHookean}},
                                   {"OgdenLaw", 1, {1, 1}},
                                   {"OgdenLawOfTwoTerms", 1, {1, 2, 1, true}},
                                   {"NeoHookeanLawOfThreeModuli", 3, {3, 0, 1, false, ElasticLaw::NeoHookean}},
                                   {"OgdenLawOfThreeModuli", 3, {3, 2}}};
  for (const bool quadratic : {false, true}) {
    const std::string elements = quadratic ? "OfQuadraticTetrahedra" : "OfTetrahedra";
    const auto box = [quadratic] { return test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, quadratic); };
    for (const Form& form : forms) {
      const auto body = [box, form] { return form.moduli == 1 ? box() : with_three_moduli(*box()); };
      list.push_back({form.name + elements, body,
                      [](auto of, const test::SceneBlocks& blocks) { return LawElasticity::make(of, blocks.law); },
                      true, true, of_law, true, true, form.form, true});
    }
    list.push_back({"SampledLaw" + elements,
                    box,
                    [](auto of, const test::SceneBlocks&) { return LawElasticity::make(of, sampled(*of)); },
                    true,
                    true,
                    of_nothing,
                    true,
                    true,
                    {},
                    true});
  }
}

/// Every contact: with a plane out of the parameter vector, with shapes that are fixed, led or where forces bring them,
/// smooth and rough, and bonded.
void add_contacts(std::vector<Family>& list) {
  struct Kind {
    std::string name;
    std::function<RigidContact(const Body&, const MotionBlocks&)> make;
    bool is_of_plane = false, is_sliding = true;
  };
  const Penalty soft{2e5, 0.01}, sharp{2e5, 0.02, Penalty::Onset::Quadratic};
  const auto shape = [](const std::shared_ptr<const RigidShape>& rigid, const Penalty& penalty) {
    return [rigid, penalty](const Body& body, const MotionBlocks&) {
      return RigidContact::sliding(body, surface_samples(body), rigid, penalty);
    };
  };
  const auto egg = [](const Vector3& p) { return p.cwiseQuotient(Vector3(1.0, 1.3, 0.8)).norm() - 0.08; };
  const SignedDistance grid({Vector3::Constant(-0.5), Vector3::Constant(0.5)}, 0.031, egg);
  const std::vector<Kind> kinds = {
      {"Plane",
       [soft](const Body& body, const MotionBlocks& blocks) {
         return RigidContact::sliding(body, surface_samples(body), blocks.planes[1], soft);
       },
       true},
      {"HalfSpace", shape(rigid_half_space({0.0, 0.01, 0.0}, {0.2, 1.0, -0.1}), soft)},
      {"Ball", shape(rigid_ball({0.05, 0.06, 0.02}, 0.09), soft)},
      {"SharpBall", shape(rigid_ball({0.05, 0.06, 0.02}, 0.09), sharp)},
      {"Capsule", shape(rigid_capsule({-0.05, 0.03, 0.0}, {0.06, 0.05, 0.03}, 0.06), soft)},
      {"Punch", shape(rigid_punch({0.0, 0.01, 0.0}, {0.1, -1.0, 0.2}, 0.06, 0.01), soft)},
      {"Mesh", shape(rigid_grid(grid), soft)},
      {"Mould", shape(rigid_grid(grid, true), soft)},
      {"Bond",
       [](const Body& body, const MotionBlocks&) { return RigidContact::bonded(body, surface_samples(body), 1e5); },
       false, false}};
  const auto box = [] { return test::tet_body({0.24, 0.1, 0.24}, {3, 2, 3}, false); };
  const auto add = [&](std::string name, const Kind& kind, auto body, const auto& change, bool is_rough, bool has_row) {
    Family family{std::move(name),
                  body,
                  [kind, change](auto of, const MotionBlocks& blocks) {
                    auto contact = std::make_unique<RigidContact>(kind.make(*of, blocks));
                    change(*contact, *of);
                    return contact;
                  },
                  kind.is_sliding,
                  true,
                  kind.is_of_plane ? (is_rough ? of_rough_plane : of_plane) : of_nothing,
                  kind.is_sliding};
    family.has_potential = true;  // at rest, where nothing rubs
    family.sees_start = is_rough;
    family.has_row = has_row;
    list.push_back(std::move(family));
  };
  const auto as_it_is = [](RigidContact&, const Body&) {};
  const auto led = [](RigidContact& contact, const Body&) { contact.set_translation({0.01, -0.02, 0.005}); };
  const auto rough = [](RigidContact& contact, const Body&) { contact.set_friction(0.7, 0.5); };
  const auto unknown = [](RigidContact& contact, const Body& body) {
    contact.set_row(body, body.node_count(), *test::with_row(body));
  };
  for (const Kind& kind : kinds) {
    add(kind.name + "Contact", kind, box, as_it_is, false, false);
    if (kind.is_sliding) add("Rough" + kind.name + "Contact", kind, box, rough, true, false);
    if (kind.is_of_plane) continue;
    add("Led" + kind.name + "Contact", kind, box, led, false, false);
    add("Unknown" + kind.name + "Contact", kind, box, unknown, false, true);
    if (!kind.is_sliding) continue;
    const auto both = [=](RigidContact& contact, const Body& body) { rough(contact, body), unknown(contact, body); };
    add("RoughUnknown" + kind.name + "Contact", kind, box, both, true, true);
  }
  const auto quadratic = [] { return test::tet_body({0.24, 0.1, 0.24}, {3, 2, 3}, true); };
  add("PlaneContactOfHexahedra", kinds.front(), small_torus, as_it_is, false, false);
  add("RoughPlaneContactOfHexahedra", kinds.front(), small_torus, rough, true, false);
  add("PlaneContactOfQuadraticTetrahedra", kinds.front(), quadratic, as_it_is, false, false);
}

std::vector<Family> families() {
  const auto elastic = [](std::string name, std::function<std::shared_ptr<const Body>()> body, bool is_of_tetrahedra) {
    return Family{std::move(name),
                  std::move(body),
                  [](auto of, const MotionBlocks& blocks) { return make_elasticity(of, blocks); },
                  true,
                  true,
                  of_material,
                  true,
                  is_of_tetrahedra};
  };
  std::vector<Family> list;
  for (const test::BodyKind& kind : test::body_kinds())
    list.push_back(elastic("ElasticityOf" + kind.name, kind.make, kind.name.ends_with("Tetrahedra")));
  for (const test::BodyKind& kind : test::body_kinds())
    list.push_back(elastic(
        "ThreeModuliOf" + kind.name, [kind] { return with_three_moduli(*kind.make()); },
        kind.name.ends_with("Tetrahedra")));
  for (const test::BodyKind& kind : test::body_kinds()) {
    list.push_back(
        {"NeoHookeanMeanOf" + kind.name, kind.make,
         [](auto of, const MotionBlocks& blocks) { return make_elasticity(of, blocks, ElasticLaw::NeoHookean); }, true,
         true, of_material, true, kind.name.ends_with("Tetrahedra")});
    const auto viscous = [](auto of, const MotionBlocks& blocks) {
      return make_viscous_forces(of, blocks, blocks.stiffness_damping);
    };
    Family family{"ViscosityOf" + kind.name, kind.make, viscous, true, true, of_damped_material, true};
    family.sees_start = family.rests = true;
    list.push_back(family);
    family.name = "ViscosityOfThreeModuliOf" + kind.name;
    family.body = [kind] { return with_three_moduli(*kind.make()); };
    list.push_back(family);
  }
  add_laws(list);
  add_contacts(list);
  const auto box = [](bool quadratic) {
    return [quadratic] { return test::tet_body({0.24, 0.1, 0.24}, {3, 2, 3}, quadratic); };
  };
  const auto pull = [](auto body, const MotionBlocks& blocks) {
    std::vector<int> held;
    std::vector<Vector3> all, there;
    for (int n = 0; n < body->node_count(); ++n) {
      all.push_back(body->nodes.row(n).transpose());
      if (body->nodes(n, 0) > body->nodes.col(0).minCoeff() + 0.03) continue;
      held.push_back(n);
      there.push_back(all.back());
    }
    return std::make_unique<Pull>(body, PullPoints{far_points(all, there, pulls), body->size()}, held, blocks);
  };
  const auto three = [] { return with_three_moduli(*small_torus()); };
  list.push_back({"Pull", box(true), pull, false, false, of_pulls, false, false, {}, true});
  list.push_back({"PullOfThreeModuli", three, pull, false, false, of_pulls, false, false, {}, true});
  const std::vector<Family> others = {
      {"Gravity",
       small_torus,
       [](auto body, const MotionBlocks& blocks) { return std::make_unique<Gravity>(*body, blocks); },
       false,
       false,
       of_weight,
       false,
       false,
       {},
       true},
      {"PointWeights",
       small_torus,
       [](auto body, const MotionBlocks& blocks) {
         return std::make_unique<PointWeights>(
             *body, std::vector<PointMass>{{Vector3(0.1, 0.0, 0.01), 0.2}, {Vector3(-0.12, 0.01, 0.0), 0.05}},
             blocks.gravity);
       },
       false,
       false,
       of_gravity,
       false,
       false,
       {},
       true},
      {"FixedRegions", small_torus,
       [](auto body, const MotionBlocks& blocks) {
         const Matrix3 R = Eigen::AngleAxisd(0.8, Vector3(1, -1, 2).normalized()).toRotationMatrix();
         return std::make_unique<FixedRegions>(
             body,
             std::vector<Hold>{{[](const Vector3& p) { return p.x() > 0.07; }, R, Vector3(0.02, 0.01, -0.03)},
                               {[](const Vector3& p) { return p.z() < -0.08; }}},
             blocks);
       },
       false, true, of_material}};
  list.insert(list.end(), others.begin(), others.end());
  return list;
}

/// The battery's poses have tangents with negative eigenvalues: it tests what the damping leaves out of them, too.
TEST_P(ForceTerms, PosesOfLawsHaveNegativeTangents) {
  auto* const law = dynamic_cast<LawElasticity*>(term.get());
  if (!law) return;
  law->set_parameters(theta);
  law->linearise(lag);
  BlockMatrix exact(body->pattern), positive(body->pattern);
  law->add_stiffness(LawElasticity::Stiffness::Exact, 1.0, exact);
  law->add_stiffness(LawElasticity::Stiffness::Positive, 1.0, positive);
  EXPECT_GT((test::dense(positive) - test::dense(exact)).norm(), 1e-3 * test::dense(exact).norm());
}

INSTANTIATE_TEST_SUITE_P(All, ForceTerms, ::testing::ValuesIn(families()),
                         [](const auto& member) { return member.param.name; });

/// The battery's contact sees both sides of the switch, and pulls nowhere.
TEST(RigidContact, PushesOutwardsOnBothSidesOfItsSwitch) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  const MotionLayout layout({.planes = 1});
  RigidContact contact = RigidContact::sliding(*body, surface_samples(*body), layout.planes[0], {2e5, 0.001});
  VectorX theta = layout.zero();
  theta.segment<3>(layout.planes[0].normal) = Vector3::UnitY();
  const Points& X = body->reference_positions();
  double last = 0.0;
  for (const double height : {-0.1, -0.045, -0.035, -0.02, 0.0}) {
    theta.segment<3>(layout.planes[0].point) = Vector3(0, height, 0);
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

TEST(RigidContact, RefusesNoStiffness) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  const MotionLayout layout({.planes = 1});
  const ContactSamples samples = surface_samples(*body);
  EXPECT_THROW(RigidContact::sliding(*body, samples, layout.planes[0], {0.0, 0.01}), std::invalid_argument);
  EXPECT_THROW(RigidContact::sliding(*body, samples, layout.planes[0], {1.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(RigidContact::bonded(*body, samples, 0.0), std::invalid_argument);
}

TEST(FixedRegions, RefusesARegionBesideTheObject) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  EXPECT_ANY_THROW(FixedRegions(body, {{[](const Vector3& p) { return p.x() > 1.0; }}}, MotionLayout()));
}

TEST(Gravity, PullsWithTheWeight) {
  const auto body = test::torus_body(0.1, 0.04, 0.05);
  const MotionLayout layout;
  Gravity gravity(*body, layout);
  VectorX theta = layout.zero();
  theta[layout.density] = 80.0;
  theta.segment<3>(layout.gravity) = Vector3(1, -2, 3);
  gravity.set_parameters(theta);
  Points f = Points::Zero(body->node_count(), 3);
  gravity.add_force(body->reference_positions(), f);
  EXPECT_LT((f.colwise().sum().transpose() - 80.0 * body->volume() * Vector3(1, -2, 3)).norm(), tolerance(1e-12));
}

}  // namespace
}  // namespace pliant::force_term_test
