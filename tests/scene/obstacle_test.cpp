#include "scene/obstacle.hpp"

#include <sstream>

#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"
#include "geometry/primitives.hpp"
#include "geometry/surface_distance.hpp"
#include "input_errors.hpp"
#include "scene/scene_toml.hpp"
#include "temporary_folder.hpp"

namespace pliant::obstacle_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

Scene read(const TemporaryFolder& folder, const std::string& text) {
  const std::filesystem::path file = folder.write("scene.toml", text);
  const toml::table table = parse_toml(text, file);
  TomlContext context{TomlPlaces(file), {}, {}};
  const NamedFiles files{folder.path()};
  Scene scene;
  TomlTable root(table, "", context);
  root.each_block("obstacle", [&](TomlTable& block) { scene.obstacles.push_back(read_obstacle(block, files, true)); });
  root.each_block("led", [&](TomlTable& block) { scene.led.push_back(read_led(block, files)); });
  root.finish();
  context.throw_problems();
  return scene;
}

KeyFrames<6>::Key key(double time, const Vector3& shift, const Vector3& turn) {
  KeyFrames<6>::Key key{time, {}};
  key.value << shift, turn;
  return key;
}

std::vector<RigidObstacle> all_shapes() {
  const TriangleMesh mesh = test::box_mesh(Vector3(0.1, 0.2, 0.3), Vector3(0.4, 0.4, 0.6));
  return {{ShapeBall{{0.1, 0.2, -0.3}, 0.25}, 0.5},
          {ShapeCapsule{{0.1, 0.0, 0.0}, {0.3, 0.4, 0.1}, 0.08}, 0.0, false},
          {ShapeBox{{-0.1, -0.2, -0.3}, {0.2, 0.1, 0.4}},
           0.25,
           true,
           {key(0.0, {0, 0, 0}, {0, 0, 0}), key(1.5, {0, 0.1, 0}, {0, 0.5, 0})}},
          {ShapePlane{{0.0, -0.1, 0.0}, Vector3(0.6, 0.8, 0.0)}},
          {ShapeMesh{"obstacle_4.ply", mesh}, 1.0}};
}

TEST(Obstacle, IsReadAsItWasWritten) {
  Scene scene;
  scene.obstacles = all_shapes();
  scene.led = {{RegionSphere{{0.1, 0.2, 0.3}, 0.05}},
               {RegionVertices{{3, 1, 4}},
                0.25,
                2.0,
                {key(0.25, {0, 0, 0}, {0, 0, 0}), key(1.0, {0.01, 0, 0}, {0.1, -0.2, 0.3})}}};
  const TemporaryFolder folder;
  std::ostringstream text;
  write_obstacle_blocks(text, scene);
  write_obstacle_files(folder.path(), scene);
  const Scene back = read(folder, text.str());
  ASSERT_EQ(back.obstacles.size(), scene.obstacles.size());
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const RigidObstacle &is = back.obstacles[i], &was = scene.obstacles[i];
    EXPECT_EQ(is.friction, was.friction);
    EXPECT_EQ(is.knows_friction, was.knows_friction);
    ASSERT_EQ(is.motion.size(), was.motion.size());
    for (std::size_t k = 0; k < was.motion.size(); ++k)
      EXPECT_LT((is.motion[k].value - was.motion[k].value).norm(), 1e-14) << i;
    EXPECT_TRUE(i == 4 || is.shape == was.shape) << i;
  }
  EXPECT_EQ(std::get<ShapeMesh>(back.obstacles[4].shape).mesh, std::get<ShapeMesh>(scene.obstacles[4].shape).mesh);
  ASSERT_EQ(back.led.size(), 2u);
  EXPECT_EQ(back.led[0].region, scene.led[0].region);
  EXPECT_EQ(back.led[0].from, -infinite);
  EXPECT_EQ(back.led[1].region, scene.led[1].region);
  EXPECT_EQ(back.led[1].from, 0.25);
  EXPECT_EQ(back.led[1].until, 2.0);
  EXPECT_EQ(back.led[1].motion.size(), 2u);
}

TEST(Obstacle, MovesByAFileOfKeys) {
  const TemporaryFolder folder;
  folder.write("clamp.csv", "time,x,y,z,turn_x,turn_y,turn_z\n0,0,0,0,0,0,0\n0.5,0.01,0,0,0,0,90\n");
  folder.write("table.csv", "time,x,y,z\n0,0,0,0\n1,0,0.02,0\n");
  const Scene scene = read(folder, R"(
[[led]]
half_space = { point = [0, 0, 0], normal = [0, 1, 0] }
motion_file = "clamp.csv"
[[obstacle]]
box = { min = [0, 0, 0], max = [1, 1, 1] }
motion_file = "table.csv"
)");
  ASSERT_EQ(scene.led[0].motion.size(), 2u);
  EXPECT_NEAR(scene.led[0].motion[1].value[5], 1.5707963267948966, 1e-12);
  EXPECT_EQ(scene.led[0].motion[1].value[0], 0.01);
  EXPECT_EQ(scene.obstacles[0].motion[1].value[1], 0.02);
  EXPECT_FALSE(scene.obstacles[0].knows_friction);
}

TEST(Obstacle, RefusesWhatMakesNoSense) {
  const TemporaryFolder folder;
  const auto complaint = [&](const std::string& text) { return complaint_of([&] { (void)read(folder, text); }); };
  EXPECT_THAT(complaint("[[obstacle]]\nfriction = 0.1\n"), HasSubstr("an obstacle of 0 shapes"));
  EXPECT_THAT(
      complaint("[[obstacle]]\nball = { centre = [0, 0, 0], radius = 1 }\nplane = { point = [0, 0, 0], normal = [0, "
                "1, 0] }\n"),
      HasSubstr("an obstacle of 2 shapes"));
  EXPECT_THAT(complaint("[[obstacle]]\nbox = { min = [0, 0, 0], max = [1, 0, 1] }\n"), HasSubstr("`min`"));
  EXPECT_THAT(complaint("[[obstacle]]\nmesh = \"none.ply\"\n"), HasSubstr("none.ply"));
  TriangleMesh open = test::box_mesh(Vector3::Zero(), Vector3::Ones());
  open.triangles.pop_back();
  write_mesh(folder.path() / "open.ply", open);
  EXPECT_THAT(complaint("[[obstacle]]\nmesh = \"open.ply\"\n"), HasSubstr("a closed surface"));
  folder.write("bad.csv", "time,x,y,z\n0,0,0,0\n0,0,1,0\n");
  EXPECT_THAT(complaint("[[led]]\nsphere = { centre = [0, 0, 0], radius = 1 }\nmotion_file = \"bad.csv\"\n"),
              AllOf(HasSubstr("bad.csv:3"), HasSubstr("times that increase")));
  folder.write("odd.csv", "t,x,y\n0,0,0\n");
  EXPECT_THAT(complaint("[[led]]\nsphere = { centre = [0, 0, 0], radius = 1 }\nmotion_file = \"odd.csv\"\n"),
              AllOf(HasSubstr("odd.csv:1"), HasSubstr("time,x,y,z")));
  EXPECT_THAT(complaint("[[led]]\nsphere = { centre = [0, 0, 0], radius = 1 }\nfrom = 2\nuntil = 1\n"),
              HasSubstr("an end after the beginning"));
}

/// Whatever an obstacle is: its surface is where the distance is zero, its box holds it, and what lies inside is deep.
TEST(Obstacle, SurfaceDistanceAndBoxAgree) {
  for (const RigidObstacle& obstacle : all_shapes()) {
    const auto distance = distance_to(obstacle);
    const TriangleMesh surface = surface_of(obstacle);
    const Box box = box_of(obstacle);
    if (std::holds_alternative<ShapePlane>(obstacle.shape)) {
      EXPECT_TRUE(surface.triangles.empty());
      EXPECT_NEAR(distance({0.6, 0.7, 5.0}), 1.0, 1e-14);
      continue;
    }
    ASSERT_FALSE(surface.triangles.empty());
    const double size = box.extent().maxCoeff();
    for (const Vector3& vertex : surface.vertices) {
      EXPECT_LT(std::abs(distance(vertex)), 3e-3 * size) << obstacle.shape.index();
      EXPECT_TRUE((vertex.array() >= box.min.array() - 1e-3 * size).all() &&
                  (vertex.array() <= box.max.array() + 1e-3 * size).all());
    }
    EXPECT_GT(enclosed_volume(surface), 0.0) << "faces outwards";
    const SurfaceDistance to_surface(surface);
    for (int i = 0; i < 40; ++i) {
      const Vector3 p =
          0.5 * (box.min + box.max) + size * Vector3(std::sin(1.3 * i), std::cos(2.1 * i), std::sin(3.7 * i));
      EXPECT_NEAR(std::abs(distance(p)), to_surface(p), 5e-3 * size) << obstacle.shape.index();
    }
    const Vector3 middle = 0.5 * (box.min + box.max), outside = box.max + Vector3::Ones();
    EXPECT_NEAR(greatest_depth(obstacle, std::vector<Vector3>{outside, middle}), to_surface(middle), 5e-3 * size);
    EXPECT_EQ(greatest_depth(obstacle, std::vector<Vector3>{outside}), 0.0);
  }
}

TEST(LedRegion, TurnsAboutItsMiddle) {
  const TriangleMesh surface = test::box_mesh(Vector3::Zero(), Vector3(0.4, 0.2, 0.2));
  const auto keys = std::vector{key(0.0, {0, 0, 0}, {0, 0, 3.141592653589793})};
  const auto middle = [&](const Region& region) {  // half a turn about it
    const RigidMotion motion = motion_of({region, -infinite, infinite, keys}, surface).at(0.0);
    return Vector3(0.5 * (motion(Vector3::Zero()) + Vector3(0, 0, 0.2)));
  };
  EXPECT_LT((middle(RegionBox{{0.3, -9, -9}, {9, 9, 9}}) - Vector3(0.35, 0.1, 0.1)).norm(), 1e-12);
  EXPECT_LT((middle(RegionSphere{{0.1, 0.05, 0.1}, 0.1}) - Vector3(0.1, 0.05, 0.1)).norm(), 1e-12);
  EXPECT_LT((middle(RegionHalfSpace{{0.3, 0, 0}, {1, 0, 0}}) - Vector3(0.4, 0.1, 0.1)).norm(), 1e-12);
}

TEST(Obstacle, TurnsAboutItsMiddle) {
  RigidObstacle box{ShapeBox{{0, 0, 0}, {0.2, 0.2, 0.2}}};
  EXPECT_LT((motion_of(box).at(3.0)(Vector3(0.3, 0, 0)) - Vector3(0.3, 0, 0)).norm(), 1e-15);
  box.motion = {key(0.0, {0, 0, 0}, {0, 0, 0}), key(1.0, {1, 0, 0}, {0, 0, 3.141592653589793})};
  EXPECT_LT((motion_of(box).at(2.0)(Vector3(0.2, 0.1, 0.1)) - Vector3(1.0, 0.1, 0.1)).norm(), 1e-12);
}

}  // namespace
}  // namespace pliant::obstacle_test
