#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "estimation/fit.hpp"
#include "estimation/given_quantities.hpp"
#include "estimation/press_scene.hpp"

namespace pliant {

/// The object at rest under a weight, and what was seen of it then.
struct LoadCase {
  Load load;
  TrackedPoints tracked;                                               ///< markers
  std::shared_ptr<const std::vector<FrameObservations>> observations;  ///< of one frame
};

/// One of the recordings of a fit: what was seen, and where its parameters stand in the vector of all.
struct Recording {
  Capture capture;
  TrackedPoints tracked;
  std::shared_ptr<const std::vector<FrameObservations>> observations;
  std::optional<TrackedPoints> pose;  ///< from which it is released, where it was registered
  std::shared_ptr<const SignedDistance> distance;
  double size = 0.0;                 ///< of the object [m]
  double thickness = 0.0;            ///< of the object [m], as `thickness` has it
  double scan_error = 0.0;           ///< standard deviation of its scan along the normals [m]; 0: exact
  double unevenness = 0.0;           ///< standard deviation of the logarithm of its stiffness; 0: even
  int last_frame = 0;                ///< that is compared
  int last_seen = 0;                 ///< of the whole recording
  std::vector<double> common_error;  ///< of each depth camera, what all its readings err by together [m]
  CaptureBlocks blocks;
  std::vector<LoadCase> loads;  ///< those that are fitted

  bool is_released() const { return capture.scene.initial.released; }
  /// The last frame of a part of the recording, (0, 1]. A flying object shows no stiffness in its first third; one that
  /// swings shows it at once.
  int horizon(double part) const;
};

/// How finely all recordings of a fit are simulated.
struct Grid {
  double cells = 0.0, steps = 0.0;  ///< as in `Resolution`
  ModelChange change = {};
  std::vector<Discretisation> recording;  ///< of each
  /// Presses of each recording around a body of tetrahedra; null where it has none that are fitted.
  std::vector<std::shared_ptr<const PressScene>> presses;
};

/// What an objective compares of recordings.
struct Compared {
  double band = 0.0;                                ///< outlier scale, times the object's size
  std::function<int(const Recording&)> last_frame;  ///< of each
  /// Parameters whose pulls hold released objects in the pose from which they start, whatever their material; empty:
  /// the equilibrium under their pulls is that.
  VectorX pose_of = {};
  bool by_pose = false;  ///< the first frame of released objects by where they were registered, if they were
  /// Frames by which all that was seen of a motion is taken later than stated; nothing: as stated, up to `last_frame`.
  std::optional<int> later = {};
  bool keeps_rows = false;  ///< evaluations have the residuals by themselves
};

/// The recordings of one object side by side: they share its material, and each has its own start, planes and sensors.
class Recordings {
 public:
  /// Throws InputError where a recording cannot be fitted, with the reason.
  /// @param notes  what the user should know about how they were read is added
  Recordings(std::vector<RecordedCapture> recorded, const FitOptions& options, std::vector<std::string>& notes);

  const std::vector<Recording>& all() const { return all_; }
  const Recording& front() const { return all_.front(); }
  int controls() const { return controls_; }  ///< moduli of the object
  /// All parameters where the fit begins, with the options' choices.
  const ParameterSet& parameters() const { return parameters_; }
  bool any_released() const { return std::ranges::any_of(all_, &Recording::is_released); }
  bool all_static() const {
    return std::ranges::all_of(all_, [](const Recording& r) { return r.capture.scene.timing.is_static; });
  }
  /// Whether a scan was taken as the object sags.
  bool any_sags() const {
    return std::ranges::any_of(all_,
                               [](const Recording& r) { return r.capture.scene.object.shape_is == ShapeIs::Static; });
  }
  bool any_scan_errs() const {
    return std::ranges::any_of(all_, [](const Recording& r) { return r.scan_error > 0.0; });
  }
  bool any_uneven() const {
    return std::ranges::any_of(all_, [](const Recording& r) { return r.unevenness > 0.0; });
  }
  bool any_meshed_here() const {
    return std::ranges::any_of(all_, [](const Recording& r) { return !r.capture.scene.object.volume; });
  }

  /// Whether where the body is stress-free follows from the parameters.
  bool moves_reference() const { return any_sags() || options_.scan_points > 0; }

  /// Errors that all readings of a sensor have in common, where the images show that they do.
  std::vector<CommonError> common_errors() const;
  /// How well their lengths are known: as badly as any of them states, together.
  GivenScale given_scale() const;

  /// @param about  of the same resolution and another surface near that of the change's scan errors, on whose lattice
  ///               elements are laid, so that both differ as smoothly as the surfaces do; null: on their own
  [[nodiscard]] Grid grid(double cells, double steps, const ModelChange& change = {},
                          const Grid* about = nullptr) const;

  /// The objective of the recordings' motions and, where parameters of the object are estimated or none are, of their
  /// loads and presses.
  /// @param interrupted  of its motions: see `ObjectiveOptions`
  /// @param processes   that evaluate it together; null: this one alone
  [[nodiscard]] Objective objective(const Grid& grid, const ParameterSet& parameters, const Compared& compared,
                                    const std::function<bool()>& interrupted = {},
                                    const std::shared_ptr<ProcessGroup>& processes = nullptr) const;
  /// The parameters with the prior of their moduli at the grid's control points, if it has any.
  [[nodiscard]] ParameterSet with_field_prior(ParameterSet parameters, const Grid& grid) const;

  /// Where the moduli stand in theta, and Poisson's ratio: the same of all recordings.
  const MaterialBlocks& material() const { return front().blocks.motion; }
  /// Parameters that show while an object that will move still stands as it was scanned: what is estimated of the
  /// sensors that see it then, and the places of planes.
  std::vector<std::string> told_at_rest() const;
  /// Sets the moduli [Pa], as many as controls.
  void set_moduli(VectorX& theta, const VectorX& moduli) const;

  /// In what elements the object is simulated.
  Resolution resolution(double cells, double steps) const;

 private:
  Discretisation off_scan(const Recording& r, Resolution own, const SimulationOptions& settings,
                          const std::vector<double>& errors, const Grid* about, const Discretisation* beside) const;
  CaptureParameters make_ready(RecordedCapture recorded, Recording& recording, std::vector<std::string>& notes);
  std::shared_ptr<const PressScene> press_scene(const Recording& recording, const Discretisation& d,
                                                const Resolution& resolution) const;
  void add_loads(const Recording& recording, const Discretisation& d, const ObjectiveOptions& options,
                 std::vector<std::unique_ptr<Trial>>& trials) const;
  void add_presses(const Recording& recording, const Discretisation& d, const std::shared_ptr<const PressScene>& scene,
                   const ParameterSet& parameters, std::vector<std::unique_ptr<Trial>>& trials) const;
  double widest_band() const;

  FitOptions options_;
  std::vector<Recording> all_;
  int controls_ = 1;
  ParameterSet parameters_;
};

/// Where the parameters of several recordings of one object stand in one vector: blocks of the object once, those of
/// each recording's own start, planes and sensors each for itself, with "[2]" and so on after their names from the
/// second recording.
struct JointLayout {
  ParameterLayout layout;
  std::vector<ParameterLayout> own;   ///< of each recording by itself
  std::vector<CaptureBlocks> blocks;  ///< of each recording, in `layout`

  /// What a block of a recording's own layout is called in `layout`.
  std::string name_of(const std::string& block, std::size_t recording) const;
  /// The vector of one recording by itself.
  VectorX part(const VectorX& theta, std::size_t recording) const;
};

/// Joins the layouts of recordings.
/// @param shares_density  whether they have one density; else each has that of its own capture
JointLayout join(const std::vector<CaptureParameters>& recordings, bool shares_density);

/// The layout of the parameters that a fit of these recordings with so many control moduli has.
JointLayout joint_layout(const std::vector<RecordedCapture>& recordings, const FitOptions& options, int controls);

/// A vector of one layout as one of another with other control moduli [Pa].
VectorX with_moduli(const JointLayout& from, const VectorX& theta, const JointLayout& to, const VectorX& moduli);

}  // namespace pliant
