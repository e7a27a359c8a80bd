#include "estimation/press_law.hpp"

#include <cmath>
#include <limits>

namespace pliant {

ParameterSet law_parameters(const LawLayout& layout, double youngs_modulus) {
  const LawForm& form = layout.form();
  VectorX theta = VectorX::Zero(layout.size());
  std::vector<Parameter> parameters;
  const auto add = [&](const ParameterHandle& at, Transform transform, double value, double lower, double upper,
                       double prior_std) {
    theta[at] = value;
    const ParameterBlock& block = layout.layout().block_of(at);
    Parameter p{block.name, block.unit, transform, at, 1.0, lower, upper, true};
    p.prior_std = prior_std;
    p.prior_mean = VectorX::Constant(1, transform == Transform::Logarithm ? std::log(value)
                                        : transform == Transform::Shift   ? value
                                                                          : std::log(value / (0.5 - value)));
    parameters.push_back(std::move(p));
  };
  const double none = std::numeric_limits<double>::infinity();
  for (int k = 0; k < form.controls; ++k)
    add(layout.modulus(k), Transform::Logarithm, youngs_modulus, 1e-4 * youngs_modulus, 1e4 * youngs_modulus, none);
  for (int law = 0; law < form.laws; ++law) {
    add(layout.poissons_ratio(0, law), Transform::LogitHalf, 0.3, 0.01, 0.495, 2.0);
    for (int i = 0; i < form.terms; ++i) {
      // Negative exponents stiffen in compression, great ones in tension; which of them do follows from the presses.
      const double sign = i % 2 == 0 ? 1.0 : -1.0, size = i < 2 ? 3.0 : 12.0;
      add(layout.exponent(i, law), Transform::Shift, sign * size, -60.0, 60.0, none);
      parameters.back().scale = 4.0;
      parameters.back().prior_mean /= 4.0;
      parameters.back().prior_std = 3.0;
      if (i == 0) continue;
      add(layout.stiffness_ratio(i, law), Transform::Logarithm, i < 2 ? 1.0 : 0.1, 1e-6, 1e3, 3.0);
      if (form.own_ratios) add(layout.poissons_ratio(i, law), Transform::LogitHalf, 0.3, 0.01, 0.495, 2.0);
    }
  }
  return {layout.layout(), std::move(parameters), std::move(theta)};
}

std::shared_ptr<const TabulatedLaw> press_law(const Body& body, const LawLayout& layout, const VectorX& theta) {
  return law_at(body, layout, theta);
}

}  // namespace pliant
