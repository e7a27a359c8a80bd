#pragma once

#include <array>
#include <span>
#include <vector>

#include "mesh/tet_shape.hpp"

namespace pliant {

/// A face of an element, by the corner opposite it: its corners are `tet_faces[face]` of element `tet`.
struct TetFace {
  int tet, face;

  /// Nodes, counter-clockwise from outside the element.
  std::array<int, 3> corners(std::span<const std::array<int, 4>> tets) const {
    const auto& element = tets[std::size_t(tet)];
    const auto& [i, j, k] = tet_faces[std::size_t(face)];
    return {element[std::size_t(i)], element[std::size_t(j)], element[std::size_t(k)]};
  }
};

/// The faces that belong to one element only, in the order of the elements.
/// Throws std::invalid_argument where a face belongs to more than two elements.
std::vector<TetFace> boundary_faces(std::span<const std::array<int, 4>> tets);

}  // namespace pliant
