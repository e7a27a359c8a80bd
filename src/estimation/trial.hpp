#pragma once

#include <memory>

#include "estimation/cost.hpp"

namespace pliant {

/// What takes about as long as how many time steps of the same body: for `CostEvaluation::work`.
constexpr double steps_of_a_tangent = 0.35, steps_of_an_adjoint = 1.0, steps_of_an_equilibrium = 40.0;

/// Something that is simulated and compared with what was measured of it: a motion seen by sensors, a body at rest
/// under a load, a press with known force, a stress-strain curve. It reads its parameters from the vector that all
/// trials of an objective share, by handles of its own. One instance for one thread.
class Trial {
 public:
  virtual ~Trial() = default;

  /// Cost at theta, frame by frame; with the gradient and the Gauss-Newton matrix of each frame along directions.
  /// @param directions  changes of theta, one a column; may have none: the cost alone
  /// Where it cannot be simulated the result says why.
  [[nodiscard]] virtual CostEvaluation run(const VectorX& theta, const MatrixX& directions) = 0;

  /// Cost at theta, and its derivative by the adjoint: as much work for any number of parameters.
  /// @param theta_bar  out: d cost / d theta, as long as theta; of no meaning where the evaluation failed
  [[nodiscard]] virtual CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) = 0;

  /// About what a run takes, as `CostEvaluation::work` counts it, by what is known before the first one: so that
  /// processes share out trials evenly. Here next to nothing.
  [[nodiscard]] virtual double expected_work() const { return 1.0; }

  /// From now on load-free shapes and corrected scans stay what they are for theta: costs and derivatives leave their
  /// changes out. False where there is none for theta.
  [[nodiscard]] virtual bool hold_shape(const VectorX& theta) {
    (void)theta;
    return true;
  }

  /// The same trial as if nothing had been run yet, but for where load-free shapes are looked for first, for another
  /// thread; null where there can be only one. Shapes that are held are not held in it.
  [[nodiscard]] virtual std::unique_ptr<Trial> anew() const { return nullptr; }
};

}  // namespace pliant
