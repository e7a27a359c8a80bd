#pragma once

#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "elasticity/law_elasticity.hpp"
#include "elasticity/reference_forces.hpp"

namespace pliant {

/// How stiffness damping acts at large strain; at small strain both are Rayleigh's beta K v.
enum class StiffnessDamping {
  Rayleigh,     ///< beta times the turned stiffness times v
  KelvinVoigt,  ///< on the rate of the Green strain, a force term of its own (`make_viscous_forces`)
};

/// What an object is made of: its elastic law and how it damps. The numbers of both stand in parameter vectors.
/// Whatever moves, rests, is pressed, is scanned sagging or is exported has its elastic forces from here.
struct Material {
  /// Of the elements' mean strain, by Young's moduli and Poisson's ratio of the parameter vector; or, at every
  /// quadrature point of tetrahedra, by a law's numbers in the parameter vector, or by a law that depends on no
  /// parameters.
  using Elastic = std::variant<ElasticLaw, LawLayout, std::shared_ptr<const MaterialLaw>>;
  Elastic elastic = ElasticLaw::NeoHookean;
  StiffnessDamping damping = StiffnessDamping::KelvinVoigt;

  /// The law of the elements' mean strain; nothing where there is one at every quadrature point.
  std::optional<ElasticLaw> of_mean_strain() const;
  /// Where the law's numbers stand in a parameter vector; null where they do not.
  const LawLayout* law_layout() const { return std::get_if<LawLayout>(&elastic); }
  /// The law that depends on no parameters; null where it does.
  std::shared_ptr<const MaterialLaw> law() const;

  /// The blocks of a parameter vector that elastic forces depend on.
  /// @param blocks  of moduli and Poisson's ratio
  std::vector<ParameterHandle> parameters(const MaterialBlocks& blocks) const;
  /// Throws std::invalid_argument where the body's field has another number of control moduli, or its elements do not
  /// suit: laws at quadrature points are for tetrahedra.
  std::unique_ptr<Elasticity> make_elasticity(const std::shared_ptr<const Body>& body,
                                              const MaterialBlocks& blocks) const;
  /// The same forces as functions of where the body is stress-free. Throws std::invalid_argument as above, and for any
  /// body of hexahedra.
  std::unique_ptr<ReferenceForces> make_reference_forces(const std::shared_ptr<const Body>& body,
                                                         const MaterialBlocks& blocks) const;
};

}  // namespace pliant
