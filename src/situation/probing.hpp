#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "motion/press_session.hpp"
#include "situation/situation.hpp"

namespace pliant {

/// A model of tetrahedra that probes and rigid obstacles press, pull and slide over: equilibria along a path.
class Probing {
 public:
  /// Throws InputError for a model of hexahedra, a situation without probe and obstacle or with what takes time (wind,
  /// rain, velocities, hands, led regions, forces), and a probe that is nowhere near the object.
  Probing(const Model& model, const Situation& situation);

  /// Probes first, then obstacles.
  int probe_count() const { return session_->probe_count(); }
  /// Goes on to a time [s], in halves where that is too far at once. Not converged: the last equilibrium stays, and
  /// `failure` says why.
  SolveSummary advance(double time);
  double time() const { return time_; }
  /// How far a probe is in the object, along its axis [m].
  double depth(int probe) const;
  PressSession& session() { return *session_; }
  const PressSession& session() const { return *session_; }
  const std::string& failure() const { return session_->failure(); }
  std::shared_ptr<const Body> body() const { return body_; }
  std::shared_ptr<const MaterialLaw> law() const { return law_; }

 private:
  struct Path {
    ProbeFacts::Led led;
    KeyFrames<6> keys;
  };
  std::vector<ProbeMove> moves_at(double time) const;
  std::shared_ptr<const Body> body_;
  std::shared_ptr<const MaterialLaw> law_;
  std::unique_ptr<PressSession> session_;
  std::vector<Path> paths_;
  double time_ = 0.0;
};

}  // namespace pliant
