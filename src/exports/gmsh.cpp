#include <fmt/format.h>

#include <ostream>

#include "base/files.hpp"
#include "exports/formats.hpp"
#include "model/vtu.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace {

/// Numbers of kinds of elements in Gmsh's files.
constexpr int point = 15, linear_tetrahedron = 4, quadratic_tetrahedron = 11;
constexpr int object_group = 1, held_group = 2;  // physical ones

void write_element_data(const char* name, const std::vector<double>& values, std::size_t first, std::ostream& out) {
  out << fmt::format("$ElementData\n1\n\"{}\"\n1\n0\n3\n0\n1\n{}\n", name, values.size());
  for (std::size_t e = 0; e < values.size(); ++e) out << fmt::format("{} {:.9g}\n", first + e, values[e]);
  out << "$EndElementData\n";
}

void write_msh(const ExportModel& model, std::ostream& out) {
  const Body& body = *model.body;
  out << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n"
      << fmt::format("0 {} \"held\"\n3 {} \"object\"\n$EndPhysicalNames\n", held_group, object_group);
  out << "$Nodes\n" << body.node_count() << "\n";
  for (int n = 0; n < body.node_count(); ++n)
    out << fmt::format("{} {:.9g} {:.9g} {:.9g}\n", n + 1, body.nodes(n, 0), body.nodes(n, 1), body.nodes(n, 2));
  out << "$EndNodes\n$Elements\n" << model.held.size() + std::size_t(body.element_count()) << "\n";
  std::size_t number = 0;
  for (const int node : model.held)
    out << fmt::format("{} {} 2 {} {} {}\n", ++number, point, held_group, held_group, node + 1);
  const std::size_t first = number + 1;
  for (int e = 0; e < body.element_count(); ++e) {
    out << fmt::format("{} {} 2 {} {}", ++number, model.is_quadratic() ? quadratic_tetrahedron : linear_tetrahedron,
                       object_group, object_group);
    std::vector<int> nodes = to_vtk_order(vtu_cell(body.kind), body.element(e));
    if (model.is_quadratic()) std::swap(nodes[8], nodes[9]);  // the edges 23 and 13 the other way round than VTK
    for (const int node : nodes) out << " " << node + 1;
    out << "\n";
  }
  out << "$EndElements\n";
  write_element_data("youngs_modulus [Pa]", model.moduli, first, out);
  write_element_data("poissons_ratio", std::vector<double>(model.moduli.size(), model.poissons_ratio), first, out);
}

}  // namespace

std::vector<std::string> write_gmsh(const ExportModel& model, const std::filesystem::path& folder) {
  write_file(folder / "mesh.msh", [&](std::ostream& out) { write_msh(model, out); });
  return {"mesh.msh"};
}

}  // namespace pliant
