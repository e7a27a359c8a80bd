#include "scene/scene.hpp"

namespace pliant {

std::optional<double> Object::total_mass() const {
  if (mass) return mass;
  if (density && surface) return *density * enclosed_volume(*surface);
  return std::nullopt;
}

Timing evenly_timed(double frame_rate, int frame_count, int start_frame) {
  Timing timing;
  timing.frame_rate = frame_rate;
  timing.start_frame = start_frame;
  for (int frame = 0; frame < frame_count; ++frame) timing.times.push_back(frame / frame_rate);
  return timing;
}

}  // namespace pliant
