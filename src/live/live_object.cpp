#include "live/live_object.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "elasticity/point_averages.hpp"
#include "motion/contact_samples.hpp"
#include "scene/region.hpp"

namespace pliant {

/// Forwards to what is in it, and is nothing while that is nothing.
class LiveObject::Slot : public ForceTerm {
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

LiveObject::LiveObject(LiveData data) : data_(std::move(data)), blocks_(live_blocks(data_.planes)) {
  Body body = std::holds_alternative<HexGrid>(data_.mesh) ? make_body(std::get<HexGrid>(data_.mesh))
                                                          : make_body(std::get<TetMesh>(data_.mesh));
  if (data_.relative_moduli.size() == body.modulus.relative.size()) body.modulus.relative = data_.relative_moduli;
  body_ = std::make_shared<Body>(std::move(body));
  if (data_.theta.size() != blocks_.size()) throw std::runtime_error("the bytes of the object make no sense");
  options_.max_dt = data_.max_dt, options_.newmark_theta = data_.newmark_theta;
  options_.contact_weight = data_.contact_weight, options_.rotation_prediction = data_.rotation_prediction;
  options_.elastic_law = data_.elastic_law, options_.stiffness_damping = data_.stiffness_damping;
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
  vertices_ = Embedding(*body_, data_.surface.vertices);
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

void LiveObject::build() {
  std::vector<std::unique_ptr<ForceTerm>> terms = scene_forces(body_, options_);
  elasticity_ = dynamic_cast<Elasticity*>(terms.front().get());
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
  stepper_ = std::make_unique<Stepper>(
      body_, std::move(terms), options_.blocks,
      StepOptions{options_.max_dt, options_.newmark_theta, options_.contact_weight, options_.rotation_prediction,
                  options_.stiffness_damping, options_.solver, Integrator::Lagged, options_.newton});
  stepper_->hold(eliminated_nodes(*body_, options_));
  if (!options_.weights.empty()) {
    const PointWeights hung(*body_, options_.weights, options_.blocks.gravity);
    stepper_->carry(hung.points(), hung.masses());
  }
  apply_parameters();
}

void LiveObject::apply_parameters() {
  theta_ = sample_ < 0 ? data_.theta : data_.samples[std::size_t(sample_)];
  blocks_.scale_moduli(theta_, stiffness_);
  theta_[blocks_.mass_damping] *= damping_;
  theta_[blocks_.stiffness_damping] *= damping_;
  theta_.segment<3>(blocks_.gravity) = gravity_;
  theta_.segment<3>(blocks_.wind) = wind_;
  stepper_->set_parameters(theta_);
}

void LiveObject::reset() {
  state_ = first_;
  time_ = 0.0;
  let_go();
  hand_slot_->force.reset();
  surface_ = vertices_.positions(state_.x);
}

void LiveObject::start_as_recorded() {
  reset();
  const Points lever = body_->scanned_positions().rowwise() - body_->centre_of_mass().transpose();
  const Matrix3 spin = cross_matrix(blocks_.angular_velocity.vector(theta_));
  state_.v = (lever * spin.transpose()).rowwise() + blocks_.linear_velocity.vector(theta_).transpose();
  if (options_.holds.empty()) state_.x = body_->nodes;
}

bool LiveObject::take(double dt) {
  constexpr double too_long = 0.1, explosion = 3.0;  // see Simulation::take_step
  stepper_->set_time(time_);
  stepper_->set_time_step(dt);
  if (!stepper_->prepare(state_)) return false;
  delta_ = dt * state_.v;
  const bool is_taken = stepper_->solve(state_, delta_).converged;
  const double surprise =
      is_taken ? 0.5 * std::sqrt((delta_ - dt * state_.v).rowwise().squaredNorm().maxCoeff()) / element_edge_
               : infinite;
  const double shortest = std::ldexp(options_.max_dt, -options_.most_halvings);
  if (surprise > too_long && 0.5 * dt >= (1.0 - 1e-9) * shortest) return take(0.5 * dt) && take(0.5 * dt);
  if (surprise > explosion) return false;
  stepper_->advance(delta_, state_);
  time_ += dt;
  return true;
}

bool LiveObject::step() {
  hand_slot_->force = grip_;
  const State before = state_;
  const double then = time_;
  const bool is_taken = take(options_.max_dt);
  if (!is_taken) {
    state_ = before, time_ = then;
    state_.v.setZero();
  }
  if (probe_) probe_force_ = probe_->force(state_.x, Vector3::Zero());
  surface_ = vertices_.positions(state_.x);
  return is_taken;
}

void LiveObject::grab(int triangle, const Vector3& corners, double radius, double stiffness) {
  const auto& t = data_.surface.triangles.at(std::size_t(triangle));
  Vector3 at = Vector3::Zero();
  for (int k = 0; k < 3; ++k) at += corners[k] * data_.surface.vertices[std::size_t(t[std::size_t(k)])];
  const double weight = theta_[blocks_.density] * body_->volume() * std::max(gravity_.norm(), 9.81);
  LedSpringsOptions options;
  options.stiffness = stiffness > 0.0 ? stiffness : 10.0 * weight / body_->size();
  options.reaches = true;
  grip_ = std::make_shared<LedSprings>(*body_, surface_patch(*body_, at, radius), options);
  const Points corners_now = surface_;
  Vector3 now = Vector3::Zero();
  for (int k = 0; k < 3; ++k) now += corners[k] * corners_now.row(t[std::size_t(k)]).transpose();
  move_hand(now);
}

void LiveObject::move_hand(const Vector3& place) {
  if (grip_) grip_->move_to(place);
}

Vector3 LiveObject::hand_force() const { return grip_ ? grip_->force(state_.x) : Vector3(Vector3::Zero()); }

std::optional<std::pair<Vector3, Vector3>> LiveObject::hand() const {
  if (!grip_) return std::nullopt;
  return std::pair{grip_->middle(state_.x), grip_->place()};
}

void LiveObject::set_gravity(const Vector3& gravity) {
  gravity_ = gravity;
  apply_parameters();
}

void LiveObject::set_wind(const Vector3& velocity, double gust_intensity) {
  wind_ = velocity;
  wind_slot_->force.reset();
  if (velocity.norm() > 0.0) {
    WindOptions options;
    options.gusts = Gusts(velocity, data_.up, gust_intensity, std::max(1.0, 5.0 * body_->size()), 1);
    wind_slot_->force = std::make_shared<Wind>(*body_, data_.surface, options, blocks_.wind);
  }
  apply_parameters();
}

void LiveObject::set_rain(double rate, double diameter) {
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

void LiveObject::set_probe(const Vector3& from, const Vector3& to, double radius) {
  probe_.reset();
  probe_force_.setZero();
  if (radius > 0.0)
    probe_ = std::make_shared<RigidContact>(
        RigidContact::sliding(*body_, surface_samples(*body_), rigid_capsule(from, to, radius), options_.contact));
  probe_slot_->force = probe_;
}

void LiveObject::set_material(double stiffness, double damping) {
  stiffness_ = stiffness, damping_ = damping;
  apply_parameters();
}

void LiveObject::push(const Vector3& velocity) { state_.v.rowwise() += velocity.transpose(); }

void LiveObject::set_sample(int sample) {
  sample_ = sample < int(data_.samples.size()) ? sample : -1;
  apply_parameters();
}

double LiveObject::kinetic_energy() const {
  Points momentum = Points::Zero(body_->node_count(), 3);
  body_->add_mass_product(theta_[blocks_.density], state_.v, momentum);
  return 0.5 * momentum.cwiseProduct(state_.v).sum();
}

const std::vector<float>& LiveObject::field(Field which) {
  field_.assign(data_.surface.vertices.size(), 0.0f);
  if (which == Field::Displacement) {
    for (std::size_t v = 0; v < field_.size(); ++v)
      field_[v] = float((surface_.row(Eigen::Index(v)).transpose() - data_.surface.vertices[v]).norm());
    return field_;
  }
  if (which == Field::None) return field_;
  std::vector<double> of_elements(std::size_t(body_->element_count()));
  if (which != Field::Modulus) elasticity_->linearise(state_.x);
  for (int e = 0; e < body_->element_count(); ++e) {
    double& value = of_elements[std::size_t(e)];
    if (which == Field::Modulus)
      value = theta_[blocks_.youngs_moduli.front()] * body_->modulus.relative[std::size_t(e)];
    else if (which == Field::VonMises)
      value = von_mises(elasticity_->cauchy_stress(e));
    else
      value = Eigen::SelfAdjointEigenSolver<Matrix3>(Matrix3(elasticity_->rotation(e).S - Matrix3::Identity()),
                                                     Eigen::EigenvaluesOnly)
                  .eigenvalues()
                  .cwiseAbs()
                  .maxCoeff();
  }
  const std::vector<double> averages = averages_at(*body_, vertices_, of_elements);
  std::ranges::transform(averages, field_.begin(), [](double v) { return float(v); });
  return field_;
}

const std::vector<Vector3>& LiveObject::drops() {
  drops_.clear();
  if (!rain_) return drops_;
  Box box;
  for (Eigen::Index v = 0; v < surface_.rows(); ++v) box.extend(surface_.row(v).transpose());
  drops_ = rain_->drops_at(time_, grown(box, 0.5 * body_->size()));
  return drops_;
}

}  // namespace pliant
