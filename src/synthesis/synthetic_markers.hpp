#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "geometry/triangle_mesh.hpp"
#include "synthesis/synthesis.hpp"

namespace pliant {

/// Points of a surface far from each other, and where there is a choice from `apart`: out of random points, even by
/// area, that follow from the seed.
/// @param is_wanted  of a point [m]; empty: all are
/// @param apart      [m]; may be empty
/// Throws std::invalid_argument where hardly any part of the surface is wanted, or count is below 1.
std::vector<Vector3> spread_markers(const TriangleMesh& surface, int count,
                                    const std::function<bool(const Vector3&)>& is_wanted,
                                    const std::vector<Vector3>& apart, std::uint64_t seed);

/// The point of a surface nearest to one in space, as a triangle and the weights of its corners.
struct SurfacePlace {
  int triangle = -1;
  Vector3 weights = Vector3::Zero();  ///< sum 1
  /// Where that is for these vertices, n x 3 [m].
  Vector3 operator()(const TriangleMesh& surface, const Points& vertices) const;
};
/// Throws std::invalid_argument for a surface without triangles.
SurfacePlace nearest_place(const TriangleMesh& surface, const Vector3& point);

/// Markers as they are measured: with noise, and rows of NaN for those that were not seen. Random numbers follow from
/// seed, occasion and marker alone.
/// @param rest      where they are in the scan, m x 3 [m]
/// @param now       m x 3 [m]
/// @param occasion  -1: at rest, where all are seen; else a number for each frame and load
Points measured_markers(const SyntheticMarkers& markers, const Points& rest, const Points& now, std::uint64_t seed,
                        int occasion);

}  // namespace pliant
