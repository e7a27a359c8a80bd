#include "model/model.hpp"

#include <fmt/format.h>

#include <sstream>
#include <stdexcept>

#include "base/csv.hpp"
#include "base/files.hpp"
#include "base/old_names.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/solid_surface.hpp"
#include "geometry/volume_mesh.hpp"
#include "geometry/vtk_xml.hpp"
#include "model/vtu.hpp"
#include "scene/inner_body.hpp"
#include "scene/obstacle.hpp"
#include "scene/scene_toml.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr const char *corotated = "corotated", *neo_hookean = "neo_hookean";  // mean_strain
constexpr const char *rayleigh = "rayleigh", *kelvin_voigt = "kelvin_voigt";  // damping_law
constexpr const char* sampled = "sampled";                                    // a law

constexpr const char* modulus_field = "youngs_modulus [Pa]";
constexpr const char* modulus_std_field = "youngs_modulus_std [Pa]";
constexpr const char* ratio_field = "poissons_ratio";
constexpr const char* fill_field = "fill";

// ---- writing

void line(std::ostream& out, const char* key, double value, const char* comment) {
  out << fmt::format("{:<18}= {:<24}# {}\n", key, toml_text(value), comment);
}

void line(std::ostream& out, const char* key, int value, const char* comment) {
  out << fmt::format("{:<18}= {:<24}# {}\n", key, value, comment);
}

std::string model_toml(const Model& m) {
  std::ostringstream out;
  out << "# A fitted elastic object, ready to be simulated. All quantities are SI.\n"
         "format = \"model/1\"\nname = "
      << toml_text(m.name)
      << "\n\n[object]\nsurface = \"surface.ply\"          # stress-free reference shape, world frame of the "
         "recording\n";
  if (!m.volume.connectivity.empty())
    out << "volume_mesh = \"model.vtu\"        # elements with the material of each\n";
  line(out, "mass", m.scene.object.mass.value(), "kg");
  line(out, "density", m.scene.object.density.value(), "kg/m^3");
  out << (m.law ? "\n[material]                          # moduli are those of small strains\n"
                : "\n[material]                          # isotropic\n");
  if (m.law) {
    out << fmt::format("law = \"{}\"\ntable = \"material.csv\"            # of the law, by element\n", m.law->name);
    if (m.law->name == sampled)
      out << fmt::format(
          "own_law = \"{}\"            # of each element, whose numbers the table holds\n"
          "samples = \"samples.csv\"      # stresses on top of it\n",
          m.law->own_law);
  }
  line(out, "youngs_modulus", m.youngs_modulus, "Pa; the mean where elements differ");
  line(out, "poissons_ratio", m.poissons_ratio, "-1 .. 0.5");
  line(out, "mass_damping", m.mass_damping, "Rayleigh, 1/s");
  line(out, "stiffness_damping", m.stiffness_damping, "s");
  out << fmt::format(
             "mean_strain = \"{}\"        # of an element: neo_hookean, or corotated (linear in its rotated frame)\n",
             m.material.of_mean_strain() == ElasticLaw::Corotated ? corotated : neo_hookean)
      << fmt::format(
             "damping_law = \"{}\"       # of stiffness_damping: kelvin_voigt (on the rate of the Green strain), or "
             "rayleigh\n",
             m.material.damping == StiffnessDamping::Rayleigh ? rayleigh : kelvin_voigt);
  out << "\n";
  write_toml(out, m.scene.world);
  if (!m.scene.timing.times.empty()) write_toml(out, m.scene.timing);
  out << "[simulation]\n";
  line(out, "cell_size", m.cell_size, "edge of the hexahedral grid's cells, m");
  out << "grid_origin = " << toml_text(m.grid_origin) << "   # m\n";
  line(out, "substeps", m.substeps, "time steps a frame");
  line(out, "newmark_theta", m.newmark_theta, "weight of a step's end, 0.5 .. 1");
  line(out, "contact_stiffness", m.contact_stiffness, "pressure by penetration, Pa/m");
  line(out, "contact_smoothing", m.contact_smoothing, "length over which contact sets in, m");
  out << "\n";
  write_toml(out, m.scene.initial);
  write_toml_blocks(out, m.scene);
  return std::move(out).str();
}

void write_volume(const fs::path& path, const ModelVolume& volume) {
  VtuGrid grid;
  grid.points = volume.nodes;
  grid.kind = volume.kind;
  const auto points = std::size_t(corner_count(volume.kind));
  for (std::size_t i = 0; i < volume.connectivity.size(); i += points)
    for (const int point : to_vtk_order(volume.kind, std::span(volume.connectivity).subspan(i, points)))
      grid.connectivity.push_back(point);
  grid.cell_data = {
      {modulus_field, 1, volume.youngs_modulus}, {ratio_field, 1, volume.poissons_ratio}, {fill_field, 1, volume.fill}};
  if (!volume.youngs_modulus_std.empty()) grid.cell_data.push_back({modulus_std_field, 1, volume.youngs_modulus_std});
  write_vtu(path, grid);
}

void write_table(const fs::path& path, const std::vector<std::string>& columns,
                 const std::vector<std::vector<double>>& rows) {
  std::string text = fmt::format("{}\n", fmt::join(columns, ","));
  for (const std::vector<double>& row : rows) {
    if (row.size() != columns.size()) throw std::invalid_argument("a law's rows have a number a column");
    text += fmt::format("{:.17g}\n", fmt::join(row, ","));
  }
  write_file(path, text);
}

ModelLaw read_law(const fs::path& path, std::string name) {
  ModelLaw law{std::move(name), {}, {}};
  const std::string text = read_file(path);
  std::string header = text.substr(0, text.find_first_of("\r\n"));
  for (std::size_t begin = 0; begin <= header.size();) {
    const std::size_t end = std::min(header.find(',', begin), header.size());
    law.columns.push_back(present_name(header.substr(begin, end - begin)));
    begin = end + 1;
  }
  std::vector<Problem> problems;
  read_csv(path, header, problems, [&](CsvRow& row) {
    std::vector<double>& numbers = law.rows.emplace_back();
    for (std::size_t c = 0; c < law.columns.size(); ++c) numbers.push_back(row.number(c).value_or(0.0));
  });
  if (law.columns.front() != "element")
    problems.push_back(
        {{path, 1, 1}, "the first column \"" + law.columns.front() + "\"", "\"element\"", "save the model again"});
  if (!problems.empty()) throw InputError(std::move(problems));
  return law;
}

// ---- reading

class Reader {
 public:
  Reader(const fs::path& folder, TomlContext& context) : files_{folder}, context_(context) {}

  Model read(const toml::table& table) {
    TomlTable root(table, "", context_);
    check_format(root, "model/1");
    model_.name = root.required<std::string>("name").value_or("");
    for (const auto& [name, read_part] : {std::pair{"object", &Reader::read_object},
                                          {"material", &Reader::read_material},
                                          {"simulation", &Reader::read_simulation}})
      root.with_table(
          name, [&](TomlTable& own) { (this->*read_part)(own); }, std::string("[") + name + "]",
          "save the model again");
    read_scene(root);
    root.finish();
    ModelVolume& volume = model_.volume;
    if (volume.youngs_modulus.empty()) {  // of one material
      volume.youngs_modulus.assign(volume.fill.size(), model_.youngs_modulus);
      volume.poissons_ratio.assign(volume.fill.size(), model_.poissons_ratio);
    }
    return std::move(model_);
  }

 private:
  void read_scene(TomlTable& root) {
    Scene& scene = model_.scene;
    root.with_table(
        "world", [&](TomlTable& world) { scene.world = read_world(world); }, "[world]", "save the model again");
    root.with_table("timing", [&](TomlTable& timing) { scene.timing = read_even_timing(timing, 10'000'000); });
    root.with_table("initial", [&](TomlTable& initial) { scene.initial = read_initial(initial, true); });
    root.each_block("plane", [&](TomlTable& block) { scene.planes.push_back(read_plane(block)); });
    root.each_block("obstacle",
                    [&](TomlTable& block) { scene.obstacles.push_back(read_obstacle(block, files_, false)); });
    root.each_block("led", [&](TomlTable& block) { scene.led.push_back(read_led(block, files_)); });
    root.each_block("inner", [&](TomlTable& block) { scene.inner.push_back(read_inner(block, files_)); });
    root.each_block("fixed", [&](TomlTable& block) { scene.fixed.push_back(read_fixed(block, files_)); });
    root.each_block("weight", [&](TomlTable& block) { scene.weights.push_back(read_weight(block)); });
    root.with_table("wind", [&](TomlTable& wind) { scene.wind = read_wind(wind, false); });
    root.each_block("force", [&](TomlTable& block) { scene.forces.push_back(read_force(block, false)); });
    cut_out_inner_bodies(context_, scene);
    check_vertex_lists(context_, scene);
  }

  // Reads another file of the model; its problems join the others.
  template <class Read>
  void with_file(TomlTable& table, const std::string& name, const Read& read) {
    if (const auto path = read_path(table, name, files_)) read_file_of(table, name, *path, read);
  }

  static TriangleMesh read_solid(const fs::path& path) {
    TriangleMesh surface = read_surface(path);
    const MeshReport report = examine(surface);
    if (!report.is_closed_solid)
      throw InputError({{path}, report.complaints.front(), "a closed surface that faces outwards", report.cure});
    return surface;
  }

  void read_object(TomlTable& object) {
    TriangleMesh& surface = model_.scene.object.surface.emplace();
    if (object.has("surface") || !object.has("volume_mesh"))
      with_file(object, "surface", [&](const fs::path& path) { surface = read_solid(path); });
    if (object.has("volume_mesh")) with_file(object, "volume_mesh", [&](const fs::path& path) { read_volume(path); });
    model_.scene.object.mass =
        read_number(object, "mass", {.low = 0.0, .low_allowed = false, .meaning = "the mass in kilograms"});
    model_.scene.object.density =
        read_number(object, "density", {.low = 0.0, .low_allowed = false, .meaning = "the density in kg/m^3"});
  }

  void read_samples(TomlTable& material) {
    if (material.has("metric_nu")) {
      (void)material.optional<double>("metric_nu");
      material.context().complain(
          material.key_of("metric_nu"), "a sampled law of samples of stiffness, as it was saved until 2026",
          "own_law and samples: a law of each element, and stresses on top of it", "fit the presses again");
      return;
    }
    model_.law->own_law = read_choice(material, "own_law", {"ogden", "neo_hookean", "linear"});
    with_file(material, "samples", [&](const fs::path& path) {
      std::vector<Problem> problems;
      read_csv(path, fmt::format("{}", fmt::join(sample_columns, ",")), problems, [&](CsvRow& row) {
        std::vector<double>& numbers = model_.law->samples.emplace_back();
        for (std::size_t c = 0; c < sample_columns.size(); ++c) numbers.push_back(row.number(c).value_or(0.0));
      });
      if (!problems.empty()) throw InputError(std::move(problems));
    });
  }

  void read_material(TomlTable& material) {
    if (const auto law = material.optional<std::string>("law"))
      with_file(material, "table", [&](const fs::path& path) { model_.law = read_law(path, *law); });
    if (model_.law && model_.law->name == sampled) read_samples(material);
    model_.youngs_modulus = read_number(material, "youngs_modulus",
                                        {.low = 0.0, .low_allowed = false, .meaning = "Young's modulus in pascals"});
    model_.poissons_ratio = read_number(
        material, "poissons_ratio",
        {.low = -1.0, .high = 0.5, .low_allowed = false, .high_allowed = false, .meaning = "0.3 is usual for foam"});
    model_.mass_damping = read_number(material, "mass_damping", {.low = 0.0, .meaning = "Rayleigh's, in 1/s"}, 0.0);
    model_.stiffness_damping = read_number(material, "stiffness_damping", {.low = 0.0, .meaning = "in s"}, 0.0);
    // Models of before there was a choice have neither key.
    if (read_choice(material, "mean_strain", {corotated, neo_hookean}) == corotated)
      model_.material.elastic = ElasticLaw::Corotated;
    if (read_choice(material, "damping_law", {rayleigh, kelvin_voigt}) == rayleigh)
      model_.material.damping = StiffnessDamping::Rayleigh;
  }

  void read_simulation(TomlTable& simulation) {
    model_.cell_size = read_number(simulation, "cell_size",
                                   {.low = 0.0, .low_allowed = false, .meaning = "the cells' edge in metres"});
    model_.grid_origin = simulation.required<Vector3>("grid_origin").value_or(Vector3::Zero());
    model_.substeps = read_count(simulation, "substeps", 1, 100'000, 1);
    model_.newmark_theta = read_number(simulation, "newmark_theta",
                                       {.low = 0.5, .high = 1.0, .meaning = "0.5 does not damp by itself"}, 0.5);
    model_.contact_stiffness = read_number(simulation, "contact_stiffness", {.low = 0.0, .meaning = "in Pa/m"}, 0.0);
    model_.contact_smoothing = read_number(simulation, "contact_smoothing", {.low = 0.0, .meaning = "in metres"}, 0.0);
  }

  static std::vector<double> field(const fs::path& path, const VtuGrid& grid, const char* name) {
    const VtuArray* array = grid.find_cell_data(name);
    if (!array || array->components != 1)
      throw InputError(
          {{path}, std::string("no cell field \"") + name + "\"", "one number a cell", "save the model again"});
    return array->values;
  }

  /// Tetrahedra that another program made, or `pliant mesh`: of one material.
  void read_plain_volume(const fs::path& path) {
    const VolumeMesh mesh = read_volume_mesh(path);
    ModelVolume& volume = model_.volume;
    volume.nodes = mesh.nodes;
    volume.kind = mesh.mid_nodes.empty() ? VtuCell::Tetrahedron : VtuCell::QuadraticTetrahedron;
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
      volume.connectivity.insert(volume.connectivity.end(), mesh.tets[e].begin(), mesh.tets[e].end());
      if (!mesh.mid_nodes.empty())
        volume.connectivity.insert(volume.connectivity.end(), mesh.mid_nodes[e].begin(), mesh.mid_nodes[e].end());
    }
    volume.fill.assign(mesh.tets.size(), 1.0);
    TriangleMesh& surface = *model_.scene.object.surface;
    if (surface.triangles.empty()) surface = boundary_surface(mesh);
  }

  /// Whether it has one of the fields that are saved with a model.
  static bool is_own_volume(const fs::path& path) {
    if (ending_of(path) != ".vtu") return false;
    const VtkXmlFile file(path, "UnstructuredGrid");
    return std::ranges::any_of(
        file.data_set().child("Piece").child("CellData").children("DataArray"), [](const auto& array) {
          const std::string name = array.attribute("Name").value();
          return name == modulus_field || name == ratio_field || name == former_name(ratio_field) || name == fill_field;
        });
  }

  void read_volume(const fs::path& path) {
    if (!is_own_volume(path)) return read_plain_volume(path);
    const VtuGrid grid = read_vtu(path);
    if (grid.kind == VtuCell::Triangle)
      throw InputError({{path}, "triangles", "hexahedra or tetrahedra", "save the model again"});
    ModelVolume& volume = model_.volume;
    volume.nodes = grid.points;
    volume.kind = grid.kind;
    const auto points = std::size_t(corner_count(grid.kind));
    for (std::size_t i = 0; i < grid.connectivity.size(); i += points)
      for (const int point : from_vtk_order(grid.kind, std::span(grid.connectivity).subspan(i, points)))
        volume.connectivity.push_back(point);
    volume.youngs_modulus = field(path, grid, modulus_field);
    if (std::ranges::any_of(grid.cell_data, [](const auto& data) { return data.name == modulus_std_field; }))
      volume.youngs_modulus_std = field(path, grid, modulus_std_field);
    const std::string former = former_name(ratio_field);
    volume.poissons_ratio = field(path, grid, grid.find_cell_data(former) ? former.c_str() : ratio_field);
    volume.fill = field(path, grid, fill_field);
  }

  NamedFiles files_;
  TomlContext& context_;
  Model model_;
};

}  // namespace

void save_model(const fs::path& folder, const Model& model) {
  if (!model.volume.connectivity.empty()) write_volume(folder / "model.vtu", model.volume);
  write_mesh(folder / "surface.ply", scanned_surface(model.scene.object.surface.value(), model.scene.inner));
  write_scene_files(folder, model.scene);
  if (model.law) write_table(folder / "material.csv", model.law->columns, model.law->rows);
  if (model.law && model.law->name == sampled) write_table(folder / "samples.csv", sample_columns, model.law->samples);
  write_file(folder / "model.toml", model_toml(model));
}

Model load_model(const fs::path& path) {
  const toml::table table = parse_toml(read_file(path), path);
  TomlContext context{TomlPlaces(path), {}, {}};
  Model model = Reader(fs::absolute(path).parent_path(), context).read(table);
  context.throw_problems();
  return model;
}

}  // namespace pliant
