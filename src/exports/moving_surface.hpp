#pragma once

#include <array>
#include <vector>

#include "exports/formats.hpp"

namespace pliant {

/// The surface of a model as it moves.
struct MovingSurface {
  std::vector<std::array<int, 3>> triangles;
  std::vector<Points> frames;  ///< of the vertices [m], n x 3 each
  std::vector<double> times;   ///< [s] since the first frame
};

/// Simulates a model as its recording was. The surface is that of the object, or, where there is none, the boundary of
/// the model's tetrahedra over all of their nodes.
/// Nothing, not even a frame, where `progress` stopped it. Throws std::runtime_error where the model cannot be
/// simulated.
MovingSurface moving_surface(const Model& model, const ExportProgress& progress);

}  // namespace pliant
