#include "synthesis/synthetic_scene.hpp"

#include <nlohmann/json.hpp>

#include "capture/observe.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::synthetic_scene_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

const char* const ring_scene = R"toml(format = "scene/1"
name = "ring"
seed = 7
[object]
torus = { ring_radius = 0.12, tube_radius = 0.05, ring_segments = 48, tube_segments = 24 }
translation = [0.0, 0.4, 0.0]
axis = [1.0, 0.0, 0.0]
angle_deg = 30.0
mass = 0.3
[material]
youngs_modulus = 2000.0
poissons_ratio = 0.3
mass_damping = 0.2
stiffness_damping = 0.004
[world]
gravity = [0.0, -9.81, 0.0]
[timing]
frame_rate = 60.0
frame_count = 5
start_frame = 1
[simulation]
cell_size = 0.02
substeps = 8
[initial]
linear_velocity = [0.0, -1.0, 0.0]
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
half_size = 2.0
[[camera]]
name = "front"
width = 160
height = 120
eye = [0.0, 0.9, 1.0]
target = [0.0, 0.3, 0.0]
vertical_fov_deg = 50.0
sensor = { preset = "structured-light", hole_rate = 0.01 }
)toml";

SyntheticScene read_ring() {
  const TemporaryFolder folder;
  return read_synthetic_scene(folder.write("scene.toml", ring_scene));
}

// Stands in for the simulation: the object falls rigidly.
SceneMotion fall(const SyntheticScene& scene) {
  SceneMotion motion;
  const Timing& timing = scene.scene.timing;
  const Points rest = vertex_points(*scene.scene.object.surface);
  for (int i = 0; i < timing.frame_count(); ++i) {
    const double t = std::max(0, i - timing.start_frame) / timing.frame_rate;
    const Vector3 shift = t * scene.scene.initial.linear_velocity + 0.5 * t * t * *scene.scene.world.gravity;
    motion.frames.push_back({rest.rowwise() + shift.transpose(), {}});
  }
  return motion;
}

TEST(SyntheticScene, IsReadWithItsUnitsAndDefaults) {
  const SyntheticScene s = read_ring();
  EXPECT_EQ(s.name, "ring");
  EXPECT_EQ(s.seed, 7u);
  EXPECT_EQ(s.youngs_modulus, 2000.0);
  EXPECT_EQ(s.scene.timing.frame_count(), 5);
  EXPECT_EQ(s.scene.timing.start_frame, 1);
  EXPECT_EQ(s.substeps, 8);
  EXPECT_EQ(s.newmark_theta, 0.5);
  EXPECT_EQ(s.plane_half_sizes[0], 2.0);
  EXPECT_EQ(s.cameras[0].sensor.hole_rate, 0.01);
  EXPECT_EQ(s.cameras[0].sensor.noise_base, 0.0012);
  EXPECT_EQ(s.cameras[0].depth_scale, 1000.0);
  EXPECT_NEAR(s.true_density() * enclosed_volume(*s.scene.object.surface), 0.3, 1e-12);
  EXPECT_LT((enclosed_centroid(*s.scene.object.surface) - Vector3(0, 0.4, 0)).norm(), 1e-9);
  EXPECT_NEAR(bounding_box(*s.scene.object.surface).extent().z(), 2 * (0.12 * std::cos(M_PI / 6) + 0.05), 1e-3);
}

TEST(SyntheticScene, EveryPrimitiveAndFilesMakeASolid) {
  const TemporaryFolder folder;
  write_mesh(folder / "ball.ply", make_sphere(0.1, 2));
  for (const char* shape :
       {"box = { size = [0.2, 0.1, 0.1] }", "sphere = { radius = 0.1 }", "surface = \"ball.ply\""}) {
    std::string text = ring_scene;
    const size_t at = text.find("torus"), end = text.find('\n', at);
    text.replace(at, end - at, shape);
    EXPECT_TRUE(
        examine(read_synthetic_scene(folder.write("scene.toml", text)).scene.object.surface.value()).is_closed_solid)
        << shape;
  }
}

class SceneFile : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::string after(const std::string& from, const std::string& to) {
    std::string text = ring_scene;
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    const auto path = folder.write("scene.toml", text.replace(at, from.size(), to));
    return complaint_of([&] { read_synthetic_scene(path); });
  }
};

TEST_F(SceneFile, ProblemsHaveAPlaceAndAdvice) {
  EXPECT_THAT(after("mass_damping", "mas_damping"), HasSubstr("scene.toml:13:1"));
  EXPECT_THAT(after("mass_damping", "mas_damping"), HasSubstr("did you mean `mass_damping`"));
  EXPECT_THAT(after("youngs_modulus = 2000.0", "youngs_modulus = -3.0"),
              HasSubstr("scene.toml:11:1: `youngs_modulus` is -3"));
}

TEST_F(SceneFile, RefusesWhatMakesNoSense) {
  EXPECT_THAT(after("mass = 0.3", "mass = 0.3\ndensity = 90.0"), HasSubstr("both `mass` and `density`"));
  EXPECT_THAT(after("mass = 0.3", ""), HasSubstr("neither `mass` nor `density`"));
  EXPECT_THAT(after("tube_radius = 0.05", "tube_radius = 0.5"), HasSubstr("tube radius < ring radius"));
  EXPECT_THAT(after("axis = [1.0, 0.0, 0.0]\n", ""), HasSubstr("axis"));
  EXPECT_THAT(after("torus = {", "sphere = { radius = 1.0 }\ntorus = {"), HasSubstr("2 shapes"));
  EXPECT_THAT(after("poissons_ratio = 0.3", "poissons_ratio = 0.5"), HasSubstr("below 0.5"));
  EXPECT_THAT(after("start_frame = 1", "start_frame = 5"), HasSubstr("0 to 4"));
  EXPECT_THAT(after("structured-light", "magic"), HasSubstr("ideal, structured-light"));
  EXPECT_THAT(after("hole_rate = 0.01", "hole_rate = 1.01"), HasSubstr("at most 1"));
  EXPECT_THAT(after("eye = [0.0, 0.9, 1.0]", "eye = [0.0, 0.3, 0.0]"), HasSubstr("look_at"));
  EXPECT_THAT(after("eye = [0.0, 0.9, 1.0]\n", ""), HasSubstr("no single pose"));
  EXPECT_THAT(after("\"front\"", "\"../front\""), HasSubstr("can be a folder"));
  EXPECT_THAT(after("[world]\ngravity = [0.0, -9.81, 0.0]", ""), HasSubstr("no table [world]"));
  EXPECT_THAT(after("linear_velocity", "released = true\nlinear_velocity"),
              HasSubstr("`released` without `release_of` or `pulled`"));
  EXPECT_THAT(after("linear_velocity", "release_of = { mass = 0.1, at = [0.0, 0.3, 0.0] }\nlinear_velocity"),
              HasSubstr("release_of"));
  EXPECT_THAT(after("normal = [0.0, 1.0, 0.0]", "normal = [0.0, 0.0, 0.0]"), HasSubstr("without length"));
  EXPECT_THAT(after("name = \"front\"", "name = \"front\"\nsilhouette = true"),
              HasSubstr("a silhouette camera with `sensor`"));
  EXPECT_THAT(after("sensor = { preset = \"structured-light\", hole_rate = 0.01 }", "silhouette = true\n[cloud]"),
              HasSubstr("a cloud without a camera that measures depth"));
  EXPECT_EQ(after("seed", "seed"), "");
}

TEST(Synthesis, MakesACaptureThatTheReaderAccepts) {
  const TemporaryFolder folder;
  write_synthetic_capture(folder.path(), synthesise(read_ring(), fall));
  const Capture capture = read_capture(folder.path());
  EXPECT_EQ(capture.name, "ring");
  EXPECT_EQ(capture.frame_count(), 5);
  EXPECT_EQ(capture.scene.timing.start_frame, 1);
  EXPECT_EQ(capture.scene.object.mass, 0.3);
  EXPECT_EQ(capture.scene.initial.linear_velocity, Vector3(0, -1, 0));
  ASSERT_EQ(capture.depth.size(), 1u);
  const SyntheticScene scene = read_ring();
  EXPECT_LT(
      (capture.depth[0].camera.camera_to_world.rotation - scene.cameras[0].camera.camera_to_world.rotation).norm(),
      1e-9);
  const double distance = (Vector3(0, 0.9, 1.0) - Vector3(0, 0.4, 0)).norm();
  EXPECT_NEAR(*capture.depth[0].noise, scene.cameras[0].sensor.noise(distance), 0.1 * *capture.depth[0].noise);
}

TEST(Synthesis, ASilhouetteCameraLeavesItsMasksAlone) {
  const TemporaryFolder folder;
  SyntheticScene scene = read_ring();
  SyntheticCamera film = scene.cameras[0];
  film.name = "film", film.is_silhouette = true;
  scene.cameras.push_back(film);
  scene.cloud = SyntheticCloud{};  // of the first camera, whose images are not recorded
  write_synthetic_capture(folder.path(), synthesise(scene, fall));
  const Capture capture = read_capture(folder.path());
  EXPECT_TRUE(capture.depth.empty());
  ASSERT_EQ(capture.silhouettes.size(), 1u);
  EXPECT_EQ(capture.silhouettes[0].name, "film");
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "film/mask_000004.png"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "film/000004.png"));
  for (const ObservedFrame& frame : observe(capture)) {
    EXPECT_FALSE(frame.points.empty());
    ASSERT_EQ(frame.outlines.size(), 1u);
    EXPECT_GT(frame.outlines[0].outline.points.size(), 50u);
  }
}

TEST(Synthesis, ObservedPointsLieOnTheTrueSurface) {
  const TemporaryFolder folder;
  SyntheticScene scene = read_ring();
  scene.cameras[0].sensor = sensor_preset("ideal");
  scene.cameras[0].depth_scale = 10000.0;
  const Synthesis synthesis = synthesise(scene, fall);
  write_synthetic_capture(folder.path(), synthesis);
  const auto frames = observe(read_capture(folder.path()));
  ASSERT_EQ(frames.size(), 5u);
  for (const ObservedFrame& frame : frames) {
    EXPECT_GT(frame.points.size(), 200u);
    RayScene truth;
    truth.add(synthesis.frames[std::size_t(frame.frame)].vertices, scene.scene.object.surface->triangles);
    const Vector3 eye = scene.cameras[0].camera.camera_to_world.translation;
    for (const Vector3& point : frame.points) {
      const auto hit = truth.cast(eye, (point - eye).normalized());
      ASSERT_TRUE(hit);
      EXPECT_NEAR(hit->distance, (point - eye).norm(), 1.2e-4);  // half a unit of depth, along an oblique ray
    }
  }
}

TEST(Synthesis, TruthIsWrittenApart) {
  const TemporaryFolder folder;
  SyntheticScene scene = read_ring();
  scene.write_trajectory = true;
  write_synthetic_capture(folder.path(), synthesise(scene, fall));
  const auto truth = nlohmann::json::parse(read_file(folder / "truth.json"));
  EXPECT_EQ(truth["format"], "synth-truth/1");
  EXPECT_EQ(truth["parameters"]["youngs_modulus"]["value"], 2000.0);
  EXPECT_EQ(truth["parameters"]["youngs_modulus"]["unit"], "Pa");
  EXPECT_EQ(truth["parameters"]["gravity"]["value"], nlohmann::json({0.0, -9.81, 0.0}));
  EXPECT_THAT(read_file(folder / "capture.toml"), testing::Not(HasSubstr("2000")));
  const TriangleMesh last = read_mesh(folder / "truth/000004.ply");
  EXPECT_LT((last.vertices[0] - Vector3(fall(scene).frames[4].vertices.row(0))).norm(), 1e-6);
}

TEST(Synthesis, IsRepeatableAndChangesWithTheSeed) {
  const TemporaryFolder folder;
  SyntheticScene scene = read_ring();
  const auto image = [&](const char* name, std::uint64_t seed) {
    scene.seed = seed;
    write_synthetic_capture(folder / name, synthesise(scene, fall));
    return read_file(folder / name / "front/000002.png");
  };
  const std::string first = image("a", 1);
  EXPECT_EQ(first, image("b", 1));
  EXPECT_NE(first, image("c", 2));
}

TEST(Synthesis, ScanNoiseMovesRestVerticesAlongTheirNormals) {
  const TemporaryFolder folder;
  SyntheticScene scene = read_ring();
  scene.scan_noise = 0.0005;
  write_synthetic_capture(folder.path(), synthesise(scene, fall));
  const TriangleMesh scan = read_mesh(folder / "rest.ply");
  double squares = 0.0;
  for (size_t i = 0; i < scan.vertices.size(); ++i)
    squares += (scan.vertices[i] - scene.scene.object.surface->vertices[i]).squaredNorm();
  EXPECT_NEAR(std::sqrt(squares / double(scan.vertices.size())), 0.0005, 0.00005);
}

TEST(Synthesis, RefusesATrajectoryThatDoesNotFit) {
  const SyntheticScene scene = read_ring();
  EXPECT_THROW(synthesise(scene, [](const SyntheticScene&) { return SceneMotion(); }), std::invalid_argument);
  Synthesis s = synthesise(scene, fall);
  s.frames[2].vertices(3, 1) = std::nan("");
  EXPECT_THROW(write_synthetic_capture("never", s), std::invalid_argument);
  s = synthesise(scene, fall);
  s.scene.object.density = 90.0;
  EXPECT_THROW(write_synthetic_capture("never", s), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::synthetic_scene_test
