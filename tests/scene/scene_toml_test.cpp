#include "scene/scene_toml.hpp"

#include <Eigen/Geometry>
#include <sstream>

#include "geometry/meshes.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::scene_toml_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

// Reads all of a scene but its object, as a recording does.
Scene read_scene(const TemporaryFolder& folder, const std::string& text, bool may_pull = false) {
  const std::filesystem::path file = folder.write("scene.toml", text);
  const toml::table table = parse_toml(text, file);
  TomlContext context{TomlPlaces(file), {}, {}};
  const NamedFiles files{folder.path()};
  Scene scene;
  scene.object.surface = test::box_mesh(Vector3::Zero(), Vector3::Ones());
  TomlTable root(table, "", context);
  root.with_table("world", [&](TomlTable& world) { scene.world = read_world(world); });
  root.with_table("timing", [&](TomlTable& timing) { scene.timing = read_timing(timing, files); });
  root.with_table("initial", [&](TomlTable& initial) { scene.initial = read_initial(initial, may_pull); });
  root.each_block("plane", [&](TomlTable& block) { scene.planes.push_back(read_plane(block)); });
  root.each_block("fixed", [&](TomlTable& block) { scene.fixed.push_back(read_fixed(block, files)); });
  root.each_block("region", [&](TomlTable& block) { scene.regions.push_back(read_material_region(block, files)); });
  root.each_block("control", [&](TomlTable& block) { scene.controls.push_back(read_material_control(block, files)); });
  root.each_block("weight", [&](TomlTable& block) { scene.weights.push_back(read_weight(block)); });
  root.finish();
  check_vertex_lists(context, scene);
  check_materials(context, scene);
  context.throw_problems();
  return scene;
}

Scene written_and_read(const Scene& scene) {
  const TemporaryFolder folder;
  std::ostringstream text;
  write_toml(text, scene.world);
  if (!scene.timing.times.empty()) write_toml(text, scene.timing);
  write_toml(text, scene.initial);
  write_toml_blocks(text, scene);
  write_scene_files(folder.path(), scene);
  return read_scene(folder, text.str(), true);
}

Scene full_scene() {
  Scene scene;
  scene.world.gravity = Vector3(0.1, -9.81, 1.0 / 3.0);
  scene.world.up = -scene.world.gravity->normalized();
  scene.timing = evenly_timed(59.94, 7, 2);
  scene.initial = {{0, -2.1, 0},
                   {0.1, 0.2, 1.0 / 3.0},
                   false,
                   true,
                   {{1, 2, 3}, {0.1, 0, 0}},
                   {{0, 0, 1.0 / 3.0}, {4, 5, 6}},
                   Weight{0.02, {0, 1, 0}}};
  scene.planes = {{{0, 0.1, 0}, {0.6, 0.8, 0}, false}, {}};
  scene.fixed = {{RegionBox{{-1, -1, -1}, {0.01, 1, 1}}, std::nullopt},
                 {RegionSphere{{0, 0, 1}, 0.02},
                  RigidMotion{Eigen::AngleAxisd(0.3, Vector3::UnitX()).toRotationMatrix(), {1, 2, 3}}},
                 {RegionVertices{{3, 1, 4}}, std::nullopt}};
  scene.regions = {{"red \"half\"", RegionHalfSpace{{0, 0, 0}, {1, 0, 0}}}, {"corner", RegionVertices{{7}}}};
  scene.weights = {{0.05, {0.01, -0.06, 0.15}}, {0.1, {1, 1, 1}}};
  return scene;
}

TEST(SceneToml, ComesBackAsItWasWritten) {
  const Scene scene = full_scene(), read = written_and_read(scene);
  EXPECT_EQ(read.world, scene.world);
  EXPECT_EQ(read.timing, scene.timing);
  EXPECT_EQ(read.initial, scene.initial);
  EXPECT_EQ(read.planes, scene.planes);
  ASSERT_EQ(read.fixed.size(), scene.fixed.size());
  EXPECT_EQ(read.fixed[0], scene.fixed[0]);
  EXPECT_EQ(read.fixed[2], scene.fixed[2]);
  EXPECT_EQ(read.fixed[1].region, scene.fixed[1].region);
  const RigidMotion &is = *read.fixed[1].displaced_to, &was = *scene.fixed[1].displaced_to;
  EXPECT_LT((is.rotation - was.rotation).norm(), 1e-14) << "a rotation is made orthonormal again";
  EXPECT_EQ(is.translation, was.translation);
  EXPECT_EQ(read.regions, scene.regions);
  EXPECT_EQ(read.weights, scene.weights);
}

TEST(SceneToml, EachPullHasItsPlace) {
  const TemporaryFolder folder;
  const std::string text = "[initial]\nreleased = true\npulls = [[1,0,0],[0,1,0]]\npulled_at = [[0,0,1]]";
  EXPECT_THAT(test::complaint_of([&] { read_scene(folder, text, true); }),
              testing::HasSubstr("`pulled_at` with 1 places; expected one for each of 2 `pulls`"));
}

TEST(SceneToml, ControlPointsComeBack) {
  Scene scene;
  scene.controls = {{"foot", {0, 0.1, 1.0 / 3.0}}, {"tip", {0, 1, 0}}};
  EXPECT_EQ(written_and_read(scene).controls, scene.controls);
  EXPECT_THAT(named_moduli(scene), testing::ElementsAre("youngs_modulus@foot", "youngs_modulus@tip"));
  scene.controls = {{"foot", Vector3::Zero(), {1, 0, 0.1, 1, 1, 1, 1, 1.0 / 3.0}},
                    {"tip", Vector3::Zero(), {0, 1, 1, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(written_and_read(scene).controls, scene.controls);
}

TEST(SceneToml, UnevenTimesAndLooksAtOneEquilibriumComeBack) {
  Scene scene;
  scene.timing.times = {0.0, 0.1, 1.0 / 3.0};
  scene.timing.is_static = true;
  EXPECT_EQ(written_and_read(scene).timing, scene.timing);
}

TEST(SceneToml, UpIsWrittenWhereGravityDoesNotTellIt) {
  Scene scene;
  scene.world.up = Vector3(0.6, 0.0, 0.8);
  EXPECT_EQ(written_and_read(scene).world, scene.world) << "unknown gravity";
  scene.world.gravity = Vector3::Zero();
  EXPECT_EQ(written_and_read(scene).world, scene.world) << "no gravity";
  scene.world.gravity = Vector3(0.0, 0.0, -9.81);
  EXPECT_EQ(written_and_read(scene).world, scene.world) << "a world that stands askew";
}

struct Wrong {
  const char *name, *text, *said;
};

class WrongScene : public testing::TestWithParam<Wrong> {};

TEST_P(WrongScene, IsToldWithItsPlace) {
  const TemporaryFolder folder;
  folder.write("listed.txt", "0\n 1 \n\nfour\n");
  folder.write("beyond.txt", "0\n8\n");
  folder.write("times.txt", "0.0\n0.1\n");
  folder.write("late.txt", "0.0\nlate\n");
  folder.write("empty.txt", "\n");
  folder.write("eight.txt", "1\n0\n1\n1\n1\n1\n1\n1\n");
  folder.write("negative.txt", "1\n-1\n");
  EXPECT_THAT(complaint_of([&] { read_scene(folder, GetParam().text); }), HasSubstr(GetParam().said));
}

INSTANTIATE_TEST_SUITE_P(
    All, WrongScene,
    testing::Values(
        Wrong{"NoRegion", "[[fixed]]\n", "scene.toml:1:1: no region; expected one of `box`"},
        Wrong{
            "TwoRegions",
            "[[fixed]]\nsphere = { centre = [0,0,0], radius = 1 }\nhalf_space = { point = [0,0,0], normal = [1,0,0] }",
            "2 regions in one block"},
        Wrong{"BoxInsideOut", "[[fixed]]\nbox = { min = [1,0,0], max = [0,1,1] }", "scene.toml:2:7: a box whose `min`"},
        Wrong{"CountBelowAll", "[timing]\nframe_rate = 10\nframe_count = 9\nstart_frame = -9223372036854775808",
              "scene.toml:4:1: `start_frame` is -9223372036854775808; expected a smaller number"},
        Wrong{"Radius", "[[fixed]]\nsphere = { centre = [0,0,0], radius = 0 }", "`radius` is 0; expected above 0"},
        Wrong{"Normal", "[[plane]]\npoint = [0,0,0]\nnormal = [0,0,0]",
              "scene.toml:3:1: `normal` is a direction without"},
        Wrong{"Up", "[world]\nup = [0,0,0]", "scene.toml:2:1: `up` is a direction without length"},
        Wrong{"ListedText", "[[fixed]]\nvertices = \"listed.txt\"",
              "listed.txt:4:1: \"four\"; expected one vertex index"},
        Wrong{"ListedBeyond", "[[fixed]]\nvertices = \"beyond.txt\"",
              "scene.toml:2:1: vertex 8 in the list; expected 0 to 7"},
        Wrong{"ListMissing", "[[region]]\nname = \"a\"\nvertices = \"none.txt\"",
              "scene.toml:3:1: the file \"none.txt\" is"},
        Wrong{"RegionWithoutName", "[[region]]\nsphere = { centre = [0,0,0], radius = 1 }", "has no `name`"},
        Wrong{"RegionBeyond", "[[region]]\nname = \"a\"\nsphere = { centre = [9,9,9], radius = 1 }",
              "scene.toml:1:1: no point of the object lies in region"},
        Wrong{"ControlOfNothing", "[[control]]\nname = \"a\"", "neither `point` nor `weights`"},
        Wrong{"OneControl", "[[control]]\nname = \"a\"\npoint = [0,0,0]", "one control point; expected two"},
        Wrong{"ControlsOfOneName",
              "[[control]]\nname = \"a\"\npoint = [0,0,0]\n[[control]]\nname = \"a\"\npoint = [1,0,0]",
              "scene.toml:5:1: a second control point"},
        Wrong{"ControlNamedAsAParameter",
              "[[control]]\nname = \"a@b\"\npoint = [0,0,0]\n[[control]]\nname = \"a\"\npoint = [1,0,0]",
              "expected a name without @"},
        Wrong{"ControlsOfTwoKinds",
              "[[control]]\nname = \"a\"\npoint = [0,0,0]\n[[control]]\nname = \"b\"\nweights = \"eight.txt\"",
              "control points with `point` and with `weights`"},
        Wrong{"ControlsAndRegions",
              "[[control]]\nname = \"a\"\npoint = [0,0,0]\n[[region]]\nname = \"b\"\nsphere = { centre = [0,0,0], "
              "radius = 1 }",
              "both [[control]] and [[region]]"},
        Wrong{"TooFewWeights",
              "[[control]]\nname = \"a\"\nweights = \"times.txt\"\n[[control]]\nname = \"b\"\nweights = \"times.txt\"",
              "2 weights; expected 8, one for each vertex"},
        Wrong{"NoWeight",
              "[[control]]\nname = \"a\"\nweights = \"eight.txt\"\n[[control]]\nname = \"b\"\nweights = \"eight.txt\"",
              "no weight at vertex 1 of the surface"},
        Wrong{"NegativeWeight", "[[control]]\nname = \"a\"\nweights = \"negative.txt\"",
              "negative.txt:2:1: \"-1\"; expected one weight from 0"},
        Wrong{"BothTimings", "[timing]\nframe_rate = 1.0\ntimestamps = \"times.txt\"",
              "both `frame_rate` and `timestamps`"},
        Wrong{"NoTiming", "[timing]\nframe_count = 2", "neither `frame_rate` nor `timestamps`"},
        Wrong{"NoCount", "[timing]\nframe_rate = 2.0", "has no `frame_count`"},
        Wrong{"CountZero", "[timing]\nframe_rate = 2.0\nframe_count = 0", "`frame_count` is 0; expected 1 to 10000000"},
        Wrong{"RateZero", "[timing]\nframe_rate = 0.0\nframe_count = 2",
              "scene.toml:2:1: a frame rate of 0 Hz; expected above"},
        Wrong{"CountOfTimes", "[timing]\ntimestamps = \"times.txt\"\nframe_count = 3",
              "scene.toml:3:1: `frame_count` is 3, the"},
        Wrong{"TimeIsText", "[timing]\ntimestamps = \"late.txt\"",
              "late.txt:2:1: \"late\"; expected one time in seconds"},
        Wrong{"NoTimes", "[timing]\ntimestamps = \"empty.txt\"", "empty.txt: no times"},
        Wrong{"WeightWithoutMass", "[[weight]]\nat = [0,0,0]", "has no `mass`"},
        Wrong{"PullsOfModelsAlone", "[initial]\npulls = [[1,0,0]]", "the unknown key `pulls`"},
        Wrong{"Misspelt", "[initial]\nrelaesed = true", "did you mean `released`"}),
    [](const auto& wrong) { return wrong.param.name; });

TEST(SceneToml, ProblemsComeInTheOrderOfTheFileThoseOfOtherFilesLast) {
  const TemporaryFolder folder;
  folder.write("listed.txt", "four\n");
  const std::string text =
      "[[fixed]]\nvertices = \"listed.txt\"\n[world]\nup = [0,0,0]\n[[plane]]\npoint = [0,0,0]\nnormal = 3\n";
  try {
    read_scene(folder, text);
    FAIL();
  } catch (const InputError& error) {
    ASSERT_EQ(error.problems().size(), 3u);
    EXPECT_EQ(error.problems()[0].place.line, 4);
    EXPECT_EQ(error.problems()[1].place.line, 7);
    EXPECT_EQ(error.problems()[2].place.file.filename(), "listed.txt");
  }
}

TEST(SceneToml, AFolderThatIsMovedStaysWhole) {
  const TemporaryFolder folder;
  const std::string text = "vertices = \"" + folder.write("listed.txt", "0\n").string() + "\"\n";
  const toml::table table = parse_toml(text, "scene.toml");
  const auto said = [&](bool only_relative) {
    TomlContext context{TomlPlaces("scene.toml"), {}, {}};
    TomlTable root(table, "", context);
    read_region(root, {folder.path(), only_relative});
    return complaint_of([&] { context.throw_problems(); });
  };
  EXPECT_EQ(said(false), "");
  EXPECT_THAT(said(true), AllOf(HasSubstr("the absolute path"), HasSubstr("a path relative to the folder")));
}

}  // namespace
}  // namespace pliant::scene_toml_test
