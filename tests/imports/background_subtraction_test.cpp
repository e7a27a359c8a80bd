// An object told from its background: plain and uneven ones, light that changes, objects that stay, and what is no
// object.
#include "imports/background_subtraction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/camera.hpp"
#include "picture_tools.hpp"

namespace pliant::background_subtraction_test {

using namespace test;
using ::testing::HasSubstr;

constexpr int width = 160, height = 120;
constexpr double least_overlap = 0.97;  // a shift of the outline by half a pixel

Rgb grey(double level) {
  const auto value = std::uint8_t(std::clamp(level, 0.0, 255.0));
  return {value, value, value};
}

// How a background looks at a pixel, and how much lighter everything is in a frame.
using Wall = std::function<Rgb(int u, int v)>;

struct Film {
  std::vector<Image<Rgb>> pictures;
  std::vector<Image<std::uint8_t>> truth;
};

Film filmed(const std::vector<Vector2>& places, const Wall& wall, const Rgb& object, double flicker = 0.0) {
  Film film;
  for (unsigned k = 0; k < places.size(); ++k) {
    film.truth.push_back(ring_mask(width, height, places[k].x(), places[k].y(), 22.0));
    const Image<std::uint8_t>& mask = film.truth.back();
    const double light = flicker * (int(k % 3) - 1);
    film.pictures.push_back(painted(
        width, height,
        [&](int u, int v) {
          Rgb colour = mask(u, v) != 0 ? object : wall(u, v);
          for (std::uint8_t& c : colour) c = std::uint8_t(std::clamp(c + light, 0.0, 255.0));
          return colour;
        },
        3.0, k + 1));
  }
  return film;
}

// Falls for a while, and lies where it fell.
std::vector<Vector2> fall_and_rest(int frames, int rests) {
  std::vector<Vector2> places;
  for (int i = 0; i < frames; ++i)
    places.push_back({60.0 + i, 30.0 + 55.0 * std::min(1.0, double(i) / (frames - rests))});
  return places;
}

void expect_truth(const BackgroundSubtraction& subtraction, const Film& film) {
  ASSERT_TRUE(subtraction.tells_object());
  for (std::size_t k = 0; k < film.pictures.size(); ++k) {
    const Image<std::uint8_t> mask = subtraction.mask(film.pictures[k]);
    EXPECT_GT(intersection_over_union(mask, film.truth[k]), least_overlap) << "picture " << k;
    EXPECT_EQ(doubt_about(mask), "");
  }
}

TEST(BackgroundSubtraction, TellsDarkFromLightLightFromDarkAndColourFromGrey) {
  for (const auto& [wall, object] : {std::pair{Rgb{200, 205, 210}, Rgb{90, 80, 70}},
                                     {Rgb{30, 35, 30}, Rgb{180, 180, 170}},
                                     {Rgb{128, 128, 128}, Rgb{200, 90, 90}}}) {
    const Film film = filmed(
        fall_and_rest(12, 3), [colour = wall](int, int) { return colour; }, object);
    const BackgroundSubtraction subtraction(film.pictures, {});
    EXPECT_EQ(subtraction.kind(), BackgroundKind::Plain);
    expect_truth(subtraction, film);
  }
}

TEST(BackgroundSubtraction, FollowsLightThatIsUnevenAndFlickersBehindAnObjectThatStays) {
  // Darker towards a corner by 80 levels, and from picture to picture by 40; the object never leaves its place.
  const Wall wall = [](int u, int v) { return grey(200.0 - 0.2 * u - 0.3 * v - 2e-3 * u * u / 4.0); };
  const Film film = filmed(std::vector<Vector2>(9, {80.0, 60.0}), wall, grey(90.0), 40.0);
  const BackgroundSubtraction subtraction(film.pictures, {});
  EXPECT_EQ(subtraction.kind(), BackgroundKind::Plain);
  expect_truth(subtraction, film);
}

TEST(BackgroundSubtraction, TakesAStillSceneWhereTheBorderIsNotPlain) {
  // A dark table below, stripes on the wall; the ring is in no place for half of the pictures.
  const Wall room = [](int u, int v) { return v > 95 ? Rgb{70, 50, 30} : grey(u / 10 % 2 ? 150.0 : 180.0); };
  std::vector<Vector2> places;
  for (int i = 0; i < 15; ++i) places.push_back({30.0 + 7.0 * i, 25.0 + 5.0 * i});
  const Film film = filmed(places, room, {40, 200, 60});
  const BackgroundSubtraction subtraction(film.pictures, {});
  EXPECT_EQ(subtraction.kind(), BackgroundKind::Still);
  expect_truth(subtraction, film);
  // One that stays is part of such a scene; a picture without it tells.
  const Film resting = filmed(fall_and_rest(12, 9), room, {40, 200, 60});
  BackgroundChoice choice;
  EXPECT_LT(intersection_over_union(BackgroundSubtraction(resting.pictures, choice).mask(resting.pictures.back()),
                                    resting.truth.back()),
            0.5);
  choice.kind = BackgroundKind::Given;
  choice.empty = painted(width, height, room, 3.0, 99);
  expect_truth(BackgroundSubtraction(resting.pictures, choice), resting);
}

TEST(BackgroundSubtraction, KeepsTheLargestRegionWithItsHoleAndFillsSpecks) {
  const Image<std::uint8_t> ring = ring_mask(width, height, 80.0, 60.0, 25.0);
  const auto scene = [&](int u, int v) {
    const bool is_speck = std::hypot(u - 20, v - 100) < 5.0, is_spot = std::hypot(u - 80, v - 43) < 2.0;
    return grey(is_speck || (ring(u, v) != 0 && !is_spot) ? 60.0 : 200.0);
  };
  const Image<Rgb> picture = painted(width, height, scene, 2.0);
  const Image<std::uint8_t> mask = BackgroundSubtraction({picture}, {}).mask(picture);
  EXPECT_EQ(mask(20, 100), 0);
  EXPECT_EQ(mask(80, 43), 255);
  EXPECT_EQ(mask(80, 60), 0);
  EXPECT_GT(intersection_over_union(mask, ring), least_overlap);
}

TEST(BackgroundSubtraction, TakesAGivenThreshold) {
  const Film film = filmed(
      fall_and_rest(6, 1), [](int, int) { return grey(200.0); }, grey(150.0));
  BackgroundChoice choice;
  choice.threshold = 25.0;
  EXPECT_EQ(BackgroundSubtraction(film.pictures, choice).threshold(), 25.0);
  expect_truth(BackgroundSubtraction(film.pictures, choice), film);
  choice.threshold = 80.0;
  EXPECT_THAT(doubt_about(BackgroundSubtraction(film.pictures, choice).mask(film.pictures[0])),
              HasSubstr("only 0 pixels"));
}

TEST(BackgroundSubtraction, SeesNoObjectInNoise) {
  const Film empty = filmed(
      fall_and_rest(6, 1), [](int, int) { return grey(200.0); }, grey(200.0));
  EXPECT_FALSE(BackgroundSubtraction(empty.pictures, {}).tells_object());
  const Film faint = filmed(
      fall_and_rest(6, 1), [](int, int) { return grey(200.0); }, grey(190.0));
  EXPECT_FALSE(BackgroundSubtraction(faint.pictures, {}).tells_object());
}

TEST(BackgroundSubtraction, DoubtsMasksOfNothingOfEverythingAndOfTheBorder) {
  EXPECT_THAT(doubt_about(Image<std::uint8_t>(width, height)), HasSubstr("only 0 pixels"));
  EXPECT_THAT(doubt_about(Image<std::uint8_t>(width, height, 255)), HasSubstr("100 % of the picture"));
  Image<std::uint8_t> frame(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) frame(u, v) = u < 9 || v < 9 || u >= width - 9 ? 255 : 0;
  EXPECT_THAT(doubt_about(frame), HasSubstr("of the picture's border"));
  EXPECT_EQ(doubt_about(ring_mask(width, height, 80.0, 60.0, 22.0)), "");
}

}  // namespace pliant::background_subtraction_test
