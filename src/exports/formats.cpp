#include "exports/formats.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/files.hpp"
#include "exports/card.hpp"

namespace pliant {

const std::vector<ExportFormat>& export_formats() {
  static const std::vector<ExportFormat> all = {
      {"calculix", "CalculiX and Abaqus", true, write_calculix},
      {"febio", "FEBio", true, write_febio},
      {"gltf", "Blender, browsers and game engines", false, nullptr, write_gltf},
      {"gmsh", "Gmsh and what reads its meshes", true, write_gmsh},
      {"mujoco", "MuJoCo", false, write_mujoco},
      {"newton", "Newton and Warp", false, write_newton},
      {"obj", "Blender and what reads OBJ", false, nullptr, write_obj_frames},
      {"ply", "Blender and what reads PLY", false, nullptr, write_ply_frames},
      {"sofa", "SOFA", false, write_sofa},
      {"usd", "what reads USD, such as Isaac Sim and Newton", false, write_usd},
      {"vtu", "ParaView and what reads VTK's files", false, nullptr, write_vtu_frames},
  };
  return all;
}

const ExportFormat& export_format(const std::string& name) {
  const auto it = std::ranges::find(export_formats(), name, &ExportFormat::name);
  if (it != export_formats().end()) return *it;
  std::string names;
  for (const ExportFormat& f : export_formats()) names += (names.empty() ? "" : ", ") + f.name;
  throw InputError({{}, "no format `" + name + "`", names, ""});
}

std::vector<std::string> write_export(ExportModel model, const ExportFormat& format,
                                      const std::filesystem::path& folder,
                                      const std::optional<std::filesystem::path>& result) {
  using Json = nlohmann::ordered_json;
  model.card = card_of(model, format.name, result);
  std::vector<std::string> files = format.write(model, folder);
  const auto motions = [](const SmallMotions& m) { return Json{{"frequencies", m.frequencies}, {"sag", m.sag}}; };
  const Json json = {{"format", "export/1"},
                     {"to", format.name},
                     {"files", files},
                     {"elements", model.body->element_count()},
                     {"nodes", model.body->node_count()},
                     {"quadratic", model.is_quadratic()},
                     {"held_nodes", model.held},
                     {"mass", model.density * model.body->volume()},
                     {"density", model.density},
                     {"poissons_ratio", model.poissons_ratio},
                     {"mass_damping", model.mass_damping},
                     {"stiffness_damping", model.stiffness_damping},
                     {"gravity", {model.gravity.x(), model.gravity.y(), model.gravity.z()}},
                     {"moduli_were_multiplied_by", model.identified},
                     {"steps_below", model.stiffest > 0.0 ? 2.0 / model.stiffest : 0.0},
                     {"model", motions(model.model)},
                     {"exported", motions(model.exported)},
                     {"notes", model.notes}};
  write_file(folder / "export.json", json.dump(2) + "\n");
  write_file(folder / "card.json", model.card);
  files.insert(files.end(), {"export.json", "card.json"});
  return files;
}

}  // namespace pliant
