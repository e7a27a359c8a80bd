#pragma once

#include <functional>

#include "elasticity/element_moduli.hpp"
#include "elasticity/force_term.hpp"

namespace pliant {

/// A part of the object that is held, and where.
struct Hold {
  std::function<bool(const Vector3&)> contains;  ///< of a rest position
  Matrix3 rotation = Matrix3::Identity();        ///< from rest to where it is held
  Vector3 translation = Vector3::Zero();
};

/// A part of the way from rest to where a region is held, [0, 1]: turned by that part of the angle about the same axis,
/// and moved so that the region's middle goes straight.
Hold part_of_the_way(const Hold& hold, double share, const Vector3& middle);

/// Nodes inside any hold, in order; of a hold smaller than an element those of the elements whose surface it contains.
std::vector<int> held_nodes(const Body& body, const std::vector<Hold>& holds);

/// Held regions by Nitsche's method (Weiss 2020, appendix A.3) on the part of the surface inside them, symmetric form,
/// with the penalty also on the volume inside. Linear in the frame in which the region is held:
///   f(z) = - R K (R^T (z - t) - X), K constant.
class FixedRegions : public ForceTerm {
 public:
  /// @param penalty  in units of (lambda + 2 mu) / h; large enough that the form stays positive definite on cut cells
  /// The body is one of hexahedra: tetrahedra follow the shape, so their nodes are held themselves.
  /// Throws InputError where a hold contains nothing of the object.
  FixedRegions(std::shared_ptr<const Body> body, const std::vector<Hold>& holds, const MaterialBlocks& blocks,
               double penalty = 40.0);

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  void set_parameters(const VectorX& theta) override;
  void linearise(const Points&) override {}
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void prepare_tangents(const Points& z, const Eigen::Ref<const MatrixX>& d_theta) override;
  void add_force_tangents(const Points& z, const ForceChanges& changes, std::span<Points> forces) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

  /// Moves the regions to where these hold them; they contain what they contained.
  void move_to(const std::vector<Hold>& holds) { holds_ = holds; }

 private:
  struct HeldCell {
    int cell;
    int hold;
    Matrix24 K_lambda, K_mu;  // for unit Lame constants
    Matrix24 K, dK;           // for E = 1 and its derivative by Poisson's ratio
  };
  using Vector24 = Eigen::Matrix<double, 24, 1>;
  Vector24 displacement(const HeldCell& held, const Points& z) const;
  Vector24 rotated_back(const HeldCell& held, const Points& vectors) const;

  std::shared_ptr<const Body> body_;
  std::vector<Hold> holds_;
  std::vector<HeldCell> cells_;
  ParameterHandle poissons_ratio_;
  ElementModuli modulus_;
};

}  // namespace pliant
