#include "photos/force_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::force_log_test {
namespace {

using testing::HasSubstr;

TEST(ForceLog, MeanInTheWindowElseInterpolation) {
  const TemporaryFolder folder;
  const ForceLog log = read_force_log(folder.write("f.csv", "time,force\n0,1\n1,3\n1.1,5\n2,11\n9,12\n"));
  const auto in_window = force_at(log, 1.05, 0.2, 1.0);
  ASSERT_TRUE(in_window);
  EXPECT_DOUBLE_EQ(in_window->force, 4.0);
  EXPECT_NEAR(in_window->scatter, std::sqrt(2.0), 1e-12);
  EXPECT_EQ(in_window->samples, 2);
  const auto between = force_at(log, 0.25, 0.1, 1.0);
  ASSERT_TRUE(between);
  EXPECT_DOUBLE_EQ(between->force, 1.5);
  EXPECT_EQ(between->samples, 0);
  EXPECT_FALSE(force_at(log, 5.0, 0.1, 1.0)) << "a gap of seven seconds";
  EXPECT_FALSE(force_at(log, -1.0, 0.1, 1.0));
  EXPECT_FALSE(force_at(log, 10.0, 0.1, 1.0));
}

TEST(ForceLog, ScaleAndZero) {
  const TemporaryFolder folder;
  const auto file = folder.write("f.csv", "time,force\n0,1\n1,3\n2,7\n");
  const ForceLog log = read_force_log(file, {2.0, 1.5});
  EXPECT_THAT(log.forces, testing::ElementsAre(-2.0, 2.0, 10.0));
  EXPECT_THAT(complaint_of([&] { read_force_log(file, {1.0, -0.5}); }), HasSubstr("no sample before `zero_until`"));
}

TEST(ForceLog, EveryProblemHasItsPlace) {
  const TemporaryFolder folder;
  const auto file = folder.write("f.csv", "time,force\n0,1\n2,x\n1,3\n1,4\n");
  const std::string complaint = complaint_of([&] { read_force_log(file); });
  EXPECT_THAT(complaint, HasSubstr("f.csv:3:3: \"x\""));
  EXPECT_THAT(complaint, HasSubstr("f.csv:5:1: a time that is not after the one before"));
  EXPECT_THAT(complaint_of([&] { read_force_log(folder.write("g.csv", "t;f\n1;2\n")); }), HasSubstr("time,force"));
}

TEST(PhotographTimes, EachNumberOnce) {
  const TemporaryFolder folder;
  const auto times = read_photograph_times(folder.write("t.csv", "number,time\n3,1.5\n7,2\n"));
  EXPECT_THAT(times, testing::ElementsAre(testing::Pair(3, 1.5), testing::Pair(7, 2.0)));
  EXPECT_THAT(complaint_of([&] { read_photograph_times(folder.write("u.csv", "number,time\n3,1.5\n3,2\n")); }),
              HasSubstr("u.csv:3:1: photograph 3 a second time"));
}

}  // namespace
}  // namespace pliant::test::force_log_test
