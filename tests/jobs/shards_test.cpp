#include "jobs/shards.hpp"

#include "input_errors.hpp"

namespace pliant::shards_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(Shards, ShareOutAllJobs) {
  const std::vector<int> jobs = {0, 1, 2, 3, 4};
  EXPECT_THAT(shard_of(jobs, {1, 2}), ElementsAre(0, 2, 4));
  EXPECT_THAT(shard_of(jobs, {2, 2}), ElementsAre(1, 3));
  EXPECT_THAT(shard_of(jobs, {7, 9}), IsEmpty());
  EXPECT_EQ(shard_of(jobs, {}), jobs);
}

TEST(Shards, AreNamed) {
  const Shard shard = shard_named("3/50");
  EXPECT_EQ(shard.part, 3);
  EXPECT_EQ(shard.parts, 50);
  EXPECT_EQ(shard_named("").parts, 1);
  for (const char* wrong : {"0/3", "4/3", "3", "a/b", "1/2x", "1/0"})
    EXPECT_THAT(test::complaint_of([&] { (void)shard_named(wrong); }), HasSubstr("PART/PARTS")) << wrong;
}

}  // namespace
}  // namespace pliant::shards_test
