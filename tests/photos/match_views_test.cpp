#include "photos/match_views.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <set>
#include <stdexcept>

#include "rays/look_at.hpp"

namespace pliant::test::match_views_test {
namespace {

std::vector<LensCamera> some_cameras(int count) {
  std::vector<LensCamera> cameras;
  for (int c = 0; c < count; ++c) {
    const Vector3 eye = Eigen::AngleAxisd(2.0 * c, Vector3::UnitZ()) * Vector3(0.35, 0.05 * c, 0.8);
    const PinholeCamera pinhole = look_at(eye, Vector3::Zero(), Vector3::UnitY(), 1200, 900, 0.5);
    LensCamera camera;
    camera.width = 1200;
    camera.height = 900;
    camera.camera_matrix << pinhole.fx, 0, pinhole.cx, 0, pinhole.fy, pinhole.cy, 0, 0, 1;
    camera.world_to_camera = pinhole.camera_to_world.inverse();
    cameras.push_back(camera);
  }
  return cameras;
}

std::vector<Vector3> scattered(int count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  std::vector<Vector3> points;
  for (int i = 0; i < count; ++i) points.emplace_back(0.1 * part(random), 0.1 * part(random), 0.03 * part(random));
  return points;
}

/// What each camera sees of points, with noise; dot i is point i.
std::vector<ViewDots> seen(const std::vector<LensCamera>& cameras, const std::vector<Vector3>& points, double noise,
                           unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> grain(0.0, 1.0);
  std::vector<ViewDots> views(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c)
    for (const Vector3& point : points) {
      const Vector2 pixel = project_without_lens(cameras[c], point);
      views[c].pixels.push_back(pixel + noise * Vector2(grain(random), grain(random)));
      views[c].sigmas.push_back(std::max(noise, 0.01));
    }
  return views;
}

bool is_true(const Sighting& s) {
  std::set<int> dots(s.dots.begin(), s.dots.end());
  dots.erase(-1);
  return dots.size() == 1;
}

TEST(Triangulate, FindsThePlaceWithoutNoise) {
  const auto cameras = some_cameras(3);
  const auto points = scattered(20);
  const auto views = seen(cameras, points, 0.0);
  for (int i = 0; i < 20; ++i) {
    const Sighting three = triangulate(cameras, views, {i, i, i}), two = triangulate(cameras, views, {-1, i, i});
    EXPECT_LT((three.position - points[std::size_t(i)]).norm(), 1e-12);
    EXPECT_LT((two.position - points[std::size_t(i)]).norm(), 1e-10);
    EXPECT_LT(three.rms, 1e-8);
    EXPECT_EQ(two.degrees_of_freedom(), 1);
  }
}

/// Errors over stated deviations are those of a normal distribution, in all three directions together.
TEST(Triangulate, CovarianceIsThatOfTheErrors) {
  const auto cameras = some_cameras(3);
  const auto points = scattered(400);
  const auto views = seen(cameras, points, 0.2);
  double chi = 0.0, residual = 0.0;
  for (int i = 0; i < 400; ++i) {
    const Sighting s = triangulate(cameras, views, {i, i, i});
    const Vector3 error = s.position - points[std::size_t(i)];
    chi += error.dot(s.covariance.inverse() * error) / (3.0 * 400.0);
    residual += s.chi_squared / (3.0 * 400.0);
  }
  constexpr double band = 0.15;  // three deviations of a mean over 1200 squares
  EXPECT_NEAR(chi, 1.0, band);
  EXPECT_NEAR(residual, 1.0, band);
}

/// Two hundred dots, a tenth of them hidden in each view: nothing wrong is taken, nearly all that can be is.
TEST(Resolve, TakesNothingWrong) {
  const auto cameras = some_cameras(3);
  const auto points = scattered(200);
  auto views = seen(cameras, points, 0.08);
  std::mt19937 random(9);
  int whole = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    bool all = true;
    for (ViewDots& view : views)
      if (random() % 10 == 0) {
        view.pixels[i].setConstant(std::numeric_limits<double>::quiet_NaN());
        all = false;
      }
    whole += all;
  }
  const auto all = possible_sightings(cameras, views, {});
  EXPECT_GT(int(all.size()), whole) << "false sets are there to be told apart";
  const ResolvedSightings resolved = resolve(all, 1.0);
  EXPECT_TRUE(std::ranges::all_of(resolved.sure, is_true));
  EXPECT_GE(int(resolved.sure.size()), whole * 95 / 100);
}

TEST(Resolve, TellsWhatIsAmbiguous) {
  const auto cameras = some_cameras(3);
  std::vector<Vector3> points = scattered(6);
  auto views = seen(cameras, points, 0.05);
  // A second dot beside that of point 2 in one view, as near to where it should be as the right one.
  views[1].pixels.push_back(project_without_lens(cameras[1], points[2]) -
                            (views[1].pixels[2] - project_without_lens(cameras[1], points[2])));
  views[1].sigmas.push_back(0.05);
  const ResolvedSightings resolved = resolve(possible_sightings(cameras, views, {}), 1.0);
  EXPECT_EQ(resolved.sure.size(), 5u);
  EXPECT_TRUE(std::ranges::none_of(resolved.sure, [](const Sighting& s) { return s.dots[0] == 2; }));
  EXPECT_EQ(resolved.open.size(), 2u);
  EXPECT_EQ(resolved.ambiguous_dots(), 4);
}

TEST(PossibleSightings, FourCamerasAndTwoAreEnough) {
  const auto four = some_cameras(4);
  const auto points = scattered(30);
  auto views = seen(four, points, 0.05);
  views[2].pixels[7].setConstant(std::numeric_limits<double>::quiet_NaN());
  ResolvedSightings resolved = resolve(possible_sightings(four, views, {}), 1.0);
  EXPECT_TRUE(std::ranges::all_of(resolved.sure, is_true));
  EXPECT_EQ(resolved.sure.size(), 30u);
  EXPECT_EQ(std::ranges::count(resolved.sure, 3, &Sighting::view_count), 1);
  const auto two = some_cameras(2);
  resolved = resolve(possible_sightings(two, seen(two, {points[0], points[1]}, 0.05), {1.0, 2, {}}), 1.0);
  EXPECT_EQ(resolved.sure.size(), 2u);
  EXPECT_THROW((void)possible_sightings(two, views, {}), std::invalid_argument);
}

TEST(PossibleSightings, HonoursWhereTheObjectMayBe) {
  const auto cameras = some_cameras(3);
  const auto views = seen(cameras, scattered(30), 0.05);
  EXPECT_TRUE(possible_sightings(cameras, views, {1.0, 3, [](const Vector3& p) { return p.z() > 0.2; }}).empty());
}

TEST(NoiseFactor, IsWhatPosesAddToTheDots) {
  const auto cameras = some_cameras(3);
  const auto points = scattered(200);
  auto views = seen(cameras, points, 0.3);
  for (ViewDots& view : views) std::ranges::fill(view.sigmas, 0.1);
  std::vector<Sighting> all;
  for (int i = 0; i < 200; ++i) all.push_back(triangulate(cameras, views, {i, i, i}));
  EXPECT_NEAR(noise_factor(all), 3.0, 0.3);
  EXPECT_EQ(noise_factor({}), 1.0);
}

}  // namespace
}  // namespace pliant::test::match_views_test
