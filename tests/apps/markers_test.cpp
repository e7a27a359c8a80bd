// From photographs to a capture and its check, as a user goes.

#include "capture/markers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "base/files.hpp"
#include "capture/capture.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::markers_test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Markers, PhotographsBecomeACaptureThatIsFine) {
  const TemporaryFolder folder;
  const std::string session = folder / "session", capture = folder / "capture";
  const ProgramRun example = run_pliant({"markers", "--example", session});
  ASSERT_EQ(example.exit_code, 0) << example.err;
  const ProgramRun run = run_pliant({"markers", session, "--out", capture});
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  for (const char* part : {"80 markers", "press 1 ", "press 4 ", "pliant check"}) EXPECT_THAT(run.out, HasSubstr(part));
  const ProgramRun check = run_pliant({"check", capture});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  EXPECT_THAT(check.out, HasSubstr("4, of them 1 for test only"));
  EXPECT_THAT(check.out, HasSubstr("under 4 presses and loads"));
  const auto figures = nlohmann::json::parse(read_file(folder / "capture/markers.json"));
  EXPECT_EQ(figures["markers"], 80);
  EXPECT_EQ(figures["presses"].size(), 4u);

  // A probe that is longer than stated is not found, in no press: nothing is written.
  std::string text = read_file(folder / "session/markers.toml");
  const std::string apart = "dots_apart = 0.05";
  ASSERT_NE(text.find(apart), std::string::npos);
  text.replace(text.find(apart), apart.size(), "dots_apart = 0.08");
  folder.write("session/markers.toml", text);
  const ProgramRun wrong = run_pliant({"markers", session, "--out", folder / "other"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("press 1: no two dots of the probe's colour are 80.0 mm apart"));
  EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

// A ball under one press: what its dots are measured to do is what the simulation did.
TEST(Markers, PhotographsOfAScenesPressesShowTheTruth) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", R"toml(format = "scene/1"
name = "ball"
[object]
sphere = { radius = 0.08, subdivisions = 5 }
density = 60.0
[material]
youngs_modulus = 15000.0
poissons_ratio = 0.25
[world]
gravity = [0.0, -9.81, 0.0]
[simulation]
cell_size = 0.03
[[fixed]]
half_space = { point = [0, -0.03, 0], normal = [0, -1, 0] }
[markers]
count = 3
[[press]]
at = [0.01837, 0.07349, 0.02572]
radius = 0.012
axis = [-0.2296, -0.9186, -0.3215]
push = 2.0
)toml");
  const std::string session = folder / "session", capture = folder / "capture";
  const ProgramRun example = run_pliant({"markers", "--example", session, "--scene", scene});
  ASSERT_EQ(example.exit_code, 0) << example.err;
  const ProgramRun run = run_pliant({"markers", session, "--out", capture});
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  const Capture measured = read_capture(capture);
  ASSERT_EQ(measured.presses.size(), 1u);
  EXPECT_NEAR(measured.presses[0].force.norm(), 2.0, 0.05);
  EXPECT_GT(measured.presses[0].force.normalized().dot(-Vector3(0.01837, 0.07349, 0.02572).normalized()), 0.999);
  EXPECT_LT((measured.presses[0].contact_centre - Vector3(0.01837, 0.07349, 0.02572)).norm(), 1e-3);
  // Ids differ from the truth's: each measured marker lies on one of the true dots.
  const MarkerPositions found = read_marker_positions(measured.presses[0].markers),
                        truth = read_marker_positions(folder / "session/truth/001.csv");
  EXPECT_GT(found.ids.size(), 60u);
  for (Eigen::Index i = 0; i < found.positions.rows(); ++i)
    EXPECT_LT((truth.positions.rowwise() - found.positions.row(i)).rowwise().norm().minCoeff(), 2e-4);

  std::string text = read_file(scene);
  text.replace(text.find("push = 2.0"), 10, "depth = 0.01");
  const ProgramRun wrong =
      run_pliant({"markers", "--example", folder / "never", "--scene", folder.write("other.toml", text)});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("press 1 is not led by `push`"));
}

TEST(Markers, AsksForASession) {
  const ProgramRun run = run_pliant({"markers"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("--out"));
  EXPECT_THAT(run.err, Not(HasSubstr("terminate")));
}

}  // namespace
}  // namespace pliant::test::markers_test
