#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/files.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/volume_mesh.hpp"
#include "mesh/tet_mesh.hpp"
#include "model/vtu.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Arguments {
  std::string file, out;
  double unit = 1.0;
  bool quadratic = false;
};

void say(const std::string& heading, const std::string& text) { apps::say("  " + heading, text, 14); }

/// What is known about a mesh, told and for mesh.json.
Json describe(const VolumeMesh& file, const TetMesh& mesh, const MeshReport& boundary) {
  const TetQuality q = quality(mesh);
  const Vector3 extent = boundary.box.extent();
  say("elements", formatted("%d %s tetrahedra, %d nodes", mesh.tet_count(),
                            mesh.is_quadratic() ? "quadratic" : "linear", mesh.node_count()));
  say("size", formatted("%.4g x %.4g x %.4g m, %.4g m^3", extent.x(), extent.y(), extent.z(), mesh.volume()));
  say("dihedral", formatted("%.1f to %.1f degrees; %d elements below 5, %d below 10", q.least_dihedral_deg,
                            q.greatest_dihedral_deg, q.below_5_deg, q.below_10_deg));
  say("volumes", formatted("%.3g to %.3g m^3, mean %.3g", q.least_volume, q.greatest_volume, q.mean_volume));
  say("radii",
      formatted("least ratio %.3f of inscribed to circumscribed sphere, 1 for a regular one", q.least_radius_ratio));
  if (file.turned > 0) say("repaired", formatted("%d elements were inside out and have been turned", file.turned));
  if (file.unused_nodes > 0)
    say("", formatted("%d nodes belong to no tetrahedron and are left out", file.unused_nodes));
  if (file.passed_over > 0) say("", formatted("%d points, lines and faces are ignored", file.passed_over));
  if (file.pieces > 1)
    say("note", formatted("it is in %d pieces that share no node: each moves on its own", file.pieces));
  for (const std::string& complaint : boundary.complaints)
    say("note", "the boundary is no closed surface: " + complaint);
  return {{"nodes", mesh.node_count()},
          {"elements", mesh.tet_count()},
          {"quadratic", mesh.is_quadratic()},
          {"extent", {extent.x(), extent.y(), extent.z()}},
          {"volume", mesh.volume()},
          {"dihedral_deg", {q.least_dihedral_deg, q.greatest_dihedral_deg}},
          {"below_5_deg", q.below_5_deg},
          {"below_10_deg", q.below_10_deg},
          {"element_volume", {q.least_volume, q.mean_volume, q.greatest_volume}},
          {"least_radius_ratio", q.least_radius_ratio},
          {"turned", file.turned},
          {"unused_nodes", file.unused_nodes},
          {"passed_over", file.passed_over},
          {"pieces", file.pieces},
          {"boundary_is_closed", boundary.is_closed_solid}};
}

VtuGrid grid_of(const TetMesh& mesh) {
  VtuGrid grid;
  grid.points = mesh.nodes;
  grid.kind = mesh.is_quadratic() ? VtuCell::QuadraticTetrahedron : VtuCell::Tetrahedron;
  for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
    std::vector<int> nodes(mesh.tets[e].begin(), mesh.tets[e].end());
    if (mesh.is_quadratic()) nodes.insert(nodes.end(), mesh.mid_nodes[e].begin(), mesh.mid_nodes[e].end());
    for (const int node : to_vtk_order(grid.kind, nodes)) grid.connectivity.push_back(node);
  }
  return grid;
}

void run(const Arguments& arguments) {
  const VolumeMesh file = read_volume_mesh(arguments.file, arguments.unit);
  TetMesh mesh;
  try {
    mesh = make_tet_mesh(file.nodes, file.tets, file.mid_nodes);
  } catch (const std::invalid_argument& error) {
    throw InputError(
        {{arguments.file}, error.what(), "elements that fill a volume once", "repair it where it was made"});
  }
  if (arguments.quadratic) mesh = with_mid_nodes(mesh);
  const TriangleMesh boundary = boundary_surface(file);
  std::cout << fs::path(arguments.file).filename().string() << '\n';
  const Json json = describe(file, mesh, examine(boundary));
  if (arguments.out.empty()) return;
  const fs::path out = arguments.out;
  write_vtu(out / "mesh.vtu", grid_of(mesh));
  write_mesh(out / "surface.ply", boundary);
  write_file(out / "mesh.json", json.dump(2) + "\n");
}

constexpr const char* footer = R"(Examples:
  pliant mesh liver.msh --unit 0.1
  pliant mesh trunk.vtk --unit 0.001 --out trunk

Without --out nothing is written. With it, the folder gets mesh.vtu in metres, which a capture or a model can name as its
`volume_mesh`, its boundary as surface.ply, and the figures as mesh.json.)";

}  // namespace

void add_mesh(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("mesh", "Look at a tetrahedral mesh made elsewhere, and bring it into metres");
  command.option("mesh", arguments->file, "Gmsh's .msh, or VTK's .vtk or .vtu").required().type_name("FILE");
  command.option("--unit", arguments->unit, "length of the file's unit in metres: 0.001 for millimetres")
      .show_default()
      .range(1e-9, 1e9);
  command.option("--out", arguments->out, "folder for mesh.vtu, surface.ply and mesh.json").type_name("DIR");
  command.flag("--quadratic", arguments->quadratic, "give linear elements mid nodes on their edges: they do not lock");
  command.footer(footer);
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
