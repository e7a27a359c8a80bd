#include "elasticity/element_loop.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "elasticity/corotated.hpp"
#include "elasticity/viscous_forces.hpp"
#include "support/bodies.hpp"

namespace pliant::element_loop_test {
namespace {

/// Nodes of a bar of tetrahedra in a scattered order, as meshers number them.
TetMesh scattered_bar(const Eigen::Vector3i& cells) {
  TetMesh mesh = make_tet_box(test::centred_box({0.5, 0.2, 0.2}), cells, false);
  const int n = mesh.node_count();
  const auto moved = [n](int node) { return int((std::int64_t(node) * 7919 + 13) % n); };
  Points nodes(n, 3);
  for (int node = 0; node < n; ++node) nodes.row(moved(node)) = mesh.nodes.row(node);
  for (auto& tet : mesh.tets)
    for (int& node : tet) node = moved(node);
  return make_tet_mesh(std::move(nodes), std::move(mesh.tets));
}

TEST(ElementLoop, SmallBodiesAreWalkedThroughInOrder) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {4, 3, 3}, false);
  std::vector<int> seen;
  body->loop->each([&](int e) { seen.push_back(e); });
  ASSERT_EQ(int(seen.size()), body->element_count());
  for (int e = 0; e < body->element_count(); ++e) EXPECT_EQ(seen[std::size_t(e)], e);
  EXPECT_EQ(body->loop->colour_count(), 1);
}

TEST(ElementLoop, TakesEveryElementOfALargeBodyOnce) {
  const Body body = make_body(scattered_bar({40, 12, 12}));
  ASSERT_GT(body.element_count(), 30000);
  std::vector<std::atomic<int>> times(std::size_t(body.element_count()));
  body.loop->each([&](int e) { ++times[std::size_t(e)]; });
  for (const auto& t : times) ASSERT_EQ(t, 1);
  EXPECT_GT(body.loop->colour_count(), 1);
  EXPECT_LT(body.loop->colour_count(), 30) << "parts follow each other in space, whatever order the nodes have";
}

/// Forces and matrices of bodies whose nodes many parts share: one part adding while another does would show.
TEST(ElementLoop, SumsAreTheSameForAnyNumberOfThreads) {
  for (const bool hexahedra : {false, true}) {
    const auto body = hexahedra ? test::box_body({0.6, 0.25, 0.25}, 0.0125)
                                : std::make_shared<const Body>(make_body(scattered_bar({40, 12, 12})));
    ASSERT_GT(body->loop->colour_count(), 1);
    const MotionLayout layout;
    VectorX theta = layout.zero();
    layout.set_moduli(theta, 5e4);
    theta[layout.poissons_ratio] = 0.35;
    theta[layout.stiffness_damping] = 0.003;
    const Points z = test::deformed(body->nodes, 0.1), lag = test::deformed(body->nodes, 0.11), start = body->nodes;
    const auto run = [&](int threads, Points& force, VectorX& product) {
      const ThreadLimit limit(threads);
      const auto elasticity = make_elasticity(body, layout, ElasticLaw::NeoHookean);
      const auto damping = make_viscous_forces(body, layout, layout.stiffness_damping);
      BlockMatrix matrix(body->pattern);
      force.setZero(body->node_count(), 3);
      for (ForceTerm* term : {static_cast<ForceTerm*>(elasticity.get()), damping.get()}) {
        term->set_parameters(theta);
        term->begin_step({&start, &start, 0.0, 0.01});
        term->linearise(lag);
        term->add_force(z, force);
        term->add_matrix(1.0, matrix);
      }
      body->add_mass_product(100.0, z, force);
      matrix.multiply(flat(z), product);
      return elasticity->energy(z);
    };
    Points force, again;
    VectorX product, same;
    const double energy = run(1, force, product);
    ASSERT_GT(force.norm(), 0.0);
    for (const int threads : {2, 4})
      for (int repetition = 0; repetition < 5; ++repetition) {
        EXPECT_EQ(run(threads, again, same), energy);
        EXPECT_TRUE(again == force);
        EXPECT_TRUE(same == product);
      }
  }
}

}  // namespace
}  // namespace pliant::element_loop_test
