#include "report/plot.hpp"

#include <cmath>
#include <pugixml.hpp>

namespace pliant::plot_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

pugi::xml_document parse(const std::string& svg) {
  pugi::xml_document document;
  const auto result = document.load_string(svg.c_str());
  EXPECT_TRUE(result) << result.description() << "\n" << svg;
  return document;
}

std::vector<std::pair<double, double>> circles(const std::string& svg) {
  const pugi::xml_document document = parse(svg);
  std::vector<std::pair<double, double>> centres;
  for (const auto& node : document.select_nodes("//circle"))
    centres.emplace_back(node.node().attribute("cx").as_double(), node.node().attribute("cy").as_double());
  return centres;
}

TEST(AxisTicks, AreRoundAndWithinTheRange) {
  EXPECT_THAT(axis_ticks(0.0, 1.0, 5, false),
              ElementsAre(0.0, testing::DoubleEq(0.2), testing::DoubleEq(0.4), testing::DoubleNear(0.6, 1e-12),
                          testing::DoubleEq(0.8), testing::DoubleEq(1.0)));
  EXPECT_THAT(axis_ticks(-3.0, 12.0, 3, false), ElementsAre(0.0, 5.0, 10.0));
  EXPECT_THAT(axis_ticks(1.0, 1e8, 4, true), ElementsAre(1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8));
  const auto few_decades = axis_ticks(8.0, 150.0, 4, true);
  EXPECT_THAT(few_decades, ElementsAre(10.0, 20.0, 50.0, 100.0));
  EXPECT_GE(axis_ticks(610.0, 690.0, 4, true).size(), 2u);  // within a decade: linear places
  EXPECT_TRUE(axis_ticks(1.0, 1.0, 4, false).empty());
  EXPECT_TRUE(axis_ticks(136.4, std::nextafter(136.4, 200.0), 4, false).empty());  // no place between them
  EXPECT_TRUE(axis_ticks(-1.0, 1.0, 4, true).empty());
}

TEST(Readable, ShowsTheDigitsThatCount) {
  EXPECT_EQ(readable(0.0021), "0.0021");
  EXPECT_EQ(readable(590.4), "590");
  EXPECT_EQ(readable(12345.0, 3), "12\u202f300");
  EXPECT_EQ(readable(-1234567.0, 7), "−1\u202f234\u202f567");
  EXPECT_EQ(readable(4.2e-7), "4.2×10⁻⁷");
  EXPECT_EQ(readable(1e8), "10⁸");
  EXPECT_EQ(readable(9.996, 3), "10");
  EXPECT_EQ(readable(0.0), "0");
  EXPECT_EQ(readable(std::nan("")), "unknown");
  EXPECT_EQ(readable(1000.0, 4), "1000");
}

TEST(Plot, PlacesPointsLinearly) {
  const auto p = circles(plot_svg({{"", {0, 1, 3}, {0, 1, 3}, Mark::Dots, {}, {}, -1}}));
  ASSERT_EQ(p.size(), 3u);
  EXPECT_NEAR((p[2].first - p[0].first) / (p[1].first - p[0].first), 3.0, 0.01);
  EXPECT_NEAR((p[2].second - p[0].second) / (p[1].second - p[0].second), 3.0, 0.02);
  EXPECT_GT(p[0].second, p[2].second);  // larger is higher
}

TEST(Plot, PlacesPointsLogarithmicallyAndLeavesOutWhatHasNoLogarithm) {
  PlotOptions options;
  options.log_y = true;
  const auto p = circles(plot_svg({{"", {0, 1, 2, 3, 4}, {1, 10, 100, -5, 0}, Mark::Dots, {}, {}, -1}}, options));
  ASSERT_EQ(p.size(), 3u);
  EXPECT_NEAR(p[1].second - p[0].second, p[2].second - p[1].second, 0.11);
}

TEST(Plot, UnknownValuesInterruptTheLine) {
  const std::string svg = plot_svg({{"", {0, 1, 2, 3}, {1, std::nan(""), 2, 3}, Mark::Line, {}, {}, -1}});
  const std::string d = parse(svg).select_node("//path").node().attribute("d").value();
  EXPECT_EQ(std::count(d.begin(), d.end(), 'M'), 2);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(Plot, HasLabelsLegendBandAndLevel) {
  PlotOptions options;
  options.title = "a < b", options.x_label = "time [s]", options.y_label = "cost";
  options.levels = {{1.5, "noise", 0.1}};
  const std::string svg = plot_svg({{"fit & more", {0, 1}, {1, 2}, Mark::Line, {0.9, 1.9}, {1.1, 2.1}, -1}}, options);
  for (const char* text : {"a &lt; b", "time [s]", ">cost<", "fit &amp; more", ">noise<", "<polygon", "<rect"})
    EXPECT_THAT(svg, HasSubstr(text));
  parse(svg);
}

TEST(Plot, EmptyAndConstantDataStillMakeAPlot) {
  parse(plot_svg({}));
  PlotOptions logarithmic;
  logarithmic.log_y = logarithmic.log_x = true;
  parse(plot_svg({{"", {0.0}, {0.0}, Mark::Line, {}, {}, -1}}, logarithmic));
  const auto p = circles(plot_svg({{"", {1, 1}, {5, 5}, Mark::Dots, {}, {}, -1}}));
  EXPECT_EQ(p.size(), 2u);
}

TEST(Plot, RefusesVectorsOfDifferentLength) {
  EXPECT_THROW(plot_svg({{"", {0, 1}, {1}, Mark::Line, {}, {}, -1}}), std::invalid_argument);
  EXPECT_THROW(plot_svg({{"", {0, 1}, {1, 2}, Mark::Line, {1}, {2, 3}, -1}}), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::plot_test
