// From photographs to a capture and its check, as a user goes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "base/files.hpp"
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

TEST(Markers, AsksForASession) {
  const ProgramRun run = run_pliant({"markers"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("--out"));
  EXPECT_THAT(run.err, Not(HasSubstr("terminate")));
}

}  // namespace
}  // namespace pliant::test::markers_test
