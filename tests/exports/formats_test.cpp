// What is written is read again: by readers that are ours for other purposes, or by the format's own words.
#include "exports/formats.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>
#include <sstream>

#include "base/error.hpp"
#include "geometry/volume_mesh.hpp"
#include "support/models.hpp"

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
    ExportModel model = export_model(test::block(true), kind);
    for (int e = 0; e < model.body->element_count(); ++e)
      if (model.body->nodes(model.body->element(e)[0], 0) > 0.0) model.moduli[std::size_t(e)] *= 2.0;
    return model;
  }

  fs::path folder;
};

TEST_F(Formats, AreFoundByName) {
  for (const ExportFormat& format : export_formats()) EXPECT_EQ(&export_format(format.name), &format);
  try {
    (void)export_format("obj");
    FAIL() << "there is no such format";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::AllOf(::testing::HasSubstr("obj"), ::testing::HasSubstr("calculix")));
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
    const double k_lambda = grid.find_cell_data("k_lambda")->values[std::size_t(e)];
    EXPECT_NEAR(k_mu, mu, 1e-9 * mu);
    // Small strains: lambda = k_lambda - k_mu gives back Young's modulus.
    const double lambda = k_lambda - k_mu;
    EXPECT_NEAR(mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu), E, 1e-9 * E);
    EXPECT_NEAR(grid.find_cell_data("k_damp")->values[std::size_t(e)], 0.5 * 2e-3 * mu, 1e-9 * mu);
  }
  EXPECT_TRUE(grid.point_data.empty()) << "Newton refuses arrays that it does not know";
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
  const ExportModel model = export_model(test::block(false), ElementKind::QuadraticTetrahedron);
  EXPECT_THAT(write_calculix(model, folder), ::testing::Not(::testing::Contains("sag.inp")));
  EXPECT_THAT(text_of(folder / "mesh.inp"), ::testing::Not(::testing::HasSubstr("*BOUNDARY")));
}

/// Accessors are followed as a reader of the standard follows them.
TEST_F(Formats, OfGltfHoldTheSurfaceInEveryFrame) {
  Model model = test::block(true);
  model.scene.timing = evenly_timed(50.0, 5);
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

TEST_F(Formats, OfUsdHoldTheMeshAndItsMaterial) {
  const ExportModel model = exported(ElementKind::Tetrahedron);
  write_usd(model, folder);
  const std::string stage = text_of(folder / "model.usda");
  EXPECT_EQ(stage.rfind("#usda 1.0", 0), 0u);
  EXPECT_EQ(count(stage, "def TetMesh"), 1);
  const std::size_t begin = stage.find("int4[] tetVertexIndices"), end = stage.find('\n', begin);
  EXPECT_EQ(count(stage.substr(begin, end - begin), "("), model.body->element_count());
  EXPECT_THAT(stage, ::testing::HasSubstr("physics:poissonsRatio = 0.3"));
}

}  // namespace
}  // namespace pliant::export_formats_test
