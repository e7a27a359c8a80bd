#include "jobs/claim.hpp"

#include <sys/wait.h>

#include <fstream>
#include <thread>

#include "base/error.hpp"
#include "temporary_folder.hpp"

namespace pliant::claim_test {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

TEST(Claim, OneHoldsIt) {
  const TemporaryFolder folder;
  const fs::path file = folder / "job";
  {
    const auto first = Claim::take(file);
    ASSERT_TRUE(first.has_value());
    EXPECT_FALSE(Claim::take(file).has_value());
  }
  EXPECT_FALSE(fs::exists(file)) << "it is given back";
  EXPECT_TRUE(Claim::take(file).has_value());
}

TEST(Claim, OfManyProcessesOneHoldsIt) {
  const TemporaryFolder folder;
  constexpr int processes = 8;
  for (int p = 0; p < processes; ++p)
    if (::fork() == 0) {
      const auto claim = Claim::take(folder / "job");
      if (claim) std::ofstream(folder / ("winner" + std::to_string(p))) << "x";
      std::this_thread::sleep_for(std::chrono::milliseconds(500));  // all ask while it is held
      ::_exit(claim ? 1 : 0);
    }
  int winners = 0;
  for (int p = 0; p < processes; ++p) {
    int status = 0;
    ::wait(&status);
    winners += WEXITSTATUS(status);
  }
  EXPECT_EQ(winners, 1);
}

TEST(Claim, LapsesWhereItIsNoLongerTouched) {
  const TemporaryFolder folder;
  const fs::path file = folder / "job";
  folder.write("job", "a machine that is gone\n");
  EXPECT_FALSE(Claim::take(file, std::chrono::seconds(60)).has_value()) << "it was touched just now";
  fs::last_write_time(file, fs::last_write_time(file) - std::chrono::seconds(61));
  EXPECT_TRUE(Claim::take(file, std::chrono::seconds(60)).has_value());
}

TEST(Claim, IsTouchedWhileItIsHeld) {
  const TemporaryFolder folder;
  const fs::path file = folder / "job";
  const auto claim = Claim::take(file, std::chrono::seconds(6));  // touched each second
  fs::last_write_time(file, fs::last_write_time(file) - std::chrono::seconds(60));
  std::this_thread::sleep_for(std::chrono::milliseconds(1600));
  EXPECT_FALSE(Claim::take(file, std::chrono::seconds(6)).has_value());
}

TEST(Claim, AFolderThatIsNotThereIsNamed) {
  const TemporaryFolder folder;
  EXPECT_THROW((void)Claim::take(folder / "nowhere/job"), InputError);
}

}  // namespace
}  // namespace pliant::claim_test
