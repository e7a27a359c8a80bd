#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "elasticity/body.hpp"
#include "geometry/triangle_mesh.hpp"
#include "motion/body_forces.hpp"

namespace pliant {

struct RainOptions {
  double rate = 0.0;                           ///< drops by area across the fall and time [1/(m^2 s)], > 0
  double diameter = 0.0;                       ///< of a drop [m], > 0
  double water_density = 1000.0;               ///< [kg/m^3], > 0
  Vector3 velocity = Vector3(0.0, -5.0, 0.0);  ///< of the drops [m/s], not zero
  double from = 0.0, until = 0.0;              ///< when it begins and ends to reach the object's height [s]
  /// Part of a drop's water that stays where it hit, [0, 1], and the time in which that runs off to 1/e [s], > 0.
  double stays = 0.0, runs_off = 1.0;
  std::uint64_t seed = 1;

  /// Of a drop [kg].
  double drop_mass() const;
};

/// Rain: drops at random (a Poisson process) that fall straight and hand their momentum over where they hit the
/// surface, m (v_drop - v_surface) within the step, and the weight of water that stays until it has run off. Its
/// inertia is left out, and derivatives leave out that the object's motion changes where and how fast drops hit. The
/// drops repeat with a period of several sizes of the object, so that it rains everywhere.
class Rain : public DeadLoad {
 public:
  /// @param surface  closed, where the body's nodes are at rest [m]
  /// @param gravity  3, in the parameter vector [m/s^2]
  Rain(const Body& body, const TriangleMesh& surface, const RainOptions& options, const ParameterHandle& gravity);

  const RainOptions& options() const { return options_; }

  struct Hit {
    double time;              ///< start of the step in which it hits [s]
    int triangle;             ///< of the surface
    Vector3 corners;          ///< weights of the triangle's corners
    Vector3 momentum;         ///< handed over [kg m/s]
    std::array<int, 3> drop;  ///< which, and which repetition of it
  };
  /// So far, in the order of steps.
  const std::vector<Hit>& hits() const { return hits_; }
  /// Where drops are at a time [s], within a box [m]; for pictures.
  std::vector<Vector3> drops_at(double time, const Box& box) const;

  void set_parameters(const VectorX& theta) override { gravity_now_ = gravity_.vector(theta); }
  void begin_step(const StepContext& step) override;
  void add_force(const Points& z, Points& force) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

 private:
  struct Drop {
    double time;           // at which it passes the reference plane through `origin_` [s]
    double first, second;  // where, along the plane's axes, in [0, period_) [m]
  };
  /// Calls visit(drop, repetition along the first axis, along the second, position at `time`) for drops that are in the
  /// box at some time of [time, time + dt].
  template <class Visit>
  void for_drops(double time, double dt, const Box& box, const Visit& visit) const;
  void find_hits(const StepContext& step);
  void spread(const Hit& hit, const Vector3& force, Points& out) const;
  /// Mass of a hit's water that is still there [kg].
  double left(const Hit& hit) const;

  RainOptions options_;
  ParameterHandle gravity_;
  Vector3 gravity_now_ = Vector3::Zero();
  std::vector<std::array<int, 3>> triangles_;
  Embedding vertices_;
  Vector3 origin_, fall_, first_axis_, second_axis_;  // fall: unit
  double speed_ = 0.0, period_ = 0.0;
  std::vector<Drop> drops_;  // by time
  std::vector<Hit> hits_;
  std::vector<Vector3> corners_;
  double time_ = 0.0, dt_ = 0.0;
};

}  // namespace pliant
