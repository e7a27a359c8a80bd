#include <fmt/format.h>

#include <ostream>

#include "base/files.hpp"
#include "exports/formats.hpp"
#include "model/vtu.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace {

/// Numbers of kinds of elements in Gmsh's files.
constexpr int linear_tetrahedron = 4, quadratic_tetrahedron = 11;

/// @param at  "Node" or "Element"
void write_data(const char* at, const char* name, const std::vector<double>& values, std::ostream& out) {
  out << fmt::format("${0}Data\n1\n\"{1}\"\n1\n0\n3\n0\n1\n{2}\n", at, name, values.size());
  for (std::size_t i = 0; i < values.size(); ++i) out << fmt::format("{} {:.9g}\n", i + 1, values[i]);
  out << fmt::format("$End{}Data\n", at);
}

void write_msh(const ExportModel& model, std::ostream& out) {
  const Body& body = *model.body;
  out << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"object\"\n$EndPhysicalNames\n";
  out << "$Nodes\n" << body.node_count() << "\n";
  for (int n = 0; n < body.node_count(); ++n)
    out << fmt::format("{} {:.9g} {:.9g} {:.9g}\n", n + 1, body.nodes(n, 0), body.nodes(n, 1), body.nodes(n, 2));
  out << "$EndNodes\n$Elements\n" << body.element_count() << "\n";
  for (int e = 0; e < body.element_count(); ++e) {
    out << fmt::format("{} {} 2 1 1", e + 1, model.is_quadratic() ? quadratic_tetrahedron : linear_tetrahedron);
    std::vector<int> nodes = to_vtk_order(vtu_cell(body.kind), body.element(e));
    if (model.is_quadratic()) std::swap(nodes[8], nodes[9]);  // the edges 23 and 13 the other way round than VTK
    for (const int node : nodes) out << " " << node + 1;
    out << "\n";
  }
  out << "$EndElements\n";
  std::vector<double> held(std::size_t(body.node_count()), 0.0);
  for (const int node : model.held) held[std::size_t(node)] = 1.0;
  write_data("Node", "held", held, out);
  write_data("Element", "youngs_modulus [Pa]", model.moduli, out);
  write_data("Element", "poissons_ratio", std::vector<double>(model.moduli.size(), model.poissons_ratio), out);
}

}  // namespace

std::vector<std::string> write_gmsh(const ExportModel& model, const std::filesystem::path& folder) {
  write_file(folder / "mesh.msh", [&](std::ostream& out) { write_msh(model, out); });
  return {"mesh.msh"};
}

}  // namespace pliant
