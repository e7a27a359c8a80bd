#include "simulation/scene_simulation.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "motion/linear_statics.hpp"
#include "simulation/flat_sheet.hpp"

namespace pliant::scene_simulation_test {
namespace {

Scene bar() {
  Scene scene;
  scene.object.surface = make_box(Vector3(0.2, 0.05, 0.05), 0.025);
  scene.timing = evenly_timed(50.0, 3);
  return scene;
}

Body body_of(const Scene& scene) {
  Resolution resolution;
  resolution.cells = 4.0;
  std::vector<Vector3> controls;
  return *make_body_of(scene, *scene_distance(scene, 0.15), resolution, controls);
}

const MotionLayout blocks;

VectorX parameters() {
  VectorX theta = blocks.zero();
  theta[blocks.density] = 1000.0;
  theta.segment<3>(blocks.gravity) = Vector3(0, 0, -9.81);
  return theta;
}

TEST(SceneSimulation, ASurfaceOffItsScanLiesBesideItButWhereItIsHeld) {
  Scene scene;
  scene.object.surface = make_sphere(0.1, 3);
  scene.fixed = {{RegionHalfSpace{Vector3(-0.05, 0.0, 0.0), -Vector3::UnitX()}, {}}};
  Resolution resolution;
  EXPECT_EQ(surface_of(scene, resolution).vertices, scene.object.surface->vertices);
  resolution.offset = [](const Vector3& p) { return 0.002 + 0.01 * p.y(); };
  const TriangleMesh surface = surface_of(scene, resolution);
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const Vector3& p = scene.object.surface->vertices[v];
    const double out = p.x() < -0.05 + 1e-9 ? 0.0 : 0.002 + 0.01 * p.y();
    EXPECT_NEAR(surface.vertices[v].norm(), p.norm() + out, 2e-5);
  }
}

TEST(SceneSimulation, RegionsHaveAModulusEach) {
  Scene scene = bar();
  EXPECT_EQ(body_of(scene).modulus.controls, 1);
  scene.regions = {{"far", RegionHalfSpace{Vector3::Zero(), Vector3::UnitX()}}};
  EXPECT_EQ(body_of(scene).modulus.controls, 2);
  EXPECT_TRUE(region_tests(scene)[0](Vector3(0.01, 0, 0)));
  EXPECT_FALSE(region_tests(scene)[0](Vector3(-0.01, 0, 0)));
}

/// Sag of a bar held at one end as far as `held` [m], in that of an Euler-Bernoulli beam of what is free.
double sag_of_beam(ElementKind element, double cells, double held) {
  Scene scene;
  const double length = 0.4, thickness = 0.04, density = 1000.0, modulus = 1e6;
  scene.object.surface = make_box(Vector3(length, thickness, thickness), 0.02);
  scene.timing = evenly_timed(50.0, 3);
  scene.fixed = {{RegionBox{Vector3(-1, -1, -1), Vector3(-0.5 * length + held, 1, 1)}, std::nullopt}};
  Resolution resolution;
  resolution.element = element, resolution.cells = cells;
  std::vector<Vector3> controls;
  const auto body = make_body_of(scene, *scene_distance(scene, 0.15), resolution, controls);
  VectorX theta = blocks.zero();
  blocks.set_moduli(theta, modulus);
  theta[blocks.poissons_ratio] = 0.0;
  const LinearStatics statics(body, held_nodes(*body, held_regions(scene)), blocks, theta);
  Points ones = Points::Zero(body->node_count(), 3), force = ones;
  ones.col(2).setOnes();
  body->add_mass_product(9.81 * density, ones, force);
  const double load = density * 9.81 * thickness * thickness, inertia = std::pow(thickness, 4) / 12.0;
  // Hexahedra have nodes beyond the tip, which swing out further by the slope there.
  const double beyond = body->nodes.col(0).maxCoeff() - 0.5 * length, slope = 4.0 / 3.0 / (length - held);
  return statics.greatest_displacement(force) /
         (load * std::pow(length - held, 4) / (8.0 * modulus * inertia) * (1.0 + slope * beyond));
}

class HeldEnds : public testing::TestWithParam<double> {};

TEST_P(HeldEnds, HangABeamFromWhereTheyEndWhateverTheElements) {
  // A cell is 33 mm long: held is less than one, one and a bit, and more.
  EXPECT_NEAR(sag_of_beam(ElementKind::Hexahedron, 12.0, GetParam()), 1.0, 0.1);
  EXPECT_NEAR(sag_of_beam(ElementKind::Hexahedron, 24.0, GetParam()), 1.0, 0.04);
  EXPECT_NEAR(sag_of_beam(ElementKind::QuadraticTetrahedron, 12.0, GetParam()), 1.0, 0.03);
  EXPECT_NEAR(sag_of_beam(ElementKind::QuadraticTetrahedron, 20.0, GetParam()), 1.0, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Lengths, HeldEnds, testing::Values(0.008, 0.02, 0.037, 0.05, 0.09));

TEST(SceneSimulation, ASurfaceBesideItsScanMakesAThickerBodyAsHeavy) {
  constexpr double length = 0.4, edge = 0.04, offset = 0.0006;
  Scene scene;
  scene.object.surface = make_box(Vector3(length, edge, edge), 0.02);
  scene.timing = evenly_timed(50.0, 3);
  const double grown = (length + 2.0 * offset) * (edge + 2.0 * offset) * (edge + 2.0 * offset) / (length * edge * edge);
  for (const ElementKind element :
       {ElementKind::Hexahedron, ElementKind::Tetrahedron, ElementKind::QuadraticTetrahedron})
    for (const bool is_weighed : {false, true}) {
      scene.object.mass.reset();
      if (is_weighed) scene.object.mass = 0.5;
      Resolution resolution;
      resolution.element = element, resolution.cells = 10.0;
      std::vector<Vector3> controls;
      const auto distance = scene_distance(scene, 0.15);
      const auto on_scan = make_body_of(scene, *distance, resolution, controls);
      resolution.offset = [](const Vector3&) { return offset; };
      const auto beside = make_body_of(scene, *distance, resolution, controls);
      EXPECT_NEAR(beside->volume() / on_scan->volume(), grown, 0.003) << int(element);
      const auto weight = [](const Body& body) { return std::accumulate(body.mass.begin(), body.mass.end(), 0.0); };
      EXPECT_NEAR(weight(*beside) / weight(*on_scan), is_weighed ? 1.0 : grown, 0.003) << int(element);
    }
  Resolution thin;
  thin.element = ElementKind::Tetrahedron;
  thin.offset = [](const Vector3&) { return -0.6 * edge; };
  std::vector<Vector3> controls;
  EXPECT_THROW((void)make_body_of(scene, *scene_distance(scene, 0.15), thin, controls), InputError);
}

TEST(SceneSimulation, AnUnevenBodyIsAsStiffOnTheGeometricMean) {
  const Scene scene = bar();
  Resolution resolution;
  resolution.cells = 8.0;
  resolution.unevenness = [](const Vector3& p) { return 0.3 + 2.0 * p.x(); };
  for (const ElementKind element : {ElementKind::Hexahedron, ElementKind::QuadraticTetrahedron}) {
    resolution.element = element;
    std::vector<Vector3> controls;
    const auto body = make_body_of(scene, *scene_distance(scene, 0.15), resolution, controls);
    const std::vector<double>& relative = body->modulus.relative;
    double mean = 0.0;
    for (std::size_t e = 0; e < relative.size(); ++e) mean += body->element_volume[e] * std::log(relative[e]);
    EXPECT_NEAR(mean, 0.0, 1e-12 * body->volume());
    const auto [softest, stiffest] = std::ranges::minmax(relative);
    EXPECT_NEAR(std::log(stiffest / softest), 2.0 * 0.2, 2.0 * 0.05) << "but for half an element at each end";
  }
}

/// A sheet in any plane, held at one end, sags as an Euler-Bernoulli beam.
TEST(SceneSimulation, FlatSheetsBendWithOneElementThroughThem) {
  const double length = 0.1, thickness = 0.0005, width = 0.02, modulus = 3e7, density = 1000.0;
  const Eigen::AngleAxisd turn(0.5, Vector3::UnitX());
  Scene scene;
  scene.object.surface = make_box(Vector3(length, thickness, width), 0.002);
  for (Vector3& vertex : scene.object.surface->vertices) vertex = turn * vertex;
  scene.timing = evenly_timed(50.0, 3);
  scene.fixed = {{RegionBox{Vector3(-1, -1, -1), Vector3(-0.5 * length + 1e-4, 1, 1)}, std::nullopt}};
  const auto sheet = flat_sheet(*scene.object.surface);
  ASSERT_TRUE(sheet);
  EXPECT_NEAR(sheet->thickness, thickness, 1e-9);
  EXPECT_NEAR(std::abs(sheet->normal.dot(turn * Vector3::UnitY())), 1.0, 1e-9);
  EXPECT_TRUE(is_thinner_than_hexahedra(scene));
  Resolution resolution;
  std::vector<Vector3> controls;
  const auto distance = scene_distance(scene, 0.15);
  for (const double cells : {8.0, 12.0, 20.0}) {
    resolution.element = ElementKind::QuadraticTetrahedron, resolution.cells = cells;
    const auto body = make_body_of(scene, *distance, resolution, controls);
    EXPECT_NEAR(body->volume(), length * thickness * width, 1e-6 * length * thickness * width);
    VectorX theta = blocks.zero();
    blocks.set_moduli(theta, modulus);
    theta[blocks.poissons_ratio] = 0.0;
    const LinearStatics statics(body, held_nodes(*body, held_regions(scene)), blocks, theta);
    Points down(body->node_count(), 3), force = Points::Zero(body->node_count(), 3);
    down.rowwise() = sheet->normal.transpose();
    body->add_mass_product(9.81 * density, down, force);
    const double beam = 9.81 * density * std::pow(length, 4) * 12.0 / (8.0 * modulus * thickness * thickness);
    // Flattened elements are a little stiff, by the square of their length.
    EXPECT_NEAR(statics.greatest_displacement(force) / beam, 1.0, 10.0 / (cells * cells)) << cells;
  }
  const TriangleMesh bowl =
      make_level_surface([](const Vector3& p) { return std::max(std::abs(p.norm() - 0.05) - 0.002, p.y()); },
                         grown(Box{Vector3::Constant(-0.05), Vector3::Constant(0.05)}, 0.005), 0.002);
  EXPECT_FALSE(flat_sheet(bowl));
}

/// A curved shell that no cell sees, and a sheet that no grid of distances does.
TEST(SceneSimulation, ObjectsTooThinForTheirElementsAreTold) {
  Scene scene;
  TriangleMesh& shell = scene.object.surface.emplace(make_sphere(0.05, 4));
  const int first = int(shell.vertices.size());
  const TriangleMesh inner = make_sphere(0.0495, 4);
  shell.vertices.insert(shell.vertices.end(), inner.vertices.begin(), inner.vertices.end());
  for (const auto& [a, b, c] : inner.triangles) shell.triangles.push_back({first + a, first + c, first + b});
  scene.timing = evenly_timed(50.0, 3);
  EXPECT_FALSE(flat_sheet(shell));
  std::vector<Vector3> controls;
  const auto distance = scene_distance(scene, 0.15);
  EXPECT_THAT(test::complaint_of([&] { (void)make_body_of(scene, *distance, Resolution(), controls); }),
              testing::AllOf(testing::HasSubstr("about 0.0005 m thickness"), testing::HasSubstr("400 along the object"),
                             testing::HasSubstr("`volume_mesh`")));
  scene.object.surface = make_box(Vector3(0.1, 0.0001, 0.02), 0.005);
  EXPECT_THAT(
      test::complaint_of([&] { (void)scene_distance(scene, 0.15); }),
      testing::AllOf(testing::HasSubstr("a sheet of 0.0001 m thickness"), testing::HasSubstr("0.00028 m at least")));
}

TEST(SceneSimulation, ThicknessIsThatOfMostOfTheSurface) {
  const auto of = [](TriangleMesh mesh) {
    Scene scene;
    scene.object.surface = std::move(mesh);
    return thickness(scene, *scene_distance(scene, 0.15));
  };
  EXPECT_NEAR(of(make_box(Vector3(0.4, 0.04, 0.04), 0.02)), 0.04, 0.004);
  EXPECT_NEAR(of(make_box(Vector3(0.4, 0.2, 0.03), 0.02)), 0.03, 0.004);
  EXPECT_NEAR(of(make_sphere(0.1, 3)), 0.2, 0.02);
}

TEST(SceneSimulation, HexahedraOfThinObjectsAreSmallerWithinABudget) {
  Scene scene;
  scene.object.surface = make_sphere(0.1, 3);
  EXPECT_NEAR(hex_cell_size(scene, *scene_distance(scene, 0.15), 10.0), 0.02, 1e-3) << "not thin";
  scene.object.surface = make_box(Vector3(0.4, 0.03, 0.03), 0.03);
  const auto distance = scene_distance(scene, 0.15);
  const double unlimited = hex_cell_size(scene, *distance, 12.0, 1000000);
  EXPECT_NEAR(unlimited, 5.0 * 0.03 / 12.0, 0.002);
  EXPECT_NEAR(hex_cell_size(scene, *distance, 24.0, 1000000), 0.5 * unlimited, 1e-12);
  const double limited = hex_cell_size(scene, *distance, 12.0, 100);
  EXPECT_NEAR(0.4 * 0.03 * 0.03 / std::pow(limited, 3), 100.0, 5.0);
}

TEST(SceneSimulation, ListedVerticesHoldWhatIsAroundThem) {
  Scene scene = bar();
  scene.fixed = {{RegionVertices{{0}}, std::nullopt}};
  const Vector3 corner = scene.object.surface->vertices[0];
  const std::vector<Hold> holds = held_regions(scene);
  ASSERT_EQ(holds.size(), 1u);
  EXPECT_TRUE(holds[0].contains(corner + Vector3::Constant(1e-3)));
  EXPECT_FALSE(holds[0].contains(-corner));
}

TEST(SceneSimulation, PullsHoldOnlyWhatIsReleasedFromAnUnknownPose) {
  Scene scene = bar();
  Resolution resolution;
  resolution.pulls = 3;
  EXPECT_EQ(pull_count(scene, resolution), 0);
  scene.initial.released = true;
  EXPECT_EQ(pull_count(scene, resolution), 3);
  scene.initial.pulled_at = {Vector3::Zero(), Vector3::UnitX()};
  EXPECT_EQ(pull_count(scene, resolution), 2) << "as many as there are places";
  scene.initial.pulls = {Vector3::Zero()};
  EXPECT_EQ(pull_count(scene, resolution), 1) << "as many as are known";
  scene.initial.release_of = Weight{0.1, Vector3::Zero()};
  EXPECT_EQ(pull_count(scene, resolution), 0);
}

TEST(SceneSimulation, WeightsHangOrAreReleased) {
  Scene scene = bar();
  scene.weights = {{0.1, {0.1, 0, 0}}};
  scene.initial.release_of = Weight{0.2, {0.1, 0, 0}};
  const Body body = body_of(scene);
  EXPECT_TRUE(make_simulation(scene, body, {}, blocks, parameters()).released_weights.empty());
  scene.initial.released = true;
  const SimulationOptions s = make_simulation(scene, body, {}, blocks, parameters());
  ASSERT_EQ(s.weights.size(), 1u);
  ASSERT_EQ(s.released_weights.size(), 1u);
  EXPECT_EQ(s.released_weights[0].mass, 0.2);
}

TEST(SceneSimulation, FinerStepsAreShorter) {
  const Scene scene = bar();
  const Body body = body_of(scene);
  Resolution fine;
  fine.steps = 2.0;
  EXPECT_EQ(make_simulation(scene, body, {}, blocks, parameters()).max_dt,
            2.0 * make_simulation(scene, body, fine, blocks, parameters()).max_dt);
}

TEST(SceneSimulation, StepsOfWhatIsHeldAndTouchesNothingFollowItsFrames) {
  Scene scene = bar();
  const Body body = body_of(scene);
  const auto step = [&](double frame_rate) {
    scene.timing = evenly_timed(frame_rate, 20);
    return make_simulation(scene, body, {}, blocks, parameters()).max_dt;
  };
  const double free = step(10.0);
  EXPECT_EQ(step(1000.0), free) << "what falls may meet something between two frames";
  scene.fixed = {{RegionBox{Vector3(-0.1, -0.1, -0.1), Vector3(-0.05, 0.1, 0.1)}, {}}};
  EXPECT_EQ(step(1000.0), free) << "no longer than frames are apart, and no shorter than of what is free";
  EXPECT_NEAR(step(0.05 / free), 2.0 * free, 1e-9) << "a tenth of a frame";
  EXPECT_NEAR(step(1.0), 2.5 * free, 1e-12) << "however rare frames are";
}

}  // namespace
}  // namespace pliant::scene_simulation_test
