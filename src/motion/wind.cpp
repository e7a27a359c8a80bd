#include "motion/wind.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace pliant {

namespace {

std::vector<Vector3> middles_of(const TriangleMesh& surface) {
  std::vector<Vector3> middles;
  for (const auto& t : surface.triangles) {
    Vector3 sum = Vector3::Zero();
    for (const int v : t) sum += surface.vertices[std::size_t(v)];
    middles.push_back(sum / 3.0);
  }
  return middles;
}

}  // namespace

Gusts::Gusts(const Vector3& mean, const Vector3& up, double intensity, double length, std::uint64_t seed) {
  constexpr int count = 64;
  const double speed = mean.norm();
  if (!(speed > 0.0) || !(intensity > 0.0)) return;
  const Vector3 along = mean / speed;
  Vector3 across = up.cross(along);
  across = across.norm() > 1e-6 ? across.normalized() : along.unitOrthogonal();
  const Vector3 above = along.cross(across);
  const Vector3 sigma = intensity * speed * Vector3(1.0, 0.8, 0.5);
  // By the integral of the spectrum each wave has the same share of the variance: with a = 10.3 f L / U,
  // its share below f is 1 - (1 + a)^{-2/3}.
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> part(0.0, 1.0), phase(0.0, 2.0 * std::numbers::pi);
  for (int k = 0; k < count; ++k) {
    const double share = (k + part(random)) / count;
    const double a = std::pow(1.0 - share, -1.5) - 1.0;
    Wave wave{Vector3::Zero(), Vector3::Zero(), 2.0 * std::numbers::pi * a * speed / (10.3 * length)};
    const double amplitude = std::sqrt(2.0 / count);
    int component = 0;
    for (const Vector3& axis : {along, across, above}) {
      const double angle = phase(random), size = amplitude * sigma[component++];
      wave.cosine += size * std::cos(angle) * axis;
      wave.sine += size * std::sin(angle) * axis;
    }
    waves_.push_back(wave);
  }
}

Vector3 Gusts::at(double time) const {
  Vector3 sum = Vector3::Zero();
  for (const Wave& w : waves_) sum += std::cos(w.frequency * time) * w.cosine + std::sin(w.frequency * time) * w.sine;
  return sum;
}

Wind::Wind(const Body& body, const TriangleMesh& surface, const WindOptions& options, const ParameterHandle& velocity)
    : options_(options),
      velocity_(velocity),
      triangles_(surface.triangles),
      vertices_(body, surface.vertices),
      middles_(body, middles_of(surface)),
      blocks_(body.blocks),
      corners_(surface.vertices.size()) {
  faces_.reserve(triangles_.size());
}

void Wind::begin_step(const StepContext& step) {
  dt_ = step.start ? step.dt : 0.0;
  faces_.clear();
  if (dt_ == 0.0) return;
  const double half = 0.5 * dt_;
  for (std::size_t v = 0; v < corners_.size(); ++v)
    corners_[v] = vertices_.position(int(v), *step.start) + half * vertices_.position(int(v), *step.start_velocity);
  air_ = air_velocity(step.time + half);
  constexpr double least = 1e-3;  // [m/s] below which friction along the surface is linear
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const auto& [a, b, c] = triangles_[i];
    Face f;
    f.edge_1 = corners_[std::size_t(b)] - corners_[std::size_t(a)];
    f.edge_2 = corners_[std::size_t(c)] - corners_[std::size_t(a)];
    const Vector3 twice = f.edge_1.cross(f.edge_2);
    const double length = twice.norm();
    f.area = 0.5 * length;
    f.normal = length > 0.0 ? Vector3(twice / length) : Vector3::UnitY();
    f.start = middles_.position(int(i), *step.start);
    f.first = air_ - middles_.position(int(i), *step.start_velocity);
    const double through = f.normal.dot(f.first);
    f.across = std::min(0.0, through);
    f.slide = f.first - through * f.normal;
    f.along = std::sqrt(f.slide.squaredNorm() + least * least);
    faces_.push_back(f);
  }
}

Vector3 Wind::relative_velocity(std::size_t face, const Points& z) const {
  return air_ - (middles_.position(int(face), z) - faces_[face].start) / dt_;
}

/// A change of s in |s| s, s < 0, about s0: |s0| (2 s - s0).
Vector3 Wind::force_of(const Face& f, const Vector3& u) const {
  const double s = f.normal.dot(u), pressure = -f.across * (2.0 * s - f.across);
  return 0.5 * options_.air_density * f.area *
         (options_.normal * pressure * f.normal + options_.tangential * f.along * (u - s * f.normal));
}

Vector3 Wind::force_change(const Face& f, const Vector3& u, const Change& d) const {
  const double s = f.normal.dot(u), s0 = f.across, pressure = -s0 * (2.0 * s - s0);
  const Vector3 slide = u - s * f.normal;
  const double d_s = f.normal.dot(d.now) + d.normal.dot(u);
  const double d_s0 = s0 < 0.0 ? f.normal.dot(d.first) + d.normal.dot(f.first) : 0.0;
  const double d_pressure = 2.0 * (s0 - s) * d_s0 - 2.0 * s0 * d_s;
  const double through = f.normal.dot(f.first);
  const double d_along = (f.slide.dot(d.first) - through * f.slide.dot(d.normal)) / f.along;
  const Vector3 d_slide = d.now - d_s * f.normal - s * d.normal;
  return 0.5 * options_.air_density *
         (options_.normal * (d.area * pressure * f.normal + f.area * (d_pressure * f.normal + pressure * d.normal)) +
          options_.tangential * (d.area * f.along * slide + f.area * (d_along * slide + f.along * d_slide)));
}

Wind::Change Wind::force_adjoint(const Face& f, const Vector3& u, const Vector3& w) const {
  const double s = f.normal.dot(u), s0 = f.across, pressure = -s0 * (2.0 * s - s0);
  const Vector3 slide = u - s * f.normal;
  const double n = 0.5 * options_.air_density * options_.normal, t = 0.5 * options_.air_density * options_.tangential;
  const double through = f.normal.dot(f.first);
  Change bar;
  bar.area = n * pressure * f.normal.dot(w) + t * f.along * slide.dot(w);
  bar.normal = n * f.area * pressure * w;
  const double pressure_bar = n * f.area * f.normal.dot(w);
  const double along_bar = t * f.area * slide.dot(w);
  const Vector3 slide_bar = t * f.area * f.along * w;
  double s_bar = -2.0 * s0 * pressure_bar;
  const double s0_bar = s0 < 0.0 ? 2.0 * (s0 - s) * pressure_bar : 0.0;
  bar.now = slide_bar;
  s_bar -= f.normal.dot(slide_bar);
  bar.normal -= s * slide_bar;
  bar.first = along_bar / f.along * f.slide;
  bar.normal -= along_bar / f.along * through * f.slide;
  bar.now += s_bar * f.normal;
  bar.normal += s_bar * u;
  bar.first += s0_bar * f.normal;
  bar.normal += s0_bar * f.first;
  return bar;
}

void Wind::add_force(const Points& z, Points& force) {
  for (std::size_t i = 0; i < faces_.size(); ++i)
    middles_.add_transpose(int(i), force_of(faces_[i], relative_velocity(i, z)), force);
}

void Wind::add_matrix(double scale, BlockMatrix& matrix) {
  const int n = middles_.nodes_per_point();
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Face& f = faces_[i];
    const double rate = scale * 0.5 * options_.air_density * f.area / dt_;
    const Matrix3 across = f.normal * f.normal.transpose();
    const Matrix3 block = rate * (-2.0 * options_.normal * f.across * across +
                                  options_.tangential * f.along * (Matrix3::Identity() - across));
    const auto w = middles_.weights(int(i));
    const int* blocks = blocks_->data() + std::size_t(middles_.element(int(i))) * std::size_t(n * n);
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b)
        Eigen::Map<Matrix3>(matrix.block(blocks[n * a + b])) += w[std::size_t(a)] * w[std::size_t(b)] * block;
  }
}

void Wind::add_force_tangent(const Points& z, const Points&, const Points& d_z, const VectorX& d_theta, Points& force) {
  const Vector3 d_air = velocity_.vector(d_theta);
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    Change change;
    change.first = d_air;
    change.now = d_air - middles_.position(int(i), d_z) / dt_;
    middles_.add_transpose(int(i), force_change(faces_[i], relative_velocity(i, z), change), force);
  }
}

void Wind::add_force_adjoint(const Points& z, const Points& w, Points&, Points& z_bar, VectorX& theta_bar) {
  Vector3 air_bar = Vector3::Zero();
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Change bar = force_adjoint(faces_[i], relative_velocity(i, z), middles_.position(int(i), w));
    air_bar += bar.first + bar.now;
    middles_.add_transpose(int(i), -bar.now / dt_, z_bar);
  }
  theta_bar.segment<3>(velocity_) += air_bar;
}

void Wind::add_start_tangent(const Points& z, const Points& d_start, const Points& d_start_velocity, Points& force) {
  const double half = 0.5 * dt_;
  const auto corner_change = [&](int v) -> Vector3 {
    return vertices_.position(v, d_start) + half * vertices_.position(v, d_start_velocity);
  };
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Face& f = faces_[i];
    const auto& [a, b, c] = triangles_[i];
    if (f.area == 0.0) continue;
    const Vector3 d_a = corner_change(a), d_1 = corner_change(b) - d_a, d_2 = corner_change(c) - d_a;
    const Vector3 d_twice = d_1.cross(f.edge_2) + f.edge_1.cross(d_2);
    Change change;
    change.area = 0.5 * f.normal.dot(d_twice);
    change.normal = (d_twice - 2.0 * change.area * f.normal) / (2.0 * f.area);
    change.first = -middles_.position(int(i), d_start_velocity);
    change.now = middles_.position(int(i), d_start) / dt_;
    middles_.add_transpose(int(i), force_change(f, relative_velocity(i, z), change), force);
  }
}

void Wind::add_start_adjoint(const Points& z, const Points& w, Points& start_bar, Points& start_velocity_bar) {
  const double half = 0.5 * dt_;
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Face& f = faces_[i];
    if (f.area == 0.0) continue;
    const Change bar = force_adjoint(f, relative_velocity(i, z), middles_.position(int(i), w));
    middles_.add_transpose(int(i), -bar.first, start_velocity_bar);
    middles_.add_transpose(int(i), bar.now / dt_, start_bar);
    const Vector3 twice_bar =
        0.5 * bar.area * f.normal + (bar.normal - f.normal.dot(bar.normal) * f.normal) / (2.0 * f.area);
    const Vector3 bar_1 = f.edge_2.cross(twice_bar), bar_2 = twice_bar.cross(f.edge_1);
    const std::array<Vector3, 3> corner_bar = {-bar_1 - bar_2, bar_1, bar_2};
    for (std::size_t k = 0; k < 3; ++k) {
      vertices_.add_transpose(triangles_[i][k], corner_bar[k], start_bar);
      vertices_.add_transpose(triangles_[i][k], half * corner_bar[k], start_velocity_bar);
    }
  }
}

}  // namespace pliant
