#pragma once

#include <memory>
#include <vector>

#include "estimation/parameter_set.hpp"
#include "mismatch/point_tracks.hpp"
#include "mismatch/surface_constraints.hpp"
#include "motion/simulation.hpp"

namespace pliant {

/// What was seen in one frame of the simulation.
struct FrameObservations {
  int frame = 0;                                ///< of the simulation: 0 is when the object is let go
  std::vector<SurfaceObservation> points = {};  ///< somewhere on the surface
  std::vector<TrackObservation> tracks = {};    ///< known points of the object
};

/// How one frame fits.
struct FrameFit {
  int frame = 0;
  int points = 0, matched = 0;  ///< of the surface
  int tracks = 0;               ///< followed points
  double cost = 0.0;
  VectorX gradient;                ///< by p; empty unless asked for
  MatrixX gauss_newton;            ///< J^T W J
  double sum_squares = 0.0;        ///< [m^2] of distances to the deformed surface, each at most the loss's scale
  double max_distance = 0.0;       ///< [m] of matched points
  double sum_noise_squares = 0.0;  ///< [m^2] of the sensor's standard deviations
  double track_sum_squares = 0.0;  ///< [m^2] of the followed points' distances
};

struct CostEvaluation {
  bool succeeded = false;
  std::string failure;
  double cost = 0.0;
  VectorX gradient;
  MatrixX gauss_newton;
  std::vector<FrameFit> frames;
  int steps = 0;
  double surface_rms() const;  ///< [m]; 0 where no surface was seen
  double track_rms() const;    ///< [m], of the followed points; 0 where there are none
  double matched_fraction() const;
};

struct ObjectiveOptions {
  double outlier_scale = 0.0;  ///< c of the robust loss [m], > 0, within the band
  int last_frame = 0;          ///< horizon, inclusive
  /// Neighbouring pixels err together: a frame counts as at most so many independent points.
  double independent_points = 50.0;
};

/// What was observed of a body and how it is compared; either may be null where there is nothing of its kind.
struct Mismatch {
  std::shared_ptr<const SurfaceConstraints> surface;
  std::shared_ptr<const PointTracks> tracks;
};

/// Maps parameters to the cost of one recording: the sum over frames and points of a robust loss of the pulled-back
/// distance, or of the distance from where a followed point was seen, over its noise, plus the priors. One instance for
/// one thread; the mismatch of a frame is evaluated beside the simulation of the next.
class Objective {
 public:
  Objective(Mismatch mismatch, std::shared_ptr<const Body> body, SimulationOptions simulation,
            std::shared_ptr<const std::vector<FrameObservations>> observations, ParameterSet parameters,
            ObjectiveOptions options);

  const ParameterSet& parameters() const { return parameters_; }
  const ObjectiveOptions& options() const { return options_; }
  ObjectiveOptions& options() { return options_; }
  Simulation& simulation() { return simulation_; }

  /// Cost alone.
  [[nodiscard]] CostEvaluation evaluate(const VectorX& p);
  /// Cost, gradient and Gauss-Newton matrix by tangents: for few parameters.
  [[nodiscard]] CostEvaluation linearise(const VectorX& p);
  /// Cost and gradient by the adjoint: any number of parameters.
  [[nodiscard]] CostEvaluation gradient(const VectorX& p);

 private:
  FrameFit fit_frame(const FrameObservations& seen, const Points& positions, const std::vector<Points>& tangents) const;
  CostEvaluation run(const VectorX& p, bool with_tangents);
  double frame_weight(const FrameObservations& seen) const;
  void fit_surface(const FrameObservations& seen, const Points& positions, const std::vector<Points>& tangents,
                   FrameFit& fit) const;
  void fit_tracks(const FrameObservations& seen, const Points& positions, const std::vector<Points>& tangents,
                  FrameFit& fit) const;

  Mismatch mismatch_;
  std::shared_ptr<const std::vector<FrameObservations>> observations_;
  ParameterSet parameters_;
  ObjectiveOptions options_;
  Simulation simulation_;
};

}  // namespace pliant
