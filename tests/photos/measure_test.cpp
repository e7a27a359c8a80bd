// The whole way from photographs with known truth to markers, probe and force.

#include "photos/measure.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "photos/follow.hpp"
#include "support/marker_truth.hpp"

namespace pliant::test::measure_test {
namespace {

constexpr double greatest_mean_error = 0.1;  // [pixels]

void tell(const std::string& what, const MarkerErrors& errors, const PhotoFigures& figures) {
  std::printf(
      "%-8s %3d of %3d seen, %d wrong, %d unclear; error %.3f px mean, %.3f greatest; chi^2 %.2f; rms %.3f px, "
      "noise factor %.2f, middles moved by up to %.3f px\n",
      what.c_str(), errors.seen, errors.markers, errors.wrong, figures.ambiguous, errors.mean, errors.greatest,
      errors.chi_squared, figures.rms, figures.noise_factor, figures.greatest_bias);
}

/// Two hundred dots through lenses with noise, pushed in by several spacings: none wrong, each within its deviation.
TEST(MeasureMarkers, TwoHundredDotsUnderDeepPresses) {
  PhotoExampleOptions options;
  options.width = 1296;
  options.height = 864;
  options.depths = {0.012, 0.036};
  const PhotoExample example(options);
  PhotoQuality quality;
  quality.samples = 2;  // enough here, and twice as fast
  const MarkerMeasurement measured = measure_example(example, quality);
  const Points dots = dot_centres(example.scene(0));
  const MarkerErrors rest = marker_errors(example, measured, 0, dots);
  tell("rest", rest, measured.rest_figures);
  EXPECT_GE(rest.seen, 195);
  EXPECT_EQ(rest.wrong, 0);
  EXPECT_LT(rest.mean, greatest_mean_error);
  const double spacing = spacing_of(measured.rest.positions);
  for (const MeasuredPress& press : measured.presses) {
    const int number = press.press.number;
    const MarkerErrors errors = marker_errors(example, measured, number, dots);
    tell("press " + std::to_string(number), errors, press.figures);
    EXPECT_EQ(press.failure, "");
    EXPECT_EQ(errors.wrong, 0);
    EXPECT_LT(errors.mean, greatest_mean_error);
    EXPECT_GE(errors.seen, 160);
    EXPECT_GT(errors.chi_squared, 0.3);
    EXPECT_LT(errors.chi_squared, 3.0);
    const PaintedScene truth = example.scene(number);
    EXPECT_LT((press.probe.tip - truth.probe->pose.tip).norm(), 5.0 * press.probe.tip_sigma + 1e-4);
    EXPECT_LT(press.probe.direction.cross(truth.probe->pose.direction).norm(), 0.01);
    EXPECT_LT((press.contact - example.contact(number)).norm(), 5e-4);
    EXPECT_NEAR(press.force.force, example.force(number), 0.02);
  }
  EXPECT_GT(spacings_moved(example, measured, 2, spacing), 2.0) << "the test must be a hard one";
}

/// With dots so large that perspective matters, taking it out helps.
TEST(CentreBias, IsWhatPerspectiveDoes) {
  LensCamera camera;
  camera.width = 1000;
  camera.height = 1000;
  camera.camera_matrix << 1000, 0, 500, 0, 1000, 500, 0, 0, 1;
  const Vector3 centre(0.0, 0.0, 0.5), normal = Vector3(1.0, 0.0, -1.0).normalized();
  // On the axis, tilted by 45 degrees about y: the picture reaches from f a / (z - a) to -f a / (z + a), a = r / sqrt
  // 2, and the middle of this ellipse is f a^2 / (z^2 - a^2).
  const double radius = 0.02, a = radius / std::numbers::sqrt2, expected = 1000.0 * a * a / (0.25 - a * a);
  const Vector2 bias = centre_bias(camera, centre, normal, radius);
  EXPECT_NEAR(bias.norm(), expected, 0.01 * expected);
  EXPECT_NEAR(bias.y(), 0.0, 1e-9);
  EXPECT_LT(centre_bias(camera, centre, Vector3(0, 0, -1), radius).norm(), 1e-9);
}

/// What a marker's stated deviation says of the rest also holds where calibration is off by a little.
TEST(MeasureMarkers, DeviationsGrowWithWhatCalibrationLeaves) {
  PhotoExampleOptions options;
  options.dots = 60;
  options.width = 1296;
  options.height = 864;
  options.depths = {};
  const PhotoExample example(options);
  PhotoSession session = example.session();
  const auto photographs = [&](int camera, int number) { return example.photograph(camera, number); };
  const MarkerMeasurement straight = measure_markers(session, photographs);
  session.cameras[1].camera_matrix(0, 2) += 0.4;
  const MarkerMeasurement crooked = measure_markers(session, photographs);
  EXPECT_GT(crooked.rest_figures.rms, 2.0 * straight.rest_figures.rms);
  EXPECT_GT(crooked.rest_figures.deviation, 2.0 * straight.rest_figures.deviation);
  EXPECT_EQ(crooked.rest_figures.seen, straight.rest_figures.seen);
}

}  // namespace
}  // namespace pliant::test::measure_test
