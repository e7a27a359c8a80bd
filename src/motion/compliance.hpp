#pragma once

#include <memory>
#include <vector>

#include "motion/simulation.hpp"

namespace pliant {

/// Small motions about a pose of a body that is held: forces to displacements, by the exact stiffness there.
class Compliance {
 public:
  /// @param options  forces and holds of the scene; pulls and weights that are let go count as gone
  /// @param x        the pose, n x 3 [m]
  Compliance(const std::shared_ptr<const Body>& body, const SimulationOptions& options, const VectorX& theta,
             const Points& x);

  /// Whether the stiffness could be factorised; only then are there displacements.
  bool is_ready() const { return is_ready_; }
  /// n x 3 [m] for n x 3 [N]; zeros for what is held.
  const Points& displacements(const Points& forces) { return statics_.response(forces); }
  /// What would have to be added to the scene's forces for the body to stay in the pose, n x 3 [N].
  Points missing_forces();

 private:
  Points x_;
  std::vector<std::unique_ptr<ForceTerm>> terms_;
  Statics statics_;
  bool is_ready_ = false;
};

}  // namespace pliant
