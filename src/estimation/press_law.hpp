#pragma once

#include <memory>

#include "elasticity/law_layout.hpp"
#include "parameters/parameter_set.hpp"

namespace pliant {

/// The parameters of a law at start values: its moduli, "poissons_ratio", "exponent_1", "exponent_2",
/// "stiffness_ratio_2", "poissons_ratio_2" (where terms have their own), ...
ParameterSet law_parameters(const LawLayout& layout, double youngs_modulus);

/// Appends the parameters of a law's terms beyond a modulus and a Poisson's ratio, exponents first, and sets their
/// start values in theta.
/// @param number  of the law, where every control modulus has its own
void add_term_parameters(const ParameterLayout& layout, const LawLayout& law, int number, VectorX& theta,
                         std::vector<Parameter>& parameters);

/// The law of all elements of a pressed object for theta: `law_at`.
std::shared_ptr<const TabulatedLaw> press_law(const Body& body, const LawLayout& layout, const VectorX& theta);

}  // namespace pliant
