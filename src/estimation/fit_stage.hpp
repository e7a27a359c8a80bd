#pragma once

#include <compare>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "estimation/law_stage.hpp"
#include "estimation/optimiser.hpp"
#include "estimation/refinement.hpp"
#include "estimation/uncertainty.hpp"

namespace pliant {

/// What a stage of a fit is for.
enum class StageKind {
  Pose,           ///< the poses of sensors, by an object that stands as it was scanned
  Motion,         ///< the motion or pose at the start
  Swing,          ///< the stiffness of the swing that was seen; no iterations
  Scan,           ///< a trial of each of several Young's moduli: no iteration
  Coarse,         ///< a start that is followed on the coarse grid
  Pulls,          ///< what holds a released object, on another grid
  Fine,           ///< the estimate on the full grid
  Test,           ///< which corrections the residuals ask for; no iterations
  Corrected,      ///< the estimate together with those
  ScanErrors,     ///< by how much the scan seems to err, and whether that is worth an estimate; no iterations
  OffScan,        ///< the estimate again with the surface where the scan's errors leave it
  Finer,          ///< the estimate again with finer steps or on a finer grid
  Alternative,    ///< a few steps from the estimate under another model
  Resolution,     ///< whether the next finer mesh is needed, and there is time for it; no iterations
  Law,            ///< a form of the law of a pressed object
  Scale,          ///< its moduli alone, where the other numbers begin
  Cut,            ///< where a zone more is promised most; no iterations
  Move,           ///< where one of the zones' cuts would fit better; no iterations
  ControlPoints,  ///< a field of control points, and what a step promises of it; no iterations
  Sample,         ///< the stiffness of each element that a few presses show, each by itself
};

/// Whether a stage only finds where others begin: they go on without it where it fails.
bool is_help(StageKind kind);

/// Whether a stage makes the estimate, on the full grid or a finer one.
bool is_on_full_grid(StageKind kind);

struct StageId {
  StageKind kind = StageKind::Fine;
  int start = 0;   ///< which start it belongs to
  int number = 0;  ///< of those of its kind and start
  auto operator<=>(const StageId&) const = default;
};

/// How far into each recording a stage compares.
struct Horizon {
  enum class Until {
    Part,       ///< a part of the recording, as `Recording::horizon` has it
    Beginning,  ///< a part, at least two frames; of a released object the frames before its release
    Start,      ///< the first frame
  };
  Until until = Until::Part;
  double part = 1.0;
  bool operator==(const Horizon&) const = default;
};

/// Of how much an object's stiffness varies, the part that is tried: estimates follow to first order.
inline constexpr double part_of_unevenness = 0.5;

/// Where a pass of a search among several ends early.
struct PassLimits {
  bool ends_if_unexplained = false;   ///< after its estimate
  bool looks_at_scan_errors = false;  ///< though it tries no alternatives
  /// What the cost of the last stage in the wide band must come below.
  double wide_band_cost = std::numeric_limits<double>::infinity();
};

/// In what a model differs from the one that is fitted.
struct ModelChange {
  bool small_strain = false;             ///< corotated linear elasticity, and Rayleigh's damping
  std::vector<double> scan_errors = {};  ///< of `ScanErrors`: the surface lies beside the scan; none: on it
  int unevenness = 0;  ///< a realisation of how stiffness varies over the object, from 1 on; 0: it is even
  bool operator==(const ModelChange&) const = default;
};

/// A model beside the one that is fitted, to see how much the estimate depends on the difference.
struct Alternative {
  std::string cause;                ///< for people: what the difference stands for
  double cells = 1.0, steps = 1.0;  ///< in those of the fit
  ModelChange change = {};
  bool given = false;  ///< the same model, and what is taken as given moves within its tolerance
  double size = 1.0;   ///< deviation of the truth, in the shift of the estimate
  /// What its estimate is compared with: the fit's own model, or the first alternative, whose mesh it shares.
  bool beside_the_first = false;
  int iterations = 3;  ///< before a last, short Gauss-Newton step, which is not evaluated
  /// Deviation of the logarithm of a modulus, at most: what a few steps say beyond that is taken for it, in proportion.
  double most = std::numeric_limits<double>::infinity();
};

/// A stage of a fit, as data: what is simulated and compared, what is estimated, and from where.
struct Stage {
  StageId id;
  std::string name;  ///< for people
  Spacing grid;
  ModelChange change = {};
  Horizon horizon = {};
  double band = 0.0;  ///< outlier scale, times the object's size
  int iterations = 0;
  /// Of the optimiser: a tenth of a standard deviation, and a part of the cost.
  double promise_tolerance = 0.005, cost_tolerance = 2e-4;
  /// Released objects start in the pose in which that stage's end holds them, whatever their material: pulls are not
  /// estimated beside it then. None: in the equilibrium under their pulls.
  std::optional<StageId> pose_of = {};
  /// Released objects are compared where they were registered before their release, if they were: that leads there from
  /// afar, and the surface goes on from where it ends.
  bool by_pose = false;
  /// First each modulus is tried several times smaller and larger, the others staying: a part that swings out of step
  /// seems stiff, and no valley leads back from there.
  bool tries_moduli = false;
  int iterations_before = 0;           ///< of its start, that are counted on
  double give_up_above = infinite;     ///< cost at its end that is worth no further stage
  std::vector<std::string> free = {};  ///< parameters that are estimated
  std::vector<VectorX> from = {};      ///< theta; of several the best end counts; empty: where the stage before ended
  std::vector<double> trials = {};     ///< of a scan: Young's moduli of the object's own material [Pa]
  double done_from = 0.0, done_to = 0.0;  ///< how much of the whole is done before and after it
  std::optional<Alternative> alternative = {};
  std::optional<LawTask> law = {};  ///< of a search for the law of a pressed object
};

/// Stages one after the other, each from where the one before ended.
using StageChain = std::vector<Stage>;

/// A stage that is done.
struct StageRecord {
  StageId id;
  std::string name;                     ///< for people
  VectorX from, theta;                  ///< where it began and ended
  double start_cost = 0.0, cost = 0.0;  ///< infinite where it could not be simulated
  double misfit = infinite;             ///< of a minimisation, at its end: see `misfit_of`
  bool is_explained = true;             ///< of a minimisation: see `is_explained`
  int iterations = 0;
  bool succeeded = false;
  /// Of a search for a swing: one was found; of a look at the resolution: the next finer mesh is made; of one at the
  /// scan's errors: they are worth an estimate.
  bool converged = false;
  std::string reason = {};         ///< why it ended
  int elements = 0;                ///< of the first recording's body
  double work = 0.0;               ///< that it took since the fit was last resumed: see `CostEvaluation::work`
  std::optional<int> joined = {};  ///< of a start: the one in whose valley it was stopped
  /// Of a scan: Young's moduli and costs; infinite where it cannot be simulated.
  std::vector<std::pair<double, double>> trials = {};
  std::vector<std::string> corrected = {};  ///< of a test: parameters that need correction
  std::string told = {};                    ///< for people: the swing that was found, what needs correction
  std::vector<ModelShift> shifts = {};      ///< of an alternative, or of errors of the scan: of the estimate
  /// Of a look at the errors of the scan: what they seem to be; of an estimate: what they were taken for.
  std::vector<double> scan_errors = {};
  std::optional<LawFinding> law = {};  ///< of a search for the law of a pressed object
  /// Of a minimisation, at its end; null where another process made it: files do not keep it.
  std::shared_ptr<const CostEvaluation> evaluation = {};
};

/// A stage that is under way.
struct StageUnderWay {
  StageId id;
  VectorX from;  ///< theta
  OptimiserState optimiser;
};

/// Where a pass through the stages of a plan stands.
struct PassState {
  int controls = 1;                        ///< control moduli of the parameter vectors below
  std::vector<StageRecord> done;           ///< in the order in which they ended
  std::optional<StageUnderWay> under_way;  ///< of those that make an estimate
  /// Where the stages on the full grid begin, if not with the best start: what came before was taken over from another
  /// pass.
  struct Beginning {
    VectorX theta;
    int stage = 0;                         ///< number of the first one; that with corrections comes last
    std::vector<double> scan_errors = {};  ///< of the surface that they begin with
  };
  std::optional<Beginning> begin;
};

}  // namespace pliant
