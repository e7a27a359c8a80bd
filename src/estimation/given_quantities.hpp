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

/// Of all parameters that are not estimated: poses and ranges of sensors, density, the direction of gravity, friction.
/// Poses are known as well as those of calibrated sensors, or as well as the sensor reads where that is worse: a field
/// of errors that is smooth over the object shifts it, and turns it by as much at its ends. So does the direction of
/// gravity turn, which is known against what the sensor sees.
std::vector<GivenQuantity> given_quantities(const ParameterSet& parameters,
                                            const std::vector<CommonError>& common_errors = {});

/// The parameters with those estimated, under a prior about where they are.
ParameterSet with_given(const ParameterSet& parameters, const std::vector<GivenQuantity>& given);

/// How the estimate would follow each of them, as far as the recording does not tell it.
/// @param evaluation  with derivatives by what is estimated and by what is given
/// @param all         that set, both estimated
std::vector<ModelShift> shifts_of_given(const CostEvaluation& evaluation, const ParameterSet& all,
                                        const std::vector<GivenQuantity>& given);

}  // namespace pliant
