// What the program says and returns before any work is done.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "apps/program.hpp"
#include "base/files.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::usage_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::Not;

constexpr int bad_input = 2;

TEST(Usage, VersionIsOneLineOnStdout) {
  const ProgramRun run = run_pliant({"--version"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, MatchesRegex("pliant [0-9]+\\.[0-9]+\\.[0-9]+( \\([0-9a-f]+\\))?\n"));
  EXPECT_THAT(run.err, IsEmpty());
}

TEST(Usage, HelpNamesEveryCommandAndTheExitCodes) {
  const ProgramRun run = run_pliant({"--help"});
  EXPECT_EQ(run.exit_code, 0);
  for (const char* word : {"check", "fit", "simulate", "evaluate", "synth", "mesh", "scan", "track", "markers", "press",
                           "export", "import", "batch", "ensemble", "new", "130"})
    EXPECT_THAT(run.out, HasSubstr(word));
}

TEST(Usage, WithoutArgumentsTheCommandsThatMatterAreShown) {
  const ProgramRun run = run_pliant({});
  EXPECT_EQ(run.exit_code, 0);
  for (const char* word : {"pliant check", "pliant fit", "pliant live", "pliant new", "--help"})
    EXPECT_THAT(run.out, HasSubstr(word));
  EXPECT_THAT(run.out, Not(HasSubstr("calibrate"))) << "not all of them";
  EXPECT_THAT(run.err, IsEmpty());
}

class CommandHelp : public testing::TestWithParam<const char*> {};

TEST_P(CommandHelp, IsGivenOnStdout) {
  const ProgramRun run = run_pliant({GetParam(), "--help"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, HasSubstr(GetParam()));
  EXPECT_THAT(run.out, HasSubstr("--out"));
  EXPECT_THAT(run.err, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Usage, CommandHelp,
                         testing::Values("check", "fit", "simulate", "evaluate", "synth", "mesh", "scan", "track",
                                         "markers", "press", "export", "import", "batch", "ensemble"),
                         [](const auto& choice) { return std::string(choice.param); });

TEST(Usage, FitsHelpListsItsKeysAndParameters) {
  const ProgramRun run = run_pliant({"fit", "--help"});
  for (const char* key : {"cells = ", "points_per_frame = ", "optimiser = ", "youngs_modulus", "--resume"})
    EXPECT_THAT(run.out, HasSubstr(key));
}

TEST(Usage, MistakesOnTheCommandLineAreBadInput) {
  EXPECT_EQ(run_pliant({"fti"}).exit_code, bad_input);
  EXPECT_EQ(run_pliant({"fit"}).exit_code, bad_input);
  EXPECT_EQ(run_pliant({"fit", "somewhere", "--out", "x", "--threads", "0"}).exit_code, bad_input);
  EXPECT_THAT(run_pliant({"fit", "somewhere", "--out", "x", "--threads", "0"}).err,
              HasSubstr("`0` is not a number above 0"));
  const ProgramRun run = run_pliant({"check", "--no-such-option", "x"});
  EXPECT_EQ(run.exit_code, bad_input);
  EXPECT_THAT(run.err, HasSubstr("--no-such-option"));
}

TEST(Usage, AMissingFileIsNamed) {
  const TemporaryFolder folder;
  const std::string missing = (folder.path() / "nowhere").string(), out = (folder.path() / "out").string();
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"check", missing},
                                                    {"fit", missing, "--out", out},
                                                    {"track", missing, "--out", out},
                                                    {"simulate", missing + "/model.toml", "--out", out},
                                                    {"evaluate", missing + "/model.toml", missing},
                                                    {"export", missing + "/model.toml", "--to", "gmsh", "--out", out},
                                                    {"ensemble", missing, "--out", out},
                                                    {"synth", missing + "/scene.toml", "--out", out}}) {
    const ProgramRun run = run_pliant(arguments);
    EXPECT_EQ(run.exit_code, bad_input) << arguments[0];
    EXPECT_THAT(run.err, HasSubstr("nowhere")) << arguments[0];
    EXPECT_THAT(run.err, Not(HasSubstr("terminate"))) << arguments[0];
  }
}

TEST(Usage, ALinkThatPointsAtItselfIsBadInput) {
  const TemporaryFolder folder;
  const std::string loop = folder.link_to_itself("loop"), out = folder / "out", scene = PLIANT_TEST_SCENE;
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"check", loop},
                                                    {"scan", loop, "--out", out},
                                                    {"markers", loop, "--out", out},
                                                    {"fit", loop, "--out", out},
                                                    {"track", loop, "--out", out},
                                                    {"rest", loop, "--out", out},
                                                    {"simulate", loop, "--out", out},
                                                    {"evaluate", loop, loop},
                                                    {"mesh", loop},
                                                    {"export", loop, "--to", "usd", "--out", out},
                                                    {"synth", loop, "--out", out},
                                                    {"synth", scene, "--out", loop}}) {
    const ProgramRun run = run_pliant(arguments);
    EXPECT_EQ(run.exit_code, bad_input) << arguments[0] << ": " << run.err;
    EXPECT_THAT(run.err, HasSubstr("loop")) << arguments[0];
    EXPECT_THAT(run.err, Not(HasSubstr("filesystem error"))) << arguments[0];
  }
}

TEST(Usage, ABrokenCaptureIsToldWithItsPlace) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "capture.toml") << "format = \"capture/1\"\nname = \"x\"\nmass = = 3\n";
  for (const char* command : {"check", "fit", "track"}) {
    const ProgramRun run = run_pliant({command, folder.path().string(), "--out", (folder.path() / "out").string()});
    EXPECT_EQ(run.exit_code, bad_input);
    EXPECT_THAT(run.err, HasSubstr("capture.toml:3:8"));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out"));
  }
}

/// What `check` says of the shipped drop of a ring where something in its capture is stated otherwise.
std::string checked(const std::string& from, const std::string& to) {
  const std::filesystem::path shipped = PLIANT_SOURCE_DIR "/examples/oracle-bounce-a";
  const TemporaryFolder folder;
  std::filesystem::copy(shipped, folder.path(), std::filesystem::copy_options::recursive);
  std::string text = read_file(shipped / "capture.toml");
  text.replace(text.find(from), from.size(), to);
  folder.write("capture.toml", text);
  const ProgramRun run = run_pliant({"check", folder.path().string()});
  return run.exit_code == 0 ? run.out : run.err;
}

TEST(Check, TellsWhatTheFlightContradicts) {
  const std::string gravity = "gravity = [0.0, -9.81, 0.0]";
  const std::string as_it_is = checked(gravity, gravity);
  EXPECT_THAT(as_it_is, HasSubstr("flight"));
  EXPECT_THAT(as_it_is, Not(HasSubstr("note: ")));
  EXPECT_THAT(checked(gravity, "gravity = [-9.81, 0.0, 0.0]"), HasSubstr("90 degrees from the direction of gravity"));
  EXPECT_THAT(checked(gravity, "up = [0.0, 0.0, 1.0]"), HasSubstr("`up` of [world]"));
  EXPECT_THAT(checked("frame_rate = 60.0", "frame_rate = 30.0"),
              HasSubstr("frames 0.49 times as far apart in time would agree"));
  EXPECT_THAT(checked("[[depth]]", "[initial]\nlinear_velocity = [1.0, 0.0, 0.0]\n\n[[depth]]"),
              HasSubstr("`linear_velocity` of [initial] is stated as [1, 0, 0] and `known`"));
}

TEST(Check, TellsThatTheScanIsNotWhereTheObjectIsSeen) {
  const std::string elsewhere = checked("0.52], [-0.29", "0.6], [-0.29");  // 0.08 m too high
  EXPECT_THAT(elsewhere, HasSubstr("the scan is not where the object is seen"));
  EXPECT_THAT(elsewhere, Not(HasSubstr("flight"))) << "of nothing that was scanned";
  EXPECT_THAT(checked("0.52], [-0.29", "0.92], [-0.29"), HasSubstr("camera \"front\" shows nothing within"));
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

/// What it writes is read again, in metres.
TEST(Mesh, TellsTheQualityAndBringsItIntoMetres) {
  const TemporaryFolder folder;
  const auto file = folder.write("one.msh",
                                 "$NOD\n5\n1 0 0 0\n2 10 0 0\n3 0 10 0\n4 0 0 10\n5 9 9 9\n$ENDNOD\n"
                                 "$ELM\n1\n1 4 1 1 4 2 1 3 4\n$ENDELM\n");
  const ProgramRun run = run_pliant({"mesh", file, "--unit", "0.001", "--quadratic", "--out", folder / "out"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* part : {"1 quadratic tetrahedra, 10 nodes", "0.01 x 0.01 x 0.01 m", "54.7 to 90.0 degrees",
                           "1 elements were inside out", "1 nodes belong to no tetrahedron"})
    EXPECT_THAT(run.out, HasSubstr(part));
  const ProgramRun again = run_pliant({"mesh", folder / "out/mesh.vtu"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("1 quadratic tetrahedra, 10 nodes"));
  EXPECT_THAT(again.out, Not(HasSubstr("inside out")));
  EXPECT_TRUE(std::filesystem::exists(folder / "out/surface.ply"));
}

TEST(Mesh, RefusesWithThePlace) {
  const TemporaryFolder folder;
  const ProgramRun run = run_pliant({"mesh", folder.write("bad.msh", "$NOD\n1\n1 0 x 0\n$ENDNOD\n")});
  EXPECT_EQ(run.exit_code, bad_input);
  EXPECT_THAT(run.err, HasSubstr("bad.msh:3:5: \"x\"; expected a coordinate"));
}

#ifndef PLIANT_WITH_MPI
TEST(Usage, ProcessesOfMpirunAreToldOnceThatThisBuildHasNoMpi) {
  ::setenv("OMPI_COMM_WORLD_SIZE", "2", 1);
  ::setenv("OMPI_COMM_WORLD_RANK", "0", 1);
  const ProgramRun first = run_pliant({"fit", "a", "b", "--out", "never"});
  ::setenv("OMPI_COMM_WORLD_RANK", "1", 1);
  const ProgramRun second = run_pliant({"fit", "a", "b", "--out", "never"});
  ::unsetenv("OMPI_COMM_WORLD_SIZE"), ::unsetenv("OMPI_COMM_WORLD_RANK");
  EXPECT_EQ(first.exit_code, bad_input);
  EXPECT_THAT(first.err, HasSubstr("-DPLIANT_WITH_MPI=ON"));
  EXPECT_EQ(second.exit_code, 0) << "mpirun ends the others where one fails: the first one is to have its say";
  EXPECT_THAT(second.err, IsEmpty());
}
#endif

}  // namespace
}  // namespace pliant::test::usage_test
