#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/bytes.hpp"
#include "base/process_group.hpp"
#include "estimation/motion_trial.hpp"

namespace pliant {

/// Maps parameters to the cost of trials of any kind: the sum of what they say, plus the priors. All trials read the
/// same parameter vector, each by the handles of its own blocks. One instance for one thread; trials are simulated side
/// by side, and their frames stand in the evaluation in the trials' order.
///
/// Processes of a group share out the trials, the same one always to the same process, and evaluate together: each
/// calls the same functions with the same vectors in the same order, and each holds what one process alone would, to
/// the last bit. Where a trial throws in one of them they all throw (`ProcessGroup::gather`).
class Objective : public CostFunction {
 public:
  /// Throws std::invalid_argument where a trial is missing.
  /// @param processes  that evaluate it together, each with the same trials; null: this one alone
  Objective(std::vector<std::unique_ptr<Trial>> trials, ParameterSet parameters,
            std::shared_ptr<ProcessGroup> processes = nullptr);
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
  /// What a trial says: its evaluation and, by the adjoint, the derivative of its cost by theta.
  struct Said {
    CostEvaluation evaluation;
    VectorX theta_bar;
  };
  /// How a trial is run.
  using Run = std::function<Said(Trial&)>;

  bool is_alone() const { return !processes_ || processes_->is_alone(); }
  /// The same objective as if nothing had been run yet; nothing where a trial of this process cannot be had anew.
  std::optional<Objective> anew() const;
  Run run_of(const VectorX& p, bool with_tangents) const;
  CostEvaluation run(const VectorX& p, bool with_tangents);
  /// What the trials of this process say, as many as there are of all; of those of others nothing.
  std::vector<Said> own_parts(const Run& run);
  /// What all trials say, with those of the other processes.
  std::vector<Said> parts(const char* what, const VectorX& p, const Run& run);
  std::vector<CostEvaluation> evaluate_together(std::span<const VectorX> points, const OnEvaluated& on_evaluated);
  bool hold_own_shapes(const VectorX& p);
  void write_own(const std::vector<Said>& said, ByteWriter& to) const;
  /// @param rank  who has written it
  void read_of(int rank, ByteReader& from, std::vector<Said>& said) const;
  /// The priors, and what the trials say, summed in their order.
  CostEvaluation sum(const VectorX& p, std::vector<Said> parts, bool has_gradient, bool has_matrix) const;

  ParameterSet parameters_;
  std::shared_ptr<ProcessGroup> processes_;
  std::vector<std::unique_ptr<Trial>> trials_;  // null: another process has it
  std::vector<int> owners_;                     // of the trials, by rank
  VectorX held_;                                // p that shapes are held at; empty: they follow
};

}  // namespace pliant
