#include "scan/calibrate.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/files.hpp"
#include "capture/observe.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "geometry/surface_distance.hpp"
#include "input_errors.hpp"
#include "rays/look_at.hpp"
#include "synthesis/synthesis.hpp"
#include "temporary_folder.hpp"

namespace pliant::calibrate_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

constexpr double degree = std::numbers::pi / 180.0, radius = 0.08, rate = 30.0;

Points shifted(const TriangleMesh& mesh, const Vector3& shift) {
  return vertex_points(mesh).rowwise() + shift.transpose();
}

/// A hand moves the ball round the space at about a metre a second.
Vector3 hand(double t) {
  return {0.26 * std::sin(3.0 * t), 0.2 * std::sin(4.3 * t + 1.0), 0.22 * std::sin(2.3 * t + 2.0)};
}

/// A pose that is `angle` degrees and `way` millimetres off, turned about the world's origin.
RigidMotion off(const RigidMotion& truth, const Vector3& axis, double angle, const Vector3& way) {
  const Matrix3 R = Eigen::AngleAxisd(angle * degree, axis.normalized()).toRotationMatrix();
  return {R * truth.rotation, R * truth.translation + 1e-3 * way};
}

SyntheticCamera camera(const char* name, const Vector3& eye) {
  return {name, look_at(eye, Vector3::Zero(), Vector3::UnitY(), 240, 180, 0.9), sensor_preset("structured-light"),
          1000.0, 1};
}

/// Three cameras about a metre away. The second is stated 2 degrees and 20 mm off and takes its images 8 ms late; the
/// third is as far off in another way.
Synthesis ball_scene(const std::function<Vector3(double)>& path, int frames = 90) {
  Synthesis s;
  s.name = "ball";
  const TriangleMesh ball = make_sphere(radius, 3);
  s.scene.object.surface = ball;
  s.scene.object.mass = 0.1;
  s.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
  s.scene.timing = evenly_timed(rate, frames);
  s.cameras = {camera("left", {-0.6, 0.3, 0.8}), camera("right", {0.7, 0.2, 0.75}), camera("top", {0.1, 0.9, 0.45})};
  s.cameras[1].time_offset = 0.008;
  s.cameras[1].stated.time_offset = 0.0;
  s.cameras[1].stated.camera_to_world = off(s.cameras[1].camera.camera_to_world, {1, 2, -1}, 2.0, {14.0, -10.0, 10.0});
  s.cameras[2].stated.camera_to_world = off(s.cameras[2].camera.camera_to_world, {-1, 0, 1}, -2.0, {-12.0, 12.0, 10.0});
  s.camera_frames.resize(3);
  for (int f = 0; f < frames; ++f) {
    s.frames.push_back({shifted(ball, path(f / rate)), {}});
    s.camera_frames[1].push_back({shifted(ball, path(f / rate + 0.008)), {}});
  }
  return s;
}

/// A recording of a ball has no scan: it is anywhere.
Capture recorded(const TemporaryFolder& folder, const Synthesis& s) {
  write_synthetic_capture(folder.path(), s);
  std::string text = read_file(folder.path() / "capture.toml");
  const std::string surface = "surface = \"rest.ply\"\n";
  text.erase(text.find(surface), surface.size());
  folder.write("capture.toml", text);
  return read_capture(folder.path());
}

std::vector<SensorCalibration> calibrated(const Synthesis& s, const CalibrationOptions& options) {
  const TemporaryFolder folder;
  return calibrate_by_ball(recorded(folder, s), radius, options);
}

double angle_between(const RigidMotion& a, const RigidMotion& b) {
  return Eigen::AngleAxisd(Matrix3(a.rotation.transpose() * b.rotation)).angle() / degree;
}

/// How far the found pose puts what the camera sees at a place from that place [m].
double error_at(const RigidMotion& found, const RigidMotion& truth, const Vector3& place) {
  return (found(truth.inverse()(place)) - place).norm();
}

TEST(Calibrate, FindsPosesAndClocksFromABallThatIsMovedAbout) {
  const Synthesis s = ball_scene(hand);
  CalibrationOptions options;
  options.reference = "left";
  options.finds_lenses = false;
  const auto found = calibrated(s, options);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_TRUE(found[0].is_reference);
  EXPECT_LT(angle_between(found[0].camera_to_world, s.cameras[0].camera.camera_to_world), 1e-6);
  for (const std::size_t c : {1, 2}) {
    const RigidMotion& truth = s.cameras[c].camera.camera_to_world;
    EXPECT_GT(found[c].rms_before, 0.01) << "the stated pose must be wrong";
    EXPECT_LT(angle_between(found[c].camera_to_world, truth), 0.1);
    EXPECT_LT(error_at(found[c].camera_to_world, truth, Vector3::Zero()), 1e-3);
    EXPECT_LT(found[c].rms_after, 1.5e-3);
    EXPECT_NEAR(found[c].turned / degree, 2.0, 0.1);
    ASSERT_TRUE(found[c].time_offset_std);
    EXPECT_LT(*found[c].time_offset_std, 5e-4);
    // As far off as it says it may be.
    EXPECT_LT(angle_between(found[c].camera_to_world, truth) * degree, 5.0 * found[c].turn_std);
  }
  EXPECT_NEAR(found[1].time_offset, 0.008, 1e-3);
  EXPECT_NEAR(found[2].time_offset, 0.0, 1e-3);
}

TEST(Calibrate, FindsALensThatBends) {
  Synthesis s = ball_scene(hand);
  s.cameras[1].camera.lens = LensDistortion({-0.18, 0.03, 0.0, 0.0});
  s.cameras[1].stated.lens = LensDistortion();
  CalibrationOptions options;
  options.reference = "left";
  const auto found = calibrated(s, options);
  ASSERT_TRUE(found[1].lens_is_found);
  const RigidMotion& truth = s.cameras[1].camera.camera_to_world;
  EXPECT_LT(angle_between(found[1].camera_to_world, truth), 0.2);
  EXPECT_NEAR(found[1].time_offset, 0.008, 1e-3);
  // k1 and k2 stand for each other where the picture ends: what counts is where rays go.
  PinholeCamera with = s.cameras[1].camera, without = with;
  with.lens = found[1].lens, without.lens = {};
  const auto worst = [&](const PinholeCamera& c) {
    double most = 0.0;
    for (const auto& [u, v] : {std::pair(40.0, 30.0), {200.0, 30.0}, {40.0, 150.0}, {200.0, 150.0}})
      most = std::max(most, (c.ray(u, v) - s.cameras[1].camera.ray(u, v)).norm());
    return most;
  };
  EXPECT_LT(worst(with), 0.25 * worst(without));
}

TEST(Calibrate, KeepsAStraightLens) {
  CalibrationOptions options;
  options.reference = "left";
  for (const auto& sensor : calibrated(ball_scene(hand), options)) EXPECT_FALSE(sensor.lens_is_found) << sensor.name;
}

TEST(Calibrate, RefusesABallThatDoesNotSpanTheSpace) {
  const auto complaint = [](const std::function<Vector3(double)>& path) {
    return complaint_of([&] { (void)calibrated(ball_scene(path, 20), {}); });
  };
  EXPECT_THAT(complaint([](double) { return Vector3(0.02, 0.01, 0.0); }), HasSubstr("leave its pose open"));
  EXPECT_THAT(complaint([](double t) { return Vector3(0.2 * std::sin(3.0 * t), 0.0, 0.0); }),
              HasSubstr("leave its pose open"));
}

TEST(Calibrate, RefusesAnotherRadius) {
  const TemporaryFolder folder;
  const Capture capture = recorded(folder, ball_scene(hand, 12));
  EXPECT_THAT(complaint_of([&] { (void)calibrate_by_ball(capture, 3.0 * radius); }), HasSubstr("shows the ball in"));
}

TEST(Calibrate, SaysNothingOfClocksWhereTheBallRestsInEachFrame) {
  Synthesis s = ball_scene(hand);
  s.camera_frames.clear();
  s.scene.timing.is_static = true;
  CalibrationOptions options;
  options.reference = "left";
  const auto found = calibrated(s, options);
  for (const std::size_t c : {1, 2}) {
    EXPECT_FALSE(found[c].time_offset_std);
    EXPECT_LT(angle_between(found[c].camera_to_world, s.cameras[c].camera.camera_to_world), 0.1);
  }
}

/// Three balls of different sizes run together, 0.3 m long: every camera sees faces in all directions.
TriangleMesh lump() {
  const auto distance = [](const Vector3& p) {
    const double a = (p - Vector3(-0.075, 0.0, 0.0)).norm() - 0.075, b = (p - Vector3(0.06, 0.03, 0.015)).norm() - 0.09,
                 c = (p - Vector3(0.0, 0.09, -0.075)).norm() - 0.045, d = (p - Vector3(0.0, 0.06, 0.1)).norm() - 0.04;
    const double k = 60.0;  // a smooth least
    return -std::log(std::exp(-k * a) + std::exp(-k * b) + std::exp(-k * c) + std::exp(-k * d)) / k;
  };
  return make_level_surface(distance, {Vector3::Constant(-0.2), Vector3::Constant(0.2)}, 0.007);
}

Synthesis object_scene(const TriangleMesh& object) {
  Synthesis s = ball_scene(hand, 1);
  s.name = "object";
  s.scene.object.surface = object;
  s.camera_frames.clear();
  s.scene.timing = evenly_timed(rate, 6, 5);
  s.frames.assign(6, {vertex_points(object), {}});
  s.cameras[0].stated.camera_to_world = off(s.cameras[0].camera.camera_to_world, {1, 1, 0}, 1.5, {-8.0, 10.0, 15.0});
  return s;
}

TEST(Calibrate, MovesWhatCamerasSeeOfTheObjectOntoItsScan) {
  const Synthesis s = object_scene(lump());
  const TemporaryFolder folder;
  write_synthetic_capture(folder.path(), s);
  const auto found = calibrate_by_object(read_capture(folder.path()));
  for (std::size_t c = 0; c < 3; ++c) {
    const RigidMotion& truth = s.cameras[c].camera.camera_to_world;
    EXPECT_LT(angle_between(found[c].camera_to_world, truth), 0.4) << c << " +- " << found[c].turn_std / degree;
    EXPECT_LT(error_at(found[c].camera_to_world, truth, Vector3::Zero()), 1.5e-3) << c << " +- " << found[c].shift_std;
    EXPECT_LT(angle_between(found[c].camera_to_world, truth) * degree, 4.0 * found[c].turn_std);
    EXPECT_LT(found[c].rms_after, 0.5 * found[c].rms_before) << c;
    EXPECT_FALSE(found[c].time_offset_std);
  }
}

TEST(Calibrate, RefusesAnObjectThatMayTurn) {
  const TemporaryFolder folder;
  write_synthetic_capture(folder.path(), object_scene(make_sphere(0.1, 3)));
  EXPECT_THAT(complaint_of([&] { (void)calibrate_by_object(read_capture(folder.path())); }),
              HasSubstr("leaves its pose open"));
}

TEST(Calibrate, WritesTheCaptureWithMendedCameras) {
  const Synthesis s = object_scene(lump());
  const TemporaryFolder folder;
  const std::filesystem::path out = folder / "calibrated";
  write_synthetic_capture(folder.path(), s);
  const Capture capture = read_capture(folder.path());
  std::vector<SensorCalibration> sensors(1);
  sensors[0].name = "top", sensors[0].camera_to_world = s.cameras[2].camera.camera_to_world;
  sensors[0].lens = LensDistortion({0.01, 0, 0, 0, 0}), sensors[0].time_offset = 0.004;
  sensors[0].turn_std = 3e-4, sensors[0].shift_std = 4e-4;
  write_capture(out, as_seen_from(with_calibration(capture, sensors), out));
  const Capture again = read_capture(out);
  EXPECT_TRUE(again.depth[2].camera.camera_to_world.rotation.isApprox(sensors[0].camera_to_world.rotation, 1e-12));
  EXPECT_EQ(again.depth[2].camera.lens, sensors[0].lens);
  EXPECT_EQ(again.depth[2].time_offset, 0.004);
  EXPECT_EQ(again.depth[2].pose_std, (PoseStd{3e-4, 4e-4})) << "the next fit begins with what was found";
  EXPECT_EQ(again.depth[0].pose_std, PoseStd());
  DepthCamera same = capture.depth[0];
  same.images = again.depth[0].images;
  same.masks = again.depth[0].masks;
  EXPECT_LT(angle_between(same.camera.camera_to_world, again.depth[0].camera.camera_to_world), 1e-6);
  same.camera.camera_to_world = again.depth[0].camera.camera_to_world;  // but for its rounding
  EXPECT_TRUE(again.depth[0] == same);
  EXPECT_EQ(observe(again).front().points.size(), observe(capture).front().points.size());
  sensors.push_back(sensors[0]);  // by a ball: against the reference, whose pose is as it was stated
  sensors[1].name = capture.depth[0].name, sensors[1].is_reference = true;
  sensors[1].turn_std = sensors[1].shift_std = 0.0;
  const Capture by_ball = with_calibration(capture, sensors);
  EXPECT_EQ(by_ball.depth[0].pose_std, PoseStd());
  EXPECT_NEAR(by_ball.depth[2].pose_std.turn, std::hypot(PoseStd().turn, 3e-4), 1e-15);
  sensors.pop_back();
  sensors[0].name = "bottom";
  EXPECT_THAT(complaint_of([&] { (void)with_calibration(capture, sensors); }), HasSubstr("no depth camera \"bottom\""));
}

}  // namespace
}  // namespace pliant::calibrate_test
