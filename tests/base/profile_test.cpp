#include "base/profile.hpp"

#include <gmock/gmock.h>

#include <thread>

namespace pliant::profile_test {
namespace {

using namespace std::chrono_literals;

double seconds_of(const Profile& profile, Activity activity) {
  for (const ActivityTime& time : profile.activities())
    if (time.name == activity_name(activity)) return time.seconds;
  return -1.0;
}

TEST(Profiles, CountWhatRunsWithinAnotherOnce) {
  Profile profile;
  const Profile::Recording recording(profile);
  const auto begin = std::chrono::steady_clock::now();
  {
    const Timed outer(Activity::Pictures);
    {
      const Timed inner(Activity::Steps, 7);
      std::this_thread::sleep_for(20ms);
    }
    {
      const Timed inner(Activity::Steps);
      std::this_thread::sleep_for(20ms);
    }
  }
  const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double steps = seconds_of(profile, Activity::Steps), pictures = seconds_of(profile, Activity::Pictures);
  EXPECT_GE(steps, 0.04);
  EXPECT_LE(steps + pictures, whole) << "no second is counted twice";
  ASSERT_EQ(profile.activities().size(), 2u) << "what was not done is left out";
  EXPECT_EQ(profile.activities()[0].count, 8);
  EXPECT_EQ(profile.activities()[1].count, 1);
}

TEST(Profiles, AddUpThreads) {
  Profile profile;
  const Profile::Recording recording(profile);
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i)
    threads.emplace_back([] {
      const Timed timed(Activity::Mismatch);
      std::this_thread::sleep_for(20ms);
    });
  for (std::thread& thread : threads) thread.join();
  ASSERT_EQ(profile.activities().size(), 1u);
  EXPECT_EQ(profile.activities()[0].count, 3);
  EXPECT_GE(profile.activities()[0].seconds, 0.06);
}

TEST(Profiles, RecordOnlyWhileTheyAreAskedTo) {
  Profile first, second;
  { const Timed unheard(Activity::Steps); }
  EXPECT_EQ(Profile::current(), nullptr);
  {
    const Profile::Recording outer(first);
    {
      const Profile::Recording inner(second);
      const Timed timed(Activity::Steps);
    }
    EXPECT_EQ(Profile::current(), &first);
    Profile::current()->add({"fine", 1, 4, 434, 2e6, 1.5});
  }
  EXPECT_TRUE(first.activities().empty());
  EXPECT_EQ(second.activities().size(), 1u);
  ASSERT_EQ(first.stages().size(), 1u);
  EXPECT_EQ(first.stages()[0].name, "fine");
  EXPECT_EQ(Profile::current(), nullptr);
}

}  // namespace
}  // namespace pliant::profile_test
