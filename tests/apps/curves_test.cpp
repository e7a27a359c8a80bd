// One user's session on force-depth curves, grips and stress-strain curves: check, fit, evaluate.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "base/files.hpp"
#include "support/curve_capture.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::curves_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

constexpr double modulus = 8000.0, exponent = -5.0, ratio = 0.25;

/// Writes a capture of Ogden's law of one term.
std::string made(const TemporaryFolder& folder, const CurveKinds& kinds) {
  const PressedBlock block;
  const LawLayout layout({1, 1});
  VectorX truth = law_parameters(layout, modulus).reference();
  truth[layout.exponent(0)] = exponent;
  truth[layout.poissons_ratio()] = ratio;
  const std::string capture = folder / "capture";
  const CurveCapture written(capture, press_law(*block.body, layout, truth), press_law(*unit_element(), layout, truth),
                             0.01, kinds);
  return capture;
}

TEST(Curves, OfProbesAndGripsAreFittedAndEvaluated) {
  const TemporaryFolder folder;
  const std::string capture = made(folder, {}), out = folder / "fit";
  const ProgramRun check = run_pliant({"check", capture});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  for (const char* text : {"3, of them 1 for test only", "grips", "stress-strain curves"})
    EXPECT_THAT(check.out, HasSubstr(text));

  const ProgramRun derivatives = run_pliant({"fit", capture, "--check-gradient", "--out", folder / "checked"});
  EXPECT_EQ(derivatives.exit_code, 0) << derivatives.err << derivatives.out;

  const ProgramRun fit = run_pliant({"fit", capture, "--out", out, "--set", "law_terms=1"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err << fit.out;
  EXPECT_THAT(fit.out, HasSubstr("indentation 3 (test): "));
  const json result = json::parse(read_file(out + "/result.json"));
  EXPECT_NEAR(result["parameters"]["youngs_modulus"]["value"], modulus, 0.03 * modulus);
  EXPECT_NEAR(result["parameters"]["exponent_1"]["value"], exponent, 0.5);
  ASSERT_EQ(result["curves"].size(), 7u);
  for (const json& curve : result["curves"]) EXPECT_LT(curve["relative_rms"], 0.05) << curve["name"];
  EXPECT_THAT(read_file(out + "/report.html"), HasSubstr("Force-depth and stress-strain curves"));

  const ProgramRun evaluate = run_pliant({"evaluate", out + "/model.toml", capture, "-o", folder / "judged.json"});
  EXPECT_EQ(evaluate.exit_code, 0) << evaluate.err;
  const json judged = json::parse(read_file(folder / "judged.json"))["curves"];
  ASSERT_EQ(judged.size(), 7u);
  for (std::size_t i = 0; i < judged.size(); ++i)
    EXPECT_NEAR(judged[i]["relative_rms"], result["curves"][i]["relative_rms"], 2e-3) << judged[i]["name"];
}

TEST(Curves, OfAMaterialAloneAreFittedWithoutShape) {
  const TemporaryFolder folder;
  const std::string capture = made(folder, {.indentations = false, .grips = false, .has_shape = false});
  const std::string out = folder / "fit";
  const ProgramRun check = run_pliant({"check", capture});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  EXPECT_THAT(check.out, Not(HasSubstr("Nothing can be fitted")));
  const ProgramRun fit = run_pliant({"fit", capture, "--out", out});
  ASSERT_EQ(fit.exit_code, 0) << fit.err << fit.out;
  EXPECT_THAT(fit.out, HasSubstr("simple_shear (test): "));
  const json result = json::parse(read_file(out + "/result.json"));
  EXPECT_NEAR(result["parameters"]["youngs_modulus"]["value"], modulus, 0.05 * modulus);
  EXPECT_FALSE(is_file(out + "/model.toml")) << "a specimen is no object";

  const ProgramRun known = run_pliant({"fit", capture, "--out", folder / "known", "--set", "poissons_ratio=0.25",
                                       "--set", "poissons_ratio.estimate=false"});
  ASSERT_EQ(known.exit_code, 0) << known.err << known.out;
  const json given = json::parse(read_file(folder / "known/result.json"))["parameters"]["poissons_ratio"];
  EXPECT_EQ(given["value"], 0.25);
  EXPECT_EQ(given["estimated"], false);
}

}  // namespace
}  // namespace pliant::test::curves_test
