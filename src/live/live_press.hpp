#pragma once

#include "live/live_object.hpp"
#include "motion/press_session.hpp"

namespace pliant {

/// An object that is pressed and pulled from equilibrium to equilibrium, while somebody looks. What grabs it sticks to
/// a disc of its surface.
class LivePress : public LiveObject {
 public:
  /// Throws std::runtime_error for data that make no object.
  explicit LivePress(LiveData data);

  const Points& nodes() const override { return session_->nodes(); }
  /// Equilibrium without hand and probe.
  void reset() override;
  /// One equilibrium on the way to where the hand or the probe is wanted, at most an element's edge further. False
  /// where none is found: what led there stays where it was.
  bool step() override;
  /// Whether hand or probe are where they are wanted.
  bool is_settled() const { return is_settled_; }

  void grab(int triangle, const Vector3& corners, double radius) override;
  void move_hand(const Vector3& place) override;
  void let_go() override;
  Vector3 hand_force() const override { return is_hand_ ? force() : Vector3(Vector3::Zero()); }
  std::optional<std::pair<Vector3, Vector3>> hand() const override;
  void touch(LiveProbe kind, int triangle, const Vector3& corners, double radius, const Vector3& rod) override;
  void move_probe(const Vector3& way) override;
  void lift() override;
  Vector3 probe_force() const override { return is_hand_ ? Vector3(Vector3::Zero()) : force(); }
  Vector3 probe_way() const override;
  /// The disc of a press of the recording, with its force. Throws std::out_of_range for another.
  void press_as_recorded(int test);

  void set_gravity(const Vector3& gravity) override;
  /// Damping plays no part.
  void set_material(double stiffness, double damping) override;
  void set_sample(int sample) override;
  std::shared_ptr<const MaterialLaw> law() const override { return law_; }

 private:
  void set_law();
  /// A session with the probe at hand, from the nodes at hand.
  void begin();
  void want(const ProbeMove& move);
  void hold(ProbeOptions probe, const Vector3& offset, bool is_hand);
  void drop_probe();
  Vector3 force() const { return probe_ ? session_->force() : Vector3(Vector3::Zero()); }
  bool solve(const ProbeMove& move);

  std::vector<int> held_;
  std::shared_ptr<const MaterialLaw> law_;
  std::unique_ptr<PressSession> session_;
  std::optional<ProbeOptions> probe_;
  bool is_hand_ = false, is_settled_ = true;
  ProbeMove wanted_, reached_;
  Vector3 offset_ = Vector3::Zero();  // of the touched point from rest as the probe took hold
  Vector3 gravity_ = Vector3::Zero();
  double longest_way_ = 0.0;  // of a probe in an equilibrium
  int sample_ = -1;
  double stiffness_ = 1.0;
};

}  // namespace pliant
