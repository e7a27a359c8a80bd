#include "photos/find_dots.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::find_dots_test {
namespace {

/// An ellipse with its half axes and the turn of the first one.
struct Ellipse {
  Vector2 centre;
  double a, b, turn;
};

/// Ellipses of one colour on another, by 8 x 8 samples a pixel, in light that falls off to the right, with noise.
Image<Rgb> picture(int width, int height, const std::vector<Ellipse>& ellipses, const Eigen::Vector3d& paper,
                   const Eigen::Vector3d& paint, double fall_off, double noise) {
  Image<Rgb> image(width, height);
  std::mt19937 random(7);
  std::normal_distribution<double> grain(0.0, noise);
  constexpr int n = 8;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      std::vector<Ellipse> near;
      for (const Ellipse& e : ellipses)
        if ((e.centre - Vector2(u, v)).norm() < std::max(e.a, e.b) + 1.0) near.push_back(e);
      int covered = 0;
      for (int k = 0; k < n * n && !near.empty(); ++k) {
        const Vector2 place(u - 0.5 + (k % n + 0.5) / n, v - 0.5 + (k / n + 0.5) / n);
        for (const Ellipse& e : near) {
          const Vector2 arm = Eigen::Rotation2Dd(-e.turn) * (place - e.centre);
          covered += std::pow(arm.x() / e.a, 2) + std::pow(arm.y() / e.b, 2) < 1.0;
        }
      }
      const double share = double(covered) / (n * n), light = 1.0 - fall_off * u / width;
      for (int k = 0; k < 3; ++k)
        image(u, v)[std::size_t(k)] = std::uint8_t(std::clamp(
            std::round(light * ((1 - share) * paper[k] + share * paint[k]) + (noise > 0 ? grain(random) : 0)), 0.0,
            255.0));
    }
  return image;
}

const Eigen::Vector3d white(220, 215, 205), black(30, 30, 28), red(200, 40, 35);
const std::vector<Ellipse> some = {
    {{40.37, 35.81}, 7.0, 5.0, 0.5}, {{90.12, 42.55}, 6.0, 6.0, 0.0}, {{150.9, 80.2}, 8.0, 3.5, -1.0}};

double greatest_error(const std::vector<Dot>& dots, const std::vector<Ellipse>& truth) {
  double greatest = 0.0;
  for (const Ellipse& ellipse : truth) {
    double nearest = 1e300;
    for (const Dot& dot : dots) nearest = std::min(nearest, (dot.centre - ellipse.centre).norm());
    greatest = std::max(greatest, nearest);
  }
  return greatest;
}

TEST(FindDots, CentresOfEllipsesInUnevenLight) {
  const std::vector<Dot> dots = find_dots(picture(200, 120, some, white, black, 0.6, 0.0), {.greatest_diameter = 24.0});
  ASSERT_EQ(dots.size(), some.size());
  EXPECT_LT(greatest_error(dots, some), 0.03);
  EXPECT_NEAR(dots[0].diameter, 14.0, 0.5);
  EXPECT_NEAR(dots[0].aspect, 5.0 / 7.0, 0.05);
}

/// The stated sigma is that of the errors: their mean square is within a factor of what is stated.
TEST(FindDots, SigmaIsThatOfTheErrors) {
  std::vector<Ellipse> many;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(-0.5, 0.5);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j)
      many.push_back({{25.0 + 30.0 * i + part(random), 25.0 + 30.0 * j + part(random)}, 6.0, 5.0, part(random)});
  const std::vector<Dot> dots = find_dots(picture(390, 390, many, white, black, 0.3, 6.0), {});
  ASSERT_EQ(dots.size(), many.size());
  double chi = 0.0;
  for (const Dot& dot : dots) {
    double nearest = 1e300;
    for (const Ellipse& e : many) nearest = std::min(nearest, (dot.centre - e.centre).norm());
    ASSERT_LT(nearest, 0.5);
    chi += nearest * nearest / (2.0 * dot.sigma * dot.sigma) / double(dots.size());
  }
  EXPECT_GT(chi, 0.4);
  EXPECT_LT(chi, 2.0);
}

TEST(FindDots, EachColourSeesItsOwn) {
  Image<Rgb> both = picture(200, 120, {some[0]}, white, black, 0.0, 0.0);
  const Image<Rgb> other = picture(200, 120, {some[1]}, white, red, 0.0, 0.0);
  for (int v = 0; v < both.height; ++v)
    for (int u = 70; u < both.width; ++u) both(u, v) = other(u, v);
  FindDotsOptions options;
  options.least_contrast = 0.2;
  const auto dark = find_dots(both, options);
  ASSERT_EQ(dark.size(), 1u);
  EXPECT_LT(greatest_error(dark, {some[0]}), 0.05);
  options.colour = DotColour::Red;
  const auto coloured = find_dots(both, options);
  ASSERT_EQ(coloured.size(), 1u);
  EXPECT_LT(greatest_error(coloured, {some[1]}), 0.05);
  options.colour = DotColour::Light;
  EXPECT_TRUE(find_dots(both, options).empty());
  EXPECT_EQ(find_dots(picture(200, 120, some, black, white, 0.0, 0.0), options).size(), 3u);
}

TEST(FindDots, LeavesOutWhatIsNoDot) {
  // A bar, a dot cut by the border, a ring's part: two dots that touch; one of another size.
  const std::vector<Ellipse> none = {{{60.0, 30.0}, 30.0, 2.5, 0.2},
                                     {{198.0, 60.0}, 6.0, 6.0, 0.0},
                                     {{60.0, 80.0}, 6.0, 6.0, 0.0},
                                     {{70.0, 80.0}, 6.0, 6.0, 0.0},
                                     {{120.0, 80.0}, 1.5, 1.5, 0.0}};
  EXPECT_TRUE(find_dots(picture(200, 120, none, white, black, 0.0, 0.0), {}).empty());
  EXPECT_TRUE(find_dots(picture(200, 120, {}, white, black, 0.6, 8.0), {}).empty()) << "noise alone";
}

TEST(FindDots, RefusesBadOptions) {
  EXPECT_THROW(find_dots({}, {}), std::invalid_argument);
  EXPECT_THROW(find_dots(Image<Rgb>(50, 50), {.least_diameter = 9.0, .greatest_diameter = 8.0}), std::invalid_argument);
  EXPECT_THROW(find_dots(Image<Rgb>(50, 50), {.least_contrast = 0.0}), std::invalid_argument);
  EXPECT_FALSE(dot_colour("mauve"));
  EXPECT_EQ(dot_colour("red"), DotColour::Red);
}

TEST(ReadPhotograph, KeepsChannelsInOrderAndRefusesWhatIsNoImage) {
  const TemporaryFolder folder;
  Image<Rgb> image(20, 10);
  image(3, 2) = {10, 20, 30};
  write_png(folder / "a.png", image);
  const Image<Rgb> again = read_photograph(folder / "a.png");
  EXPECT_EQ(again.width, 20);
  EXPECT_EQ(again.pixels, image.pixels);
  EXPECT_THAT(complaint_of([&] { read_photograph(folder.write("b.png", "no image")); }),
              testing::HasSubstr("b.png: is no image"));
  EXPECT_THAT(complaint_of([&] { read_photograph(folder.write("c.png", "")); }), testing::HasSubstr("is no image"));
  EXPECT_THAT(complaint_of([&] { read_photograph(folder / "none.png"); }), testing::HasSubstr("none.png"));
}

}  // namespace
}  // namespace pliant::test::find_dots_test
