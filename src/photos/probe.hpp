#pragma once

#include <optional>
#include <span>
#include <string>

#include "geometry/triangle_mesh.hpp"
#include "photos/match_views.hpp"

namespace pliant {

/// A straight shaft with two dots on its axis and a disc at its tip.
struct ProbeShape {
  double dots_apart = 0.0;  ///< [m] between the dots
  double tip = 0.0;         ///< [m] from the dot nearer the tip to the tip, along the axis
  double radius = 0.0;      ///< [m] of the disc
};

/// Where the probe is.
struct ProbePose {
  Vector3 tip = Vector3::Zero();         ///< middle of the disc [m]
  Vector3 direction = Vector3::UnitZ();  ///< along the axis, from the probe into the object; unit length
  double tip_sigma = 0.0;                ///< [m] of a coordinate
};

struct FoundProbe {
  std::optional<ProbePose> pose;
  std::string failure;  ///< why there is none, in words
};

/// The probe's pose from what may be its dots: two of them as far apart as they should be, within 3 %. The one nearer
/// to the object is nearer to the tip.
/// @param factor  on the dots' sigmas (`noise_factor`)
FoundProbe find_probe(std::span<const Sighting> dots, const ProbeShape& shape, const TriangleMesh& surface,
                      double factor);

/// Where a probe first touched: the place [m] nearest to its tip where its axis enters the surface. Nothing where it
/// does so nowhere within `reach` [m] of the tip.
std::optional<Vector3> contact_of(const ProbePose& pose, const TriangleMesh& surface, double reach);

}  // namespace pliant
