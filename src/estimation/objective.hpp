#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "estimation/motion_trial.hpp"

namespace pliant {

/// Maps parameters to the cost of trials of any kind: the sum of what they say, plus the priors. All trials read the
/// same parameter vector, each by the handles of its own blocks. One instance for one thread; trials are simulated side
/// by side, and their frames stand in the evaluation in the trials' order.
class Objective : public CostFunction {
 public:
  /// Throws std::invalid_argument where a trial is missing.
  Objective(std::vector<std::unique_ptr<Trial>> trials, ParameterSet parameters);
  /// Of motions alone; they are numbered in their order.
  Objective(std::vector<ObservedMotion> motions, ParameterSet parameters);
  /// Of one motion.
  Objective(Mismatch mismatch, std::shared_ptr<const Body> body, SimulationOptions simulation,
            std::shared_ptr<const std::vector<FrameObservations>> observations, ParameterSet parameters,
            ObjectiveOptions options);

  const ParameterSet& parameters() const override { return parameters_; }
  /// Goes on with other parameters of the same trials, whose handles are to be of their layout.
  void set_parameters(ParameterSet parameters) { parameters_ = std::move(parameters); }

  /// From now on load-free shapes and corrected scans stay what they are for p: costs and derivatives leave their
  /// changes out. False where there are none.
  [[nodiscard]] bool hold_shapes(const VectorX& p);

  [[nodiscard]] CostEvaluation evaluate(const VectorX& p) override;
  /// Side by side, each with trials of its own that nothing was run of yet: what one costs depends neither on the
  /// others nor on what was evaluated before. Where a trial cannot be had anew, one after the other with the
  /// objective's own.
  [[nodiscard]] std::vector<CostEvaluation> evaluate(std::span<const VectorX> points,
                                                     const OnEvaluated& on_evaluated = {}) override;
  /// By tangents.
  [[nodiscard]] CostEvaluation linearise(const VectorX& p) override;
  /// By the adjoint.
  [[nodiscard]] CostEvaluation gradient(const VectorX& p) override;

 private:
  /// The same objective as if nothing had been run yet; nothing where a trial cannot be had anew.
  std::optional<Objective> anew() const;
  CostEvaluation run(const VectorX& p, bool with_tangents);
  /// The priors, and what the trials say, summed in their order.
  CostEvaluation sum(const VectorX& p, std::vector<CostEvaluation> parts, bool has_gradient, bool has_matrix) const;

  ParameterSet parameters_;
  std::vector<std::unique_ptr<Trial>> trials_;
  VectorX held_;  // p that shapes are held at; empty: they follow
};

}  // namespace pliant
