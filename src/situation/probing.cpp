#include "situation/probing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "meshing/mesh_distance.hpp"
#include "scene/obstacle.hpp"
#include "scene/region.hpp"
#include "simulation/inner_bodies.hpp"
#include "simulation/law_table.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/obstacles.hpp"
#include "simulation/scene_simulation.hpp"
#include "situation/situation_scene.hpp"

namespace pliant {

namespace {

void refuse_what_takes_time(const Situation& s) {
  const std::pair<bool, const char*> parts[] = {
      {s.wind.has_value(), "[wind]"},
      {!s.rains.empty(), "[[rain]]"},
      {!s.forces.empty(), "[[force]]"},
      {!s.hands.empty(), "[[hand]]"},
      {!s.led.empty(), "[[led]]"},
      {!s.copies.empty(), "[[copy]]"},
      {!s.keeps_held, "`held = false`"},
      {s.planes.has_value(), "[[plane]]"},
      {!(s.pose == RigidMotion()) || !s.linear_velocity.isZero() || !s.angular_velocity.isZero(), "[initial]"}};
  for (const auto& [is_there, name] : parts)
    if (is_there)
      throw InputError({{s.file},
                        std::string(name) + " in a situation of equilibria",
                        "[[probe]], [[obstacle]] and `gravity` alone",
                        "`pliant simulate --situation` moves a model in time"});
  if (s.probes.empty() && !s.obstacles)
    throw InputError({{s.file}, "neither [[probe]] nor [[obstacle]]", "one at least", "nothing presses the object"});
}

}  // namespace

Probing::Probing(const Model& model, const Situation& situation)
    : body_(model_body(model)), law_(law_of(model, *body_)) {
  refuse_what_takes_time(situation);
  const Scene& scene = model.scene;
  PressSessionOptions options;
  options.held = held_nodes(*body_, scene);
  options.inner = inner_contacts(*body_, sliding_bodies(scene), mean_modulus(*body_, *law_));
  if (const auto& gravity = scene.world.gravity) {
    const Vector3 now = situation.gravity.empty() ? *gravity : situation.gravity.front().value;
    options.dead_load = weight_of(*body_, scene.object.density.value(), now);
  }
  std::vector<ProbeOptions> probes;
  for (const ProbeFacts& facts : situation.probes) {
    ProbeOptions& probe = probes.emplace_back();
    probe.kind = facts.kind, probe.centre = facts.at, probe.radius = facts.radius;
    probe.axis = facts.axis, probe.rod = facts.rod;
    if (facts.kind == ProbeKind::Shape) {
      const RigidObstacle shape{ShapeMesh{{}, facts.mesh}};
      probe.shape = rigid_shape(shape), probe.radius = 0.1 * box_of(shape).extent().minCoeff();
    } else {
      check_place(situation, scene, "probe", facts.at, facts.radius);
    }
    paths_.push_back({facts.led, KeyFrames<6>(facts.path)});
  }
  for (const RigidObstacle& obstacle : situation.obstacles.value_or(std::vector<RigidObstacle>{})) {
    const Box box = box_of(obstacle);
    const bool is_bounded = box.extent().minCoeff() > 0.0;
    ProbeOptions& probe = probes.emplace_back();
    probe.kind = ProbeKind::Shape, probe.shape = rigid_shape(obstacle), probe.centre = 0.5 * (box.min + box.max);
    probe.radius = 0.1 * (is_bounded ? box.extent().minCoeff() : body_->size());
    paths_.push_back(
        {ProbeFacts::Led::Displacement, obstacle.motion.empty() ? KeyFrames<6>() : KeyFrames<6>(obstacle.motion)});
  }
  session_ = std::make_unique<PressSession>(body_, law_, probes, options);
}

std::vector<ProbeMove> Probing::moves_at(double time) const {
  std::vector<ProbeMove> moves;
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    using Led = ProbeFacts::Led;
    const KeyFrames<6>::Value now = paths_[i].keys.at(time);
    const Led led = paths_[i].led;
    ProbeMove& move = moves.emplace_back();
    move.by = led == Led::Force || led == Led::Push ? ProbeMove::By::Force : ProbeMove::By::Displacement;
    move.turn = now.tail<3>();
    move.vector = led == Led::Depth || led == Led::Push
                      ? Vector3(now[0] * (rotation_of(move.turn) * *session_->probe(int(i)).axis))
                      : Vector3(now.head<3>());
  }
  return moves;
}

SolveSummary Probing::advance(double time) {
  constexpr int most_halvings = 6;
  double part = time - time_, now = time_;
  const double least = std::ldexp(part, -most_halvings);
  SolveSummary summary;
  int iterations = 0;
  bool is_first = true;
  while (is_first || now < time) {
    is_first = false;
    const double next = std::min(time, now + part);
    summary = session_->lead(moves_at(next));
    iterations += summary.iterations;
    if (summary.converged) {
      now = next;
    } else if (0.5 * part >= least && part > 0.0) {
      part *= 0.5;
      is_first = true;
    } else {
      break;
    }
  }
  time_ = now;
  summary.iterations = iterations;
  return summary;
}

double Probing::depth(int probe) const { return session_->displacement(probe).dot(*session_->probe(probe).axis); }

}  // namespace pliant
