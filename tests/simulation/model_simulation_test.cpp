#include "simulation/model_simulation.hpp"

#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "simulation/scene_simulation.hpp"
#include "simulation/trajectory.hpp"
#include "temporary_folder.hpp"

namespace pliant::model_simulation_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

constexpr double length = 0.2, edge = 0.05, frame_rate = 50.0;
constexpr int frames = 6, start = 2, substeps = 4;

/// A bar held at its low end, with a weight at its other one, above a floor.
Model bar() {
  Model model;
  model.name = "bar";
  model.scene.object.surface = make_box(Vector3(length, edge, edge), edge);
  model.scene.object.density = 1000.0, model.scene.object.mass = 0.5;
  model.scene.world.gravity = Vector3(0.0, 0.0, -9.81);
  model.scene.world.up = Vector3::UnitZ();
  model.scene.timing = evenly_timed(frame_rate, frames, start);
  model.scene.fixed = {{RegionHalfSpace{{-0.499 * length, 0, 0}, {-1, 0, 0}}, std::nullopt}};
  model.scene.planes = {{{0, 0, -0.3}, Vector3::UnitZ(), true}};
  model.scene.weights = {{0.1, {0.5 * length, 0, 0}}};
  model.youngs_modulus = 2e5, model.poissons_ratio = 0.3, model.stiffness_damping = 2e-3;
  model.cell_size = edge, model.substeps = substeps, model.newmark_theta = 0.6;
  return model;
}

TEST(ModelSimulation, IsTheModelsOwnSituation) {
  const ModelScene made = make_scene(bar());
  const SimulationOptions& s = made.simulation;
  ASSERT_EQ(s.times.size(), std::size_t(frames - start));
  EXPECT_EQ(s.times.front(), start / frame_rate);
  EXPECT_FALSE(s.is_static);
  EXPECT_DOUBLE_EQ(s.max_dt, 1.0 / (frame_rate * substeps) * (1.0 + 1e-9));
  EXPECT_EQ(s.newmark_theta, 0.6);
  EXPECT_EQ(s.blocks.planes.size(), 1u);
  EXPECT_EQ(s.holds.size(), 1u);
  ASSERT_EQ(s.weights.size(), 1u);
  EXPECT_EQ(s.weights[0].mass, 0.1);
  EXPECT_EQ(made.theta[made.simulation.blocks.youngs_moduli.front()], 2e5);
  EXPECT_EQ(made.theta[made.simulation.blocks.density], 1000.0);
  EXPECT_EQ(made.simulation.blocks.planes[0].point.vector(made.theta), Vector3(0, 0, -0.3));
}

/// The same bar somewhere else, as another recording has it: its elements are laid there.
TEST(ModelSimulation, ElementsFillTheObjectWhereAnotherSituationHasIt) {
  const Model model = bar();
  Scene elsewhere = model.scene;
  elsewhere.fixed.clear(), elsewhere.weights.clear();
  TriangleMesh moved = *model.scene.object.surface;
  for (Vector3& vertex : moved.vertices) vertex += Vector3(0.31, -0.17, 0.43);
  elsewhere.object.surface = moved;
  const ModelScene made = make_scene(model, elsewhere, scene_distance(elsewhere, Resolution{}.band), {});
  EXPECT_NEAR(made.body->volume(), length * edge * edge, 0.02 * length * edge * edge);
  EXPECT_NEAR(made.body->reference_positions().colwise().mean().x(), 0.31, 0.02 * length);
}

TEST(ModelSimulation, WithoutFramesIsOneEquilibrium) {
  Model model = bar();
  model.scene.timing = {};
  const SimulationOptions s = make_scene(model).simulation;
  EXPECT_TRUE(s.is_static);
  EXPECT_EQ(s.times, std::vector<double>{0.0});
}

TEST(ModelSimulation, AReleaseNeedsThePoseBefore) {
  Model model = bar();
  model.scene.initial.released = true;
  EXPECT_THAT(complaint_of([&] { (void)make_scene(model); }), HasSubstr("knows no pose before a release"));
  Scene other = model.scene;
  model.scene.initial.pulls = {{0, 0, 0.1}, {0, 0.1, 0}};
  const ModelScene made = make_scene(model, other, scene_distance(other, 0.15), "other/capture.toml");
  EXPECT_EQ(made.simulation.blocks.pulls.size(), 2u) << "those of the model";
  EXPECT_EQ(made.simulation.blocks.pulls[1].vector(made.theta), Vector3(0, 0.1, 0));
  model.scene.initial.pulled_at = {{0.1, 0, 0}, {0.2, 0, 0}};
  EXPECT_EQ(make_scene(model, other, scene_distance(other, 0.15), {}).simulation.pull_points.at,
            model.scene.initial.pulled_at);
}

TEST(Trajectory, HasAFileForEachFrame) {
  const TemporaryFolder folder;
  const ModelScene made = make_scene(bar());
  const RolloutSummary summary = write_trajectory(folder.path(), made.body, made.simulation, made.theta);
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  EXPECT_TRUE(std::filesystem::exists(folder / "trajectory.pvd"));
  const VtuGrid first = read_vtu(folder / "frames/000000.vtu"), last = read_vtu(folder / "frames/000003.vtu");
  EXPECT_FALSE(std::filesystem::exists(folder / "frames/000004.vtu"));
  EXPECT_LT(last.points.col(2).minCoeff(), first.points.col(2).minCoeff() - 1e-4) << "it sinks";
}

TEST(Trajectory, FilesHaveTheFieldsOfTheBody) {
  const TemporaryFolder folder;
  const ModelScene made = make_scene(bar());
  std::vector<BodyFields> fields;
  (void)write_trajectory(folder.path(), made.body, made.simulation, made.theta, {},
                         [&](int, const State&, const BodyFields& of) { fields.push_back(of); });
  ASSERT_EQ(fields.size(), 4u);
  const VtuGrid last = read_vtu(folder / "frames/000003.vtu");
  ASSERT_EQ(last.cell_count(), made.body->element_count());
  std::vector<std::string> names;
  for (const VtuArray& array : last.cell_data) names.push_back(array.name);
  EXPECT_THAT(names, testing::UnorderedElementsAre("strain [1]", "stress [Pa]", "von_mises [Pa]", "greatest_strain [1]",
                                                   "tangent_modulus [Pa]"));
  const auto expect_read = [&](const char* name, const std::vector<double>& written) {
    const VtuArray* array = last.find_cell_data(name);
    ASSERT_TRUE(array) << name;
    EXPECT_EQ(array->components, 1);
    ASSERT_EQ(array->values.size(), written.size()) << name;
    const double most = *std::ranges::max_element(written);
    for (std::size_t e = 0; e < written.size(); ++e)
      ASSERT_NEAR(array->values[e], written[e], 1e-6 * most) << name << ": written in single precision";
  };
  expect_read("von_mises [Pa]", fields.back().von_mises);
  expect_read("greatest_strain [1]", fields.back().greatest_strain);
  expect_read("tangent_modulus [Pa]", fields.back().tangent_modulus);
  const double most = *std::ranges::max_element(fields.back().von_mises);
  const VtuArray& stress = *last.find_cell_data("stress [Pa]");
  for (std::size_t e = 0; e < fields.back().von_mises.size(); ++e) {
    const double* s = stress.values.data() + 6 * e;  // xx yy zz xy yz xz
    const Matrix3 tensor{{s[0], s[3], s[5]}, {s[3], s[1], s[4]}, {s[5], s[4], s[2]}};
    ASSERT_NEAR(von_mises(tensor), fields.back().von_mises[e], 1e-5 * most);
  }
}

}  // namespace
}  // namespace pliant::model_simulation_test
