#include <gmock/gmock.h>

#include "batch_motion/motion_batch.hpp"
#include "batch_scenes.hpp"
#include "support/tolerance.hpp"

namespace pliant::batch_cuda_test {
namespace {

using test::BatchScene;
using test::tolerance;

/// Skips where there is no device, with a line that says so.
class CudaBatch : public testing::Test {
 protected:
  void SetUp() override {
    std::string reason;
    if (cuda_device_count(&reason) == 0) GTEST_SKIP() << "no CUDA device: " << reason;
  }
};

constexpr int members = 40, steps = 20;

MotionBatch batch_of(const BatchScene& scene, BatchDevice device) {
  BatchOptions options = scene.options;
  options.device = device;
  options.tolerance = 1e-10;
  MotionBatch batch(scene.body, options, members);
  for (int k = 0; k < members; ++k) batch.set_member(k, scene.other(k % 11));
  return batch;
}

TEST_F(CudaBatch, MovesAsTheHostDoes) {
  for (const BatchScene& scene : {test::batch_torus(0.04), test::batch_bar({8, 2, 2})}) {
    MotionBatch host = batch_of(scene, BatchDevice::Host), device = batch_of(scene, BatchDevice::Cuda);
    std::vector<BatchRun> runs;
    const std::vector<State> expected = test::ends(host, steps), found = test::ends(device, steps, &runs);
    for (std::size_t k = 0; k < members; ++k) {
      EXPECT_TRUE(runs[k].succeeded);
      EXPECT_LT(test::farthest(found[k].x, expected[k].x), tolerance(1e-7) * scene.body->size());
    }
  }
}

TEST_F(CudaBatch, EqualMembersMoveEquallyToTheLastBit) {
  const BatchScene torus = test::batch_torus(0.05);
  MotionBatch device = batch_of(torus, BatchDevice::Cuda);
  const std::vector<State> end = test::ends(device, steps);
  EXPECT_EQ(end[0].x, end[11].x);
  EXPECT_EQ(end[6].v, end[39].v);
}

TEST_F(CudaBatch, GradientsAreTheHosts) {
  for (const BatchScene& scene : {test::batch_torus(0.05), test::batch_bar({6, 2, 2})}) {
    const auto gradients = [&](BatchDevice device) {
      MotionBatch batch = batch_of(scene, device);
      return test::gradients_of_ends(batch, steps);
    };
    const std::vector<BatchGradient> expected = gradients(BatchDevice::Host), found = gradients(BatchDevice::Cuda);
    for (std::size_t k = 0; k < members; ++k) {
      EXPECT_NEAR(found[k].youngs_modulus, expected[k].youngs_modulus,
                  tolerance(1e-5) * std::abs(expected[k].youngs_modulus));
      EXPECT_LT((found[k].start.x - expected[k].start.x).norm(), tolerance(1e-5) * expected[k].start.x.norm());
    }
  }
}

TEST(CudaBatchWithoutDevice, IsRefusedInWords) {
  if (cuda_device_count() > 0) GTEST_SKIP() << "there is a CUDA device";
  BatchScene bar = test::batch_bar({4, 2, 2});
  bar.options.device = BatchDevice::Cuda;
  try {
    MotionBatch(bar.body, bar.options, 1);
    FAIL() << "there is no device";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("no CUDA device"));
  }
}

}  // namespace
}  // namespace pliant::batch_cuda_test
