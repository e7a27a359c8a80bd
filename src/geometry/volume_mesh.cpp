#include "geometry/volume_mesh.hpp"

#include <algorithm>
#include <map>

#include "base/disjoint_sets.hpp"
#include "base/files.hpp"
#include "geometry/raw_cells.hpp"
#include "geometry/tetrahedron.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

RawCells read_cells(const fs::path& path) {
  const std::string ending = ending_of(path);
  if (ending == ".msh") return read_gmsh(path);
  if (ending == ".vtk") return read_legacy_vtk(path);
  if (ending == ".vtu") return read_xml_vtk(path);
  throw InputError({{path},
                    "a volume mesh with the ending \"" + path.extension().string() + "\"",
                    ".msh (Gmsh), .vtk or .vtu",
                    "export the mesh as one of these"});
}

Place place_of(const fs::path& path, int line) { return {path, line, 0}; }

std::string label(const RawCells::Cell& cell, std::size_t number) {
  return (cell.kind == RawCell::OtherSolid ? "a " + cell.name + " (cell " : "tetrahedron (cell ") +
         std::to_string(number) + ")";
}

/// Twice three times the volume of the element's corners.
double determinant(const RawCells& raw, const std::vector<int>& nodes) {
  Matrix3 edges;
  for (int k = 0; k < 3; ++k)
    edges.col(k) = raw.nodes[std::size_t(nodes[std::size_t(k) + 1])] - raw.nodes[std::size_t(nodes[0])];
  return edges.determinant();
}

/// Inside out to outside out: corners 0 and 1 change places, and with them the middles of 02 and 12, 03 and 13.
void turn(std::vector<int>& nodes) {
  std::swap(nodes[0], nodes[1]);
  if (nodes.size() == 10) std::swap(nodes[5], nodes[7]), std::swap(nodes[6], nodes[8]);
}

/// The file's tetrahedra, turned where they have to be; complaints about the others.
std::vector<RawCells::Cell> tetrahedra(RawCells& raw, const fs::path& path, VolumeMesh& mesh) {
  constexpr std::size_t most = 10;  // complaints
  std::vector<Problem> problems;
  std::vector<RawCells::Cell> tets;
  for (std::size_t c = 0; c < raw.cells.size() && problems.size() < most; ++c) {
    RawCells::Cell& cell = raw.cells[c];
    if (cell.kind == RawCell::Flat) {
      ++mesh.passed_over;
      continue;
    }
    const Place place = place_of(path, cell.line);
    if (cell.kind == RawCell::OtherSolid) {
      problems.push_back(
          {place, label(cell, c), "tetrahedra only", "split it into tetrahedra, or fit hexahedra to the surface"});
      continue;
    }
    if (!tets.empty() && tets.front().kind != cell.kind) {
      problems.push_back(
          {place, "both linear and quadratic tetrahedra", "one of them", "export elements of one order"});
      break;
    }
    const double volume = determinant(raw, cell.nodes);
    double edge = 0.0;
    for (const auto& [a, b] : tet_edges)
      edge = std::max(edge, (raw.nodes[std::size_t(cell.nodes[std::size_t(a)])] -
                             raw.nodes[std::size_t(cell.nodes[std::size_t(b)])])
                                .norm());
    if (!(std::abs(volume) > 1e-12 * edge * edge * edge)) {
      problems.push_back({place, label(cell, c) + " has no volume", "four corners that lie in no plane",
                          "improve the mesh where it was made"});
      continue;
    }
    if (volume < 0.0) turn(cell.nodes), ++mesh.turned;
    tets.push_back(std::move(cell));
  }
  if (problems.empty() && tets.empty())
    problems.push_back({{path},
                        "there are no tetrahedra among " + std::to_string(raw.cells.size()) + " cells",
                        "a mesh of the volume",
                        mesh.passed_over > 0 ? "a surface belongs to `surface`" : ""});
  if (!problems.empty()) throw InputError(std::move(problems));
  return tets;
}

/// Numbers of the nodes that belong to an element, -1 for the others.
std::vector<int> numbers_of_used(const RawCells& raw, const std::vector<RawCells::Cell>& tets) {
  std::vector<int> number(raw.nodes.size(), -1);
  for (const RawCells::Cell& cell : tets)
    for (const int n : cell.nodes) number[std::size_t(n)] = 0;
  int next = 0;
  for (int& n : number)
    if (n == 0) n = next++;
  return number;
}

/// Nodes at one place tear a mesh open where it looks whole.
void refuse_coincident(const RawCells& raw, const std::vector<int>& number, const fs::path& path) {
  const auto less = [](const Vector3& a, const Vector3& b) { return std::ranges::lexicographical_compare(a, b); };
  std::map<Vector3, std::size_t, decltype(less)> seen(less);
  std::vector<Problem> problems;
  int count = 0;
  for (std::size_t n = 0; n < number.size(); ++n) {
    if (number[n] < 0) continue;
    const auto [first, is_new] = seen.try_emplace(raw.nodes[n], n);
    if (is_new || ++count > 1) continue;
    problems.push_back(
        {place_of(path, raw.node_lines[n]),
         "node " + std::to_string(n) + " lies where node " + std::to_string(first->second) + " does",
         "one node at a place (nodes counted from 0)",
         "merge coincident nodes where the mesh was made: elements that do not share a node come apart"});
  }
  if (count > 1) problems.front().found += ", and so do " + std::to_string(count - 1) + " more";
  if (!problems.empty()) throw InputError(std::move(problems));
}

int count_pieces(const VolumeMesh& mesh) {
  DisjointSets pieces(std::size_t(mesh.nodes.rows()));
  for (const auto& tet : mesh.tets)
    for (int k = 1; k < 4; ++k) pieces.join(tet[0], tet[std::size_t(k)]);
  for (std::size_t e = 0; e < mesh.mid_nodes.size(); ++e)
    for (const int m : mesh.mid_nodes[e]) pieces.join(mesh.tets[e][0], m);
  return pieces.count();
}

}  // namespace

VolumeMesh read_volume_mesh(const fs::path& path, double unit) {
  RawCells raw = read_cells(path);
  VolumeMesh mesh;
  const std::vector<RawCells::Cell> tets = tetrahedra(raw, path, mesh);
  const std::vector<int> number = numbers_of_used(raw, tets);
  refuse_coincident(raw, number, path);
  const auto used = std::ranges::count_if(number, [](int n) { return n >= 0; });
  mesh.unused_nodes = int(number.size()) - int(used);
  mesh.nodes.resize(used, 3);
  for (std::size_t n = 0; n < number.size(); ++n)
    if (number[n] >= 0) mesh.nodes.row(number[n]) = unit * raw.nodes[n].transpose();
  for (const RawCells::Cell& cell : tets) {
    auto& corners = mesh.tets.emplace_back();
    for (std::size_t k = 0; k < 4; ++k) corners[k] = number[std::size_t(cell.nodes[k])];
    if (cell.nodes.size() == 4) continue;
    auto& mids = mesh.mid_nodes.emplace_back();
    for (std::size_t k = 0; k < 6; ++k) mids[k] = number[std::size_t(cell.nodes[4 + k])];
  }
  mesh.pieces = count_pieces(mesh);
  return mesh;
}

TriangleMesh boundary_surface(const VolumeMesh& mesh) {
  std::map<std::array<int, 3>, std::pair<int, std::array<int, 3>>> faces;  // by sorted corners: how often, and how
  for (const auto& tet : mesh.tets)
    for (const auto& face : tet_faces) {
      const std::array<int, 3> corners = {tet[std::size_t(face[0])], tet[std::size_t(face[1])],
                                          tet[std::size_t(face[2])]};
      std::array<int, 3> sorted = corners;
      std::ranges::sort(sorted);
      auto& entry = faces[sorted];
      ++entry.first, entry.second = corners;
    }
  std::vector<int> number(std::size_t(mesh.nodes.rows()), -1);
  for (const auto& [sorted, face] : faces)
    if (face.first == 1)
      for (const int n : sorted) number[std::size_t(n)] = 0;
  TriangleMesh surface;
  for (std::size_t n = 0; n < number.size(); ++n)
    if (number[n] == 0) {
      number[n] = int(surface.vertices.size());
      surface.vertices.push_back(mesh.nodes.row(Eigen::Index(n)).transpose());
    }
  for (const auto& [sorted, face] : faces)
    if (face.first == 1) {
      auto& triangle = surface.triangles.emplace_back(face.second);
      for (int& n : triangle) n = number[std::size_t(n)];
    }
  return surface;
}

}  // namespace pliant
