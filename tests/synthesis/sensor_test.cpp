#include "synthesis/sensor.hpp"

#include <cmath>

#include "geometry/primitives.hpp"

namespace pliant::sensor_test {
namespace {

constexpr double metres_per_unit = 1e-4;

PinholeCamera camera_of(int width, int height) {
  return {width, height, 200, 200, (width - 1) / 2.0, (height - 1) / 2.0, {}};
}

// A wall across the whole view, `distance` away, with an optional ball in front of it.
RayScene wall(double distance, bool ball = false) {
  RayScene scene;
  TriangleMesh sphere = make_sphere(0.1, 4);
  for (Vector3& vertex : sphere.vertices) vertex += Vector3(0, 0, ball ? distance - 0.4 : -10.0);
  scene.add(sphere);
  TriangleMesh plane{{{-9, -9, distance}, {-9, 9, distance}, {9, 9, distance}, {9, -9, distance}},
                     {{0, 1, 2}, {0, 2, 3}}};
  scene.add(plane);
  return scene;
}

SensedFrame look(const RayScene& scene, const SensorModel& sensor, int frame = 0, std::uint64_t seed = 1) {
  return sense(scene, 0, camera_of(160, 120), sensor, 1.0 / metres_per_unit, seed, 0, frame);
}

// Readings of a flat wall [m]; without those that are lost.
std::vector<double> readings(const SensedFrame& frame) {
  std::vector<double> values;
  for (const std::uint16_t raw : frame.depth.pixels)
    if (raw > 0) values.push_back(raw * metres_per_unit);
  return values;
}

struct Moments {
  double mean, deviation;
};
Moments moments(const std::vector<double>& values) {
  double sum = 0.0, squares = 0.0;
  for (const double v : values) sum += v;
  const double mean = sum / double(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return {mean, std::sqrt(squares / double(values.size()))};
}

// Correlation of the readings' errors at a distance of some pixels.
double correlation(const SensedFrame& frame, double truth, int du, int dv) {
  double product = 0.0, square = 0.0;
  int count = 0, all = 0;
  for (int v = 0; v < frame.depth.height; ++v)
    for (int u = 0; u < frame.depth.width; ++u) {
      const double error = frame.depth(u, v) * metres_per_unit - truth;
      square += error * error, ++all;
      if (!frame.depth.contains(u + du, v + dv)) continue;
      product += error * (frame.depth(u + du, v + dv) * metres_per_unit - truth), ++count;
    }
  return (product / count) / (square / all);
}

TEST(CounterNumbers, AreUniformAndNormalAndDifferByEveryCounter) {
  std::vector<double> uniform, normal;
  for (std::uint64_t i = 0; i < 20000; ++i)
    uniform.push_back(counter_uniform(5, 1, 2, i)), normal.push_back(counter_normal(5, 1, 2, i));
  EXPECT_NEAR(moments(uniform).mean, 0.5, 0.01);
  EXPECT_NEAR(moments(uniform).deviation, std::sqrt(1.0 / 12.0), 0.005);
  EXPECT_NEAR(moments(normal).mean, 0.0, 0.03);
  EXPECT_NEAR(moments(normal).deviation, 1.0, 0.02);
  EXPECT_NE(counter_uniform(5, 1, 2, 3), counter_uniform(6, 1, 2, 3));
  EXPECT_NE(counter_uniform(5, 1, 2, 3), counter_uniform(5, 2, 2, 3));
  EXPECT_NE(counter_uniform(5, 1, 2, 3), counter_uniform(5, 1, 3, 3));
}

TEST(Sensor, TheIdealOneReadsTheTruthToItsUnit) {
  const SensedFrame frame = look(wall(1.2345), sensor_preset("ideal"));
  for (const std::uint16_t raw : frame.depth.pixels) EXPECT_EQ(raw, 12345);
}

TEST(Sensor, MaskShowsTheObjectAlone) {
  const SensedFrame frame = look(wall(1.2, true), sensor_preset("structured-light"));
  EXPECT_EQ(frame.mask(80, 60), 255);
  EXPECT_EQ(frame.mask(5, 5), 0);
  int inside = 0;
  for (const auto m : frame.mask.pixels) inside += m > 0;
  const double radius = 200.0 * 0.1 / std::sqrt(0.8 * 0.8 - 0.1 * 0.1);
  EXPECT_NEAR(inside, std::numbers::pi * radius * radius, 0.02 * inside);
}

TEST(Sensor, NoiseHasTheStatedDeviationAtEveryDistance) {
  SensorModel sensor;
  sensor.noise_base = 0.002, sensor.noise_growth = 0.004, sensor.noise_reference = 0.5;
  for (const double distance : {0.4, 1.0, 2.5}) {
    const Moments m = moments(readings(look(wall(distance), sensor)));
    EXPECT_NEAR(m.mean, distance, 4.0 * sensor.noise(distance) / std::sqrt(160.0 * 120.0));
    EXPECT_NEAR(m.deviation, sensor.noise(distance), 0.03 * sensor.noise(distance));
  }
  EXPECT_DOUBLE_EQ(sensor.noise(0.2), 0.002);
  EXPECT_DOUBLE_EQ(sensor.noise(1.5), 0.006);
}

TEST(Sensor, SharedNoiseKeepsTheVarianceAndCorrelatesNeighbours) {
  SensorModel sensor;
  sensor.noise_base = 0.005, sensor.correlation_length = 1.5;
  EXPECT_NEAR(correlation(look(wall(1.0), sensor), 1.0, 1, 0), 0.0, 0.03);
  sensor.correlated_part = 0.5;
  const SensedFrame frame = look(wall(1.0), sensor);
  EXPECT_NEAR(moments(readings(frame)).deviation, 0.005, 0.05 * 0.005);
  // two Gaussian filters of length L: exp(-d^2 / (4 L^2)) of the shared part
  const double expected = 0.5 * std::exp(-1.0 / (4.0 * 1.5 * 1.5));
  EXPECT_NEAR(correlation(frame, 1.0, 1, 0), expected, 0.04);
  EXPECT_NEAR(correlation(frame, 1.0, 0, 1), expected, 0.04);
  EXPECT_NEAR(correlation(frame, 1.0, 12, 0), 0.0, 0.05);
}

TEST(Sensor, ReadingsAreWholeSteps) {
  SensorModel sensor = sensor_preset("ideal");
  sensor.noise_base = 0.01, sensor.step = 0.004;
  for (const double value : readings(look(wall(1.0), sensor))) {
    const double steps = value / 0.004;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
  }
}

TEST(Sensor, HolesAreAsFrequentAsStated) {
  SensorModel sensor;
  sensor.hole_rate = 0.1;
  const double kept = double(readings(look(wall(1.0), sensor)).size()) / (160.0 * 120.0);
  EXPECT_NEAR(kept, 0.9, 0.01);
}

TEST(Sensor, EdgesLoseReadingsOrFlyBetweenFrontAndBack) {
  SensorModel sensor;
  sensor.edge_flying = 1.0;
  const RayScene scene = wall(1.2, true);
  const auto between = [&](const SensedFrame& frame) {
    int count = 0;
    for (const double z : readings(frame)) count += z > 0.83 && z < 1.19;
    return count;
  };
  EXPECT_EQ(between(look(scene, sensor_preset("ideal"))), 0);
  const int flying = between(look(scene, sensor));
  EXPECT_GT(flying, 80);  // the outline is about 160 pixels long, seen from both sides
  sensor.edge_loss = 1.0;
  const SensedFrame lost = look(scene, sensor);
  EXPECT_EQ(between(lost), 0);
  EXPECT_GT(160 * 120 - int(readings(lost).size()), 120);
}

TEST(Sensor, ObliqueSurfacesHaveNoReading) {
  SensorModel sensor;
  sensor.grazing_angle = 45.0 * std::numbers::pi / 180.0;
  const RayScene scene = wall(1.2, true);
  const SensedFrame all = look(scene, {}), steep = look(scene, sensor);
  int seen = 0, kept = 0;
  for (size_t i = 0; i < all.mask.pixels.size(); ++i)
    if (all.mask.pixels[i]) seen += all.depth.pixels[i] > 0, kept += steep.depth.pixels[i] > 0;
  EXPECT_NEAR(double(kept) / seen, 0.5, 0.07);  // sin^2 45 degrees for a distant ball
}

TEST(Sensor, JitterMovesTheOutlineButNotTheMask) {
  SensorModel sensor;
  sensor.lateral_jitter = 1.0;
  const RayScene scene = wall(1.2, true);
  const SensedFrame sharp = look(scene, {}), jittered = look(scene, sensor);
  EXPECT_EQ(sharp.mask.pixels, jittered.mask.pixels);
  int changed = 0;
  for (size_t i = 0; i < sharp.depth.pixels.size(); ++i)
    changed += std::abs(int(sharp.depth.pixels[i]) - int(jittered.depth.pixels[i])) > 1000;
  EXPECT_GT(changed, 20);
}

TEST(Sensor, FollowsFromSeedCameraAndFrameAlone) {
  const SensorModel sensor = sensor_preset("structured-light");
  const RayScene scene = wall(1.2, true);
  EXPECT_EQ(look(scene, sensor).depth.pixels, look(scene, sensor).depth.pixels);
  EXPECT_NE(look(scene, sensor, 0).depth.pixels, look(scene, sensor, 1).depth.pixels);
  EXPECT_NE(look(scene, sensor, 0, 1).depth.pixels, look(scene, sensor, 0, 2).depth.pixels);
}

TEST(Sensor, RefusesSettingsOutOfRange) {
  SensorModel sensor;
  EXPECT_EQ(sensor.validate(), "");
  sensor.edge_loss = 1.5;
  EXPECT_THAT(sensor.validate(), testing::HasSubstr("edge_loss"));
  EXPECT_THROW(look(wall(1.0), sensor), std::invalid_argument);
  sensor = {};
  sensor.noise_base = std::nan("");
  EXPECT_THAT(sensor.validate(), testing::HasSubstr("noise_base"));
  EXPECT_THROW(sensor_preset("perfect"), std::invalid_argument);
  for (const std::string& name : sensor_presets()) EXPECT_EQ(sensor_preset(name).validate(), "");
}

}  // namespace
}  // namespace pliant::sensor_test
