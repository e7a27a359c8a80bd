#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "parameters/parameter_set.hpp"

namespace pliant {

/// Residuals of one kind in a frame, and what they count.
struct ResidualRows {
  VectorX residual;  ///< [m]
  VectorX weight;    ///< [1/m^2]; 0 where a point is not matched
  MatrixX J;         ///< their changes along directions, one row each; no columns where derivatives were not asked for
};

/// How one instant of what was simulated fits what was measured: a frame of a motion, a press, a load, a curve.
struct FrameFit {
  int recording = 0;            ///< which trial of an objective it belongs to, as that counts
  int frame = 0;                ///< of the trial
  int points = 0, matched = 0;  ///< of the surface, and of outlines
  int outlines = 0;             ///< points of outlines among them
  int tracks = 0;               ///< followed points
  double independent = 0.0;     ///< observations behind the cost
  double cost = 0.0;
  VectorX gradient;      ///< by p; empty unless asked for
  MatrixX gauss_newton;  ///< J^T W J
  std::vector<float>
      distances;  ///< [m] of each point to the deformed surface or its contour, each at most the loss's scale
  double sum_squares = 0.0;          ///< [m^2] of them
  double max_distance = 0.0;         ///< [m] of matched points
  double sum_noise_squares = 0.0;    ///< [m^2] of the sensor's standard deviations
  double outline_sum_squares = 0.0;  ///< [m^2] of the outlines' part of `sum_squares`
  double track_sum_squares = 0.0;    ///< [m^2] of the followed points' distances
  std::vector<ResidualRows> rows;    ///< of surface and outlines, where `ObjectiveOptions::keeps_rows` asks for them
};

struct CostEvaluation {
  bool succeeded = false;
  std::string failure;
  double cost = 0.0;
  VectorX gradient;
  MatrixX gauss_newton;
  std::vector<FrameFit> frames;  ///< of all recordings, one after the other
  int steps = 0;
  /// Nodes times steps, with what derivatives and equilibria take in steps: as great on every machine, however busy it
  /// is.
  double work = 0.0;
  double surface_rms() const;     ///< [m]; 0 where no surface was seen
  double surface_median() const;  ///< [m], likewise
  double outline_rms() const;     ///< [m], of the outlines among them; 0 where none were seen
  double track_rms() const;       ///< [m], of the followed points; 0 where there are none
  double matched_fraction() const;
  double independent_observations() const;  ///< behind the cost, as `ObjectiveOptions` counts them
  /// The frames of one recording alone, with its cost and without derivatives.
  [[nodiscard]] CostEvaluation of_recording(int recording) const;
};

/// What is minimised: parameters to cost. One instance for one thread.
class CostFunction {
 public:
  virtual ~CostFunction() = default;
  virtual const ParameterSet& parameters() const = 0;
  /// Cost alone.
  [[nodiscard]] virtual CostEvaluation evaluate(const VectorX& p) = 0;
  /// Told that an evaluation is done, with its number; from any thread. False: those that have not begun are left out.
  using OnEvaluated = std::function<bool(std::size_t, const CostEvaluation&)>;
  /// Costs of several vectors, in their order: here one after the other.
  /// @param on_evaluated  called after each; may be empty. What it leaves out fails ("left out")
  [[nodiscard]] virtual std::vector<CostEvaluation> evaluate(std::span<const VectorX> points,
                                                             const OnEvaluated& on_evaluated = {});
  /// Cost, gradient and Gauss-Newton matrix: for few parameters.
  [[nodiscard]] virtual CostEvaluation linearise(const VectorX& p) = 0;
  /// Cost and gradient: any number of parameters.
  [[nodiscard]] virtual CostEvaluation gradient(const VectorX& p) = 0;
};

}  // namespace pliant
