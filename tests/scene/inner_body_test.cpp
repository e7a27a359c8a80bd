#include "scene/inner_body.hpp"

#include <sstream>

#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "scene/scene_toml.hpp"
#include "temporary_folder.hpp"

namespace pliant::inner_body_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

constexpr double skin = 0.05, core = 0.03;  // [m]

TriangleMesh ball(double radius, const Vector3& centre = Vector3::Zero()) {
  TriangleMesh mesh = make_sphere(radius, 3);
  for (Vector3& vertex : mesh.vertices) vertex += centre;
  return mesh;
}

/// Reads blocks [[inner]] inside a skin.
Scene read_scene(const TemporaryFolder& folder, const std::string& text, const TriangleMesh& object = ball(skin),
                 bool is_volume = false) {
  const std::filesystem::path file = folder.write("scene.toml", text);
  const toml::table table = parse_toml(text, file);
  TomlContext context{TomlPlaces(file), {}, {}};
  Scene scene;
  scene.object.surface = object;
  if (is_volume) scene.object.volume.emplace();
  TomlTable root(table, "", context);
  root.each_block("inner",
                  [&](TomlTable& block) { scene.inner.push_back(read_inner(block, NamedFiles{folder.path()})); });
  root.finish();
  cut_out_inner_bodies(context, scene);
  context.throw_problems();
  return scene;
}

const char* const one = "[[inner]]\nsurface = \"core.ply\"\n";

Scene with_body(const TriangleMesh& body, const std::string& text = one, const TriangleMesh& object = ball(skin),
                bool is_volume = false) {
  const TemporaryFolder folder;
  write_mesh(folder / "core.ply", body);
  return read_scene(folder, text, object, is_volume);
}

TEST(InnerBody, IsCutOutOfAScanOfTheSkin) {
  const Scene scene = with_body(ball(core));
  EXPECT_EQ(scene.inner.at(0).contact, InnerBody::Contact::Sliding);
  EXPECT_TRUE(scene.inner.at(0).is_cut_out);
  const MeshReport report = examine(*scene.object.surface);
  EXPECT_TRUE(report.is_closed_solid);
  EXPECT_EQ(report.components, 2);
  EXPECT_NEAR(report.volume, enclosed_volume(ball(skin)) - enclosed_volume(ball(core)), 1e-9);
  EXPECT_EQ(scanned_surface(*scene.object.surface, scene.inner), ball(skin));
}

TEST(InnerBody, IsNotCutOutOfASurfaceWithRoomForIt) {
  const TriangleMesh layer = *with_body(ball(core)).object.surface;
  const Scene again = with_body(ball(core), one, layer);
  EXPECT_FALSE(again.inner.at(0).is_cut_out);
  EXPECT_EQ(*again.object.surface, layer);
  const Scene on_a_table = with_body(test::box_mesh({-0.2, -0.09, -0.2}, {0.2, -skin, 0.2}));
  EXPECT_FALSE(on_a_table.inner.at(0).is_cut_out);
  EXPECT_EQ(*on_a_table.object.surface, ball(skin));
}

TEST(InnerBody, ComesBackAsItWasWritten) {
  Scene scene = with_body(ball(core), std::string(one) + "contact = \"glued\"\n");
  scene.inner.push_back({test::box_mesh({-0.2, -0.09, -0.2}, {0.2, -skin, 0.2}), {}, InnerBody::Contact::Sliding});
  const TemporaryFolder folder;
  std::ostringstream text;
  write_toml_blocks(text, scene);
  write_scene_files(folder.path(), scene);
  const Scene read = read_scene(folder, text.str());
  ASSERT_EQ(read.inner.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read.inner[i].contact, scene.inner[i].contact);
    EXPECT_EQ(read.inner[i].is_cut_out, scene.inner[i].is_cut_out);
    EXPECT_EQ(read.inner[i].surface.triangles, scene.inner[i].surface.triangles);
    for (std::size_t v = 0; v < scene.inner[i].surface.vertices.size(); ++v)
      EXPECT_LT((read.inner[i].surface.vertices[v] - scene.inner[i].surface.vertices[v]).norm(), 1e-7);
  }
  EXPECT_EQ(read.inner[0].file, folder / "inner_0.ply");
}

TEST(InnerBody, IsTurnedOverWhereItFacesInwards) {
  TriangleMesh inside_out = ball(core);
  for (auto& triangle : inside_out.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_EQ(complaint_of([&] {
              EXPECT_GT(enclosed_volume(with_body(inside_out, one, ball(skin), false).inner.front().surface), 0.0);
            }),
            "");
}

TEST(InnerBody, IsRefusedWhereItMakesNoSense) {
  const auto said = [](const TriangleMesh& body, const std::string& text = one, bool is_volume = false) {
    return complaint_of([&] { (void)with_body(body, text, ball(skin), is_volume); });
  };
  TriangleMesh open = ball(core);
  open.triangles.pop_back();
  EXPECT_THAT(said(open), AllOf(HasSubstr("scene.toml:2"), HasSubstr("the surface has holes")));
  EXPECT_THAT(said(ball(core, {0.2, 0, 0})), HasSubstr("touches the object nowhere"));
  EXPECT_THAT(said(ball(core, {0.04, 0, 0})), HasSubstr("of its surface in the object"));
  EXPECT_THAT(said(ball(core), one, true), HasSubstr("in the middle of tetrahedra"));
  EXPECT_THAT(said(ball(core), "[[inner]]\nsurface = \"skull.ply\"\n"), HasSubstr("skull.ply"));
  EXPECT_THAT(said(ball(core), "[[inner]]\ncontact = \"glued\"\n"), HasSubstr("surface"));
  EXPECT_THAT(said(ball(core), std::string(one) + "contact = \"bolted\"\n"), HasSubstr("bolted"));
  EXPECT_THAT(said(ball(core), std::string(one) + "friction = 0.3\n"), HasSubstr("friction"));
}

}  // namespace
}  // namespace pliant::inner_body_test
