#pragma once

#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"

namespace pliant {

/// Springs from points of the body to places in the world, f_i = k_i (t I + (1 - t) n_i n_i^T) (c_i - s_i): the virtual
/// forces that draw a surface to what was seen of it (Wang 2015, eq. 5, where t = 1). With a smaller t the surface may
/// slide along itself: what was seen of it says little about that, and what it seems to say is mostly where sensors see
/// more points. Exactly linear, symmetric, positive semidefinite.
class PointSprings : public ForceTerm {
 public:
  PointSprings(const Body& body, Embedding points);

  int count() const { return points_.point_count(); }
  const Embedding& points() const { return points_; }
  /// @param stiffness  of each point [N/m], >= 0
  /// @param targets    n x 3 [m]; those of points without stiffness do not matter
  /// @param normals    n x 3, of unit length; zero: a point's spring pulls alike in every direction
  /// @param tangential t, [0, 1]
  /// Throws std::invalid_argument where their numbers differ from the points'.
  void set(VectorX stiffness, Points targets, Points normals, double tangential);
  /// No springs.
  void clear();

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  void set_parameters(const VectorX&) override {}
  void linearise(const Points&) override {}
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

 private:
  Vector3 force(int i, const Vector3& stretch) const;

  Embedding points_;
  std::shared_ptr<const std::vector<int>> blocks_;  // where each element's blocks go in the matrix
  VectorX stiffness_;
  Points targets_, normals_;
  double tangential_ = 1.0;
};

}  // namespace pliant
