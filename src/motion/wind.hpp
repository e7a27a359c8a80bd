#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "geometry/key_frames.hpp"
#include "geometry/triangle_mesh.hpp"
#include "parameters/layout.hpp"

namespace pliant {

/// Turbulence of a wind about its mean: a sum of waves over time with random phases, whose spectrum is that of Kaimal
/// et al. (1972), S(f) f / sigma^2 = (2/3) a / (1 + a)^{5/3} with a = 10.3 f L / U: most of it in gusts as long as L.
/// The three components have sigma = intensity times the mean speed, of which 0.8 across the mean and 0.5 along the
/// vertical, as over open ground.
class Gusts {
 public:
  /// None.
  Gusts() = default;
  /// @param mean       velocity of the wind [m/s]
  /// @param up         unit
  /// @param intensity  standard deviation along the wind over its mean speed [-], >= 0
  /// @param length     of the gusts [m], > 0
  Gusts(const Vector3& mean, const Vector3& up, double intensity, double length, std::uint64_t seed);
  /// Departure from the mean [m/s] at a time [s].
  Vector3 at(double time) const;

 private:
  struct Wave {
    Vector3 cosine, sine;  ///< [m/s]
    double frequency;      ///< [rad/s]
  };
  std::vector<Wave> waves_;
};

struct WindOptions {
  double air_density = 1.2;  ///< [kg/m^3], > 0
  double normal = 1.2;       ///< drag coefficient of a plate across the wind [-], >= 0
  double tangential = 0.02;  ///< friction coefficient of a surface along the wind [-], >= 0
  KeyFrames<3> change;       ///< of the mean velocity over time [m/s]
  Gusts gusts;
  double delay = 0.0;  ///< [s] by which its time runs ahead
};

/// Drag of the air on every triangle of the surface, of area A and outward normal n. With u the air's velocity relative
/// to the triangle's middle,
///   f = rho / 2 A (C_n [u.n]_-^2 (-n) + C_t |T u| T u),   T = I - n n^T:
/// pressure on the windward side alone, nothing in the wake, friction on all sides. A plate across the wind has the
/// drag coefficient C_n, a ball C_n / 2.
///
/// In a step the triangles are where the start's velocities bring them by its middle, and the velocity is that of the
/// step, linearised about the start's: the matrix stays symmetric and positive, and wind brakes as much as it drives.
/// At rest, where there is no step, there is no wind.
class Wind : public ForceTerm {
 public:
  /// @param surface   closed, where the body's nodes are at rest [m]
  /// @param velocity  3, mean velocity of the air in the parameter vector [m/s]
  Wind(const Body& body, const TriangleMesh& surface, const WindOptions& options, const ParameterHandle& velocity);

  /// Velocity of the air far from the object at a time [s], [m/s].
  Vector3 air_velocity(double time) const {
    const double t = time + options_.delay;
    return mean_ + options_.change.at(t) + options_.gusts.at(t);
  }

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  void set_parameters(const VectorX& theta) override { mean_ = velocity_.vector(theta); }
  void begin_step(const StepContext& step) override;
  void linearise(const Points&) override {}
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;
  bool sees_start() const override { return true; }
  void add_start_tangent(const Points& z, const Points& d_start, const Points& d_start_velocity,
                         Points& force) override;
  void add_start_adjoint(const Points& z, const Points& w, Points& start_bar, Points& start_velocity_bar) override;

 private:
  /// A triangle in the step at hand.
  struct Face {
    Vector3 edge_1, edge_2, normal;
    double area;           // [m^2]
    Vector3 start, first;  // middle at the step's start [m]; u there [m/s]
    double across, along;  // [u.n]_- there, |T u| there
    Vector3 slide;         // T u there
  };
  /// Changes or cotangents of what a face's force depends on.
  struct Change {
    Vector3 normal = Vector3::Zero(), first = Vector3::Zero(), now = Vector3::Zero();
    double area = 0.0;
  };
  Vector3 relative_velocity(std::size_t face, const Points& z) const;
  Vector3 force_of(const Face& f, const Vector3& u) const;
  Vector3 force_change(const Face& f, const Vector3& u, const Change& change) const;
  Change force_adjoint(const Face& f, const Vector3& u, const Vector3& w) const;

  WindOptions options_;
  ParameterHandle velocity_;
  std::vector<std::array<int, 3>> triangles_;
  Embedding vertices_, middles_;
  std::shared_ptr<const std::vector<int>> blocks_;
  Vector3 mean_ = Vector3::Zero();
  double dt_ = 0.0;                // of the step at hand [s]; 0: there is none
  Vector3 air_ = Vector3::Zero();  // velocity in it [m/s]
  std::vector<Face> faces_;
  std::vector<Vector3> corners_;  // of the surface in the step at hand
};

}  // namespace pliant
