#include "tracking/correspondence.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "base/parallel.hpp"
#include "tracking/neighbours.hpp"

namespace pliant {

namespace {

constexpr std::size_t chunk = 256;  // points whose sums are made by one thread

struct Weighed {
  int sample;
  double probability, squared_distance;
};

/// Posterior probabilities of a chunk of points, one point after the other.
struct ChunkOfPoints {
  std::vector<Weighed> weighed;
  std::vector<std::size_t> end;  // of each point's own
};

}  // namespace

Correspondence expect(const Points& samples, std::span<const double> share, const CloudView& cloud,
                      const MixtureOptions& options) {
  if (!(options.sigma > 0.0) || !(options.volume > 0.0) || Eigen::Index(share.size()) != samples.rows() ||
      cloud.noise.size() != cloud.points.size())
    throw std::invalid_argument("a mixture needs a deviation, a volume, one share a sample and one noise a point");
  Correspondence c;
  const std::size_t n = cloud.points.size();
  c.precision.setZero(samples.rows());
  c.mass.setZero(samples.rows());
  c.target.setZero(samples.rows(), 3);
  c.explained.assign(n, 0.0f);
  c.likeliest.assign(n, -1);
  if (n == 0 || samples.rows() == 0) return c;

  const Neighbours near(samples);
  const double reach = 2.0 * std::log(1.0 / options.least_posterior), w = options.outlier_share;
  std::vector<ChunkOfPoints> chunks((n + chunk - 1) / chunk);
  parallel_for(std::size_t(0), chunks.size(), [&](std::size_t k) {
    std::vector<Neighbours::Match> found;
    ChunkOfPoints& own = chunks[k];
    for (std::size_t i = k * chunk; i < std::min(n, (k + 1) * chunk); ++i) {
      const std::size_t begin = own.weighed.size();
      const double s2 = options.sigma * options.sigma + double(cloud.noise[i]) * double(cloud.noise[i]);
      const double outlier = w / options.volume * std::pow(2.0 * std::numbers::pi * s2, 1.5) / (1.0 - w);
      const double nearest = near.nearest(cloud.points[i]).squared_distance;
      double sum = outlier;
      if (std::exp(-nearest / (2.0 * s2)) > options.least_posterior * outlier) {
        near.within(cloud.points[i], std::sqrt(nearest + reach * s2) * (1.0 + 1e-12), found);
        for (const auto& [index, squared] : found) {
          const double p = share[std::size_t(index)] * std::exp(-squared / (2.0 * s2));
          if (p == 0.0) continue;
          own.weighed.push_back({int(index), p, squared});
          sum += p;
        }
      }
      double most = 0.0, all = 0.0;
      for (std::size_t j = begin; j < own.weighed.size(); ++j) {
        Weighed& weighed = own.weighed[j];
        weighed.probability /= sum;
        all += weighed.probability;
        if (weighed.probability > most) most = weighed.probability, c.likeliest[i] = weighed.sample;
      }
      c.explained[i] = float(all);
      own.end.push_back(own.weighed.size());
    }
  });
  for (std::size_t k = 0; k < chunks.size(); ++k) {
    std::size_t j = 0;
    for (std::size_t i = 0; i < chunks[k].end.size(); ++i) {
      const std::size_t point = k * chunk + i;
      const double s2 = options.sigma * options.sigma + double(cloud.noise[point]) * double(cloud.noise[point]);
      for (; j < chunks[k].end[i]; ++j) {
        const Weighed& weighed = chunks[k].weighed[j];
        const double precision = weighed.probability / s2;
        c.precision[weighed.sample] += precision;
        c.mass[weighed.sample] += weighed.probability;
        c.target.row(weighed.sample) += precision * cloud.points[point].transpose();
        c.sum_squares += weighed.probability * weighed.squared_distance;
        c.explained_points += weighed.probability;
      }
    }
  }
  for (Eigen::Index s = 0; s < samples.rows(); ++s)
    if (c.precision[s] > 0.0) c.target.row(s) /= c.precision[s];
  return c;
}

}  // namespace pliant
