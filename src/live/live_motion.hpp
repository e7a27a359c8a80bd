#pragma once

#include "live/live_object.hpp"
#include "motion/patch_forces.hpp"
#include "motion/rain.hpp"
#include "motion/rigid_contact.hpp"
#include "motion/wind.hpp"

namespace pliant {

/// An object that moves: stepped, pulled, poked, blown at and rained upon while somebody looks.
class LiveMotion : public LiveObject {
 public:
  /// Throws std::runtime_error for data that make no object.
  explicit LiveMotion(LiveData data);

  const State& state() const { return state_; }
  const Points& nodes() const override { return state_.x; }
  double time() const { return time_; }
  /// Of a step [s]: that of the fit times the pace.
  double step_length() const { return pace_ * options_.max_dt; }
  /// Steps so many times as long as the fit's, >= 1, for a page that shall keep up with time: contact gets as much
  /// softer as they resolve, and a ten-thousandth of the linear residual is left. 1: as the program steps.
  void set_pace(double factor);

  /// At rest where it was scanned, or, where something is held, in equilibrium.
  void reset() override;
  /// Takes the object as it is, and its velocities, as those of the recording at its start.
  void start_as_recorded();
  /// One step, in halves where it cannot be taken as a whole.
  bool step() override;

  void grab(int triangle, const Vector3& corners, double radius) override { grab(triangle, corners, radius, 0.0); }
  /// @param stiffness  of the springs together [N/m]; 0: what lifts the object by a tenth of its size
  void grab(int triangle, const Vector3& corners, double radius, double stiffness);
  void move_hand(const Vector3& place) override;
  void let_go() override { grip_.reset(); }
  Vector3 hand_force() const override;
  std::optional<std::pair<Vector3, Vector3>> hand() const override;
  /// A disc that should stick slides.
  void touch(LiveProbe kind, int triangle, const Vector3& corners, double radius, const Vector3& rod) override;
  void move_probe(const Vector3& way) override;
  void lift() override;
  Vector3 probe_force() const override { return probe_force_; }
  Vector3 probe_way() const override { return probe_way_; }
  void set_gravity(const Vector3& gravity) override;
  void set_wind(const Vector3& velocity, double gust_intensity);
  /// @param rate  drops by square metre and second; 0: none
  void set_rain(double rate, double diameter);
  void set_material(double stiffness, double damping) override;
  /// Adds a velocity to every node [m/s].
  void push(const Vector3& velocity);
  void set_sample(int sample) override;

  std::shared_ptr<const MaterialLaw> law() const override;
  /// Kinetic energy [J].
  double kinetic_energy() const;
  const std::vector<Vector3>& drops();

 private:
  /// A force that comes and goes.
  class Slot;
  void build();
  void apply_parameters();
  /// Takes the sample's law, and the factor of stiffness.
  void set_law();
  bool take(double dt);

  MotionLayout blocks_;
  SimulationOptions options_;
  std::unique_ptr<Stepper> stepper_;
  Slot *hand_slot_ = nullptr, *wind_slot_ = nullptr, *rain_slot_ = nullptr, *probe_slot_ = nullptr;
  State state_, first_;
  Points delta_;
  double time_ = 0.0, element_edge_ = 0.0;
  VectorX theta_;
  int sample_ = -1;
  double stiffness_ = 1.0, damping_ = 1.0, pace_ = 1.0;
  Vector3 gravity_ = Vector3::Zero(), wind_ = Vector3::Zero(), probe_force_ = Vector3::Zero();
  Vector3 probe_way_ = Vector3::Zero();
  std::shared_ptr<LedSprings> grip_;
  std::shared_ptr<Wind> blowing_;
  std::shared_ptr<Rain> rain_;
  std::shared_ptr<RigidContact> probe_;
  std::vector<Vector3> drops_;
};

}  // namespace pliant
