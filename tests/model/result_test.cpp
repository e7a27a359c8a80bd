#include "model/result.hpp"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "input_errors.hpp"
#include "support/load_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::result_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

Result full_result() {
  Result r;
  r.software = {"pliant", "0.1.0", "abc"};
  r.capture = {"a \"soft\" ring", "00ff"};
  r.parameters = {
      {"youngs_modulus", 590.0, "Pa", 21.0, 5000.0, true, 12.0, 3.0, 575.0},
      {"youngs_modulus@red half", 900.0, "Pa", std::nullopt, std::nullopt, false},
      {"gravity", Vector3(0, -9.81, 0), "m/s^2", Vector3(0.1, 0.2, 0.3), Vector3(0, -9, 0), true},
      {"plane", PlaneValue{{0, 0.1, 0}, {0, 1, 0}}, "", PlaneValue{{0, 0.01, 0}, {0, 0, 0}}, std::nullopt, true}};
  r.fields = {
      {"youngs_modulus", {{{1, 2, 3}, 4.5, 0.5}, {{1, 2, 4}, 5.5, std::nullopt}}, "model.vtu", {{2, true, 8.0, {}}}}};
  r.error = {.surface_rms = 0.0021,
             .surface_median = 0.0014,
             .surface_max = 0.009,
             .marker_rms = {},
             .points = 48211,
             .frames = {{0, 0.002, 0.0019, 1000}, {3, 0.0022, 0.0018, 900}}};
  r.cost = {143.9, 8.46};
  r.identifiability = {{{"youngs_modulus", "stiffness_damping"}, -0.93}};
  r.starts = {{{{"youngs_modulus", 5000.0}}, {{"youngs_modulus", 590.0}}, 8.46, 12, true, "cost settled"},
              {{{"youngs_modulus", 1e7}}, {}, std::nullopt, 3, false, "no finite cost"}};
  r.resolutions = {{12.0, 1.0, 800, {{"youngs_modulus", 590.0}}, 8.46, true, "cost settled"},
                   {18.0, 1.0, 2600, {{"youngs_modulus", 580.0}}, std::nullopt, false, "interrupted"}};
  r.tracking = {"points",
                "They predict better.",
                {{9e4, 1.8e5, 1e-3, 2e-3, 0.9, false}, {1.8e5, 1.7e5, {}, {}, 0.1, true}},
                HeldOutFramesResult{17, 484.0, 2.4e-3},
                HeldOutFramesResult{17, {}, {}}};
  r.time = {41.0, 9600, 2.1, std::nullopt, {{"steps", 9600, 20.0}}, {{"fine", 1, 4, 434, 2e6, 11.5}}};
  r.notes = {"The floor was taken as known."};
  return r;
}

TEST(Result, PoissonsRatioHasItsFormerNameToo) {
  const TemporaryFolder folder;
  Result result = full_result();
  result.parameters.push_back({"poissons_ratio", 0.3, "1", 0.01, std::nullopt, true});
  write_result(folder / "result.json", result);
  const std::string text = read_file(folder / "result.json");
  for (const char* name : {"\"poissons_ratio\"", "\"poisson_ratio\""}) EXPECT_THAT(text, HasSubstr(name));
  EXPECT_EQ(read_result(folder / "result.json").parameters.size(), result.parameters.size());
  const std::string former = std::string(text).erase(
      text.find("    \"poissons_ratio\""), text.find("    \"poisson_ratio\"") - text.find("    \"poissons_ratio\""));
  folder.write("former.json", former);
  const Result read = read_result(folder / "former.json");
  ASSERT_NE(read.find("poissons_ratio"), nullptr);
  EXPECT_EQ(std::get<double>(read.find("poissons_ratio")->value), 0.3);
}

TEST(Result, CurvesStandThereWithTheirErrors) {
  Result result = full_result();
  result.curves = {
      {"site", "indentation", "test", "depth [m]", "N", {1e-3, 2e-3}, {0.1, 0.3}, {0.01, 0.01}, {0.13, 0.26}, "", 4e-4},
      {"tension", "material curve", "fit", "stretch", "Pa", {1.1}, {9.0}, {1.0}, {NAN}, "none", {}}};
  const auto json = nlohmann::json::parse(to_json(result))["curves"];
  ASSERT_EQ(json.size(), 2u);
  EXPECT_NEAR(json[0]["rms"].get<double>(), 0.035355, 1e-5);
  EXPECT_NEAR(json[0]["relative_rms"].get<double>(), 0.117851, 1e-5);
  EXPECT_EQ(json[0], nlohmann::json({{"name", "site"},
                                     {"kind", "indentation"},
                                     {"role", "test"},
                                     {"abscissa", "depth [m]"},
                                     {"unit", "N"},
                                     {"at", {1e-3, 2e-3}},
                                     {"measured", {0.1, 0.3}},
                                     {"std", {0.01, 0.01}},
                                     {"predicted", {0.13, 0.26}},
                                     {"depth_offset", 4e-4},
                                     {"rms", result.curves[0].rms()},
                                     {"relative_rms", result.curves[0].relative_rms()}}));
  EXPECT_TRUE(json[1]["predicted"][0].is_null());
  EXPECT_TRUE(json[1]["rms"].is_null());
  EXPECT_EQ(json[1]["failure"], "none");
}

TEST(Result, WhatIsAskedOfAnEarlierFitComesBack) {
  const TemporaryFolder folder;
  const auto path = folder / "result.json";
  write_result(path, full_result());
  const Result read = read_result(path), truth = full_result();
  ASSERT_EQ(read.parameters.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(read.parameters[i].name, truth.parameters[i].name);  // the order stays
    EXPECT_EQ(read.parameters[i].value, truth.parameters[i].value);
    EXPECT_EQ(read.parameters[i].unit, truth.parameters[i].unit);
    EXPECT_EQ(read.parameters[i].std, truth.parameters[i].std);
    EXPECT_EQ(read.parameters[i].estimated, truth.parameters[i].estimated);
  }
  EXPECT_EQ(std::get<double>(read.find("youngs_modulus@red half")->value), 900.0);
  EXPECT_EQ(std::get<Vector3>(read.find("gravity")->value), Vector3(0, -9.81, 0));
  EXPECT_EQ(std::get<PlaneValue>(read.find("plane")->value), (PlaneValue{{0, 0.1, 0}, {0, 1, 0}}));
  EXPECT_EQ(read.find("nothing"), nullptr);
  EXPECT_EQ(read.error.surface_rms, truth.error.surface_rms);
  ASSERT_EQ(read.identifiability.size(), 1u);
  EXPECT_EQ(read.identifiability[0].parameters, truth.identifiability[0].parameters);
  EXPECT_EQ(read.identifiability[0].correlation, truth.identifiability[0].correlation);
}

// The layout is a contract with readers in other languages: names and kinds, looked at without our own reader.
TEST(Result, HasTheNamesAndKindsOfTheFormat) {
  const auto json = nlohmann::json::parse(to_json(full_result()));
  EXPECT_EQ(json["format"], "result/1");
  EXPECT_EQ(json["parameters"]["youngs_modulus"], nlohmann::json({{"value", 590.0},
                                                                  {"unit", "Pa"},
                                                                  {"std", 21.0},
                                                                  {"mesh_error", 12.0},
                                                                  {"step_error", 3.0},
                                                                  {"extrapolated", 575.0},
                                                                  {"start", 5000.0},
                                                                  {"estimated", true}}));
  EXPECT_EQ(json["software"], nlohmann::json({{"name", "pliant"}, {"version", "0.1.0"}, {"commit", "abc"}}));
  EXPECT_EQ(json["capture"], nlohmann::json({{"name", "a \"soft\" ring"}, {"sha256", "00ff"}}));
  EXPECT_FALSE(json["parameters"]["gravity"].contains("extrapolated"));
  EXPECT_EQ(json["parameters"]["gravity"]["start"], nlohmann::json({0.0, -9.0, 0.0}));
  EXPECT_EQ(json["resolutions"][0], nlohmann::json({{"cells", 12.0},
                                                    {"steps", 1.0},
                                                    {"elements", 800},
                                                    {"values", {{"youngs_modulus", 590.0}}},
                                                    {"cost", 8.46},
                                                    {"converged", true},
                                                    {"reason", "cost settled"}}));
  EXPECT_EQ(json["resolutions"][1]["elements"], 2600);
  EXPECT_TRUE(json["resolutions"][1]["cost"].is_null());
  EXPECT_EQ(json["parameters"]["plane"]["value"]["normal"], nlohmann::json({0.0, 1.0, 0.0}));
  EXPECT_FALSE(json["parameters"]["plane"].contains("unit"));
  EXPECT_EQ(json["fields"]["youngs_modulus"]["control_points"][0], nlohmann::json({1.0, 2.0, 3.0, 4.5, 0.5}));
  EXPECT_EQ(json["fields"]["youngs_modulus"]["control_points"][1], nlohmann::json({1.0, 2.0, 4.0, 5.5, nullptr}));
  EXPECT_EQ(json["fields"]["youngs_modulus"]["per_element"], "model.vtu");
  EXPECT_EQ(
      json["fields"]["youngs_modulus"]["tried"],
      nlohmann::json({{{"control_points", 2}, {"estimated", true}, {"cost", 8.0}, {"log_bayes_factor", nullptr}}}));
  EXPECT_EQ(json["error"]["unit"], "m");
  EXPECT_TRUE(json["error"]["marker_rms"].is_null());
  EXPECT_EQ(json["error"]["points"], 48211);
  EXPECT_EQ(json["identifiability"][0]["parameters"][1], "stiffness_damping");
  EXPECT_EQ(json["error"]["surface_rms"], 0.0021);
  EXPECT_EQ(json["error"]["surface_median"], 0.0014);
  EXPECT_EQ(json["error"]["surface_max"], 0.009);
  EXPECT_EQ(json["error"]["frames"][1],
            nlohmann::json({{"frame", 3}, {"rms", 0.0022}, {"noise", 0.0018}, {"points", 900}}));
  EXPECT_EQ(json["cost"], nlohmann::json({{"start", 143.9}, {"final", 8.46}}));
  EXPECT_EQ(json["identifiability"][0]["correlation"], -0.93);
  EXPECT_EQ(json["starts"][0], nlohmann::json({{"start", {{"youngs_modulus", 5000.0}}},
                                               {"final", {{"youngs_modulus", 590.0}}},
                                               {"cost", 8.46},
                                               {"iterations", 12},
                                               {"converged", true},
                                               {"reason", "cost settled"}}));
  EXPECT_TRUE(json["starts"][1]["cost"].is_null());
  EXPECT_EQ(json["tracking"]["kept"], "points");
  EXPECT_EQ(json["tracking"]["why"], "They predict better.");
  EXPECT_EQ(json["tracking"]["rounds"][0], nlohmann::json({{"tracked_with", 9e4},
                                                           {"youngs_modulus", 1.8e5},
                                                           {"surface_rms", 1e-3},
                                                           {"fit_rms", 2e-3},
                                                           {"confidence", 0.9},
                                                           {"lost", false}}));
  EXPECT_EQ(json["tracking"]["rounds"][1]["lost"], true);
  EXPECT_TRUE(json["tracking"]["rounds"][1]["fit_rms"].is_null());
  EXPECT_EQ(json["tracking"]["held_out_frames"]["tracked motion"],
            nlohmann::json({{"frames", 17}, {"cost", 484.0}, {"surface_rms", 2.4e-3}}));
  EXPECT_TRUE(json["tracking"]["held_out_frames"]["points"]["cost"].is_null()) << "it cannot be simulated";
  EXPECT_EQ(json["time"]["wall_seconds"], 41.0);
  EXPECT_EQ(json["time"]["forward_steps"], 9600);
  EXPECT_EQ(json["time"]["ms_per_forward_step"], 2.1);
  EXPECT_TRUE(json["time"]["ms_per_adjoint_step"].is_null());
  EXPECT_EQ(json["time"]["activities"][0], nlohmann::json({{"name", "steps"}, {"count", 9600}, {"seconds", 20.0}}));
  EXPECT_EQ(
      json["time"]["stages"][0],
      nlohmann::json(
          {{"name", "fine"}, {"start", 1}, {"iterations", 4}, {"elements", 434}, {"work", 2e6}, {"seconds", 11.5}}));
  EXPECT_EQ(json["notes"][0], "The floor was taken as known.");
}

TEST(Result, NumbersThatAreNotFiniteBecomeNullAndAreReadAsNothing) {
  const TemporaryFolder folder;
  Result result = full_result();
  result.parameters[0].std = std::numeric_limits<double>::infinity();
  result.parameters[2].std = Vector3(1.0, std::nan(""), 1.0);
  result.starts[0].cost = std::nan("");
  write_result(folder / "result.json", result);
  const Result read = read_result(folder / "result.json");
  EXPECT_FALSE(read.parameters[0].std);
  EXPECT_FALSE(read.parameters[2].std);
  EXPECT_TRUE(nlohmann::json::parse(to_json(result))["starts"][0]["cost"].is_null());
}

TEST(Result, IntervalsVerdictAndBudgetComeBack) {
  const TemporaryFolder folder;
  Result result = full_result();
  result.parameters[0].interval_90 = std::pair(553.0, 629.0);
  result.parameters[0].std_noise = 9.0, result.parameters[0].std_model = 19.0;
  result.parameters[0].prior = PriorResult{500.0, std::pair(200.0, 1250.0)};
  result.material = "neo-Hookean";
  result.verdict = "unexplained", result.reasons = {"The distances are 3.0 times the noise."};
  result.judgement = {{"verdict.residual", 1.6}, {"interval.floor.youngs_modulus", 0.05}};
  result.options_given = {{"cells", "16.5"}};
  result.options_used = {{"cells", "16.5"}, {"element", "\"hexahedra\""}, {"gravity", "[0.0,-9.5,0.25]"}};
  result.uncertainty = {{"noise", {{"youngs_modulus", 9.0}}}, {"mesh", {{"youngs_modulus", std::nan("")}}}};
  write_result(folder / "result.json", result);
  const Result read = read_result(folder / "result.json");
  EXPECT_EQ(read.parameters[0].interval_90, result.parameters[0].interval_90);
  EXPECT_EQ(read.parameters[0].prior, result.parameters[0].prior);
  EXPECT_FALSE(read.parameters[1].prior);
  EXPECT_EQ(read.verdict, result.verdict);
  const auto json = nlohmann::json::parse(to_json(result));
  EXPECT_EQ(json["parameters"]["youngs_modulus"]["interval_90"], nlohmann::json({553.0, 629.0}));
  EXPECT_EQ(json["parameters"]["youngs_modulus"]["std_noise"], 9.0);
  EXPECT_EQ(json["parameters"]["youngs_modulus"]["std_model"], 19.0);
  EXPECT_EQ(json["parameters"]["youngs_modulus"]["prior"],
            nlohmann::json({{"median", 500.0}, {"interval_90", {200.0, 1250.0}}}));
  EXPECT_EQ(json["material"], "neo-Hookean");
  EXPECT_EQ(json["verdict"], "unexplained");
  ASSERT_EQ(json["reasons"].size(), 1u);
  EXPECT_EQ(json["reasons"][0], "The distances are 3.0 times the noise.");
  EXPECT_EQ(json["judgement"], nlohmann::json({{"verdict.residual", 1.6}, {"interval.floor.youngs_modulus", 0.05}}));
  EXPECT_EQ(json["options"]["given"], nlohmann::json({{"cells", 16.5}}));
  EXPECT_EQ(json["options"]["used"],
            nlohmann::json({{"cells", 16.5}, {"element", "hexahedra"}, {"gravity", {0.0, -9.5, 0.25}}}));
  EXPECT_EQ(json["uncertainty"][0], nlohmann::json({{"cause", "noise"}, {"std", {{"youngs_modulus", 9.0}}}}));
  EXPECT_TRUE(json["uncertainty"][1]["std"]["youngs_modulus"].is_null());
}

TEST(Result, SeveralRecordingsStandThereEachWithItsError) {
  Result result = full_result();
  result.recordings = {{"throw", "aa", {0.001, {}, {}, {}, 40}}, {"drop", "bb", {0.002, {}, {}, {}, 50}}};
  result.held_out = RecordingResult{"roll", "cc", {{}, {}, {}, 0.003, 60}};
  const auto json = nlohmann::json::parse(to_json(result));
  EXPECT_EQ(json["recordings"][1]["name"], "drop");
  EXPECT_EQ(json["recordings"][1]["sha256"], "bb");
  EXPECT_EQ(json["recordings"][1]["error"]["surface_rms"], 0.002);
  EXPECT_EQ(json["held_out"]["error"]["marker_rms"], 0.003);
}

TEST(Result, UnknownKeysArePassedOver) {
  const TemporaryFolder folder;
  auto json = nlohmann::json::parse(to_json(full_result()));
  json["later"] = {{"more", 1}};
  json["parameters"]["density"] = {{"value", 95.0}, {"estimated", false}, {"colour", "red"}};
  const Result read = read_result(folder.write("result.json", json.dump()));
  EXPECT_EQ(std::get<double>(read.find("density")->value), 95.0);
}

TEST(Result, ReaderNamesTheMemberThatIsWrong) {
  const TemporaryFolder folder;
  const auto complaint = [&](const std::string& pointer, const nlohmann::json& value) {
    auto json = nlohmann::json::parse(to_json(full_result()));
    json[nlohmann::json::json_pointer(pointer)] = value;
    return complaint_of([&] { read_result(folder.write("result.json", json.dump())); });
  };
  EXPECT_THAT(complaint("/format", "result/9"), HasSubstr("expected \"result/1\""));
  EXPECT_THAT(complaint("/parameters/youngs_modulus/value", nullptr), HasSubstr("parameters.youngs_modulus.value"));
  EXPECT_THAT(complaint("/parameters/gravity/value", {1, 2}), HasSubstr("three numbers"));
  EXPECT_THAT(complaint("/parameters/gravity/estimated", 1), HasSubstr("true or false"));
  EXPECT_THAT(complaint("/parameters/youngs_modulus/prior", {{"median", 1.0}}), HasSubstr("an `interval_90`"));
  EXPECT_THAT(complaint("/parameters/gravity/prior", {{"median", {0, 0, 0}}, {"std", 2.0}}),
              HasSubstr("gravity.prior.std"));
  EXPECT_THAT(complaint("/identifiability/0/parameters", {"one"}), HasSubstr("two names"));
  EXPECT_THAT(complaint("/identifiability", "none"), HasSubstr("a list"));
  EXPECT_THAT(complaint("/error/surface_rms", "small"), HasSubstr("error.surface_rms"));
}

TEST(Result, TruncatedAndForeignFilesAreRefusedWithAPlace) {
  const TemporaryFolder folder;
  const std::string whole = to_json(full_result());
  for (size_t length = 0; length + 2 < whole.size(); length += 13) {
    const auto path = folder.write("result.json", whole.substr(0, length));
    EXPECT_THAT(complaint_of([&] { read_result(path); }), HasSubstr("result.json:")) << length;
  }
  const auto path = folder.write("result.json", "{\n  \"format\": oops}");
  EXPECT_THAT(complaint_of([&] { read_result(path); }), HasSubstr("result.json:2:1"));
  EXPECT_THAT(complaint_of([&] { read_result(folder.write("result.json", "[]")); }), HasSubstr("an object"));
}

TEST(Result, NumbersAndDepthsBeyondAllAreRefused) {
  const TemporaryFolder folder;
  EXPECT_THAT(complaint_of([&] { read_result(folder.write("result.json", R"({"format": 1e999})")); }),
              HasSubstr("too great"));
  const std::string deep = R"({"format": )" + std::string(100000, '[') + std::string(100000, ']') + "}";
  EXPECT_THAT(complaint_of([&] { read_result(folder.write("result.json", deep)); }), HasSubstr("64 deep"));
}

TEST(Convergence, IsATableWithNamesAndUnits) {
  const TemporaryFolder folder;
  ConvergenceHistory history{{"youngs_modulus", "plane, x"}, {"Pa", "m"}, {}};
  history.rows = {{0, 1, "all", 12.5, 1e-3, {590.25, 0.1}}, {1, 2, "warm start, \"a\"", 8.0, 0.0, {600.0, 0.2}}};
  write_convergence(folder / "convergence.csv", history);
  EXPECT_EQ(read_file(folder / "convergence.csv"),
            "start,stage,iteration,cost,damping,youngs_modulus [Pa],\"plane, x [m]\"\n"
            "0,all,1,12.5,0.001,590.25,0.1\n"
            "1,\"warm start, \"\"a\"\"\",2,8,0,600,0.2\n");
  history.rows[0].parameters.pop_back();
  EXPECT_THROW(write_convergence(folder / "convergence.csv", history), std::invalid_argument);
}

TEST(Evaluation, HasTheNamesOfTheFormat) {
  const TemporaryFolder folder;
  write_evaluation(folder / "e.json",
                   {{0.002, 0.01, std::nullopt, 10}, {{"push 3", "test", 1e-3, 2e-3, 0.02, 0.05}}, {}, {}});
  const auto json = nlohmann::json::parse(read_file(folder / "e.json"));
  EXPECT_EQ(json["format"], "evaluation/1");
  EXPECT_EQ(json["error"]["surface_rms"], 0.002);
  EXPECT_EQ(json["presses"][0], nlohmann::json({{"name", "push 3"},
                                                {"role", "test"},
                                                {"marker_rms", 1e-3},
                                                {"marker_max", 2e-3},
                                                {"max_displacement", 0.02},
                                                {"relative_error", 0.05}}));
  EXPECT_TRUE(json["loads"].is_array());
}

TEST(Evaluation, TellsHowFarLoadsAreOff) {
  const TemporaryFolder folder;
  write_evaluation(folder / "e.json", {{}, {}, {test::seen_load(), test::failed_load()}, {}});
  const auto json = nlohmann::json::parse(read_file(folder / "e.json"));
  EXPECT_EQ(json["loads"][0], nlohmann::json({{"name", "load 1"},
                                              {"role", "test"},
                                              {"marker_rms", nullptr},
                                              {"marker_max", nullptr},
                                              {"max_displacement", nullptr},
                                              {"relative_error", nullptr},
                                              {"observed", "cloud"},
                                              {"points", 400},
                                              {"outliers", 3},
                                              {"mean", 1e-3},
                                              {"max", 4e-3},
                                              {"relative_mean", 0.005},
                                              {"relative_max", 0.02}}));
  EXPECT_EQ(json["loads"][1]["failure"], "no equilibrium was found");
  EXPECT_TRUE(json["loads"][1]["mean"].is_null());
  EXPECT_TRUE(json["loads"][1]["observed"].is_null());
}

}  // namespace
}  // namespace pliant::result_test
