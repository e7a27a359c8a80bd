#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// A decaying oscillation, a exp(-decay (t - t_0)) cos(omega (t - t_0) + phase), t_0 the first of the times.
struct DampedSinusoid {
  double omega = 0.0;      ///< of the damped oscillation [rad/s]
  double decay = 0.0;      ///< [1/s], >= 0
  double amplitude = 0.0;  ///< a, in the signal's unit
  double power = 0.0;      ///< sum of squares of the signal that it explains
  double explained =
      0.0;  ///< share of the signal's variance about its settling value (and the known sinusoids), [0, 1]
  double deviation = 0.0;   ///< standard deviation of omega that the unexplained rest leaves [rad/s]
  double periods = 0.0;     ///< seen before the record ends or the amplitude has fallen to a twentieth
  bool is_at_edge = false;  ///< of the band: there is no peak inside

  /// sqrt(omega^2 + decay^2) [rad/s]: what it would be without damping.
  double natural() const;
  double damping_ratio() const { return decay / natural(); }
};

/// Angular frequencies [rad/s].
struct FrequencyBand {
  double least, most;
};

/// From one period in the record to nine tenths of the rate that the median interval resolves. Times ascend.
FrequencyBand resolvable_band(const std::vector<double>& times);

/// The strongest oscillation in a band: the peak of the periodogram, generalised to times that are not equally far
/// apart and to a settling value that is fitted along (Lomb 1976, Scargle 1982, Zechmeister and Kuerster 2009), on a
/// grid eight times as fine as the record's length resolves and by a parabola in between; from there omega and the
/// decay by least squares. The record need not last until the oscillation has settled.
/// @param known  sinusoids whose part in the signal is fitted along, with free amplitude and phase
/// @return       none where the band or the signal is empty, or where there are too few times for so many unknowns
std::optional<DampedSinusoid> dominant_sinusoid(const std::vector<double>& times, const VectorX& signal,
                                                const FrequencyBand& band,
                                                const std::vector<DampedSinusoid>& known = {});

/// "" where a sinusoid is an oscillation beyond doubt; else why not, in words: it explains no more than noise would,
/// lasts too few periods, is damped too much, or lies at the edge of its band.
std::string rejection_reason(const DampedSinusoid& sinusoid, std::size_t samples);

}  // namespace pliant
