#pragma once

#include "base/types.hpp"

namespace pliant {

/// A point of the surface with its share of area.
struct SurfacePoint {
  Vector3 position;  ///< rest [m]
  Vector3 normal;    ///< outward, unit
  double area;       ///< [m^2]
};

}  // namespace pliant
