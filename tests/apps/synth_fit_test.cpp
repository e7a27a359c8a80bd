// What `pliant fit` finds of scenes that `pliant synth` made: one of each kind of recording, with the simulation's own
// model and hardly any noise (an inverse crime, on purpose: the truth is exactly there to be found).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "base/files.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::synth_fit_test {
namespace {

const std::string bar = R"toml(format = "scene/1"
name = "bar"
[object]
box = { size = [0.16, 0.04, 0.04], facet = 0.01 }
density = 200.0
SHAPE
[material]
youngs_modulus = 60000.0
poissons_ratio = 0.3
mass_damping = 0.5
stiffness_damping = 0.002
MATERIAL
[world]
gravity = [0.0, -9.81, 0.0]
[simulation]
cell_size = 0.02
substeps = 10
ELEMENT
)toml";
const std::string held = "[[fixed]]\nbox = { min = [-1, -1, -1], max = [-0.0399, 1, 1] }\n";
const std::string timing = "[timing]\nframe_rate = 60.0\nframe_count = 12\nstart_frame = 1\n";
const std::string markers = "[markers]\ncount = 60\nnoise = 0.00003\n";
const std::string cameras = R"toml([[camera]]
name = "front"
width = 96
height = 64
eye = [0.02, 0.15, 0.35]
target = [0.02, 0.0, 0.0]
vertical_fov_deg = 35.0
sensor = { preset = "ideal", noise_base = 0.0005 }
[[camera]]
name = "back"
width = 96
height = 64
eye = [0.02, -0.15, -0.35]
target = [0.02, 0.0, 0.0]
vertical_fov_deg = 35.0
sensor = { preset = "ideal", noise_base = 0.0005 }
)toml";
const std::string loads =
    "[[load]]\nmass = 0.005\nat = [0.08, 0, 0]\n[[load]]\nmass = 0.01\nat = [0.08, 0, 0]\n"
    "[[load]]\nmass = 0.01\nat = [0.04, 0.02, 0]\n";
const std::string tetrahedra = "element = \"quadratic_tetrahedra\"";

class Fitted : public testing::Test {
 protected:
  /// Parameters that a fit finds of a scene. @param words  in the place of SHAPE, MATERIAL, ELEMENT
  nlohmann::json fitted(std::string scene, const std::vector<std::string>& settings,
                        std::map<std::string, std::string> words = {}) {
    for (const char* word : {"SHAPE", "MATERIAL", "ELEMENT"})
      if (const std::size_t at = scene.find(word); at != std::string::npos)
        scene.replace(at, std::string(word).size(), words[word]);
    const std::string capture = folder / "capture", out = folder / "fit";
    const ProgramRun made = run_pliant({"synth", folder.write("scene.toml", scene), "--out", capture});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    if (made.exit_code != 0) return {};
    truth = nlohmann::json::parse(read_file(capture + "/truth.json"))["parameters"];
    std::vector<std::string> line = {"fit", capture, "--out", out};
    for (const std::string& setting : settings) line.insert(line.end(), {"--set", setting});
    for (const char* setting : {"starts=1", "most_starts=1", "budget=0", "alternatives=false"})
      line.insert(line.end(), {"--set", setting});
    const ProgramRun fit = run_pliant(line);
    const bool is_there = fit.exit_code == 0 || fit.exit_code == 3;  // 3: most iterations were not enough to be sure
    EXPECT_TRUE(is_there) << fit.out << fit.err;
    if (!is_there) return {};
    return nlohmann::json::parse(read_file(out + "/result.json"))["parameters"];
  }
  void expect_found(const nlohmann::json& result, const std::string& name, double tolerance) {
    if (!result.contains(name)) {
      ADD_FAILURE() << name << " was not estimated: " << result.dump();
      return;
    }
    const double found = result[name]["value"], value = truth[name]["value"];
    EXPECT_NEAR(found, value, tolerance * value) << name;
  }
  TemporaryFolder folder;
  nlohmann::json truth;
};

// Meshes and time steps of the fit differ from the simulation's: by so much may they move a modulus.
constexpr double of_hexahedra = 0.06, of_tetrahedra = 0.05;

TEST_F(Fitted, AReleaseFromAHandSeenAsClouds) {
  const std::string pulled =
      "[initial]\nreleased = true\npulled = { at = [0.08, 0, 0], radius = 0.03, force = [0, 0.15, 0.05] }\n";
  expect_found(fitted(bar + held + timing + pulled + "[cloud]\n" + cameras, {"cells=8", "youngs_modulus.start=40000"}),
               "youngs_modulus", of_hexahedra);
}

TEST_F(Fitted, ASaggingScanUnderHungWeights) {
  const auto result = fitted(bar + held + loads + markers, {"cells=5", "youngs_modulus.start=30000"},
                             {{"SHAPE", "shape_is = \"static\""}, {"ELEMENT", tetrahedra}});
  expect_found(result, "youngs_modulus", of_tetrahedra);
}

TEST_F(Fitted, TwoRegionsUnderHungWeights) {
  const std::string root =
      "[[region]]\nname = \"root\"\nhalf_space = { point = [0.02, 0, 0], normal = [-1, 0, 0] }\nyoungs_modulus = 2e4\n";
  const auto result =
      fitted(bar + held + root + loads + markers, {"cells=6", "youngs_modulus.start=30000"}, {{"ELEMENT", tetrahedra}});
  expect_found(result, "youngs_modulus", of_tetrahedra);
  expect_found(result, "youngs_modulus@root", of_tetrahedra);
}

TEST_F(Fitted, AThrowOfUnknownVelocity) {
  std::string soft = bar;
  soft.replace(soft.find("youngs_modulus = 60000.0"), 24, "youngs_modulus = 8000.0");
  const std::string thrown =
      "[initial]\nlinear_velocity = [0.2, 0.0, 0.1]\nangular_velocity = [0, 0, 3]\nknown = false\n";
  const std::string floor = "[[plane]]\npoint = [0, -0.04, 0]\nnormal = [0, 1, 0]\nfriction = 0.3\n";
  const auto result = fitted(soft + timing + thrown + floor + cameras, {"cells=8"});
  ASSERT_TRUE(result.contains("linear_velocity"));
  EXPECT_NEAR(result["linear_velocity"]["value"][0], 0.2, 0.03);
  EXPECT_NEAR(result["angular_velocity"]["value"][2], 3.0, 0.5);
}

TEST_F(Fitted, PressesOfAStiffeningBlock) {
  std::string block = bar;
  block.replace(block.find("[0.16, 0.04, 0.04]"), 18, "[0.08, 0.05, 0.08]");
  std::string presses = "[[fixed]]\nhalf_space = { point = [0, -0.0249, 0], normal = [0, -1, 0] }\n";
  for (const char* force : {"[0, -4, 0]", "[0, -8, 0]", "[3, -6, 0]", "[0, 5, 2]"})
    presses += std::string("[[press]]\nat = [0, 0.025, 0]\nradius = 0.012\nforce = ") + force + "\n";
  const auto result =
      fitted(block + presses + markers,
             {"element=tetrahedra", "cells=4", "material=ogden", "law_terms=1", "law_zones=1", "control_points=1"},
             {{"MATERIAL", "law = \"ogden\"\nexponents = [5.0]"}, {"ELEMENT", "element = \"tetrahedra\""}});
  expect_found(result, "youngs_modulus", of_tetrahedra);
  expect_found(result, "exponent_1", 0.25);
}

}  // namespace
}  // namespace pliant::test::synth_fit_test
