#pragma once

#include <vector>

#include "model/model.hpp"
#include "model/result.hpp"

namespace pliant {

/// A material out of what a fit leaves open.
struct DrawnMaterial {
  double youngs_modulus = 0.0;     ///< [Pa]; where it varies, what all moduli are scaled by is its ratio to the fit's
  double poissons_ratio = 0.0;     ///< [-]
  double mass_damping = 0.0;       ///< [1/s]
  double stiffness_damping = 0.0;  ///< [s]
};

/// Materials drawn from a fit's result: normal numbers, correlated as the result says, each mapped so that the value is
/// the median and 90 % lie in its stated interval; modulus and dampings by their logarithm, Poisson's ratio by the
/// logit of its way from -1 to 0.5. What was given stays. The same seed gives the same materials.
/// Throws InputError where the result states no interval of Young's modulus.
std::vector<DrawnMaterial> posterior_samples(const Result& result, int count, unsigned seed = 1);

/// The model of that material: moduli of all elements are scaled alike.
Model with_material(Model model, const DrawnMaterial& sample);

}  // namespace pliant
