// The first loading of tests whose truth is known: a rubber of 1 MPa between grips, a ball on a half-space.
#include "imports/first_loading.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "input_errors.hpp"

namespace pliant::first_loading_test {

using namespace test;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double length = 0.05, area = 4e-5;
constexpr double bin = 1e-4;     // [m] by which means over the last rows may be short
constexpr double noise = 0.004;  // [N] of a greatest force of 9.4 N

double rubber(double extension) {
  const double stretch = 1.0 + extension / length;
  return area * 1e6 / 3.0 * (stretch - 1.0 / (stretch * stretch));
}
double ball(double depth) { return 4.0 / 3.0 * 25e3 * 0.1 * std::pow(std::max(0.0, depth), 1.5); }

struct Recorded {
  std::vector<double> extensions, forces;
  std::mt19937 random{3};

  void add(double extension, double force, double scatter = noise) {
    extensions.push_back(extension);
    forces.push_back(force + std::normal_distribution<>(0.0, scatter)(random));
  }
  // Up to an extension and, where `soft` is not zero, back.
  void pull(double from, double to, int rows, double soft = 1.0) {
    for (int i = 0; i < rows; ++i) {
      const double e = from + (to - from) * i / (rows - 1);
      add(e, soft * rubber(e));
    }
  }
};

// Farthest that a curve is from the rubber's, over its deviation.
double worst_miss(const LoadingCurve& curve) {
  double worst = 0.0;
  for (std::size_t i = 0; i < curve.forces.size(); ++i)
    worst = std::max(worst, std::abs(curve.forces[i] - rubber(curve.extensions[i])) / curve.stds[i]);
  return worst;
}

// Of the slope up to a tenth of strain, against the rubber's.
double slope_error(const LoadingCurve& curve) {
  double measured = 0.0, true_ones = 0.0;
  for (std::size_t i = 0; i < curve.forces.size() && curve.extensions[i] < 0.1 * length; ++i)
    measured += curve.forces[i], true_ones += rubber(curve.extensions[i]);
  return measured / true_ones - 1.0;
}

LoadingCurve loading(const Recorded& test, const LoadingOptions& options = {}) {
  return first_loading(test.extensions, test.forces, options, "pull");
}

TEST(FirstLoading, IsTheFirstOfEqualCycles) {
  Recorded test;
  for (int cycle = 0; cycle < 3; ++cycle) {
    const double peak = 0.015 * (1.0 + 5e-4 * cycle);
    test.pull(0.0, peak, 150, cycle == 0 ? 1.0 : 0.7);
    test.pull(peak, 0.0, 150, 0.6);
  }
  const LoadingCurve curve = loading(test);
  EXPECT_NEAR(curve.extensions.back(), 0.015, bin);
  EXPECT_LT(worst_miss(curve), 3.5);
  EXPECT_THAT(curve.notes, Contains(HasSubstr("goes back 3 times")));
}

TEST(FirstLoading, OfGrowingCyclesIsWhatGoesBeyondAllBefore) {
  Recorded test;
  double worst = 0.0;
  for (const double peak : {0.005, 0.01, 0.015})
    for (int cycle = 0; cycle < 3; ++cycle) {
      for (int i = 0; i < 80; ++i) {
        const double e = peak * i / 79.0;
        test.add(e, (e > worst ? 1.0 : 0.7) * rubber(e));
      }
      test.pull(peak, 0.0, 80, 0.6);
      worst = peak;
    }
  const LoadingCurve curve = loading(test);
  EXPECT_NEAR(curve.extensions.back(), 0.015, bin);
  EXPECT_GT(curve.extensions.size(), 60u);
  EXPECT_LT(worst_miss(curve), 3.5);
  EXPECT_THAT(curve.notes, Contains(HasSubstr("3 cycles")));
}

TEST(FirstLoading, LeavesOutTheRelaxationOfAHold) {
  Recorded test;
  test.pull(0.0, 0.01, 100);
  for (int i = 0; i < 200; ++i) test.add(0.01, (0.8 + 0.2 * std::exp(-0.05 * i)) * rubber(0.01));
  EXPECT_LT(worst_miss(loading(test)), 3.5);
}

TEST(FirstLoading, TakesSlackOffUnlessItIsToBeKept) {
  Recorded test;
  for (int i = 0; i < 39; ++i) test.add(0.002 * i / 39.0, 0.0);
  for (int i = 0; i < 300; ++i) test.add(0.002 + 0.015 * i / 299.0, rubber(0.015 * i / 299.0));
  const LoadingCurve curve = loading(test);
  EXPECT_NEAR(curve.extensions.back(), 0.015, bin);
  EXPECT_LT(worst_miss(curve), 4.0);
  EXPECT_THAT(curve.notes, Contains(HasSubstr("slack")));
  LoadingOptions options;
  options.keeps_extension_zero = true;
  EXPECT_NEAR(loading(test, options).extensions.back(), 0.017, bin);
}

TEST(FirstLoading, CarriesAFootBackToWhereTheRiseBegins) {
  Recorded test;  // grips that tighten over 1 mm
  const auto tightened = [](double e) { return 0.0003 * std::log1p(std::exp((e - 0.001) / 0.0003)); };
  for (int i = 0; i < 400; ++i) test.add(0.016 * i / 399.0, rubber(tightened(0.016 * i / 399.0)));
  const LoadingCurve curve = loading(test);
  EXPECT_NEAR(curve.extensions.back(), 0.015, 1e-4);
  EXPECT_NEAR(slope_error(curve), 0.0, 0.02);
}

TEST(FirstLoading, DoesNotTakeAGradualRiseForSlack) {
  Recorded test;  // a tissue that stiffens
  for (int i = 0; i < 300; ++i) test.add(0.015 * i / 299.0, 0.5 * std::expm1(4.0 * i / 299.0));
  const LoadingCurve curve = loading(test);
  EXPECT_NEAR(curve.extensions.back(), 0.015, bin);
  EXPECT_THAT(curve.notes, Not(Contains(HasSubstr("slack"))));
}

TEST(FirstLoading, CountsForcesFromThatAtNoExtension) {
  Recorded test;
  for (int i = 0; i < 300; ++i) test.add(0.015 * i / 299.0, 0.5 + rubber(0.015 * i / 299.0));
  const LoadingCurve curve = loading(test);
  EXPECT_LT(worst_miss(curve), 3.5);
  EXPECT_THAT(curve.notes, Contains(HasSubstr("--keep force-zero")));
  LoadingOptions options;
  options.keeps_force_zero = true;  // a preload: the specimen was pulled before its extension was called zero
  const LoadingCurve preloaded = loading(test, options);
  EXPECT_NEAR(preloaded.extensions.back() - curve.extensions.back(), 0.5 / (area * 1e6 / length), 3e-5);
  EXPECT_NEAR(preloaded.forces.back(), curve.forces.back() + 0.5, 0.02);
}

TEST(FirstLoading, CountsPositionsFromTheFirstRow) {
  for (const double position : {0.12, -0.03, 0.004}) {
    Recorded test;
    for (int i = 0; i < 300; ++i) test.add(position + 0.015 * i / 299.0, rubber(0.015 * i / 299.0));
    const LoadingCurve curve = loading(test);
    EXPECT_NEAR(curve.extensions.back(), 0.015, bin) << position;
    EXPECT_LT(worst_miss(curve), 3.5) << position;
    EXPECT_THAT(curve.notes, Contains(HasSubstr("--keep extension-zero"))) << position;
  }
}

TEST(FirstLoading, BelievesAZeroBeforeTheFirstRowWhereTheForceGoesBackToIt) {
  Recorded test;
  test.pull(0.002, 0.015, 300);
  const LoadingCurve curve = loading(test);
  EXPECT_LT(worst_miss(curve), 3.5);
  EXPECT_NEAR(curve.extensions.back(), 0.015, bin);
}

TEST(FirstLoading, BelievesTheZerosOfACoarseTableOfARubberThatSoftens) {
  Recorded test;  // far rows from a fifteenth of the length on, steepest at the beginning
  for (int i = 3; i < 400; ++i) test.add(0.001 * i, std::pow(0.001 * i, 0.7) * (1.0 + 0.001 * i), 1e-3);
  const LoadingCurve curve = loading(test);
  EXPECT_NEAR(curve.extensions.back(), 0.399, 4e-3);
  EXPECT_THAT(curve.notes, Not(Contains(HasSubstr("--keep"))));
}

TEST(FirstLoading, EndsWhereTheSpecimenBreaks) {
  Recorded test;
  test.pull(0.0, 0.015, 300);
  for (int i = 0; i < 50; ++i) test.add(0.015 + 0.003 * (i + 1) / 50.0, 0.3);
  const LoadingCurve curve = loading(test);
  EXPECT_NEAR(curve.extensions.back(), 0.015, 1e-4);
  EXPECT_THAT(curve.notes, Contains(HasSubstr("--keep break")));
  LoadingOptions options;
  options.keeps_break = true;
  EXPECT_NEAR(loading(test, options).extensions.back(), 0.018, bin);
}

TEST(FirstLoading, FindsTheNoiseThatThereIs) {
  for (const double scatter : {1e-4, 0.01, 0.2}) {
    Recorded test;
    for (int i = 0; i < 100; ++i) test.add(0.015 * i / 99.0, rubber(0.015 * i / 99.0), scatter);
    const LoadingCurve curve = loading(test);
    const double greatest = rubber(0.015), cell = 0.001 * greatest;
    EXPECT_NEAR(curve.stds.front(), std::hypot(scatter, cell), 0.25 * std::hypot(scatter, cell)) << scatter;
    EXPECT_NEAR(curve.stds.back(), std::hypot(scatter, cell, 0.005 * greatest),
                0.25 * std::hypot(scatter, cell, 0.005 * greatest));
  }
  Recorded coarse;  // a file with one digit behind the point
  for (int i = 0; i < 100; ++i) coarse.add(0.015 * i / 99.0, std::round(10.0 * rubber(0.015 * i / 99.0)) / 10.0, 0.0);
  LoadingOptions options;
  options.force_resolution = 0.1;
  EXPECT_GE(loading(coarse, options).stds.front(), 0.1 / std::sqrt(12.0));
}

TEST(FirstLoading, OfAnyDirectionGrows) {
  Recorded test;
  test.pull(0.0, 0.015, 300);
  for (double& e : test.extensions) e = -e;
  for (double& f : test.forces) f = -f;
  const LoadingCurve curve = loading(test);
  EXPECT_EQ(curve.extension_sign, -1.0);
  EXPECT_EQ(curve.force_sign, -1.0);
  EXPECT_LT(worst_miss(curve), 3.5);
}

TEST(FirstLoading, RefusesWhatIsNoTest) {
  EXPECT_THAT(complaint_of([] {
                (void)first_loading({1, 1, 1}, {1, 2, 3}, {}, "still");
              }),
              HasSubstr("does not change"));
  EXPECT_THAT(complaint_of([] {
                (void)first_loading({1, 2, 3}, {1, 1, 1}, {}, "slack");
              }),
              HasSubstr("the same throughout"));
}

// A ball that begins `air` above the surface, or below it where that is negative, with an offset of the force.
Recorded pressed(double air, double offset, double shape_error = 0.0, int rows = 60) {
  Recorded test;
  for (int i = 0; i < rows; ++i) {
    const double z = (0.003 + air) * i / (rows - 1), depth = z - air;
    test.add(z, offset + ball(depth) * (1.0 + shape_error * std::max(0.0, depth) / 0.003), 2e-4);
  }
  return test;
}

LoadingOptions of_a_ball() {
  LoadingOptions options;
  options.is_indentation = true, options.power = 1.5;
  return options;
}

TEST(FirstLoading, FindsTheContactOfABall) {
  for (const double air : {0.003, 0.0005, 0.0, -0.0005})
    for (const double offset : {0.0, 0.05}) {
      if (air < 0.0 && offset > 0.0) continue;  // one curve cannot tell the two apart
      const LoadingCurve curve = loading(pressed(air, offset), of_a_ball());
      EXPECT_NEAR(curve.extensions.back(), 0.003, std::max(3e-5, 3.0 * curve.zero_std)) << air << ", " << offset;
      EXPECT_NEAR(curve.forces.back(), ball(0.003), 0.005) << air << ", " << offset;
      EXPECT_LT(curve.zero_std, 1e-4) << air << ", " << offset;
      EXPECT_GE(curve.extensions.front(), 0.0);
    }
}

TEST(FirstLoading, KnowsHowWellItFindsAContactOfAnObjectThatIsNoHalfSpace) {
  for (const double shape : {-0.15, 0.15}) {
    const LoadingCurve curve = loading(pressed(0.002, 0.0, shape, 30), of_a_ball());
    EXPECT_NEAR(curve.extensions.back(), 0.003, std::max(5e-5, 3.0 * curve.zero_std)) << shape;
  }
}

TEST(FirstLoading, DoesNotLookForAContactBehindAZeroOfForceWhereTheForceIsLinear) {
  Recorded test;  // a hollow object under a ball
  for (int i = 0; i <= 200; ++i) test.add(5e-5 * i, 2000.0 * 5e-5 * i, 1e-4);
  EXPECT_NEAR(loading(test, of_a_ball()).extensions.back(), 0.01, 3e-5);
}

}  // namespace pliant::first_loading_test
