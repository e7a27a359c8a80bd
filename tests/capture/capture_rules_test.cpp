#include "capture/capture_rules.hpp"

#include <filesystem>

#include "capture/small_capture.hpp"
#include "input_errors.hpp"
#include "support/c3d_writer.hpp"

namespace pliant::capture_rules_test {
namespace {

using test::complaint_of;
using test::SmallCapture;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// A slip in an otherwise valid capture: `from` becomes `to`, and exactly one problem is reported, at the line on
// which `at` then stands.
struct Slip {
  const char* name;
  const char* from;
  const char* to;
  const char* says;
  const char* at;
};

void PrintTo(const Slip& slip, std::ostream* stream) { *stream << slip.name; }

class CaptureSlip : public ::testing::TestWithParam<Slip> {};

TEST_P(CaptureSlip, IsReportedAtItsLine) {
  SmallCapture small;
  const Slip& slip = GetParam();
  small.edit(slip.from, slip.to);
  try {
    (void)small.read();
    FAIL() << "nothing was reported";
  } catch (const InputError& error) {
    ASSERT_THAT(error.problems(), SizeIs(1)) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(slip.says));
    const Place& place = error.problems()[0].place;
    EXPECT_EQ(place.file.filename(), "capture.toml");
    EXPECT_EQ(place.line, small.line_of(slip.at)) << error.what();
    EXPECT_GT(place.column, 0);
  }
}

const Slip slips[] = {
    {"UnknownKey", "mass = 0.8", "mas = 0.8", "did you mean `mass`", "mas ="},
    {"UnknownTable", "[[region]]", "[[regions]]", "did you mean `region`", "[[regions]]"},
    {"UnknownFormat", "capture/1", "capture/9", "expected \"capture/1\"", "format"},
    {"MissingName", "name = \"box\"", "", "the file has no `name`", "format"},
    {"MissingKey", "fx = 80.0\n", "", "has no `fx`", "[[depth]]"},
    {"WrongType", "mass = 0.8", "mass = \"0.8\"", "`mass` is a text; expected a number", "mass"},
    {"NotFinite", "mass = 0.8", "mass = nan", "expected a finite number", "mass"},
    {"NotFiniteVector", "[0.0, 9.81, 0.0]", "[0.0, inf, 0.0]", "three numbers", "gravity"},
    {"ShortVector", "[0.0, 9.81, 0.0]", "[0.0, 9.81]", "a list of 2", "gravity"},
    {"FractionalCount", "frame_count = 4", "frame_count = 4.5", "expected a whole number", "frame_count"},
    {"OneTableTwice", "[timing]", "[[timing]]", "expected a table [timing]", "[[timing]]"},
    {"BlockWithSingleBrackets", "[[plane]]", "[plane]", "expected blocks [[plane]]", "[plane]"},
    {"SurfaceMissing", "rest.ply", "rset.ply", "\"rset.ply\" is not there", "surface"},
    {"AbsolutePath", "\"rest.ply\"", "\"/rest.ply\"", "relative to the folder", "surface"},
    {"ShapeIs", "mass = 0.8", "mass = 0.8\nshape_is = \"loaded\"", "expected \"reference\" or \"static\"", "shape_is"},
    {"MassInGrams", "mass = 0.8", "mass = 800.0", "mass is in kilograms", "mass"},
    {"MassZero", "mass = 0.8", "mass = 0.0", "expected a number above 0", "mass"},
    {"DensityInGramsPerCubicCentimetre", "mass = 0.8", "density = 1.08", "1 g/cm^3 is 1000 kg/m^3", "density"},
    {"SurfaceNoiseInMillimetres", "mass = 0.8", "mass = 0.8\nsurface_noise = 0.25", "a standard deviation in metres",
     "surface_noise"},
    {"NegativeSurfaceNoise", "mass = 0.8", "mass = 0.8\nsurface_noise = -0.001", "a surface that errs by",
     "surface_noise"},
    {"MassKnownInGrams", "mass = 0.8", "mass = 0.8\nmass_std = 5", "half of `mass`", "mass_std"},
    {"MassKnownToLessThanNothing", "mass = 0.8", "mass = 0.8\nmass_std = -0.01", "a deviation of -0.01 kg", "mass_std"},
    {"DensityStdOfAMass", "mass = 0.8", "mass = 0.8\ndensity_std = 3", "`density_std` without `density`",
     "density_std"},
    {"GravityStdInDegrees", "9.81, 0.0]", "9.81, 0.0]\ngravity_std = 1.0", "radians", "gravity_std"},
    {"GravityStdOfNoGravity", "gravity = [0.0, 9.81, 0.0]", "up = [0, -1, 0]\ngravity_std = 0.01",
     "`gravity_std` without `gravity`", "gravity_std"},
    {"ScaleStdInPercent", "mass = 0.8", "mass = 0.8\nscale_std = 3", "a share of all lengths", "scale_std"},
    {"StiffnessStdInPercent", "mass = 0.8", "mass = 0.8\nstiffness_std = 15", "a share of the stiffness",
     "stiffness_std"},
    {"ScaleStdBesideAForce", "mass = 0.8\n\n[world]",
     "mass = 0.8\nscale_std = 0.03\n\n[[force]]\nat = [0.1, 0, 0]\nforce = [0, 1, 0]\n[world]",
     "forces that are no weight", "scale_std"},
    {"ScaleStdOfADensityBesideAWeight", "mass = 0.8\n\n[world]",
     "density = 100\nscale_std = 0.03\n\n[[weight]]\nat = [0.1, 0, 0]\nmass = 0.01\n[world]",
     "`mass` in the place of `density`", "scale_std"},
    {"RangeStdInMillimetres", "noise = 0.002", "noise = 0.002\nrange_std = 2.0", "metres by which all ranges are off",
     "range_std"},
    {"RangeScaleStdInPercent", "noise = 0.002", "noise = 0.002\nrange_scale_std = 1", "a share, like 0.003",
     "range_scale_std"},
    {"FocalStdInPixels", "noise = 0.002", "noise = 0.002\nfocal_std = 2.0", "a share, like 0.003", "focal_std"},
    {"MassAndDensity", "mass = 0.8", "mass = 0.8\ndensity = 100.0", "both `mass` and `density`", "density"},
    {"GravityInCentimetres", "9.81", "981.0", "expected about 9.81", "gravity"},
    {"NeitherGravityNorUp", "gravity = [0.0, 9.81, 0.0]", "", "neither `gravity` nor `up`", "[world]"},
    {"UpAlongGravity", "gravity = [0.0, 9.81, 0.0]", "gravity = [0.0, 9.81, 0.0]\nup = [0, 1, 0]",
     "does not point against", "up ="},
    {"UpWithoutLength", "gravity = [0.0, 9.81, 0.0]", "up = [0, 0, 0]", "without length", "up ="},
    {"NoRate", "frame_rate = 60.0", "", "neither `frame_rate` nor `timestamps`", "[timing]"},
    {"NoCount", "frame_count = 4", "", "has no `frame_count`", "[timing]"},
    {"RateZero", "frame_rate = 60.0", "frame_rate = 0.0", "expected above 0", "frame_rate"},
    {"RateInMilliseconds", "frame_rate = 60.0", "frame_rate = 0.016", "times are in seconds", "frame_rate"},
    {"StartBeyondEnd", "start_frame = 1", "start_frame = 4", "expected 0 to 3", "start_frame"},
    {"StartNegative", "start_frame = 1", "start_frame = -1", "expected 0 to 3", "start_frame"},
    {"StaticWithVelocity", "start_frame = 1", "static = true\n[initial]\nlinear_velocity = [0, 1, 0]",
     "an object at rest", "[initial]"},
    {"StaticReleased", "start_frame = 1", "static = true\n[initial]\nreleased = true",
     "a static capture that is released", "released"},
    {"VelocityInMillimetres", "[[plane]]", "[initial]\nlinear_velocity = [0, 2100, 0]\n[[plane]]", "at most 100 m/s",
     "linear_velocity"},
    {"WindTooFast", "[[plane]]", "[wind]\nvelocity = [300, 0, 0]\n[[plane]]", "metres a second", "velocity"},
    {"ForceOffTheSurface", "[[plane]]", "[[force]]\nat = [3, 0, 0]\nforce = [0, 1, 0]\n[[plane]]",
     "off the rest surface", "at = [3"},
    {"ForceOfNothing", "[[plane]]", "[[force]]\nat = [0.1, 0, 0]\nforce = [0, 0, 0]\n[[plane]]", "a force of 0 N",
     "[[force]]"},
    {"ForceWithTimesInDisorder", "[[plane]]",
     "[[force]]\nat = [0.1, 0, 0]\nover_time = [ { time = 1, force = [0, 1, 0] }, { time = 0, force = [0, 1, 0] } ]\n"
     "[[plane]]",
     "times that increase", "over_time"},
    {"SpinInDegrees", "[[plane]]", "[initial]\nangular_velocity = [0, 3600, 0]\n[[plane]]", "radians per second",
     "angular_velocity"},
    {"PlaneTurnedRound", "normal = [0.0, -2.0, 0.0]", "normal = [0.0, 1.0, 0.0]", "below this plane", "[[plane]]"},
    {"PlaneWithoutNormal", "normal = [0.0, -2.0, 0.0]", "normal = [0, 0, 0]", "a direction without length",
     "normal = [0, 0, 0]"},
    {"FixedOutside", "[[plane]]", "[[fixed]]\nsphere = { centre = [1, 0, 0], radius = 0.02 }\n[[plane]]",
     "no point of the object lies in this fixed region", "[[fixed]]"},
    {"FixedAll", "[[plane]]", "[[fixed]]\nsphere = { centre = [0, 0, 0], radius = 2 }\n[[plane]]", "nothing could move",
     "[[fixed]]"},
    {"FixedTwice", "[[plane]]",
     "[[fixed]]\nvertices = \"held.txt\"\nsphere = { centre = [0, 0, 0], radius = 0.1 }\n[[plane]]",
     "2 regions in one block", "[[fixed]]"},
    {"FixedNothing", "[[plane]]", "[[fixed]]\n[[plane]]", "no region", "[[fixed]]"},
    {"BoxInsideOut", "[[plane]]", "[[fixed]]\nbox = { min = [1, 0, 0], max = [0, 1, 1] }\n[[plane]]", "swap them",
     "box = {"},
    {"SphereRadius", "[[plane]]", "[[fixed]]\nsphere = { centre = [0, 0, 0], radius = 0 }\n[[plane]]",
     "`radius` is 0; expected above 0; a radius in metres", "sphere"},
    {"DisplacedByAShear", "[[plane]]",
     "[[fixed]]\nvertices = \"held.txt\"\ndisplaced_to = [[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, "
     "1]]\n[[plane]]",
     "not orthonormal", "displaced_to"},
    {"RegionOutside", "point = [0, 0, 0], normal = [-1, 0, 0]", "point = [5, 0, 0], normal = [1, 0, 0]",
     "no point of the object lies in region", "[[region]]"},
    {"RegionTwice", "[[depth]]",
     "[[region]]\nname = \"left\"\nsphere = { centre = [0, 0, 0], radius = 0.1 }\n[[depth]]", "a second region",
     "name = \"left\"\nsphere"},
    {"RegionName", "\"left\"", "\"a@b\"", "a name without @", "a@b"},
    {"PoseScaled", "[1, 0, 0, 0]", "[1000, 0, 0, 0]", "not orthonormal", "camera_to_world"},
    {"PoseMirrored", "[1, 0, 0, 0]", "[-1, 0, 0, 0]", "mirrors", "camera_to_world"},
    {"PoseTransposed", "[0, 0, 1, -1], [0, 0, 0, 1]", "[0, 0, 1, 0], [0, 0, -1, 1]", "transposed", "camera_to_world"},
    {"PoseShort", ", [0, 0, 0, 1]]", "]", "a 4 x 4 matrix", "camera_to_world"},
    {"PoseLooksAway", "[0, 0, 1, -1]", "[0, 0, 1, 9]", "shows nothing within", "camera_to_world"},
    {"PoseOffTheReadings", "[0, 0, 1, -1]", "[0, 0, 1, -30]", "shows nothing within", "camera_to_world"},
    {"FocalInMillimetres", "fx = 80.0", "fx = 3.6", "focal lengths are in pixels", "fx"},
    {"LensOfTwoNumbers", "fx = 80.0", "fx = 80.0\ndistortion = [0.1, 0.2]", "4, 5, 8, 12 or 14 of them", "distortion"},
    {"LensThatFoldsBack", "fx = 80.0", "fx = 80.0\ndistortion = [-2.0, 0, 0, 0]", "each place of the image once",
     "distortion"},
    {"PoseKnownInDegrees", "noise = 0.002", "noise = 0.002\npose_std = { turn = 1.0, shift = 0.01 }",
     "radians about each axis", "pose_std"},
    {"PoseStdMisspelt", "noise = 0.002", "noise = 0.002\npose_std = { turned = 0.01 }", "turn", "pose_std"},
    {"LateInMilliseconds", "noise = 0.002", "noise = 0.002\ntime_offset = 8.0", "-1 to 1 s", "time_offset"},
    {"PrincipalPointNormalised", "cx = 39.5\ncy = 29.5", "cx = 0.5\ncy = 0.5", "a point in the middle of the image",
     "cx"},
    {"IntrinsicsOfTheColourCamera", "cx = 39.5\ncy = 29.5", "cx = 79.5\ncy = 44.5", "of the colour camera", "cx"},
    {"PoseInverted", "[0, 0, 1, -1]", "[0, 0, 1, 1]", "its inverse would: it looks like one from world to camera",
     "camera_to_world"},
    {"PoseInMillimetres", "[0, 0, 1, -1]", "[0, 0, 1, -1000]", "its translation divided by 1000", "camera_to_world"},
    {"PoseOfOpenGl", "[0, 1, 0, 0], [0, 0, 1, -1]", "[0, -1, 0, 0], [0, 0, -1, -1]", "with the axes of OpenGL",
     "camera_to_world"},
    {"DepthInTenthsOfAMillimetre", "depth_scale = 1000.0", "depth_scale = 10000.0",
     "with `depth_scale` = 1000 it would", "depth_scale"},
    {"DepthInQuarters", "depth_scale = 1000.0", "depth_scale = 250.0", "with `depth_scale` = 1000 it would",
     "depth_scale"},
    {"ImagesMissing", "\"front/%06d.png\"", "\"back/%06d.png\"", "nor for any other frame", "images"},
    {"PatternWithoutNumber", "\"front/%06d.png\"", "\"front/000000.png\"", "one %06d", "images"},
    {"PatternWithText", "\"front/%06d.png\"", "\"front/%s.png\"", "one %06d", "images"},
    {"DepthScaleOne", "depth_scale = 1000.0", "depth_scale = 1.0", "1000 for millimetres", "depth_scale"},
    {"DepthScaleZero", "depth_scale = 1000.0", "depth_scale = 0.0", "0 or less", "depth_scale"},
    {"MaskIsDepth", "front/mask_%06d.png", "front/%06d.png", "16 bits a channel", "masks"},
    {"BackgroundMissing", "noise = 0.002", "background = \"none.png\"", "\"none.png\" is not there", "background"},
    {"EveryZero", "noise = 0.002", "every = 0", "`every` is 0", "every"},
    {"NoiseInMillimetres", "noise = 0.002", "noise = 2.0", "a standard deviation in metres", "noise"},
};

INSTANTIATE_TEST_SUITE_P(Facts, CaptureSlip, ::testing::ValuesIn(slips),
                         [](const auto& slip) { return slip.param.name; });

TEST(CaptureRules, AcceptTheCaptureThatTheSlipsStartFrom) {
  SmallCapture small;
  EXPECT_EQ(complaint_of([&] { (void)small.read(); }), "");
}

TEST(CaptureRules, ReportEverythingTogetherInTheOrderOfTheFile) {
  SmallCapture small;
  small.edit("mass = 0.8", "mas = 0.8").edit("fx = 80.0", "fx = 3.6").edit("9.81", "981.0");
  const std::string said = complaint_of([&] { (void)small.read(); });
  EXPECT_LT(said.find("`mas`"), said.find("981"));
  EXPECT_LT(said.find("981"), said.find("3.6"));
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 2);
}

TEST(CaptureRules, RefuseASurfaceThatIsOpen) {
  SmallCapture small;
  TriangleMesh open = test::box_mesh(Vector3::Constant(-0.1), Vector3::Constant(0.1));
  open.triangles.pop_back();
  write_mesh(small.folder / "rest.ply", open);
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }),
              AllOf(HasSubstr("`surface` is no solid"), HasSubstr("has holes")));
}

TEST(CaptureRules, TakeASurfaceThatFacesInwardsTurnedOver) {
  SmallCapture small;
  TriangleMesh inwards = test::box_mesh(Vector3::Constant(-0.1), Vector3::Constant(0.1));
  for (auto& triangle : inwards.triangles) std::swap(triangle[0], triangle[1]);
  write_mesh(small.folder / "rest.ply", inwards);
  EXPECT_NEAR(enclosed_volume(*small.read().scene.object.surface), 0.008, 1e-12);
}

TEST(CaptureRules, RefusePartsThatShareAVolume) {
  SmallCapture small;
  TriangleMesh both = test::box_mesh(Vector3::Constant(-0.1), Vector3::Constant(0.1));
  for (const Vector3& vertex : test::box_mesh(Vector3::Constant(-0.05), Vector3::Constant(0.08)).vertices)
    both.vertices.push_back(vertex);
  for (std::size_t t = 0; t < 12; ++t) {
    const auto [a, b, c] = both.triangles[t];
    both.triangles.push_back({a + 8, b + 8, c + 8});
  }
  write_mesh(small.folder / "rest.ply", both);
  EXPECT_THAT(
      complaint_of([&] { (void)small.read(); }),
      AllOf(HasSubstr("`surface` is no solid"), HasSubstr("lies in the part"), HasSubstr("trimesh.boolean.union")));
}

/// A box of +-half, cut into six tetrahedra; `cells` of them.
std::string box_of_tetrahedra(const std::string& half, int cells = 6) {
  std::string text = "# vtk DataFile Version 2.0\nbox\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n";
  for (int n = 0; n < 8; ++n)
    for (int d = 0; d < 3; ++d) text += std::string(n >> d & 1 ? "" : "-") + half + (d < 2 ? " " : "\n");
  text += "CELLS " + std::to_string(cells) + " " + std::to_string(5 * cells) + "\n";
  const char* list[] = {"4 0 1 3 7\n", "4 0 3 2 7\n", "4 0 2 6 7\n", "4 0 6 4 7\n", "4 0 4 5 7\n", "4 0 5 1 7\n"};
  for (int c = 0; c < cells; ++c) text += list[c];
  text += "CELL_TYPES " + std::to_string(cells) + "\n";
  for (int c = 0; c < cells; ++c) text += "10\n";
  return text;
}

TEST(CaptureRules, TakeTetrahedraInPlaceOfASurface) {
  SmallCapture small;
  small.folder.write("rest.vtk", box_of_tetrahedra("0.1"));
  small.edit("surface = \"rest.ply\"", "volume_mesh = \"rest.vtk\"");
  const Capture capture = small.read();
  ASSERT_TRUE(capture.scene.object.volume && capture.scene.object.surface);
  EXPECT_EQ(capture.scene.object.volume->tets.size(), 6u);
  EXPECT_EQ(capture.scene.object.surface->triangles.size(), 12u);
  EXPECT_NEAR(enclosed_volume(*capture.scene.object.surface), 0.008, 1e-9);  // the file has single precision
  EXPECT_NE(capture.sha256, SmallCapture().read().sha256);
}

TEST(CaptureRules, RefuseTetrahedraThatAreNoSolid) {
  SmallCapture small;
  small.edit("surface = \"rest.ply\"", "volume_mesh = \"rest.vtk\"");
  const auto complaint = [&](const std::string& content) {
    small.folder.write("rest.vtk", content);
    return complaint_of([&] { (void)small.read(); });
  };
  EXPECT_THAT(complaint(box_of_tetrahedra("100")), AllOf(HasSubstr("capture.toml:5"), HasSubstr("divide by 1000")));
  std::string broken = box_of_tetrahedra("0.1");
  broken.replace(broken.find("4 0 1 3 7"), 9, "4 0 1 3 8");
  EXPECT_THAT(complaint(broken), AllOf(HasSubstr("rest.vtk:15"), HasSubstr("names point 8")));
  // Two elements that touch along one edge.
  std::string touching = box_of_tetrahedra("0.1", 2);
  touching.replace(touching.find("4 0 3 2 7"), 9, "4 0 6 4 7");
  EXPECT_THAT(complaint(touching), HasSubstr("the boundary of `volume_mesh` is no solid"));
}

TEST(CaptureRules, RefuseASurfaceBesideTetrahedra) {
  SmallCapture small;
  small.folder.write("rest.vtk", box_of_tetrahedra("0.1"));
  small.edit("surface = \"rest.ply\"", "surface = \"rest.ply\"\nvolume_mesh = \"rest.vtk\"");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("both `surface` and `volume_mesh`"));
}

TEST(CaptureRules, RefuseASurfaceInMillimetres) {
  SmallCapture small;
  write_mesh(small.folder / "rest.ply", test::box_mesh(Vector3::Constant(-100), Vector3::Constant(100)));
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("divide by 1000 if this one is in millimetres"));
}

TEST(CaptureRules, RefuseAVertexListOutOfRange) {
  SmallCapture small;
  small.folder.write("held.txt", "0\n8\n");
  small.edit("[[plane]]", "[[fixed]]\nvertices = \"held.txt\"\n[[plane]]");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), AllOf(HasSubstr("vertex 8"), HasSubstr("expected 0 to 7")));
}

TEST(CaptureRules, NameTheLineOfABadIndex) {
  SmallCapture small;
  small.folder.write("held.txt", "0\none\n");
  small.edit("[[plane]]", "[[fixed]]\nvertices = \"held.txt\"\n[[plane]]");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("held.txt:2:1: \"one\""));
}

TEST(CaptureRules, RefuseTimesThatDoNotIncrease) {
  SmallCapture small;
  small.folder.write("times.txt", "0\n0.1\n0.1\n0.2\n");
  small.edit("frame_rate = 60.0", "timestamps = \"times.txt\"");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("time 2"));
}

TEST(CaptureRules, RefuseAnotherNumberOfTimes) {
  SmallCapture small;
  small.folder.write("times.txt", "0\n0.1\n0.2\n");
  small.edit("frame_rate = 60.0", "timestamps = \"times.txt\"");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("the timestamps are 3"));
}

TEST(CaptureRules, NameTheLineOfABadTime) {
  SmallCapture small;
  small.folder.write("times.txt", "0\nnan\n");
  small.edit("frame_rate = 60.0", "timestamps = \"times.txt\"");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("times.txt:2:1"));
}

TEST(CaptureRules, RefuseTwoCamerasOfOneName) {
  SmallCapture small;
  small.append(small.text.substr(small.text.find("[[depth]]")));
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("a second camera \"front\""));
}

TEST(CaptureRules, RefuseAnImageOfAnotherDepth) {
  SmallCapture small;
  write_png(small.folder / "front/000002.png", SmallCapture::mask_image(0));
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }),
              AllOf(HasSubstr("front/000002.png"), HasSubstr("16-bit grey")));
}

TEST(CaptureRules, SayThatImagesAreTurned) {
  SmallCapture small;
  small.edit("width = 80\nheight = 60", "width = 60\nheight = 80").edit("cx = 39.5\ncy = 29.5", "cx = 29.5\ncy = 39.5");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("turned by 90 degrees"));
}

/// Images that were written upright, with the camera's size and centre traded, and its pose as it was.
TEST(CaptureRules, SayThatImagesWereTurnedWithTheirIntrinsics) {
  SmallCapture small;
  const auto turned = [](const auto& image) {
    auto upright = image;
    std::swap(upright.width, upright.height);
    for (int v = 0; v < image.height; ++v)
      for (int u = 0; u < image.width; ++u) upright(v, image.width - 1 - u) = image(u, v);
    return upright;
  };
  small.edit("[1, 0, 0, 0], [0, 1, 0, 0]", "[1, 0, 0, 0.3], [0, 1, 0, 0]");
  for (int frame = 0; frame < SmallCapture::frames; ++frame) {
    // The object stands left of the picture's middle: the camera is moved, and so are the images.
    const std::string number = std::to_string(frame);
    Image<std::uint16_t> depth(SmallCapture::width, SmallCapture::height, 2000);
    Image<std::uint8_t> mask(SmallCapture::width, SmallCapture::height);
    for (int v = 22; v < 38; ++v)
      for (int u = 5; u < 21; ++u) depth(u, v) = 900, mask(u, v) = 255;
    write_png(small.folder / ("front/00000" + number + ".png"), turned(depth));
    write_png(small.folder / ("front/mask_00000" + number + ".png"), turned(mask));
  }
  small.edit("width = 80\nheight = 60", "width = 60\nheight = 80").edit("cx = 39.5\ncy = 29.5", "cx = 29.5\ncy = 39.5");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("with images turned by 90 degrees it would"));
}

TEST(CaptureRules, SayThatMasksAreInverted) {
  SmallCapture small;
  for (int frame = 0; frame < SmallCapture::frames; ++frame) {
    Image<std::uint8_t> mask = SmallCapture::mask_image(0.02 * frame * frame);
    for (std::uint8_t& m : mask.pixels) m = std::uint8_t(255 - m);
    write_png(small.folder / ("front/mask_00000" + std::to_string(frame) + ".png"), mask);
  }
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("they look inverted"));
}

TEST(CaptureRules, TakeTheScanForSeenWhereItsPoseIsOffByWhatIsStated) {
  SmallCapture small;
  small.edit("[0, 0, 1, -1]", "[0, 0, 1, -1.03]");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("shows nothing within"));
  small.edit("noise = 0.002", "noise = 0.002\npose_std = { turn = 0.01, shift = 0.02 }");
  EXPECT_EQ(complaint_of([&] { (void)small.read(); }), "");
}

TEST(CaptureRules, RefuseAnotherImageSize) {
  SmallCapture small;
  small.edit("width = 80", "width = 64");
  EXPECT_THAT(
      complaint_of([&] { (void)small.read(); }),
      AllOf(HasSubstr("\"front/000000.png\" has 80 x 60 pixels; expected 64 x 60"), HasSubstr("mask_000000.png")));
}

TEST(CaptureRules, NameTheFramesThatAreMissing) {
  SmallCapture small;
  small.edit("frame_count = 4", "frame_count = 6");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("no file for 2 of 6 frames: 4-5"));
  small.edit("frame_count = 6", "frame_count = 1000000");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }),
              HasSubstr("no file for at least 10000 of 1000000 frames: 4-10003"));
}

TEST(CaptureRules, RefuseAnImageThatIsCutShort) {
  SmallCapture small;
  const auto path = small.folder / "front/000001.png";
  write_file(path, read_file(path).substr(0, 60));
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("cannot be decoded"));
}

TEST(CaptureRules, RefuseACaptureWithoutObservations) {
  SmallCapture small;
  small.text.resize(small.text.find("[[depth]]"));
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("no observation"));
}

const char* const press = R"(
[[press]]
force = [0.0, 0.0, 3.0]
contact = { centre = [0.0, 0.0, -0.1], radius = 0.01 }
probe = { point = [0.0, 0.0, -0.1], normal = [0.0, 0.0, 1.0] }
markers = "markers_rest.csv"
markers_rest = "markers_rest.csv"
)";

const char* const markers = "\n[[markers]]\nrest = \"markers_rest.csv\"\ntrack = \"markers.csv\"\n";

std::string said_of_markers(const std::string& rest, const std::string& track) {
  SmallCapture small;
  if (!rest.empty()) small.folder.write("markers_rest.csv", "id,x,y,z\n" + rest);
  if (!track.empty()) small.folder.write("markers.csv", "frame,id,x,y,z\n" + track);
  return complaint_of([&] { (void)small.append(markers).read(); });
}

TEST(CaptureRules, CheckMarkers) {
  EXPECT_EQ(said_of_markers("", ""), "");
  EXPECT_THAT(said_of_markers("0,0,0,-0.1\n", ""), HasSubstr("markers.csv:3:3: marker \"7\" is not among"));
  EXPECT_THAT(said_of_markers("0,0,0,-100\n7,0,0,0\n", ""), HasSubstr("marker \"0\" at rest lies outside"));
  EXPECT_THAT(said_of_markers("", "4,0,0,0,0\n"), HasSubstr("markers.csv:2:1: frame 4; expected 0 to 3"));
  EXPECT_THAT(said_of_markers("", "0,0,0,0,-100\n1,0,0,80,-100\n"),
              AllOf(HasSubstr("capture.toml"), HasSubstr("away from where they rest (median)")));
}

TEST(CaptureRules, CheckTheRateOfMarkersAgainstTheCaptures) {
  test::C3dWriter track;
  track.labels = {"0", "7"};
  track.units = "m";
  track.rate = 60.0;
  track.frames.assign(2, Points::Constant(2, 3, 0.05));
  const auto said = [&](const char* timing) {
    SmallCapture small;
    small.folder.write("markers.c3d", track.bytes());
    small.folder.write("times.txt", "0\n0.01\n0.02\n0.03\n");
    small.append("\n[[markers]]\nrest = \"markers_rest.csv\"\ntrack = \"markers.c3d\"\n");
    return complaint_of([&] { (void)small.edit("frame_rate = 60.0", timing).read(); });
  };
  EXPECT_EQ(said("frame_rate = 60.0"), "");
  EXPECT_THAT(
      said("frame_rate = 59.94"),
      HasSubstr("\"markers.c3d\" has frames at 60 Hz (POINT:RATE), `frame_rate` is 59.94 Hz; expected one rate"));
  EXPECT_THAT(said("timestamps = \"times.txt\""), HasSubstr("`timestamps` are at 100 Hz"));
  track.rate = 100.0;
  EXPECT_EQ(said("timestamps = \"times.txt\""), "");
  track.rate = 0.0;
  EXPECT_EQ(said("frame_rate = 60.0"), "") << "a file that states no rate contradicts nothing";
}

TEST(CaptureRules, TellFaultsOfASharedFileOnce) {
  SmallCapture small;
  small.folder.write("markers_rest.csv", "id,x,y,z\n0,0,0,bad\n");
  const std::string said = complaint_of([&] { (void)small.append(press).append(press).read(); });
  EXPECT_THAT(said, HasSubstr("markers_rest.csv:2:7"));
  EXPECT_EQ(said.find("markers_rest.csv:2:7"), said.rfind("markers_rest.csv:2:7"));
}

std::string press_with(std::string_view from, std::string_view to) {
  std::string text = press;
  return text.replace(text.find(from), from.size(), to);
}

TEST(CaptureRules, CheckPresses) {
  const auto said = [](const std::string& block) {
    return complaint_of([&] { (void)SmallCapture().append(block).read(); });
  };
  EXPECT_EQ(said(press), "");
  EXPECT_THAT(said(press_with("[0.0, 0.0, 3.0]", "[0.0, 0.0, 0.0]")), HasSubstr("a force of 0 N"));
  EXPECT_THAT(said(press_with("radius = 0.01", "radius = 10")), HasSubstr("a contact radius of 10 m"));
  EXPECT_THAT(said(press_with("[0.0, 0.0, -0.1], radius", "[0.0, 0.0, -0.3], radius")),
              HasSubstr("off the rest surface"));
  EXPECT_THAT(said(press_with("markers_rest =", "role = \"train\"\nmarkers_rest =")),
              HasSubstr("expected \"fit\" or \"test\""));
  EXPECT_THAT(said(press_with("markers = \"markers_rest.csv\"\n", "")), HasSubstr("has no `markers`"));
}

TEST(CaptureRules, SayThatForcesAreTheSensors) {
  std::string forwards = press;
  forwards.replace(forwards.find("markers_rest.csv"), 16, "b.csv");
  forwards.replace(forwards.find("markers_rest.csv"), 16, "a.csv");
  std::string backwards = forwards;
  backwards.replace(backwards.find("0.0, 0.0, 3.0"), 13, "0.0, 0.0, -3.0");
  const auto said = [](const std::string& blocks) {
    SmallCapture small;
    small.folder.write("a.csv", "id,x,y,z\n1,0,0,-0.1\n2,0.02,0,-0.1\n3,0,0.02,-0.1\n4,0,0,0.1\n");
    small.folder.write("b.csv", "id,x,y,z\n1,0,0,-0.09\n2,0.02,0,-0.095\n3,0,0.02,-0.095\n4,0,0,0.099\n");
    return complaint_of([&] { (void)small.append(blocks).read(); });
  };
  EXPECT_EQ(said(forwards), "");
  EXPECT_THAT(said(backwards), AllOf(HasSubstr("move against the force"), HasSubstr("turn it round")));
  EXPECT_THAT(said(backwards + backwards), HasSubstr("under all 2 presses"));
  EXPECT_EQ(said(backwards + forwards), "") << "one against its force is a fault of its own";
}

TEST(CaptureRules, CheckLoads) {
  const auto said = [](const std::string& block) {
    return complaint_of([&] { (void)SmallCapture().append("\n[[load]]\n" + block).read(); });
  };
  EXPECT_EQ(said("mass = 0.1\nat = [0, 0.1, 0]\ncloud = \"load.ply\""), "");
  EXPECT_EQ(said("mass = 0.1\nat = [0, 0.1, 0]\nimages = { front = \"front/000000.png\" }"), "");
  EXPECT_THAT(said("mass = 100\nat = [0, 0.1, 0]\ncloud = \"load.ply\""), HasSubstr("masses are in kilograms"));
  EXPECT_THAT(said("mass = 0.1\nat = [0, 0.1, 0]"), HasSubstr("a load without observation"));
  EXPECT_THAT(said("mass = 0.1\nat = [0, 0.5, 0]\ncloud = \"load.ply\""), HasSubstr("off the rest surface"));
  EXPECT_THAT(said("mass = 0.1\nat = [0, 0.1, 0]\nmarkers = \"markers_rest.csv\""),
              HasSubstr("without `markers_rest`"));
  EXPECT_THAT(said("mass = 0.1\nat = [0, 0.1, 0]\nimages = { back = \"front/000000.png\" }"),
              HasSubstr("no depth camera \"back\""));
}

TEST(CaptureRules, CheckIndentations) {
  const auto said = [](const std::string& from, const std::string& to, const std::string& curve) {
    std::string block =
        "\n[[indentation]]\nprobe = \"ball\"\nradius = 0.01\ncontact = [0, 0, -0.1]\ndirection = [0, 0, 1]\n"
        "curve = \"depths.csv\"\n";
    if (!from.empty()) block.replace(block.find(from), from.size(), to);
    SmallCapture small;
    small.folder.write("depths.csv", curve);
    return complaint_of([&] { (void)small.append(block).read(); });
  };
  const std::string curve = "depth,force,std\n0.001,0.1,0.01\n0.002,0.3,0.01\n";
  EXPECT_EQ(said("", "", curve), "");
  EXPECT_THAT(said("\"ball\"", "\"cone\"", curve), HasSubstr("one of \"ball\", \"punch\""));
  EXPECT_THAT(said("radius = 0.01", "radius = 10", curve), HasSubstr("a probe's radius of 10 m"));
  EXPECT_THAT(said("[0, 0, -0.1]", "[0, 0, -0.3]", curve), HasSubstr("off the rest surface"));
  EXPECT_THAT(said("direction = [0, 0, 1]\n", "", curve), HasSubstr("has no `direction`"));
  EXPECT_THAT(said("", "", "depth,force\n0.001,0.1\n"), HasSubstr("depth,force,std"));
  EXPECT_THAT(said("", "", "depth,force,std\n0.002,0.1,0.01\n0.001,0.1,0.01\n"), HasSubstr("depths in metres from 0"));
  EXPECT_THAT(said("", "", "depth,force,std\n0.002,0.1,0\n"), HasSubstr("depths.csv:2:11"));
}

TEST(CaptureRules, CheckGrips) {
  const auto said = [](const std::string& more) {
    return complaint_of([&] {
      (void)SmallCapture()
          .append("\n[[grip]]\nbox = { min = [-1, 0.09, -1], max = [1, 1, 1] }\ndisplacement = [0, 0.01, 0]\n" + more)
          .read();
    });
  };
  const std::string force = "force = 1.0\nforce_std = 0.01\n";
  EXPECT_EQ(said(force), "");
  EXPECT_THAT(said(""), HasSubstr("a grip without observation"));
  EXPECT_THAT(said("force = 1.0\n"), HasSubstr("`force` without `force_std`"));
  EXPECT_THAT(said("force = 1.0\nforce_std = 0\n"), HasSubstr("a standard deviation above 0"));
  EXPECT_THAT(said(force + "markers = \"markers_rest.csv\"\n"), HasSubstr("all three or none"));
  EXPECT_THAT(said(force + "sphere = { centre = [0, 0, 0], radius = 1 }\n"), HasSubstr("2 regions in one block"));
  EXPECT_THAT(said(force + "role = \"train\"\n"), HasSubstr("expected \"fit\" or \"test\""));
}

TEST(CaptureRules, CheckMaterialCurves) {
  const auto said = [](const std::string& block, const std::string& curve) {
    test::TemporaryFolder folder;
    folder.write("curve.csv", curve);
    folder.write("capture.toml",
                 "format = \"capture/1\"\nname = \"rubber\"\n[[material_curve]]\ncurve = \"curve.csv\"\n" + block);
    return complaint_of([&] { (void)read_capture(folder.path()); });
  };
  const std::string curve = "stretch,stress,std\n1.1,1000,10\n";
  EXPECT_EQ(said("mode = \"uniaxial\"\n", curve), "") << "neither shape nor gravity is asked for";
  EXPECT_THAT(said("mode = \"torsion\"\n", curve), HasSubstr("\"simple_shear\""));
  EXPECT_THAT(said("mode = \"biaxial\"\n", curve), HasSubstr("stretch,second,stress,std"));
  EXPECT_THAT(said("mode = \"uniaxial\"\nprestretch = 1.1\n", curve), HasSubstr("of another test"));
  EXPECT_THAT(said("mode = \"uniaxial\"\n", "stretch,stress,std\n1,1000,10\n15,15000,10\n30,30000,10\n"),
              AllOf(HasSubstr("stretches up to 30"), HasSubstr("percents")));
  EXPECT_THAT(said("mode = \"uniaxial\"\n", "stretch,stress,std\n0.1,1000,10\n0.2,2000,10\n0.3,3000,10\n"),
              HasSubstr("stretches below 1"));
  EXPECT_EQ(said("mode = \"uniaxial\"\n", "stretch,stress,std\n0.8,-1000,10\n0.99,50,10\n1.3,3000,10\n"), "");
  EXPECT_THAT(said("mode = \"uniaxial\"\n", "stretch,stress,std\n-0.1,1000,10\n"), HasSubstr("curve.csv:2:1"));
  EXPECT_EQ(said("mode = \"simple_shear\"\n", "stretch,stress,std\n-0.1,-1000,10\n"), "");
  EXPECT_THAT(said("mode = \"uniaxial\"\n", "stretch,stress,std\n1.1,0,10\n"), HasSubstr("all zero"));
}

TEST(CaptureRules, CheckRelease) {
  const auto said = [](const std::string& block) {
    return complaint_of([&] { (void)SmallCapture().append("\n[initial]\n" + block).read(); });
  };
  const std::string good = "release_of = { mass = 0.1, at = [0, 0.1, 0] }";
  EXPECT_EQ(said("released = true\n" + good), "");
  EXPECT_THAT(said(good), HasSubstr("`release_of` without `released`"));
  EXPECT_THAT(said("released = true\nrelease_of = { mass = 0, at = [0, 0.1, 0] }"),
              HasSubstr("an attached point mass of 0 kg"));
  EXPECT_THAT(said("released = true\nrelease_of = { mass = 100, at = [0, 0.1, 0] }"),
              HasSubstr("masses are in kilograms"));
  EXPECT_THAT(said("released = true\nrelease_of = { mass = 0.1, at = [0, 0.5, 0] }"),
              HasSubstr("off the rest surface"));
  EXPECT_THAT(said("released = true\nrelease_of = { mass = 0.1 }"), HasSubstr("at"));
  EXPECT_THAT(said("released = true\nrelease_of = { mass = 0.1, at = [0, 0.1, 0], force = 3 }"),
              HasSubstr("unknown key `force`"));
  EXPECT_THAT(said("released = true\nrelease_of = 0.1"), HasSubstr("release_of"));
  SmallCapture weightless;
  weightless.edit("[0.0, 9.81, 0.0]", "[0.0, 0.0, 0.0]").append("\n[initial]\nreleased = true\n" + good);
  EXPECT_THAT(complaint_of([&] { (void)weightless.read(); }), HasSubstr("an attached weight without gravity"));
  SmallCapture small;
  const Capture capture = small.append("\n[initial]\nreleased = true\n" + good).read();
  ASSERT_TRUE(capture.scene.initial.release_of);
  EXPECT_EQ(capture.scene.initial.release_of->mass, 0.1);
  EXPECT_EQ(capture.scene.initial.release_of->at, Vector3(0, 0.1, 0));
}

TEST(CaptureRules, CheckWeights) {
  const auto said = [](const std::string& block) {
    return complaint_of([&] { (void)SmallCapture().append("\n[[weight]]\n" + block).read(); });
  };
  EXPECT_EQ(said("mass = 0.1\nat = [0, 0.1, 0]"), "");
  EXPECT_THAT(said("mass = 0\nat = [0, 0.1, 0]"), HasSubstr("an attached point mass of 0 kg"));
  EXPECT_THAT(said("mass = 100\nat = [0, 0.1, 0]"), HasSubstr("masses are in kilograms"));
  EXPECT_THAT(said("mass = 0.1\nat = [0, 0.5, 0]"), HasSubstr("off the rest surface"));
  EXPECT_THAT(said("mass = 0.1"), HasSubstr("at"));
  EXPECT_THAT(said("mass = 0.1\nat = [0, 0.1, 0]\nforce = 3"), HasSubstr("unknown key `force`"));
  SmallCapture small;
  const Capture capture = small.append("\n[[weight]]\nmass = 0.1\nat = [0, 0.1, 0]\n").read();
  ASSERT_EQ(capture.scene.weights.size(), 1u);
  EXPECT_EQ(capture.scene.weights[0].mass, 0.1);
  EXPECT_EQ(capture.scene.weights[0].at, Vector3(0, 0.1, 0));
}

TEST(CaptureRules, CheckClouds) {
  SmallCapture small;
  small.append("\n[[cloud]]\npoints = \"clouds/%d.ply\"\nevery = 3\n");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("\"clouds/0.ply\", nor for any other"));
  for (const int frame : {0, 3})
    write_points(small.folder / ("clouds/" + std::to_string(frame) + ".ply"), std::vector<Vector3>{{0, 0, 0}});
  EXPECT_EQ(complaint_of([&] { (void)small.read(); }), "");
  write_points(small.folder / "clouds/3.ply", std::vector<Vector3>{{0, 0, 900}});
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("no point near the rest surface"));
  small.folder.write("clouds/3.ply", "solid\n");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("clouds/3.ply"));
}

TEST(FramesOf, CountsFromZero) {
  EXPECT_THAT(frames_of(5, 2), ElementsAre(0, 2, 4));
  EXPECT_THAT(frames_of(1, 3), ElementsAre(0));
  EXPECT_THAT(frames_of(0, 1), SizeIs(0));
}

TEST(RangesText, JoinsRunsAndCountsTheRest) {
  EXPECT_EQ(ranges_text(std::vector{3, 7, 8, 9, 12}), "3, 7-9, 12");
  std::vector<int> odd;
  for (int i = 1; i < 40; i += 2) odd.push_back(i);
  EXPECT_THAT(ranges_text(odd), HasSubstr(", and 12 more"));
}

}  // namespace
}  // namespace pliant::capture_rules_test
