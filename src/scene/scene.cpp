#include "scene/scene.hpp"

#include <algorithm>

namespace pliant {

std::optional<double> Object::total_mass() const {
  if (mass) return mass;
  if (density && surface) return *density * enclosed_volume(*surface);
  return std::nullopt;
}

std::optional<double> Object::relative_mass_std() const {
  if (mass && mass_std) return *mass_std / *mass;
  if (density && density_std) return *density_std / *density;
  return std::nullopt;
}

namespace {

bool has_inner(const Scene& scene, InnerBody::Contact contact) {
  return std::ranges::find(scene.inner, contact, &InnerBody::contact) != scene.inner.end();
}

}  // namespace

bool Scene::is_held() const {
  const auto always = [](const LedRegion& region) { return region.from == -infinite && region.until == infinite; };
  return !fixed.empty() || std::ranges::any_of(led, always) || has_inner(*this, InnerBody::Contact::Glued);
}

bool Scene::is_touched() const {
  return !planes.empty() || !obstacles.empty() || has_inner(*this, InnerBody::Contact::Sliding);
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
