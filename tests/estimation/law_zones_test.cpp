#include "estimation/law_zones.hpp"

#include "estimation/optimiser.hpp"
#include "support/presses.hpp"

namespace pliant::law_zones_test {
namespace {

using By = ZoneCut::By;

TEST(LawZones, CutsOneAfterTheOther) {
  MatrixX coordinates(4, 4);
  coordinates << 0, 0, 0, 1, 0, 1, 0, 2, 0, 2, 0, 1, 0, 3, 0, 2;
  EXPECT_EQ(zones_after(coordinates, {}), (std::vector{0, 0, 0, 0}));
  EXPECT_EQ(zones_after(coordinates, {{0, By::Y, 1.5}}), (std::vector{0, 0, 1, 1}));
  EXPECT_EQ(zones_after(coordinates, {{0, By::Y, 1.5}, {0, By::Y, 0.5}}), (std::vector{0, 2, 1, 1}));
  EXPECT_EQ(zones_after(coordinates, {{0, By::Y, 1.5}, {1, By::Depth, 1.5}}), (std::vector{0, 0, 1, 2}));
}

TEST(LawZones, DepthIsTheDistanceToTheSurface) {
  const test::PressedBlock block({10, 5, 10});
  const MatrixX coordinates = zone_coordinates(*block.body);
  for (Eigen::Index e = 0; e < coordinates.rows(); ++e) {
    const Vector3 centre = coordinates.row(e).head<3>();
    const double depth =
        std::min({0.1 - std::abs(centre.x()), 0.05 - std::abs(centre.y()), 0.1 - std::abs(centre.z())});
    // Samples of the surface lie some millimetres apart.
    EXPECT_NEAR(coordinates(e, 3), depth, 0.006);
  }
}

/// A soft layer on a stiff one.
struct TwoLayers : ::testing::Test {
  TwoLayers() : coordinates(zone_coordinates(*block.body)) {
    const std::vector<int> zone_of = zones_after(coordinates, {{0, By::Y, border}});
    auto layered = std::make_shared<Body>(*block.body);
    layered->modulus = zone_field(block.body->modulus, zone_of, 2);
    VectorX truth = with_zone(one, law_parameters(one, 9000.0).reference(), two, 0);
    truth[two.modulus(1)] = 4000.0;
    truth[two.exponent(0, 1)] = -8.0;
    scene = std::make_shared<PressScene>(
        block.scene(test::PressedBlock::presses(), press_law(*layered, two, truth), noise));
  }

  const LawLayout one{{1, 1}}, two{{2, 1, 2}};
  static constexpr double border = 1e-3, noise = 1e-4;  // of cells of 20 mm
  test::PressedBlock block{{5, 5, 5}};
  MatrixX coordinates;
  std::shared_ptr<const PressScene> scene;
};

TEST_F(TwoLayers, AreFoundByTheCutThatPromisesMost) {
  const ParameterSet set = law_parameters(one, 6000.0);
  PressObjective objective(scene, {0, 1, 2, 3}, one, set, {noise, 5.0});
  const OptimiserSummary best = minimise(objective.cost(), set.to_unconstrained(set.reference()), {});
  ASSERT_TRUE(best.succeeded) << best.reason;
  const auto cut = most_promising_cut(objective, *scene, one, set.to_theta(best.p), {}, 1.5);
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->cut.zone, 0);
  EXPECT_EQ(cut->cut.by, By::Y);
  EXPECT_LT(std::abs(cut->cut.at - border), 0.04) << "of 0.1 m; moving it does the rest";
  EXPECT_GT(cut->evidence, 10.0);
}

TEST(LawZones, ContrastsKnowWhichNumberIsWhich) {
  for (const LawForm& form : {LawForm{1, 0}, LawForm{1, 1}, LawForm{1, 3}, LawForm{1, 3, 1, true}}) {
    const std::vector<std::string> names = law_parameters(LawLayout(form), 5000.0).coordinate_names();
    const VectorX deviation = law_contrast_deviations(form, 7.0);
    ASSERT_EQ(deviation.size(), Eigen::Index(names.size()));
    for (std::size_t i = 0; i < names.size(); ++i) {
      const bool is_stiffness = names[i].starts_with("youngs_modulus") || names[i].starts_with("stiffness_ratio");
      EXPECT_EQ(deviation[Eigen::Index(i)], is_stiffness ? 7.0 : 1.0) << names[i];
    }
  }
}

TEST_F(TwoLayers, DrawACutToTheirBorder) {
  std::vector<ZoneCut> cuts = {{0, By::Y, -0.03}};
  auto cut_scene = std::make_shared<PressScene>(*scene);
  auto body = std::make_shared<Body>(*scene->body);
  body->modulus = zone_field(body->modulus, zones_after(coordinates, cuts), 2);
  cut_scene->body = body;
  const ParameterSet set = zone_parameters(two, 6000.0, 1.5);
  PressObjective objective(cut_scene, {0, 1, 2, 3}, two, set, {noise, 5.0});
  const OptimiserSummary best = minimise(objective.cost(), set.to_unconstrained(set.reference()), {});
  ASSERT_TRUE(best.succeeded) << best.reason;
  const auto move = best_move(objective, *cut_scene, two, set.to_theta(best.p), cuts, 0, 1.5);
  ASSERT_TRUE(move);
  EXPECT_NEAR(move->at, border, 0.02);
  EXPECT_GT(move->gain, 10.0);
}

TEST_F(TwoLayers, AreNotSeenInPressesOfOneMaterial) {
  const ParameterSet set = law_parameters(one, 6000.0);
  const auto uniform = std::make_shared<PressScene>(
      block.scene(test::PressedBlock::presses(), press_law(*block.body, one, set.reference()), noise, 7));
  PressObjective objective(uniform, {0, 1, 2, 3}, one, set, {noise, 5.0});
  const OptimiserSummary best = minimise(objective.cost(), set.to_unconstrained(set.reference()), {});
  ASSERT_TRUE(best.succeeded) << best.reason;
  const auto cut = most_promising_cut(objective, *uniform, one, set.to_theta(best.p), {}, 1.5);
  ASSERT_TRUE(cut);
  EXPECT_LT(cut->evidence, 3.0);
}

}  // namespace
}  // namespace pliant::law_zones_test
