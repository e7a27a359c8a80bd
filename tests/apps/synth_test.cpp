// What `pliant synth` makes of the facts that scenes share with captures: regions, weights, releases, listed vertices.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "capture/capture.hpp"
#include "geometry/mesh_io.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::synth_test {
namespace {

using testing::HasSubstr;

constexpr int frames = 10, start = 2;

// A bar along x that is held at its low end and bends under its weight.
const std::string bar = R"toml(format = "scene/1"
name = "bar"
truth_trajectory = true
[object]
box = { size = [0.2, 0.04, 0.04], facet = 0.02 }
density = 200.0
[material]
youngs_modulus = 2e5
poissons_ratio = 0.3
mass_damping = 0.2
stiffness_damping = 0.002
[world]
gravity = [0.0, -9.81, 0.0]
[timing]
frame_rate = 60.0
frame_count = 10
start_frame = 2
[simulation]
cell_size = 0.02
substeps = 8
newmark_theta = 0.6
[[camera]]
name = "front"
width = 48
height = 32
eye = [0.0, 0.1, 0.5]
target = [0.0, 0.0, 0.0]
)toml";
const std::string held = "[[fixed]]\nhalf_space = { point = [-0.09, 0, 0], normal = [-1, 0, 0] }\n";

struct Recorded {
  Capture capture;
  nlohmann::json truth;
  std::vector<double> tip;  ///< [m] height of the free end in each frame
};

Recorded recorded(const TemporaryFolder& folder, const std::string& scene) {
  const std::string out = folder / "capture";
  std::filesystem::remove_all(out);
  const ProgramRun run = run_pliant({"synth", folder.write("scene.toml", scene), "--out", out});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  if (run.exit_code != 0) return {};
  Recorded made{read_capture(out), nlohmann::json::parse(read_file(out + "/truth.json")), {}};
  const TriangleMesh rest = *made.capture.scene.object.surface;
  for (int frame = 0; frame < frames; ++frame) {
    const TriangleMesh now = read_mesh(out + "/truth/00000" + std::to_string(frame) + ".ply");
    double height = 0.0, count = 0.0;
    for (std::size_t v = 0; v < rest.vertices.size(); ++v)
      if (rest.vertices[v].x() > 0.099) height += now.vertices[v].y(), ++count;
    made.tip.push_back(height / count);
  }
  return made;
}

TEST(Synth, SharesAScenesFactsWithCaptures) {
  const TemporaryFolder folder;
  const Recorded plain = recorded(folder, bar + held);
  ASSERT_EQ(plain.tip.size(), std::size_t(frames));
  EXPECT_NEAR(plain.tip[start], 0.0, 1e-6) << "it begins stress-free";
  EXPECT_LT(plain.tip.back(), -1e-3) << "and sinks";

  const Recorded hung = recorded(folder, bar + held + "[[weight]]\nmass = 0.02\nat = [0.1, 0, 0]\n");
  EXPECT_LT(hung.tip.back(), plain.tip.back() - 5e-4);
  EXPECT_EQ(hung.capture.scene.weights.size(), 1u);

  const Recorded soft =
      recorded(folder, bar + held +
                           "[[region]]\nname = \"root\"\nhalf_space = { point = [0, 0, 0], normal = [-1, 0, 0] }\n"
                           "youngs_modulus = 2e4\n");
  EXPECT_LT(soft.tip.back(), plain.tip.back() - 5e-4);
  EXPECT_EQ(soft.truth["parameters"]["youngs_modulus@root"]["value"], 2e4);
  EXPECT_EQ(soft.truth["parameters"]["youngs_modulus"]["value"], 2e5);
  ASSERT_EQ(soft.capture.scene.regions.size(), 1u);
  EXPECT_EQ(soft.capture.scene.regions[0].name, "root");

  std::string blended = bar;
  const std::string own = "youngs_modulus = 2e5\n";
  ASSERT_NE(blended.find(own), std::string::npos);
  blended.erase(blended.find(own), own.size());
  const std::string points =
      "[[control]]\nname = \"root\"\npoint = [-0.1, 0, 0]\nyoungs_modulus = 2e4\n"
      "[[control]]\nname = \"tip\"\npoint = [0.1, 0, 0]\nyoungs_modulus = 2e5\n";
  const Recorded graded = recorded(folder, blended + held + points);
  EXPECT_LT(graded.tip.back(), plain.tip.back() - 2e-4) << "softer at the root";
  EXPECT_EQ(graded.truth["parameters"]["youngs_modulus@tip"]["value"], 2e5);
  EXPECT_FALSE(graded.truth["parameters"].contains("youngs_modulus"));
  ASSERT_EQ(graded.capture.scene.controls.size(), 2u);
  EXPECT_EQ(graded.capture.scene.controls[0].point, Vector3(-0.1, 0, 0));

  const Recorded freed =
      recorded(folder, bar + held + "[initial]\nreleased = true\nrelease_of = { mass = 0.02, at = [0.1, 0, 0] }\n");
  ASSERT_TRUE(freed.capture.scene.initial.release_of);
  EXPECT_LT(freed.tip[start], -5e-3) << "it begins bent";
  EXPECT_EQ(freed.tip[0], freed.tip[start]) << "and is held there before";
  EXPECT_GT(freed.tip.back(), freed.tip[start] + 1e-3) << "and swings up once the string is cut";
}

TEST(Synth, HoldsListedVertices) {
  const TemporaryFolder folder;
  std::string low;
  const Recorded loose = recorded(folder, bar);
  const TriangleMesh rest = *loose.capture.scene.object.surface;
  for (std::size_t v = 0; v < rest.vertices.size(); ++v)
    if (rest.vertices[v].x() < -0.099) low += std::to_string(v) + "\n";
  folder.write("low.txt", low);
  const Recorded listed = recorded(folder, bar + "[[fixed]]\nvertices = \"low.txt\"\n");
  const double fall = 0.5 * 9.81 * std::pow((frames - 1 - start) / 60.0, 2);
  EXPECT_NEAR(loose.tip.back(), -fall, 0.05 * fall) << "nothing holds it";
  EXPECT_GT(listed.tip.back(), -0.8 * fall);
  EXPECT_EQ(std::get<RegionVertices>(listed.capture.scene.fixed.at(0).region).indices.size(),
            std::size_t(std::count(low.begin(), low.end(), '\n')));
}

TEST(Synth, RefusesHalfARelease) {
  const TemporaryFolder folder;
  const auto said = [&](const std::string& more) {
    return run_pliant({"synth", folder.write("scene.toml", bar + held + more), "--out", folder / "never"}).err;
  };
  EXPECT_THAT(said("[initial]\nreleased = true\n"), HasSubstr("`released` without `release_of` or `pulled`"));
  EXPECT_THAT(said("[[region]]\nname = \"a\"\nsphere = { centre = [9, 9, 9], radius = 1 }\nyoungs_modulus = 1.0\n"),
              HasSubstr("no point of the object lies in region \"a\""));
  EXPECT_THAT(said("[[weight]]\nmass = 0.0\nat = [0, 0, 0]\n"), HasSubstr("`mass` is 0; expected above 0"));
  EXPECT_FALSE(std::filesystem::exists(folder / "never"));
}

TEST(Synth, MakesTheExamples) {
  const TemporaryFolder folder;
  const auto made = [&](const std::string& name) {
    const std::string scene = PLIANT_SOURCE_DIR "/examples/" + name + "/scene.toml";
    const ProgramRun run = run_pliant({"synth", scene, "--out", folder / name});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const ProgramRun check = run_pliant({"check", folder / name});
    EXPECT_EQ(check.exit_code, 0) << check.err;
    return check.out;
  };
  const std::string released = made("released-bar");
  for (const char* part : {"released from a held, deformed pose", "clouds/%06d.ply", "2, of them 2 for test only"})
    EXPECT_THAT(released, HasSubstr(part));
  const std::string block = made("pressed-block");
  for (const char* part : {"4, of them 1 for test only", "60 under 4 presses and loads"})
    EXPECT_THAT(block, HasSubstr(part));
}

TEST(Plan, SaysWhatARecordingOfASceneWouldTell) {
  const TemporaryFolder folder;
  const std::string out = folder / "plan";
  const ProgramRun run = run_pliant({"check", "--plan", PLIANT_TEST_SCENE, "--out", out});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* word : {"90 % intervals", "youngs_modulus", "stiffness_damping", "most of it from"})
    EXPECT_THAT(run.out, HasSubstr(word));
  const auto plan = nlohmann::json::parse(read_file(out + "/plan.json"));
  const auto& modulus = plan.at("parameters").at("youngs_modulus");
  const double low = modulus.at("interval_90").at(0), high = modulus.at("interval_90").at(1);
  EXPECT_LT(low, 3000.0);
  EXPECT_GT(high, 3000.0);
  EXPECT_LT(high / low, 3.0) << "the recording tells something";
  EXPECT_FALSE(modulus.at("largest_cause").get<std::string>().empty());
  EXPECT_NO_THROW((void)read_capture(out)) << "the synthetic recording is there to look at";
}

TEST(Plan, IsAskedForInsteadOfACapture) {
  const ProgramRun neither = run_pliant({"check"});
  EXPECT_EQ(neither.exit_code, 2);
  EXPECT_THAT(neither.err, HasSubstr("--plan"));
  EXPECT_EQ(run_pliant({"check", "somewhere", "--plan", PLIANT_TEST_SCENE}).exit_code, 2);
  const ProgramRun missing = run_pliant({"check", "--plan", "nowhere.toml"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("nowhere.toml"));
}

}  // namespace
}  // namespace pliant::test::synth_test
