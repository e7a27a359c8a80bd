#include "model/model.hpp"

#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::model_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

Model full_model() {
  Model m;
  m.name = "a \"soft\" ring \\ with\ttab";
  m.scene.object.surface = make_torus(0.15, 0.06, 12, 8);
  m.youngs_modulus = 590.1234567890123, m.poissons_ratio = 1.0 / 3.0, m.mass_damping = 0.24,
  m.stiffness_damping = 0.027;
  m.scene.object.density = 95.0, m.scene.object.mass = 0.456;
  m.scene.world.gravity = Vector3(0.1, -9.81, 1e-17);
  m.scene.planes = {{{0, 0.1, 0}, Vector3(0.6, 0.8, 0), false}, {}};
  m.scene.fixed = {{RegionBox{{-1, -1, -1}, {0.01, 1, 1}}, std::nullopt},
                   {RegionSphere{{0, 0, 1}, 0.02},
                    RigidMotion{Eigen::AngleAxisd(0.3, Vector3::UnitX()).toRotationMatrix(), {1, 2, 3}}},
                   {RegionHalfSpace{{0, 0, 0}, {1, 0, 0}}, std::nullopt},
                   {RegionVertices{{3, 1, 4}}, std::nullopt}};
  m.scene.weights = {{0.05, {0.01, -0.06, 0.15}}};
  m.scene.wind.emplace().over_time = {{0.0, {1, 2, 3}}, {2.0, {3, 2, 1}}};
  m.scene.forces = {{{0.01, -0.06, 0.15}, 0.02, {{0.0, {0, 0.5, 0}}}}};
  m.scene.initial = {{0, -2.1, 0}, {0.1, 0.2, 0.3}, false, true, {}, {}, Weight{0.02, {0.1, 1.0 / 3.0, 0}}};
  m.scene.timing = evenly_timed(60.0, 80, 4);
  m.cell_size = 0.0243, m.grid_origin = {-0.3, -0.1, 0.7};
  m.substeps = 4, m.newmark_theta = 0.55, m.contact_stiffness = 1e6, m.contact_smoothing = 1e-3;
  m.volume.nodes = Points::Random(12, 3);
  m.volume.connectivity = {0, 1, 2, 3, 4, 5, 6, 7, 4, 5, 6, 7, 8, 9, 10, 11};
  m.volume.youngs_modulus = {500, 680}, m.volume.poissons_ratio = {0.3, 0.4}, m.volume.fill = {1.0, 0.25};
  m.volume.youngs_modulus_std = {20, 35};
  return m;
}

TEST(Model, ComesBackAsItWasSaved) {
  const TemporaryFolder folder;
  const Model m = full_model();
  save_model(folder.path(), m);
  const Model read = load_model(folder / "model.toml");
  EXPECT_EQ(read.name, m.name);
  EXPECT_EQ(read.scene.object.surface->triangles, m.scene.object.surface->triangles);
  for (size_t i = 0; i < m.scene.object.surface->vertices.size(); ++i)
    EXPECT_LT((read.scene.object.surface->vertices[i] - m.scene.object.surface->vertices[i]).norm(), 1e-7);
  EXPECT_EQ(read.youngs_modulus, m.youngs_modulus);
  EXPECT_EQ(read.poissons_ratio, m.poissons_ratio);
  EXPECT_EQ(read.mass_damping, m.mass_damping);
  EXPECT_EQ(read.stiffness_damping, m.stiffness_damping);
  EXPECT_EQ(read.scene.object.density, m.scene.object.density);
  EXPECT_EQ(read.scene.object.mass, m.scene.object.mass);
  EXPECT_EQ(read.scene.world.gravity, m.scene.world.gravity);
  EXPECT_EQ(read.scene.timing, m.scene.timing);
  EXPECT_EQ(read.cell_size, m.cell_size);
  EXPECT_EQ(read.grid_origin, m.grid_origin);
  EXPECT_EQ(read.substeps, 4);
  EXPECT_EQ(read.newmark_theta, 0.55);
  EXPECT_EQ(read.contact_stiffness, 1e6);
  EXPECT_EQ(read.contact_smoothing, 1e-3);
  EXPECT_EQ(read.volume.nodes, m.volume.nodes);
  EXPECT_EQ(read.volume.kind, m.volume.kind);
  EXPECT_EQ(read.volume.connectivity, m.volume.connectivity);
  EXPECT_EQ(read.volume.youngs_modulus, m.volume.youngs_modulus);
  EXPECT_EQ(read.volume.youngs_modulus_std, m.volume.youngs_modulus_std);
  EXPECT_EQ(read.volume.poissons_ratio, m.volume.poissons_ratio);
  EXPECT_EQ(read.volume.fill, m.volume.fill);
}

TEST(Model, KeepsTheRigidBodyInside) {
  const TemporaryFolder folder;
  Model m = full_model();
  const TriangleMesh skin = make_sphere(0.15, 3), core = make_sphere(0.09, 3);
  m.scene.object.surface = skin;
  m.scene.fixed.clear();
  const int first = int(skin.vertices.size());
  TriangleMesh& layer = *m.scene.object.surface;  // as a capture's reader leaves it
  layer.vertices.insert(layer.vertices.end(), core.vertices.begin(), core.vertices.end());
  for (const auto& [a, b, c] : core.triangles) layer.triangles.push_back({first + a, first + c, first + b});
  m.scene.inner = {{core, {}, InnerBody::Contact::Glued, true}};
  save_model(folder.path(), m);
  const Model read = load_model(folder / "model.toml");
  ASSERT_EQ(read.scene.inner.size(), 1u);
  EXPECT_EQ(read.scene.inner[0].contact, InnerBody::Contact::Glued);
  EXPECT_EQ(read.scene.object.surface->triangles, layer.triangles);
  EXPECT_EQ(read_mesh(folder / "surface.ply").vertices.size(), skin.vertices.size()) << "the skin alone";
}

TEST(Model, FormerNamesAreRead) {
  const TemporaryFolder folder;
  const Model m = full_model();
  save_model(folder.path(), m);
  for (const char* name : {"model.toml", "model.vtu"}) {
    std::string text = read_file(folder / name);
    const std::string present = "poissons_ratio";
    const auto at = text.find(present);
    ASSERT_NE(at, std::string::npos) << name;
    folder.write(name, text.replace(at, present.size(), "poisson_ratio"));
  }
  const Model read = load_model(folder / "model.toml");
  EXPECT_EQ(read.poissons_ratio, m.poissons_ratio);
  EXPECT_EQ(read.volume.poissons_ratio, m.volume.poissons_ratio);
}

TEST(Model, TakesTetrahedraMadeElsewhereAsOfOneMaterial) {
  const TemporaryFolder folder;
  save_model(folder.path(), full_model());
  std::string text = read_file(folder / "model.toml");
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"surface = \"surface.ply\"", ""}, {"\"model.vtu\"", "\"made.msh\""}}) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  }
  folder.write("model.toml", text);
  folder.write("fixed_3.txt", "3\n1\n");
  folder.write("made.msh",
               "$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 2 1 3 4\n$ENDELM\n");
  const Model read = load_model(folder / "model.toml");
  EXPECT_EQ(read.volume.kind, VtuCell::Tetrahedron);
  EXPECT_EQ(read.volume.connectivity, (std::vector<int>{0, 1, 2, 3})) << "turned";
  EXPECT_EQ(read.volume.youngs_modulus, std::vector<double>{read.youngs_modulus});
  EXPECT_EQ(read.volume.poissons_ratio, std::vector<double>{read.poissons_ratio});
  EXPECT_EQ(read.scene.object.surface->triangles.size(), 4u);
  // With a triangle among them and data of another program.
  text.replace(text.find("made.msh"), 8, "made.vtu");
  folder.write("model.toml", text);
  folder.write("made.vtu",
               R"(<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="2">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 1 0 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 7</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5 10</DataArray></Cells>
<CellData><DataArray type="Int64" Name="gmsh:physical" format="ascii">1 2</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>)");
  EXPECT_EQ(load_model(folder / "model.toml").volume.connectivity, (std::vector<int>{0, 1, 2, 3}));
}

TEST(Model, RefusesPartsThatShareAVolume) {
  const TemporaryFolder folder;
  Model m = full_model();
  m.scene.fixed.clear();
  TriangleMesh& surface = m.scene.object.surface.emplace(make_sphere(0.15, 3));
  const TriangleMesh core = make_sphere(0.09, 3);
  const int first = int(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(), core.vertices.begin(), core.vertices.end());
  for (const auto& [a, b, c] : core.triangles) surface.triangles.push_back({first + a, first + b, first + c});
  save_model(folder.path(), m);
  EXPECT_THAT(complaint_of([&] { load_model(folder / "model.toml"); }),
              testing::AllOf(HasSubstr("surface.ply"), HasSubstr("lies in the part"), HasSubstr("trimesh")));
  for (std::size_t t = surface.triangles.size() - core.triangles.size(); t < surface.triangles.size(); ++t)
    std::swap(surface.triangles[t][0], surface.triangles[t][1]);
  save_model(folder.path(), m);
  EXPECT_EQ(*load_model(folder / "model.toml").scene.object.surface, surface);  // hollow
}

TEST(Model, PlanesRegionsAndVelocitiesComeBack) {
  const TemporaryFolder folder;
  const Model m = full_model();
  save_model(folder.path(), m);
  const Model read = load_model(folder / "model.toml");
  ASSERT_EQ(read.scene.planes.size(), 2u);
  EXPECT_LT((read.scene.planes[0].normal - m.scene.planes[0].normal).norm(), 1e-15);
  EXPECT_FALSE(read.scene.planes[0].known);
  EXPECT_TRUE(read.scene.planes[1].known);
  ASSERT_EQ(read.scene.weights.size(), 1u);
  EXPECT_EQ(read.scene.weights[0].mass, 0.05);
  EXPECT_EQ(read.scene.weights[0].at, m.scene.weights[0].at);
  ASSERT_TRUE(read.scene.wind);
  ASSERT_EQ(read.scene.wind->over_time.size(), 2u);
  EXPECT_EQ(read.scene.wind->over_time[1].value, Vector3(3, 2, 1));
  EXPECT_EQ(read.scene.wind->velocity, Vector3(2, 2, 2)) << "the keys' mean";
  ASSERT_EQ(read.scene.forces.size(), 1u);
  EXPECT_EQ(read.scene.forces[0].force[0].value, Vector3(0, 0.5, 0));
  ASSERT_EQ(read.scene.fixed.size(), 4u);
  EXPECT_EQ(std::get<RegionBox>(read.scene.fixed[0].region).max, Vector3(0.01, 1, 1));
  EXPECT_EQ(std::get<RegionSphere>(read.scene.fixed[1].region).radius, 0.02);
  EXPECT_LT((read.scene.fixed[1].displaced_to->rotation - m.scene.fixed[1].displaced_to->rotation).norm(), 1e-14);
  EXPECT_EQ(read.scene.fixed[1].displaced_to->translation, Vector3(1, 2, 3));
  EXPECT_EQ(std::get<RegionHalfSpace>(read.scene.fixed[2].region).normal, Vector3(1, 0, 0));
  EXPECT_EQ(std::get<RegionVertices>(read.scene.fixed[3].region).indices, (std::vector<int>{3, 1, 4}));
  EXPECT_EQ(read.scene.initial.linear_velocity, m.scene.initial.linear_velocity);
  EXPECT_EQ(read.scene.initial.angular_velocity, m.scene.initial.angular_velocity);
  EXPECT_FALSE(read.scene.initial.known);
  EXPECT_TRUE(read.scene.initial.released);
  ASSERT_TRUE(read.scene.initial.release_of);
  EXPECT_EQ(read.scene.initial.release_of->mass, 0.02);
  EXPECT_EQ(read.scene.initial.release_of->at, m.scene.initial.release_of->at);
}

TEST(Model, MayHaveNoVolumeNoGravityAndNoTiming) {
  const TemporaryFolder folder;
  Model m = full_model();
  m.volume = {}, m.scene.world.gravity.reset(), m.scene.timing = {};
  save_model(folder.path(), m);
  EXPECT_FALSE(std::filesystem::exists(folder / "model.vtu"));
  const Model read = load_model(folder / "model.toml");
  EXPECT_FALSE(read.scene.world.gravity);
  EXPECT_TRUE(read.scene.timing.times.empty());
  EXPECT_TRUE(read.volume.connectivity.empty());
}

// What is said about a model.toml in which one text was replaced by another.
class ModelFile : public testing::Test {
 protected:
  TemporaryFolder folder;
  void SetUp() override { save_model(folder.path(), full_model()); }
  std::string after(const std::string& from, const std::string& to) {
    std::string text = read_file(folder / "model.toml");
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from << "\n" << text;
    const auto path = folder.write("changed.toml", text.replace(at, from.size(), to));
    return complaint_of([&] { load_model(path); });
  }
};

TEST_F(ModelFile, UnknownKeysNameTheNearestKnownOne) {
  EXPECT_THAT(after("mass_damping ", "mass_damping = 0.1\nmass_dampnig "), HasSubstr("did you mean `mass_damping`"));
  EXPECT_THAT(after("[material]", "[materiel]"), HasSubstr("no table [material]"));
}

TEST_F(ModelFile, LinksThatPointAtThemselvesAreTold) {
  for (const char* file : {"model.vtu", "surface.ply"}) {
    folder.link_to_itself(file);
    EXPECT_THAT(complaint_of([&] { load_model(folder / "model.toml"); }),
                HasSubstr(std::string("the file \"") + file + "\" is a symbolic link that leads in a circle"));
  }
  EXPECT_THAT(complaint_of([&] { load_model(folder.link_to_itself("model.toml")); }),
              HasSubstr("model.toml: cannot be read"));
}

TEST_F(ModelFile, PlacesAreNamedByLineAndColumn) {
  const std::string complaint = after("youngs_modulus    = 590.1234567890123", "youngs_modulus    = -1.0");
  EXPECT_THAT(complaint, testing::ContainsRegex("changed.toml:[0-9]+:1: `youngs_modulus` is -1; expected above 0"));
}

TEST_F(ModelFile, RefusesWhatIsOutOfRangeNotFiniteOrMissing) {
  EXPECT_THAT(after("poissons_ratio    = 0.333", "poissons_ratio = 0.5 # 0.333"), HasSubstr("below 0.5"));
  EXPECT_THAT(after("density           = 95.0", "density = nan"), HasSubstr("finite"));
  EXPECT_THAT(after("mass              = 0.456", "mass = \"heavy\""), HasSubstr("a number"));
  EXPECT_THAT(after("substeps          = 4", "substeps = 0"), HasSubstr("1 to 100000"));
  EXPECT_THAT(after("start_frame = 4", "start_frame = 80"), HasSubstr("0 to 79"));
  EXPECT_THAT(after("cell_size         = 0.0243", ""), HasSubstr("no `cell_size`"));
  EXPECT_THAT(after("model/1", "model/2"), HasSubstr("expected \"model/1\""));
  EXPECT_THAT(after("surface.ply", "other.ply"), HasSubstr("other.ply"));
  EXPECT_THAT(after("normal = [0.6, 0.8, 0.0]", "normal = [0, 0, 0]"), HasSubstr("without length"));
  EXPECT_THAT(after("box = { min", "sphere = { centre = [0,0,0], radius = 1 }\nbox = { min"), HasSubstr("2 regions"));
  EXPECT_THAT(after("radius = 0.02", "radius = 0"), HasSubstr("above 0"));
  EXPECT_THAT(after("format =", "format ="), "");
}

TEST_F(ModelFile, AllProblemsAreToldAtOnce) {
  std::string text = read_file(folder / "model.toml");
  for (const std::string key : {"newmark_theta     = 0.55", "contact_smoothing = 0.001"})
    text.replace(text.find(key), key.size(), key.substr(0, 19) + " -3.0");
  const auto path = folder.write("changed.toml", text);
  const std::string complaint = complaint_of([&] { load_model(path); });
  EXPECT_THAT(complaint, HasSubstr("newmark_theta"));
  EXPECT_THAT(complaint, HasSubstr("contact_smoothing"));
}

TEST_F(ModelFile, DamagedFilesBesideItAreNamed) {
  folder.write("fixed_3.txt", "3\nfour\n");
  EXPECT_THAT(complaint_of([&] { load_model(folder / "model.toml"); }), HasSubstr("fixed_3.txt:2:1"));
  folder.write("fixed_3.txt", "3\n");
  const std::string volume = read_file(folder / "model.vtu");
  folder.write("model.vtu", volume.substr(0, volume.size() / 2));
  EXPECT_THAT(complaint_of([&] { load_model(folder / "model.toml"); }), HasSubstr("model.vtu"));
  std::string renamed = volume;
  renamed.replace(renamed.find("\"fill\""), 6, "\"fall\"");
  folder.write("model.vtu", renamed);
  EXPECT_THAT(complaint_of([&] { load_model(folder / "model.toml"); }), HasSubstr("no cell field \"fill\""));
  EXPECT_THAT(complaint_of([&] { load_model(folder / "nowhere.toml"); }), HasSubstr("nowhere.toml"));
}

}  // namespace
}  // namespace pliant::model_test
