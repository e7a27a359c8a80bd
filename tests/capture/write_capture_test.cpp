#include "base/files.hpp"
#include "capture/small_capture.hpp"

namespace pliant::write_capture_test {
namespace {

using test::SmallCapture;
using testing::HasSubstr;
using testing::Not;

void expect_same_scene(const Scene& is, const Scene& was) {
  EXPECT_EQ(is.object.file, was.object.file);
  EXPECT_EQ(is.object.mass, was.object.mass);
  EXPECT_EQ(is.object.density, was.object.density);
  EXPECT_EQ(is.object.mass_std, was.object.mass_std);
  EXPECT_EQ(is.object.density_std, was.object.density_std);
  EXPECT_EQ(is.object.scale_std, was.object.scale_std);
  EXPECT_EQ(is.object.shape_is, was.object.shape_is);
  EXPECT_EQ(is.object.surface_noise, was.object.surface_noise);
  EXPECT_EQ(is.object.stiffness_std, was.object.stiffness_std);
  EXPECT_EQ(is.object.surface, was.object.surface);
  EXPECT_EQ(is.object.volume.has_value(), was.object.volume.has_value());
  EXPECT_EQ(is.world, was.world);
  EXPECT_EQ(is.timing, was.timing);
  EXPECT_EQ(is.fixed, was.fixed);
  EXPECT_EQ(is.regions, was.regions);
  EXPECT_EQ(is.planes, was.planes);
  EXPECT_EQ(is.weights, was.weights);
  EXPECT_EQ(is.initial, was.initial);
  ASSERT_EQ(is.wind.has_value(), was.wind.has_value());
  if (is.wind) {
    EXPECT_EQ(is.wind->velocity, was.wind->velocity);
    EXPECT_EQ(is.wind->over_time.size(), was.wind->over_time.size());
    EXPECT_EQ(is.wind->known, was.wind->known);
    EXPECT_EQ(is.wind->gust_intensity, was.wind->gust_intensity);
    EXPECT_EQ(is.wind->gust_length, was.wind->gust_length);
    EXPECT_EQ(is.wind->seed, was.wind->seed);
    EXPECT_EQ(is.wind->air_density, was.wind->air_density);
    EXPECT_EQ(is.wind->normal, was.wind->normal);
    EXPECT_EQ(is.wind->tangential, was.wind->tangential);
  }
  ASSERT_EQ(is.forces.size(), was.forces.size());
  for (std::size_t i = 0; i < is.forces.size(); ++i) {
    EXPECT_EQ(is.forces[i].at, was.forces[i].at);
    EXPECT_EQ(is.forces[i].radius, was.forces[i].radius);
    EXPECT_EQ(is.forces[i].known, was.forces[i].known);
    ASSERT_EQ(is.forces[i].force.size(), was.forces[i].force.size());
    for (std::size_t k = 0; k < is.forces[i].force.size(); ++k)
      EXPECT_EQ(is.forces[i].force[k].value, was.forces[i].force[k].value);
  }
}

// Everything that a capture.toml can say but its hash and its place.
void expect_same(const Capture& is, const Capture& was) {
  EXPECT_EQ(is.name, was.name);
  expect_same_scene(is.scene, was.scene);
  EXPECT_EQ(is.depth, was.depth);
  EXPECT_EQ(is.silhouettes, was.silhouettes);
  EXPECT_EQ(is.clouds, was.clouds);
  EXPECT_EQ(is.markers, was.markers);
  EXPECT_EQ(is.presses, was.presses);
  EXPECT_EQ(is.loads, was.loads);
  EXPECT_EQ(is.indentations, was.indentations);
  EXPECT_EQ(is.grips, was.grips);
  EXPECT_EQ(is.material_curves, was.material_curves);
}

Capture written_and_read(const std::filesystem::path& folder, const Capture& capture) {
  write_capture(folder, capture);
  return read_capture(folder);
}

// Gives a small recording every kind of block.
void fill(SmallCapture& small) {
  write_points(small.folder / "clouds/000000.ply", std::vector<Vector3>{{0, 0, -0.1}});
  write_points(small.folder / "clouds/000002.ply", std::vector<Vector3>{{0, 0.08, -0.1}});
  small.folder.write("press/000.csv", "id,x,y,z\n0,0,0,-0.09\n");
  small.folder.write("press/000_std.csv", "id,sx,sy,sz\n0,1e-4,1e-4,2e-4\n");
  write_png(small.folder / "load.png", SmallCapture::depth_image(0.0));
  write_png(small.folder / "load_mask.png", SmallCapture::mask_image(0.0));
  small.edit("gravity = [0.0, 9.81, 0.0]", "gravity = [0.0, 9.81, 0.0]\ngravity_std = 0.004");
  small.edit("mass = 0.8",
             "density = 100.0\ndensity_std = 2.5\nscale_std = 0.0\nsurface_noise = 0.0002\n"
             "stiffness_std = 0.15\nshape_is = \"static\"");
  small.edit("noise = 0.002",
             "background = \"front/background.png\"\nevery = 1\nnoise = 0.002\ntime_offset = -0.004\n"
             "pose_std = { turn = 0.002, shift = 0.0 }\n"
             "range_std = 0.0\nrange_scale_std = 0.001\nfocal_std = 0.003\n"
             "distortion = [-0.1, 0.02, 0.001, -0.002, 0.003]");
  small.append(R"([initial]
linear_velocity = [0, 0.5, 0]
angular_velocity = [0, 0, 0.1]
known = false
[[fixed]]
vertices = "held.txt"
displaced_to = [[0, -1, 0, 0.1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[[fixed]]
sphere = { centre = [0.1, 0.1, 0.1], radius = 0.01 }
[[region]]
name = "listed"
vertices = "held.txt"
[[plane]]
point = [0.0, 0.7, 0.0]
normal = [0.0, -0.8, 0.6]
known = false
[[weight]]
mass = 0.05
at = [0.1, 0.1, 0.0]
[wind]
velocity = [3, 0, 0.3333333333333333]
known = false
normal = 1.1
gusts = { intensity = 0.3, length = 2.0, seed = 7 }
[[force]]
at = [0.1, 0.1, 0.0]
radius = 0.03
over_time = [ { time = 0, force = [0, 0, 0] }, { time = 0.5, force = [0, 0.125, 0] } ]
known = false
[[force]]
at = [0.1, 0.1, 0.0]
force = [0, 1, 0]
[[cloud]]
points = "clouds/%06d.ply"
every = 2
noise = 0.003
pose_std = { turn = 0.01, shift = 0.002 }
background = "clouds/000000.ply"
[[markers]]
rest = "markers_rest.csv"
track = "markers.csv"
[[press]]
force = [0.0, 0.1, -3.3333333333333335]
contact = { centre = [0, 0, -0.1], radius = 0.01 }
probe = { point = [0, 0, -0.1], normal = [0, 0, 1] }
markers = "press/000.csv"
markers_std = "press/000_std.csv"
markers_rest = "markers_rest.csv"
role = "test"
glued = false
[[press]]
force = [0, 0, 1]
contact = { centre = [0, 0, -0.1], radius = 0.01 }
markers = "press/000.csv"
markers_rest = "markers_rest.csv"
[[load]]
mass = 0.1
at = [0, 0.1, 0]
cloud = "load.ply"
images = { front = "load.png" }
masks = { front = "load_mask.png" }
role = "test"
[[load]]
mass = 0.2
at = [0, 0.1, 0]
markers = "press/000.csv"
markers_rest = "markers_rest.csv"
[[indentation]]
name = "site"
probe = "punch"
radius = 0.01
contact = [0, 0, -0.1]
direction = [0, 0.6, 0.8]
contact_std = 0.0001
curve = "depths.csv"
[[indentation]]
probe = "ball"
radius = 0.02
contact = [0, 0, -0.1]
direction = [0, 0, 1]
curve = "depths.csv"
role = "test"
[[grip]]
vertices = "held.txt"
displacement = [0.01, 0, 0]
force = 0.3
force_std = 0.01
[[grip]]
name = "clamp"
sphere = { centre = [0.1, 0.1, 0.1], radius = 0.01 }
displacement = [0, 0.01, 0]
force = -0.3
force_std = 0.01
force_direction = [0, 0, 1]
markers = "press/000.csv"
markers_rest = "markers_rest.csv"
markers_std = 0.0002
unseen = [1, 0, 0]
role = "test"
[[material_curve]]
mode = "biaxial"
measure = "cauchy_difference"
curve = "biaxial.csv"
[[material_curve]]
name = "sheared"
mode = "simple_shear"
prestretch = 0.9
curve = "shear.csv"
role = "test"
)");
  small.folder.write("depths.csv", "depth,force,std\n0.001,0.1,0.01\n0.002,0.3,0.01\n");
  small.folder.write("biaxial.csv", "stretch,second,stress,std\n1.1,1.05,1000,10\n");
  small.folder.write("shear.csv", "stretch,stress,std\n-0.1,-500,10\n0.2,1000,10\n");
}

TEST(WriteCapture, ComesBackAsItWasRead) {
  SmallCapture small;
  fill(small);
  const Capture capture = small.read();
  ASSERT_EQ(capture.presses.size(), 2u);
  ASSERT_EQ(capture.loads.size(), 2u);
  ASSERT_EQ(capture.indentations.size(), 2u);
  ASSERT_EQ(capture.grips.size(), 2u);
  ASSERT_EQ(capture.material_curves.size(), 2u);
  ASSERT_EQ(capture.scene.fixed.size(), 2u);
  const Capture again = written_and_read(small.folder.path(), capture);
  expect_same(again, capture);
  const std::string text = read_file(small.folder / "capture.toml");
  write_capture(small.folder.path(), again);
  EXPECT_EQ(read_file(small.folder / "capture.toml"), text);
}

TEST(WriteCapture, ReleasesAndRecordedTimesComeBack) {
  SmallCapture small;
  small.folder.write("times.txt", "0\n0.1\n0.25\n0.3333333333333333\n");
  small.edit("frame_rate = 60.0", "timestamps = \"times.txt\"");
  small.append(
      "[initial]\nreleased = true\nrelease_of = { mass = 0.02, at = [0.1, 0.1, 0.1] }\n[[fixed]]\nhalf_space = { "
      "point = [-0.099, 0, 0], normal = [-1, 0, 0] }\n");
  const Capture capture = small.read();
  expect_same(written_and_read(small.folder.path(), capture), capture);
}

TEST(WriteCapture, MaySayNothingOfScanGravityAndFrames) {
  SmallCapture small;
  small.edit("surface = \"rest.ply\"\n", "").edit("gravity = [0.0, 9.81, 0.0]", "up = [0.0, -1.0, 0.0]");
  const Capture capture = small.read();
  expect_same(written_and_read(small.folder.path(), capture), capture);
}

TEST(WriteCapture, ElementsMadeElsewhereStayWhatTheyAre) {
  SmallCapture small;
  small.folder.write("made.msh",
                     "$NOD\n4\n1 0 0 0\n2 .1 0 0\n3 0 .1 0\n4 0 0 .1\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n");
  small.text = R"(format = "capture/1"
name = "tetrahedron"
[object]
volume_mesh = "made.msh"
density = 100.0
[world]
gravity = [0.0, -9.81, 0.0]
[[press]]
force = [0, 0, 1]
contact = { centre = [0.01, 0.01, 0], radius = 0.01 }
markers = "markers_rest.csv"
markers_rest = "markers_rest.csv"
)";
  small.folder.write("markers_rest.csv", "id,x,y,z\n0,0,0,0\n");
  const Capture capture = small.read();
  ASSERT_TRUE(capture.scene.object.volume);
  expect_same(written_and_read(small.folder.path(), capture), capture);
  EXPECT_THAT(read_file(small.folder / "capture.toml"), Not(HasSubstr("[timing]")));
}

TEST(WriteCapture, FilesOfAnotherFolderAreNamedFromTheNewOne) {
  SmallCapture small;
  Capture capture = small.read();
  capture.depth.clear();
  capture.markers = {{small.folder / "markers_rest.csv", small.folder / "markers.csv"}};
  const Capture again = written_and_read(small.folder / "new", capture);
  expect_same(again, capture);
  EXPECT_THAT(read_file(small.folder / "new/capture.toml"), HasSubstr("surface = \"../rest.ply\""));
}

TEST(WriteCapture, ASurfaceWithoutFileGetsOne) {
  SmallCapture small;
  Capture capture = small.read();
  capture.scene.object.file.clear();
  std::filesystem::remove(small.folder / "rest.ply");
  const Capture again = written_and_read(small.folder.path(), capture);
  EXPECT_EQ(again.scene.object.surface, capture.scene.object.surface);
  EXPECT_EQ(again.scene.object.file.filename(), "rest.ply");
}

TEST(WriteCapture, BeginsWithItsComment) {
  const SmallCapture small;
  write_capture(small.folder.path(), small.read(), "made by a test");
  EXPECT_THAT(read_file(small.folder / "capture.toml"),
              testing::StartsWith("# made by a test\nformat = \"capture/1\""));
}

}  // namespace
}  // namespace pliant::write_capture_test
