#include "ensemble/member.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "input_errors.hpp"
#include "simulation/small_motions.hpp"
#include "support/models.hpp"
#include "temporary_folder.hpp"

namespace pliant::member_test {
namespace {

using test::complaint_of;
using testing::Each;
using testing::HasSubstr;
using testing::IsNan;

constexpr DrawnMaterial soft = {1.2e5, 0.4, 0.2, 1e-3};

double output(const EnsembleScene& scene, const MemberRecord& record, const std::string& name) {
  for (std::size_t k = 0; k < scene.outputs().size(); ++k)
    if (scene.outputs()[k].name == name) return record.outputs[k];
  ADD_FAILURE() << "no output " << name;
  return 0.0;
}

/// A point of a frame of a record [m].
Vector3 point(const RecordShape& shape, const MemberRecord& record, int frame, int number) {
  const float* at = &record.positions[3 * std::size_t(frame * shape.points + number)];
  return {at[0], at[1], at[2]};
}

MarkerPositions tip() {
  MarkerPositions points;
  points.ids = {"tip"};
  points.positions.resize(1, 3);
  points.positions.row(0) << 0.1, 0.0, 0.0;  // the middle of the free end
  return points;
}

TEST(EnsembleMember, IsTheModelOfItsMaterial) {
  const Model model = test::block(true);
  const EnsembleScene scene(model, {tip(), true});
  const MemberRecord record = scene.simulate(soft);
  ASSERT_EQ(record.state, MemberRecord::State::Simulated) << record.reason;
  const RecordShape shape = scene.shape();
  ASSERT_EQ(record.outputs.size(), std::size_t(shape.outputs));
  ASSERT_EQ(record.series.size(), shape.frame_series());
  ASSERT_EQ(record.positions.size(), shape.frame_points());

  // The same by way of the model that has this material.
  const ModelScene alone = make_scene(with_material(model, soft));
  std::vector<Vector3> places = scene.surface().vertices;
  places.push_back({0.1, 0.0, 0.0});
  const Embedding points(*alone.body, places);
  const Points rest = points.positions(alone.body->reference_positions());
  Simulation simulation(alone.body, alone.simulation);
  double most = 0.0, lowest = HUGE_VAL;
  (void)simulation.run(alone.theta, [&](int frame, const State& state, auto) {
    const Points there = points.positions(state.x);
    for (Eigen::Index i = 0; i < there.rows(); ++i)
      EXPECT_LT((point(shape, record, frame, int(i)) - there.row(i).transpose()).norm(), 1e-8);  // of floats
    const Points vertices = there.topRows(there.rows() - 1);
    most = std::max(most, (vertices - rest.topRows(vertices.rows())).rowwise().norm().maxCoeff());
    lowest = std::min(lowest, vertices.col(1).minCoeff());
    return true;
  });
  EXPECT_GT(most, 1e-4) << "it moves";
  EXPECT_NEAR(output(scene, record, "greatest_displacement"), most, 1e-15);
  EXPECT_NEAR(output(scene, record, "lowest_y"), lowest, 1e-15);
  const Vector3 end = point(shape, record, shape.frames - 1, shape.points - 1);
  EXPECT_FLOAT_EQ(float(output(scene, record, "y@tip")), float(end.y()));
  EXPECT_GT(output(scene, record, "greatest_displacement@tip"), 0.5 * most);
  EXPECT_FLOAT_EQ(record.series[std::size_t(shape.series) * std::size_t(shape.frames - 1)],
                  float(output(scene, record, "end_displacement")));
}

/// Of a bar that is pulled down by gravity alone: w L^4 / 8 E I and the first bending, roughly.
TEST(EnsembleMember, TellsFrequencyAndStrainOfItsOwn) {
  const EnsembleScene scene(test::block(true), {});
  DrawnMaterial stiff = soft;
  stiff.youngs_modulus *= 4.0;
  const MemberRecord a = scene.simulate(soft), b = scene.simulate(stiff);
  // Squared frequencies are proportional to the modulus.
  EXPECT_NEAR(output(scene, b, "first_frequency") / output(scene, a, "first_frequency"), 2.0, 1e-6);
  const ModelScene alone = make_scene(with_material(test::block(true), soft));
  EXPECT_NEAR(
      output(scene, a, "first_frequency"),
      small_motions(alone.body, elastic_alone(alone.simulation), alone.theta, alone.body->nodes, 3).frequencies.front(),
      1e-6 * output(scene, a, "first_frequency"));
  EXPECT_GT(output(scene, a, "peak_strain"), 1e-4);
  EXPECT_LT(output(scene, b, "peak_strain"), output(scene, a, "peak_strain"));
}

TEST(EnsembleMember, DependsOnItsMaterialAlone) {
  const EnsembleScene scene(test::block(false), {});
  const MemberRecord first = scene.simulate(soft);
  (void)scene.simulate({5e5, 0.1, 0.0, 0.0});
  const MemberRecord again = scene.simulate(soft);
  EXPECT_EQ(first.positions, again.positions);
  EXPECT_EQ(first.outputs, again.outputs);
  const EnsembleScene bare(test::block(false), {{}, false});
  EXPECT_EQ(bare.simulate(soft).outputs, first.outputs) << "whatever is kept";
  EXPECT_EQ(bare.shape().points, 0);
}

TEST(EnsembleMember, ThatCannotBeSimulatedSaysWhy) {
  Model model = test::block(false);
  model.scene.timing = {}, model.scene.planes.clear();  // it would be at rest in the air
  const EnsembleScene scene(model, {tip(), true});
  const MemberRecord record = scene.simulate(soft);
  EXPECT_EQ(record.state, MemberRecord::State::Failed);
  EXPECT_FALSE(record.reason.empty());
  EXPECT_EQ(record.positions.size(), scene.shape().frame_points());
  EXPECT_THAT(record.outputs, Each(IsNan()));
}

TEST(EnsembleMember, IsStoppedWithinItsMotion) {
  const EnsembleScene scene(test::block(true), {});
  EXPECT_THROW((void)scene.simulate(soft, [] { return true; }), Interrupted);
}

TEST(EnsembleScene, OfAStaticModelIsItsEquilibrium) {
  Model model = test::block(true);
  model.scene.timing = {};
  const EnsembleScene scene(model, {});
  EXPECT_EQ(scene.shape().frames, 1);
  const MemberRecord record = scene.simulate(soft);
  ASSERT_EQ(record.state, MemberRecord::State::Simulated) << record.reason;
  EXPECT_GT(output(scene, record, "end_displacement"), 1e-3) << "it sags";
}

TEST(EnsembleScene, RefusesALawOfItsOwn) {
  EXPECT_THAT(complaint_of([] { const EnsembleScene scene(test::pressed_block(), {}); }),
              HasSubstr("a material law of its own (`ogden`)"));
}

TEST(EnsembleScene, NamesPointsThatLieElsewhere) {
  EnsembleQuestion question{tip(), true};
  question.points.positions *= 1000.0;  // in millimetres
  EXPECT_THAT(complaint_of([&] { const EnsembleScene scene(test::block(true), question, "tips.csv"); }),
              HasSubstr("tips.csv: point \"tip\" lies far from the object"));
}

}  // namespace
}  // namespace pliant::member_test
