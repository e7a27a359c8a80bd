// Scenes simulated, recorded and read again: each kind of recording holds what the scene says, and its equilibria are
// equilibria.

#include "synthesis/scene_motion.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "capture/markers.hpp"
#include "capture/observe.hpp"
#include "capture/point_cloud.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/surface_distance.hpp"
#include "input_errors.hpp"
#include "rays/ray_scene.hpp"
#include "temporary_folder.hpp"

namespace pliant::scene_motion_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

// A bar along x, held at its low end; 0.16 m of it are free.
constexpr double length = 0.16, edge = 0.04, modulus = 2e5;
const std::string head = R"toml(format = "scene/1"
name = "bar"
truth_trajectory = true
)toml";
const std::string object = R"toml([object]
box = { size = [0.2, 0.04, 0.04], facet = 0.02 }
density = 200.0
)toml";
const std::string material = R"toml([material]
youngs_modulus = 2e5
poissons_ratio = 0.3
mass_damping = 0.2
stiffness_damping = 0.002
)toml";
const std::string world = "[world]\ngravity = [0.0, -9.81, 0.0]\n";
const std::string weightless = "[world]\ngravity = [0.0, 0.0, 0.0]\n";
const std::string timing = "[timing]\nframe_rate = 60.0\nframe_count = 5\nstart_frame = 2\n";
const std::string simulation = "[simulation]\ncell_size = 0.02\nsubsteps = 8\n";
const std::string held = "[[fixed]]\nbox = { min = [-1, -1, -1], max = [-0.0599, 1, 1] }\n";
const std::string camera = R"toml([[camera]]
name = "front"
width = 64
height = 40
eye = [0.0, 0.0, 0.5]
target = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
)toml";
const std::string markers = "[markers]\ncount = 40\nbox = { min = [-0.05, -1, -1], max = [1, 1, 1] }\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

struct Made {
  SyntheticScene scene;
  SceneMotion motion;
  Capture capture;
  nlohmann::json truth;
};

class Recorded : public testing::Test {
 protected:
  Made made(const std::string& text) {
    std::filesystem::remove_all(folder / "out");
    Made m{read(text), {}, {}, {}};
    m.motion = simulate_scene(m.scene);
    const auto again = [&](const SyntheticScene&) { return m.motion; };
    write_synthetic_capture(folder / "out", synthesise(m.scene, again));
    m.capture = read_capture(folder / "out");
    m.truth = nlohmann::json::parse(read_file(folder / "out/truth.json"));
    return m;
  }
  SyntheticScene read(const std::string& text) { return read_synthetic_scene(folder.write("scene.toml", text)); }
  std::string complaint(const std::string& text) {
    return complaint_of([&] { read(text); });
  }
  TemporaryFolder folder;
};

Vector3 mean_tip(const SyntheticScene& scene, const TrueShape& shape) {
  const std::vector<Vector3>& rest = scene.scene.object.surface->vertices;
  Vector3 sum = Vector3::Zero();
  double count = 0.0;
  for (std::size_t v = 0; v < rest.size(); ++v)
    if (rest[v].x() > 0.0999) sum += Vector3(shape.vertices.row(Eigen::Index(v)).transpose()) - rest[v], ++count;
  return sum / count;
}

// Of a force across the free end of the clamped bar (Timoshenko).
double beam_deflection(double force) {
  const double inertia = std::pow(edge, 4) / 12.0, shear = modulus / 2.6 * edge * edge * 5.0 / 6.0;
  return force * (std::pow(length, 3) / (3.0 * modulus * inertia) + length / shear);
}
constexpr double beam_tolerance = 0.08;  // two cells across, and deflections that are not small

double greatest(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

TEST_F(Recorded, ASaggingScanIsAnEquilibrium) {
  // Hexahedra of the linear law, and tetrahedra of another one.
  const std::string sagging = object + "shape_is = \"static\"\n";
  const std::string weight = "[[weight]]\nmass = 0.01\nat = [0.1, -0.02, 0.0]\n";
  for (const std::string& law : {std::string(), std::string("law = \"ogden\"\nexponents = [4.0]\n")}) {
    const Made m = made(head + sagging + material + law + world + timing + simulation + held + weight + camera);
    ASSERT_TRUE(m.motion.scan);
    EXPECT_EQ(m.capture.scene.object.shape_is, ShapeIs::Static);
    const TriangleMesh load_free = read_mesh(folder / "out/truth/load_free.ply");
    const Points& scan = m.motion.scan->vertices;
    EXPECT_LT(greatest(vertex_points(load_free), vertex_points(*m.scene.scene.object.surface)), 1e-6);
    EXPECT_LT(greatest(vertex_points(*m.capture.scene.object.surface), scan), 1e-6) << "rest.ply is the scan";
    EXPECT_LT(mean_tip(m.scene, *m.motion.scan).y(), -1e-3);
    for (const TrueShape& frame : m.motion.frames)  // nothing is left over that would move it
      EXPECT_LT(greatest(frame.vertices, scan), 1e-8) << law;
    const Vector3 hung = m.capture.scene.weights.at(0).at;
    EXPECT_LT(distances_to_surface(*m.capture.scene.object.surface, std::span(&hung, 1)).front(), 1e-6);
    EXPECT_LT(hung.y(), -0.021) << "where the weight hangs has sunk too";
    EXPECT_NEAR(*m.capture.scene.object.mass, 200.0 * 0.2 * edge * edge, 1e-9);
  }
}

TEST_F(Recorded, APulledBarBendsAsABeamAndIsLetGo) {
  const double force = 0.1;
  const std::string pulled =
      "[initial]\nreleased = true\npulled = { at = [0.1, 0, 0], radius = 0.03, force = [0, 0.1, 0] }\n";
  const Made m = made(head + object + material + weightless + timing + simulation + held + pulled + camera);
  EXPECT_TRUE(m.capture.scene.initial.released);
  EXPECT_FALSE(m.capture.scene.initial.release_of);
  EXPECT_NEAR(mean_tip(m.scene, m.motion.frames[2]).y(), beam_deflection(force),
              beam_tolerance * beam_deflection(force));
  EXPECT_EQ(greatest(m.motion.frames[0].vertices, m.motion.frames[2].vertices), 0.0) << "held before";
  EXPECT_LT(mean_tip(m.scene, m.motion.frames[4]).y(), 0.9 * beam_deflection(force)) << "swings back";
}

TEST_F(Recorded, AGrippedBarStartsWhereTheGripHasIt) {
  const std::string gripped =
      "[initial]\nreleased = true\npulled = { at = [0.1, 0, 0], radius = 0.03, shift = [-0.01, 0.05, 0.0], turn_deg = "
      "[0, 0, 30] }\n";
  for (const char* element : {"hexahedra", "tetrahedra"}) {
    const Made m = made(head + object + material + world + timing + simulation + "element = \"" + element + "\"\n" +
                        held + gripped + camera);
    const Vector3 tip = mean_tip(m.scene, m.motion.frames[2]);
    EXPECT_NEAR(tip.x(), -0.01, 2e-3) << element;
    EXPECT_NEAR(tip.y(), 0.05, 2e-3) << element;
    EXPECT_LT(mean_tip(m.scene, m.motion.frames[4]).y(), 0.049) << element;
  }
}

TEST_F(Recorded, LoadsBendTheBarAsABeam) {
  const std::string loads =
      "[[load]]\nmass = 0.01\nat = [0.1, -0.02, 0]\n[[load]]\nmass = 0.02\nat = [0.1, -0.02, 0]\nrole = \"test\"\n";
  const std::string seen = replaced(camera, "eye = [0.0, 0.0, 0.5]", "eye = [0.1, 0.1, 0.5]");
  const Made m = made(head + object + material + world + simulation + held + loads + "[cloud]\n" + seen + markers);
  EXPECT_TRUE(m.capture.scene.timing.times.empty());
  ASSERT_EQ(m.capture.loads.size(), 2u);
  EXPECT_EQ(m.capture.loads[1].role, "test");
  const double further = beam_deflection(0.01 * 9.81);
  EXPECT_NEAR(mean_tip(m.scene, m.motion.loads[0]).y() - mean_tip(m.scene, m.motion.loads[1]).y(), further,
              beam_tolerance * further);
  for (std::size_t i = 0; i < 2; ++i) {
    const ObservedLoad load = observe_load(m.capture, m.capture.loads[i]);
    EXPECT_GT(load.seen.points.size(), 50u);
    TriangleMesh truth = *m.scene.scene.object.surface;
    for (std::size_t v = 0; v < truth.vertices.size(); ++v)
      truth.vertices[v] = m.motion.loads[i].vertices.row(Eigen::Index(v)).transpose();
    for (const double off : distances_to_surface(truth, load.seen.points)) EXPECT_LT(off, 6e-4);  // half a millimetre
    const MarkerSet set = read_marker_pair(*m.capture.loads[i].markers_rest, *m.capture.loads[i].markers);
    EXPECT_LT(greatest(set.frames[0], m.motion.loads[i].markers), 1e-7);
  }
}

TEST_F(Recorded, CloudsAreTheObjectWithTheCamerasNoise) {
  // The face at z = 0.02 is square to the optical axis, so the noise along it is that of the points.
  std::string near = replaced(camera, "width = 64\nheight = 40", "width = 200\nheight = 60\nvertical_fov_deg = 8");
  const std::string noisy = near + "sensor = { preset = \"ideal\", noise_base = 0.003 }\ndepth_scale = 10000.0\n";
  const std::string table = "[[plane]]\npoint = [0, -0.03, 0]\nnormal = [0, 1, 0]\n";
  const std::string still = replaced(timing, "start_frame = 2", "start_frame = 4");
  const std::string text = head + object + material + world + still + simulation + held + table + noisy;
  const Made m = made(text + "[cloud]\nevery = 2\n");
  EXPECT_TRUE(m.capture.depth.empty());
  ASSERT_EQ(m.capture.clouds.size(), 1u);
  EXPECT_EQ(m.capture.clouds[0].every, 2);
  EXPECT_NEAR(*m.capture.clouds[0].noise, 0.003, 1e-4);
  const std::vector<Vector3> points = read_points(folder / "out/clouds/000002.ply");
  double sum = 0.0, squares = 0.0;
  for (const Vector3& p : points) sum += p.z() - 0.02, squares += std::pow(p.z() - 0.02, 2);
  const double count = double(points.size());
  EXPECT_GT(count, 300.0);
  EXPECT_NEAR(sum / count, 0.0, 4.0 * 0.003 / std::sqrt(count));
  EXPECT_NEAR(std::sqrt(squares / count), 0.003, 4.0 * 0.003 / std::sqrt(2.0 * count));
  EXPECT_EQ(observe(m.capture).size(), 3u);
  const std::string first = read_file(folder / "out/clouds/000002.ply");

  const Made all = made(text + "[cloud]\nbackground = true\nimages = true\n");
  EXPECT_EQ(all.capture.depth.size(), 1u);
  int of_table = 0;
  for (const Vector3& p : read_points(folder / "out/clouds/000002.ply")) of_table += p.z() < -0.05;
  EXPECT_GT(of_table, 50);
  made(text + "[cloud]\nevery = 2\n");
  EXPECT_EQ(read_file(folder / "out/clouds/000002.ply"), first) << "random numbers are seeded";
}

TEST_F(Recorded, MarkersHaveTheirNoiseAndGetLost) {
  const std::string many = "[markers]\ncount = 300\nnoise = 0.001\nrelative_noise = 0.1\nlost = 0.2\n";
  const std::string thrown = "[initial]\nlinear_velocity = [0.0, 0.0, 3.0]\nangular_velocity = [0, 1, 0]\n";
  const Made m = made(head + object + material + weightless + timing + simulation + thrown + many);
  ASSERT_EQ(m.capture.markers.size(), 1u);
  const MarkerSet set = read_markers(m.capture.markers[0], m.capture.frame_count());
  ASSERT_EQ(set.marker_count(), 300);
  for (const double off : distances_to_surface(*m.scene.scene.object.surface, m.scene.markers->points))
    EXPECT_LT(off, 1e-9);
  double lost = 0.0, squares = 0.0, count = 0.0;
  for (int frame = 3; frame < 5; ++frame)
    for (int i = 0; i < 300; ++i) {
      if (!set.is_seen(frame, i)) {
        ++lost;
        continue;
      }
      const Points& truth = m.motion.frames[std::size_t(frame)].markers;
      const double way = (truth.row(i) - m.scene.markers->points[std::size_t(i)].transpose()).norm();
      squares += (set.frames[std::size_t(frame)].row(i) - truth.row(i)).squaredNorm() /
                 (std::pow(0.001, 2) + std::pow(0.1 * way, 2));
      count += 3.0;
      EXPECT_GT(way, 0.03);
    }
  EXPECT_NEAR(lost / 600.0, 0.2, 0.06);
  EXPECT_NEAR(squares / count, 1.0, 4.0 * std::sqrt(2.0 / count));
  double at_rest = 0.0;
  for (int i = 0; i < 300; ++i)
    at_rest += (set.rest.row(i) - m.scene.markers->points[std::size_t(i)].transpose()).squaredNorm();
  EXPECT_NEAR(std::sqrt(at_rest / 900.0), 0.001, 1e-4);
}

TEST_F(Recorded, PressesAreAsTheSceneLedThem) {
  const std::string block = replaced(object, "[0.2, 0.04, 0.04]", "[0.1, 0.06, 0.1]");
  const std::string stands = "[[fixed]]\nhalf_space = { point = [0, -0.0299, 0], normal = [0, -1, 0] }\n";
  const std::string presses =
      "[[press]]\nat = [0, 0.03, 0]\nradius = 0.015\npush = 4.0\n"
      "[[press]]\nat = [0, 0.03, 0]\nradius = 0.015\nforce = [1, -4, 0]\nforce_noise = 0.1\nrole = \"test\"\n"
      "[[press]]\nat = [0, 0.03, 0]\nradius = 0.015\nshift = [0.002, -0.004, 0]\n"
      "[[press]]\nat = [0, 0.03, 0]\nradius = 0.015\ndepth = 0.004\nglued = false\n"
      "[[indentation]]\nprobe = \"ball\"\nradius = 0.01\ncontact = [0, 0.03, 0]\ndepths = [0.001, 0.002, 0.004]\n"
      "force_noise = 0.01\n";
  const Made m = made(head + block + material + world + simulation + stands + "[markers]\ncount = 80\n" + presses);
  ASSERT_EQ(m.capture.presses.size(), 4u);
  EXPECT_LT((m.capture.presses[0].force - Vector3(0, -4, 0)).norm(), 1e-5);
  EXPECT_LT((m.motion.presses[1].force - Vector3(1, -4, 0)).norm(), 1e-5);
  EXPECT_NEAR((m.capture.presses[1].force - Vector3(1, -4, 0)).norm(), 0.17, 0.17);
  EXPECT_GT((m.capture.presses[1].force - Vector3(1, -4, 0)).norm(), 1e-3) << "measured with noise";
  EXPECT_NEAR(m.truth["presses"][1]["force"][0], 1.0, 1e-5);
  EXPECT_LT((m.capture.presses[2].probe->point - Vector3(0.002, 0.026, 0)).norm(), 1e-9);
  EXPECT_LT((m.capture.presses[2].probe->normal - Vector3(0, -1, 0)).norm(), 1e-9);
  EXPECT_TRUE(m.capture.presses[2].glued);
  EXPECT_FALSE(m.capture.presses[3].glued);
  EXPECT_EQ(m.capture.presses[1].role, "test");
  const MarkerSet set = read_marker_pair(m.capture.presses[0].markers_rest, m.capture.presses[0].markers);
  for (int i = 0; i < set.marker_count(); ++i) {
    const bool is_covered = (Vector3(set.rest.row(i).transpose()) - Vector3(0, 0.03, 0)).norm() < 0.015;
    EXPECT_EQ(set.is_seen(0, i), !is_covered) << i;
    if (is_covered) continue;
    EXPECT_LT((set.frames[0].row(i) - m.motion.presses[0].shape.markers.row(i)).norm(), 1e-7);
  }
  const ForceCurve curve = read_force_curve(m.capture.indentations.at(0).curve);
  EXPECT_EQ(curve.depths, (std::vector<double>{0.001, 0.002, 0.004}));
  const std::vector<double>& forces = m.motion.indentations[0].forces;
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(curve.forces[k], forces[k], 0.05);
  EXPECT_NEAR(forces[2] / forces[1], std::pow(2.0, 1.5), 0.6) << "Hertz";
}

TEST_F(Recorded, RegionsMayHaveLawsOfTheirOwn) {
  const std::string law = "law = \"ogden\"\nexponents = [4.0, -2.0]\nstiffness_ratios = [0.5]\n";
  const std::string region =
      "[[region]]\nname = \"root\"\nhalf_space = { point = [0, 0, 0], normal = [-1, 0, 0] }\nyoungs_modulus = 2e4\n";
  const std::string rest = world + timing + simulation + held + camera;
  const SyntheticScene one = read(head + object + material + law + region + rest);
  ASSERT_TRUE(one.law);
  EXPECT_EQ(*one.law, (LawForm{2, 2, 1, false, ElasticLaw::Corotated}));
  EXPECT_EQ(one.element, ElementKind::QuadraticTetrahedron);
  const Made two = made(head + object + material + law + region + "exponents = [8.0, -3.0]\n" + rest);
  EXPECT_EQ(two.scene.law->laws, 2);
  EXPECT_EQ(two.scene.law_numbers[1].exponents, (std::vector<double>{8.0, -3.0}));
  EXPECT_EQ(two.scene.law_numbers[1].stiffness_ratios, std::vector<double>{0.5}) << "as the object's own";
  std::vector<double> exponents;
  for (const auto& [name, value] : two.truth["parameters"].items())
    if (name.starts_with("exponent_1")) exponents.push_back(value["value"]);
  EXPECT_THAT(exponents, testing::UnorderedElementsAre(4.0, 8.0));
  EXPECT_LT(mean_tip(two.scene, two.motion.frames.back()).y(), -1e-4);
}

TEST_F(Recorded, WhatIsStaticStaysAndWhatIsThrownIsKeptSecret) {
  const std::string at_rest = replaced(timing, "start_frame = 2", "static = true");
  const Made still = made(head + object + material + world + at_rest + simulation + held + camera);
  EXPECT_TRUE(still.capture.scene.timing.is_static);
  EXPECT_EQ(greatest(still.motion.frames[0].vertices, still.motion.frames[4].vertices), 0.0);
  EXPECT_LT(mean_tip(still.scene, still.motion.frames[0]).y(), -1e-3);

  const std::string thrown = "[initial]\nlinear_velocity = [0.5, 1.0, 0.0]\nangular_velocity = [0, 0, 2]\n";
  for (const bool known : {true, false}) {
    const Made m = made(head + object + material + world + timing + simulation + thrown +
                        (known ? "known = true\n" : "known = false\n") + camera);
    EXPECT_EQ(m.capture.scene.initial.known, known);
    EXPECT_EQ(m.capture.scene.initial.linear_velocity, known ? Vector3(0.5, 1, 0) : Vector3(0, 0, 0));
    EXPECT_EQ(m.truth["parameters"]["linear_velocity"]["value"], nlohmann::json({0.5, 1.0, 0.0}));
    const Points moved = m.motion.frames[4].vertices - m.motion.frames[2].vertices;
    const double t = 2.0 / 60.0;  // the middle falls as a point would
    EXPECT_LT((moved.colwise().mean().transpose() - Vector3(0.5 * t, t - 0.5 * 9.81 * t * t, 0)).norm(), 5e-4);
  }
}

TEST_F(Recorded, RefusesWhatDoesNotGoTogether) {
  const std::string base = head + object + material + world + timing + simulation;
  EXPECT_EQ(complaint(base + held + camera), "");
  EXPECT_THAT(complaint(replaced(base, "density", "shape_is = \"static\"\ndensity") + camera),
              HasSubstr("nothing holds"));
  EXPECT_THAT(complaint(replaced(base, "density", "shape_is = \"sagging\"\ndensity") + held + camera),
              HasSubstr("static"));
  EXPECT_THAT(complaint(base + held + "[cloud]\n" + markers), HasSubstr("without a camera"));
  EXPECT_THAT(complaint(base + held + "[cloud]\nevry = 1\n" + camera), HasSubstr("did you mean `every`"));
  EXPECT_THAT(complaint(base + held + "[markers]\ncount = 10\nlost = 1.5\n"), HasSubstr("`lost` is 1.5"));
  EXPECT_THAT(complaint(base + held + "[markers]\n"), HasSubstr("neither or both of `points` and `count`"));
  EXPECT_THAT(complaint(base + held + "[markers]\npoints = [[0, 1, 0], [0, 0, 0], [0, 0.02, 0]]\n"),
              HasSubstr("off the object's surface"));
  const std::string press = "[[press]]\nat = [0, 0.02, 0]\nradius = 0.01\n";
  EXPECT_THAT(complaint(base + held + camera + press + "push = 1.0\n"), HasSubstr("presses without markers"));
  EXPECT_THAT(complaint(base + held + markers + press), HasSubstr("no ways to press"));
  EXPECT_THAT(complaint(base + held + markers + press + "push = 1.0\ndepth = 0.1\n"), HasSubstr("2 ways to press"));
  EXPECT_THAT(complaint(base + markers + press + "push = 1.0\n"), HasSubstr("nothing holds"));
  EXPECT_THAT(complaint(replaced(base, "cell_size", "element = \"hexahedra\"\ncell_size") + held + markers + press +
                        "push = 1.0\n"),
              HasSubstr("quadratic_tetrahedra"));
  EXPECT_THAT(complaint(replaced(base, "poissons_ratio", "exponents = [2.0]\npoissons_ratio") + held + camera),
              HasSubstr("law = \"ogden\""));
  EXPECT_THAT(complaint(replaced(base, "poissons_ratio", "law = \"ogden\"\npoissons_ratio") + held + camera),
              HasSubstr("exponents"));
  EXPECT_THAT(
      complaint(base + held + camera + "[initial]\nreleased = true\npulled = { at = [0.1, 0, 0], radius = 0 }\n"),
      HasSubstr("neither or both of a force and a way"));
  EXPECT_THAT(complaint(replaced(base, timing, "") + held + camera), HasSubstr("[timing]"));
  EXPECT_THAT(complaint(replaced(base, "frame_rate", "static = true\nframe_rate") + camera),
              HasSubstr("nothing holds"));
}

/// Half a frame late, by no fault of the capture: what the camera sees has fallen half a frame further. The capture
/// says what the scene has it say of the camera.
TEST_F(Recorded, ACameraMayBeLateAndBadlyCalibrated) {
  const std::string late = camera + R"toml(distortion = [-0.1, 0.02, 0.0, 0.0]
time_offset = 0.0083333333
stated = { turn_deg = [0, 2, 0], shift = [0.01, 0, 0], distortion = [], time_offset = 0.0 }
)toml";
  const Made m = made(head + object + material + world + timing + simulation + late);
  ASSERT_EQ(m.motion.camera_frames.size(), 1u);
  ASSERT_EQ(m.motion.camera_frames[0].size(), 5u);
  for (int f = 0; f < 5; ++f) {
    const double t = std::max(0.0, (f - 2) / 60.0 + 0.0083333333);
    const Points& seen = m.motion.camera_frames[0][std::size_t(f)].vertices;
    const double fallen = (vertex_points(*m.scene.scene.object.surface) - seen).col(1).mean();
    EXPECT_NEAR(fallen, 0.5 * 9.81 * t * t, 0.03 * 0.5 * 9.81 * t * t + 1e-6) << f;
  }
  const DepthCamera& stated = m.capture.depth[0];
  EXPECT_EQ(stated.time_offset, 0.0);
  EXPECT_FALSE(stated.camera.lens.bends());
  const RigidMotion& truth = m.scene.cameras[0].camera.camera_to_world;
  EXPECT_NEAR(Eigen::AngleAxisd(Matrix3(stated.camera.camera_to_world.rotation.transpose() * truth.rotation)).angle(),
              2.0 * M_PI / 180.0, 1e-9);
  const nlohmann::json& own = m.truth["cameras"]["front"];
  EXPECT_EQ(own["time_offset"], 0.0083333333);
  EXPECT_EQ(own["distortion"], nlohmann::json({-0.1, 0.02, 0.0, 0.0}));
  EXPECT_NEAR(own["camera_to_world"][2][3], truth.translation.z(), 1e-12);
}

/// Through the lens that it was seen with every reading lies on the true surface; taken for a pinhole's they do not.
TEST_F(Recorded, AReadingComesBackThroughTheLens) {
  const std::string bent = replaced(camera, "up =", "distortion = [0.4, 0.05, 0.001, 0.002]\nup =");
  const Made m = made(head + object + material + weightless + replaced(timing, "start_frame = 2", "static = true") +
                      simulation + held + replaced(bent, "[0.0, 0.0, 0.5]", "[0.15, 0.1, 0.2]"));
  const auto greatest = [&](const Capture& capture) {
    double most = 0.0;
    for (const double d : distances_to_surface(*m.scene.scene.object.surface, observe(capture).front().points))
      most = std::max(most, d);
    return most;
  };
  EXPECT_LT(greatest(m.capture), 1e-3);  // readings are whole millimetres
  Capture straight = m.capture;
  straight.depth[0].camera.lens = {};
  EXPECT_GT(greatest(straight), 1.5e-3);
}

}  // namespace
}  // namespace pliant::scene_motion_test
