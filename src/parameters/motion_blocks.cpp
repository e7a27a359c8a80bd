#include "parameters/motion_blocks.hpp"

namespace pliant {

void MaterialBlocks::set_moduli(VectorX& theta, double youngs_modulus) const {
  for (const ParameterHandle& modulus : youngs_moduli) theta[modulus] = youngs_modulus;
}

void MaterialBlocks::scale_moduli(VectorX& theta, double factor) const {
  for (const ParameterHandle& modulus : youngs_moduli) theta[modulus] *= factor;
}

VectorX MaterialBlocks::moduli(const VectorX& theta) const {
  VectorX values(Eigen::Index(youngs_moduli.size()));
  for (std::size_t k = 0; k < youngs_moduli.size(); ++k) values[Eigen::Index(k)] = theta[youngs_moduli[k]];
  return values;
}

std::vector<ParameterHandle> MotionBlocks::all() const {
  std::vector<ParameterHandle> handles = youngs_moduli;
  handles.insert(handles.end(), {poissons_ratio, mass_damping, stiffness_damping, density, gravity, linear_velocity,
                                 angular_velocity});
  for (const PlaneBlock& plane : planes) {
    handles.push_back(plane.whole());
    if (plane.friction.exists()) handles.push_back(plane.friction);
  }
  for (const ContactBlock& obstacle : obstacles)
    if (obstacle.friction.exists()) handles.push_back(obstacle.friction);
  if (contact_stiffness.exists()) handles.push_back(contact_stiffness);
  handles.insert(handles.end(), pulls.begin(), pulls.end());
  handles.insert(handles.end(), scan_corrections.begin(), scan_corrections.end());
  if (wind.exists()) handles.push_back(wind);
  handles.insert(handles.end(), strengths.begin(), strengths.end());
  return handles;
}

MotionBlocks MotionBlocks::moved(const std::function<ParameterHandle(const ParameterHandle&)>& there) const {
  MotionBlocks other = *this;
  for (ParameterHandle& modulus : other.youngs_moduli) modulus = there(modulus);
  for (ParameterHandle* handle : {&other.poissons_ratio, &other.mass_damping, &other.stiffness_damping, &other.density,
                                  &other.gravity, &other.linear_velocity, &other.angular_velocity})
    *handle = there(*handle);
  const auto there_if = [&](const ParameterHandle& handle) {
    return handle.exists() ? there(handle) : ParameterHandle{};
  };
  for (PlaneBlock& plane : other.planes)
    plane = {there(plane.point), there(plane.normal), there_if(plane.friction), there_if(plane.stiffness)};
  for (ContactBlock& obstacle : other.obstacles) obstacle = {there_if(obstacle.friction), there_if(obstacle.stiffness)};
  other.contact_stiffness = there_if(contact_stiffness);
  for (ParameterHandle& pull : other.pulls) pull = there(pull);
  for (ParameterHandle& correction : other.scan_corrections) correction = there(correction);
  other.wind = there_if(wind);
  for (ParameterHandle& strength : other.strengths) strength = there(strength);
  return other;
}

MotionBlocks add_motion_blocks(ParameterLayout& layout, const MotionCounts& counts,
                               const std::vector<std::string>& moduli_names) {
  const auto modulus = [&](int k) {
    std::string name = "youngs_modulus";
    if (!moduli_names.empty())
      name = moduli_names[std::size_t(k)];
    else if (k > 0)
      name += "@" + std::to_string(k + 1);
    return layout.add({std::move(name), "Pa", 1, Role::Material});
  };
  MotionBlocks blocks;
  blocks.youngs_moduli.push_back(modulus(0));
  blocks.poissons_ratio = layout.add({"poissons_ratio", "1", 1, Role::Material});
  blocks.mass_damping = layout.add({"mass_damping", "1/s", 1, Role::Damping});
  blocks.stiffness_damping = layout.add({"stiffness_damping", "s", 1, Role::Damping});
  blocks.density = layout.add({"density", "kg/m^3", 1, Role::Inertia});
  blocks.gravity = layout.add({"gravity", "m/s^2", 3, Role::Load});
  blocks.linear_velocity = layout.add({"linear_velocity", "m/s", 3, Role::Initial});
  blocks.angular_velocity = layout.add({"angular_velocity", "rad/s", 3, Role::Initial});
  for (int i = 0; i < counts.planes; ++i) {
    const ParameterHandle plane =
        layout.add({i == 0 ? "plane" : "plane_" + std::to_string(i + 1), "", 6, Role::Obstacle});
    const ParameterHandle friction =
        layout.add({i == 0 ? "friction" : "friction_" + std::to_string(i + 1), "1", 1, Role::Obstacle});
    blocks.planes.push_back({{plane.first, 3}, {plane.first + 3, 3}, friction, {}});
  }
  for (int i = 0; i < counts.obstacles; ++i)
    blocks.obstacles.push_back({layout.add({i == 0 ? "obstacle_friction" : "obstacle_friction_" + std::to_string(i + 1),
                                            "1", 1, Role::Obstacle}),
                                {}});
  if (counts.planes + counts.obstacles > 0)
    blocks.contact_stiffness = layout.add({"contact_stiffness", "Pa/m", 1, Role::Obstacle});
  for (PlaneBlock& plane : blocks.planes) plane.stiffness = blocks.contact_stiffness;
  for (ContactBlock& obstacle : blocks.obstacles) obstacle.stiffness = blocks.contact_stiffness;
  for (int k = 0; k < counts.pulls; ++k)
    blocks.pulls.push_back(layout.add({"pull@" + std::to_string(k + 1), "1", 3, Role::Initial}));
  for (int k = 0; k < counts.scan_corrections; ++k)
    blocks.scan_corrections.push_back(layout.add({"scan_correction@" + std::to_string(k + 1), "1", 3, Role::Shape}));
  if (counts.wind) blocks.wind = layout.add({"wind", "m/s", 3, Role::Load});
  for (int k = 0; k < counts.strengths; ++k)
    blocks.strengths.push_back(layout.add({"strength@" + std::to_string(k + 1), "1", 1, Role::Load}));
  for (int k = 1; k < counts.moduli; ++k) blocks.youngs_moduli.push_back(modulus(k));
  return blocks;
}

}  // namespace pliant
