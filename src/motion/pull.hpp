#pragma once

#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "motion/body_forces.hpp"
#include "parameters/motion_blocks.hpp"

namespace pliant {

/// Where an object is pulled. Points of the scan rather than nodes, so that the same pulls hold about the same pose on
/// every mesh.
struct PullPoints {
  std::vector<Vector3> at;  ///< in the scan [m]
  double size = 0.0;        ///< of the object [m]
};

/// As many points out of `candidates` as wanted, far from what is held and from each other.
/// Throws std::invalid_argument where there are no candidates or nothing is held.
std::vector<Vector3> far_points(const std::vector<Vector3>& candidates, const std::vector<Vector3>& held, int count);

/// How forces spread about points: w_k(X_n) V_n of `Pull`, n x k [m^3].
MatrixX pull_spread(const Body& body, const PullPoints& points);

/// What holds an object in the pose from which it is released: forces spread smoothly about a few points,
///   f_n = E_0 sum_k w_k(X_n) V_n c_k / s_k,
/// with w_k a Gaussian about point k, V_n the node's volume, and s_k (of each axis) such that a unit c_k would move the
/// object by its size, by linear elasticity from rest of an even one. E_0 is the geometric mean of Young's modulus over
/// the volume, so that the pose hardly depends on how stiff the object is thought to be, nor on what its field is told
/// by.
class Pull : public DeadLoad {
 public:
  /// @param points  see `far_points`
  /// @param held    nodes that stay where they are
  /// @param blocks  of the pulls c_k, one a point, and of the moduli
  /// Throws InputError where the held nodes do not hold the object.
  Pull(const std::shared_ptr<const Body>& body, const PullPoints& points, const std::vector<int>& held,
       const MotionBlocks& blocks);

  /// Nothing pulls while it is not active.
  void set_active(bool active) { is_active_ = active; }

  void set_parameters(const VectorX& theta) override;
  void add_force(const Points& z, Points& force) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

 private:
  Eigen::Index count() const { return spread_.cols(); }
  std::vector<ParameterHandle> pull_blocks_;
  MaterialBlocks material_;
  bool is_active_ = true;
  MatrixX spread_;             // n x k: w_k(X_n) V_n [m^3]
  Points strength_;            // k x 3: 1 / s_k [1/m]
  Points pulls_;               // k x 3: c_k / s_k
  VectorX moduli_at_;          // [Pa]
  VectorX share_;              // of each control modulus in the mean over the volume of ln E
  double log_relative_ = 0.0;  // of the elements' own factors in it
  double mean_ = 0.0;          // exp of that mean [Pa]
};

}  // namespace pliant
