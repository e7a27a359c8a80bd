// One user's session on a layer over a rigid core: a scan of the skin, presses with known truth, and what a fit that
// knows nothing of the core would say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::inner_app_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr double truth = 20000.0;  // [Pa]

// A ball of 0.1 m with a rigid core of 0.06 m.
const std::string scene = R"toml(format = "scene/1"
name = "shell on a core"
[object]
sphere = { radius = 0.05, subdivisions = 4 }
density = 200.0
[material]
youngs_modulus = 20000.0
poissons_ratio = 0.3
[world]
gravity = [0.0, -9.81, 0.0]
[simulation]
cell_size = 0.0166666666666667
element = "tetrahedra"
[markers]
count = 80
half_space = { point = [0, 0, 0], normal = [0, 1, 0] }
noise = 1e-5
[[press]]
at = [0, 0.05, 0]
radius = 0.014
depth = 0.003
[[press]]
at = [0.035355, 0.035355, 0]
radius = 0.014
depth = 0.004
[[press]]
at = [0, 0.035355, 0.035355]
radius = 0.014
depth = 0.003
role = "test"
[[indentation]]
probe = "ball"
radius = 0.02
contact = [-0.035355, 0.035355, 0]
depths = [0.001, 0.002, 0.003]
force_noise = 0.01
role = "test"
)toml";

const std::string held = "[[fixed]]\nhalf_space = { point = [0, -0.03, 0], normal = [0, -1, 0] }\n";

std::string inner(const char* contact) {
  return std::string("[[inner]]\nsurface = \"core.obj\"\ncontact = \"") + contact + "\"\n";
}

/// By the elements that made the recording, so that the truth's own error is the fit's.
ProgramRun fit(const std::string& capture, const std::string& out, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {"fit", capture, "--out", out};
  for (const char* choice :
       {"element=tetrahedra", "cells=6", "material=neo_hookean", "law_zones=1", "control_points=1"})
    arguments.insert(arguments.end(), {"--set", choice});
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_pliant(arguments);
}

double modulus_of(const std::string& out) {
  return json::parse(read_file(out + "/result.json"))["parameters"]["youngs_modulus"]["value"].get<double>();
}

struct OnACore : ::testing::TestWithParam<const char*> {};

TEST_P(OnACore, TheTruthIsFoundAndPredicts) {
  const bool is_glued = std::string(GetParam()) == "glued";
  const TemporaryFolder folder;
  write_mesh(folder / "core.obj", make_sphere(0.03, 3));
  const std::string capture = folder / "capture", out = folder / "out";
  const ProgramRun synth = run_pliant(
      {"synth", folder.write("scene.toml", scene + inner(GetParam()) + (is_glued ? "" : held)), "--out", capture});
  ASSERT_EQ(synth.exit_code, 0) << synth.err;
  EXPECT_EQ(read_mesh(capture + "/rest.ply").vertices.size(), make_sphere(0.05, 4).vertices.size()) << "the skin alone";
  const ProgramRun check = run_pliant({"check", capture});
  ASSERT_EQ(check.exit_code, 0) << check.err;
  EXPECT_THAT(check.out, HasSubstr("1 rigid body"));

  const ProgramRun found = fit(capture, out);
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_NEAR(std::log(modulus_of(out) / truth), 0.0, 0.03) << found.out;
  EXPECT_TRUE(std::filesystem::exists(out + "/inner_0.ply"));
  EXPECT_EQ(std::filesystem::exists(out + "/live.html"), is_glued) << "pages know held nodes, not sliding bodies";

  const ProgramRun judged = run_pliant({"evaluate", out + "/model.toml", capture, "-o", folder / "judged.json"});
  ASSERT_EQ(judged.exit_code, 0) << judged.err;
  const json figures = json::parse(read_file(folder / "judged.json"));
  EXPECT_LT(figures["presses"][2]["relative_error"].get<double>(), 0.03);

  // What the truth's own probing says, another probe of the model says.
  const ProgramRun press = run_pliant({"press", out + "/model.toml", "--contact", "0,0.05,0", "--move", "0,-0.004,0",
                                       "--probe", "ball", "--radius", "0.015", "--steps", "2"});
  EXPECT_EQ(press.exit_code, 0) << press.err;

  // As if there were no core: the object seems much stiffer than it is.
  std::string ignorant = read_file(capture + "/capture.toml");
  const auto at = ignorant.find("[[inner]]"), end = ignorant.find("[[", at + 2);
  ASSERT_NE(at, std::string::npos);
  ignorant.erase(at, end - at);
  if (is_glued) ignorant += held;
  folder.write("capture/capture.toml", ignorant);
  const ProgramRun wrong = fit(capture, folder / "wrong");
  ASSERT_EQ(wrong.exit_code, 0) << wrong.err;
  EXPECT_GT(modulus_of(folder / "wrong"), 1.2 * truth);
}

INSTANTIATE_TEST_SUITE_P(Contacts, OnACore, ::testing::Values("sliding", "glued"),
                         [](const auto& c) { return c.param; });

TEST(Inner, MovesAlongAndIsRefusedWhereNothingKnowsIt) {
  const TemporaryFolder folder;
  write_mesh(folder / "core.obj", make_sphere(0.03, 3));
  const std::string timing = "[timing]\nframe_rate = 60.0\nframe_count = 3\n";
  const auto synth = [&](const std::string& text, const char* out) {
    return run_pliant({"synth", folder.write("scene.toml", text), "--out", folder / out});
  };
  const ProgramRun moving = synth(scene + inner("glued") + timing, "moving");
  EXPECT_EQ(moving.exit_code, 0) << moving.err;
  EXPECT_EQ(run_pliant({"check", folder / "moving"}).exit_code, 0);
  // A scan that sags: load-free shapes know what is fixed alone.
  std::string sagging = scene;
  sagging.replace(sagging.find("[object]"), 8, "[object]\nshape_is = \"static\"");
  const ProgramRun refused = synth(sagging + inner("sliding") + timing, "never");
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_THAT(refused.err, HasSubstr("a rigid body of an object that sags"));
}

}  // namespace
}  // namespace pliant::test::inner_app_test
