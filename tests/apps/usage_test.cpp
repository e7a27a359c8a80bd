// What the program says and returns before any work is done.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "apps/program.hpp"
#include "temporary_folder.hpp"

namespace pliant::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::Not;

constexpr int bad_input = 2;

TEST(Usage, VersionIsOneLineOnStdout) {
  const ProgramRun run = run_pliant({"--version"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, MatchesRegex("pliant [0-9]+\\.[0-9]+\\.[0-9]+\n"));
  EXPECT_THAT(run.err, IsEmpty());
}

TEST(Usage, HelpNamesEveryCommandAndTheExitCodes) {
  const ProgramRun run = run_pliant({"--help"});
  EXPECT_EQ(run.exit_code, 0);
  for (const char* word : {"check", "fit", "simulate", "evaluate", "synth", "130"})
    EXPECT_THAT(run.out, HasSubstr(word));
}

class CommandHelp : public testing::TestWithParam<const char*> {};

TEST_P(CommandHelp, IsGivenOnStdout) {
  const ProgramRun run = run_pliant({GetParam(), "--help"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, HasSubstr(GetParam()));
  EXPECT_THAT(run.out, HasSubstr("--out"));
  EXPECT_THAT(run.err, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Usage, CommandHelp, testing::Values("check", "fit", "simulate", "evaluate", "synth"),
                         [](const auto& choice) { return std::string(choice.param); });

TEST(Usage, FitsHelpListsItsKeysAndParameters) {
  const ProgramRun run = run_pliant({"fit", "--help"});
  for (const char* key : {"cells = ", "points_per_frame = ", "optimiser = ", "youngs_modulus", "--resume"})
    EXPECT_THAT(run.out, HasSubstr(key));
}

TEST(Usage, MistakesOnTheCommandLineAreBadInput) {
  EXPECT_EQ(run_pliant({}).exit_code, bad_input);
  EXPECT_EQ(run_pliant({"fti"}).exit_code, bad_input);
  EXPECT_EQ(run_pliant({"fit"}).exit_code, bad_input);
  EXPECT_EQ(run_pliant({"fit", "somewhere", "--out", "x", "--threads", "0"}).exit_code, bad_input);
  const ProgramRun run = run_pliant({"check", "--no-such-option", "x"});
  EXPECT_EQ(run.exit_code, bad_input);
  EXPECT_THAT(run.err, HasSubstr("--no-such-option"));
}

TEST(Usage, AMissingFileIsNamed) {
  const TemporaryFolder folder;
  const std::string missing = (folder.path() / "nowhere").string(), out = (folder.path() / "out").string();
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"check", missing},
                                                    {"fit", missing, "--out", out},
                                                    {"simulate", missing + "/model.toml", "--out", out},
                                                    {"evaluate", missing + "/model.toml", missing},
                                                    {"synth", missing + "/scene.toml", "--out", out}}) {
    const ProgramRun run = run_pliant(arguments);
    EXPECT_EQ(run.exit_code, bad_input) << arguments[0];
    EXPECT_THAT(run.err, HasSubstr("nowhere")) << arguments[0];
    EXPECT_THAT(run.err, Not(HasSubstr("terminate"))) << arguments[0];
  }
}

TEST(Usage, ABrokenCaptureIsToldWithItsPlace) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "capture.toml") << "format = \"capture/1\"\nname = \"x\"\nmass = = 3\n";
  for (const char* command : {"check", "fit"}) {
    const ProgramRun run = run_pliant({command, folder.path().string(), "--out", (folder.path() / "out").string()});
    EXPECT_EQ(run.exit_code, bad_input);
    EXPECT_THAT(run.err, HasSubstr("capture.toml:3:8"));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out"));
  }
}

TEST(Usage, AnUnknownChoiceSuggestsTheNearest) {
  const TemporaryFolder folder;
  const std::vector<std::string> fit = {"fit", folder.path().string(), "--out", (folder.path() / "out").string(),
                                        "--set"};
  const auto with = [&](const char* assignment) {
    std::vector<std::string> arguments = fit;
    arguments.push_back(assignment);
    return run_pliant(arguments);
  };
  const ProgramRun key = with("cels=8");
  EXPECT_EQ(key.exit_code, bad_input);
  EXPECT_THAT(key.err, HasSubstr("cels"));
  EXPECT_THAT(key.err, HasSubstr("cells"));
  const ProgramRun parameter = with("young_modulus=8");
  EXPECT_EQ(parameter.exit_code, bad_input);
  EXPECT_THAT(parameter.err, HasSubstr("youngs_modulus"));
  EXPECT_EQ(with("cells=1").exit_code, bad_input);
  EXPECT_EQ(with("cells=many").exit_code, bad_input);
  EXPECT_EQ(with("cells").exit_code, bad_input);
}

}  // namespace
}  // namespace pliant::test
