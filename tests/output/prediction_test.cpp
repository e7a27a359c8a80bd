#include "output/prediction.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include "capture/point_cloud.hpp"
#include "geometry/primitives.hpp"
#include "support/load_errors.hpp"
#include "support/tolerance.hpp"
#include "temporary_folder.hpp"

namespace pliant::prediction_test {
namespace {

using test::tolerance;

constexpr double length = 0.2, edge = 0.05;
const Vector3 tip(0.5 * length, 0.0, 0.5 * edge);

/// A bar held at its low end, with a marker at its tip.
struct Predictions : ::testing::Test {
  Predictions() {
    capture.file = "capture.toml";
    capture.scene.object.surface = make_box(Vector3(length, edge, edge), edge);
    capture.scene.object.surface_noise = 0.0;
    capture.scene.object.density = 1000.0;
    capture.scene.world.gravity = Vector3(0.0, 0.0, -9.81);
    capture.scene.world.up = Vector3::UnitZ();
    capture.scene.fixed = {{RegionHalfSpace{{-0.499 * length, 0, 0}, {-1, 0, 0}}, std::nullopt}};
    model.scene.object.surface = capture.scene.object.surface;
    model.youngs_modulus = 2e5, model.poissons_ratio = 0.3, model.stiffness_damping = 2e-3;
    model.scene.object.density = 1000.0, model.scene.object.mass = 0.5;
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

TEST_F(Predictions, SayWhatTheyTakeAsKnownThatIsNot) {
  capture.scene.planes = {{Vector3::Zero(), Vector3::UnitZ(), true}};
  EXPECT_EQ(taken_as_known(capture), "");
  capture.scene.initial.known = false;
  EXPECT_THAT(taken_as_known(capture), testing::StartsWith("the velocity at the start is taken as the capture has it"));
  capture.scene.planes.front().known = false;
  EXPECT_THAT(taken_as_known(capture), testing::HasSubstr("start and where the ground lies are taken"));
  EXPECT_THAT(taken_as_known(capture), testing::HasSubstr("--hold-out"));
  capture.scene.initial.released = true;  // from rest
  EXPECT_THAT(taken_as_known(capture), testing::StartsWith("where the ground lies is"));
}

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
  capture.loads = {load("exact.csv"), load("missed.csv")};
  const std::vector<LoadError> errors = predict_loads(capture, scene);
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_EQ(errors[0].name, "load 1");
  EXPECT_EQ(errors[1].name, "load 2");
  EXPECT_EQ(errors[1].observed, "markers");
  EXPECT_EQ(errors[1].points, 1);
  EXPECT_NEAR(errors[1].mean.value(), 0.005, 1e-8);
  EXPECT_NEAR(errors[1].max.value(), 0.005, 1e-8);
  EXPECT_NEAR(errors[1].relative_mean.value(), 0.005 / length, 1e-6);
  EXPECT_NEAR(errors[1].relative_max.value(), 0.005 / length, 1e-6);
  EXPECT_EQ(errors[1].role, "test");
  EXPECT_LT(errors[0].marker_rms.value(), 1e-8);  // the file keeps nine digits
  EXPECT_NEAR(errors[1].marker_rms.value(), 0.005, 1e-8);
  EXPECT_NEAR(errors[1].marker_max.value(), 0.005, 1e-8);
  const double moved = (loaded + miss - tip).norm();
  EXPECT_NEAR(errors[1].max_displacement.value(), moved, 1e-8);
  EXPECT_NEAR(errors[1].relative_error.value(), 0.005 / moved, 1e-6);
}

/// Clouds of the bar under a weight, as its own model has it, with noise along the surface's normals.
struct LoadClouds : Predictions {
  static constexpr double mass = 0.1, noise = 2e-4;

  /// Seen from above and from the side: the bar's upper and one of its other faces, and five readings in the air.
  void write_cloud(const CaptureScene& scene) {
    SimulationOptions options = scene.discretisation.simulation;
    options.is_static = true;
    options.times = {0.0};
    options.weights = {{tip, mass}};
    TriangleMesh surface = *capture.scene.object.surface;
    const Embedding embedding(*scene.discretisation.body, surface.vertices);
    Simulation simulation(scene.discretisation.body, options);
    const RolloutSummary summary = simulation.run(scene.theta, [&](int, const State& state, auto) {
      const Points moved = embedding.positions(state.x);
      for (Eigen::Index v = 0; v < moved.rows(); ++v) surface.vertices[std::size_t(v)] = moved.row(v).transpose();
      return true;
    });
    ASSERT_TRUE(summary.succeeded) << summary.failure;
    std::mt19937 random(7);
    std::normal_distribution<double> normal(0.0, noise);
    std::uniform_real_distribution<double> uniform;
    std::vector<Vector3> points;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      const auto& [a, b, c] = surface.triangles[t];
      const std::vector<Vector3>& v = surface.vertices;
      const Vector3 n = (v[b] - v[a]).cross(v[c] - v[a]).normalized();
      if (n.z() < 0.5 && n.y() < 0.5) continue;
      for (int k = 0; k < 60; ++k) {
        const double s = std::sqrt(uniform(random)), u = uniform(random);
        points.push_back((1 - s) * v[a] + s * (1 - u) * v[b] + s * u * v[c] + normal(random) * n);
      }
    }
    sound = int(points.size());
    for (int k = 0; k < 5; ++k) points.emplace_back(0.02 * k, 0.06 + 0.01 * k, 0.08);
    write_points(folder / "load.ply", points);
    capture.loads = {Load{mass, tip, folder / "load.ply", {}, {}, {}, {}, "test"}};
  }
  LoadError predicted(double youngs_modulus) {
    model.youngs_modulus = youngs_modulus;
    return predict_loads(capture, make_scene(model, capture)).front();
  }
  int sound = 0;
};

TEST_F(LoadClouds, LieAsFarFromTheRightModelAsTheirNoise) {
  write_cloud(make_scene(model, capture));
  const LoadError right = predicted(2e5);
  EXPECT_EQ(right.observed, "cloud");
  EXPECT_EQ(right.role, "test");
  EXPECT_EQ(right.outliers, 5);
  EXPECT_EQ(right.points, sound);
  // The mean of |N(0, s)| is 0.8 s; a hundredth of it is what so many points leave.
  EXPECT_NEAR(right.mean.value() / noise, std::sqrt(2.0 / std::numbers::pi), tolerance(0.03));
  EXPECT_LT(right.max.value(), 6.0 * noise);
  EXPECT_DOUBLE_EQ(right.relative_mean.value(), *right.mean / length);
  EXPECT_DOUBLE_EQ(right.relative_max.value(), *right.max / length);
  EXPECT_FALSE(right.marker_rms) << "no point was followed";
  EXPECT_TRUE(right.failure.empty());
}

TEST_F(LoadClouds, LieFartherFromAWrongModel) {
  write_cloud(make_scene(model, capture));
  const double right = predicted(2e5).mean.value(), near = predicted(1.7e5).mean.value();
  EXPECT_GT(near, 1.5 * right);
  EXPECT_GT(predicted(1e5).mean.value(), 2.0 * near);
  EXPECT_GT(predicted(4e5).mean.value(), 2.0 * right);
}

TEST_F(LoadClouds, WithoutEquilibriumSaySoAndStopNoOther) {
  write_cloud(make_scene(model, capture));
  capture.scene.fixed.clear();  // nothing holds it against gravity
  capture.loads.push_back(capture.loads.front());
  const std::vector<LoadError> errors = predict_loads(capture, make_scene(model, capture));
  ASSERT_EQ(errors.size(), 2u);
  for (const LoadError& error : errors) {
    EXPECT_NE(error.failure.find("no equilibrium"), std::string::npos) << error.failure;
    EXPECT_FALSE(error.mean);
    EXPECT_NE(load_sentence(error).find("no equilibrium"), std::string::npos);
  }
}

TEST_F(LoadClouds, TooHeavyALoadLeavesTheOthers) {
  write_cloud(make_scene(model, capture));
  Load heavy = capture.loads.front(), far = heavy;
  heavy.mass = 1e5;
  write_points(folder / "far.ply", std::vector<Vector3>{{0, 0, 90}});
  far.cloud = folder / "far.ply";
  capture.loads.insert(capture.loads.begin(), heavy);
  capture.loads.push_back(far);
  const std::vector<LoadError> errors = predict_loads(capture, make_scene(model, capture));
  ASSERT_EQ(errors.size(), 3u);
  EXPECT_NE(errors[0].failure.find("no equilibrium"), std::string::npos) << errors[0].failure;
  EXPECT_TRUE(errors[1].failure.empty()) << errors[1].failure;
  EXPECT_TRUE(errors[1].mean);
  EXPECT_NE(errors[2].failure.find("nothing of the object was seen"), std::string::npos) << errors[2].failure;
}

TEST(LoadSentence, IsToldInMillimetresAndPercent) {
  EXPECT_EQ(load_sentence(test::seen_load()),
            "load 1 (test): mean 1 mm (0.50 % of the object's size), max 4 mm (2.00 % of the object's size), "
            "400 points, 3 that stand alone left out");
}

/// A model that was fitted to one release predicts another whose weight is known, and needs no pulls for it.
TEST_F(Predictions, AReleaseFromUnderAKnownWeightStartsAtItsEquilibrium) {
  capture.scene.timing.times = {0.0, 0.01};
  capture.scene.initial.released = true;
  EXPECT_THROW(make_scene(model, capture), InputError) << "nobody knows what held it";
  capture.scene.initial.release_of = Weight{0.1, tip};
  const CaptureScene scene = make_scene(model, capture);
  SimulationOptions at_rest = scene.discretisation.simulation, first = at_rest;
  ASSERT_EQ(first.released_weights.size(), 1u);
  first.times = {0.0};
  at_rest.times = {0.0};
  at_rest.is_static = true;
  at_rest.weights = {{tip, 0.1}};
  EXPECT_LT((tip_of(first, scene) - tip_of(at_rest, scene)).norm(), 1e-9);
  at_rest.weights.clear();
  EXPECT_GT((tip_of(first, scene) - tip_of(at_rest, scene)).norm(), 1e-3);
}

TEST_F(Predictions, MarkersFollowTheMotionFromItsStart) {
  for (int frame = 0; frame < 5; ++frame) capture.scene.timing.times.push_back(0.01 * frame);
  capture.scene.timing.start_frame = 2;
  capture.scene.weights = {{0.2, tip}};
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
  capture.scene.weights.clear();
  const MarkerPrediction light = predict_markers(capture, make_scene(model, capture));
  EXPECT_GT(std::abs(light.frames[4](0, 2) - prediction.frames[4](0, 2)), 1e-5)
      << "the capture's weights hang in the scene";
}

TEST_F(Predictions, RefuseMarkersThatAreMissingOrNamedTwice) {
  capture.scene.timing.times = {0.0, 0.01};
  folder.write("track.csv", "frame,id,x,y,z\n0,tip,0,0,0\n");
  const MarkerTrack block{folder / "rest.csv", folder / "track.csv"};
  EXPECT_THROW(predict_markers(capture, make_scene(model, capture)), InputError);
  capture.markers = {block, block};
  EXPECT_THROW(predict_markers(capture, make_scene(model, capture)), InputError);
}

}  // namespace
}  // namespace pliant::prediction_test
