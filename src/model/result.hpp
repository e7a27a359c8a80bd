#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/profile.hpp"
#include "base/types.hpp"

namespace pliant {

/// What a fit found: `result.json` of docs/formats.md, member by member. SI units.

/// Value of a plane.
struct PlaneValue {
  Vector3 point = Vector3::Zero();    ///< [m]
  Vector3 normal = Vector3::UnitY();  ///< unit length
  bool operator==(const PlaneValue&) const = default;
};

using ParameterValue = std::variant<double, Vector3, PlaneValue>;

/// What was held likely of a parameter before the recording was seen.
struct PriorResult {
  ParameterValue median = 0.0;
  std::optional<std::pair<double, double>> interval_90 = {};  ///< of a scalar
  std::optional<Vector3> std = {};                            ///< of a vector, along each axis
  bool operator==(const PriorResult&) const = default;
};

/// A parameter, estimated or given; `name` as in the format, with "@region" where it belongs to one.
struct ParameterResult {
  std::string name;
  ParameterValue value = 0.0;
  std::string unit;                     ///< "Pa", "1", "1/s", ...; empty: none (a plane)
  std::optional<ParameterValue> std;    ///< one standard deviation, of the value's kind
  std::optional<ParameterValue> start;  ///< where the estimation began
  bool estimated = false;
  /// Where the estimate was repeated at other resolutions: how far mesh and time steps may have put the value off, and
  /// where it goes as both become infinitely fine.
  std::optional<ParameterValue> mesh_error = {}, step_error = {}, extrapolated = {};
  /// What `std` is made of, where models other than the fit's were tried, and the 90 % interval of a scalar.
  std::optional<ParameterValue> std_noise = {}, std_model = {};
  std::optional<std::pair<double, double>> interval_90 = {};
  std::optional<PriorResult> prior = {};  ///< of an estimated scalar or vector that has one, in its unit
};

/// A control point of a field of values.
struct ControlPoint {
  Vector3 position = Vector3::Zero();  ///< [m], reference shape
  double value = 0.0;
  std::optional<double> std;
};

/// What a number of control points was worth, where it was chosen.
struct TriedFieldResult {
  int control_points = 1;
  bool estimated = false;                  ///< false: one Gauss-Newton step promised too little
  std::optional<double> cost;              ///< of the estimate
  std::optional<double> log_bayes_factor;  ///< against the best before; nothing: it cannot be simulated
};

struct FieldResult {
  std::string name;  ///< the parameter's
  std::vector<ControlPoint> control_points = {};
  std::string per_element = {};  ///< file with the values of the elements, beside the result; empty: none
  std::vector<TriedFieldResult> tried = {};
};

/// Distances between what was seen and what was simulated [m].
struct ErrorResult {
  std::optional<double> surface_rms, surface_median, surface_max, marker_rms;
  std::optional<double> outline_rms = {};  ///< of outlines alone, which `surface_rms` counts too
  long long points = 0;
  struct Frame {
    int frame = 0;                  ///< of the simulation: 0 is its start
    double rms = 0.0, noise = 0.0;  ///< [m], of the distances to the surface, and of the sensor
    int points = 0;
  };
  std::vector<Frame> frames = {};  ///< of one recording; empty for several, and where no surface was seen
};

/// One of several recordings of a fit, or one that was kept out of it.
struct RecordingResult {
  std::string name, sha256;
  ErrorResult error;
};

/// What the object did while it was measured: beyond that a model is extrapolated.
struct DeformationResult {
  /// Principal strain (`greatest_strain`) that a hundredth and that half of the volume exceed at some time [-].
  double greatest_strain = 0.0, median_strain = 0.0;
  std::optional<double> greatest_rate = {};  ///< of that strain, likewise of a hundredth [1/s]; of motions
};

struct CostResult {
  double start = 0.0, final = 0.0;
};

/// What one cause contributes to the deviations of the estimates.
struct UncertaintyResult {
  std::string cause;                  ///< "noise", "mesh", "mass", ...
  std::map<std::string, double> std;  ///< by parameter name, of scalars, in their units
};

struct CorrelationResult {
  std::pair<std::string, std::string> parameters;
  double correlation = 0.0;  ///< -1..1
};

/// One run of the optimiser from one starting point.
struct StartResult {
  std::map<std::string, double> start, final;  ///< by parameter name
  std::optional<double> cost;                  ///< nothing: not finite
  int iterations = 0;
  bool converged = false;
  std::string reason;  ///< why it stopped
};

/// The estimate at one of several resolutions.
struct ResolutionResult {
  double cells = 0.0;  ///< elements along the object's longest axis
  double steps = 0.0;  ///< time steps per default step
  long long elements = 0;
  std::map<std::string, double> values;  ///< of what was estimated, by parameter name
  std::optional<double> cost;
  bool converged = false;
  std::string reason;  ///< why the optimiser stopped
};

/// One round of tracking and estimation in turns.
struct TrackingRoundResult {
  double tracked_with = 0.0;                   ///< Young's modulus [Pa] that the object was followed with
  double youngs_modulus = 0.0;                 ///< estimated from its motion [Pa]
  std::optional<double> surface_rms, fit_rms;  ///< [m] points to the tracked surface; tracked to simulated points
  double confidence = 0.0;                     ///< least of all frames
  bool lost = false;
};

/// How an estimate predicts frames that were left out.
struct HeldOutFramesResult {
  int frames = 0;
  std::optional<double> cost, surface_rms;  ///< nothing: it cannot be simulated; [m]
};

/// Where the object was tracked.
struct TrackingResult {
  std::string kept;  ///< "tracked motion" or "points": what the estimate was made from
  std::string why;   ///< a sentence
  std::vector<TrackingRoundResult> rounds;
  std::optional<HeldOutFramesResult> loop, direct;  ///< where both were tried
};

/// Curve or measurement between grips beside what a material predicts of it.
struct CurvePrediction {
  std::string name, kind, role;        ///< kind: "indentation", "grip force" or "material curve"
  std::string abscissa, unit;          ///< what the points stand over, like "depth [m]"; the ordinate's unit: N or Pa
  std::vector<double> at;              ///< depths [m], displacements [m], stretches or shears [-]
  std::vector<double> measured, std;   ///< [unit], as many
  std::vector<double> predicted;       ///< [unit], as many; not a number where no equilibrium was found
  std::string failure;                 ///< why not; empty: all points have one
  std::optional<double> depth_offset;  ///< [m] of an indentation: estimated, to be added to `at`; in `predicted`
  std::optional<DeformationResult> strained = {};  ///< over all points, as predicted
  double rms() const;           ///< [unit] of predicted less measured; not a number where one is missing
  double relative_rms() const;  ///< over the greatest measured size
};

struct TimeResult {
  double wall_seconds = 0.0;
  long long forward_steps = 0;
  std::optional<double> ms_per_forward_step, ms_per_adjoint_step;
  std::vector<ActivityTime> activities = {};  ///< where the time went, and
  std::vector<StageTime> stages = {};         ///< when: of a fit that was profiled
};

struct Result {
  struct Software {
    std::string name = "pliant", version, commit;
  } software;
  struct Recording {
    std::string name, sha256;
  } capture;
  std::vector<ParameterResult> parameters;
  std::vector<FieldResult> fields;
  ErrorResult error;
  std::vector<RecordingResult> recordings;  ///< where there are several: the errors of each
  std::optional<RecordingResult> held_out;  ///< predicted, with its own start, planes and sensors alone estimated
  CostResult cost;
  std::optional<DeformationResult> deformation;  ///< of the first recording, as it was simulated
  std::string material;  ///< what law the object was taken to have, and how it damps, in words; empty: it is not known
  std::vector<CorrelationResult> identifiability;
  std::string verdict;               ///< "explained", "unexplained" or "undetermined"; empty: none was made
  std::vector<std::string> reasons;  ///< of the verdict, plain sentences
  /// Choices of the fit, values as JSON writes them: those that differ from the standard, and all as they were used.
  std::map<std::string, std::string> options_given, options_used;
  std::map<std::string, double> judgement;  ///< numbers set by hand that intervals, verdict and model rest on, by name
  std::vector<UncertaintyResult> uncertainty;
  std::vector<StartResult> starts;
  std::vector<ResolutionResult> resolutions;  ///< where there are several, in the order in which they were used
  std::optional<TrackingResult> tracking;
  std::vector<CurvePrediction> curves;  ///< force-depth curves, forces of grips and stress-strain curves, of all roles
  TimeResult time;
  std::vector<std::string> notes;  ///< plain sentences for the user

  /// The parameter of that name, or null.
  const ParameterResult* find(const std::string& name) const;
};

/// JSON text in the format "result/1". A number that is not finite becomes null, so that a fit's end is never lost to
/// one bad figure; `read_result` takes null as "nothing" where a member is optional.
std::string to_json(const Result& result);

/// Writes `result.json`, whole or not at all. Throws InputError where it cannot be written.
void write_result(const std::filesystem::path& path, const Result& result);

/// Reads of a `result.json` what is asked of an earlier fit: of each parameter its value, unit, deviation, interval and
/// prior and whether it was estimated, and the correlations, the verdict, the error's surface_rms and how far the
/// object was strained; the rest of the result stays empty. Throws InputError naming the place: line and column where
/// the text is not JSON, the member
/// ("parameters.density.value") where something of this is missing or of another kind.
Result read_result(const std::filesystem::path& path);

/// One iteration of one start of an optimisation.
struct ConvergenceRow {
  int start = 0, iteration = 0;
  std::string stage;  ///< what was being estimated, like "stiffness" or "all"
  double cost = 0.0;
  double damping = 0.0;            ///< Levenberg-Marquardt's; 0 where there is none
  std::vector<double> parameters;  ///< in the order of `ConvergenceHistory::parameters`
};

struct ConvergenceHistory {
  std::vector<std::string> parameters, units;  ///< names; as many units
  std::vector<ConvergenceRow> rows;
};

/// Writes `convergence.csv`: a header `start,stage,iteration,cost,damping,<parameter [unit]>...`, then the rows.
/// Throws std::invalid_argument where a row has another number of parameters.
void write_convergence(const std::filesystem::path& path, const ConvergenceHistory& history);

/// A measurement under a known force or weight, as predicted by a model.
struct StaticError {
  std::string name, role;
  std::optional<double> marker_rms, marker_max;  ///< [m]
  std::optional<double> max_displacement;        ///< greatest measured displacement [m]
  std::optional<double> relative_error;          ///< rms over max_displacement
};

/// A measurement under a hung weight: where the object was seen and where the model has it.
struct LoadError : StaticError {
  std::string observed;  ///< "markers", "cloud", "depth", "cloud and depth"; empty: nothing of the object was seen
  int points = 0;        ///< markers that were seen, or points
  int outliers = 0;      ///< points that were left out because they stand alone in their cloud
  std::optional<double> mean;  ///< distance of the markers, or of the points to the simulated surface [m]
  std::optional<double> max;
  std::optional<double> relative_mean, relative_max;  ///< over the object's size
  std::string failure;                                ///< why there are no figures; empty: there are
};

/// What a model is worth on another recording: "evaluation/1" of docs/formats.md.
struct Evaluation {
  ErrorResult error;
  std::vector<StaticError> presses;
  std::vector<LoadError> loads;
  std::vector<CurvePrediction> curves;
};

std::string to_json(const Evaluation& evaluation);
void write_evaluation(const std::filesystem::path& path, const Evaluation& evaluation);

}  // namespace pliant
