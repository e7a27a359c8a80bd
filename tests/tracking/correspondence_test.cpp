#include "tracking/correspondence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "base/parallel.hpp"
#include "support/tolerance.hpp"

namespace pliant::correspondence_test {
namespace {

using test::tolerance;

/// Samples of a plate, and points seen of it with noise and outliers.
struct Plate {
  explicit Plate(int count = 400, unsigned seed = 5) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform;
    std::normal_distribution<double> normal;
    constexpr int edge = 24;
    samples.resize(edge * edge, 3);
    for (int i = 0; i < edge; ++i)
      for (int j = 0; j < edge; ++j) samples.row(i * edge + j) << i / double(edge), j / double(edge), 0.0;
    double sum = 0.0;
    for (int k = 0; k < edge * edge; ++k)
      share.push_back(k % 11 == 0 ? 0.0 : 0.5 + uniform(random)), sum += share.back();
    for (double& s : share) s /= sum;
    for (int n = 0; n < count; ++n) {
      const bool is_outlier = n % 10 == 9;
      points.emplace_back(uniform(random), uniform(random),
                          is_outlier ? 2.0 * uniform(random) - 1.0 : 0.01 * normal(random));
      noise.push_back(float(0.005 + 0.02 * uniform(random)));
    }
  }
  CloudView cloud() const { return {points, noise}; }

  Points samples;
  std::vector<double> share;
  std::vector<Vector3> points;
  std::vector<float> noise;
};

MixtureOptions mixture(double sigma = 0.03) { return {sigma, 0.1, 2.0, 1e-3}; }

/// All samples of all points.
struct BruteForce {
  BruteForce(const Plate& plate, const MixtureOptions& o) {
    const Eigen::Index m = plate.samples.rows();
    p.setZero(Eigen::Index(plate.points.size()), m);
    c.precision.setZero(m), c.mass.setZero(m), c.target.setZero(m, 3);
    for (Eigen::Index n = 0; n < p.rows(); ++n) {
      const double s2 = o.sigma * o.sigma + std::pow(double(plate.noise[std::size_t(n)]), 2);
      const Vector3& point = plate.points[std::size_t(n)];
      const double normalisation = std::pow(2.0 * std::numbers::pi * s2, -1.5);
      double sum = o.outlier_share / o.volume;
      for (Eigen::Index k = 0; k < m; ++k) {
        const double d2 = (point - plate.samples.row(k).transpose()).squaredNorm();
        p(n, k) = (1.0 - o.outlier_share) * plate.share[std::size_t(k)] * normalisation * std::exp(-d2 / (2.0 * s2));
        sum += p(n, k);
      }
      p.row(n) /= sum;
      for (Eigen::Index k = 0; k < m; ++k) {
        c.precision[k] += p(n, k) / s2;
        c.mass[k] += p(n, k);
        c.target.row(k) += p(n, k) / s2 * point.transpose();
        c.sum_squares += p(n, k) * (point - plate.samples.row(k).transpose()).squaredNorm();
      }
      c.explained_points += p.row(n).sum();
    }
    for (Eigen::Index k = 0; k < m; ++k)
      if (c.precision[k] > 0.0) c.target.row(k) /= c.precision[k];
  }
  MatrixX p;
  Correspondence c;
};

TEST(Expectation, AgreesWithTheWholeMixture) {
  const Plate plate;
  MixtureOptions options = mixture();
  options.least_posterior = 1e-14;  // nothing that counts is left out
  const BruteForce all(plate, options);
  const Correspondence c = expect(plate.samples, plate.share, plate.cloud(), options);
  EXPECT_LT((c.precision - all.c.precision).norm(), tolerance(1e-10) * all.c.precision.norm());
  EXPECT_LT((c.mass - all.c.mass).norm(), tolerance(1e-10) * all.c.mass.norm());
  EXPECT_LT((c.target - all.c.target).norm(), tolerance(1e-10) * all.c.target.norm());
  EXPECT_NEAR(c.explained_points, all.c.explained_points, tolerance(1e-10) * all.c.explained_points);
  EXPECT_NEAR(c.sum_squares, all.c.sum_squares, tolerance(1e-10) * all.c.sum_squares);
  for (std::size_t n = 0; n < plate.points.size(); ++n) {
    EXPECT_NEAR(c.explained[n], all.p.row(Eigen::Index(n)).sum(), tolerance(1e-6)) << n;  // single precision
    Eigen::Index likeliest = -1;
    if (all.p.row(Eigen::Index(n)).maxCoeff(&likeliest) > 1e-3) {
      EXPECT_EQ(c.likeliest[n], likeliest) << n;
    }
  }
  EXPECT_EQ(c.mass[0], 0.0) << "what cannot be seen explains nothing";
}

/// Each sample that a point leaves out is at most `least_posterior` times as likely as its nearest one, or than that it
/// is an outlier.
TEST(Expectation, LeavesOutNoMoreThanItSays) {
  const Plate plate(60);
  for (const double least : {1e-1, 1e-3, 1e-6}) {
    MixtureOptions options = mixture();
    options.least_posterior = least;
    int left_out = 0, kept = 0;
    for (std::size_t n = 0; n < plate.points.size(); ++n) {
      const CloudView one{std::span(plate.points).subspan(n, 1), std::span(plate.noise).subspan(n, 1)};
      const Correspondence c = expect(plate.samples, plate.share, one, options);
      const double s2 = options.sigma * options.sigma + std::pow(double(plate.noise[n]), 2);
      const VectorX likelihood =
          (-(plate.samples.rowwise() - plate.points[n].transpose()).rowwise().squaredNorm() / (2.0 * s2)).array().exp();
      const double outlier = options.outlier_share / (1.0 - options.outlier_share) / options.volume *
                             std::pow(2.0 * std::numbers::pi * s2, 1.5);
      for (std::size_t k = 0; k < plate.share.size(); ++k) {
        if (plate.share[k] == 0.0) continue;
        if (c.mass[Eigen::Index(k)] > 0.0) {
          ++kept;
          continue;
        }
        ++left_out;
        EXPECT_LE(likelihood[Eigen::Index(k)], least * std::max(likelihood.maxCoeff(), outlier)) << n << ", " << k;
      }
    }
    EXPECT_GT(left_out, 1000);
    EXPECT_GT(kept, 200);
  }
}

TEST(Expectation, APointFarAwayIsAnOutlier) {
  Plate plate(3);
  plate.points = {{0.5, 0.5, 0.0}, {0.5, 0.5, 0.35}, {0.5, 0.5, 50.0}};
  plate.noise = {0.005f, 0.005f, 0.005f};
  const Correspondence c = expect(plate.samples, plate.share, plate.cloud(), mixture());
  EXPECT_GT(c.explained[0], 0.95f);
  EXPECT_GE(c.likeliest[0], 0);
  for (const std::size_t n : {1UL, 2UL}) {
    EXPECT_LT(c.explained[n], 1e-6f) << n;
  }
  EXPECT_EQ(c.likeliest[2], -1);
  EXPECT_NEAR(c.mass.sum(), c.explained_points, tolerance(1e-12));
  EXPECT_LT(c.explained_points, 1.0);
}

/// A point's precision is its own, and so is how far away it may be.
TEST(Expectation, EachPointHasItsOwnNoise) {
  Points samples(1, 3);
  samples << 0.0, 0.0, 0.0;
  const std::vector<double> share = {1.0};
  const MixtureOptions options{0.01, 0.1, 1.0, 1e-3};
  const auto look = [&](double height, float noise) {
    const std::vector<Vector3> points = {{0.0, 0.0, height}};
    const std::vector<float> deviations = {noise};
    return expect(samples, share, {points, deviations}, options);
  };
  for (const float noise : {0.001f, 0.02f}) {
    const Correspondence c = look(0.0, noise);
    EXPECT_NEAR(c.precision[0] * (1e-4 + double(noise) * double(noise)), c.mass[0], tolerance(1e-12));
  }
  EXPECT_GT(look(0.06, 0.03f).explained[0], 0.9f);
  EXPECT_LT(look(0.06, 0.001f).explained[0], 0.1f);
}

TEST(Expectation, IsTheSameForEveryNumberOfThreads) {
  const Plate plate(3000);
  const Correspondence many = expect(plate.samples, plate.share, plate.cloud(), mixture(0.05));
  const ThreadLimit one(1);
  const Correspondence alone = expect(plate.samples, plate.share, plate.cloud(), mixture(0.05));
  EXPECT_EQ(many.precision, alone.precision);
  EXPECT_EQ(many.mass, alone.mass);
  EXPECT_EQ(many.target, alone.target);
  EXPECT_EQ(many.explained, alone.explained);
  EXPECT_EQ(many.likeliest, alone.likeliest);
  EXPECT_EQ(many.sum_squares, alone.sum_squares);
  EXPECT_EQ(many.explained_points, alone.explained_points);
}

TEST(Expectation, OfNothingIsNothing) {
  Plate plate(0);
  const Correspondence c = expect(plate.samples, plate.share, plate.cloud(), mixture());
  EXPECT_EQ(c.precision.size(), plate.samples.rows());
  EXPECT_EQ(c.precision.norm() + c.mass.norm() + c.target.norm() + c.explained_points + c.sum_squares, 0.0);
  EXPECT_TRUE(c.explained.empty());
  const Plate seen(5);
  const Correspondence none = expect(Points(0, 3), {}, seen.cloud(), mixture());
  EXPECT_EQ(none.explained_points, 0.0);
  EXPECT_EQ(none.likeliest, std::vector<int>(5, -1));
}

TEST(Expectation, RefusesWrongNumbersAndSenselessOptions) {
  const Plate plate(5);
  const auto with = [&](const MixtureOptions& options) {
    return expect(plate.samples, plate.share, plate.cloud(), options);
  };
  EXPECT_NO_THROW(with(mixture()));
  EXPECT_THROW(with(mixture(0.0)), std::invalid_argument);
  EXPECT_THROW(with(mixture(std::nan(""))), std::invalid_argument);
  EXPECT_THROW(with({0.1, 0.1, 0.0, 1e-3}), std::invalid_argument);
  const std::vector<double> short_share(3, 1.0 / 3.0);
  EXPECT_THROW(expect(plate.samples, short_share, plate.cloud(), mixture()), std::invalid_argument);
  const std::vector<float> short_noise(3, 0.01f);
  EXPECT_THROW(expect(plate.samples, plate.share, {plate.points, short_noise}, mixture()), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::correspondence_test
