#include "scan/ball.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

#include "capture/depth_points.hpp"

namespace pliant {

namespace {

constexpr int fewest_ball_readings = 60, ball_hypotheses = 300, ball_sample = 1500;
constexpr double near_share = 0.15;            // of the radius: how far off a hypothesis a reading may be
constexpr double ball_reach = 3.5;             // standard deviations around the sphere in the end
constexpr double least_cap = 0.5;              // of the radius: how far from its middle a ball is seen
constexpr double independent_readings = 50.0;  // readings, at most: neighbouring pixels err together

Vector3 point_of(const PinholeCamera& camera, const Vector3& pixel) {
  return camera.ray(pixel.x(), pixel.y()) * pixel.z();
}

double tukey(double r, double scale) {
  const double s = r / scale;
  return std::abs(s) < 1.0 ? std::pow(1.0 - s * s, 2) : 0.0;
}

}  // namespace

Vector3 ball_centre(const std::vector<Vector3>& pixels, const PinholeCamera& camera, double radius, Vector3 centre,
                    double scale) {
  for (int step = 0; step < 20; ++step) {
    Matrix3 A = Matrix3::Zero();
    Vector3 b = Vector3::Zero();
    for (const Vector3& pixel : pixels) {
      const Vector3 arm = point_of(camera, pixel) - centre;
      const double r = arm.norm() - radius, w = tukey(r, scale);
      const Vector3 n = arm.normalized();
      A += w * n * n.transpose(), b += w * r * n;
    }
    const Vector3 d = (A + 1e-9 * (1.0 + A.trace()) * Matrix3::Identity()).ldlt().solve(b);
    centre += d;
    if (d.norm() < 1e-8) break;
  }
  return centre;
}

std::optional<BallSight> find_ball(const DepthImage& depth, const Image<PixelKind>& kinds, const PinholeCamera& camera,
                                   const DepthNoise& noise, double radius, std::uint64_t seed) {
  std::vector<Vector3> pixels, points;
  PinholeCamera own = camera;  // in its own axes
  own.camera_to_world = {};
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u)
      if (kinds(u, v) == PixelKind::Object)
        pixels.emplace_back(u, v, depth(u, v)), points.push_back(point_of(own, pixels.back()));
  if (int(pixels.size()) < fewest_ball_readings) return std::nullopt;
  std::mt19937_64 random(seed);
  const std::size_t every = std::max<std::size_t>(1, pixels.size() / ball_sample);
  Vector3 best;
  int most = 0;
  for (int i = 0; i < ball_hypotheses; ++i) {
    const std::size_t at = random() % pixels.size();
    const int u = int(pixels[at].x()), v = int(pixels[at].y());
    const Vector3 normal = surface_normal(depth, own, u, v, noise.jump(depth(u, v)));
    if (normal.isZero()) continue;
    const Vector3 centre = points[at] - radius * normal;
    int inliers = 0;
    for (std::size_t k = 0; k < points.size(); k += every)
      inliers += std::abs((points[k] - centre).norm() - radius) < near_share * radius;
    if (inliers > most) most = inliers, best = centre;
  }
  if (most == 0) return std::nullopt;
  BallSight sight;
  sight.centre = best;
  double scale = 2.0 * near_share * radius;
  for (int round = 0; round < 4; ++round) {
    sight.centre = ball_centre(pixels, own, radius, sight.centre, scale);
    scale = std::max(0.5 * scale, 1.5 * ball_reach * noise.axial(sight.centre.z()));
  }
  Matrix3 A = Matrix3::Zero();
  double squares = 0.0, widest = 0.0;
  const double sigma = noise.axial(sight.centre.z());
  const Vector3 view = sight.centre.normalized();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Vector3 arm = points[i] - sight.centre;
    const double r = arm.norm() - radius;
    if (std::abs(r) > ball_reach * sigma) continue;
    sight.pixels.push_back(pixels[i]);
    A += arm.normalized() * arm.normalized().transpose();
    squares += r * r;
    widest = std::max(widest, (arm - arm.dot(view) * view).norm());
  }
  const double count = double(sight.pixels.size());
  if (count < fewest_ball_readings || widest < least_cap * radius) return std::nullopt;
  sight.rms = std::sqrt(squares / count);
  sight.centre = ball_centre(sight.pixels, own, radius, sight.centre, 2.0 * ball_reach * sigma);
  const double repeats = std::max(1.0, count / independent_readings);
  sight.noise = std::max(sight.rms, 0.2 * sigma) * std::sqrt((A / repeats).inverse().trace() / 3.0);
  return sight;
}

}  // namespace pliant
