#include "geometry/primitives.hpp"
#include "motion/patch_forces.hpp"
#include "motion/rigid_contact.hpp"
#include "motion/wind.hpp"
#include "support/force_terms.hpp"

namespace pliant::driven_forces_test {
namespace {

using test::Family;
using test::ForceTerms;
using Handles = std::vector<ParameterHandle>;

KeyFrames<6> turning() {
  KeyFrames<6>::Value begin, end;
  begin << 0.0, 0.0, 0.0, 0.0, 0.0, 0.0;
  end << 0.02, -0.03, 0.01, 0.4, -0.6, 0.2;
  return KeyFrames<6>({{0.0, begin}, {0.2, end}});
}

/// Wind, hands, led regions, applied forces and shapes that are led, each on tetrahedra and hexahedra.
std::vector<Family> families() {
  const auto box = [] { return test::tet_body({0.24, 0.1, 0.24}, {3, 2, 3}, false); };
  const auto quadratic = [] { return test::tet_body({0.24, 0.1, 0.24}, {3, 2, 3}, true); };
  const auto cells = [] { return test::box_body({0.24, 0.12, 0.24}, 0.06); };
  std::vector<Family> list;
  for (const auto& [kind, body] : std::initializer_list<std::pair<std::string, decltype(Family::body)>>{
           {"Tetrahedra", box}, {"QuadraticTetrahedra", quadratic}, {"Hexahedra", cells}}) {
    const Vector3 size = kind == "Hexahedra" ? Vector3(0.24, 0.12, 0.24) : Vector3(0.24, 0.1, 0.24);
    Family wind{"WindOn" + kind,
                body,
                [size](auto of, const MotionBlocks& blocks) {
                  WindOptions options;
                  options.tangential = 0.3;
                  options.gusts = Gusts({4.0, -1.0, 2.0}, Vector3::UnitY(), 0.2, 1.0, 7);
                  return std::make_unique<Wind>(*of, make_box(size, 0.08), options, blocks.wind);
                },
                false,
                true,
                [](const MotionBlocks& blocks) { return Handles{blocks.wind}; }};
    wind.sees_start = wind.rests = true;
    list.push_back(wind);
    Family grip{"LedSpringsOf" + kind,
                body,
                [](auto of, const MotionBlocks&) {
                  LedSpringsOptions options;
                  options.stiffness = 300.0, options.from_rest = true;
                  options.motion = KeyedMotion({0.1, 0.0, 0.0}, turning());
                  return std::make_unique<LedSprings>(*of, surface_patch(*of, {0.1, 0.05, 0.05}, 0.09), options);
                },
                false,
                true,
                [](const MotionBlocks&) { return Handles{}; }};
    grip.has_potential = true;
    list.push_back(grip);
    grip.name = "LedSpringsAsStiffAsTheBodyOf" + kind;
    grip.make = [](auto of, const MotionBlocks& blocks) {
      LedSpringsOptions options;
      options.stiffness = 0.1, options.moduli = blocks.youngs_moduli, options.from_rest = true;
      options.motion = KeyedMotion({0.1, 0.0, 0.0}, turning());
      return std::make_unique<LedSprings>(*of, surface_patch(*of, {0.1, 0.05, 0.05}, 0.09), options);
    };
    grip.parameters = [](const MotionBlocks& blocks) { return blocks.youngs_moduli; };
    list.push_back(grip);
    Family load{"AppliedForceOn" + kind,
                body,
                [](auto of, const MotionBlocks& blocks) {
                  return std::make_unique<PatchLoad>(*of, surface_patch(*of, {0.1, 0.05, 0.05}, 0.09),
                                                     KeyFrames<3>(Vector3(0.3, -2.0, 1.0)), blocks.strengths[0]);
                },
                false,
                false,
                [](const MotionBlocks& blocks) { return Handles{blocks.strengths[0]}; }};
    load.has_potential = true;
    list.push_back(load);
    Family led{
        "RoughContactWithALedCapsuleOf" + kind,
        body,
        [](auto of, const MotionBlocks&) {
          auto contact = std::make_unique<RigidContact>(RigidContact::sliding(
              *of, surface_samples(*of), rigid_capsule({-0.05, 0.03, 0.0}, {0.06, 0.05, 0.03}, 0.06), {2e5, 0.01}));
          contact->set_friction(0.7, 0.5);
          contact->lead(KeyedMotion({0.0, 0.05, 0.0}, turning()));
          return contact;
        },
        true,
        true,
        [](const MotionBlocks&) { return Handles{}; },
        true};
    led.has_potential = led.sees_start = true;
    list.push_back(led);
    led.name = "ContactOfUnknownFrictionWithALedBoxOf" + kind;
    led.make = [](auto of, const MotionBlocks& blocks) {
      auto contact = std::make_unique<RigidContact>(
          RigidContact::sliding(*of, surface_samples(*of), rigid_box({0.0, 0.06, 0.0}, {0.07, 0.05, 0.06}, 0.02),
                                {1e5, 0.01}, blocks.obstacles[0]));
      contact->set_friction(0.0, 0.5);
      contact->lead(KeyedMotion({0.0, 0.05, 0.0}, turning()));
      return contact;
    };
    led.parameters = [](const MotionBlocks& blocks) {
      return Handles{blocks.obstacles[0].friction, blocks.contact_stiffness};
    };
    list.push_back(led);
  }
  return list;
}

INSTANTIATE_TEST_SUITE_P(Situations, ForceTerms, ::testing::ValuesIn(families()),
                         [](const auto& member) { return member.param.name; });

/// What a shape does at rest it does wherever it was moved to.
TEST(RigidShape, MovesAndTurnsAsAWhole) {
  const auto box = rigid_box({0.1, 0.2, -0.1}, {0.3, 0.2, 0.1}, 0.02);
  const RigidMotion motion{Eigen::AngleAxisd(1.1, Vector3(1, 2, -1).normalized()).toRotationMatrix(), {0.4, -0.2, 0.3}};
  const auto moved = rigid_moved(box, motion);
  for (int i = 0; i < 60; ++i) {
    const Vector3 p(0.6 * std::sin(1.3 * i), 0.6 * std::sin(2.1 * i + 1.0), 0.5 * std::cos(0.7 * i));
    const RigidShape::Sample rest = box->sample(p), there = moved->sample(motion(p));
    EXPECT_NEAR(there.distance, rest.distance, 1e-13);
    EXPECT_LT((there.gradient - motion.rotation * rest.gradient).norm(), 1e-13);
    EXPECT_LT((there.hessian - motion.rotation * rest.hessian * motion.rotation.transpose()).norm(), 1e-11);
  }
}

TEST(RigidShape, BoxIsRoundedAtItsEdges) {
  const auto box = rigid_box({0, 0, 0}, {0.3, 0.2, 0.1}, 0.02);
  EXPECT_NEAR(box->sample({0.5, 0, 0}).distance, 0.2, 1e-14);
  EXPECT_NEAR(box->sample({0, 0.15, 0}).distance, -0.05, 1e-14);
  const double corner = (Vector3(0.3, 0.2, 0.1) - Vector3(0.28, 0.18, 0.08)).norm() - 0.02;
  EXPECT_NEAR(box->sample({0.3, 0.2, 0.1}).distance, corner, 1e-14);
  for (int i = 0; i < 60; ++i) {
    const Vector3 p(0.6 * std::sin(1.3 * i), 0.6 * std::sin(2.1 * i + 1.0), 0.5 * std::cos(0.7 * i));
    if (box->sample(p).distance < 0.01) continue;
    const auto distance = [&](const Vector3& q) { return box->sample(q).distance; };
    for (int d = 0; d < 3; ++d) {
      const Vector3 h = 1e-5 * Vector3::Unit(d);
      EXPECT_NEAR((distance(p + h) - distance(p - h)) / 2e-5, box->sample(p).gradient[d], 1e-6);
      const Vector3 bend = (box->sample(p + h).gradient - box->sample(p - h).gradient) / 2e-5;
      EXPECT_LT((bend - box->sample(p).hessian.col(d)).norm(), 1e-3 * (1.0 + bend.norm())) << p.transpose();
    }
  }
}

}  // namespace
}  // namespace pliant::driven_forces_test
