#include "synthesis/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace pliant {

namespace {

std::uint64_t mix(std::uint64_t x) {  // splitmix64 (Steele, Lea, Flood 2014)
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ x >> 27) * 0x94D049BB133111EBull;
  return x ^ x >> 31;
}

// What a random number is for: each purpose has its own.
enum Purpose : std::uint64_t { JitterU, JitterV, White, Smooth, EdgeLoss, EdgeFlying, FlyingPlace, Hole };

// The random numbers of one image.
struct Dice {
  std::uint64_t seed, image;
  double uniform(Purpose purpose, int pixel) const {
    return counter_uniform(seed, image, purpose, std::uint64_t(pixel));
  }
  double normal(Purpose purpose, int pixel) const { return counter_normal(seed, image, purpose, std::uint64_t(pixel)); }
};

std::vector<double> gaussian_weights(double length) {
  const int reach = std::max(1, int(std::ceil(3.0 * length)));
  std::vector<double> weights;
  double squares = 0.0;
  for (int i = -reach; i <= reach; ++i) {
    weights.push_back(std::exp(-0.5 * i * i / (length * length)));
    squares += weights.back() * weights.back();
  }
  for (double& weight : weights) weight /= std::sqrt(squares);  // white noise of variance 1 stays of variance 1
  return weights;
}

// Standard normal numbers that neighbouring pixels share: white noise through a Gaussian filter. The image is padded so
// that the border has the same statistics.
std::vector<double> smooth_noise(int width, int height, double length, const Dice& dice) {
  const std::vector<double> weights = gaussian_weights(length);
  const int taps = int(weights.size()), padded_height = height + taps - 1, padded_width = width + taps - 1;
  std::vector<double> rows(size_t(width) * padded_height), result(size_t(width) * height, 0.0), white(padded_width);
  for (int v = 0; v < padded_height; ++v) {
    for (int u = 0; u < padded_width; ++u) white[u] = dice.normal(Smooth, v * padded_width + u);
    for (int u = 0; u < width; ++u) {
      double sum = 0.0;
      for (int k = 0; k < taps; ++k) sum += weights[k] * white[u + k];
      rows[size_t(v) * width + u] = sum;
    }
  }
  for (int v = 0; v < height; ++v)
    for (int k = 0; k < taps; ++k)
      for (int u = 0; u < width; ++u) result[size_t(v) * width + u] += weights[k] * rows[size_t(v + k) * width + u];
  return result;
}

struct Neighbours {
  double nearest, farthest;  // of those with something there [m]
  bool beside_nothing;
};

Neighbours look_around(const DepthRender& image, int u, int v) {
  Neighbours around{1e300, 0.0, false};
  for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
    const int nu = u + du, nv = v + dv;
    if (nu < 0 || nv < 0 || nu >= image.width || nv >= image.height) continue;
    const double depth = image.depth[image.at(nu, nv)];
    around.beside_nothing = around.beside_nothing || depth <= 0.0;
    if (depth > 0.0)
      around.nearest = std::min(around.nearest, depth), around.farthest = std::max(around.farthest, depth);
  }
  return around;
}

// The reading at one pixel before its noise; 0: none.
double true_reading(const DepthRender& image, int u, int v, const SensorModel& sensor, const Dice& dice) {
  const int i = image.at(u, v);
  const double depth = image.depth[i];
  if (depth <= 0.0 || dice.uniform(Hole, i) < sensor.hole_rate) return 0.0;
  if (std::abs(image.cosine[i]) < std::cos(sensor.grazing_angle)) return 0.0;
  const Neighbours around = look_around(image, u, v);
  const double jump = std::max(std::abs(depth - around.nearest) * (around.nearest < 1e300),
                               std::abs(around.farthest - depth) * (around.farthest > 0.0));
  if (jump <= sensor.edge_jump && !around.beside_nothing) return depth;
  if (dice.uniform(EdgeLoss, i) < sensor.edge_loss) return 0.0;
  if (jump <= sensor.edge_jump || dice.uniform(EdgeFlying, i) >= sensor.edge_flying) return depth;
  const double low = std::min(depth, around.nearest), high = std::max(depth, around.farthest);
  return low + dice.uniform(FlyingPlace, i) * (high - low);
}

std::uint16_t raw_reading(double depth, double step, double scale) {
  const double stepped = step > 0.0 ? std::round(depth / step) * step : depth;
  const double raw = std::round(stepped * scale);
  return raw >= 1.0 && raw <= 65535.0 ? std::uint16_t(raw) : std::uint16_t(0);
}

bool is_part(double value) { return value >= 0.0 && value <= 1.0; }

}  // namespace

double counter_uniform(std::uint64_t seed, std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return double(mix(mix(mix(mix(seed) ^ a) ^ b) ^ c) >> 11) * 0x1p-53;
}

double counter_normal(std::uint64_t seed, std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  const double u1 = 1.0 - counter_uniform(seed, a, 2 * b + 1000, c), u2 = counter_uniform(seed, a, 2 * b + 1001, c);
  return std::sqrt(-2.0 * std::log(u1)) * std::cos(2.0 * std::numbers::pi * u2);
}

double SensorModel::noise(double depth) const {
  const double beyond = std::max(0.0, depth - noise_reference);
  return noise_base + noise_growth * beyond * beyond;
}

std::string SensorModel::validate() const {
  for (const auto& [name, value] : {std::pair{"noise_base", noise_base},
                                    {"noise_growth", noise_growth},
                                    {"noise_reference", noise_reference},
                                    {"step", step},
                                    {"lateral_jitter", lateral_jitter}})
    if (!(value >= 0.0 && value < 1e6)) return std::string(name) + " must be 0 or more";
  for (const auto& [name, value] : {std::pair{"correlated_part", correlated_part},
                                    {"edge_loss", edge_loss},
                                    {"edge_flying", edge_flying},
                                    {"hole_rate", hole_rate}})
    if (!is_part(value)) return std::string(name) + " must be between 0 and 1";
  if (!(correlation_length > 0.0 && correlation_length <= 50.0))
    return "correlation_length must be above 0 and at most 50 pixels";
  if (!(edge_jump > 0.0)) return "edge_jump must be above 0";
  if (!(grazing_angle >= 0.0 && grazing_angle <= std::numbers::pi / 2 + 1e-9))
    return "grazing_angle must be 0 to 90 degrees";
  return "";
}

SensorModel sensor_preset(const std::string& name) {
  SensorModel sensor;
  if (name == "ideal") return sensor;
  if (name != "structured-light") throw std::invalid_argument("no sensor is called \"" + name + "\"");
  sensor.noise_base = 0.0012, sensor.noise_growth = 0.0019, sensor.noise_reference = 0.4;
  sensor.correlated_part = 0.4, sensor.correlation_length = 1.5;
  sensor.step = 0.001, sensor.lateral_jitter = 0.4;
  sensor.edge_loss = 0.4, sensor.edge_flying = 0.25;
  sensor.grazing_angle = 78.0 * std::numbers::pi / 180.0;
  sensor.hole_rate = 0.002;
  return sensor;
}

std::vector<std::string> sensor_presets() { return {"ideal", "structured-light"}; }

SensedFrame sense(const RayScene& scene, int object, const PinholeCamera& camera, const SensorModel& sensor,
                  double depth_scale, std::uint64_t seed, int camera_number, int frame) {
  if (const std::string problem = sensor.validate(); !problem.empty()) throw std::invalid_argument("sense: " + problem);
  const Dice dice{seed, std::uint64_t(camera_number) << 32 | std::uint64_t(std::uint32_t(frame))};
  const auto jitter = [&](int u, int v) -> Eigen::Vector2d {
    const int i = v * camera.width + u;
    return sensor.lateral_jitter * Eigen::Vector2d(dice.normal(JitterU, i), dice.normal(JitterV, i));
  };
  const DepthRender exact = scene.render_depth(camera);
  const DepthRender seen = sensor.lateral_jitter > 0.0 ? scene.render_depth(camera, jitter) : exact;
  const double part = sensor.correlated_part;
  const std::vector<double> smooth =
      part > 0.0 ? smooth_noise(camera.width, camera.height, sensor.correlation_length, dice) : std::vector<double>();
  SensedFrame result{{camera.width, camera.height}, {camera.width, camera.height}};
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const int i = exact.at(u, v);
      result.mask(u, v) = exact.mesh[i] == object ? 255 : 0;
      const double depth = true_reading(seen, u, v, sensor, dice);
      if (depth <= 0.0) continue;
      const double shared = part > 0.0 ? std::sqrt(part) * smooth[i] : 0.0;
      const double noise = sensor.noise(depth) * (std::sqrt(1.0 - part) * dice.normal(White, i) + shared);
      result.depth(u, v) = raw_reading(depth + noise, sensor.step, depth_scale);
    }
  return result;
}

}  // namespace pliant
