#pragma once

#include <array>

namespace pliant {

/// Edges of a tetrahedron in the order of its mid nodes.
inline constexpr std::array<std::array<int, 2>, 6> tet_edges = {{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

/// Corners of the face opposite each corner, counter-clockwise seen from outside a positively oriented tetrahedron:
/// det(x1 - x0, x2 - x0, x3 - x0) > 0.
inline constexpr std::array<std::array<int, 3>, 4> tet_faces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

}  // namespace pliant
