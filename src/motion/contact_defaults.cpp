#include "motion/contact_defaults.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/error.hpp"

namespace pliant {

namespace {

constexpr double bond = 10.0;  // stiffness of a bonded disc and of a punch, in layers of elements
// Of a disc bonded to quadratic elements, whose faces bend at its edge: at 10 moduli of two blocks that an independent
// simulator pressed came out 4 and 10 % too high, at 50 within 1.5 % (Poisson's ratios 11 and 16 % too low).
constexpr double quadratic_bond = 50.0;
constexpr double ball_stiffness = 100.0;               // of a ball, which touches a small part of an element
constexpr double punch_smoothing = 0.005;              // over which pressure sets in, in radii
constexpr double ball_smoothing = 0.01;                // likewise
constexpr double punch_rim = 0.05;                     // radius of the rounded rim, in radii
constexpr double inner_stiffness = 50.0;               // of a body on which the object slides, in layers of elements
constexpr double inner_smoothing = 0.01;               // over which its pressure sets in, in edges
constexpr int inner_cuts = 2;                          // of a face, for the samples where it acts
constexpr auto quadratic = Penalty::Onset::Quadratic;  // of probes: at a distance they do not touch
constexpr int fewest_cuts = 4, most_cuts = 8;          // of a face, for the samples where contact acts

RigidContact bonded_disc(const Body& body, const ProbeOptions& probe, double youngs_modulus) {
  const ContactSamples disc = disc_samples(body, probe.centre, probe.radius);
  if (disc.rest.empty()) {
    std::ostringstream found;
    found.precision(4);
    found << "the disc at (" << probe.centre.x() << ", " << probe.centre.y() << ", " << probe.centre.z()
          << ") m touches nothing of the object";
    throw InputError({{},
                      found.str(),
                      "a contact whose centre lies on the surface at rest",
                      "correct where the probe touches the object"});
  }
  const double layers = body.kind == ElementKind::QuadraticTetrahedron ? quadratic_bond / bond : 1.0;
  return RigidContact::bonded(body, disc, layers * bond_stiffness(youngs_modulus, mean_edge(body)));
}

}  // namespace

double default_contact_stiffness(double weight, double area, double size) {
  const double projected = 0.25 * area;  // a convex body's mean over all directions
  return weight / (projected * 1e-4 * size);
}

Penalty default_contact(const Body& body, double mass, double gravity) {
  double area = 0.0;
  for (const SurfacePoint& point : body.surface) area += point.area;
  return {default_contact_stiffness(mass * gravity, area, body.size()), 1e-3 * body.size()};
}

double default_friction_speed(const Body& body, double gravity) { return std::sqrt(2e-4 * gravity * body.size()); }

Vector3 probe_axis(const Body& body, const ProbeOptions& probe) {
  if (probe.axis) return probe.axis->normalized();
  const auto nearest = std::ranges::min_element(
      body.surface, {}, [&](const SurfacePoint& p) { return (p.position - probe.centre).squaredNorm(); });
  return -nearest->normal;
}

RigidContact probe_contact(const Body& body, const ProbeOptions& probe, double youngs_modulus) {
  if (probe.kind == ProbeKind::BondedDisc) return bonded_disc(body, probe, youngs_modulus);
  const Vector3 axis = probe_axis(body, probe);
  const double edge = mean_edge(body), radius = probe.radius;
  const ContactSamples samples = boundary_samples(body, std::clamp(int(2.0 * edge / radius), fewest_cuts, most_cuts));
  std::shared_ptr<const RigidShape> round = probe.shape;
  const Vector3 middle = probe.centre - radius * axis;
  if (probe.kind == ProbeKind::Ball) round = rigid_ball(middle, radius);
  if (probe.kind == ProbeKind::Capsule)
    round = rigid_capsule(middle - 0.5 * probe.rod, middle + 0.5 * probe.rod, radius);
  if (probe.kind != ProbeKind::Punch)
    return RigidContact::sliding(body, samples, round,
                                 Penalty{ball_stiffness * youngs_modulus / edge, ball_smoothing * radius, quadratic});
  return RigidContact::sliding(body, samples, rigid_punch(probe.centre, axis, radius, punch_rim * radius),
                               Penalty{bond_stiffness(youngs_modulus, edge), punch_smoothing * radius, quadratic});
}

RigidContact inner_contact(const Body& body, std::shared_ptr<const RigidShape> shape, double youngs_modulus) {
  const double edge = mean_edge(body);
  const ContactSamples all =
      body.kind == ElementKind::Hexahedron ? surface_samples(body) : boundary_samples(body, inner_cuts);
  ContactSamples facing;
  for (std::size_t i = 0; i < all.rest.size(); ++i)
    if (shape->sample(all.rest[i]).gradient.dot(all.normal[i]) < 0.0) {
      facing.rest.push_back(all.rest[i]);
      facing.area.push_back(all.area[i]);
    }
  if (facing.rest.empty())
    throw InputError({{}, "a rigid body that nothing of the object faces", "one inside the object or under it", ""});
  RigidContact contact =
      RigidContact::sliding(body, facing, std::move(shape),
                            Penalty{inner_stiffness * youngs_modulus / edge, inner_smoothing * edge, quadratic});
  contact.touch_at_rest();
  return contact;
}

double bond_stiffness(double youngs_modulus, double edge) { return bond * youngs_modulus / edge; }

double mean_edge(const Body& body) {
  // A regular tetrahedron of edge a has the volume a^3 / (6 sqrt 2).
  const double edges = body.kind == ElementKind::Hexahedron ? 1.0 : 6.0 * std::sqrt(2.0);
  return std::cbrt(edges * body.volume() / body.element_count());
}

}  // namespace pliant
