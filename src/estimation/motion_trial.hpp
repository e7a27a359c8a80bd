#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "estimation/judgement.hpp"
#include "estimation/trial.hpp"
#include "mismatch/outline_constraints.hpp"
#include "mismatch/point_tracks.hpp"
#include "mismatch/sensor_correction.hpp"
#include "mismatch/surface_constraints.hpp"
#include "motion/simulation.hpp"

namespace pliant {

/// A plane of the scene as a sensor saw it.
struct PlaneObservation {
  int plane = 0;                              ///< of the motion's blocks
  int sensor = 0;                             ///< whose correction applies
  Vector3 point = Vector3::Zero();            ///< [m] on it, by the sensor's stated pose
  Vector3 normal = Vector3::UnitY();          ///< unit length, likewise
  Sight sight = {};                           ///< how the sensor sees the point
  Vector3 normal_off_axis = Vector3::Zero();  ///< the normal's part across the sensor's optical axis
  double tilt_std = 0.0, height_std = 0.0;    ///< [rad], [m] of its normal, and of the point along it; > 0
};

/// What was seen in one frame of the simulation.
struct FrameObservations {
  int frame = 0;                                ///< of the simulation: 0 is when the object is let go
  std::vector<SurfaceObservation> points = {};  ///< somewhere on the surface
  std::vector<TrackObservation> tracks = {};    ///< known points of the object
  double after = 0.0;                           ///< [s] since that frame, and before the next
  int at_rest = 0;                            ///< of an object that stands still as it was scanned: frames that show it
  std::vector<PlaneObservation> planes = {};  ///< of the scene
  std::vector<OutlineObservation> outlines = {};  ///< of cameras without depth

  std::size_t outline_points() const {
    std::size_t count = 0;
    for (const OutlineObservation& outline : outlines) count += outline.points.size();
    return count;
  }
};

struct ObjectiveOptions {
  double outlier_scale = 0.0;  ///< c of the robust loss [m], > 0, within the band
  int last_frame = 0;          ///< horizon, inclusive
  /// Neighbouring pixels err together: a frame counts as at most so many independent points.
  double independent_points = judgement.independent_points;
  /// Of an object that stands still as it was scanned there is no model to err.
  double independent_points_at_rest = judgement.independent_points_at_rest;
  bool keeps_rows = false;  ///< evaluations have the residuals by themselves: `FrameFit::rows`
  /// Asked at each frame whether the work is to end; may be empty.
  std::function<bool()> interrupted = {};
};

/// What was observed of a body and how it is compared; each may be null where there is nothing of its kind.
struct Mismatch {
  std::shared_ptr<const SurfaceConstraints> surface;
  std::shared_ptr<const PointTracks> tracks;
  Vector3 centre = Vector3::Zero();        ///< about which sensors are corrected
  std::vector<SensorBlocks> sensors = {};  ///< their corrections in the parameter vector; may be fewer than there are
  std::shared_ptr<const OutlineConstraints> outlines = {};
};

/// A body in motion, or at rest, and what was seen of it.
struct ObservedMotion {
  Mismatch mismatch;
  std::shared_ptr<const Body> body;
  SimulationOptions simulation;
  std::shared_ptr<const std::vector<FrameObservations>> observations;
  ObjectiveOptions options;
};

/// A motion, or an equilibrium, compared with points on its surface, with its outlines in pictures and with points of
/// the object that were followed: the sum over frames and points of a robust loss of the pulled-back distance, of the
/// distance from an outline's ray to the occluding contour, or from where a followed point was seen, over its noise;
/// and half the squares of how far planes were seen from where they are, over theirs.
/// The comparison of a frame is evaluated beside the simulation of the next.
/// Runs throw Interrupted at the frame where `ObjectiveOptions::interrupted` says so.
class MotionTrial : public Trial {
 public:
  /// @param number  what its frames call it (`FrameFit::recording`)
  MotionTrial(ObservedMotion motion, int number);
  ~MotionTrial() override;

  [[nodiscard]] CostEvaluation run(const VectorX& theta, const MatrixX& directions) override;
  [[nodiscard]] CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override;
  [[nodiscard]] double expected_work() const override;
  [[nodiscard]] bool hold_shape(const VectorX& theta) override;
  [[nodiscard]] std::unique_ptr<Trial> anew() const override;

 private:
  class Comparison;
  std::unique_ptr<Comparison> comparison_;
};

}  // namespace pliant
