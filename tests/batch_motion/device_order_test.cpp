// What a device does, on the host: its kernels member by member, rows by colours, without a device.

#include "batch_motion/batch_mesh.hpp"
#include "batch_motion/motion_batch.hpp"
#include "batch_scenes.hpp"
#include "support/tolerance.hpp"

namespace pliant::batch_device_order_test {
namespace {

using test::BatchScene;
using test::tolerance;

constexpr int members = 5, steps = 15;
constexpr double solver_tolerance = 1e-11, steps_amplify = 1e3;  // as in motion_batch_test.cpp

MotionBatch batch_of(const BatchScene& scene, BatchDevice device) {
  BatchOptions options = scene.options;
  options.device = device;
  options.tolerance = solver_tolerance;
  MotionBatch batch(scene.body, options, members);
  for (int k = 0; k < members; ++k) batch.set_member(k, scene.other(k));
  return batch;
}
std::vector<BatchScene> scenes() { return {test::batch_torus(0.05), test::batch_bar({6, 2, 2})}; }

TEST(BatchDeviceOrder, MovesAsTheLanesDo) {
  for (const BatchScene& scene : scenes()) {
    MotionBatch lanes = batch_of(scene, BatchDevice::Host), mimic = batch_of(scene, BatchDevice::Mimic);
    EXPECT_EQ(mimic.stride(), 32);
    std::vector<BatchRun> runs;
    const std::vector<State> expected = test::ends(lanes, steps), found = test::ends(mimic, steps, &runs);
    for (std::size_t k = 0; k < members; ++k) {
      EXPECT_TRUE(runs[k].succeeded);
      EXPECT_GT(runs[k].solver_iterations, 0);
      EXPECT_LT(test::farthest(found[k].x, expected[k].x),
                tolerance(steps_amplify * solver_tolerance) * scene.body->size());
    }
  }
}

TEST(BatchDeviceOrder, GradientsAreTheLanes) {
  for (const BatchScene& scene : scenes()) {
    const auto gradients = [&](BatchDevice device) {
      MotionBatch batch = batch_of(scene, device);
      return test::gradients_of_ends(batch, steps);
    };
    const std::vector<BatchGradient> expected = gradients(BatchDevice::Host), found = gradients(BatchDevice::Mimic);
    for (std::size_t k = 0; k < members; ++k) {
      EXPECT_NE(expected[k].youngs_modulus, 0.0);
      EXPECT_NEAR(found[k].youngs_modulus, expected[k].youngs_modulus,
                  tolerance(1e-6) * std::abs(expected[k].youngs_modulus));
      EXPECT_NEAR(found[k].poissons_ratio, expected[k].poissons_ratio,
                  tolerance(1e-6) * std::abs(expected[k].poissons_ratio));
      EXPECT_LT((found[k].start.x - expected[k].start.x).norm(), tolerance(1e-7) * expected[k].start.x.norm());
      EXPECT_LT((found[k].gravity - expected[k].gravity).norm(), tolerance(1e-6) * expected[k].gravity.norm());
    }
  }
}

TEST(BatchDeviceOrder, NodesOfAColourDoNotMeet) {
  using namespace batch_motion;
  for (const BatchScene& scene : scenes()) {
    const MeshData mesh = make_mesh_data(*scene.body, scene.body->modulus.relative, scene.options.held,
                                         scene.options.with_plane, SweepOrder::Colours);
    ASSERT_GT(mesh.colour_start.size(), 4U);
    EXPECT_LT(mesh.colour_start.size(), 40U);
    EXPECT_EQ(mesh.colour_start.back(), mesh.nodes);
    std::vector<int> colour(std::size_t(mesh.nodes));
    for (std::size_t c = 0; c + 1 < mesh.colour_start.size(); ++c)
      for (int n = mesh.colour_start[c]; n < mesh.colour_start[c + 1]; ++n) colour[std::size_t(n)] = int(c);
    for (std::size_t k = 0; k < mesh.column.size(); ++k)
      EXPECT_NE(colour[std::size_t(mesh.row[k])], colour[std::size_t(mesh.column[k])]);
  }
}

}  // namespace
}  // namespace pliant::batch_device_order_test
