// What is written is read again: by readers that are ours for other purposes, or by the format's own words.
#include "exports/formats.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>
#include <sstream>

#include "base/error.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/volume_mesh.hpp"
#include "model/vtu.hpp"
#include "support/models.hpp"
#include "support/pvd.hpp"

namespace pliant::export_formats_test {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

int count(const std::string& text, const std::string& word) {
  int found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
  return found;
}

class Formats : public ::testing::Test {
 protected:
  Formats() : folder(fs::temp_directory_path() / ("pliant.exports." + std::to_string(::getpid()))) {
    fs::create_directories(folder);
  }
  ~Formats() override { fs::remove_all(folder); }

  /// Held, of two moduli in halves.
  static ExportModel exported(ElementKind kind) {
    ExportModel model = export_model(test::block(true), kind, 6.0);
    for (int e = 0; e < model.body->element_count(); ++e)
      if (model.body->nodes(model.body->element(e)[0], 0) > 0.0) model.moduli[std::size_t(e)] *= 2.0;
    return model;
  }

  /// Of five frames, from rest: the end that is not held falls.
  static Model moving_bar() {
    Model model = test::block(true);
    model.scene.timing = evenly_timed(50.0, 5);
    return model;
  }

  fs::path folder;
};

TEST_F(Formats, AreFoundByName) {
  for (const ExportFormat& format : export_formats()) EXPECT_EQ(&export_format(format.name), &format);
  try {
    (void)export_format("blend");
    FAIL() << "there is no such format";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::AllOf(::testing::HasSubstr("blend"), ::testing::HasSubstr("calculix")));
  }
}

TEST_F(Formats, SayWhatWasWritten) {
  for (const ExportFormat& format : export_formats()) {
    if (!format.write) continue;  // of surfaces
    const ExportModel model =
        exported(format.takes_quadratic ? ElementKind::QuadraticTetrahedron : ElementKind::Tetrahedron);
    const fs::path own = folder / format.name;
    fs::create_directories(own);
    for (const std::string& file : write_export(model, format, own)) EXPECT_TRUE(fs::exists(own / file)) << file;
    const auto json = nlohmann::json::parse(text_of(own / "export.json"));
    EXPECT_EQ(json["to"], format.name);
    EXPECT_EQ(json["elements"], model.body->element_count());
    EXPECT_NEAR(json["mass"], 0.25, 0.01);
    EXPECT_EQ(json["exported"]["frequencies"].size(), 6u);
    EXPECT_EQ(json["held_nodes"].get<std::vector<int>>(), model.held);
  }
}

TEST_F(Formats, OfGmshIsReadAgain) {
  for (const ElementKind kind : {ElementKind::Tetrahedron, ElementKind::QuadraticTetrahedron}) {
    const ExportModel model = exported(kind);
    write_gmsh(model, folder);
    const VolumeMesh read = read_volume_mesh(folder / "mesh.msh");
    const TetMesh mesh = make_tet_mesh(read.nodes, read.tets, read.mid_nodes);
    const auto& own = std::get<TetMesh>(model.body->mesh);
    EXPECT_EQ(mesh.tets, own.tets);
    EXPECT_EQ(mesh.mid_nodes, own.mid_nodes) << "each on the edge that it was on";
    EXPECT_LT((mesh.nodes - own.nodes).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_EQ(count(text_of(folder / "mesh.msh"), "$ElementData"), 2);
  }
}

TEST_F(Formats, OfNewtonHaveItsConstants) {
  const ExportModel model = exported(ElementKind::Tetrahedron);
  write_newton(model, folder);
  const VtuGrid grid = read_vtu(folder / "model.vtu");
  ASSERT_EQ(grid.cell_count(), model.body->element_count());
  const double nu = model.poissons_ratio;
  for (int e = 0; e < grid.cell_count(); ++e) {
    const double E = model.moduli[std::size_t(e)], mu = E / (2.0 * (1.0 + nu));
    const double k_mu = grid.find_cell_data("k_mu")->values[std::size_t(e)];
    const double lambda = grid.find_cell_data("k_lambda")->values[std::size_t(e)];
    EXPECT_NEAR(k_mu, mu, 1e-9 * mu);
    EXPECT_NEAR(mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu), E, 1e-9 * E);
    EXPECT_NEAR(grid.find_cell_data("k_damp")->values[std::size_t(e)], 0.5 * 2e-3 * mu, 1e-9 * mu);
  }
  EXPECT_TRUE(grid.point_data.empty()) << "Newton refuses arrays that it does not know";
  const std::string scene = text_of(folder / "scene.py");
  const double step = std::stod(scene.substr(scene.find("STEP = ") + 7));
  EXPECT_NEAR(step, std::max(6.0 / model.stiffest, 1e-4), 0.01 * step);
  EXPECT_EQ(count(scene, "{{") + count(scene, "}}"), 0) << "braces are those of Python";
}

TEST_F(Formats, OfMujocoCarryMassesAndShareBodies) {
  const ExportModel model = exported(ElementKind::Tetrahedron);
  write_mujoco(model, folder);
  pugi::xml_document document;
  ASSERT_TRUE(document.load_file((folder / "model.xml").c_str()));
  const pugi::xml_node scene = document.child("mujoco");
  double mass = 0.0;
  int bodies = 0;
  for (const pugi::xml_node& body : scene.child("worldbody").children("body"))
    ++bodies, mass += body.child("inertial").attribute("mass").as_double();
  EXPECT_EQ(bodies, model.body->node_count() - int(model.held.size()));
  const std::vector<double> masses = model.lumped_masses();
  double all = 0.0, held = 0.0;
  for (const double m : masses) all += m;
  for (const int node : model.held) held += masses[std::size_t(node)];
  EXPECT_NEAR(all, model.density * model.body->volume(), 1e-9 * all);
  EXPECT_NEAR(mass, all - held, 1e-6 * all);
  int elements = 0, flexes = 0;
  for (const pugi::xml_node& flex : scene.child("deformable").children("flex")) {
    ++flexes;
    std::istringstream list(flex.attribute("element").as_string()), names(flex.attribute("body").as_string());
    int numbers = 0, greatest = -1, vertices = 0;
    for (int n = 0; list >> n; ++numbers) greatest = std::max(greatest, n);
    for (std::string name; names >> name;) ++vertices;
    EXPECT_EQ(greatest + 1, vertices);
    elements += numbers / 4;
  }
  EXPECT_EQ(flexes, 2) << "one a modulus";
  EXPECT_EQ(elements, model.body->element_count());
}

TEST_F(Formats, OfCalculixNameEveryPartAndWhatIsHeld) {
  const ExportModel model = exported(ElementKind::QuadraticTetrahedron);
  const std::vector<std::string> files = write_calculix(model, folder);
  EXPECT_THAT(files, ::testing::Contains("sag.inp"));
  const std::string deck = text_of(folder / "mesh.inp");
  EXPECT_EQ(count(deck, "*ELEMENT, TYPE=C3D10"), 2);
  EXPECT_EQ(count(deck, "*MATERIAL"), 2);
  EXPECT_EQ(count(deck, "*BOUNDARY"), 1);
  EXPECT_THAT(text_of(folder / "sag.inp"), ::testing::HasSubstr("GRAV, 9.81, 0, -1, 0"));
}

TEST_F(Formats, OfCalculixHaveNoSagWhereNothingIsHeld) {
  const ExportModel model = export_model(test::block(false), ElementKind::QuadraticTetrahedron, 6.0);
  EXPECT_THAT(write_calculix(model, folder), ::testing::Not(::testing::Contains("sag.inp")));
  EXPECT_THAT(text_of(folder / "mesh.inp"), ::testing::Not(::testing::HasSubstr("*BOUNDARY")));
}

/// Accessors are followed as a reader of the standard follows them.
TEST_F(Formats, OfGltfHoldTheSurfaceInEveryFrame) {
  const Model model = moving_bar();
  int told = 0;
  const auto tell = [&](int done, int) {
    told = done;
    return true;
  };
  ASSERT_THAT(write_gltf(model, folder, tell), ::testing::ElementsAre("model.glb"));
  EXPECT_EQ(told, 5);
  const std::string file = text_of(folder / "model.glb");
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, file.data() + at, sizeof value);
    return std::size_t(value);
  };
  EXPECT_EQ(file.substr(0, 4), "glTF");
  EXPECT_EQ(number(4), 2u);
  EXPECT_EQ(number(8), file.size());
  const std::size_t json_size = number(12), begin = 20 + json_size + 8;
  EXPECT_EQ(number(20 + json_size), file.size() - begin);
  const auto json = nlohmann::json::parse(file.substr(20, json_size));
  const auto numbers = [&](int index) {
    const auto& accessor = json["accessors"][std::size_t(index)];
    const auto& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    std::vector<float> values(view["byteLength"].get<std::size_t>() / sizeof(float));
    std::memcpy(values.data(), file.data() + begin + view["byteOffset"].get<std::size_t>(),
                values.size() * sizeof(float));
    return values;
  };
  const auto& primitive = json["meshes"][0]["primitives"][0];
  ASSERT_EQ(primitive["targets"].size(), 4u) << "one a frame after the first";
  const std::vector<float> first = numbers(primitive["attributes"]["POSITION"]),
                           last = numbers(primitive["targets"][3]["POSITION"]);
  ASSERT_EQ(first.size(), 3 * model.scene.object.surface->vertices.size());
  ASSERT_EQ(last.size(), first.size());
  float lowest = 0.0F, held = 0.0F;
  for (std::size_t n = 0; n < first.size() / 3; ++n) {
    lowest = std::min(lowest, last[3 * n + 1]);
    if (first[3 * n] < -0.09F) held = std::max(held, std::abs(last[3 * n + 1]));
  }
  EXPECT_LT(lowest, -1e-3F) << "the free end falls";
  EXPECT_LT(held, 1e-3F) << "the other is held";
  const auto& sampler = json["animations"][0]["samplers"][0];
  EXPECT_THAT(numbers(sampler["input"]), ::testing::ElementsAre(0.0F, 0.02F, 0.04F, 0.06F, 0.08F));
  const std::vector<float> weights = numbers(sampler["output"]);
  ASSERT_EQ(weights.size(), 20u);
  for (std::size_t frame = 0; frame < 5; ++frame)
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(weights[4 * frame + k], k + 1 == frame ? 1.0F : 0.0F);
}

TEST_F(Formats, OfGltfOfAnObjectAtRestHaveNoMotion) {
  (void)write_gltf(test::pressed_block(), folder, {});
  const std::string file = text_of(folder / "model.glb");
  EXPECT_EQ(count(file, "animations"), 0);
  EXPECT_EQ(count(file, "targets"), 0);
}

/// Numbers between blanks and commas.
std::vector<double> numbers_of(std::string text) {
  std::ranges::replace(text, ',', ' ');
  std::istringstream in(text);
  std::vector<double> numbers;
  for (double x = 0.0; in >> x;) numbers.push_back(x);
  return numbers;
}

/// Node numbers of the middle of edges 12, 23, 31, 14, 24, 34: FEBio's order.
constexpr int febio_edges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

TEST_F(Formats, OfFebioAreReadAgain) {
  for (const ElementKind kind : {ElementKind::Tetrahedron, ElementKind::QuadraticTetrahedron}) {
    const ExportModel model = exported(kind);
    EXPECT_THAT(write_febio(model, folder), ::testing::ElementsAre("motion.feb", "sag.feb"));
    for (const char* file : {"sag.feb", "motion.feb"}) {
      pugi::xml_document document;
      ASSERT_TRUE(document.load_file((folder / file).c_str())) << file;
      const pugi::xml_node root = document.child("febio_spec");
      EXPECT_STREQ(root.attribute("version").as_string(), "4.0");
      Points nodes(model.body->node_count(), 3);
      int count = 0;
      for (const pugi::xml_node& node : root.child("Mesh").child("Nodes").children("node")) {
        const std::vector<double> x = numbers_of(node.text().as_string());
        ASSERT_EQ(x.size(), 3u);
        ASSERT_EQ(node.attribute("id").as_int(), ++count) << "numbers follow one another";
        nodes.row(count - 1) << x[0], x[1], x[2];
      }
      ASSERT_EQ(count, model.body->node_count());
      EXPECT_LT((nodes - model.body->nodes).cwiseAbs().maxCoeff(), 1e-8);
      std::map<std::string, std::string> material_of;
      for (const pugi::xml_node& domain : root.child("MeshDomains").children("SolidDomain"))
        material_of[domain.attribute("name").as_string()] = domain.attribute("mat").as_string();
      double volume = 0.0;
      int elements = 0;
      for (const pugi::xml_node& part : root.child("Mesh").children("Elements")) {
        const pugi::xml_node material =
            root.child("Material")
                .find_child_by_attribute("name", material_of.at(part.attribute("name").as_string()).c_str());
        const bool is_mixture = std::string(material.attribute("type").as_string()) == "solid mixture";
        EXPECT_EQ(is_mixture, std::string(file) == "motion.feb") << "viscosity only where it moves";
        const pugi::xml_node elastic = is_mixture ? material.child("solid") : material;
        EXPECT_STREQ(elastic.attribute("type").as_string(), "neo-Hookean");
        const double E = elastic.child("E").text().as_double(), nu = elastic.child("v").text().as_double();
        EXPECT_EQ(nu, model.poissons_ratio);
        EXPECT_EQ(elastic.child("density").text().as_double(), model.density);
        if (is_mixture) {
          const pugi::xml_node viscous = elastic.next_sibling("solid");
          EXPECT_STREQ(viscous.attribute("type").as_string(), "Newtonian viscous solid");
          const double bulk = 2e-3 * E / (3.0 - 6.0 * nu), shear = 2e-3 * E / (2.0 + 2.0 * nu);
          EXPECT_NEAR(viscous.child("kappa").text().as_double(), bulk, 1e-6 * bulk);
          EXPECT_NEAR(viscous.child("mu").text().as_double(), shear, 1e-6 * shear);
        }
        for (const pugi::xml_node& element : part.children("elem")) {
          std::vector<double> corners = numbers_of(element.text().as_string());
          for (double& corner : corners) corner -= 1.0;
          ASSERT_EQ(corners.size(), kind == ElementKind::Tetrahedron ? 4u : 10u);
          const std::size_t number = element.attribute("id").as_uint() - 1;
          EXPECT_NEAR(E, model.moduli[number], 1e-6 * E) << number;
          const auto at = [&](std::size_t k) -> Vector3 { return nodes.row(Eigen::Index(corners[k])).transpose(); };
          volume += (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0)) / 6.0;
          for (std::size_t k = 4; k < corners.size(); ++k) {
            const auto& [a, b] = febio_edges[k - 4];
            const Vector3 middle = 0.5 * (at(std::size_t(a)) + at(std::size_t(b)));
            EXPECT_LT((at(k) - middle).norm(), 1e-6) << "the middle of its edge";
          }
          ++elements;
        }
      }
      EXPECT_EQ(elements, model.body->element_count());
      EXPECT_NEAR(volume, model.body->volume(), 1e-6 * volume) << "no element is inverted";
      std::vector<int> held;
      for (const double node : numbers_of(root.child("Mesh").child("NodeSet").text().as_string()))
        held.push_back(int(node) - 1);
      EXPECT_EQ(held, model.held);
      const pugi::xml_node fixed = root.child("Boundary").child("bc");
      EXPECT_STREQ(fixed.attribute("node_set").as_string(), "held");
      for (const char* dof : {"x_dof", "y_dof", "z_dof"}) EXPECT_EQ(fixed.child(dof).text().as_int(), 1);
      const pugi::xml_node gravity = root.child("Loads").child("body_load");
      EXPECT_EQ(gravity.child("y").text().as_double(), 9.81) << "FEBio's loads push the other way";
      EXPECT_STREQ(root.child("Control").child_value("analysis"),
                   std::string(file) == "sag.feb" ? "STATIC" : "DYNAMIC");
    }
  }
}

TEST_F(Formats, OfFebioHaveNoSagWhereNothingIsHeld) {
  const ExportModel model = export_model(test::block(false), ElementKind::QuadraticTetrahedron, 6.0);
  EXPECT_THAT(write_febio(model, folder), ::testing::ElementsAre("motion.feb"));
  EXPECT_EQ(count(text_of(folder / "motion.feb"), "NodeSet"), 0);
}

TEST_F(Formats, OfSofaAreReadAgain) {
  const ExportModel model = exported(ElementKind::Tetrahedron);
  write_sofa(model, folder);
  pugi::xml_document document;
  ASSERT_TRUE(document.load_file((folder / "model.scn").c_str()));
  const pugi::xml_node root = document.child("Node"), object = root.child("Node");
  EXPECT_EQ(numbers_of(root.attribute("gravity").as_string()), (std::vector<double>{0.0, -9.81, 0.0}));
  EXPECT_NEAR(root.attribute("dt").as_double() * 100.0 * model.exported.frequencies[0], 1.0, 1e-5);
  const pugi::xml_node solver = object.child("EulerImplicitSolver");
  EXPECT_EQ(solver.attribute("rayleighStiffness").as_double(), model.stiffness_damping);
  EXPECT_EQ(solver.attribute("rayleighMass").as_double(), model.mass_damping);
  const pugi::xml_node topology = object.child("TetrahedronSetTopologyContainer");
  const std::vector<double> x = numbers_of(topology.attribute("position").as_string()),
                            corners = numbers_of(topology.attribute("tetrahedra").as_string()),
                            moduli = numbers_of(
                                object.child("TetrahedronFEMForceField").attribute("youngModulus").as_string());
  ASSERT_EQ(x.size(), std::size_t(3 * model.body->node_count()));
  for (int n = 0; n < model.body->node_count(); ++n)
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(x[std::size_t(3 * n + d)], model.body->nodes(n, d), 1e-8);
  ASSERT_EQ(corners.size(), std::size_t(4 * model.body->element_count()));
  ASSERT_EQ(moduli.size(), model.moduli.size());
  for (int e = 0; e < model.body->element_count(); ++e) {
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(int(corners[std::size_t(4 * e) + k]), model.body->element(e)[k]);
    EXPECT_NEAR(moduli[std::size_t(e)], model.moduli[std::size_t(e)], 1e-6 * moduli[std::size_t(e)]);
  }
  EXPECT_EQ(object.child("MeshMatrixMass").attribute("massDensity").as_double(), model.density);
  std::vector<int> held;
  for (const double node : numbers_of(object.child("FixedProjectiveConstraint").attribute("indices").as_string()))
    held.push_back(int(node));
  EXPECT_EQ(held, model.held);
}

/// The free end of a bar that falls, and the held one, out of vertices of the last frame.
void expect_that_the_free_end_falls(const TriangleMesh& first, const TriangleMesh& last) {
  ASSERT_EQ(first.vertices.size(), last.vertices.size());
  EXPECT_EQ(first.triangles, last.triangles);
  double lowest = 0.0, held = 0.0;
  for (std::size_t n = 0; n < first.vertices.size(); ++n) {
    const double fallen = last.vertices[n].y() - first.vertices[n].y();
    lowest = std::min(lowest, fallen);
    if (first.vertices[n].x() < -0.09) held = std::max(held, std::abs(fallen));
  }
  EXPECT_LT(lowest, -1e-3);
  EXPECT_LT(held, 1e-3);
}

TEST_F(Formats, OfSequencesAreReadAgain) {
  const Model model = moving_bar();
  for (const char* ending : {"ply", "obj", "vtu"}) {
    const fs::path own = folder / ending;
    const auto name = [&](int frame) { return own / "frames" / ("00000" + std::to_string(frame) + "." + ending); };
    fs::create_directories(own / "frames");
    std::ofstream(name(5)) << "of a longer motion";
    int told = 0;
    const std::vector<std::string> files = export_format(ending).write_surface(model, own, [&](int done, int total) {
      EXPECT_EQ(done, ++told);
      return total == 5;
    });
    EXPECT_FALSE(fs::exists(name(5))) << "frames of another motion are gone";
    for (const std::string& file : files) EXPECT_TRUE(fs::exists(own / file)) << file;
    EXPECT_EQ(std::ranges::count_if(files, [](const std::string& f) { return f.starts_with("frames/"); }), 5);
    EXPECT_EQ(std::ranges::count(files, "blender.py"), std::string(ending) == "vtu" ? 0 : 1);
    EXPECT_THAT(text_of(own / "frames.csv"), ::testing::EndsWith(std::string("4,0.08,frames/000004.") + ending + "\n"));
    TriangleMesh first, last;
    for (auto [mesh, frame] : {std::pair{&first, 0}, {&last, 4}}) {
      if (std::string(ending) != "vtu") {
        *mesh = read_mesh(name(frame));
        continue;
      }
      const VtuGrid grid = read_vtu(name(frame));
      ASSERT_EQ(grid.kind, VtuCell::Triangle);
      for (const auto& point : grid.points.rowwise()) mesh->vertices.push_back(point.transpose());
      for (std::size_t i = 0; i + 2 < grid.connectivity.size(); i += 3)
        mesh->triangles.push_back({grid.connectivity[i], grid.connectivity[i + 1], grid.connectivity[i + 2]});
      EXPECT_EQ(std::ranges::count(grid.point_data, "displacement [m]", &VtuArray::name), 1);
    }
    EXPECT_EQ(first.triangles, model.scene.object.surface->triangles);
    expect_that_the_free_end_falls(first, last);
  }
  const std::vector<PvdEntry> entries = test::read_pvd(folder / "vtu" / "motion.pvd");
  ASSERT_EQ(entries.size(), 5u);
  EXPECT_NEAR(entries[3].time, 0.06, 1e-9);
}

TEST_F(Formats, OfSurfacesWriteNothingWhereTheyAreStopped) {
  for (const ExportFormat& format : export_formats()) {
    if (!format.write_surface) continue;
    const fs::path own = folder / format.name;
    fs::create_directories(own);
    EXPECT_TRUE(format.write_surface(moving_bar(), own, [](int done, int) { return done < 3; }).empty());
    EXPECT_TRUE(fs::is_empty(own)) << format.name;
  }
}

TEST_F(Formats, OfUsdHoldTheMeshAndItsMaterial) {
  ExportModel model = exported(ElementKind::Tetrahedron);
  model.stiffness_damping = 0.003;
  (void)write_export(model, export_format("usd"), folder);
  const std::string stage = text_of(folder / "model.usda");
  EXPECT_EQ(stage.rfind("#usda 1.0", 0), 0u);
  EXPECT_THAT(stage, ::testing::HasSubstr("PhysicsVolumeDeformableMaterialAPI"));
  EXPECT_THAT(stage, ::testing::HasSubstr("pull request 111, commit "));
  EXPECT_THAT(stage, ::testing::HasSubstr("custom float pliant:stiffnessDamping = 0.003"));
  EXPECT_THAT(stage, ::testing::HasSubstr("dictionary \"tested\""));
  EXPECT_EQ(count(stage, "def TetMesh"), 1);
  const std::size_t begin = stage.find("int4[] tetVertexIndices"), end = stage.find('\n', begin);
  EXPECT_EQ(count(stage.substr(begin, end - begin), "("), model.body->element_count());
  EXPECT_THAT(stage, ::testing::HasSubstr("physics:poissonsRatio = 0.3"));
}

/// A result of a fit as far as a card repeats it.
constexpr const char* fit_result = R"({"format": "result/1",
  "software": {"name": "pliant", "version": "1", "commit": "c"}, "capture": {"name": "bar", "sha256": "abc"},
  "material": "a law", "verdict": "explained", "reasons": [],
  "parameters": {"youngs_modulus": {"value": 1e4, "unit": "Pa", "std": 300.0, "interval_90": [9.5e3, 1.05e4], "estimated": true},
                 "exponent_2": {"value": 4.0, "unit": "1", "estimated": true},
                 "linear_velocity": {"value": [0, 0, 0], "unit": "m/s", "estimated": true}},
  "error": {"surface_rms": 0.001},
  "deformation": {"greatest_strain": 0.2, "median_strain": 0.05, "greatest_rate": 3.0}})";

TEST_F(Formats, HaveACardWithValuesIntervalsAndHowTheyDiffer) {
  using nlohmann::json;
  const ExportModel model = exported(ElementKind::Tetrahedron);
  std::ofstream(folder / "result.json") << fit_result;
  (void)write_export(model, export_format("gmsh"), folder, folder / "result.json");
  const json card = json::parse(text_of(folder / "card.json"));
  EXPECT_EQ(card["fit"]["values"].size(), 2u) << "of the material alone";
  EXPECT_EQ(card["fit"]["values"]["exponent_2"]["value"], 4.0);
  EXPECT_EQ(card["fit"]["values"]["youngs_modulus"]["interval_90"], json({9.5e3, 1.05e4}));
  EXPECT_EQ(card["fit"]["capture"]["sha256"], "abc");
  EXPECT_EQ(card["fit"]["deformation"]["greatest_rate"], 3.0);
  EXPECT_EQ(card["exported"]["moduli_were_multiplied_by"], model.identified);
  EXPECT_EQ(card["exported"]["differs"], json(model.notes));
  EXPECT_EQ(card["tested"]["frequencies"]["exported"].size(), model.exported.frequencies.size());
  const double difference = card["tested"]["frequencies"]["greatest_difference"];
  double greatest = 0.0;
  for (std::size_t i = 0; i < model.model.frequencies.size(); ++i)
    greatest = std::max(greatest, std::abs(model.exported.frequencies[i] / model.model.frequencies[i] - 1.0));
  EXPECT_NEAR(difference, greatest, 1e-12);
}

/// Cards with and without a fit, against the schema that is shipped, by Python's jsonschema.
TEST_F(Formats, HaveCardsOfTheSchema) {
  if (std::system("python3 -c 'import jsonschema' 2>/dev/null") != 0) GTEST_SKIP() << "no python3-jsonschema";
  const ExportModel model = exported(ElementKind::Tetrahedron);
  std::ofstream(folder / "result.json") << fit_result;
  const auto is_valid = [&] {
    return std::system(("python3 -m jsonschema -i '" + (folder / "card.json").string() +
                        "' '" PLIANT_SOURCE_DIR "/docs/card.schema.json' 2>/dev/null")
                           .c_str()) == 0;
  };
  (void)write_export(model, export_format("gmsh"), folder);
  EXPECT_TRUE(is_valid());
  (void)write_export(model, export_format("gmsh"), folder, folder / "result.json");
  EXPECT_TRUE(is_valid());
  nlohmann::json card = nlohmann::json::parse(text_of(folder / "card.json"));
  card["tested"].erase("how");
  std::ofstream(folder / "card.json") << card;
  EXPECT_FALSE(is_valid()) << "a card without how it was tested";
}

}  // namespace
}  // namespace pliant::export_formats_test
