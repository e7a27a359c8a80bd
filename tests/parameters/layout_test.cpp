#include "parameters/layout.hpp"

#include <numeric>
#include <stdexcept>

#include "parameters/motion_blocks.hpp"

namespace pliant::layout_test {
namespace {

/// A scalar, a vector and a plane.
struct ThreeBlocks : ::testing::Test {
  ParameterLayout layout;
  ParameterHandle stiffness = layout.add({"stiffness", "Pa", 1, Role::Material});
  ParameterHandle push = layout.add({"push", "N", 3, Role::Load});
  ParameterHandle wall = layout.add({"wall", "", 6, Role::Obstacle});
  VectorX theta = VectorX::LinSpaced(layout.size(), 0.0, layout.size() - 1.0);  // each number its own place
};

TEST_F(ThreeBlocks, StandOneAfterTheOther) {
  EXPECT_EQ(stiffness, (ParameterHandle{0, 1}));
  EXPECT_EQ(push, (ParameterHandle{1, 3}));
  EXPECT_EQ(wall, (ParameterHandle{4, 6}));
  EXPECT_EQ(layout.size(), 10);
  EXPECT_EQ(ParameterLayout().size(), 0);
  ASSERT_EQ(layout.blocks().size(), 3u);
  EXPECT_EQ(layout.blocks()[1], (ParameterBlock{"push", "N", 3, Role::Load}));
  EXPECT_EQ(layout.handle(2), wall);
}

TEST_F(ThreeBlocks, AreReadAndWrittenByTheirHandles) {
  EXPECT_EQ(theta[stiffness], 0.0);
  EXPECT_EQ(push.vector(theta), Vector3(1.0, 2.0, 3.0));
  theta.segment<3>(push) = Vector3(7.0, 8.0, 9.0);
  EXPECT_EQ(push.vector(theta), Vector3(7.0, 8.0, 9.0));
  EXPECT_EQ(theta[wall], 4.0) << "what stands beside stays";
  EXPECT_TRUE(stiffness.exists());
  EXPECT_FALSE(ParameterHandle().exists());
}

TEST_F(ThreeBlocks, AreFoundByTheirNames) {
  EXPECT_TRUE(layout.contains("push"));
  EXPECT_FALSE(layout.contains("pus"));
  EXPECT_EQ(layout.at("wall"), wall);
  EXPECT_THROW((void)layout.at("ceiling"), std::invalid_argument);
}

TEST_F(ThreeBlocks, AreFoundByHandlesOfThemAndOfTheirParts) {
  EXPECT_EQ(layout.block_of(push).name, "push");
  EXPECT_EQ(layout.block_of({push.first + 2, 1}).name, "push");
  EXPECT_EQ(layout.block_of({wall.first + 3, 3}).name, "wall");
  EXPECT_THROW((void)layout.block_of({layout.size(), 1}), std::invalid_argument);
  EXPECT_THROW((void)layout.block_of(ParameterHandle()), std::invalid_argument);
}

TEST_F(ThreeBlocks, RefuseTakenNamesAndEmptyBlocks) {
  EXPECT_THROW(layout.add({"push", "N", 1}), std::invalid_argument);
  EXPECT_THROW(layout.add({"nothing", "N", 0}), std::invalid_argument);
  EXPECT_THROW(layout.add({"less", "N", -1}), std::invalid_argument);
  EXPECT_EQ(layout.size(), 10) << "and are what they were";
  EXPECT_FALSE(layout.contains("nothing"));
}

TEST_F(ThreeBlocks, AreTheSameLayoutWithTheSameBlocksInTheSameOrder) {
  ParameterLayout same, turned;
  for (const ParameterBlock& block : layout.blocks()) same.add(block);
  for (std::size_t i = layout.blocks().size(); i-- > 0;) turned.add(layout.blocks()[i]);
  EXPECT_EQ(same, layout);
  EXPECT_FALSE(turned == layout);
}

TEST_F(ThreeBlocks, AreCarriedToWhereTheirNamesStand) {
  ParameterLayout to;
  const ParameterHandle there = to.add({"wall", "", 6}), unknown = to.add({"density", "kg/m^3"}),
                        scalar = to.add({"stiffness", "Pa"});
  const VectorX carried = carry(layout, theta, to, VectorX::Constant(to.size(), -1.0));
  EXPECT_EQ(carried.segment(there, 6), theta.segment(wall, 6));
  EXPECT_EQ(carried[scalar], theta[stiffness]);
  EXPECT_EQ(carried[unknown], -1.0) << "what is not carried keeps its value";
  const VectorX back = carry(to, carried, layout, VectorX::Zero(layout.size()));
  EXPECT_EQ(back.segment(wall, 6), theta.segment(wall, 6));
  EXPECT_EQ(push.vector(back), Vector3(0.0, 0.0, 0.0));
}

TEST_F(ThreeBlocks, AreCarriedUnderOtherNames) {
  ParameterLayout to;
  const ParameterHandle second = to.add({"push[2]", "N", 3}), other = to.add({"stiffness[2]", "Pa"}),
                        plain = to.add({"stiffness", "Pa"});
  const VectorX carried = carry(layout, theta, to, VectorX::Constant(to.size(), -1.0), [](const std::string& name) {
    return name == "push[2]" ? "push" : name == "stiffness[2]" ? "stiffness" : "";
  });
  EXPECT_EQ(second.vector(carried), push.vector(theta));
  EXPECT_EQ(carried[other], theta[stiffness]);
  EXPECT_EQ(carried[plain], -1.0);
}

TEST_F(ThreeBlocks, AreNotCarriedToOtherSizes) {
  ParameterLayout to;
  to.add({"push", "N", 2});
  EXPECT_THROW((void)carry(layout, theta, to, VectorX::Zero(2)), std::invalid_argument);
  EXPECT_THROW((void)carry(layout, theta.head(9), layout, theta), std::invalid_argument);
  EXPECT_THROW((void)carry(layout, theta, layout, theta.head(9)), std::invalid_argument);
}

const MotionCounts many = {.moduli = 3, .planes = 2, .pulls = 4, .scan_corrections = 2};

TEST(MotionLayouts, BlocksOfEveryMotionStandInTheSamePlacesWhateverFollows) {
  const MotionLayout plain;
  for (const MotionLayout& more : {MotionLayout({.moduli = 5}), MotionLayout({.planes = 3}), MotionLayout({.pulls = 2}),
                                   MotionLayout({.scan_corrections = 2}), MotionLayout(many)}) {
    EXPECT_EQ(more.youngs_moduli.front(), plain.youngs_moduli.front());
    EXPECT_EQ(more.poissons_ratio, plain.poissons_ratio);
    EXPECT_EQ(more.mass_damping, plain.mass_damping);
    EXPECT_EQ(more.stiffness_damping, plain.stiffness_damping);
    EXPECT_EQ(more.density, plain.density);
    EXPECT_EQ(more.gravity, plain.gravity);
    EXPECT_EQ(more.linear_velocity, plain.linear_velocity);
    EXPECT_EQ(more.angular_velocity, plain.angular_velocity);
    for (std::size_t i = 0; i < plain.layout().blocks().size(); ++i)
      EXPECT_EQ(more.layout().blocks()[i], plain.layout().blocks()[i]);
  }
}

TEST(MotionLayouts, HaveAsManyBlocksAsWereAskedFor) {
  const MotionLayout layout(many);
  EXPECT_EQ(layout.youngs_moduli.size(), 3u);
  EXPECT_EQ(layout.planes.size(), 2u);
  EXPECT_EQ(layout.pulls.size(), 4u);
  EXPECT_EQ(layout.scan_corrections.size(), 2u);
  EXPECT_EQ(layout.size(), MotionLayout().size() + 2 + 2 * (6 + 1) + 1 + 4 * 3 + 2 * 3);
  EXPECT_EQ(layout.zero(), VectorX::Zero(layout.size()));
  EXPECT_EQ(layout.layout().at("youngs_modulus@3"), layout.youngs_moduli[2]);
  EXPECT_EQ(layout.layout().at("plane_2"), layout.planes[1].whole());
  EXPECT_EQ(layout.layout().at("pull@4"), layout.pulls[3]);
  EXPECT_EQ(layout.layout().at("scan_correction@1"), layout.scan_corrections[0]);
}

TEST(MotionLayouts, KnowWhatTheirBlocksDescribe) {
  const MotionLayout layout(many);
  const auto role = [&](const ParameterHandle& handle) { return layout.layout().block_of(handle).role; };
  EXPECT_EQ(role(layout.youngs_moduli[2]), Role::Material);
  EXPECT_EQ(role(layout.poissons_ratio), Role::Material);
  EXPECT_EQ(role(layout.mass_damping), Role::Damping);
  EXPECT_EQ(role(layout.stiffness_damping), Role::Damping);
  EXPECT_EQ(role(layout.density), Role::Inertia);
  EXPECT_EQ(role(layout.gravity), Role::Load);
  EXPECT_EQ(role(layout.linear_velocity), Role::Initial);
  EXPECT_EQ(role(layout.angular_velocity), Role::Initial);
  EXPECT_EQ(role(layout.planes[0].point), Role::Obstacle);
  EXPECT_EQ(role(layout.planes[1].normal), Role::Obstacle);
  EXPECT_EQ(role(layout.pulls[3]), Role::Initial);
  EXPECT_EQ(role(layout.scan_corrections[1]), Role::Shape);
}

TEST(MotionLayouts, NameModuliAsTold) {
  ParameterLayout layout;
  layout.add({"before", "1", 2});
  const MotionBlocks blocks = add_motion_blocks(layout, {.moduli = 2}, {"stiff", "soft"});
  EXPECT_EQ(layout.at("stiff"), blocks.youngs_moduli[0]);
  EXPECT_EQ(layout.at("soft"), blocks.youngs_moduli[1]);
  EXPECT_FALSE(layout.contains("youngs_modulus"));
  EXPECT_EQ(blocks.youngs_moduli[0].first, 2) << "after what was there";
  EXPECT_THROW(add_motion_blocks(layout, {}), std::invalid_argument) << "names are taken";
}

TEST(MotionBlocksOf, AllNumbersAreThereOnce) {
  const MotionLayout layout(many);
  std::vector<int> times(std::size_t(layout.size()), 0);
  for (const ParameterHandle& block : layout.all())
    for (int i = 0; i < block.size; ++i) ++times[std::size_t(block.first + i)];
  EXPECT_EQ(times, std::vector<int>(times.size(), 1));
}

TEST(MotionBlocksOf, AMotionMoveWithTheirLayout) {
  constexpr int shift = 7;
  const MotionLayout layout(many);
  ParameterLayout after;
  after.add({"before", "1", shift});
  const MotionBlocks expected = add_motion_blocks(after, many);
  const MotionBlocks moved = layout.moved([](const ParameterHandle& handle) {
    return ParameterHandle{handle.first + shift, handle.size};
  });
  EXPECT_EQ(moved.all(), expected.all());
  EXPECT_EQ(moved.planes[1].normal, expected.planes[1].normal);
  EXPECT_EQ(moved.planes[1].point, expected.planes[1].point);
}

TEST(ParameterHandles, ChangeWithAnyOfTheirNumbers) {
  const MotionLayout layout(many);
  const std::vector<ParameterHandle> blocks = {layout.gravity, layout.youngs_moduli[1]};
  for (Eigen::Index i = 0; i < layout.size(); ++i) {
    const bool is_theirs = (i >= layout.gravity && i < layout.gravity + 3) || i == layout.youngs_moduli[1];
    EXPECT_EQ(changes_any(blocks, VectorX::Unit(layout.size(), i)), is_theirs) << i;
  }
  EXPECT_FALSE(changes_any(blocks, VectorX::Zero(layout.size())));
  EXPECT_FALSE(changes_any({}, VectorX::Ones(layout.size())));
}

TEST(MaterialBlocksOf, AMotionReadAndWriteAllModuli) {
  const MotionLayout layout(many);
  VectorX theta = VectorX::LinSpaced(layout.size(), 1.0, layout.size());
  VectorX others = theta;
  for (std::size_t k = 0; k < 3; ++k) theta[layout.youngs_moduli[k]] = 1000.0 * double(k + 1);
  EXPECT_EQ(layout.moduli(theta), Vector3(1000.0, 2000.0, 3000.0));
  layout.scale_moduli(theta, 0.5);
  EXPECT_EQ(layout.moduli(theta), Vector3(500.0, 1000.0, 1500.0));
  layout.set_moduli(theta, 20.0);
  EXPECT_EQ(layout.moduli(theta), Vector3(20.0, 20.0, 20.0));
  layout.set_moduli(others, 20.0);
  EXPECT_EQ(theta, others) << "nothing else changes";
}

}  // namespace
}  // namespace pliant::layout_test
