#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "elasticity/law_elasticity.hpp"
#include "elasticity/reference_forces.hpp"

namespace pliant {

/// What a body is made of: linearly elastic in one turning frame an element, the fast special case, or of any material
/// law. It makes the body's forces, and the same as a function of where the body is stress-free.
class BodyMaterial {
 public:
  /// Corotated linear elasticity, its moduli and Poisson's ratio in these blocks of a parameter vector.
  explicit BodyMaterial(MaterialBlocks blocks) : kind_(std::move(blocks)) {}
  /// A law out of a parameter vector.
  explicit BodyMaterial(LawLayout layout) : kind_(std::move(layout)) {}
  /// A law as it is: it depends on no parameters.
  explicit BodyMaterial(std::shared_ptr<const MaterialLaw> law) : kind_(std::move(law)) {}

  bool is_corotated() const { return std::holds_alternative<MaterialBlocks>(kind_); }
  /// The blocks of a parameter vector that it depends on.
  std::vector<ParameterHandle> parameters() const;

  /// Throws std::invalid_argument where the body's field has another number of control moduli, or its elements do not
  /// suit: laws are for tetrahedra.
  std::unique_ptr<Elasticity> make_elasticity(const std::shared_ptr<const Body>& body) const;
  /// Throws std::invalid_argument as above, and for any body of hexahedra.
  std::unique_ptr<ReferenceForces> make_reference_forces(const std::shared_ptr<const Body>& body) const;

 private:
  std::variant<MaterialBlocks, LawLayout, std::shared_ptr<const MaterialLaw>> kind_;
};

}  // namespace pliant
