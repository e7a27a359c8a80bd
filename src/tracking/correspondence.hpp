#pragma once

#include <span>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// What was seen in a frame, and how surely.
struct CloudView {
  std::span<const Vector3> points;  ///< [m], world
  std::span<const float> noise;     ///< standard deviation of each [m], > 0
};

/// A mixture of one Gaussian a surface sample, each as likely as the share of the surface that it stands for, and of
/// outliers anywhere in a volume.
struct MixtureOptions {
  double sigma = 0.0;          ///< [m] standard deviation of the samples, > 0; a point's own noise is added in squares
  double outlier_share = 0.1;  ///< beforehand, (0, 1)
  double volume = 0.0;         ///< [m^3] in which outliers lie, > 0
  double least_posterior = 1e-3;  ///< samples less likely than this times a point's nearest one are left out, (0, 1)
};

/// Soft correspondences: the expectation step.
struct Correspondence {
  VectorX precision;              ///< of each sample: sum_n p_kn / s_n^2 [1/m^2], s_n^2 = sigma^2 + noise_n^2
  VectorX mass;                   ///< of each sample: sum_n p_kn, the points that it explains
  Points target;                  ///< the mean of its points with those weights [m]; zero where there are none
  std::vector<float> explained;   ///< of each point: its probability to be no outlier
  std::vector<int> likeliest;     ///< sample of each point; -1: none is near
  double explained_points = 0.0;  ///< sum of `explained`
  double sum_squares = 0.0;       ///< sum_kn p_kn |c_n - s_k|^2 [m^2]
};

/// The posterior probabilities p_kn that sample k made point n, given where the samples are (Wang 2015, eq. 4 and 5;
/// Schulman et al. 2013), summed up for each sample. Sums run over the samples near a point: what is left out is at
/// most `least_posterior` times as likely as the nearest one, each. The same for every number of threads.
/// @param samples  m x 3 [m]
/// @param share    of each, summing to one; 0: cannot be seen
Correspondence expect(const Points& samples, std::span<const double> share, const CloudView& cloud,
                      const MixtureOptions& options);

}  // namespace pliant
