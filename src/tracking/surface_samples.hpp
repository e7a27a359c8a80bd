#pragma once

#include <array>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Samples of a surface at one of several spacings: a subset of its vertices, each of which stands for a share of it.
struct SampleLevel {
  double spacing = 0.0;        ///< [m] no two samples are closer; 0: all vertices
  std::vector<int> vertex;     ///< of each sample
  std::vector<double> area;    ///< that each stands for [m^2]: of the vertices that are nearest to it
  std::vector<int> sample_of;  ///< of each vertex: the nearest sample
};

/// Levels from all vertices to few, each half as wide again as the one before, none with fewer than `fewest` samples
/// but the first.
std::vector<SampleLevel> sample_levels(const TriangleMesh& mesh, int fewest = 60);

}  // namespace pliant
