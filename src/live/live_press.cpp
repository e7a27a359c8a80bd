#include "live/live_press.hpp"

#include <algorithm>
#include <stdexcept>

namespace pliant {

LivePress::LivePress(LiveData data) : LiveObject(std::move(data)), held_(data_.held) {
  const int nodes = body_->node_count();
  const bool is_sound = body_->kind != ElementKind::Hexahedron && data_.material.law() &&
                        std::ranges::all_of(held_, [&](int i) { return i >= 0 && i < nodes; });
  if (!is_sound) throw std::runtime_error("the bytes of the object make no sense");
  longest_way_ = mean_edge(*body_);
  gravity_ = live_blocks(data_.planes).gravity.vector(data_.theta);
  set_law();
  reset();
}

void LivePress::set_law() {
  const auto own = data_.material.law(), of_sample = sample_ < 0 ? own : data_.samples[std::size_t(sample_)].law;
  law_ = scaled_law(of_sample ? of_sample : own, stiffness_);
}

void LivePress::begin() {
  PressSessionOptions options;
  options.held = held_;
  // As exact as a picture and a curve show it; what is not followed at once is tried by half the way (`step`).
  options.equilibrium.tolerance = 1e-5, options.equilibrium.max_iterations = 15, options.equilibrium.max_halvings = 0;
  if (!gravity_.isZero())
    options.dead_load = weight_of(*body_, data_.theta[live_blocks(data_.planes).density], gravity_);
  const Points nodes = session_ ? session_->nodes() : body_->nodes;
  session_ =
      std::make_unique<PressSession>(body_, law_, probe_ ? std::vector{*probe_} : std::vector<ProbeOptions>(), options);
  session_->start_from(nodes);
  is_settled_ = false;
}

bool LivePress::solve(const ProbeMove& move) {
  const bool is_found = session_->lead(probe_ ? std::vector{move} : std::vector<ProbeMove>()).converged;
  if (is_found) surface_ = vertices_.positions(session_->nodes());
  return is_found;
}

void LivePress::reset() {
  probe_.reset();
  session_.reset();
  begin();
  (void)solve({});
  surface_ = vertices_.positions(session_->nodes());
  is_settled_ = true;
}

bool LivePress::step() {
  if (is_settled_) return true;
  const Vector3 left = wanted_.vector - reached_.vector;
  constexpr int most_halvings = 3;
  double share = 1.0;
  if (probe_ && wanted_.by == ProbeMove::By::Displacement && left.norm() > longest_way_)
    share = longest_way_ / left.norm();
  for (int i = 0; i <= most_halvings; ++i, share *= 0.5) {
    ProbeMove next = wanted_;
    next.vector = reached_.vector + share * left;
    if (!solve(next)) continue;
    reached_ = next;
    is_settled_ = share == 1.0;
    return true;
  }
  wanted_ = reached_;
  is_settled_ = true;
  return false;
}

void LivePress::want(const ProbeMove& move) {
  wanted_ = move;
  is_settled_ = false;
}

void LivePress::hold(ProbeOptions probe, const Vector3& offset, bool is_hand) {
  probe.radius = std::max(probe.radius, 1e-3 * body_->size());
  // A disc that sticks covers a face's samples at least.
  if (probe.kind == ProbeKind::BondedDisc) probe.radius = std::max(probe.radius, mean_edge(*body_));
  probe_ = std::move(probe);
  offset_ = offset, is_hand_ = is_hand;
  begin();
  reached_ = wanted_ = {ProbeMove::By::Displacement, offset_, Vector3::Zero()};
}

void LivePress::drop_probe() {
  if (!probe_) return;
  probe_.reset();
  begin();
  reached_ = wanted_ = {};
  if (!solve({})) reset();  // too far to come back at once
  is_settled_ = true;
}

void LivePress::grab(int triangle, const Vector3& corners, double radius) {
  const Touched rest = touched(triangle, corners, vertices_.positions(body_->nodes));
  ProbeOptions disc;
  disc.centre = rest.at, disc.radius = radius, disc.axis = rest.inward;
  hold(disc, touched(triangle, corners, surface_).at - rest.at, true);
}

void LivePress::move_hand(const Vector3& place) {
  if (probe_ && is_hand_) want({ProbeMove::By::Displacement, place - probe_->centre, Vector3::Zero()});
}

void LivePress::let_go() {
  if (is_hand_) drop_probe();
}

std::optional<std::pair<Vector3, Vector3>> LivePress::hand() const {
  if (!probe_ || !is_hand_) return std::nullopt;
  const Vector3 there = probe_->centre + session_->displacement();
  return std::pair{there, Vector3(probe_->centre + wanted_.vector)};
}

void LivePress::touch(LiveProbe kind, int triangle, const Vector3& corners, double radius, const Vector3& rod) {
  const Touched rest = touched(triangle, corners, vertices_.positions(body_->nodes));
  ProbeOptions probe;
  probe.kind = kind == LiveProbe::Ball      ? ProbeKind::Ball
               : kind == LiveProbe::Capsule ? ProbeKind::Capsule
               : kind == LiveProbe::Disc    ? ProbeKind::Punch
                                            : ProbeKind::BondedDisc;
  probe.centre = rest.at, probe.radius = radius, probe.axis = rest.inward, probe.rod = rod;
  hold(probe, touched(triangle, corners, surface_).at - rest.at, false);
}

void LivePress::move_probe(const Vector3& way) {
  if (probe_ && !is_hand_) want({ProbeMove::By::Displacement, offset_ + way, Vector3::Zero()});
}

Vector3 LivePress::probe_way() const {
  return probe_ && !is_hand_ ? Vector3(session_->displacement() - offset_) : Vector3(Vector3::Zero());
}

void LivePress::lift() {
  if (!is_hand_) drop_probe();
}

void LivePress::press_as_recorded(int test) {
  const LiveTest& press = data_.tests.at(std::size_t(test));
  reset();
  ProbeOptions disc;
  disc.centre = press.at, disc.radius = press.radius;
  disc.axis = pliant::probe_axis(*body_, disc);
  hold(disc, Vector3::Zero(), false);
  reached_ = {ProbeMove::By::Force, Vector3::Zero(), Vector3::Zero()};
  want({ProbeMove::By::Force, press.force, Vector3::Zero()});
}

void LivePress::set_gravity(const Vector3& gravity) {
  gravity_ = gravity;
  begin();
}

void LivePress::set_material(double stiffness, double) {
  if (stiffness == stiffness_) return;
  stiffness_ = stiffness;
  set_law();
  begin();
}

void LivePress::set_sample(int sample) {
  sample_ = sample < int(data_.samples.size()) ? sample : -1;
  set_law();
  begin();
}

}  // namespace pliant
