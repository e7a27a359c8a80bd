#include "geometry/primitives.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace pliant {

namespace {

void require(bool good, const char* what) {
  if (!good) throw std::invalid_argument(what);
}

bool is_length(double value) { return std::isfinite(value) && value > 0.0; }

// Joins equal grid points of the box's six faces.
class GridVertices {
 public:
  GridVertices(TriangleMesh& mesh, const Vector3& size, const std::array<int, 3>& parts)
      : mesh_(mesh), size_(size), parts_(parts) {}
  int operator()(const std::array<int, 3>& grid) {
    const auto [entry, is_new] = numbers_.try_emplace(grid, int(mesh_.vertices.size()));
    if (is_new) mesh_.vertices.push_back(position(grid));
    return entry->second;
  }

 private:
  Vector3 position(const std::array<int, 3>& grid) const {
    Vector3 p;
    for (int k = 0; k < 3; ++k) p[k] = size_[k] * (double(grid[k]) / parts_[k] - 0.5);
    return p;
  }
  TriangleMesh& mesh_;
  Vector3 size_;
  std::array<int, 3> parts_;
  std::map<std::array<int, 3>, int> numbers_;
};

// The two faces across `axis`; (axis, a, b) is a right-handed order, so a x b points along +axis.
void add_box_faces(TriangleMesh& mesh, GridVertices& vertex, const std::array<int, 3>& parts, int axis) {
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  for (const int side : {0, parts[axis]})
    for (int i = 0; i < parts[a]; ++i)
      for (int j = 0; j < parts[b]; ++j) {
        const auto corner = [&](int di, int dj) {
          std::array<int, 3> grid;
          grid[axis] = side, grid[a] = i + di, grid[b] = j + dj;
          return vertex(grid);
        };
        std::array<int, 4> quad{corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
        if (side == 0) std::swap(quad[1], quad[3]);
        mesh.triangles.push_back({quad[0], quad[1], quad[2]});
        mesh.triangles.push_back({quad[0], quad[2], quad[3]});
      }
}

TriangleMesh icosahedron() {
  const double g = std::numbers::phi;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return mesh;
}

TriangleMesh split_in_four(const TriangleMesh& coarse) {
  TriangleMesh fine{coarse.vertices, {}};
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [entry, is_new] = middles.try_emplace(std::minmax(a, b), int(fine.vertices.size()));
    if (is_new) fine.vertices.push_back((fine.vertices[a] + fine.vertices[b]).normalized());
    return entry->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const std::array<int, 3>& t :
         {std::array{a, ab, ca}, std::array{b, bc, ab}, std::array{c, ca, bc}, std::array{ab, bc, ca}})
      fine.triangles.push_back(t);
  }
  return fine;
}

using Corners = std::array<int, 4>;  // of a tetrahedron, positively oriented

bool is_odd(const Corners& order) {
  int inversions = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = i + 1; j < 4; ++j) inversions += order[i] > order[j];
  return inversions % 2 == 1;
}

// Values at the points of a lattice, and the surface between them.
class MarchingTetrahedra {
 public:
  MarchingTetrahedra(const std::function<double(const Vector3&)>& function, const Box& box, double spacing)
      : origin_(box.min), spacing_(spacing) {
    for (int k = 0; k < 3; ++k) size_[k] = int(std::ceil(box.extent()[k] / spacing)) + 1;
    values_.resize(std::size_t(size_.prod()));
    for (int n = 0; n < int(values_.size()); ++n) {
      values_[n] = function(point(n));
      require(std::isfinite(values_[n]), "make_level_surface: the function is not finite");
      require(!is_inside(n) || !is_at_border(n), "make_level_surface: the inside reaches the border of the box");
    }
  }

  TriangleMesh run() {
    for (int k = 0; k + 1 < size_.z(); ++k)
      for (int j = 0; j + 1 < size_.y(); ++j)
        for (int i = 0; i + 1 < size_.x(); ++i) add_cube({i, j, k});
    return std::move(mesh_);
  }

 private:
  int number(const Eigen::Vector3i& at) const { return (at.z() * size_.y() + at.y()) * size_.x() + at.x(); }
  Eigen::Vector3i lattice(int n) const {
    return {n % size_.x(), n / size_.x() % size_.y(), n / (size_.x() * size_.y())};
  }
  Vector3 point(int n) const { return origin_ + spacing_ * lattice(n).cast<double>(); }
  bool is_inside(int n) const { return values_[std::size_t(n)] < 0.0; }
  bool is_at_border(int n) const {
    const Eigen::Vector3i at = lattice(n);
    return (at.array() == 0).any() || (at.array() == size_.array() - 1).any();
  }

  // Each order of the axes is a way along edges from the first corner to the last: a tetrahedron.
  void add_cube(const Eigen::Vector3i& first) {
    std::array<int, 3> axes{0, 1, 2};
    do {
      Corners corners{number(first), 0, 0, 0};
      Eigen::Vector3i at = first;
      for (int k = 0; k < 3; ++k) ++at[axes[k]], corners[k + 1] = number(at);
      if (is_odd({axes[0], axes[1], axes[2], 3})) std::swap(corners[2], corners[3]);
      add_tetrahedron(corners);
    } while (std::ranges::next_permutation(axes).found);
  }

  // The corners on one side come first: one of them, cut off by a triangle, or two, by a quadrilateral.
  void add_tetrahedron(const Corners& corners) {
    Corners order{0, 1, 2, 3};
    const auto inside = [&](int i) { return is_inside(corners[std::size_t(i)]); };
    const auto count = std::ranges::count_if(order, inside);
    if (count == 0 || count == 4) return;
    const bool outside_first = count == 3;
    std::ranges::stable_partition(order, [&](int i) { return inside(i) != outside_first; });
    if (is_odd(order)) std::swap(order[2], order[3]);
    const auto cut = [&](int i, int j) { return vertex(corners[order[i]], corners[order[j]]); };
    if (count == 2) {
      mesh_.triangles.push_back({cut(0, 2), cut(0, 3), cut(1, 3)});
      mesh_.triangles.push_back({cut(0, 2), cut(1, 3), cut(1, 2)});
    } else if (outside_first) {
      mesh_.triangles.push_back({cut(0, 1), cut(0, 3), cut(0, 2)});
    } else {
      mesh_.triangles.push_back({cut(0, 1), cut(0, 2), cut(0, 3)});
    }
  }

  int vertex(int a, int b) {
    const auto [entry, is_new] = vertices_.try_emplace(std::minmax(a, b), int(mesh_.vertices.size()));
    if (is_new) {
      constexpr double least = 0.05;
      const double from = values_[std::size_t(a)], to = values_[std::size_t(b)];
      const double share = std::clamp(from / (from - to), least, 1.0 - least);
      mesh_.vertices.push_back((1.0 - share) * point(a) + share * point(b));
    }
    return entry->second;
  }

  Vector3 origin_;
  double spacing_;
  Eigen::Vector3i size_;
  std::vector<double> values_;
  std::map<std::pair<int, int>, int> vertices_;  // by the lattice points between which they lie
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh make_box(const Vector3& size, double facet) {
  require(is_length(size.x()) && is_length(size.y()) && is_length(size.z()) && is_length(facet),
          "make_box: edge lengths and the facet size must be positive");
  std::array<int, 3> parts;
  for (int k = 0; k < 3; ++k) {
    require(size[k] / facet < 4096, "make_box: more than 4096 facets along an edge");
    parts[k] = std::max(1, int(std::lround(size[k] / facet)));
  }
  TriangleMesh mesh;
  GridVertices vertex(mesh, size, parts);
  for (int axis = 0; axis < 3; ++axis) add_box_faces(mesh, vertex, parts, axis);
  return mesh;
}

TriangleMesh make_sphere(double radius, int subdivisions) {
  require(is_length(radius), "make_sphere: the radius must be positive");
  require(subdivisions >= 0 && subdivisions <= 8, "make_sphere: subdivisions must be 0..8");
  TriangleMesh mesh = icosahedron();
  for (Vector3& vertex : mesh.vertices) vertex.normalize();
  for (int i = 0; i < subdivisions; ++i) mesh = split_in_four(mesh);
  for (Vector3& vertex : mesh.vertices) vertex *= radius;
  return mesh;
}

TriangleMesh make_torus(double ring_radius, double tube_radius, int ring_segments, int tube_segments) {
  require(is_length(ring_radius) && is_length(tube_radius) && tube_radius < ring_radius,
          "make_torus: 0 < tube radius < ring radius is needed");
  require(ring_segments >= 3 && tube_segments >= 3, "make_torus: at least 3 segments each way");
  TriangleMesh mesh;
  for (int i = 0; i < ring_segments; ++i)
    for (int j = 0; j < tube_segments; ++j) {
      const double s = 2.0 * std::numbers::pi * i / ring_segments, t = 2.0 * std::numbers::pi * j / tube_segments;
      const double from_axis = ring_radius + tube_radius * std::cos(t);
      mesh.vertices.emplace_back(from_axis * std::cos(s), tube_radius * std::sin(t), from_axis * std::sin(s));
    }
  const auto vertex = [&](int i, int j) { return (i % ring_segments) * tube_segments + j % tube_segments; };
  for (int i = 0; i < ring_segments; ++i)
    for (int j = 0; j < tube_segments; ++j) {
      const int a = vertex(i, j), b = vertex(i, j + 1), c = vertex(i + 1, j + 1), d = vertex(i + 1, j);
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}

TriangleMesh make_level_surface(const std::function<double(const Vector3&)>& function, const Box& box, double spacing) {
  require(is_length(spacing), "make_level_surface: the spacing must be positive");
  const Vector3 extent = box.extent();
  require(is_length(extent.x()) && is_length(extent.y()) && is_length(extent.z()),
          "make_level_surface: the box must have a volume");
  require((extent / spacing).prod() < 1e9, "make_level_surface: more than 1e9 points of the lattice");
  return MarchingTetrahedra(function, box, spacing).run();
}

}  // namespace pliant
