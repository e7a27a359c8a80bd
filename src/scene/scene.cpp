#include "scene/scene.hpp"

namespace pliant {

std::optional<double> Object::total_mass() const {
  if (mass) return mass;
  if (density && surface) return *density * enclosed_volume(*surface);
  return std::nullopt;
}

std::vector<std::string> named_moduli(const Scene& scene) {
  std::vector<std::string> names;
  if (!scene.regions.empty()) names.emplace_back("youngs_modulus");
  for (const MaterialRegion& region : scene.regions) names.push_back("youngs_modulus@" + region.name);
  for (const MaterialControl& control : scene.controls) names.push_back("youngs_modulus@" + control.name);
  return names;
}

Timing evenly_timed(double frame_rate, int frame_count, int start_frame) {
  Timing timing;
  timing.frame_rate = frame_rate;
  timing.start_frame = start_frame;
  for (int frame = 0; frame < frame_count; ++frame) timing.times.push_back(frame / frame_rate);
  return timing;
}

}  // namespace pliant
