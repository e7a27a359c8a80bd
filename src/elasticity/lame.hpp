#pragma once

namespace pliant {

/// Isotropic elasticity that Young's modulus and Poisson's ratio say completely, E = mu (3 lambda + 2 mu) / (lambda +
/// mu) at rest. One energy each, whether it is that of an element's mean deformation (`make_elasticity`) or of every
/// quadrature point (`LinearLaw`, `NeoHookeanLaw`).
enum class ElasticLaw {
  Corotated,   ///< stress linear in S - I, F = R S
  NeoHookean,  ///< W = mu/2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2 (Smith, de Goes, Kim 2018 without
               ///< their barrier at the origin, by whose constants at rest are mu and lambda exactly): stiffens under
               ///< compression, softens under tension, and is smooth also where an element is turned inside out
};

/// Lame's constants for a unit Young's modulus and their derivatives with respect to Poisson's ratio.
struct UnitLame {
  double lambda, mu, d_lambda, d_mu;
};
UnitLame unit_lame(double poissons_ratio);

}  // namespace pliant
