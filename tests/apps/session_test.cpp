// One user's session on a small recording: synth, check, fit, simulate, evaluate; with interruptions.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>
#include <set>
#include <sstream>

#include "apps/program.hpp"
#include "base/files.hpp"

namespace pliant::test::session_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

constexpr int fine = 0, not_converged = 3, was_interrupted = 130;
constexpr int frames = 14;  // of scene.toml

json read_json(const fs::path& path) { return json::parse(read_file(path)); }

double value(const json& result, const char* name) { return result["parameters"][name]["value"]; }

/// The parts of a result that another run must reproduce.
std::string without_times(json result) {
  result.erase("time");
  return result.dump(1);
}

class Session : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("pliant.session." + std::to_string(::getpid()));
    fs::create_directories(folder_);
    const ProgramRun synth = run_pliant({"synth", PLIANT_TEST_SCENE, "--out", capture()});
    ASSERT_EQ(synth.exit_code, fine) << synth.err;
    fit_ = new ProgramRun(run_fit("fit", {"--threads", "2"}));
    ASSERT_EQ(fit_->exit_code, fine) << fit_->err << fit_->out;
  }
  static void TearDownTestSuite() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
    delete fit_;
  }

  static std::string at(const std::string& name) { return (folder_ / name).string(); }
  static std::string capture() { return at("capture"); }

  /// A fit of a few seconds.
  static ProgramRun run_fit(const std::string& name, std::vector<std::string> more = {},
                            const std::string& interrupt_at = "") {
    std::vector<std::string> arguments = {"fit", capture(), "--out", at(name)};
    for (const char* choice : {"cells=8", "coarse_cells=6", "points_per_frame=100", "scan_per_decade=1", "starts=1",
                               "steps=0.4", "max_iterations=40", "budget=0"})
      arguments.insert(arguments.end(), {"--set", choice});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_pliant(arguments, interrupt_at);
  }
  /// The same at two resolutions, for the first who asks.
  static const ProgramRun& refined_fit() {
    static std::map<fs::path, ProgramRun> runs;  // every suite has its own folder's worth
    if (!fs::exists(at("refined"))) runs[folder_] = run_fit("refined", {"--refine", "2"});
    return runs[folder_];
  }
  static json result(const std::string& name = "fit") { return read_json(at(name) + "/result.json"); }

  static inline fs::path folder_;
  static inline ProgramRun* fit_ = nullptr;
};

TEST_F(Session, CheckDescribesTheRecording) {
  const ProgramRun run = run_pliant({"check", capture()});
  EXPECT_EQ(run.exit_code, fine) << run.err;
  for (const char* text : {"a small ball", "64 x 64", "14 in", "+ "}) EXPECT_THAT(run.out, HasSubstr(text));
}

TEST_F(Session, FitFindsTheTruthAndSaysSo) {
  const json found = result();
  const json truth = read_json(capture() + "/truth.json");
  const double youngs_modulus = truth["parameters"]["youngs_modulus"]["value"];
  // Another grid, other steps and a hundred noisy points a frame.
  EXPECT_NEAR(value(found, "youngs_modulus") / youngs_modulus, 1.0, 0.10);
  EXPECT_THAT(fit_->out, HasSubstr("Young's modulus"));
  EXPECT_THAT(fit_->out, HasSubstr("report.html"));
}

TEST_F(Session, FitWritesEveryPromisedFile) {
  for (const char* name :
       {"result.json", "model.toml", "model.vtu", "trajectory.pvd", "convergence.csv", "report.html", "log.txt"})
    EXPECT_TRUE(fs::is_regular_file(at("fit") + "/" + name)) << name;
  EXPECT_FALSE(fs::exists(at("fit") + "/state.json")) << "a finished fit leaves no state";
}

TEST_F(Session, ResultHoldsWhatTheFormatPromises) {
  const json found = result();
  EXPECT_EQ(found["format"], "result/1");
  for (const char* key : {"software", "capture", "parameters", "error", "cost", "identifiability", "starts", "time"})
    EXPECT_TRUE(found.contains(key)) << key;
  EXPECT_EQ(found["software"]["name"], "pliant");
  EXPECT_THAT(found["material"].get<std::string>(), testing::StartsWith("a neo-Hookean law"));
  EXPECT_EQ(found["capture"]["sha256"].get<std::string>().size(), 64U);
  for (const char* name : {"youngs_modulus", "poissons_ratio", "mass_damping", "stiffness_damping", "density",
                           "gravity", "plane", "linear_velocity", "angular_velocity"}) {
    ASSERT_TRUE(found["parameters"].contains(name)) << name;
    const json& p = found["parameters"][name];
    EXPECT_TRUE(p.contains("value")) << name;
    EXPECT_EQ(p.contains("std") && p.contains("start"), p["estimated"].get<bool>()) << name;
  }
  EXPECT_GT(found["parameters"]["youngs_modulus"]["std"].get<double>(), 0.0);
  EXPECT_FALSE(found["parameters"]["youngs_modulus"].contains("prior")) << "none was chosen";
  const json& prior = found["parameters"]["poissons_ratio"]["prior"];
  EXPECT_NEAR(prior["median"].get<double>(), 0.35, 1e-9);
  EXPECT_LT(prior["interval_90"][0], 0.3);
  EXPECT_GT(prior["interval_90"][1], 0.4);
  EXPECT_EQ(found["parameters"]["youngs_modulus"]["unit"], "Pa");
  EXPECT_EQ(found["error"]["points"], 100 * frames);
  EXPECT_GT(found["cost"]["start"].get<double>(), found["cost"]["final"].get<double>());
  EXPECT_EQ(found["starts"].size(), 1U);
  EXPECT_GT(found["time"]["ms_per_forward_step"].get<double>(), 0.0);
}

TEST_F(Session, TrajectoryIsWhole) {
  pugi::xml_document pvd;
  ASSERT_TRUE(pvd.load_file((at("fit") + "/trajectory.pvd").c_str()));
  int count = 0;
  for (const pugi::xml_node entry : pvd.child("VTKFile").child("Collection").children("DataSet")) {
    const fs::path file = fs::path(at("fit")) / entry.attribute("file").value();
    pugi::xml_document frame;
    ASSERT_TRUE(frame.load_file(file.c_str())) << file;
    const pugi::xml_node piece = frame.child("VTKFile").child("UnstructuredGrid").child("Piece");
    EXPECT_GT(piece.attribute("NumberOfCells").as_int(), 0);
    std::set<std::string> arrays;
    for (const char* data : {"PointData", "CellData"})
      for (const pugi::xml_node array : piece.child(data).children()) arrays.insert(array.attribute("Name").value());
    EXPECT_THAT(arrays, testing::IsSupersetOf({"displacement [m]", "velocity [m/s]", "strain [1]", "stress [Pa]"}));
    ++count;
  }
  EXPECT_EQ(count, frames);
}

TEST_F(Session, ReportStandsAlone) {
  const std::string page = read_file(at("fit") + "/report.html");
  EXPECT_THAT(page, HasSubstr("a small ball"));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(page, HasSubstr("mm rms"));
  for (const char* link : {"src=\"http", "href=\"http", "<script", "@import"}) EXPECT_THAT(page, Not(HasSubstr(link)));
}

TEST_F(Session, ConvergenceHasARowForEachIteration) {
  const std::string table = read_file(at("fit") + "/convergence.csv");
  EXPECT_THAT(table, testing::StartsWith("start,stage,iteration,cost,damping,youngs_modulus [Pa]"));
  for (const char* stage : {"scan", "coarse", "fine"}) EXPECT_THAT(table, HasSubstr(stage));
}

TEST_F(Session, SavedChoicesReproduceTheResult) {
  const ProgramRun run = run_pliant({"fit", capture(), "--out", at("again"), "--config", at("fit") + "/fit.toml"});
  ASSERT_EQ(run.exit_code, fine) << run.err;
  EXPECT_EQ(without_times(result("again")), without_times(result()));
}

TEST_F(Session, ThreadsDoNotChangeTheResult) {
  ASSERT_EQ(run_fit("one thread", {"--threads", "1"}).exit_code, fine);
  EXPECT_EQ(without_times(result("one thread")), without_times(result()));
  for (const char* file : {"model.toml", "model.vtu", "convergence.csv", "frames/000013.vtu"})
    EXPECT_EQ(read_file(at("one thread") + "/" + file), read_file(at("fit") + "/" + file)) << file;
}

TEST_F(Session, SimulateRepeatsTheFittedMotion) {
  const ProgramRun run = run_pliant({"simulate", at("fit") + "/model.toml", "--out", at("simulated")});
  ASSERT_EQ(run.exit_code, fine) << run.err;
  EXPECT_THAT(run.out, HasSubstr("14 frames"));
  EXPECT_TRUE(fs::is_regular_file(at("simulated") + "/trajectory.pvd"));
  // The model file keeps what a simulation needs: last frames agree to the figures that it writes.
  const auto size_of_last = [&](const std::string& folder) { return fs::file_size(at(folder) + "/frames/000013.vtu"); };
  EXPECT_EQ(size_of_last("simulated"), size_of_last("fit"));
}

TEST_F(Session, EvaluateAgreesWithTheFit) {
  const ProgramRun run = run_pliant({"evaluate", at("fit") + "/model.toml", capture(), "-o", at("evaluation.json")});
  ASSERT_EQ(run.exit_code, fine) << run.err;
  const json evaluation = read_json(at("evaluation.json"));
  EXPECT_EQ(json::parse(run.out), evaluation);
  EXPECT_EQ(evaluation["format"], "evaluation/1");
  const double fitted = result()["error"]["surface_rms"], evaluated = evaluation["error"]["surface_rms"];
  EXPECT_NEAR(evaluated / fitted, 1.0, 0.1) << "more points of the same frames, the same noise";
}

TEST_F(Session, TheGradientIsCheckedInsteadOfFitting) {
  const ProgramRun run = run_fit("checked", {"--check-gradient"});
  EXPECT_EQ(run.exit_code, fine) << run.err << run.out;
  for (const char* name : {"youngs_modulus", "stiffness_damping", "agree as far as"})
    EXPECT_THAT(run.out, HasSubstr(name));
  EXPECT_FALSE(fs::exists(at("checked") + "/result.json"));
  EXPECT_THAT(read_file(at("checked") + "/gradient.csv"),
              testing::StartsWith("parameter,step,difference,tangents,adjoint\nyoungs_modulus,0.1"));
}

TEST_F(Session, TooFewIterationsAreNotConverged) {
  const ProgramRun run = run_fit("short", {"--set", "max_iterations=1", "--set", "optimiser=rprop"});
  EXPECT_EQ(run.exit_code, not_converged) << run.err;
  EXPECT_TRUE(fs::is_regular_file(at("short") + "/result.json"));
  EXPECT_TRUE(fs::is_regular_file(at("short") + "/report.html"));
}

TEST_F(Session, RefiningRepeatsTheEstimateAndStatesWhatIsLeft) {
  const ProgramRun& run = refined_fit();
  ASSERT_EQ(run.exit_code, fine) << run.err;
  const json refined = result("refined"), plain = result();
  const json& resolutions = refined["resolutions"];
  ASSERT_EQ(resolutions.size(), 3U);
  EXPECT_EQ(resolutions[0]["values"]["youngs_modulus"], plain["parameters"]["youngs_modulus"]["value"])
      << "the first one is the fit that is not repeated";
  EXPECT_EQ(resolutions[1]["steps"].get<double>() / resolutions[0]["steps"].get<double>(), 2.0);
  EXPECT_GT(resolutions[2]["elements"], resolutions[1]["elements"]);
  const json& modulus = refined["parameters"]["youngs_modulus"];
  EXPECT_EQ(modulus["value"], resolutions[2]["values"]["youngs_modulus"]) << "the finest mesh's";
  for (const char* error : {"mesh_error", "step_error"}) EXPECT_GT(modulus[error].get<double>(), 0.0) << error;
  const double change = modulus["extrapolated"].get<double>() - modulus["value"].get<double>();
  EXPECT_LE(std::abs(change), modulus["mesh_error"].get<double>() + modulus["step_error"].get<double>());
  EXPECT_FALSE(refined["parameters"]["density"].contains("mesh_error")) << "given, not estimated";
  EXPECT_THAT(run.out, HasSubstr("limit"));
  EXPECT_THAT(read_file(at("refined") + "/report.html"), HasSubstr("Convergence in mesh and time step"));
}

class InterruptedRefinement : public Session, public testing::WithParamInterface<const char*> {};

TEST_P(InterruptedRefinement, KeepsWhatIsDoneAndIsResumed) {
  const std::string name = std::string("refinement at ") + GetParam();
  const ProgramRun stopped = run_fit(name, {"--refine", "2"}, std::string("\n") + GetParam());
  EXPECT_EQ(stopped.exit_code, was_interrupted) << stopped.err;
  EXPECT_EQ(value(result(name), "youngs_modulus"), value(result(), "youngs_modulus")) << "the first estimate stands";
  const ProgramRun resumed = run_fit(name, {"--refine", "2", "--resume"});
  ASSERT_EQ(resumed.exit_code, fine) << resumed.err;
  ASSERT_EQ(refined_fit().exit_code, fine);
  EXPECT_EQ(without_times(result(name)), without_times(result("refined")));
}

INSTANTIATE_TEST_SUITE_P(Stages, InterruptedRefinement, testing::Values("12 cells"),
                         [](const auto&) { return "mesh"; });

TEST_F(Session, TwoRecordingsAreFittedTogetherAndAThirdIsPredicted) {
  for (const char* seed : {"11", "12"}) {
    const ProgramRun synth = run_pliant({"synth", PLIANT_TEST_SCENE, "--out", at(seed), "--seed", seed});
    ASSERT_EQ(synth.exit_code, fine) << synth.err;
  }
  ASSERT_NE(read_file(at("11") + "/capture.toml"), "");
  const ProgramRun run = run_fit("two", {at("11"), "--hold-out", at("12")});
  ASSERT_EQ(run.exit_code, fine) << run.err;
  const json two = result("two"), one = result();
  ASSERT_EQ(two["recordings"].size(), 2U);
  EXPECT_NE(two["recordings"][0]["error"]["surface_rms"], two["recordings"][1]["error"]["surface_rms"])
      << "each has its own noise";
  EXPECT_TRUE(two["parameters"].contains("linear_velocity[2]"));
  EXPECT_FALSE(two["parameters"].contains("youngs_modulus[2]")) << "one material";
  const auto spread = [](const json& found) {
    return found["parameters"]["youngs_modulus"]["std_noise"].get<double>();
  };
  EXPECT_LT(spread(two), spread(one)) << "twice the data";
  const double fitted = two["error"]["surface_rms"], predicted = two["held_out"]["error"]["surface_rms"];
  EXPECT_NEAR(predicted / fitted, 1.0, 0.2) << "the same object, scene and noise";
}

/// The elements of one fit are the volume mesh of another recording.
TEST_F(Session, AVolumeMeshMadeElsewhereIsFitted) {
  const std::vector<std::string> tetrahedra = {"--set", "element=tetrahedra"};
  ASSERT_EQ(run_fit("tetrahedra", tetrahedra).exit_code, fine);
  const fs::path meshed = at("meshed");
  fs::copy(capture(), meshed, fs::copy_options::recursive);
  fs::copy_file(at("tetrahedra") + "/model.vtu", meshed / "body.vtu");
  std::string facts = read_file(meshed / "capture.toml");
  const std::size_t surface = facts.find("surface = ");
  ASSERT_NE(surface, std::string::npos);
  facts.replace(surface, facts.find('\n', surface) - surface, "volume_mesh = \"body.vtu\"");
  write_file(meshed / "capture.toml", facts);
  const ProgramRun run = run_pliant({"fit", meshed, "--out", at("on the mesh"), "--set", "element=tetrahedra", "--set",
                                     "points_per_frame=100", "--set", "scan_per_decade=1", "--set", "starts=1", "--set",
                                     "steps=0.4", "--set", "max_iterations=40", "--refine", "2"});
  ASSERT_EQ(run.exit_code, fine) << run.err;
  const json found = result("on the mesh"), before = result("tetrahedra");
  const auto spread = [](const json& of) { return of["parameters"]["youngs_modulus"]["std"].get<double>(); };
  EXPECT_NEAR(value(found, "youngs_modulus"), value(before, "youngs_modulus"),
              2.0 * std::hypot(spread(found), spread(before)))
      << "the same elements, whose boundary is the surface now";
  EXPECT_EQ(found["resolutions"].size(), 2U) << "finer steps, but no other mesh than the one given";
  EXPECT_FALSE(found["parameters"]["youngs_modulus"].contains("mesh_error"));
}

TEST_F(Session, TrackFollowsTheObject) {
  write_file(at("follow.csv"), "id,x,y,z\ntop,0,0.12,0\nmiddle,0,0.07,0\n");
  const ProgramRun run =
      run_pliant({"track", capture(), "--out", at("track"), "--set", "cells=8", "--points", at("follow.csv")});
  ASSERT_EQ(run.exit_code, fine) << run.err << run.out;
  EXPECT_THAT(run.out, HasSubstr("14 frames"));
  EXPECT_THAT(run.out, HasSubstr("track.html"));
  for (const char* name : {"track.json", "track.csv", "track.html", "trajectory.pvd", "points.csv", "frames/000000.vtu",
                           "frames/000013.vtu", "pictures/000000.png", "pictures/000013.png"})
    EXPECT_TRUE(fs::is_regular_file(at("track") + "/" + name)) << name;

  const json track = read_json(at("track") + "/track.json");
  EXPECT_EQ(track["format"], "track/1");
  EXPECT_EQ(track["capture"]["name"], "a small ball");
  EXPECT_TRUE(track["lost_at"].is_null());
  ASSERT_EQ(track["frames"].size(), std::size_t(frames));
  for (const json& frame : track["frames"]) {
    EXPECT_FALSE(frame["lost"].get<bool>()) << frame;
    EXPECT_GT(frame["points"].get<int>(), 100) << frame;
    EXPECT_GT(frame["explained"].get<double>(), 0.9) << frame;
    EXPECT_LT(frame["surface_rms"].get<double>(), 0.002) << frame;
  }
  const std::string table = read_file(at("track") + "/track.csv");
  EXPECT_EQ(std::ranges::count(table, '\n'), frames + 1);
  EXPECT_THAT(read_file(at("track") + "/track.html"), HasSubstr("Never lost"));

  std::map<std::pair<int, std::string>, double> height;
  std::istringstream points(read_file(at("track") + "/points.csv"));
  std::string line;
  std::getline(points, line);
  EXPECT_EQ(line, "frame,id,x,y,z");
  while (std::getline(points, line)) {
    std::istringstream row(line);
    std::string cells[4];
    for (std::string& cell : cells) std::getline(row, cell, ',');
    height[{std::stoi(cells[0]), cells[1]}] = std::stod(cells[3]);
  }
  EXPECT_EQ(height.size(), 2U * frames);
  EXPECT_NEAR((height[{0, "top"}]), 0.12, 1e-9);
  const double fallen = 0.5 * 9.81 * std::pow(3.0 / 60.0, 2);  // it meets the floor after that
  for (const auto& [id, rest] : {std::pair{"top", 0.12}, std::pair{"middle", 0.07}})
    EXPECT_NEAR((height[{3, id}]), rest - fallen, 0.001) << id;
}

TEST_F(Session, TrackSaysThatTheObjectIsLost) {
  std::string scene = read_file(PLIANT_TEST_SCENE);
  const std::string here = "translation = [0.0, 0.07, 0.0]";
  ASSERT_NE(scene.find(here), std::string::npos);
  write_file(at("moved.toml"), scene.replace(scene.find(here), here.size(), "translation = [-0.12, 0.07, -0.08]"));
  ASSERT_EQ(run_pliant({"synth", at("moved.toml"), "--out", at("moved")}).exit_code, fine);
  const fs::path elsewhere = at("elsewhere");
  fs::copy(capture(), elsewhere, fs::copy_options::recursive);
  constexpr int gone = 6;  // from this frame on the pictures show it elsewhere
  for (const fs::directory_entry& picture : fs::directory_iterator(at("moved") + "/front")) {
    const std::string name = picture.path().stem().string();
    if (std::stoi(name.substr(name.size() - 6)) >= gone)
      fs::copy(picture, elsewhere / "front", fs::copy_options::overwrite_existing);
  }
  const ProgramRun run = run_pliant({"track", elsewhere, "--out", at("lost track"), "--set", "cells=6",
                                     "--points-per-frame", "400", "--no-pictures"});
  EXPECT_EQ(run.exit_code, not_converged) << run.err;
  EXPECT_THAT(run.out, HasSubstr("was lost in frame 6"));
  EXPECT_EQ(read_json(at("lost track") + "/track.json")["lost_at"], gone);
  EXPECT_FALSE(fs::exists(at("lost track") + "/pictures/000000.png"));
}
TEST_F(Session, TrackRefusesBadInputWithItsPlace) {
  write_file(at("broken.csv"), "id,x,y,z\ntop,0,high,0\n");
  const ProgramRun points = run_pliant({"track", capture(), "--out", at("no track"), "--points", at("broken.csv")});
  EXPECT_EQ(points.exit_code, 2);
  EXPECT_THAT(points.err, HasSubstr("broken.csv"));
  const ProgramRun choice = run_pliant({"track", capture(), "--out", at("no track"), "--set", "cels=8"});
  EXPECT_EQ(choice.exit_code, 2);
  EXPECT_THAT(choice.err, HasSubstr("cells"));
  EXPECT_FALSE(fs::exists(at("no track") + "/track.json"));
}

class InterruptedSession : public Session, public testing::WithParamInterface<const char*> {};

TEST_P(InterruptedSession, LeavesAResultAndIsResumed) {
  const std::string name = std::string("interrupted at ") + GetParam();
  const ProgramRun stopped = run_fit(name, {}, std::string("\n") + GetParam());
  EXPECT_EQ(stopped.exit_code, was_interrupted) << stopped.err;
  EXPECT_THAT(stopped.out, HasSubstr("--resume"));
  EXPECT_TRUE(fs::is_regular_file(at(name) + "/result.json"));
  EXPECT_TRUE(fs::is_regular_file(at(name) + "/report.html"));
  EXPECT_TRUE(fs::is_regular_file(at(name) + "/state.json"));

  const ProgramRun resumed = run_fit(name, {"--resume"});
  ASSERT_EQ(resumed.exit_code, fine) << resumed.err;
  EXPECT_FALSE(fs::exists(at(name) + "/state.json"));
  // The same path is taken again, to the last bit.
  EXPECT_EQ(without_times(result(name)), without_times(result()));
}

INSTANTIATE_TEST_SUITE_P(Stages, InterruptedSession, testing::Values("scan", "coarse", "fine"),
                         [](const auto& choice) { return std::string(choice.param); });

TEST_F(Session, AStateOfAnotherFitIsRefused) {
  const ProgramRun stopped = run_fit("other", {}, "\nscan");
  ASSERT_EQ(stopped.exit_code, was_interrupted);
  const ProgramRun resumed = run_fit("other", {"--resume", "--set", "cells=7"});
  EXPECT_EQ(resumed.exit_code, 2);
  EXPECT_THAT(resumed.err, HasSubstr("state.json"));
  const ProgramRun nothing = run_fit("never begun", {"--resume"});
  EXPECT_EQ(nothing.exit_code, 2);
}

}  // namespace
}  // namespace pliant::test::session_test
