#include "live/live_motion.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "elasticity/law_layout.hpp"
#include "motion/contact_samples.hpp"
#include "scene/region.hpp"

namespace pliant {

/// Forwards to what is in it, and is nothing while that is nothing.
class LiveMotion::Slot : public ForceTerm {
 public:
  std::shared_ptr<ForceTerm> force;
  Lag lag() const override { return lag_; }
  At at() const override { return at_; }
  Slot(Lag lag, At at) : lag_(lag), at_(at) {}
  void set_parameters(const VectorX& theta) override {
    if (force) force->set_parameters(theta);
  }
  void begin_step(const StepContext& step) override {
    if (force) force->begin_step(step);
  }
  void linearise(const Points& lag) override {
    if (force) force->linearise(lag);
  }
  void add_force(const Points& z, Points& out) override {
    if (force) force->add_force(z, out);
  }
  void add_matrix(double scale, BlockMatrix& matrix) override {
    if (force) force->add_matrix(scale, matrix);
  }
  std::optional<double> potential(const Points& x) override { return force ? force->potential(x) : 0.0; }
  void add_force_tangent(const Points&, const Points&, const Points&, const VectorX&, Points&) override {}
  void add_force_adjoint(const Points&, const Points&, Points&, Points&, VectorX&) override {}

 private:
  Lag lag_;
  At at_;
};

LiveMotion::LiveMotion(LiveData data) : LiveObject(std::move(data)), blocks_(live_blocks(data_.planes)) {
  options_.max_dt = data_.max_dt, options_.newmark_theta = data_.newmark_theta;
  options_.contact_weight = data_.contact_weight, options_.rotation_prediction = data_.rotation_prediction;
  options_.material = data_.material;
  options_.contact = data_.contact, options_.friction_speed = data_.friction_speed;
  options_.blocks = blocks_;
  for (const FixedRegion& fixed : data_.fixed) {
    Hold hold{is_in_region(data_.surface, fixed.region)};
    if (fixed.displaced_to)
      hold.rotation = fixed.displaced_to->rotation, hold.translation = fixed.displaced_to->translation;
    options_.holds.push_back(std::move(hold));
  }
  for (const Weight& weight : data_.weights) options_.weights.push_back({weight.at, weight.mass});
  element_edge_ = std::cbrt(body_->volume() / std::max(1, body_->element_count()));
  theta_ = data_.theta;
  gravity_ = blocks_.gravity.vector(theta_);
  build();
  SimulationOptions at_start = options_;
  at_start.times = {0.0};
  at_start.starts_settled = !options_.holds.empty();
  first_ = {body_->nodes, Points::Zero(body_->node_count(), 3)};
  VectorX still = theta_;
  still.segment<3>(blocks_.linear_velocity).setZero();
  still.segment<3>(blocks_.angular_velocity).setZero();
  (void)Simulation(body_, at_start).run(still, [&](int, const State& state, auto) {
    first_ = state;
    return true;
  });
  reset();
}

void LiveMotion::build() {
  SimulationOptions options = options_;
  if (pace_ > 1.0) {
    options.contact.stiffness /= pace_ * pace_, options.contact.smoothing *= pace_;
    options.solver.tolerance = 1e-4;
  }
  std::vector<std::unique_ptr<ForceTerm>> terms = scene_forces(body_, options);
  const auto add = [&](ForceTerm::Lag lag, ForceTerm::At at) {
    auto slot = std::make_unique<Slot>(lag, at);
    Slot* const there = slot.get();
    terms.push_back(std::move(slot));
    return there;
  };
  hand_slot_ = add(ForceTerm::Lag::Rotation, ForceTerm::At::End);
  wind_slot_ = add(ForceTerm::Lag::Rotation, ForceTerm::At::End);
  rain_slot_ = add(ForceTerm::Lag::Rotation, ForceTerm::At::End);
  probe_slot_ = add(ForceTerm::Lag::Contact, ForceTerm::At::Contact);
  hand_slot_->force = grip_, wind_slot_->force = blowing_, rain_slot_->force = rain_, probe_slot_->force = probe_;
  stepper_ = std::make_unique<Stepper>(
      body_, std::move(terms), options_.blocks,
      StepOptions{step_length(), options_.newmark_theta, options_.contact_weight, options_.rotation_prediction,
                  options_.material.damping, options.solver,
                  options_.material.law() ? Integrator::Newton : Integrator::Lagged, options_.newton});
  stepper_->hold(eliminated_nodes(*body_, options_));
  if (!options_.weights.empty()) {
    const PointWeights hung(*body_, options_.weights, options_.blocks.gravity);
    stepper_->carry(hung.points(), hung.masses());
  }
  apply_parameters();
}

void LiveMotion::apply_parameters() {
  const LiveSample* const sample = sample_ < 0 ? nullptr : &data_.samples[std::size_t(sample_)];
  theta_ = sample ? sample->theta : data_.theta;
  blocks_.scale_moduli(theta_, stiffness_);
  theta_[blocks_.mass_damping] *= damping_;
  theta_[blocks_.stiffness_damping] *= damping_;
  theta_.segment<3>(blocks_.gravity) = gravity_;
  theta_.segment<3>(blocks_.wind) = wind_;
  if (blocks_.contact_stiffness.exists()) theta_[blocks_.contact_stiffness] /= pace_ * pace_;
  stepper_->set_parameters(theta_);
}

void LiveMotion::reset() {
  state_ = first_;
  time_ = 0.0;
  let_go();
  lift();
  hand_slot_->force.reset();
  surface_ = vertices_.positions(state_.x);
}

void LiveMotion::start_as_recorded() {
  reset();
  const Points lever = body_->scanned_positions().rowwise() - body_->centre_of_mass().transpose();
  const Matrix3 spin = cross_matrix(blocks_.angular_velocity.vector(theta_));
  state_.v = (lever * spin.transpose()).rowwise() + blocks_.linear_velocity.vector(theta_).transpose();
  if (options_.holds.empty()) state_.x = body_->nodes;
}

bool LiveMotion::take(double dt) {
  constexpr double too_long = 0.1, explosion = 3.0;  // see Simulation::take_step
  stepper_->set_time(time_);
  stepper_->set_time_step(dt);
  if (!stepper_->prepare(state_)) return false;
  delta_ = dt * state_.v;
  const bool is_taken = stepper_->solve(state_, delta_).converged;
  const double surprise =
      is_taken ? 0.5 * std::sqrt((delta_ - dt * state_.v).rowwise().squaredNorm().maxCoeff()) / element_edge_
               : infinite;
  const double shortest = std::ldexp(step_length(), -options_.most_halvings);
  if (surprise > too_long && 0.5 * dt >= (1.0 - 1e-9) * shortest) return take(0.5 * dt) && take(0.5 * dt);
  if (surprise > explosion) return false;
  stepper_->advance(delta_, state_);
  time_ += dt;
  return true;
}

bool LiveMotion::step() {
  hand_slot_->force = grip_;
  const State before = state_;
  const double then = time_;
  const bool is_taken = take(step_length());
  if (!is_taken) {
    state_ = before, time_ = then;
    state_.v.setZero();
  }
  if (probe_) probe_force_ = probe_->force(state_.x, probe_way_);
  surface_ = vertices_.positions(state_.x);
  return is_taken;
}

void LiveMotion::grab(int triangle, const Vector3& corners, double radius, double stiffness) {
  const double weight = theta_[blocks_.density] * body_->volume() * std::max(gravity_.norm(), 9.81);
  LedSpringsOptions options;
  options.stiffness = stiffness > 0.0 ? stiffness : 10.0 * weight / body_->size();
  options.reaches = true;
  const Vector3 at = touched(triangle, corners, vertices_.positions(body_->nodes)).at;
  grip_ = std::make_shared<LedSprings>(*body_, surface_patch(*body_, at, radius), options);
  move_hand(touched(triangle, corners, surface_).at);
}

void LiveMotion::move_hand(const Vector3& place) {
  if (grip_) grip_->move_to(place);
}

Vector3 LiveMotion::hand_force() const { return grip_ ? grip_->force(state_.x) : Vector3(Vector3::Zero()); }

std::optional<std::pair<Vector3, Vector3>> LiveMotion::hand() const {
  if (!grip_) return std::nullopt;
  return std::pair{grip_->middle(state_.x), grip_->place()};
}

void LiveMotion::set_gravity(const Vector3& gravity) {
  gravity_ = gravity;
  apply_parameters();
}

void LiveMotion::set_wind(const Vector3& velocity, double gust_intensity) {
  wind_ = velocity;
  blowing_.reset();
  if (velocity.norm() > 0.0) {
    WindOptions options;
    options.gusts = Gusts(velocity, data_.up, gust_intensity, std::max(1.0, 5.0 * body_->size()), 1);
    blowing_ = std::make_shared<Wind>(*body_, data_.surface, options, blocks_.wind);
  }
  wind_slot_->force = blowing_;
  apply_parameters();
}

void LiveMotion::set_rain(double rate, double diameter) {
  rain_.reset();
  if (rate > 0.0) {
    RainOptions options;
    options.rate = rate, options.diameter = diameter, options.velocity = -6.0 * data_.up;
    options.from = time_, options.until = time_ + 60.0;
    rain_ = std::make_shared<Rain>(*body_, data_.surface, options, blocks_.gravity);
  }
  rain_slot_->force = rain_;
  apply_parameters();
}

void LiveMotion::touch(LiveProbe kind, int triangle, const Vector3& corners, double radius, const Vector3& rod) {
  const auto [at, inward] = touched(triangle, corners, surface_);
  const Vector3 middle = at - radius * inward;
  std::shared_ptr<const RigidShape> shape = rigid_ball(middle, radius);
  if (kind == LiveProbe::Capsule) shape = rigid_capsule(middle - 0.5 * rod, middle + 0.5 * rod, radius);
  if (kind == LiveProbe::Disc || kind == LiveProbe::BondedDisc) shape = rigid_punch(at, inward, radius, 0.2 * radius);
  probe_ = std::make_shared<RigidContact>(
      RigidContact::sliding(*body_, surface_samples(*body_), std::move(shape), options_.contact));
  probe_slot_->force = probe_;
  move_probe(Vector3::Zero());
}

void LiveMotion::move_probe(const Vector3& way) {
  probe_way_ = way;
  if (probe_) probe_->set_translation(way);
}

void LiveMotion::lift() {
  probe_.reset();
  probe_slot_->force.reset();
  probe_force_.setZero();
  probe_way_.setZero();
}

void LiveMotion::set_pace(double factor) {
  if (!(factor >= 1.0)) throw std::invalid_argument("a pace is at least that of the fit");
  if (factor == pace_) return;
  pace_ = factor;
  build();
}

void LiveMotion::set_law() {
  const auto own = data_.material.law();
  if (!own) return apply_parameters();
  const auto law = sample_ < 0 ? own : data_.samples[std::size_t(sample_)].law;
  options_.material.elastic = scaled_law(law ? law : own, stiffness_);
  build();
}

void LiveMotion::set_material(double stiffness, double damping) {
  const bool is_as_stiff = stiffness == stiffness_;
  stiffness_ = stiffness, damping_ = damping;
  is_as_stiff ? apply_parameters() : set_law();
}

void LiveMotion::push(const Vector3& velocity) { state_.v.rowwise() += velocity.transpose(); }

void LiveMotion::set_sample(int sample) {
  sample_ = sample < int(data_.samples.size()) ? sample : -1;
  set_law();
}

double LiveMotion::kinetic_energy() const {
  Points momentum = Points::Zero(body_->node_count(), 3);
  body_->add_mass_product(theta_[blocks_.density], state_.v, momentum);
  return 0.5 * momentum.cwiseProduct(state_.v).sum();
}

std::shared_ptr<const MaterialLaw> LiveMotion::law() const {
  if (auto law = options_.material.law()) return law;
  ParameterLayout layout = blocks_.layout();
  const LawForm form{.terms = 0, .two_numbers = *data_.material.of_mean_strain()};
  return law_at(*body_, LawLayout::of_motion(layout, blocks_, form), theta_);
}

const std::vector<Vector3>& LiveMotion::drops() {
  drops_.clear();
  if (!rain_) return drops_;
  Box box;
  for (Eigen::Index v = 0; v < surface_.rows(); ++v) box.extend(surface_.row(v).transpose());
  drops_ = rain_->drops_at(time_, grown(box, 0.5 * body_->size()));
  return drops_;
}

}  // namespace pliant
