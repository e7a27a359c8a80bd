#include "mesh/tet_boundary.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace pliant {

std::vector<TetFace> boundary_faces(std::span<const std::array<int, 4>> tets) {
  struct Face {
    std::array<int, 3> sorted;  // corners
    TetFace of;
  };
  std::vector<Face> faces;
  faces.reserve(4 * tets.size());
  for (int e = 0; e < int(tets.size()); ++e)
    for (int f = 0; f < 4; ++f) {
      faces.push_back({TetFace{e, f}.corners(tets), {e, f}});
      std::ranges::sort(faces.back().sorted);
    }
  std::ranges::stable_sort(faces, {}, &Face::sorted);
  std::vector<TetFace> boundary;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t next = i + 1;
    while (next < faces.size() && faces[next].sorted == faces[i].sorted) ++next;
    if (next - i > 2)
      throw std::invalid_argument("boundary_faces: a face of element " + std::to_string(faces[i].of.tet) +
                                  " belongs to " + std::to_string(next - i) + " elements");
    if (next - i == 1) boundary.push_back(faces[i].of);
    i = next;
  }
  std::ranges::sort(boundary, {}, [](const TetFace& f) { return std::pair(f.tet, f.face); });
  return boundary;
}

}  // namespace pliant
