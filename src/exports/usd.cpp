#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
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

// JSON as the dictionary of a USD file: numbers become doubles, lists of objects dictionaries by their places; what is
// null is left out.
std::string dictionary(const nlohmann::ordered_json& json, const std::string& indent);

std::string entry(const std::string& name, const nlohmann::ordered_json& value, const std::string& indent) {
  const std::string key = nlohmann::json(name).dump();
  if (value.is_boolean()) return fmt::format("{}bool {} = {}\n", indent, key, value.get<bool>() ? 1 : 0);
  if (value.is_string()) return fmt::format("{}string {} = {}\n", indent, key, value.dump());
  if (value.is_number()) return fmt::format("{}double {} = {:.9g}\n", indent, key, value.get<double>());
  if (value.is_object()) return fmt::format("{}dictionary {} = {}", indent, key, dictionary(value, indent));
  if (!value.is_array() || value.empty()) return "";
  const auto all = [&](const auto& is) { return std::ranges::all_of(value, is); };
  if (all([](const auto& v) { return v.is_number(); }))
    return fmt::format("{}double[] {} = {}\n", indent, key, list(value.size(), [&](std::size_t i) {
                         return fmt::format("{:.9g}", value[i].template get<double>());
                       }));
  if (all([](const auto& v) { return v.is_string(); }))
    return fmt::format("{}string[] {} = {}\n", indent, key,
                       list(value.size(), [&](std::size_t i) { return value[i].dump(); }));
  nlohmann::ordered_json by_place = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < value.size(); ++i) by_place[std::to_string(i)] = value[i];
  return fmt::format("{}dictionary {} = {}", indent, key, dictionary(by_place, indent));
}

std::string dictionary(const nlohmann::ordered_json& json, const std::string& indent) {
  std::string text = "{\n";
  for (const auto& [name, value] : json.items()) text += entry(name, value, indent + "    ");
  return text + indent + "}\n";
}

// Schemas of deformable bodies are not part of USD yet: those of pull request 111 of OpenUSD-proposals are written, as
// Newton 1.8 reads them.
constexpr const char* schema_commit = "63c74d79aa67dc98d8707af8ad68f2e1a10622b5";

void write_stage(const ExportModel& model, std::ostream& out) {
  const Body& body = *model.body;
  const auto& mesh = std::get<TetMesh>(body.mesh);
  const bool z_is_up = std::abs(model.gravity.z()) > std::abs(model.gravity.y());
  const double nu = model.poissons_ratio;
  double mean = 0.0;
  for (int e = 0; e < body.element_count(); ++e)
    mean += model.moduli[std::size_t(e)] * body.element_volume[std::size_t(e)] / body.volume();
  out << fmt::format(
      "#usda 1.0\n(\n    customLayerData = {{\n        string deformable_schema = \"OpenUSD-proposals pull request "
      "111, commit "
      "{}\"\n        dictionary card = {}    }}\n    defaultPrim = \"object\"\n    metersPerUnit = 1\n    "
      "kilogramsPerUnit = 1\n"
      "    upAxis = \"{}\"\n)\n\ndef Xform \"object\" (\n    prepend apiSchemas = "
      "[\"PhysicsDeformableBodyAPI\"]\n)\n{{\n"
      "    def TetMesh \"mesh\" (\n        prepend apiSchemas = [\"PhysicsVolumeDeformableSimAPI\", "
      "\"MaterialBindingAPI\"]\n"
      "    )\n    {{\n",
      schema_commit, dictionary(nlohmann::ordered_json::parse(model.card), "        "), z_is_up ? "Z" : "Y");
  out << "        point3f[] points = " << list(std::size_t(body.node_count()), [&](std::size_t n) {
    const auto row = body.nodes.row(Eigen::Index(n));
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", row[0], row[1], row[2]);
  }) << "\n";
  out << "        int4[] tetVertexIndices = " << list(mesh.tets.size(), [&](std::size_t e) {
    const auto& t = mesh.tets[e];
    return fmt::format("({}, {}, {}, {})", t[0], t[1], t[2], t[3]);
  }) << "\n";
  out << "        int3[] surfaceFaceVertexIndices = " << list(mesh.boundary.size(), [&](std::size_t f) {
    const auto& t = mesh.boundary[f];
    return fmt::format("({}, {}, {})", t[0], t[1], t[2]);
  }) << "\n";
  out << "        float[] primvars:youngsModulus = " << list(model.moduli.size(), [&](std::size_t e) {
    return fmt::format("{:.9g}", model.moduli[e]);
  }) << " (\n            interpolation = \"uniform\"\n        )\n";
  out << "        int[] primvars:held = "
      << list(model.held.size(), [&](std::size_t i) { return fmt::format("{}", model.held[i]); }) << "\n";
  out << fmt::format(
      "        rel material:binding:physics = </object/material>\n    }}\n\n"
      "    def Material \"material\" (\n        prepend apiSchemas = [\"PhysicsMaterialAPI\", "
      "\"PhysicsVolumeDeformableMaterialAPI\"]\n    )\n    {{\n"
      "        float physics:youngsModulus = {:.9g}\n        float physics:poissonsRatio = {:.9g}\n"
      "        float physics:density = {:.9g}\n"
      "        custom float pliant:massDamping = {:.9g} (\n            doc = \"Rayleigh's [1/s]\"\n        )\n"
      "        custom float pliant:stiffnessDamping = {:.9g} (\n            doc = \"Rayleigh's [s]\"\n        )\n    "
      "}}\n}}\n",
      mean, nu, model.density, model.mass_damping, model.stiffness_damping);
}

}  // namespace

std::vector<std::string> write_usd(const ExportModel& model, const std::filesystem::path& folder) {
  write_file(folder / "model.usda", [&](std::ostream& out) { write_stage(model, out); });
  return {"model.usda"};
}

}  // namespace pliant
