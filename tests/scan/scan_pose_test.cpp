#include "scan/scan_pose.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "rays/look_at.hpp"
#include "rays/ray_scene.hpp"
#include "synthesis/synthesis.hpp"
#include "temporary_folder.hpp"

namespace pliant::scan_pose_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

/// Three balls of different sizes run together: no turn brings it onto itself. 0.2 m long.
TriangleMesh lump() {
  const auto distance = [](const Vector3& p) {
    const double a = (p - Vector3(-0.05, 0.0, 0.0)).norm() - 0.05, b = (p - Vector3(0.04, 0.02, 0.01)).norm() - 0.06,
                 c = (p - Vector3(0.0, 0.06, -0.05)).norm() - 0.03;
    const double k = 60.0;  // a smooth least
    return -std::log(std::exp(-k * a) + std::exp(-k * b) + std::exp(-k * c)) / k;
  };
  return make_level_surface(distance, {Vector3::Constant(-0.14), Vector3::Constant(0.14)}, 0.005);
}

RigidMotion any_motion(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Eigen::Quaterniond q =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  return {q.toRotationMatrix(), Vector3(normal(random), normal(random), normal(random))};
}

TriangleMesh moved(TriangleMesh mesh, const RigidMotion& motion, double scale = 1.0) {
  for (Vector3& vertex : mesh.vertices) vertex = scale * motion(vertex);
  return mesh;
}

/// What depth cameras record of an object that stays in the air, before an empty room.
struct Recording {
  Recording(const TriangleMesh& object, const TriangleMesh& scan, const std::string& keys) {
    Synthesis s;
    s.name = "in the air";
    s.scene.object.surface = object;
    s.frames.assign(3, {vertex_points(object), {}});
    s.scene.timing = evenly_timed(60.0, 3, 1);
    s.scene.object.mass = 0.1;
    s.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
    s.cameras.push_back({"front", look_at({0.3, 0.3, 0.7}, Vector3::Zero(), Vector3::UnitY(), 320, 240, 0.6),
                         sensor_preset("structured-light"), 1000.0, 1});
    write_synthetic_capture(folder.path(), s);
    std::string text = read_file(folder.path() / "capture.toml");
    const std::string surface = "surface = \"rest.ply\"\n";
    text.replace(text.find(surface), surface.size(), surface + keys);
    folder.write("capture.toml", text);
    write_mesh(folder.path() / "rest.ply", scan);
  }
  Capture read() const { return read_capture(folder.path()); }
  TemporaryFolder folder;
};

double mean_distance(const TriangleMesh& a, const TriangleMesh& b) {
  double sum = 0.0;
  for (std::size_t v = 0; v < a.vertices.size(); ++v) sum += (a.vertices[v] - b.vertices[v]).norm();
  return sum / double(a.vertices.size());
}

/// The sensor reads to 1 to 2 mm; a pose from a thousand readings is known better.
constexpr double pose_error = 1.5e-3;

TEST(ScanPose, IsFoundFromAnyTurn) {
  const TriangleMesh object = lump();
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Recording recording(object, moved(object, any_motion(seed)), "pose = \"unknown\"\n");
    Capture capture = recording.read();
    EXPECT_FALSE(capture.scene.object.pose_is_known);
    std::optional<ScanPose> pose;
    const auto seen = observe_placed(capture, {}, {}, &pose);
    ASSERT_TRUE(pose);
    EXPECT_TRUE(capture.scene.object.pose_is_known);
    EXPECT_EQ(seen.size(), 3u);
    EXPECT_LT(mean_distance(*capture.scene.object.surface, object), pose_error) << seed;
    EXPECT_LT(pose->rms, 2e-3);
    EXPECT_GT(pose->overlap, 0.8);
    EXPECT_GT(pose->runner_up, 1.3) << "nothing else fits";
  }
}

TEST(ScanPose, FindsTheUnit) {
  const TriangleMesh object = lump();
  const Recording recording(object, moved(object, any_motion(4), 1000.0), "pose = \"unknown\"\nscale = \"unknown\"\n");
  Capture capture = recording.read();
  std::optional<ScanPose> pose;
  (void)observe_placed(capture, {}, {}, &pose);
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->scale, 1e-3, 0.02e-3) << "a pixel of the outline is a hundredth of the object";
  EXPECT_LT(mean_distance(*capture.scene.object.surface, object), 3e-3);
}

TEST(ScanPose, OfAWholeCloudIsExact) {
  const TriangleMesh object = lump();
  const RigidMotion motion = any_motion(5);
  ObservedFrame seen;
  for (std::size_t v = 0; v < object.vertices.size(); v += 2) {
    seen.points.push_back(motion(object.vertices[v]));
    seen.noise.push_back(1e-4f), seen.view.push_back(Vector3::Zero());
    seen.camera.push_back(-1), seen.pixel.push_back(-1);
  }
  const ScanPose pose = find_scan_pose(object, Capture{}, seen);
  EXPECT_LT(mean_distance(placed(object, pose), moved(object, motion)), 3e-4) << "a tenth of the distance grid";
  EXPECT_EQ(pose.overlap, 1.0);
}

TEST(ScanPose, OfABallFitsInManyWaysAndSaysSo) {
  const TriangleMesh ball = make_sphere(0.08, 3);
  const Recording recording(ball, moved(ball, any_motion(6)), "pose = \"unknown\"\n");
  Capture capture = recording.read();
  std::optional<ScanPose> pose;
  (void)observe_placed(capture, {}, {}, &pose);
  ASSERT_TRUE(pose);
  EXPECT_GT(pose->runner_up, 0.0);
  EXPECT_LT(pose->runner_up, 1.3);
  Vector3 middle = Vector3::Zero();
  for (const Vector3& v : capture.scene.object.surface->vertices)
    middle += v / double(capture.scene.object.surface->vertices.size());
  EXPECT_LT(middle.norm(), pose_error);
}

TEST(ScanPose, MovesWhatStandsInTheScansFrame) {
  Scene scene;
  scene.object.surface = make_sphere(0.1, 1);
  scene.object.pose_is_known = scene.object.scale_is_known = false;
  scene.fixed = {{RegionSphere{{1.0, 0.0, 0.0}, 2.0}, std::nullopt},
                 {RegionHalfSpace{{1.0, 0.0, 0.0}, {1.0, 0.0, 0.0}}, std::nullopt}};
  scene.weights = {{0.1, {0.0, 1.0, 0.0}}};
  scene.forces = {{{0.0, 0.0, 1.0}, 0.1, {}, true}};
  ScanPose pose;
  pose.motion = {Eigen::AngleAxisd(0.5 * 3.14159265358979, Vector3::UnitZ()).toRotationMatrix(), {0.0, 0.0, 5.0}};
  pose.scale = 0.1;
  place(scene, pose);
  EXPECT_LT((std::get<RegionSphere>(scene.fixed[0].region).centre - Vector3(0.0, 0.1, 5.0)).norm(), 1e-12);
  EXPECT_NEAR(std::get<RegionSphere>(scene.fixed[0].region).radius, 0.2, 1e-12);
  EXPECT_LT((std::get<RegionHalfSpace>(scene.fixed[1].region).normal - Vector3::UnitY()).norm(), 1e-12);
  EXPECT_LT((scene.weights[0].at - Vector3(-0.1, 0.0, 5.0)).norm(), 1e-12);
  EXPECT_LT((scene.forces[0].at - Vector3(0.0, 0.0, 5.1)).norm(), 1e-12);
  EXPECT_TRUE(scene.object.pose_is_known);
  scene.fixed = {{RegionBox{Vector3::Zero(), Vector3::Ones()}, std::nullopt}};
  EXPECT_THROW(place(scene, pose), std::invalid_argument);
}

TEST(ScanPose, WhatCannotBePlacedIsRefused) {
  const TriangleMesh object = lump();
  ObservedFrame few;
  few.frame = 7;
  few.points.assign(20, Vector3::Zero());
  EXPECT_THAT(complaint_of([&] { (void)find_scan_pose(object, Capture{}, few); }),
              HasSubstr("frame 7 shows 20 points"));
  EXPECT_THROW((void)find_scan_pose(TriangleMesh{}, Capture{}, few), std::invalid_argument);
  const Recording scaled(object, object, "scale = \"unknown\"\n");
  EXPECT_THAT(complaint_of([&] { (void)scaled.read(); }), HasSubstr("pose = \"unknown\" beside it"));
  const Recording held(object, object, "pose = \"unknown\"\n");
  held.folder.write("capture.toml", read_file(held.folder.path() / "capture.toml") +
                                        "[[fixed]]\nbox = { min = [-1, -1, -1], max = [-0.08, 1, 1] }\n");
  EXPECT_THAT(complaint_of([&] { (void)held.read(); }), HasSubstr("a box cannot be turned"));
}

/// A lump that spins while it flies, and what a sensor sees of the side that faces +z.
struct Flown {
  TriangleMesh scan = lump();
  Vector3 centre = enclosed_centroid(scan), velocity{0.4, 0.3, -0.1}, gravity{0.0, -9.81, 0.0};
  Vector3 spin{1.0, -3.0, 2.0};  // [rad/s]
  double noise = 0.001;          // [m]
  Capture capture;
  std::vector<ObservedFrame> frames;

  explicit Flown(int count, const std::function<Vector3(double)>& moved_too = {}) {
    capture.scene.object.surface = scan;
    capture.scene.world.gravity = gravity;
    capture.scene.timing.start_frame = 2;
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int f = 0; f < count + 2; ++f) {
      capture.scene.timing.times.push_back(0.5 + f / 60.0);
      const double t = std::max(0, f - 2) / 60.0;  // held before
      const Matrix3 turn = Eigen::AngleAxisd(spin.norm() * t, spin.normalized()).toRotationMatrix();
      Vector3 at = centre + t * velocity + 0.5 * t * t * gravity;
      if (moved_too) at += moved_too(t);
      ObservedFrame& seen = frames.emplace_back();
      seen.frame = f;
      for (const auto& face : scan.triangles) {
        const Vector3 &a = scan.vertices[std::size_t(face[0])], &b = scan.vertices[std::size_t(face[1])],
                      &c = scan.vertices[std::size_t(face[2])];
        const Vector3 normal_there = turn * (b - a).cross(c - a).normalized();
        if (normal_there.z() < 0.2) continue;
        seen.points.push_back(turn * ((a + b + c) / 3.0 - centre) + at + noise * normal(random) * normal_there);
      }
    }
  }
};

TEST(FreeFlight, IsTheParabolaOfASpinningScan) {
  const Flown flown(12);
  const std::optional<Flight> flight = free_flight(flown.capture, flown.frames);
  ASSERT_TRUE(flight);
  EXPECT_EQ(flight->frames, 12);
  EXPECT_LT((flight->acceleration - flown.gravity).norm(), 0.2);
  EXPECT_LT((flight->velocity - flown.velocity).norm(), 0.02);
  EXPECT_GT(flight->acceleration_std, 0.0);
  EXPECT_LT(flight->acceleration_std, 0.1);
}

TEST(FreeFlight, EndsWhereItComesNearAPlane) {
  Flown flown(16);
  double lowest = infinite;
  for (const Vector3& v : flown.scan.vertices) lowest = std::min(lowest, v.y());
  Plane floor;
  floor.normal = Vector3::UnitY(), floor.point = Vector3(0.0, lowest - 0.1, 0.0);
  flown.capture.scene.planes = {floor};
  const std::optional<Flight> flight = free_flight(flown.capture, flown.frames);
  ASSERT_TRUE(flight);
  // It rises first: 0.1 m below are met after 0.177 s, were it not turned.
  EXPECT_LT(flight->frames, 13);
  EXPECT_GT(flight->frames, 8);
  EXPECT_LT((flight->acceleration - flown.gravity).norm(), 0.3);
}

TEST(FreeFlight, EndsWhereItLeavesTheParabola) {
  // A floor that nobody has stated throws it up with 2 m/s after 0.15 s, nine frames.
  const Flown flown(16, [](double t) { return Vector3(0.0, 2.0 * std::max(0.0, t - 0.151), 0.0); });
  const std::optional<Flight> flight = free_flight(flown.capture, flown.frames);
  ASSERT_TRUE(flight);
  EXPECT_EQ(flight->frames, 10);
  EXPECT_LT((flight->acceleration - flown.gravity).norm(), 0.3);
}

TEST(FreeFlight, TakesSixFramesOfWhatNothingHolds) {
  Flown flown(5);
  EXPECT_FALSE(free_flight(flown.capture, flown.frames));
  flown = Flown(6);
  EXPECT_TRUE(free_flight(flown.capture, flown.frames));
  flown.frames[5].points.resize(20);
  EXPECT_FALSE(free_flight(flown.capture, flown.frames)) << "too few points in one of them";
  flown = Flown(6);
  flown.capture.scene.initial.released = true;
  EXPECT_FALSE(free_flight(flown.capture, flown.frames));
  flown.capture.scene.initial.released = false;
  flown.capture.scene.fixed.emplace_back();
  EXPECT_FALSE(free_flight(flown.capture, flown.frames));
}

}  // namespace
}  // namespace pliant::scan_pose_test
