#include "report/report.hpp"

#include <cmath>
#include <cstdlib>

#include "geometry/primitives.hpp"
#include "rays/ray_scene.hpp"
#include "report/picture.hpp"
#include "support/load_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::report_test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

ConvergenceHistory falling_history() {
  ConvergenceHistory history{{"youngs_modulus", "stiffness_damping"}, {"Pa", "s"}, {}};
  for (int start = 0; start < 3; ++start)
    for (int i = 0; i < 12; ++i) {
      const double left = std::exp(-0.7 * i);
      history.rows.push_back({start,
                              i,
                              "all",
                              8.46 + 140.0 * (start + 1) * left,
                              1e-3,
                              {590.0 * std::exp((start - 0.7) * 3.0 * left), 0.027 * std::exp((1 - start) * left)}});
    }
  return history;
}

Picture example_picture(double squash, double range, int width, int height) {
  PictureScene scene;
  const TriangleMesh ring = make_torus(0.15, 0.06, 64, 32);
  scene.triangles = ring.triangles;
  scene.planes = {Plane{}};
  scene.surface = vertex_points(ring);
  for (Eigen::Index i = 0; i < scene.surface.rows(); ++i) {
    Eigen::RowVector3d p = scene.surface.row(i);
    p.y() = squash * p.y() + 0.06 * squash, p.head<1>() *= 2.0 - squash;
    scene.surface.row(i) = p;
    if (i % 3 == 0 && ring.vertices[i].y() > -0.02) {
      scene.residuals.push_back(0.003 * std::sin(9.0 * double(i)));
      scene.points.push_back(p.transpose() + Vector3(0, scene.residuals.back(), 0));
    }
  }
  PictureOptions options;
  options.residual_range = range;
  if (width < 300) options.samples = 1;
  return draw(scene, view_of({{-0.25, 0, -0.25}, {0.25, 0.15, 0.25}}, Vector3::UnitY(), width, height), options);
}

ReportData example(int width, int height) {
  ReportData data;
  data.title = "Soft ring, dropped on the floor";
  Result& r = data.result;
  r.software = {"pliant", "0.1.0", "abcdef123456789"};
  r.capture = {"soft ring <dropped>", "00ff00ff00ff00ff00ff"};
  r.parameters = {{"youngs_modulus", 590.0, "Pa", 21.0, 5000.0, true},
                  {"poissons_ratio", 0.35, "1", std::nullopt, std::nullopt, false},
                  {"mass_damping", 0.24, "1/s", 0.11, 0.1, true},
                  {"stiffness_damping", 0.027, "s", 0.004, 0.01, true},
                  {"density", 95.0, "kg/m^3", std::nullopt, std::nullopt, false},
                  {"gravity", Vector3(0, -9.81, 0), "m/s^2", std::nullopt, std::nullopt, false},
                  {"plane", PlaneValue{}, "", std::nullopt, std::nullopt, false}};
  r.error = {.surface_rms = 0.0023, .surface_median = 0.0016, .surface_max = 0.009, .marker_rms = {}, .points = 48211};
  r.cost = {143.9, 8.46};
  r.identifiability = {{{"youngs_modulus", "stiffness_damping"}, -0.93}, {{"youngs_modulus", "mass_damping"}, 0.1}};
  for (int i = 0; i < 3; ++i)
    r.starts.push_back({{{"youngs_modulus", 5000.0}},
                        {{"youngs_modulus", 590.0 + i}},
                        8.46 + 3.0 * (i == 2),
                        12,
                        i < 2,
                        i < 2 ? "the cost settled" : "too many iterations"});
  r.time = {41.0, 9600, 2.1, 2.4};
  r.notes = {"The floor was taken as known."};
  data.convergence = falling_history();
  for (int i = 0; i < 60; ++i)
    data.residuals.push_back({i, i / 60.0, 0.0021 + 0.0004 * std::pow(std::sin(0.2 * i), 2), 800, 0.0021});
  data.residual_range = 0.005;
  for (const double squash : {1.0, 0.8, 0.6, 0.9})
    data.pictures.push_back({encode_png(example_picture(squash, 0.005, width, height)), "squash"});
  data.correlations.names = {"youngs_modulus", "mass_damping", "stiffness_damping"};
  data.correlations.values.resize(3, 3);
  data.correlations.values << 1, 0.1, -0.93, 0.1, 1, 0.4, -0.93, 0.4, 1;
  data.capture_path = "examples/ring";
  return data;
}

TEST(PlainWords, TermsOfALawAreSpokenLikeTheWhole) {
  EXPECT_EQ(spoken_name("poissons_ratio"), "Poisson's ratio");
  EXPECT_EQ(spoken_name("poissons_ratio_2@top"), "Poisson's ratio 2 (top)");
  EXPECT_EQ(spoken_name("exponent_2"), "Exponent 2");
}

TEST(Report, ShowsLoadsThatWereKeptApart) {
  ReportData data = example(8, 5);
  EXPECT_THAT(report_html(data), Not(HasSubstr("Static loads")));
  data.loads = {test::seen_load(), test::failed_load()};
  const std::string html = report_html(data);
  EXPECT_THAT(html, HasSubstr("Static loads"));
  EXPECT_THAT(html, HasSubstr("<td>1 mm, 0.5 %</td><td>4 mm, 2 %</td><td>cloud, 400 points</td>"));
  EXPECT_THAT(html, HasSubstr("load &lt;2&gt;"));
  EXPECT_THAT(html, HasSubstr("no equilibrium was found"));
  EXPECT_THAT(html, HasSubstr("sliding along it does not show"));
  data.loads[0].observed = "markers";
  EXPECT_THAT(report_html(data), Not(HasSubstr("sliding")));
}

TEST(ValueWithUncertainty, RoundsBothToTheSamePlace) {
  EXPECT_EQ(value_with_uncertainty(590.3, 21.4, "Pa"), "590 ± 21\u00a0Pa");
  EXPECT_EQ(value_with_uncertainty(0.2437, 0.052, "1/s"), "0.244 ± 0.052\u00a01/s");
  EXPECT_EQ(value_with_uncertainty(12345.0, 432.0, "Pa"), "12.35 ± 0.43\u00a0kPa");
  EXPECT_EQ(value_with_uncertainty(4.21e6, 6.5e5, "Pa/m"), "4.21 ± 0.65\u00a0MPa/m");
  EXPECT_EQ(value_with_uncertainty(0.0271, 0.004, "s"), "27.1 ± 4\u00a0ms");
  EXPECT_EQ(value_with_uncertainty(0.35, std::nullopt, "1"), "0.35");
  EXPECT_EQ(value_with_uncertainty(95.0, std::nullopt, "kg/m^3"), "95\u00a0kg/m³");
  EXPECT_EQ(value_with_uncertainty(590.0, std::nan(""), "Pa"), "590\u00a0Pa");
}

TEST(SpokenName, IsWordsWithTheRegion) {
  EXPECT_EQ(spoken_name("youngs_modulus@red half"), "Young's modulus (red half)");
  EXPECT_EQ(spoken_name("linear_velocity"), "Linear velocity");
}

TEST(PlainSentences, SayHowFarTheFitCanBeTrusted) {
  ReportData data = example(8, 5);
  const auto words = plain_sentences(data);
  EXPECT_THAT(words, Contains(HasSubstr("2.3\u00a0mm (root mean square) from the 48\u202f211 observed points")));
  EXPECT_THAT(words, Contains(HasSubstr("explains the recording down to its noise")));
  EXPECT_THAT(words, Contains(HasSubstr("Mass damping is known poorly (± 46 %)")));
  EXPECT_THAT(words, Contains(HasSubstr("Taken as given, not estimated: Poisson's ratio (0.35), density (95")));
  EXPECT_THAT(words, Contains("The floor was taken as known."));
  for (ParameterResult& p : data.result.parameters)
    if (p.name == "mass_damping") p.value = 0.0, p.std = 0.12;
  EXPECT_THAT(plain_sentences(data), Contains(HasSubstr("Mass damping is known poorly (± 0.12\u00a01/s)")))
      << "no percentage of nothing";
  ParameterResult friction = data.result.parameters.front();
  friction.name = "friction", friction.unit = "1", friction.value = 1e-4, friction.std = 6e-4;
  data.result.parameters.push_back(friction);
  EXPECT_THAT(plain_sentences(data), Not(Contains(HasSubstr("Friction is known poorly")))) << "there is none";
  data.result.parameters.back().std = 0.12;
  EXPECT_THAT(plain_sentences(data), Contains(HasSubstr("Friction is known poorly")));
  data.result.parameters.back().name = "outline_error@film";
  EXPECT_THAT(plain_sentences(data), Not(Contains(HasSubstr("Outline error")))) << "whose value is about zero";
  data.result.error.surface_rms = 0.00201;
  EXPECT_THAT(plain_sentences(data), Contains(HasSubstr("lies 2.0\u00a0mm")));
  data.result.error.surface_rms = 0.0063;
  EXPECT_THAT(plain_sentences(data), Contains(HasSubstr("not explained by this model")));
}

TEST(Report, IsOneSelfContainedPage) {
  const std::string html = report_html(example(64, 40));
  for (const char* outside : {"<script", "http://", "https://", "<link", "src=\"/", "url(/", "@import"}) {
    std::string without_namespace = html;
    for (size_t at; (at = without_namespace.find("xmlns=\"http://www.w3.org/2000/svg\"")) != std::string::npos;)
      without_namespace.erase(at, 34);
    EXPECT_THAT(without_namespace, Not(HasSubstr(outside)));
  }
  EXPECT_THAT(html, HasSubstr("590 ± 21"));
  EXPECT_THAT(html, HasSubstr("soft ring &lt;dropped&gt;"));
  EXPECT_THAT(html, HasSubstr("pliant evaluate model.toml"));
  EXPECT_THAT(html, HasSubstr("examples/ring"));
  EXPECT_THAT(html, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(html, HasSubstr("−0.93"));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(Report, BeginsWithTheVerdictAndShowsWhatTheIntervalIsMadeOf) {
  ReportData data = example(64, 40);
  EXPECT_THAT(report_html(data), Not(HasSubstr("class=\"verdict")));
  data.result.verdict = "unexplained", data.result.reasons = {"About frame 30 after the start it is < right."};
  data.result.parameters[0].interval_90 = std::pair(553.0, 629.0);
  data.result.uncertainty = {{"noise", {{"youngs_modulus", 5.9}}}, {"mass", {{"youngs_modulus", 11.8}}}};
  const std::string html = report_html(data);
  EXPECT_LT(html.find("does not explain"), html.find("class=\"cards\""));
  EXPECT_THAT(html, HasSubstr("it is &lt; right"));
  EXPECT_THAT(html, HasSubstr("<td>mass</td><td>2 %</td>"));
  EXPECT_THAT(html, HasSubstr("553\u00a0Pa to 629\u00a0Pa"));
  EXPECT_THAT(html, HasSubstr("comes from mass (2 %); what would narrow it most is weighing the object"));
  data.result.curves.emplace_back();  // of a specimen alone
  data.result.error.surface_rms.reset(), data.result.error.marker_rms.reset();
  EXPECT_THAT(report_html(data), HasSubstr("what would narrow it most is curves of other modes of loading"));
}

TEST(Report, LinesAreBrokenBetweenStages) {
  ReportData data;
  data.convergence = falling_history();
  const auto strokes = [&] {
    const std::string html = report_html(data);
    const size_t at = html.find("<path d=\"");
    const std::string path = html.substr(at, html.find("style", at) - at);
    return std::count(path.begin(), path.end(), 'M');
  };
  EXPECT_EQ(strokes(), 1);
  EXPECT_THAT(report_html(data), Not(HasSubstr("Stages: ")));
  for (ConvergenceRow& row : data.convergence.rows)
    if (row.iteration >= 6) row.stage = "fine";
  EXPECT_EQ(strokes(), 2);
  EXPECT_THAT(report_html(data), HasSubstr("Stages: "));
}

TEST(Report, EmptyPartsAreLeftOut) {
  ReportData data;
  data.result.capture.name = "nothing";
  const std::string html = report_html(data);
  for (const char* title : {"Observed and simulated", "Agreement over time", "Convergence", "Starting points"})
    EXPECT_THAT(html, Not(HasSubstr(title)));
}

TEST(Report, RefusesTablesThatDoNotFit) {
  ReportData data = example(8, 5);
  data.correlations.names.pop_back();
  EXPECT_THROW(report_html(data), std::invalid_argument);
  data = example(8, 5);
  data.convergence.rows[3].parameters.pop_back();
  EXPECT_THROW(report_html(data), std::invalid_argument);
}

TEST(Report, IsWrittenWhole) {
  const test::TemporaryFolder folder;
  const ReportData data = example(8, 5);
  write_report(folder / "report.html", data);
  EXPECT_EQ(read_file(folder / "report.html"), report_html(data));
}

// With PLIANT_PICTURES=folder a page with pictures of full size is left there for people to look at.
TEST(Report, ExamplePage) {
  const char* keep = std::getenv("PLIANT_PICTURES");
  const std::string html = report_html(keep ? example(760, 475) : example(76, 47));
  if (keep) write_file(std::filesystem::path(keep) / "report.html", html);
  EXPECT_GT(html.size(), 20000u);
}

}  // namespace
}  // namespace pliant::report_test
