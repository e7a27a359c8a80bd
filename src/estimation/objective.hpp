#pragma once

#include <memory>
#include <vector>

#include "estimation/parameter_set.hpp"
#include "mismatch/point_tracks.hpp"
#include "mismatch/sensor_correction.hpp"
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
  int recording = 0, frame = 0;
  int points = 0, matched = 0;  ///< of the surface
  int tracks = 0;               ///< followed points
  double independent = 0.0;     ///< observations behind the cost
  double cost = 0.0;
  VectorX gradient;                ///< by p; empty unless asked for
  MatrixX gauss_newton;            ///< J^T W J
  std::vector<float> distances;    ///< [m] of each point to the deformed surface, each at most the loss's scale
  double sum_squares = 0.0;        ///< [m^2] of them
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
  std::vector<FrameFit> frames;  ///< of all recordings, one after the other
  int steps = 0;
  double surface_rms() const;     ///< [m]; 0 where no surface was seen
  double surface_median() const;  ///< [m], likewise
  double track_rms() const;       ///< [m], of the followed points; 0 where there are none
  double matched_fraction() const;
  double independent_observations() const;  ///< behind the cost, as `ObjectiveOptions` counts them
  /// The frames of one recording alone, with its cost and without derivatives.
  [[nodiscard]] CostEvaluation of_recording(int recording) const;
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
  Vector3 centre = Vector3::Zero();  ///< about which sensors are corrected
};

/// One recording as the objective sees it.
struct ObservedMotion {
  Mismatch mismatch;
  std::shared_ptr<const Body> body;
  SimulationOptions simulation;
  std::shared_ptr<const std::vector<FrameObservations>> observations;
  ObjectiveOptions options;
};

/// What is minimised: parameters to cost. One instance for one thread.
class CostFunction {
 public:
  virtual ~CostFunction() = default;
  virtual const ParameterSet& parameters() const = 0;
  /// Cost alone.
  [[nodiscard]] virtual CostEvaluation evaluate(const VectorX& p) = 0;
  /// Cost, gradient and Gauss-Newton matrix: for few parameters.
  [[nodiscard]] virtual CostEvaluation linearise(const VectorX& p) = 0;
  /// Cost and gradient: any number of parameters.
  [[nodiscard]] virtual CostEvaluation gradient(const VectorX& p) = 0;
};

/// Maps parameters to the cost of recordings: the sum over recordings, frames and points of a robust loss of the
/// pulled-back distance, or of the distance from where a followed point was seen, over its noise, plus the priors. The
/// recordings' thetas stand one after the other in that of the parameters. One instance for one thread; recordings are
/// simulated side by side, and the mismatch of a frame is evaluated beside the simulation of the next.
class Objective : public CostFunction {
 public:
  Objective(std::vector<ObservedMotion> recordings, ParameterSet parameters);
  /// Of one recording.
  Objective(Mismatch mismatch, std::shared_ptr<const Body> body, SimulationOptions simulation,
            std::shared_ptr<const std::vector<FrameObservations>> observations, ParameterSet parameters,
            ObjectiveOptions options);
  ~Objective() override;
  Objective(Objective&&) noexcept;

  const ParameterSet& parameters() const override { return parameters_; }

  /// From now on load-free shapes and corrected scans stay what they are for p: costs and derivatives leave their
  /// changes out. False where there are none.
  [[nodiscard]] bool hold_shapes(const VectorX& p);

  [[nodiscard]] CostEvaluation evaluate(const VectorX& p) override;
  /// By tangents.
  [[nodiscard]] CostEvaluation linearise(const VectorX& p) override;
  /// By the adjoint.
  [[nodiscard]] CostEvaluation gradient(const VectorX& p) override;

 private:
  class Part;
  CostEvaluation run(const VectorX& p, bool with_tangents);
  /// The priors, and what the parts say, summed in their order.
  CostEvaluation sum(const VectorX& p, std::vector<CostEvaluation> parts, bool has_gradient, bool has_matrix) const;

  ParameterSet parameters_;
  std::vector<std::unique_ptr<Part>> parts_;
};

}  // namespace pliant
