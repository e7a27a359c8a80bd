#include <fmt/format.h>

#include <ostream>

#include "base/files.hpp"
#include "exports/formats.hpp"
#include "model/vtu.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace {

constexpr int most_materials = 64;

void write_numbers(std::ostream& out, const std::vector<int>& numbers) {  // at most 16 a line
  for (std::size_t i = 0; i < numbers.size(); ++i)
    out << numbers[i] + 1 << ((i + 1) % 10 == 0 || i + 1 == numbers.size() ? "\n" : ", ");
}

void write_deck(const ExportModel& model, std::ostream& out) {
  const Body& body = *model.body;
  out << "** " << model.name << ": nodes in metres, moduli in pascals, densities in kg/m^3\n*NODE, NSET=ALL\n";
  for (int n = 0; n < body.node_count(); ++n)
    out << fmt::format("{}, {:.9g}, {:.9g}, {:.9g}\n", n + 1, body.nodes(n, 0), body.nodes(n, 1), body.nodes(n, 2));
  const ModulusGroups groups = grouped_moduli(model.moduli, most_materials);
  for (std::size_t g = 0; g < groups.moduli.size(); ++g) {
    out << fmt::format("*ELEMENT, TYPE={}, ELSET=PART{}\n", model.is_quadratic() ? "C3D10" : "C3D4", g + 1);
    for (int e = 0; e < body.element_count(); ++e) {
      if (groups.group[std::size_t(e)] != int(g)) continue;
      out << e + 1;
      for (const int node : to_vtk_order(vtu_cell(body.kind), body.element(e))) out << ", " << node + 1;
      out << "\n";
    }
  }
  for (std::size_t g = 0; g < groups.moduli.size(); ++g)
    out << fmt::format(
        "*MATERIAL, NAME=MATERIAL{0}\n*ELASTIC\n{1:.9g}, {2:.9g}\n*DENSITY\n{3:.9g}\n*DAMPING, ALPHA={4:.9g}, "
        "BETA={5:.9g}\n*SOLID SECTION, ELSET=PART{0}, MATERIAL=MATERIAL{0}\n",
        g + 1, groups.moduli[g], model.poissons_ratio, model.density, model.mass_damping, model.stiffness_damping);
  out << "*ELSET, ELSET=OBJECT\n";
  for (std::size_t g = 0; g < groups.moduli.size(); ++g) out << "PART" << g + 1 << "\n";
  if (model.held.empty()) return;
  out << "*NSET, NSET=HELD\n";
  write_numbers(out, model.held);
  out << "*BOUNDARY\nHELD, 1, 3\n";
}

}  // namespace

std::vector<std::string> write_calculix(const ExportModel& model, const std::filesystem::path& folder) {
  write_file(folder / "mesh.inp", [&](std::ostream& out) { write_deck(model, out); });
  const bool is_held = !model.held.empty();
  write_file(folder / "frequencies.inp",
             fmt::format("*INCLUDE, INPUT=mesh.inp\n*STEP, PERTURBATION\n*FREQUENCY\n{}\n*NODE FILE\nU\n*END STEP\n",
                         is_held ? 10 : 16));
  std::vector<std::string> files = {"frequencies.inp", "mesh.inp"};
  if (!is_held) return files;  // nothing is at rest that nothing holds
  const double g = model.gravity.norm();
  const Vector3 down = g > 0.0 ? Vector3(model.gravity / g) : Vector3(0.0, -1.0, 0.0);
  const auto sag = [&](const char* step) {
    return fmt::format(
        "*INCLUDE, INPUT=mesh.inp\n{}\n*STATIC\n*DLOAD\nOBJECT, GRAV, {:.9g}, {:.9g}, {:.9g}, {:.9g}\n*NODE FILE\nU\n"
        "*NODE PRINT, NSET=ALL\nU\n*END STEP\n",
        step, g, down.x(), down.y(), down.z());
  };
  write_file(folder / "sag.inp", sag("*STEP"));
  write_file(folder / "sag_large.inp", sag("*STEP, NLGEOM, INC=1000"));
  files.insert(files.end(), {"sag.inp", "sag_large.inp"});
  return files;
}

}  // namespace pliant
