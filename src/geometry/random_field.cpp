#include "geometry/random_field.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace pliant {

RandomField::RandomField(double deviation, double length, std::uint64_t seed) {
  constexpr int count = 128;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0 / length);
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  waves_.resize(count);
  for (Wave& wave : waves_) {
    for (int d = 0; d < 3; ++d) wave.number[d] = normal(random);
    wave.phase = phase(random);
  }
  amplitude_ = deviation * std::sqrt(2.0 / count);
}

double RandomField::operator()(const Vector3& p) const {
  double sum = 0.0;
  for (const Wave& wave : waves_) sum += std::cos(wave.number.dot(p) + wave.phase);
  return amplitude_ * sum;
}

}  // namespace pliant
