// Frequencies and decays of short, noisy records.
#include "estimation/damped_sinusoid.hpp"

#include <gtest/gtest.h>

#include <random>

#include "support/tolerance.hpp"

namespace pliant::damped_sinusoid_test {
namespace {

using test::tolerance;

struct Record {
  std::vector<double> times;
  VectorX values;
};

/// Frames at 60 Hz, every seventh of them missing.
Record record(int frames, double noise, const std::function<double(double)>& signal) {
  Record r;
  for (int f = 0; f < frames; ++f)
    if (f % 7 != 3) r.times.push_back(2.0 + f / 60.0);
  r.values.resize(Eigen::Index(r.times.size()));
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < r.times.size(); ++i)
    r.values[Eigen::Index(i)] = signal(r.times[i] - r.times[0]) + noise * normal(random);
  return r;
}

double decaying(double t, double omega, double decay, double phase) {
  return std::exp(-decay * t) * std::cos(omega * t + phase);
}

/// Without noise the model is exact: what is left is where the search stops.
TEST(DominantSinusoid, IsExactWithoutNoise) {
  for (const double phase : {0.0, 0.7, 2.0})
    for (const double omega : {9.0, 31.7, 120.0})
      for (const double decay : {0.0, 0.4, 2.0}) {
        const Record r = record(120, 0.0, [&](double t) { return 3.0 + 0.5 * decaying(t, omega, decay, phase); });
        const auto sinusoid = dominant_sinusoid(r.times, r.values, resolvable_band(r.times));
        ASSERT_TRUE(sinusoid);
        EXPECT_NEAR(sinusoid->omega, omega, tolerance(1e-4) * omega) << phase << " " << decay;
        EXPECT_NEAR(sinusoid->decay, decay, tolerance(1e-3)) << phase << " " << omega;
        EXPECT_NEAR(sinusoid->amplitude, 0.5, tolerance(1e-3));
        EXPECT_GT(sinusoid->explained, 1.0 - tolerance(1e-5));
        EXPECT_EQ(rejection_reason(*sinusoid, r.times.size()), "");
      }
}

/// Errors are of the size that the sinusoid's own deviation says.
TEST(DominantSinusoid, KnowsItsDeviationUnderNoise) {
  double sum = 0.0;
  int count = 0;
  for (const double omega : {10.0, 17.0, 33.0, 60.0, 90.0, 130.0})
    for (const double phase : {0.1, 0.9, 1.7, 2.6}) {
      const Record r = record(150, 0.2, [&](double t) { return 1.0 + decaying(t, omega, 1.0, phase); });
      const auto sinusoid = dominant_sinusoid(r.times, r.values, resolvable_band(r.times));
      ASSERT_TRUE(sinusoid);
      EXPECT_EQ(rejection_reason(*sinusoid, r.times.size()), "") << omega << " " << phase;
      EXPECT_NEAR(sinusoid->omega / omega, 1.0, tolerance(0.03));
      sum += std::pow((sinusoid->omega - omega) / sinusoid->deviation, 2);
      ++count;
    }
  // The mean square of two dozen unit deviates, which share their noise.
  EXPECT_GT(sum / count, 0.2);
  EXPECT_LT(sum / count, 3.0);
}

TEST(DominantSinusoid, LeavesOutWhatIsKnown) {
  const auto both = [](double t) { return decaying(t, 30.0, 0.5, 0.3) + 0.2 * decaying(t, 47.0, 1.0, 1.0); };
  const Record r = record(120, 0.02, both);
  const FrequencyBand band = resolvable_band(r.times);
  const auto strong = dominant_sinusoid(r.times, r.values, band);
  ASSERT_TRUE(strong);
  EXPECT_NEAR(strong->omega, 30.0, tolerance(0.3));
  const auto weak = dominant_sinusoid(r.times, r.values, band, {*strong});
  ASSERT_TRUE(weak);
  EXPECT_NEAR(weak->omega, 47.0, tolerance(0.5));
  EXPECT_EQ(rejection_reason(*weak, r.times.size()), "");
}

TEST(DominantSinusoid, IsDoubtedWhereNothingSwings) {
  const auto doubt = [](const Record& r) {
    const auto sinusoid = dominant_sinusoid(r.times, r.values, resolvable_band(r.times));
    return sinusoid ? rejection_reason(*sinusoid, r.times.size()) : "none";
  };
  EXPECT_EQ(doubt(record(120, 0.0, [](double) { return 0.0; })), "none");
  EXPECT_NE(doubt(record(120, 1.0, [](double) { return 0.0; })), "");
  EXPECT_NE(doubt(record(120, 0.01, [](double t) { return std::exp(-3.0 * t); })), "");
  EXPECT_NE(doubt(record(120, 0.01, [](double t) { return decaying(t, 12.0, 9.0, 0.0); })), "");
  EXPECT_NE(doubt(record(120, 0.01, [](double t) { return std::cos(4.0 * t); })), "");  // once to and fro
  EXPECT_EQ(doubt(record(120, 0.01, [](double t) { return decaying(t, 12.0, 2.0, 0.0); })), "");
}

TEST(DominantSinusoid, NeedsTimes) {
  EXPECT_FALSE(dominant_sinusoid({0.0, 0.1, 0.2}, VectorX::Ones(3), {1.0, 2.0}));
  EXPECT_FALSE(dominant_sinusoid({}, {}, resolvable_band({})));
}

}  // namespace
}  // namespace pliant::damped_sinusoid_test
