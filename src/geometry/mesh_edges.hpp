#pragma once

#include <span>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// A triangle's side, from the vertex `low` to the higher one, or against that.
struct EdgeUse {
  int low, high, triangle;
  bool is_forward;
};

/// All sides of a mesh's triangles, those of one edge one after the other. A side between a vertex and itself is none.
std::vector<EdgeUse> edge_uses(const TriangleMesh& mesh);

/// Calls `visit` with the uses of each edge.
template <class Visit>
void for_each_edge(std::span<const EdgeUse> uses, Visit&& visit) {
  for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high) ++end;
    visit(uses.subspan(begin, end - begin));
  }
}

/// Triangles that hang together by edges.
struct Shell {
  std::vector<int> triangles;
  bool is_closed = false;  ///< each edge joins two triangles
  double volume = 0.0;     ///< enclosed [m^3]; negative where it faces inwards
  double area = 0.0;       ///< [m^2]
  Box box;
};

/// In the order of their first triangles.
std::vector<Shell> shells_of(const TriangleMesh& mesh);

/// Whether the closed shell `inner` lies in the closed shell `outer`, of which it cuts nothing.
bool lies_in(const TriangleMesh& mesh, const Shell& inner, const Shell& outer);

/// Whether closed shells cut one another, or one lies in the other. Those that only touch do not.
bool share_volume(const TriangleMesh& mesh, const Shell& a, const Shell& b);

/// Whether an edge of one shell goes through a triangle of the other.
bool cut(const TriangleMesh& mesh, const Shell& a, const Shell& b);

}  // namespace pliant
