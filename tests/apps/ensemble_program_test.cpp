// `pliant ensemble` as users run it: in one go, in parts, killed and gone on with.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <thread>

#include "apps/program.hpp"
#include "geometry/primitives.hpp"
#include "model/model.hpp"
#include "model/result.hpp"
#include "model/samples.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::ensemble_program_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

constexpr int fine = 0, bad_input = 2, not_converged = 3, was_interrupted = 130;

/// A soft ball above the floor, as a fit would leave it.
Model ball(int frames) {
  Model model;
  model.name = "ball";
  model.scene.object.surface = make_sphere(0.05, 2);
  model.scene.object.density = 100.0, model.scene.object.mass = 0.05;
  model.scene.world.gravity = Vector3(0, -9.81, 0);
  model.scene.planes = {{{0, -0.052, 0}, Vector3::UnitY(), true, 0.3}};
  model.scene.timing = evenly_timed(60.0, frames);
  model.youngs_modulus = 3000.0, model.poissons_ratio = 0.3, model.mass_damping = 0.2, model.stiffness_damping = 0.002;
  model.cell_size = 0.02, model.substeps = 4;
  return model;
}

Result result_of(const Model& model) {
  Result r;
  const auto add = [&](const char* name, double value, const char* unit, double low, double high) {
    ParameterResult p{name, value, unit, {}, {}, true};
    p.interval_90 = std::pair(low, high);
    r.parameters.push_back(p);
  };
  add("youngs_modulus", model.youngs_modulus, "Pa", 2500.0, 3700.0);
  add("poissons_ratio", model.poissons_ratio, "1", 0.2, 0.4);
  add("mass_damping", model.mass_damping, "1/s", 0.1, 0.4);
  add("stiffness_damping", model.stiffness_damping, "s", 0.001, 0.004);
  return r;
}

class EnsembleProgram : public testing::Test {
 protected:
  EnsembleProgram() { leave_fit(4); }
  void leave_fit(int frames) const {
    save_model(folder / "fit", ball(frames));
    write_result(folder / "fit/result.json", result_of(ball(frames)));
  }
  std::string at(const std::string& name) const { return (folder / name).string(); }
  std::vector<std::string> words(const std::string& out, std::vector<std::string> more) const {
    std::vector<std::string> all = {"ensemble", at("fit"), "--out", at(out), "--chunk", "3"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ProgramRun run(const std::string& out, const std::vector<std::string>& more) const {
    return run_pliant(words(out, more));
  }
  /// Files by their names beneath a folder.
  static std::map<std::string, std::string> files(const fs::path& out) {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(out))
      if (entry.is_regular_file()) all[entry.path().lexically_relative(out).generic_string()] = read_file(entry.path());
    return all;
  }
  /// Of all files of chunks in the folder `out`, also of those that are being made.
  std::uintmax_t chunk_bytes() const {
    std::uintmax_t bytes = 0;
    std::error_code gone;
    for (const auto& entry : fs::directory_iterator(folder / "out/chunks", gone))
      if (const auto size = entry.file_size(gone); !gone) bytes += size;
    return bytes;
  }
  TemporaryFolder folder;
};

TEST_F(EnsembleProgram, HasTheSameBytesByOneProcessAndInParts) {
  const std::vector<std::string> ten = {"--members", "10", "--points",
                                        folder.write("p.csv", "id,x,y,z\ntop,0,0.05,0\n")};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), ten.begin(), ten.end());
    return more;
  };
  const ProgramRun whole = run("whole", with({"--workers", "1"}));
  ASSERT_EQ(whole.exit_code, fine) << whole.err;
  EXPECT_THAT(whole.out, HasSubstr("10 of 10 members ended, 0 failed"));
  const ProgramRun second = run("parts", with({"--shard", "2/2", "--workers", "2", "--threads", "2"}));
  EXPECT_EQ(second.exit_code, not_converged) << second.err;
  EXPECT_THAT(second.out, HasSubstr("4 of 10 members ended"));
  EXPECT_FALSE(fs::exists(folder / "parts/members.csv"));
  const ProgramRun first = run("parts", with({"--shard", "1/2"}));
  EXPECT_EQ(first.exit_code, fine) << "the last one gathers: " << first.err;
  const auto a = files(folder / "whole"), b = files(folder / "parts");
  for (const char* file : {"members.csv", "quantiles.csv", "frames.csv", "points.csv", "surface.pvd", "ensemble.html",
                           "ensemble.json", "surface/000003.vtu"})
    EXPECT_TRUE(a.contains(file)) << file;
  for (const auto& [name, content] : a) EXPECT_TRUE(b.contains(name) && b.at(name) == content) << name;
  EXPECT_EQ(a.size(), b.size()) << "nothing else is left";
  EXPECT_THAT(a.at("ensemble.html"), Not(HasSubstr("<script")));

  // Members are those of the fit's result, and the same however many there are.
  const std::vector<DrawnMaterial> drawn = posterior_samples(result_of(ball(4)), 10);
  const std::vector<DrawnMaterial> members = read_materials(folder / "whole/members.csv", {});
  ASSERT_EQ(members.size(), drawn.size());
  for (std::size_t i = 0; i < drawn.size(); ++i)
    EXPECT_NEAR(members[i].youngs_modulus / drawn[i].youngs_modulus, 1.0, 1e-8);
  const ProgramRun again = run("whole", with({"--workers", "1"}));
  EXPECT_EQ(again.exit_code, fine);
  EXPECT_EQ(files(folder / "whole"), a);
}

TEST_F(EnsembleProgram, GoesOnWhereItWasInterruptedOrKilled) {
  leave_fit(60);
  std::vector<char*> arguments;
  std::vector<std::string> all = words("out", {"--members", "6", "--workers", "2", "--no-surface"});
  all.insert(all.begin(), PLIANT_PROGRAM);
  for (std::string& word : all) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  for (const int signal : {SIGINT, SIGKILL}) {
    const pid_t child = ::fork();
    if (child == 0) {
      ::setpgid(0, 0);
      ::execv(arguments[0], arguments.data());
      ::_exit(127);
    }
    const std::uintmax_t enough = chunk_bytes() + (signal == SIGINT ? 3000 : 1000);  // a record more has 1,072
    for (int k = 0; k < 1500 && chunk_bytes() < enough; ++k) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_GE(chunk_bytes(), enough);
    ::kill(child, signal);
    int status = 0;
    ::waitpid(child, &status, 0);
    if (signal == SIGINT) {
      EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == was_interrupted);
      EXPECT_TRUE(fs::is_empty(folder / "out/claims")) << "others can go on at once";
    }
  }
  std::this_thread::sleep_for(std::chrono::seconds(2));  // its processes end, too
  std::error_code ignored;
  fs::remove_all(folder / "out/claims", ignored);  // as if three minutes had gone by
  const ProgramRun run_again = run("out", {"--members", "6", "--no-surface"});
  EXPECT_EQ(run_again.exit_code, fine) << run_again.err;
  ASSERT_EQ(run("whole", {"--members", "6", "--no-surface"}).exit_code, fine);
  EXPECT_EQ(read_file(folder / "out/members.csv"), read_file(folder / "whole/members.csv"));
  for (const auto& entry : fs::directory_iterator(folder / "out/chunks"))
    EXPECT_EQ(entry.path().extension(), ".bin") << entry.path();
}

TEST_F(EnsembleProgram, TakesMaterialsOfATable) {
  const std::string table = folder.write("m.csv", "youngs_modulus [Pa],note\n2000,soft\n8000,stiff\n");
  ASSERT_EQ(run("out", {"--from", table}).exit_code, fine);
  const std::vector<DrawnMaterial> members = read_materials(folder / "out/members.csv", {});
  ASSERT_EQ(members.size(), 2u);
  EXPECT_EQ(numbers_of(members[1]), (std::array{8000.0, 0.3, 0.2, 0.002}));
  fs::remove(folder / "fit/result.json");
  EXPECT_EQ(run("out2", {"--from", table, "--members", "1"}).exit_code, fine) << "no result is needed";
  const ProgramRun three = run("out", {"--from", table, "--members", "3"});
  EXPECT_EQ(three.exit_code, bad_input);
  EXPECT_THAT(three.err, HasSubstr("m.csv: 2 rows for 3 members"));
}

TEST_F(EnsembleProgram, SaysHowMuchItIsAndSimulatesNothing) {
  const ProgramRun dry = run("out", {"--members", "5000", "--dry-run"});
  EXPECT_EQ(dry.exit_code, fine) << dry.err;
  EXPECT_THAT(dry.out, HasSubstr("5000 members in 1667 chunks; 5000 members in 1667 chunks are left"));
  EXPECT_THAT(dry.out, HasSubstr("of core time"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST_F(EnsembleProgram, NamesWhatIsWrong) {
  const auto said = [&](const std::vector<std::string>& more) {
    const ProgramRun wrong = run("out", more);
    EXPECT_EQ(wrong.exit_code, bad_input) << wrong.err;
    return wrong.err;
  };
  EXPECT_THAT(said({"--from", "prior"}), HasSubstr("result.json: the result states no prior of youngs_modulus"));
  EXPECT_THAT(said({"--from", at("nowhere.csv")}), HasSubstr("nowhere.csv: is not there"));
  EXPECT_THAT(said({"--shard", "3/2"}), HasSubstr("PART/PARTS"));
  EXPECT_THAT(said({"--members", "0"}), HasSubstr("not a number above 0"));
  EXPECT_THAT(said({"--points", folder.write("p.csv", "id,x,y,z\na,50,0,0\n")}),
              HasSubstr("p.csv: point \"a\" lies far"));
  EXPECT_THAT(said({"--from", folder.write("m.csv", "youngs_modulus [Pa]\n1e3\n"), "--seed", "2"}),
              HasSubstr("--seed"));
  fs::remove(folder / "fit/result.json");
  EXPECT_THAT(said({"--members", "2"}), HasSubstr("result.json"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

}  // namespace
}  // namespace pliant::test::ensemble_program_test
