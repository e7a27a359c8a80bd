#pragma once

namespace pliant {

/// Lame's constants for a unit Young's modulus and their derivatives with respect to Poisson's ratio.
struct UnitLame {
  double lambda, mu, d_lambda, d_mu;
};
UnitLame unit_lame(double poissons_ratio);

}  // namespace pliant
