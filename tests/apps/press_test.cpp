// One user's session on presses with known force: check, fit, evaluate, press.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "support/press_capture.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::press_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(Presses, AreFittedEvaluatedAndPredicted) {
  const TemporaryFolder folder;
  const PressedBlock block;
  const LawLayout layout({1, 1});
  VectorX truth = law_parameters(layout, 8000.0).reference();
  truth[layout.exponent(0)] = -5.0;
  const std::string capture = folder / "capture", out = folder / "fit";
  write_press_capture(capture, block.scene(PressedBlock::presses(), press_law(*block.body, layout, truth), 1e-4), 1);

  const ProgramRun check = run_pliant({"check", capture});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  EXPECT_THAT(check.out, HasSubstr("4, of them 1 for test only"));

  const ProgramRun derivatives = run_pliant({"fit", capture, "--check-gradient", "--out", folder / "checked"});
  EXPECT_EQ(derivatives.exit_code, 0) << derivatives.err << derivatives.out;
  EXPECT_THAT(derivatives.out, HasSubstr("exponent_1"));

  const ProgramRun cut_off = run_pliant({"fit", capture, "--out", out}, "1 term");
  EXPECT_EQ(cut_off.exit_code, 130) << cut_off.err;
  const ProgramRun fit = run_pliant({"fit", capture, "--out", out, "--resume"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err << fit.out;
  EXPECT_THAT(fit.out, HasSubstr("press 4 (test): 0."));
  const json result = json::parse(read_file(out + "/result.json"));
  // Mesh and law are those of the recording.
  EXPECT_NEAR(result["parameters"]["youngs_modulus"]["value"], 8000.0, 160.0);
  EXPECT_NEAR(result["parameters"]["exponent_1"]["value"], -5.0, 0.3);
  for (const char* name : {"presses.csv", "presses.pvd", "presses/004.vtu", "convergence.csv", "material.csv"})
    EXPECT_TRUE(std::filesystem::exists(out + "/" + name)) << name;
  EXPECT_THAT(read_file(out + "/report.html"), HasSubstr("press 4"));

  const ProgramRun evaluate = run_pliant({"evaluate", out + "/model.toml", capture, "-o", folder / "judged.json"});
  EXPECT_EQ(evaluate.exit_code, 0) << evaluate.err;
  const json judged = json::parse(read_file(folder / "judged.json"))["presses"];
  ASSERT_EQ(judged.size(), 4u);
  EXPECT_EQ(judged[3]["role"], "test");
  // The model, read back from its files, errs as the fit says: by the noise.
  EXPECT_NEAR(judged[3]["marker_rms"], 1.73e-4, 0.4e-4);

  const std::vector<std::string> touch = {"press", out + "/model.toml", "--contact", "0,0.05,0", "--radius", "0.03"};
  const auto pressed = [&](std::vector<std::string> more) {
    more.insert(more.begin(), touch.begin(), touch.end());
    return run_pliant(more);
  };
  const ProgramRun by_force = pressed({"--force", "0,-15,0", "--steps", "3", "--out", folder / "pressed"});
  EXPECT_EQ(by_force.exit_code, 0) << by_force.err;
  EXPECT_THAT(by_force.out, HasSubstr("3 equilibria"));
  EXPECT_TRUE(std::filesystem::exists(folder / "pressed/frames/000003.ply"));
  const ProgramRun by_ball = pressed({"--move", "0,-0.01,0", "--probe", "ball"});
  EXPECT_EQ(by_ball.exit_code, 0) << by_ball.err;
  folder.write("probing.toml", R"(format = "situation/1"
duration = 1
frame_rate = 4
[[probe]]
kind = "capsule"
at = [0, 0.05, 0]
axis = [0, -1, 0]
radius = 0.01
rod = [0.04, 0, 0]
path = [ { time = 0, depth = 0 }, { time = 1, depth = 0.006, turn_deg = [0, 30, 0] } ]
)");
  const ProgramRun along =
      run_pliant({"press", out + "/model.toml", "--path", folder / "probing.toml", "--out", folder / "probed"});
  EXPECT_EQ(along.exit_code, 0) << along.err;
  EXPECT_THAT(along.out, HasSubstr("5 equilibria of"));
  EXPECT_THAT(read_file(folder / "probed/probes.csv"), HasSubstr("\n1,1,0,-0.006,0,0.006,"));
  EXPECT_TRUE(std::filesystem::exists(folder / "probed/frames/000004.vtu"));
  const ProgramRun both = pressed({"--path", folder / "probing.toml"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("--path beside --contact"));

  const ProgramRun neither = pressed({});
  EXPECT_EQ(neither.exit_code, 2);
  EXPECT_THAT(neither.err, HasSubstr("say what leads the probe"));

  // A table that belongs to another mesh is told with what to do.
  std::string table = read_file(out + "/material.csv");
  table.resize(table.rfind('\n', table.size() - 2) + 1);
  folder.write("fit/material.csv", table);
  const ProgramRun damaged = pressed({"--force", "0,-15,0"});
  EXPECT_EQ(damaged.exit_code, 2);
  EXPECT_THAT(damaged.err, HasSubstr("one for each of"));
}

}  // namespace
}  // namespace pliant::test::press_test
