#pragma once

#include <utility>

#include "estimation/fit_pass.hpp"
#include "estimation/recordings.hpp"

namespace pliant {

/// Plans a fit with as many control points of Young's modulus as the recordings support. The homogeneous object is
/// fitted first, off the scan where that seems to err: fields would make up for it. Then fields of 2, 3, 4, 6, 8, ...
/// points, each from the best one so far and only where one step of Gauss and Newton promises enough
/// (`is_worth_a_fit`), and to its end only where the stage in the wide band takes off as large a part of the best one's
/// cost there. A field of more points is kept where there is strong evidence of what it has beyond the best one before
/// (`log_bayes_factor` above `Judgement::strong_evidence`); two numbers in a row without it end the search, and the
/// best one is repeated where the options ask for that. Where the evidence for that, once it counts what other models
/// and parts of the motion leave open of the field, is not above `Judgement::evidence_of_parts`, the homogeneous object
/// stands.
class FieldChoice : public PassPlanner {
 public:
  /// @param resume  the state of an interrupted choice goes on with the field that was under way
  /// @param processes  as in `FitMonitor`
  FieldChoice(std::vector<RecordedCapture> recordings, const FitOptions& options, FitState resume,
              std::shared_ptr<ProcessGroup> processes = nullptr);

  std::optional<Pass> next() override;
  bool take(FitOutcome outcome, PassState reached) override;
  bool is_done() const override { return outcome_.has_value(); }
  void write(FitState& state) const override { state.field = choice_; }
  FitOutcome outcome() override { return std::move(*outcome_); }

 private:
  const TriedField& best() const { return choice_.tried[std::size_t(choice_.best)]; }
  bool is_decided() const;
  /// Where a fit with so many points begins; nothing where one step promises too little.
  std::optional<PassState> beginning_of(int count);
  /// The best fit's state as one of another field, and what one step promises of that.
  PassState with_field(int count, TriedField& promised);
  /// What a field's cost must come below in the wide band to be followed further.
  double wide_band_limit() const;
  Pass pass_of(int count, const PassState& from, int refine, double done_from, double done_to) const;
  void judge(const FitOutcome& outcome, PassState reached);
  /// Logarithm of the Bayes factor of the last pass' field over one modulus, by the whole uncertainty of its estimate.
  double whole_evidence(const FitOutcome& outcome) const;
  /// Goes back to the homogeneous object.
  void refuse_fields(double whole_evidence);
  /// With all that was done on the way.
  FitOutcome with_history(FitOutcome outcome);
  JointLayout layout_of(int count) const { return joint_layout(recordings_, options_, count); }
  ModulusField field_of(const Body& body, int count) const;

  std::vector<RecordedCapture> recordings_;
  FitOptions options_;
  std::shared_ptr<ProcessGroup> processes_;
  FitState::FieldChoice choice_;
  PassState left_;        // by an interruption
  int resumed_ = 0;       // control points of the fit that was interrupted, until it goes on
  int count_ = 0;         // of the pass that was handed out last
  TriedField promised_;   // of the same, where another field was best before
  bool is_last_ = false;  // that pass
  bool is_cut_ = false;   // interrupted, and the best so far is looked at
  std::optional<FitOutcome> outcome_;
  std::vector<std::pair<int, std::vector<FitEvent>>> histories_;  // by number of control points
  long long forward_steps_ = 0;
};

/// Whether a field of which one step of Gauss and Newton promises so much is fitted. Beside an even object it must
/// promise strong evidence, beside a field any, and a part of what a field must take off the cost.
bool is_worth_a_fit(const TriedField& promised, const TriedField& best);

/// How many control points were chosen, and by what evidence, in a sentence.
/// @param tried  as a choice tried them, the homogeneous object first
std::string explained(const std::vector<TriedField>& tried);

/// The moduli of one field that come closest to another field of the same body, by ln E of its elements and their
/// volumes: ln E_to = M ln E_from.
/// @return  M, controls of `to` x controls of `from`
MatrixX carried_over(const Body& body, const ModulusField& from, const ModulusField& to);

}  // namespace pliant
