#include "situation/probing.hpp"

#include <fstream>

#include "input_errors.hpp"
#include "situation/situation_scene.hpp"
#include "support/models.hpp"
#include "temporary_folder.hpp"

namespace pliant::probing_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

struct Folder : TemporaryFolder {
  Situation read(const std::string& text) const {
    const auto file = path() / "probing.toml";
    std::ofstream(file) << "format = \"situation/1\"\n" << text;
    return read_situation(file);
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path() / name) << text; }
};

constexpr const char* ball = R"([[probe]]
kind = "ball"
at = [0.05, 0.025, 0]
axis = [0, -1, 0]
radius = 0.02
)";

TEST(Probing, LeadsTwoProbesAndAnObstacle) {
  const Folder folder;
  Situation situation =
      folder.read(std::string(ball) + R"(path = [ { time = 0, depth = 0 }, { time = 1, depth = 0.004 } ]
[[probe]]
kind = "disc"
at = [0.09, 0, 0.025]
radius = 0.012
path = [ { time = 0, force = [0, 0, 0] }, { time = 1, force = [0, 0, 2] } ]
[[obstacle]]
plane = { point = [0, -0.025, 0], normal = [0, 1, 0] }
)");
  Model model = test::block(true);
  model.scene.world.gravity.reset();
  Probing probing(model, situation);
  ASSERT_EQ(probing.probe_count(), 3);
  EXPECT_EQ(probing.body()->kind, ElementKind::QuadraticTetrahedron) << "a model of hexahedra is pressed as tetrahedra";
  for (int k = 0; k <= 4; ++k) ASSERT_TRUE(probing.advance(0.25 * k).converged) << probing.failure();
  EXPECT_NEAR(probing.depth(0), 0.004, 1e-12);
  const PressSession& session = probing.session();
  EXPECT_LT(session.force(0).y(), -0.05);
  EXPECT_LT((session.force(1) - Vector3(0.0, 0.0, 2.0)).norm(), 1e-4) << "pulled by force, until it balances";
  EXPECT_GT(session.displacement(1).z(), 1e-4);
  EXPECT_GT(session.force(2).y(), 0.01) << "the ground pushes back";
}

TEST(Probing, FollowsATable) {
  const Folder folder;
  folder.write("path.csv", "time,x,y,z,turn_x,turn_y,turn_z\n0,0,0,0,0,0,0\n1,0.002,-0.003,0,0,90,0\n");
  const Situation situation = folder.read(std::string(ball) + "path_file = \"path.csv\"\n");
  ASSERT_EQ(situation.probes.front().path.size(), 2u);
  EXPECT_NEAR(situation.probes.front().path.back().value[4], 1.5707963, 1e-6);
  Probing probing(test::block(true), situation);
  ASSERT_TRUE(probing.advance(1.0).converged) << probing.failure();
  EXPECT_EQ(probing.session().displacement(), Vector3(0.002, -0.003, 0.0));
}

TEST(Probing, PathsByPushKeepToTheAxis) {
  const Folder folder;
  folder.write("path.csv", "time,push\n0,0\n1,1.5\n");
  Probing probing(test::block(true), folder.read(std::string(ball) + "path_file = \"path.csv\"\n"));
  for (int k = 1; k <= 4; ++k) ASSERT_TRUE(probing.advance(0.25 * k).converged) << probing.failure();
  EXPECT_NEAR(probing.session().force().y(), -1.5, 1e-3);
  EXPECT_LT(std::abs(probing.session().displacement().x()), 1e-5);
}

TEST(Probing, RefusesWhatTakesTime) {
  const Folder folder;
  const std::string path = std::string(ball) + "path = [ { time = 0, depth = 0.001 } ]\n";
  const auto refused = [&](const std::string& text) {
    return complaint_of([&] { Probing(test::block(true), folder.read(text)); });
  };
  EXPECT_THAT(refused(path + "[wind]\nvelocity = [1, 0, 0]\n"), HasSubstr("[wind] in a situation of equilibria"));
  EXPECT_THAT(refused(""), HasSubstr("neither [[probe]] nor [[obstacle]]"));
  EXPECT_THAT(refused("[[probe]]\nat = [0, 0.5, 0]\nradius = 0.01\npath = [ { time = 0, depth = 0 } ]\n"),
              HasSubstr("m from the object"));
  EXPECT_THAT(complaint_of([&] { (void)make_scene(test::block(true), folder.read(path)); }),
              HasSubstr("pliant press MODEL --path"));
}

TEST(Probing, SlipsInItsFileAreReportedAtTheirPlace) {
  const Folder folder;
  const auto refused = [&](const std::string& text) { return complaint_of([&] { (void)folder.read(ball + text); }); };
  EXPECT_THAT(refused(""), HasSubstr("a probe without `path` and `path_file`"));
  EXPECT_THAT(refused("path = [ { time = 0 } ]\n"), HasSubstr("one of `shift`, `depth` [m], `force`, `push` [N]"));
  EXPECT_THAT(refused("path = [ { time = 0, depth = 0 }, { time = 1, push = 1 } ]\n"), HasSubstr("`depth` and `push`"));
  EXPECT_THAT(refused("path = [ { time = 1, depth = 0 }, { time = 1, depth = 1 } ]\n"),
              HasSubstr("times that increase"));
  folder.write("path.csv", "time,deep\n0,0\n");
  EXPECT_THAT(refused("path_file = \"path.csv\"\n"), HasSubstr("path.csv:1:1: the header `time,deep`"));
  folder.write("path.csv", "time,depth\n0,0\n0,1\n");
  EXPECT_THAT(refused("path_file = \"path.csv\"\n"), HasSubstr("path.csv:3"));
  folder.write("path.csv", "time,depth\n");
  EXPECT_THAT(refused("path_file = \"path.csv\"\n"), HasSubstr("path.csv"));
}

}  // namespace
}  // namespace pliant::probing_test
