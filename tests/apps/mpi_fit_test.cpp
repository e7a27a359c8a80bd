// `mpirun -n N pliant fit A B C`: whatever the number of processes, the same answer to the last bit, one voice, and an
// end.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "base/files.hpp"

namespace pliant::test::mpi_fit_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
namespace fs = std::filesystem;

constexpr int bad_input = 2, was_interrupted = 130;

/// A bar that is pulled aside and let go before two cameras.
std::string scene(const char* name, const char* force, int frames) {
  return std::string("format = \"scene/1\"\nname = \"") + name + R"toml("
[object]
box = { size = [0.16, 0.04, 0.04], facet = 0.01 }
density = 200.0
[material]
youngs_modulus = 60000.0
poissons_ratio = 0.3
mass_damping = 0.5
stiffness_damping = 0.002
[world]
gravity = [0.0, -9.81, 0.0]
[simulation]
cell_size = 0.02
substeps = 10
[[fixed]]
box = { min = [-1, -1, -1], max = [-0.0399, 1, 1] }
[cloud]
[[camera]]
name = "front"
width = 96
height = 64
eye = [0.02, 0.15, 0.35]
target = [0.02, 0.0, 0.0]
vertical_fov_deg = 35.0
sensor = { preset = "ideal", noise_base = 0.0005 }
[timing]
frame_rate = 60.0
start_frame = 1
frame_count = )toml" +
         std::to_string(frames) +
         "\n[initial]\nreleased = true\npulled = { at = [0.08, 0, 0], radius = 0.03, force = " + force + " }\n";
}

int occurrences(const std::string& text, const std::string& word) {
  int count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

class JointFit : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("pliant.mpi_fit." + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const std::vector<std::pair<const char*, const char*>> forces = {
        {"a", "[0, 0.15, 0.05]"}, {"b", "[0, -0.15, 0.08]"}, {"c", "[0, 0.05, 0.15]"}};
    for (const auto& [name, force] : forces) {  // of unlike lengths, so that shares are unlike
      write_file(at(name) + ".toml", scene(name, force, *name == 'b' ? 14 : 9));
      const ProgramRun made = run_pliant({"synth", at(name) + ".toml", "--out", at(name)});
      ASSERT_EQ(made.exit_code, 0) << made.err;
    }
    alone_ = new ProgramRun(run_pliant(fit_of({at("a"), at("b"), at("c")}, "alone")));
    ASSERT_TRUE(fs::is_regular_file(at("alone") + "/result.json")) << alone_->out << alone_->err;
  }
  static void TearDownTestSuite() {
    delete alone_;
    fs::remove_all(folder_);
  }
  static std::string at(const std::string& name) { return (folder_ / name).string(); }
  static std::vector<std::string> fit_of(const std::vector<std::string>& captures, const std::string& out,
                                         const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"fit"};
    words.insert(words.end(), captures.begin(), captures.end());
    words.insert(words.end(), {"--out", at(out)});
    for (const char* setting :
         {"cells=6", "coarse_cells=5", "control_points=1", "starts=1", "most_starts=1", "budget=0"})
      words.insert(words.end(), {"--set", setting});
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  /// Each with its own words, as mpirun takes them apart by colons.
  static ProgramRun run_each(const std::vector<std::vector<std::string>>& each, const std::string& at_text = "",
                             const std::function<void(pid_t)>& then = {}) {
    std::vector<std::string> words = {PLIANT_MPIRUN, "--oversubscribe", "--allow-run-as-root", "--bind-to", "none"};
    for (const std::vector<std::string>& own : each) {
      if (&own != &each.front()) words.emplace_back(":");
      words.insert(words.end(), {"-n", "1", PLIANT_PROGRAM});
      words.insert(words.end(), own.begin(), own.end());
    }
    return run_words(words, at_text, then);
  }
  static ProgramRun run_together(int processes, const std::vector<std::string>& words, const std::string& at_text = "",
                                 const std::function<void(pid_t)>& then = {}) {
    return run_each(std::vector<std::vector<std::string>>(std::size_t(processes), words), at_text, then);
  }
  /// But for its times.
  static std::string result(const std::string& name) {
    json all = json::parse(read_file(at(name) + "/result.json"));
    all.erase("time");
    return all.dump(1);
  }
  static void expect_as_alone(const std::string& name) {
    EXPECT_EQ(result(name), result("alone")) << name;
    for (const char* file : {"model.toml", "model.vtu", "convergence.csv", "fit.toml"})
      EXPECT_EQ(read_file(at(name) + "/" + file), read_file(at("alone") + "/" + file)) << name << " " << file;
  }
  static const ProgramRun* alone_;

 private:
  static fs::path folder_;
};
const ProgramRun* JointFit::alone_ = nullptr;
fs::path JointFit::folder_;

class OfProcesses : public JointFit, public testing::WithParamInterface<int> {};

TEST_P(OfProcesses, HasTheAnswerOfOneToTheLastBit) {
  const std::string name = std::to_string(GetParam()) + " processes";
  const ProgramRun run = run_together(GetParam(), fit_of({at("a"), at("b"), at("c")}, name));
  EXPECT_EQ(run.exit_code, alone_->exit_code) << run.err;
  expect_as_alone(name);
  EXPECT_EQ(occurrences(run.out, "Look at "), 1) << "one of them tells";
  EXPECT_EQ(occurrences(run.err, "\nfine"), occurrences(alone_->err, "\nfine"));
  const std::string told = std::to_string(std::min(3, GetParam())) + " processes share out 3 recordings";
  EXPECT_EQ(run.err.find(told) != std::string::npos, GetParam() > 1) << run.err;
  EXPECT_EQ(run.err.find("1 more has nothing to do") != std::string::npos, GetParam() == 4) << run.err;
}

INSTANTIATE_TEST_SUITE_P(Numbers, OfProcesses, testing::Values(1, 2, 4));

TEST_F(JointFit, AGradientIsCheckedTogether) {
  const auto words = [&](const char* out) { return fit_of({at("a"), at("b")}, out, {"--check-gradient"}); };
  const ProgramRun one = run_pliant(words("checked")), two = run_together(2, words("checked by two"));
  EXPECT_EQ(two.exit_code, one.exit_code) << two.err;
  EXPECT_EQ(two.out, one.out);
  EXPECT_EQ(read_file(at("checked by two") + "/gradient.csv"), read_file(at("checked") + "/gradient.csv"));
}

TEST_F(JointFit, ThatIsAskedToStopTellsWhatItHasAndIsResumedByAnyNumber) {
  const std::vector<std::string> captures = {at("a"), at("b"), at("c")};
  const ProgramRun stopped = run_together(2, fit_of(captures, "stopped"), "\nfine",
                                          [](pid_t mpirun) { ::kill(mpirun, SIGUSR1); });  // which hands it on
  EXPECT_EQ(stopped.exit_code, was_interrupted) << stopped.err;
  EXPECT_EQ(occurrences(stopped.out, "--resume"), 1) << stopped.out;
  EXPECT_TRUE(fs::is_regular_file(at("stopped") + "/state.json"));
  EXPECT_TRUE(fs::is_regular_file(at("stopped") + "/result.json"));
  fs::copy(at("stopped"), at("stopped too"), fs::copy_options::recursive);
  const ProgramRun resumed = run_together(3, fit_of(captures, "stopped", {"--resume"}));
  const ProgramRun by_one = run_pliant(fit_of(captures, "stopped too", {"--resume"}));
  EXPECT_EQ(resumed.exit_code, by_one.exit_code) << resumed.err;
  EXPECT_EQ(occurrences(resumed.err, "resuming the fit"), 1) << resumed.err;
  EXPECT_FALSE(fs::exists(at("stopped") + "/state.json"));
  EXPECT_EQ(result("stopped"), result("stopped too"));
}

TEST_F(JointFit, TheScriptForSlurmStartsItAndHandsASignalOn) {
  const std::map<std::string, std::string> variables = {{"PLIANT", PLIANT_PROGRAM},
                                                        {"MPIRUN", PLIANT_MPIRUN},
                                                        {"MPIRUN_OPTIONS", "--oversubscribe --allow-run-as-root"},
                                                        {"SLURM_NTASKS", "2"},
                                                        {"SLURM_CPUS_PER_TASK", "1"}};
  for (const auto& [name, value] : variables) ::setenv(name.c_str(), value.c_str(), 1);
  std::vector<std::string> words = fit_of({at("a"), at("b")}, "of Slurm");
  words.front() = PLIANT_SOURCE_DIR "/examples/engines/joint.sh";
  words.insert(words.begin(), "bash");
  const ProgramRun run = run_words(words, "\ncoarse", [](pid_t script) { ::kill(script, SIGUSR1); });
  for (const auto& [name, value] : variables) ::unsetenv(name.c_str());
  EXPECT_EQ(run.exit_code, was_interrupted) << run.err;
  EXPECT_THAT(run.err, HasSubstr("2 processes share out 2 recordings; this one with 1 thread\n"));
  EXPECT_EQ(occurrences(run.out, "--resume"), 1) << run.out;
}

TEST_F(JointFit, ThereIsNothingToResumeIsSaidOnce) {
  const ProgramRun run = run_together(2, fit_of({at("a"), at("b")}, "never begun", {"--resume"}));
  EXPECT_EQ(run.exit_code, bad_input) << run.err;
  EXPECT_EQ(occurrences(run.err, "there is no interrupted fit to resume"), 1) << run.err;
}

TEST_F(JointFit, ARecordingThatOneProcessCannotReadEndsAllWithOneComplaint) {
  fs::copy(at("b"), at("broken"), fs::copy_options::recursive);
  for (const auto& entry : fs::recursive_directory_iterator(at("broken")))
    if (entry.path().extension() == ".ply" && entry.path().string().find("scan") == std::string::npos)
      write_file(entry.path(), read_file(entry.path()).substr(0, 400));
  const ProgramRun both = run_together(2, fit_of({at("a"), at("broken")}, "of a broken one"));
  EXPECT_EQ(both.exit_code, bad_input) << both.err;
  EXPECT_EQ(occurrences(both.err, at("broken")), 1) << both.err;
  EXPECT_FALSE(fs::exists(at("of a broken one") + "/result.json"));
  const ProgramRun second =
      run_each({fit_of({at("a"), at("b")}, "missing"), fit_of({at("a"), at("absent")}, "missing")});
  EXPECT_EQ(second.exit_code, bad_input) << second.err;
  EXPECT_EQ(occurrences(second.err, at("absent")), 1) << second.err;
}

TEST_F(JointFit, ProcessesOfOtherRecordingsComeApartAtOnce) {
  const ProgramRun run = run_each({fit_of({at("a"), at("b")}, "apart"), fit_of({at("a"), at("c")}, "apart")});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_EQ(occurrences(run.err, "the processes have come apart"), 1) << run.err;
}

TEST_F(JointFit, AProcessThatEndsAloneEndsAll) {
  const ProgramRun run = run_each({fit_of({at("a"), at("b")}, "alone at the end"), {"fit", "--nonsense"}});
  EXPECT_NE(run.exit_code, 0) << run.err;
  EXPECT_FALSE(fs::exists(at("alone at the end") + "/result.json"));
}

// The first process alone writes: where it cannot, those that wait for it in the fit do not wait for ever.
TEST_F(JointFit, AFailureThatTheOthersCannotKnowOfEndsAll) {
  const fs::path state = at("no state") + "/state.json";
  const ProgramRun run = run_together(2, fit_of({at("a"), at("b")}, "no state"), "\ncoarse", [&](pid_t) {
    for (int tries = 0; tries < 1000 && !fs::is_directory(state); ++tries) {  // it is written again and again
      std::error_code ignored;
      fs::remove(state, ignored);
      fs::create_directories(state / "in the way", ignored);
    }
  });
  EXPECT_EQ(run.exit_code, bad_input) << run.err;
  EXPECT_THAT(run.err, HasSubstr("state.json"));
  EXPECT_FALSE(fs::exists(at("no state") + "/result.json"));
}

TEST_F(JointFit, WhereTheResultCannotBeWrittenTheFirstProcessSaysSo) {
  write_file(at("no room") + "/frames", "a file where a folder should be");
  const ProgramRun run = run_together(2, fit_of({at("a"), at("b")}, "no room"));
  EXPECT_EQ(run.exit_code, bad_input) << run.err;
  EXPECT_EQ(occurrences(run.err, "no room/frames"), 1) << run.err;
}

}  // namespace
}  // namespace pliant::test::mpi_fit_test
