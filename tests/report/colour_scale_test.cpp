#include "report/colour_scale.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <pugixml.hpp>

#include "report/report.hpp"

namespace pliant::colour_scale_test {
namespace {

using testing::DoubleEq;
using testing::DoubleNear;
using testing::ElementsAre;

TEST(ColourScale, EndsWhereTheValuesDo) {
  const ColourScale scale = colour_scale(std::vector<double>{3e3, NAN, 7e3, 1.5e3}, ScaleEnds::All);
  EXPECT_EQ(scale.low, 1.5e3);
  EXPECT_EQ(scale.high, 7e3);
  EXPECT_FALSE(scale.logarithmic);
  EXPECT_THAT(scale.ticks(),
              ElementsAre(DoubleEq(2e3), DoubleEq(3e3), DoubleEq(4e3), DoubleEq(5e3), DoubleEq(6e3), DoubleEq(7e3)));
}

TEST(ColourScale, IsLogarithmicBeyondADecade) {
  EXPECT_FALSE(colour_scale(std::vector<double>{1e3, 9.9e3}, ScaleEnds::All).logarithmic);
  EXPECT_FALSE(colour_scale(std::vector<double>{0.0, 9.9e3}, ScaleEnds::All).logarithmic);
  const ColourScale scale = colour_scale(std::vector<double>{1e3, 1e5}, ScaleEnds::All);
  ASSERT_TRUE(scale.logarithmic);
  EXPECT_NEAR(scale.place(1e4), 0.5, 1e-12);
  EXPECT_THAT(scale.ticks(),
              testing::IsSupersetOf({DoubleNear(1e3, 1e-6), DoubleNear(1e4, 1e-6), DoubleNear(1e5, 1e-6)}));
  EXPECT_TRUE(std::isnan(scale.place(-1.0)));
}

TEST(ColourScale, OneHotSpotDoesNotDarkenTheRest) {
  std::vector<double> values(1000, 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = double(i) / 1000.0;
  values[500] = 1e6;
  const ColourScale scale = colour_scale(values, ScaleEnds::FromZero);
  EXPECT_EQ(scale.low, 0.0);
  EXPECT_NEAR(scale.high, 0.99, 0.01);
  EXPECT_EQ(scale.colour(1e6), sequential_colour(1.0));
  EXPECT_EQ(scale.colour(0.0), sequential_colour(0.0));
  EXPECT_EQ(scale.colour(NAN), sequential_colour(NAN)) << "grey";
}

TEST(ColourScale, ThereIsAlwaysOne) {
  for (const std::vector<double>& values : {std::vector<double>{}, {NAN}, {0.0, 0.0}, {5.0}, {1e9, 1e9}})
    for (const ScaleEnds ends : {ScaleEnds::FromZero, ScaleEnds::All}) {
      const ColourScale scale = colour_scale(values, ends);
      EXPECT_LT(scale.low, scale.high);
      EXPECT_TRUE(std::isfinite(scale.place(0.0)));
    }
}

TEST(ColourBar, HasRoundNumbersWhereTheyBelong) {
  pugi::xml_document svg;
  const ColourScale scale{0.0, 25'000.0};
  ASSERT_TRUE(svg.load_string(colour_bar_svg(scale, "von Mises stress", "Pa", "bar").c_str()));
  const pugi::xml_node root = svg.child("svg"), rect = root.child("rect");
  std::vector<std::string> texts;
  std::vector<double> places;
  for (const pugi::xml_node text : root.children("text")) {
    texts.emplace_back(text.text().get());
    places.push_back((text.attribute("x").as_double() - rect.attribute("x").as_double()) /
                     rect.attribute("width").as_double());
  }
  EXPECT_THAT(texts, ElementsAre("von Mises stress [kPa]", "0", "5", "10", "15", "20", "25"));
  EXPECT_THAT(std::vector(places.begin() + 1, places.end()),
              testing::Pointwise(DoubleNear(1e-3), {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}));
  EXPECT_EQ(std::string(rect.attribute("fill").value()), "url(#bar)");
  ASSERT_TRUE(svg.child("svg").child("defs").find_child_by_attribute("id", "bar"));
}

}  // namespace
}  // namespace pliant::colour_scale_test
