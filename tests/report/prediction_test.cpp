#include "report/prediction.hpp"

#include <cmath>

#include "geometry/primitives.hpp"
#include "temporary_folder.hpp"

namespace pliant {
namespace {

constexpr double length = 0.2, edge = 0.05;
const Vector3 tip(0.5 * length, 0.0, 0.5 * edge);

/// A bar held at its low end, with a marker at its tip.
struct Predictions : ::testing::Test {
  Predictions() {
    capture.file = "capture.toml";
    capture.surface = make_box(Vector3(length, edge, edge), edge);
    capture.density = 1000.0;
    capture.gravity = Vector3(0.0, 0.0, -9.81);
    capture.up = Vector3::UnitZ();
    capture.fixed = {{RegionHalfSpace{{-0.499 * length, 0, 0}, {-1, 0, 0}}, std::nullopt}};
    model.surface = *capture.surface;
    model.youngs_modulus = 2e5, model.poisson_ratio = 0.3, model.stiffness_damping = 2e-3;
    model.density = 1000.0, model.mass = 0.5;
    model.cell_size = edge;
    write_marker_positions(folder / "rest.csv", {{"tip"}, tip.transpose()});
  }
  Vector3 tip_of(const SimulationOptions& options, const CaptureScene& scene) const {
    const Embedding embedding(*scene.discretisation.body, {tip});
    Simulation simulation(scene.discretisation.body, options);
    Vector3 at = Vector3::Zero();
    simulation.run(scene.theta, [&](int, const State& state, auto) {
      at = embedding.position(0, state.x);
      return true;
    });
    return at;
  }

  test::TemporaryFolder folder;
  Capture capture;
  Model model;
};

TEST_F(Predictions, LoadsAreEquilibriaUnderGravityAndTheirWeight) {
  const CaptureScene scene = make_scene(model, capture);
  SimulationOptions options = scene.discretisation.simulation;
  options.is_static = true;
  options.times = {0.0};
  const Vector3 sagging = tip_of(options, scene);
  options.weights = {{tip, 0.1}};
  const Vector3 loaded = tip_of(options, scene);
  ASSERT_LT(loaded.z(), sagging.z() - 1e-3);
  const Vector3 miss(0.0, 0.003, 0.004);
  write_marker_positions(folder / "exact.csv", {{"tip"}, loaded.transpose()});
  write_marker_positions(folder / "missed.csv", {{"tip"}, (loaded + miss).transpose()});
  const auto load = [&](const char* markers) {
    Load l{0.1, tip, {}, {}, {}, {}, {}, "test"};
    if (*markers) l.markers = folder / markers, l.markers_rest = folder / "rest.csv";
    return l;
  };
  capture.loads = {load("exact.csv"), load(""), load("missed.csv")};
  const std::vector<StaticError> errors = predict_loads(capture, scene);
  ASSERT_EQ(errors.size(), 2u) << "a load without markers is left out";
  EXPECT_EQ(errors[0].name, "load 1");
  EXPECT_EQ(errors[1].name, "load 3");
  EXPECT_EQ(errors[1].role, "test");
  EXPECT_LT(errors[0].marker_rms.value(), 1e-8);  // the file keeps nine digits
  EXPECT_NEAR(errors[1].marker_rms.value(), 0.005, 1e-8);
  EXPECT_NEAR(errors[1].marker_max.value(), 0.005, 1e-8);
  const double moved = (loaded + miss - tip).norm();
  EXPECT_NEAR(errors[1].max_displacement.value(), moved, 1e-8);
  EXPECT_NEAR(errors[1].relative_error.value(), 0.005 / moved, 1e-6);
}

TEST_F(Predictions, MarkersFollowTheMotionFromItsStart) {
  for (int frame = 0; frame < 5; ++frame) capture.times.push_back(0.01 * frame);
  capture.start_frame = 2;
  capture.weights = {{0.2, tip}};
  folder.write("track.csv", "frame,id,x,y,z\n0,tip,0,0,0\n");
  capture.markers = {{folder / "rest.csv", folder / "track.csv"}};
  const CaptureScene scene = make_scene(model, capture);
  const MarkerPrediction prediction = predict_markers(capture, scene);
  ASSERT_TRUE(prediction.summary.succeeded);
  EXPECT_EQ(prediction.ids, std::vector<std::string>{"tip"});
  ASSERT_EQ(prediction.frames.size(), 5u);
  EXPECT_TRUE(std::isnan(prediction.frames[1](0, 0))) << "nothing is known before the start";
  EXPECT_LT((prediction.frames[2].row(0).transpose() - tip).norm(), 1e-12);
  EXPECT_LT((prediction.frames[4].row(0).transpose() - tip_of(scene.discretisation.simulation, scene)).norm(), 1e-12);
  capture.weights.clear();
  const MarkerPrediction light = predict_markers(capture, make_scene(model, capture));
  EXPECT_GT(std::abs(light.frames[4](0, 2) - prediction.frames[4](0, 2)), 1e-5)
      << "the capture's weights hang in the scene";
}

TEST_F(Predictions, RefuseMarkersThatAreMissingOrNamedTwice) {
  capture.times = {0.0, 0.01};
  folder.write("track.csv", "frame,id,x,y,z\n0,tip,0,0,0\n");
  const MarkerTrack block{folder / "rest.csv", folder / "track.csv"};
  EXPECT_THROW(predict_markers(capture, make_scene(model, capture)), InputError);
  capture.markers = {block, block};
  EXPECT_THROW(predict_markers(capture, make_scene(model, capture)), InputError);
}

}  // namespace
}  // namespace pliant
