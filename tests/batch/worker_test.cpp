// Workers, with a program that stands in for fits: what it does stands in the recording.
#include "batch/worker.hpp"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "base/error.hpp"
#include "temporary_folder.hpp"

namespace pliant::worker_test {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using State = BatchStatus::State;
using testing::HasSubstr;

/// Called as `fit CAPTURE --out DIR ...`: notes that it ran, then does what capture.toml says.
constexpr const char* stand_in = R"sh(#!/bin/bash
echo "$@" >> "$4/words.txt"
trap 'echo asked >> "$4/words.txt"; echo state > "$4/state.json"; exit 130' INT
case "$(cat "$2/capture.toml")" in
  fine) exit 0 ;;
  slow) for i in $(seq 600); do sleep 0.1; done ;;
  bad) echo "capture.toml:3: no such thing"; exit 2 ;;
  crash) kill -SEGV $$ ;;
  open) echo "too many iterations" > "$4/log.txt"; exit 3 ;;
esac
)sh";

class Worker : public testing::Test {
 protected:
  Worker() {
    make_program(stand_in);
    options.batch = folder / "fits";
    options.program = {(folder / "program").string()};
    options.threads = 1;
    options.on_end = [this](const BatchJob& job, const BatchStatus& s) { ended[job.capture.filename()] = s; };
  }
  void make_program(const std::string& script) const {
    fs::permissions(folder.write("program", script), fs::perms::owner_all);
  }
  void record(const std::string& name, const std::string& what) {
    fs::create_directories(folder / "recordings" / name);
    folder.write("recordings/" + name + "/capture.toml", what);
  }
  std::vector<BatchJob> jobs() const {
    return batch_jobs(captures_of({(folder / "recordings/*").string()}), {}, "1.0");
  }
  std::string words(const std::string& name) const {
    for (const BatchJob& job : jobs())
      if (job.capture.filename() == name) return read_file(options.batch / job.name / "words.txt");
    return "";
  }
  TemporaryFolder folder;
  WorkerOptions options;
  std::map<std::string, BatchStatus> ended;
};

TEST_F(Worker, OneBadRecordingStopsNoOther) {
  record("a", "fine"), record("b", "bad"), record("c", "crash"), record("d", "open"), record("e", "fine");
  folder.write("recordings/e/more", "so that it is another recording");
  options.workers = 2;
  EXPECT_EQ(work(jobs(), options), 5);
  EXPECT_EQ(ended["a"].state, State::Converged);
  EXPECT_EQ(ended["e"].state, State::Converged);
  EXPECT_EQ(ended["b"].state, State::Failed);
  EXPECT_EQ(ended["b"].reason, "capture.toml:3: no such thing");
  EXPECT_EQ(ended["c"].state, State::Failed);
  EXPECT_THAT(ended["c"].reason, HasSubstr("signal 11"));
  EXPECT_EQ(ended["d"].state, State::NotConverged);
  EXPECT_EQ(ended["d"].reason, "too many iterations");
}

TEST_F(Worker, NothingIsDoneTwice) {
  record("a", "fine"), record("b", "bad");
  EXPECT_EQ(work(jobs(), options), 2);
  EXPECT_EQ(work(jobs(), options), 0);
  EXPECT_EQ(std::ranges::count(words("a"), '\n'), 1);
}

TEST_F(Worker, WorkersShareTheJobs) {
  for (int k = 0; k < 6; ++k) {
    const std::string name = "r" + std::to_string(k);
    record(name, "fine");
    folder.write("recordings/" + name + "/" + std::string(std::size_t(k + 1), 'x'), "another");
  }
  options.on_end = {};
  int first = 0, second = 0;
  std::thread other([&] { second = work(jobs(), options); });
  first = work(jobs(), options);
  other.join();
  EXPECT_EQ(first + second, 6);
  for (const BatchJob& job : jobs())
    EXPECT_EQ(std::ranges::count(read_file(options.batch / job.name / "words.txt"), '\n'), 1) << job.name;
  EXPECT_TRUE(fs::is_empty(options.batch / "claims"));
}

TEST_F(Worker, AFitThatTakesTooLongIsAskedToEnd) {
  record("a", "slow"), record("b", "fine");
  options.timeout = std::chrono::seconds(1);
  EXPECT_EQ(work(jobs(), options), 2);
  EXPECT_EQ(ended["a"].state, State::TimedOut);
  EXPECT_THAT(words("a"), HasSubstr("asked"));
  EXPECT_EQ(ended["b"].state, State::Converged);
}

TEST_F(Worker, AnInterruptedOneLeavesItsFitToOthersWhoGoOn) {
  record("a", "slow");
  const auto begin = std::chrono::steady_clock::now();
  options.interrupted = [&] { return std::chrono::steady_clock::now() - begin > std::chrono::milliseconds(700); };
  EXPECT_EQ(work(jobs(), options), 0);
  EXPECT_FALSE(read_status(options.batch, jobs()[0]).has_value());
  EXPECT_TRUE(fs::is_empty(options.batch / "claims"));
  options.interrupted = {};
  make_program("#!/bin/bash\necho \"$@\" >> \"$4/words.txt\"\nexit 0\n");
  EXPECT_EQ(work(jobs(), options), 1);
  EXPECT_THAT(words("a"), HasSubstr("--resume"));
}

TEST_F(Worker, AKilledOneTakesItsFitWithIt) {
  record("a", "slow");
  const pid_t killed = ::fork();
  if (killed == 0) {
    work(jobs(), options);
    ::_exit(0);
  }
  const fs::path words_file = options.batch / jobs()[0].name / "words.txt";
  const auto waits_for = [&](const std::string& text) {
    for (int k = 0; k < 200 && !(fs::exists(words_file) && words("a").find(text) != std::string::npos); ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return words("a").find(text) != std::string::npos;
  };
  ASSERT_TRUE(waits_for("fit"));
  ::kill(killed, SIGKILL);
  ::waitpid(killed, nullptr, 0);
  EXPECT_TRUE(waits_for("asked")) << "no fit goes on that nobody waits for";
}

TEST_F(Worker, AClaimOfAnotherMachineIsLeftAlone) {
  record("a", "fine");
  fs::create_directories(options.batch / "claims");
  folder.write("fits/claims/" + jobs()[0].key, "elsewhere 1\n");
  EXPECT_EQ(work(jobs(), options), 0);
  EXPECT_FALSE(read_status(options.batch, jobs()[0]).has_value());
}

TEST_F(Worker, AProgramThatIsNotThereIsNamed) {
  record("a", "fine");
  options.program = {(folder / "nowhere").string()};
  EXPECT_THROW(work(jobs(), options), InputError);
}

}  // namespace
}  // namespace pliant::worker_test
