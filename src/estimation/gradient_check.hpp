#pragma once

#include <string>
#include <vector>

#include "estimation/cost.hpp"

namespace pliant {

/// Steps of the central differences that a gradient is compared with.
struct GradientCheckOptions {
  double greatest_step = 0.1;  ///< of an unconstrained number of order one, > 0
  int steps = 10;              ///< step sizes, each a root of ten smaller than the one before, >= 3
  /// Relative difference up to which tangents and adjoint count as equal: both are exact but for the tolerance of the
  /// linear solves behind them.
  double tolerance = 1e-5;
};

/// Derivative of a cost by one unconstrained number, found in three ways.
struct CheckedDerivative {
  enum class Verdict {
    Agree,     ///< all three are the same, as far as the differences can tell
    Disagree,  ///< one of them is wrong
    Undecided  ///< tangents and adjoint are the same, but no step size gives differences worth comparing with
  };
  std::string name;            ///< of the number, as `ParameterSet::coordinate_names` has it
  double by_tangents = 0.0;    ///< from the sum of the frames' gradients
  double by_adjoint = 0.0;     ///< from the reverse sweep
  double by_difference = 0.0;  ///< at the best step; not a number where no three neighbouring steps could be evaluated
  double step = 0.0;           ///< best step size: there differences change least from step to step
  double uncertainty = 0.0;    ///< by how much the difference at the best step may be wrong
  double scale = 0.0;  ///< root of the Gauss-Newton matrix's diagonal: size of a gradient that noise alone makes
  std::vector<double> steps, differences;  ///< the whole V-curve; not a number where the cost cannot be evaluated
  Verdict verdict = Verdict::Undecided;
};

/// Comparison of a cost's gradient by tangents, by the adjoint and by central differences.
struct GradientCheck {
  bool succeeded = false;  ///< false: the cost or a gradient cannot be evaluated, and `failure` says why
  std::string failure;
  double cost = 0.0;
  std::vector<CheckedDerivative> derivatives;  ///< one for each unconstrained number

  /// Whether no derivative disagrees.
  bool agrees() const;
};

/// Compares the gradient of a cost at p in every number by tangents, by the adjoint and by central differences over
/// several step sizes; a number at its bound is moved beside it by the greatest step. A difference is trusted as far as
/// its neighbours in the V-curve confirm it: large steps err by curvature, small ones by rounding and by the tolerance
/// of nonlinear solves. Evaluates the cost twice for each number and step size. Throws std::invalid_argument for
/// options outside their ranges.
GradientCheck check_gradient(CostFunction& cost, const VectorX& p, const GradientCheckOptions& options = {});

/// The comparison as text: a line for each number with the three derivatives, how well the best difference is known,
/// and the verdict; then one line about all.
std::string describe(const GradientCheck& check);

}  // namespace pliant
