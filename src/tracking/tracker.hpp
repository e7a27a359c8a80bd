#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "capture/observe.hpp"
#include "mismatch/point_tracks.hpp"
#include "motion/simulation.hpp"
#include "rays/ray_scene.hpp"
#include "tracking/correspondence.hpp"
#include "tracking/point_springs.hpp"
#include "tracking/surface_samples.hpp"

namespace pliant {

/// Choices of a tracker; none is needed.
struct TrackOptions {
  /// How stiff all virtual springs of a frame are together, in units of the body's own stiffness against its slowest
  /// vibration, of its inertia over a frame and of its weight over its size. The body's and the springs' stiffness grow
  /// together: how the object is tracked depends little on how stiff it is thought to be.
  double data_weight = 1000.0;
  /// That weight where nothing holds the body: against inertia and weight, and against its slowest vibration. It moves
  /// and turns freely then, and what need not bend keeps its shape: a hand that lies on it is no part of it.
  double free_weight = 30.0, shape_weight = 10.0;
  double outlier_share = 0.1;  ///< of the points, beforehand, (0, 1)
  double widest = 0.15;        ///< deviation of the correspondences where they are sought, times the object's size
  /// How much the expected density of points over the surface is worth against what was seen: sensors see less of what
  /// is steep, hidden or at an edge, and a surface must not stretch to make up for that. > 0
  double density_prior = 0.1;
  /// Deviation of the correspondences at which a spring pulls alike in every direction, times the object's size;
  /// narrower ones let the surface slide along itself in proportion.
  double sliding = 0.3;
  double annealing = 0.7;        ///< of that deviation from one round to the next, (0, 1)
  int max_rounds = 40;           ///< of expectation and maximisation a frame, >= 1
  double sample_spacing = 0.01;  ///< of the surface, times the object's size
  int most_samples = 16000;
  int marks = 300;  ///< about so many points of the surface are followed for estimation
};

/// What was seen in one frame.
struct TrackView {
  std::vector<Vector3> points;            ///< [m], world
  std::vector<float> noise;               ///< of each [m]
  std::vector<TrackObservation> markers;  ///< known points of the object
};

/// Where the object was in one frame.
struct TrackedFrame {
  int frame = 0;         ///< of the recording
  double time = 0.0;     ///< [s]
  bool is_held = false;  ///< before it was let go, or at rest
  Points nodes;          ///< n x 3 [m]
  int points = 0, markers = 0;
  double explained = 0.0;    ///< share of the points that are no outliers
  double supported = 0.0;    ///< share of what the sensors could see of the surface on which points were seen
  double surface_rms = 0.0;  ///< [m] of explained points along the surface's normal
  double marker_rms = 0.0;   ///< [m]
  double confidence = 0.0;  ///< 0..1: how much of what is usually seen was seen, times how well it fits; 0: nothing was
  bool is_lost = false;     ///< points were seen, and the object is not where they are
  int rounds = 0;
  std::vector<float> residuals;  ///< [m] of each point along the surface's normal, outwards; NaN for outliers
  std::vector<int> mark_points;  ///< explained points about each mark
};

/// Where a tracker's time goes, summed over frames [s].
struct TrackTimes {
  double visibility = 0.0, correspondence = 0.0, motion = 0.0;
};

/// The motion of an object.
struct Track {
  std::shared_ptr<const Body> body;  ///< stress-free
  TriangleMesh surface;              ///< at rest, as sampled
  std::vector<Vector3> marks;        ///< [m] at rest, on the surface
  std::vector<TrackedFrame> frames;
  std::string note;  ///< what the user should know; may be empty
  TrackTimes times;
  std::optional<int> lost_at;  ///< the first frame of the recording from which the object stays lost for some
};

/// Follows a deforming object through points that were seen of its surface: maximum a posteriori by expectation
/// maximisation (Wang 2015, section 5; Schulman et al. 2013). In each frame soft correspondences between points and
/// samples of the surface, with a class of outliers and a deviation that anneals, become virtual springs; the body's
/// own implicit dynamics with them gives the motion, run to convergence, and new correspondences.
class Tracker {
 public:
  /// @param body        stress-free
  /// @param scene       held regions, planes, weights and solver count; `scan_sags` is passed over
  /// @param surface     in the scan [m]
  /// @param cameras     that saw the points: what they cannot see makes none; empty: unknown
  /// @param markers     rest positions of known points [m]
  /// @param typical     number of points in a frame
  /// @param noise       of a point, typically [m], >= 0
  Tracker(std::shared_ptr<const Body> body, const SimulationOptions& scene, const VectorX& theta,
          const TriangleMesh& surface, std::vector<PinholeCamera> cameras, const std::vector<Vector3>& markers,
          int typical, double noise, const TrackOptions& options = {});

  const TriangleMesh& surface() const { return surface_; }  ///< as sampled, in the scan
  std::vector<Vector3> marks() const;
  const State& state() const { return state_; }
  /// Sets positions and velocities, both n x 3.
  void set_state(State state) { state_ = std::move(state); }

  /// The object at rest under gravity and whatever holds it.
  TrackedFrame hold(const TrackView& view);
  /// Some time [s] later. Without anything seen it is simulated.
  TrackedFrame advance(double dt, const TrackView& view);

  /// How what was seen fits where the object is now; nothing moves.
  TrackedFrame compare(const TrackView& view);

  /// Spent so far.
  const TrackTimes& times() const { return times_; }

 private:
  TrackedFrame look(double dt, bool at_rest, const TrackView& view);
  /// Delta of a step with the springs at hand, by repeated lagged steps until it changes by less than `tolerance` [m].
  [[nodiscard]] bool relax(Points& delta, double tolerance);
  [[nodiscard]] bool drift(double dt);
  /// Of those, the one whose surface is nearest to what was seen; and how far most points are from it.
  double choose(std::vector<Points> candidates, const TrackView& view, Points& delta) const;
  [[nodiscard]] bool maximise(double dt, bool at_rest, const TrackView& view, double distance, Points& delta,
                              TrackedFrame& frame);
  void learn_density(const SampleLevel& level, const std::vector<double>& shares, const Correspondence& c);
  /// Of the surface with its vertices there.
  Points normals_of(const Points& vertices) const;
  void see(const Points& nodes);
  const SampleLevel& level_for(double deviation) const;
  Points samples_of(const SampleLevel& level, const Points& nodes) const;
  std::vector<double> shares_of(const SampleLevel& level) const;
  void describe(const Points& nodes, const TrackView& view, TrackedFrame& frame);
  double spread(const TrackView& view) const;
  /// In which outliers lie [m^3]: where points were seen.
  double volume_of(const TrackView& view) const;

  std::shared_ptr<const Body> body_;
  TriangleMesh surface_;
  std::vector<PinholeCamera> cameras_;
  TrackOptions options_;
  double size_ = 0.0, mass_ = 0.0, slowest_ = 0.0, pendulum_ = 0.0, noise_ = 0.0, finest_ = 0.0, typical_ = 1.0;
  double usually_supported_ = 0.0;
  int samples_ = 0;  // vertices of the surface; markers follow them among the springs' points
  std::vector<SampleLevel> levels_;
  std::size_t mark_level_ = 0;
  std::vector<double> visible_;  // of each vertex, 0..1
  std::vector<double> density_;  // of points seen there, to what visibility alone says
  RayScene rays_;
  PointSprings* springs_ = nullptr;  // of the stepper's terms
  std::unique_ptr<Stepper> stepper_;
  State state_;
  bool is_free_ = false;  // nothing holds it
  bool found_ = false;    // in some frame
  int lost_for_ = 0;      // frames
  double outlier_share_;
  TrackTimes times_;
};

/// Tracks a recording: frames from its start on, and those before a release, in which something holds it.
/// @param body   as scanned; where the scene says that the scan sags, its load-free shape follows from theta. Where
///               there is none for theta, the scan stands in for it and gravity is left out, with a note.
/// @param progress  frames done and their total; false stops. May be empty
/// Throws InputError where nothing was seen, or where held regions are moved.
Track track(const Capture& capture, const std::shared_ptr<const Body>& body, const SimulationOptions& scene,
            const VectorX& theta, const std::vector<ObservedFrame>& observed, const std::vector<Vector3>& markers,
            const std::map<int, std::vector<TrackObservation>>& seen_markers, const TrackOptions& options = {},
            const std::function<bool(int, int)>& progress = {});

}  // namespace pliant
