#pragma once

#include <memory>

#include "elasticity/element_moduli.hpp"
#include "elasticity/force_term.hpp"

namespace pliant {

/// Kelvin-Voigt damping at finite strain: the second Piola-Kirchhoff stress
///   S = beta (lambda tr(dE/dt) I + 2 mu dE/dt),   dE/dt = sym(F^T dF/dt),
/// of the Green strain E, with F that of an element's mean. At small strain that is Rayleigh's beta K v; under
/// compression it is weaker along the way, under extension stronger. A rigid motion is not damped. With K_e the
/// stiffness of the unturned element, over a step from x0 that is dt long,
///   f(z | p) = - beta / dt sum_e F_e(p) K_e F_e(p)^T (z - x0).
/// At rest, where there is no step, it is nothing. Of tetrahedra it has derivatives by the stress-free reference.
/// @param blocks             of the elements' material
/// @param stiffness_damping  of beta [s]
/// Throws std::invalid_argument where there is not one block for each control of the body's field of moduli.
std::unique_ptr<ForceTerm> make_viscous_forces(std::shared_ptr<const Body> body, const MaterialBlocks& blocks,
                                               ParameterHandle stiffness_damping);

}  // namespace pliant
