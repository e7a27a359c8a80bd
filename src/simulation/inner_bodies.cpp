#include "simulation/inner_bodies.hpp"

#include <algorithm>
#include <iterator>

#include "base/error.hpp"
#include "geometry/surface_distance.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/contact_defaults.hpp"
#include "motion/fixed_regions.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant {

bool has_sliding_bodies(const Scene& scene) {
  return std::ranges::find(scene.inner, InnerBody::Contact::Sliding, &InnerBody::contact) != scene.inner.end();
}

std::vector<std::shared_ptr<const RigidShape>> sliding_bodies(const Scene& scene) {
  constexpr double across_least = 80.0, across_most = 240.0;  // grid points: of the smaller and of the body itself
  constexpr double margin = 0.15;                             // of the object's size
  std::vector<std::shared_ptr<const RigidShape>> shapes;
  for (const InnerBody& inner : scene.inner) {
    if (inner.contact != InnerBody::Contact::Sliding) continue;
    const double own = bounding_box(inner.surface).extent().maxCoeff(), object = object_size(scene);
    const double spacing = std::max(std::min(own, object) / across_least, own / across_most);
    shapes.push_back(rigid_smooth_grid(signed_distance(inner.surface, spacing, margin * object)));
  }
  return shapes;
}

std::vector<RigidContact> inner_contacts(const Body& body,
                                         const std::vector<std::shared_ptr<const RigidShape>>& sliding,
                                         double youngs_modulus) {
  std::vector<RigidContact> contacts;
  for (const auto& shape : sliding) contacts.push_back(inner_contact(body, shape, youngs_modulus));
  return contacts;
}

std::vector<Hold> holds_of(const Body& body, const Scene& scene) {
  constexpr double near = 0.12;  // of an element's edge: middles of edges that cut a curved body's corners are on it
  std::vector<Hold> holds = held_regions(scene);
  const double reach = near * mean_edge(body);
  for (const InnerBody& inner : scene.inner) {
    if (inner.contact != InnerBody::Contact::Glued) continue;
    const auto contains = [distance = SurfaceDistance(inner.surface), reach](const Vector3& p) {
      return distance(p) <= reach;
    };
    if (held_nodes(body, {{contains}}).empty())
      throw InputError({{inner.file},
                        "no node of the object's elements lies on the rigid body that it is glued to",
                        "a body that the object's surface touches",
                        "see that both surfaces meet where the object is at rest"});
    holds.push_back({contains});
  }
  return holds;
}

std::vector<int> held_nodes(const Body& body, const Scene& scene) { return held_nodes(body, holds_of(body, scene)); }

}  // namespace pliant
