#include "jobs/processes.hpp"

#include <gmock/gmock.h>
#include <signal.h>

#include <cstdlib>
#include <map>
#include <thread>

#include "base/error.hpp"
#include "temporary_folder.hpp"

namespace pliant::processes_test {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using testing::HasSubstr;

/// A job whose process is a line of a shell, in the folder that all share; it is done once a file of its name is there.
class ShellJob : public Job {
 public:
  ShellJob(const TemporaryFolder& folder, std::string name, std::string line, std::vector<ProcessEnd>& ends)
      : folder_(folder), name_(std::move(name)), line_(std::move(line)), ends_(ends) {}
  std::string key() const override { return "key-of-" + name_; }
  bool has_ended() const override { return fs::exists(folder_ / name_); }
  std::vector<std::string> words(int threads) const override {
    return {"/bin/bash", "-c", "cd '" + folder_.path().string() + "'; echo ran >> " + name_ + ".ran; " + line_, "bash",
            std::to_string(threads)};
  }
  fs::path messages() const override { return folder_ / (name_ + ".txt"); }
  Next end(const ProcessEnd& end) override {
    ends_.push_back(end);
    if (has_ended()) return Next::Ended;
    return end.exit_code == 7 ? Next::Again : Next::Open;
  }

 private:
  const TemporaryFolder& folder_;
  std::string name_, line_;
  std::vector<ProcessEnd>& ends_;
};

class Processes : public testing::Test {
 protected:
  Processes() {
    options.claims = folder / "claims";
    options.threads = 1;
  }
  void add(const std::string& name, const std::string& line) {
    jobs.push_back(std::make_unique<ShellJob>(folder, name, line, ends[name]));
  }
  int runs(const std::string& name) const {
    const fs::path file = folder / (name + ".ran");
    return fs::exists(file) ? int(std::ranges::count(read_file(file), '\n')) : 0;
  }
  TemporaryFolder folder;
  ProcessOptions options;
  std::map<std::string, std::vector<ProcessEnd>> ends;
  std::vector<std::unique_ptr<Job>> jobs;
};

TEST_F(Processes, RunWhatHasNotEnded) {
  add("a", "touch a; echo said");
  add("b", "touch b");
  folder.write("b", "");
  EXPECT_EQ(run_processes(jobs, options), 1);
  EXPECT_EQ(runs("a"), 1);
  EXPECT_EQ(runs("b"), 0);
  EXPECT_EQ(read_file(folder / "a.txt"), "said\n");
  EXPECT_TRUE(fs::is_empty(folder / "claims"));
}

TEST_F(Processes, AreNoPartOfWhatMpirunStarted) {
  ::setenv("OMPI_COMM_WORLD_SIZE", "2", 1);
  ::setenv("PLIANT_OF_THE_TEST", "kept", 1);
  add("a", "touch a; echo \"${OMPI_COMM_WORLD_SIZE:-alone} $PLIANT_OF_THE_TEST\"");
  EXPECT_EQ(run_processes(jobs, options), 1);
  ::unsetenv("OMPI_COMM_WORLD_SIZE"), ::unsetenv("PLIANT_OF_THE_TEST");
  EXPECT_EQ(read_file(folder / "a.txt"), "alone kept\n");
}

TEST_F(Processes, TellHowTheyEnded) {
  add("code", "exit 3"), add("signal", "kill -SEGV $$"), add("threads", "exit $1");
  options.workers = 3, options.threads = 2;
  EXPECT_EQ(run_processes(jobs, options), 0);
  EXPECT_EQ(ends["code"].at(0).exit_code, 3);
  EXPECT_EQ(ends["signal"].at(0).signal, SIGSEGV);
  EXPECT_EQ(ends["threads"].at(0).exit_code, 2);
}

TEST_F(Processes, GoOnAtOnceWhereTheJobWantsThat) {
  add("a", "test $(wc -l < a.ran) -lt 3 && exit 7; touch a");
  EXPECT_EQ(run_processes(jobs, options), 1);
  EXPECT_EQ(runs("a"), 3);
}

TEST_F(Processes, AreAskedToEndAfterTheirTime) {
  add("a", "trap 'touch asked; exit 130' INT; for i in $(seq 600); do sleep 0.1; done");
  options.timeout = std::chrono::seconds(1);
  EXPECT_EQ(run_processes(jobs, options), 0);
  EXPECT_TRUE(ends["a"].at(0).has_timed_out);
  EXPECT_TRUE(fs::exists(folder / "asked"));
}

TEST_F(Processes, AnInterruptionReachesThemAndStartsNoOther) {
  add("a", "trap 'exit 7' INT; touch begun; for i in $(seq 600); do sleep 0.1; done"), add("b", "touch b");
  options.interrupted = [&] { return fs::exists(folder / "begun"); };
  EXPECT_EQ(run_processes(jobs, options), 0);
  EXPECT_TRUE(ends["a"].at(0).was_asked);
  EXPECT_EQ(runs("a"), 1) << "not even where it would go on at once";
  EXPECT_EQ(runs("b"), 0);
}

TEST_F(Processes, NeedTheirProgram) {
  class Nowhere : public ShellJob {
   public:
    using ShellJob::ShellJob;
    std::vector<std::string> words(int) const override { return {"/nowhere/program"}; }
  };
  jobs.push_back(std::make_unique<Nowhere>(folder, "a", "", ends["a"]));
  EXPECT_THROW(run_processes(jobs, options), InputError);
}

TEST(LastLine, IsTheLastThatIsNotEmpty) {
  const TemporaryFolder folder;
  EXPECT_EQ(last_line(folder.write("a", "one\ntwo \n\n")), "two");
  EXPECT_EQ(last_line(folder.write("b", "12 %\r100 %\rdone")), "done");
  EXPECT_EQ(last_line(folder.write("c", "\n")), "");
  EXPECT_EQ(last_line(folder / "nowhere"), "");
}

}  // namespace
}  // namespace pliant::processes_test
