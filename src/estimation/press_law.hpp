#pragma once

#include <memory>

#include "elasticity/law_layout.hpp"
#include "parameters/parameter_set.hpp"

namespace pliant {

/// The parameters of a law at start values: its moduli, "poisson_ratio", "exponent_1", "exponent_2",
/// "stiffness_ratio_2", "poisson_ratio_2" (where terms have their own), ...
ParameterSet law_parameters(const LawLayout& layout, double youngs_modulus);

/// The law of all elements of a pressed object for theta: `law_at`.
std::shared_ptr<const TabulatedLaw> press_law(const Body& body, const LawLayout& layout, const VectorX& theta);

}  // namespace pliant
