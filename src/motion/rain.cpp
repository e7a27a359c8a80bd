#include "motion/rain.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

namespace pliant {

double RainOptions::drop_mass() const { return water_density * std::numbers::pi / 6.0 * std::pow(diameter, 3); }

Rain::Rain(const Body& body, const TriangleMesh& surface, const RainOptions& options, const ParameterHandle& gravity)
    : DeadLoad(body.nodes),
      options_(options),
      gravity_(gravity),
      triangles_(surface.triangles),
      vertices_(body, surface.vertices),
      corners_(surface.vertices.size()) {
  speed_ = options.velocity.norm();
  if (!(options.rate > 0.0) || !(options.diameter > 0.0) || !(speed_ > 0.0))
    throw std::invalid_argument("rain needs a rate, drops with a diameter and a velocity");
  fall_ = options.velocity / speed_;
  first_axis_ = fall_.unitOrthogonal();
  second_axis_ = fall_.cross(first_axis_);
  const Box box = bounding_box(surface);
  origin_ = 0.5 * (box.min + box.max);
  period_ = 4.0 * box.extent().norm();
  std::mt19937_64 random(options.seed);
  std::exponential_distribution<double> wait(options.rate * period_ * period_);
  std::uniform_real_distribution<double> place(0.0, period_);
  for (double time = options.from + wait(random); time < options.until; time += wait(random)) {
    const double first = place(random), second = place(random);
    drops_.push_back({time, first, second});
  }
}

template <class Visit>
void Rain::for_drops(double time, double dt, const Box& box, const Visit& visit) const {
  // The box in the rain's axes.
  Vector3 low = Vector3::Constant(infinite), high = Vector3::Constant(-infinite);
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3 p = Vector3(corner & 1 ? box.max.x() : box.min.x(), corner & 2 ? box.max.y() : box.min.y(),
                              corner & 4 ? box.max.z() : box.min.z()) -
                      origin_;
    const Vector3 q(first_axis_.dot(p), second_axis_.dot(p), fall_.dot(p));
    low = low.cwiseMin(q), high = high.cwiseMax(q);
  }
  const auto begin = std::ranges::lower_bound(drops_, time - high.z() / speed_, {}, &Drop::time);
  for (auto drop = begin; drop != drops_.end() && drop->time <= time + dt - low.z() / speed_; ++drop) {
    const double along = speed_ * (time - drop->time);
    for (int i = int(std::ceil((low.x() - drop->first) / period_)); drop->first + i * period_ <= high.x(); ++i)
      for (int j = int(std::ceil((low.y() - drop->second) / period_)); drop->second + j * period_ <= high.y(); ++j)
        visit(std::array<int, 3>{int(drop - drops_.begin()), i, j},
              Vector3(origin_ + (drop->first + i * period_) * first_axis_ +
                      (drop->second + j * period_) * second_axis_ + along * fall_));
  }
}

std::vector<Vector3> Rain::drops_at(double time, const Box& box) const {
  std::vector<Vector3> there;
  for_drops(time, 0.0, box, [&](const std::array<int, 3>& drop, const Vector3& position) {
    if (std::ranges::find(hits_, drop, &Hit::drop) == hits_.end()) there.push_back(position);
  });
  return there;
}

double Rain::left(const Hit& hit) const {
  const double since = time_ + 0.5 * dt_ - hit.time;
  return options_.stays * options_.drop_mass() * std::exp(-since / options_.runs_off);
}

void Rain::begin_step(const StepContext& step) {
  time_ = step.time, dt_ = step.dt;
  // A step may be taken again, also from an earlier time.
  std::erase_if(hits_, [&](const Hit& hit) { return hit.time >= step.time; });
  if (step.start && step.dt > 0.0) find_hits(step);
}

void Rain::find_hits(const StepContext& step) {
  Box box;
  for (std::size_t v = 0; v < corners_.size(); ++v) {
    corners_[v] = vertices_.position(int(v), *step.start);
    box.extend(corners_[v]);
  }
  // A drop's way begins a step earlier, for a surface that comes towards it.
  const Vector3 way = 2.0 * step.dt * options_.velocity;
  const std::size_t before = hits_.size();
  for_drops(step.time - step.dt, 2.0 * step.dt, box, [&](const std::array<int, 3>& drop, const Vector3& from) {
    const bool has_hit = std::any_of(hits_.begin(), hits_.begin() + std::ptrdiff_t(before),
                                     [&](const Hit& hit) { return hit.drop == drop; });
    if (has_hit) return;
    double nearest = 1.0;
    Hit hit{step.time, -1, {}, {}, drop};
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const Vector3& a = corners_[std::size_t(triangles_[t][0])];
      const Vector3 e1 = corners_[std::size_t(triangles_[t][1])] - a, e2 = corners_[std::size_t(triangles_[t][2])] - a;
      const Vector3 across = way.cross(e2);
      const double determinant = e1.dot(across);
      if (!(determinant > 0.0)) continue;  // from behind
      const Vector3 offset = from - a;
      const double u = offset.dot(across) / determinant;
      if (u < 0.0 || u > 1.0) continue;
      const Vector3 other = offset.cross(e1);
      const double v = way.dot(other) / determinant, s = e2.dot(other) / determinant;
      if (v < 0.0 || u + v > 1.0 || s < 0.0 || s >= nearest) continue;
      nearest = s;
      hit.triangle = int(t);
      hit.corners = {1.0 - u - v, u, v};
    }
    if (hit.triangle < 0) return;
    Vector3 surface = Vector3::Zero();
    for (int k = 0; k < 3; ++k)
      surface += hit.corners[k] *
                 vertices_.position(triangles_[std::size_t(hit.triangle)][std::size_t(k)], *step.start_velocity);
    hit.momentum = options_.drop_mass() * (options_.velocity - surface);
    hits_.push_back(hit);
  });
}

void Rain::spread(const Hit& hit, const Vector3& force, Points& out) const {
  for (int k = 0; k < 3; ++k)
    vertices_.add_transpose(triangles_[std::size_t(hit.triangle)][std::size_t(k)], hit.corners[k] * force, out);
}

void Rain::add_force(const Points&, Points& force) {
  for (const Hit& hit : hits_) {
    Vector3 f = hit.time == time_ && dt_ > 0.0 ? Vector3(hit.momentum / dt_) : Vector3(Vector3::Zero());
    if (options_.stays > 0.0) f += left(hit) * gravity_now_;
    spread(hit, f, force);
  }
}

void Rain::add_force_tangent(const Points&, const Points&, const Points&, const VectorX& d_theta, Points& force) {
  if (options_.stays == 0.0) return;
  for (const Hit& hit : hits_) spread(hit, left(hit) * gravity_.vector(d_theta), force);
}

void Rain::add_force_adjoint(const Points&, const Points& w, Points&, Points&, VectorX& theta_bar) {
  for (const Hit& hit : hits_) {
    Vector3 there = Vector3::Zero();
    for (int k = 0; k < 3; ++k)
      there += hit.corners[k] * vertices_.position(triangles_[std::size_t(hit.triangle)][std::size_t(k)], w);
    theta_bar.segment<3>(gravity_) += left(hit) * there;
  }
}

}  // namespace pliant
