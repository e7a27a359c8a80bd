#pragma once

#include "elasticity/modes.hpp"
#include "mismatch/point_tracks.hpp"

namespace pliant {

/// How the motion of followed points becomes coordinates of modes.
enum class ModeProjection {
  Automatic,       ///< rotation-strain where parts of the body turn far and enough points show it, else displacements
  Displacements,   ///< u = sum_j z_j phi_j at the points: of small rotations, where it withstands noise best
  RotationStrain,  ///< log R + S - I = sum_j z_j grad phi_j: of any rotation below half a turn
};

/// One instant at which points were seen.
struct SeenInstant {
  double time = 0.0;  ///< [s]
  std::vector<TrackObservation> seen;
};

/// Coordinates over time, of the instants at which enough was seen.
struct ModeCoordinates {
  std::vector<double> times;                                  ///< [s]
  MatrixX values;                                             ///< instants x modes [m sqrt(kg)]
  ModeProjection projection = ModeProjection::Displacements;  ///< the one used
};

/// Followed points through time, ready to be projected on modes (Wang 2015, section 6.3).
///
/// In rotation-strain coordinates (Huang 2011) a part of the body that turns by R and stretches by S has the
/// coordinates log R + S - I, which a mode changes in proportion to its displacement gradient, however far it turns.
/// The paper has every node of its meshes followed and takes the gradients of elements. Here a gradient is that of the
/// affine map which fits a followed point and its nearest neighbours at rest best: where all nodes are followed much
/// the same, and there too where an element has fewer followed points than nodes. Four neighbours that do not lie in a
/// plane are the least. Where fewer instants show that, it is plain displacements.
///
/// Coordinates are those of least squares, weighted by the points' noise, with a trace of a prior under which a mode's
/// mean square falls with its lambda: few points then give the lowest mode that explains them.
class TrackedMotion {
 public:
  /// @param rest      followed points at rest [m]
  /// @param instants  ascending in time; those at which less than a third of the usual count is seen are left out
  /// @param is_free   nothing is held: the best rigid motion is taken out of every instant
  TrackedMotion(const Body& body, const std::vector<Vector3>& rest, std::vector<SeenInstant> instants, bool is_free);

  int instant_count() const { return int(instants_.size()); }
  std::vector<double> times() const;
  /// The farthest that any part turns [rad]; 0 where too few points are seen to tell.
  double largest_rotation() const { return largest_rotation_; }
  bool has_gradients() const { return has_gradients_; }
  /// What Automatic comes to.
  ModeProjection automatic() const;

  /// @param stiffness  of each shape its lambda over that of the first vibration's, >= 0
  ModeCoordinates project(const std::vector<Points>& shapes, const VectorX& stiffness,
                          ModeProjection projection = ModeProjection::Automatic) const;

 private:
  /// Weights that take the gradient of an affine fit from displacements: grad = sum_i u_i d_i^T.
  struct Neighbourhood {
    std::vector<int> seen;  // which of the instant's observations
    Points weights;         // d_i [1/m]
    double stiffness;       // smallest eigenvalue of sum_i d d^T at rest: inverse variance of the gradient [m^2]
    Matrix3 rotation_strain;
  };
  struct Instant {
    double time;
    std::vector<TrackObservation> seen;  // positions less rest: displacements
    std::vector<Neighbourhood> parts;
  };
  void take_out_rigid_motion(Instant& instant) const;
  void find_parts(Instant& instant, double noise);
  MatrixX displacement_rows(const Instant& instant, const std::vector<Points>& at_points, VectorX& observed) const;
  MatrixX gradient_rows(const Instant& instant, const std::vector<Points>& at_points, VectorX& observed) const;

  Embedding points_;
  std::vector<Vector3> rest_;
  std::vector<std::vector<int>> neighbours_;  // of each point, itself first, by distance at rest
  std::vector<Instant> instants_;
  double size_ = 0.0, largest_rotation_ = 0.0;
  bool has_gradients_ = false;
};

}  // namespace pliant
