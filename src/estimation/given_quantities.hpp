#pragma once

#include <string>
#include <vector>

#include "estimation/cost.hpp"
#include "estimation/uncertainty.hpp"
#include "mismatch/sensor_correction.hpp"

namespace pliant {

/// What a capture gives and a fit takes as exact, and how exactly such things are known.
struct GivenQuantity {
  std::string parameter, cause;  ///< its name; for people
  double deviation = 0.0;        ///< of each of its unconstrained numbers
};

/// What all readings of a sensor err by together.
struct CommonError {
  SensorBlocks sensor;
  double relative = 0.0;  ///< over the object's size
};

/// How well all lengths of the recordings together are known: scan, points and pictures have them in common.
struct GivenScale {
  double deviation = 0.0;        ///< of the logarithm of the true ones over those that are taken; 0: they are exact
  bool masses_are_known = true;  ///< false: the density is, and masses follow from volumes
};

/// Of all parameters that are not estimated: poses and ranges of sensors, density, the direction of gravity, friction.
/// They are known as well as somebody stated (`Parameter::given_std`), or else as such things are. Poses are known as
/// well as those of calibrated sensors, or as well as the sensor reads where that is worse: a field of errors that is
/// smooth over the object shifts it, and turns it by as much at its ends. So does the direction of gravity turn, which
/// is known against what the sensor sees.
std::vector<GivenQuantity> given_quantities(const ParameterSet& parameters,
                                            const std::vector<CommonError>& common_errors = {});

/// The parameters with those estimated, under a prior about where they are.
ParameterSet with_given(const ParameterSet& parameters, const std::vector<GivenQuantity>& given);

/// The parameters, and behind them how strong each gravity is whose strength is given, without a prior.
ParameterSet with_strengths_of_gravity(const ParameterSet& parameters);

/// How the estimate would follow each of them, as far as the recording does not tell it. Where lengths are s times
/// those that are taken, gravity is 1 / s times as strong in these, and an estimate that has the power k of a length is
/// s^k times what it is in these: both together move it.
/// @param evaluation  with derivatives by what is estimated and by what is given
/// @param all         that set, both estimated; where lengths are not exact with strengths of gravity
std::vector<ModelShift> shifts_of_given(const CostEvaluation& evaluation, const ParameterSet& all,
                                        const std::vector<GivenQuantity>& given, const GivenScale& scale = {});

}  // namespace pliant
