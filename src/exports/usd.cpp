#include <fmt/format.h>

#include <ostream>

#include "base/files.hpp"
#include "exports/formats.hpp"
#include "mesh/tet_mesh.hpp"

namespace pliant {

namespace {

/// "[a, b, ...]" of so many items.
template <class Item>
std::string list(std::size_t count, const Item& item) {
  std::string text = "[";
  for (std::size_t i = 0; i < count; ++i) text += (i ? ", " : "") + item(i);
  return text + "]";
}

void write_stage(const ExportModel& model, std::ostream& out) {
  const Body& body = *model.body;
  const auto& mesh = std::get<TetMesh>(body.mesh);
  const bool z_is_up = std::abs(model.gravity.z()) > std::abs(model.gravity.y());
  const double nu = model.poissons_ratio;
  double mean = 0.0;
  for (int e = 0; e < body.element_count(); ++e)
    mean += model.moduli[std::size_t(e)] * body.element_volume[std::size_t(e)] / body.volume();
  out << fmt::format(
      "#usda 1.0\n(\n    defaultPrim = \"object\"\n    metersPerUnit = 1\n    kilogramsPerUnit = 1\n    upAxis = "
      "\"{}\"\n)\n\ndef TetMesh \"object\" (\n    prepend apiSchemas = [\"PhysicsMassAPI\", "
      "\"MaterialBindingAPI\"]\n)\n{{\n",
      z_is_up ? "Z" : "Y");
  out << "    point3f[] points = " << list(std::size_t(body.node_count()), [&](std::size_t n) {
    const auto row = body.nodes.row(Eigen::Index(n));
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", row[0], row[1], row[2]);
  }) << "\n";
  out << "    int4[] tetVertexIndices = " << list(mesh.tets.size(), [&](std::size_t e) {
    const auto& t = mesh.tets[e];
    return fmt::format("({}, {}, {}, {})", t[0], t[1], t[2], t[3]);
  }) << "\n";
  out << "    int3[] surfaceFaceVertexIndices = " << list(mesh.boundary.size(), [&](std::size_t f) {
    const auto& t = mesh.boundary[f];
    return fmt::format("({}, {}, {})", t[0], t[1], t[2]);
  }) << "\n";
  out << "    float[] primvars:youngsModulus = " << list(model.moduli.size(), [&](std::size_t e) {
    return fmt::format("{:.9g}", model.moduli[e]);
  }) << " (\n        interpolation = \"uniform\"\n    )\n";
  out << "    int[] primvars:held = "
      << list(model.held.size(), [&](std::size_t i) { return fmt::format("{}", model.held[i]); }) << "\n";
  out << fmt::format("    float physics:density = {:.9g}\n    rel material:binding:physics = </object/material>\n\n",
                     model.density);
  out << fmt::format(
      "    def Material \"material\" (\n        prepend apiSchemas = [\"PhysicsDeformableMaterialAPI\"]\n    )\n    "
      "{{\n"
      "        float physics:youngsModulus = {:.9g}\n        float physics:poissonsRatio = {:.9g}\n"
      "        float physics:density = {:.9g}\n    }}\n}}\n",
      mean, nu, model.density);
}

}  // namespace

std::vector<std::string> write_usd(const ExportModel& model, const std::filesystem::path& folder) {
  write_file(folder / "model.usda", [&](std::ostream& out) { write_stage(model, out); });
  return {"model.usda"};
}

}  // namespace pliant
