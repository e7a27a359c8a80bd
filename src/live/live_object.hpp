#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "live/live_data.hpp"
#include "motion/patch_forces.hpp"
#include "motion/rain.hpp"
#include "motion/rigid_contact.hpp"
#include "motion/wind.hpp"

namespace pliant {

/// An object that is stepped, pulled, poked, blown at and rained upon while somebody looks.
class LiveObject {
 public:
  /// Throws std::runtime_error for bytes that are no object.
  explicit LiveObject(LiveData data);

  const LiveData& data() const { return data_; }
  const Body& body() const { return *body_; }
  const State& state() const { return state_; }
  double time() const { return time_; }
  double step_length() const { return options_.max_dt; }
  /// Of the surface's vertices [m].
  const Points& surface() const { return surface_; }

  /// Back to the start: at rest where it was scanned, or, where something is held, in equilibrium.
  void reset();
  /// Takes the object as it is, and its velocities, as those of the recording at its start.
  void start_as_recorded();
  /// One step, in halves where it cannot be taken as a whole. False where it cannot be taken at all: the object stays
  /// as it was.
  bool step();

  /// @name What a user does
  /// @{
  /// Takes the surface within a radius [m] of a triangle's point.
  /// @param stiffness  of the springs together [N/m]; 0: what lifts the object by a tenth of its size
  void grab(int triangle, const Vector3& corners, double radius, double stiffness = 0.0);
  /// Where the hand is now [m].
  void move_hand(const Vector3& place);
  void let_go() { grip_.reset(); }
  /// Of the hand on the object [N].
  Vector3 hand_force() const;
  /// Where the hand holds the object, and where it would have it [m].
  std::optional<std::pair<Vector3, Vector3>> hand() const;
  void set_gravity(const Vector3& gravity);
  void set_wind(const Vector3& velocity, double gust_intensity);
  /// @param rate  drops by square metre and second; 0: none
  void set_rain(double rate, double diameter);
  /// A rigid ball or rod that pushes; a radius of 0 takes it away.
  void set_probe(const Vector3& from, const Vector3& to, double radius);
  Vector3 probe_force() const { return probe_force_; }
  /// Factors of Young's modulus and of both dampings.
  void set_material(double stiffness, double damping);
  /// Adds a velocity to every node [m/s].
  void push(const Vector3& velocity);
  /// The parameters of a sample of the posterior; -1: the estimate.
  void set_sample(int sample);
  /// @}

  enum class Field { None, Displacement, VonMises, Strain, Modulus };
  /// A number for each vertex of the surface, of the elements around it: displacement [m], von Mises stress [Pa],
  /// largest principal strain [1], Young's modulus [Pa].
  const std::vector<float>& field(Field which);
  /// Kinetic energy [J].
  double kinetic_energy() const;
  const std::vector<Vector3>& drops();

 private:
  /// A force that comes and goes.
  class Slot;
  void build();
  void apply_parameters();
  bool take(double dt);

  LiveData data_;
  MotionLayout blocks_;
  std::shared_ptr<const Body> body_;
  SimulationOptions options_;
  std::unique_ptr<Stepper> stepper_;
  Elasticity* elasticity_ = nullptr;
  Slot *hand_slot_ = nullptr, *wind_slot_ = nullptr, *rain_slot_ = nullptr, *probe_slot_ = nullptr;
  Embedding vertices_;
  State state_, first_;
  Points delta_, surface_;
  double time_ = 0.0, element_edge_ = 0.0;
  VectorX theta_;
  int sample_ = -1;
  double stiffness_ = 1.0, damping_ = 1.0;
  Vector3 gravity_ = Vector3::Zero(), wind_ = Vector3::Zero(), probe_force_ = Vector3::Zero();
  std::shared_ptr<LedSprings> grip_;
  std::shared_ptr<Rain> rain_;
  std::shared_ptr<RigidContact> probe_;
  std::vector<float> field_;
  std::vector<Vector3> drops_;
};

}  // namespace pliant
