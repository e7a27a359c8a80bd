#include "estimation/press_law.hpp"

#include <cmath>
#include <limits>

namespace pliant {

namespace {

/// Appends parameters that start from the middle of their priors.
struct StartValues {
  const ParameterLayout& layout;
  VectorX& theta;
  std::vector<Parameter>& parameters;

  Parameter& add(const ParameterHandle& at, Transform transform, double value, double lower, double upper,
                 double prior_std) {
    theta[at] = value;
    const ParameterBlock& block = layout.block_of(at);
    Parameter p{block.name, block.unit, transform, at, 1.0, lower, upper, true};
    p.prior_std = prior_std;
    p.prior_mean = VectorX::Constant(1, transform == Transform::Logarithm ? std::log(value)
                                        : transform == Transform::Shift   ? value
                                                                          : std::log(value / (0.5 - value)));
    return parameters.emplace_back(std::move(p));
  }
  void add_ratio(const ParameterHandle& at) { add(at, Transform::LogitHalf, 0.3, 0.01, 0.495, 2.0); }
};

}  // namespace

void add_term_parameters(const ParameterLayout& layout, const LawLayout& law, int number, VectorX& theta,
                         std::vector<Parameter>& parameters) {
  StartValues start{layout, theta, parameters};
  for (int i = 0; i < law.form().terms; ++i) {
    // Negative exponents stiffen in compression, great ones in tension; which of them do follows from what was seen.
    const double sign = i % 2 == 0 ? 1.0 : -1.0, size = i < 2 ? 3.0 : 12.0;
    Parameter& exponent = start.add(law.exponent(i, number), Transform::Shift, sign * size, -60.0, 60.0, 3.0);
    exponent.scale = 4.0;
    exponent.prior_mean /= exponent.scale;
    if (i == 0) continue;
    start.add(law.stiffness_ratio(i, number), Transform::Logarithm, i < 2 ? 1.0 : 0.1, 1e-6, 1e3, 3.0);
    if (law.form().own_ratios) start.add_ratio(law.poissons_ratio(i, number));
  }
}

ParameterSet law_parameters(const LawLayout& layout, double youngs_modulus) {
  VectorX theta = VectorX::Zero(layout.size());
  std::vector<Parameter> parameters;
  StartValues start{layout.layout(), theta, parameters};
  for (int k = 0; k < layout.form().controls; ++k)
    start.add(layout.modulus(k), Transform::Logarithm, youngs_modulus, 1e-4 * youngs_modulus, 1e4 * youngs_modulus,
              infinite);
  for (int law = 0; law < layout.form().laws; ++law) {
    start.add_ratio(layout.poissons_ratio(0, law));
    add_term_parameters(layout.layout(), layout, law, theta, parameters);
  }
  return {layout.layout(), std::move(parameters), std::move(theta)};
}

std::shared_ptr<const TabulatedLaw> press_law(const Body& body, const LawLayout& layout, const VectorX& theta) {
  return law_at(body, layout, theta);
}

}  // namespace pliant
