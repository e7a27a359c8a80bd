#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/process_group.hpp"
#include "estimation/fit_options.hpp"
#include "estimation/fit_stage.hpp"
#include "estimation/law_zones.hpp"
#include "estimation/press_sampling.hpp"
#include "estimation/problem.hpp"
#include "estimation/verdict.hpp"
#include "tracking/tracker.hpp"

namespace pliant {

/// A step of the fit, for progress and convergence.csv.
struct FitEvent {
  StageKind kind = StageKind::Fine;
  /// For people: "motion", "scan", "coarse", "fine", "18 cells", "round 2: fine"; "linear", "1 term", "2 terms apart",
  /// "3 zones", "a law a region", "8 control points", "press 3".
  std::string stage;
  int start = 0;  ///< which start
  int iteration = 0;
  double cost = 0.0, damping = 0.0, surface_rms = 0.0;
  VectorX theta;                ///< of `layout`; of a sample empty
  double fraction_done = 0.0;   ///< a guess at how much of the whole is done; 0: there is none
  double marker_rms = 0.0;      ///< [m] of the points of presses
  double youngs_modulus = 0.0;  ///< [Pa] of the object's own material; of presses the mean
  std::shared_ptr<const ParameterLayout> layout = {};
};

/// One start that was followed.
struct FitStart {
  VectorX start, final;  ///< theta
  double start_cost = 0.0, cost = 0.0;
  int iterations = 0;
  bool converged = false;
  std::string reason;
};

/// What a number of control points is worth: see `FieldChoice`.
struct TriedField {
  int control_points = 1;
  bool estimated = false;         ///< false: its evidence is what one Gauss-Newton step promised
  double cost = 0.0;              ///< of the estimate; infinite where there is none
  double log_bayes_factor = 0.0;  ///< against the best before; infinitely low where it cannot be simulated
  bool is_refused = false;        ///< for what other models and parts of the motion leave open, which that counts then
};

/// One round of tracking and estimation in turns.
struct TrackingRound {
  double youngs_modulus = 0.0;          ///< [Pa] that the object was tracked with; with control points the first one's
  double surface_rms = 0.0;             ///< [m] from points that are no outliers to the tracked surface
  double confidence = 0.0;              ///< least of all frames in which the object was seen
  double fit_rms = 0.0;                 ///< [m] from the tracked points to the simulated ones, with the estimate
  double change = 0.0;                  ///< of ln E by the estimate, the greatest of all moduli
  bool lost = false;                    ///< in some frame
  VectorX theta;                        ///< estimated
  int controls = 1;                     ///< control moduli of `theta`
  std::vector<TriedField> fields = {};  ///< where their number was chosen in this round
};

/// One form of the law of a pressed object that was fitted.
struct TriedLaw {
  LawForm form;
  double cost = 0.0;      ///< infinite where it cannot be fitted
  double evidence = 0.0;  ///< for it against the best before: fall of half the BIC for terms, ln of the Bayes factor
                          ///< for zones and control points
  bool kept = false;
  double youngs_modulus = 0.0;  ///< [Pa] at no strain, geometric mean of its moduli; 0 where it cannot be fitted
};

/// Where a fit stands, to go on after an interruption.
struct FitState {
  PassState pass;  ///< that was under way
  /// Where the number of control points is chosen: the pass is the fit with one of them.
  struct FieldChoice {
    std::vector<TriedField> tried;   ///< that are done
    int best = 0;                    ///< of those tried
    std::optional<PassState> state;  ///< of the best one's fit, with its estimate
    std::optional<PassState> even;   ///< of the homogeneous object's
    int under_way = 0;               ///< control points of the fit that was under way; 0: none
  };
  std::optional<FieldChoice> field;
  /// Where the object is tracked.
  struct Tracking {
    enum class Phase { Loop, Direct, Last };
    Phase phase = Phase::Loop;
    std::vector<TrackingRound> rounds;  ///< that are done
    std::optional<PassState> loop;      ///< of the last of them, with its estimate
    std::optional<PassState> direct;    ///< of the fit to the points, with its estimate
    bool keeps_loop = true;             ///< in the last phase
  };
  std::optional<Tracking> tracking;
  std::optional<PressSampling::State> sampled;  ///< of a sampled material
  /// Where the part of the recordings is looked for that the model explains.
  struct SpanSearch {
    bool has_whole = false;          ///< the whole was fitted, and is not explained
    bool is_ended = false;           ///< the last part that was tried is not explained
    double part = 0.0;               ///< the longest that is explained; the first one where none is; 1: none is tried
    double next_part = 0.0;          ///< to be tried
    bool has_parts = false;          ///< parts of it are tried, on a finer mesh; the whole again after the longest
    std::optional<PassState> state;  ///< of the fit to `part`, with its estimate; of the whole before that
  };
  std::optional<SpanSearch> span = {};
};

/// A recording, and what its sensors saw.
struct RecordedCapture {
  Capture capture;
  std::vector<ObservedFrame> observed;
  std::optional<TrackedPoints> followed = {};  ///< points of the object, instead of the capture's markers
  /// Of an object that is released: points of its surface in the frame before that, as it was registered there (see
  /// `registered_pose`).
  std::optional<TrackedPoints> pose = {};
};

/// How an estimate predicts frames that took no part in it.
struct HeldOutFrames {
  bool succeeded = false;
  int frames = 0;
  double cost = 0.0, surface_rms = 0.0;  ///< [-], [m]
};

/// What tracking gave to a fit.
struct TrackingOutcome {
  std::vector<TrackingRound> rounds;
  bool keeps_loop = true;                            ///< the estimate is the loop's; else that from the points alone
  std::optional<HeldOutFrames> loop, direct;         ///< where both were tried
  std::string why;                                   ///< a sentence
  std::vector<std::shared_ptr<const Track>> tracks;  ///< of each recording, as tracked last
};

/// One of the recordings of a fit, at the solution.
struct RecordingOutcome {
  Discretisation discretisation;
  VectorX theta;                          ///< of all recordings; its own blocks are `discretisation.simulation.blocks`
  CostEvaluation evaluation;              ///< its own frames
  std::shared_ptr<const Body> rest_body;  ///< the body where it is stress-free
};

/// An object under static tests, and what a law predicts of its presses.
struct TestedObject {
  std::shared_ptr<const PressScene> scene;
  std::shared_ptr<const MaterialLaw> law;    ///< of its elements
  std::vector<PressPrediction> predictions;  ///< of all presses, tests too; empty where the fit was interrupted
};

/// The law that was fitted to static tests, and what it predicts of those of the first capture.
struct LawOutcome {
  std::shared_ptr<const PressScene> scene;
  std::shared_ptr<const MaterialLaw> law;
  LawLayout layout;
  MarkerNoise noise = {};     ///< of a marker's coordinate
  std::vector<ZoneCut> cuts;  ///< of the zones, one after the other
  std::vector<TriedLaw> tried;
  std::optional<SampledMaterial> sampled;  ///< with `samples`, one a press that was fitted
  std::vector<PressSample> samples;
  std::vector<PressPrediction> predictions;  ///< of all presses, tests too; empty where it was interrupted
  std::vector<TestedObject> others;          ///< of further captures, and of the one that was held out, last
};

/// A recording that took no part in the fit, as the estimate predicts it: only its own start, planes and sensors were
/// estimated.
struct HeldOutRecording {
  std::string name, sha256;   ///< of the capture
  CostEvaluation evaluation;  ///< may have failed
};

struct FitOutcome {
  ParameterSet parameters;  ///< as used, with the reference at the solution
  VectorX theta;            ///< of all recordings, by the layout of `parameters`
  VectorX start_theta;      ///< likewise; empty where the fit began with another form of the law
  VectorX std;              ///< of each unconstrained coordinate
  MatrixX covariance, correlation;
  Uncertainty uncertainty;  ///< what these are made of; empty where nothing is estimated
  Verdict verdict;          ///< whether the estimate can be quoted
  std::string material;     ///< elastic law and stiffness damping, in words; empty where nothing could be fitted
  FitOptions given;         ///< choices of the fit
  FitOptions used;          ///< the same, with what they left to the fit as it was decided
  double start_cost = 0.0, final_cost = 0.0;
  CostEvaluation evaluation;  ///< at the solution, all points of the fit
  std::vector<RecordingOutcome> recordings;
  double cells = 0.0;     ///< elements along the longest axis of the discretisation
  Refinement refinement;  ///< empty unless the estimate was repeated
  std::vector<FitStart> starts;
  std::vector<FitEvent> history;
  bool converged = false, interrupted = false;
  std::string reason;
  std::optional<TrackingOutcome> tracking;
  std::optional<LawOutcome> law;             ///< where presses are all that was fitted
  std::optional<HeldOutRecording> held_out;  ///< where there was one, and the fit was not interrupted
  std::vector<TriedField> fields;  ///< where the number of control points was chosen: those tried, in their order
  std::vector<std::string> notes;  ///< plain sentences
  long long forward_steps = 0;
  double ms_per_forward_step = 0.0, ms_per_adjoint_step = 0.0;  ///< at the solution, measured by one rollout of each
};

/// Watches a fit. All members may be empty.
struct FitMonitor {
  /// Whether it is to end: of processes that carry it out together the same in all of them (`ProcessGroup`).
  bool is_interrupted() const { return processes ? processes->is_interrupted() : interrupted && interrupted(); }
  /// The same where nothing is exchanged for long; asked as often by each of them.
  bool agrees_to_stop() const { return processes ? processes->agrees_to_stop() : is_interrupted(); }
  /// Whether this process is asked to end, in the midst of its share of the work.
  bool is_asked_to_stop() const { return processes ? processes->is_asked_to_stop() : is_interrupted(); }
  bool has_others() const { return processes && !processes->is_alone(); }

  std::function<void(const FitEvent&)> on_event;
  std::function<void(const FitState&)> on_state;  ///< something is done that a resumed fit need not do again
  std::function<bool()> interrupted;  ///< asked of this process alone; not with `processes`, which ask it themselves
  /// Processes that carry out the fit together: each is given the same recordings, options and state, and returns the
  /// same outcome, to the last bit that of one process; null: this one alone. Fits of static tests alone are not shared
  /// out: one process is to make them.
  std::shared_ptr<ProcessGroup> processes;
};

/// Estimates the unknown parameters of an object from what recordings hold of it.
///
/// Motions and equilibria: its pose or motion at the start from the first frames where that is unknown, a scan over
/// decades of Young's modulus on a coarse grid, the best starts followed there in a wide band and a growing horizon,
/// then the best on the full grid in a narrow band and, where asked, again at finer resolutions. Loads and presses of
/// the same recordings take part. Recordings share the object's material (moduli, Poisson's ratio, dampings and, where
/// it is estimated, density); each has its own start, planes and sensors, named with "[2]" and so on from the second
/// recording.
///
/// Static tests alone: the law of their one material (`fit_presses`).
/// @param resume    what an interrupted fit of the same recordings and options had done
/// @param held_out  a recording that takes no part in the fit, and is predicted by the estimate
/// Throws InputError where a recording cannot be fitted, or not together with the others, with the reason.
FitOutcome fit(std::vector<RecordedCapture> recordings, const FitOptions& options, const FitMonitor& monitor = {},
               FitState resume = {}, std::optional<RecordedCapture> held_out = {});

/// Takes covariance, standard deviations and correlation from an outcome's evaluation, which has derivatives, and what
/// is known about its models.
/// @param shifts, floor  as in `uncertainty_of`
/// @param tests          of static tests how well they are met, by which they are judged; nothing: by the evaluation
void add_uncertainty(FitOutcome& outcome, const std::vector<ModelShift>& shifts = {}, const VectorX& floor = {},
                     const std::optional<std::vector<Agreement>>& tests = std::nullopt);

}  // namespace pliant
