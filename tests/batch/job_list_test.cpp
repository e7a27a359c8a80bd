#include "batch/job_list.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "batch/job_table.hpp"
#include "jobs/shards.hpp"
#include "temporary_folder.hpp"

namespace pliant::job_list_test {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

/// Recordings a, b and c; what is not one beside them.
class Jobs : public testing::Test {
 protected:
  Jobs() {
    for (const char* name : {"b", "a", "c"}) record(name, std::string("name = \"") + name + "\"\n");
    fs::create_directories(folder / "recordings/notes");
  }
  void record(const std::string& name, const std::string& text) const {
    fs::create_directories(folder / "recordings" / name);
    folder.write("recordings/" + name + "/capture.toml", text);
  }
  std::vector<fs::path> captures() const { return captures_of({(folder / "recordings/*").string()}); }
  std::vector<BatchJob> jobs(const std::string& program = "1.0", const FitOptions& options = {}) const {
    return batch_jobs(captures(), options, program);
  }
  static std::string key_of(const std::vector<BatchJob>& jobs, const std::string& recording) {
    for (const BatchJob& job : jobs)
      if (job.capture.filename() == recording) return job.key;
    return "";
  }
  TemporaryFolder folder;
};

TEST_F(Jobs, PatternsNameFoldersWithACapture) {
  EXPECT_THAT(captures(), ElementsAre(folder / "recordings/a", folder / "recordings/b", folder / "recordings/c"));
  EXPECT_THAT(captures_of({(folder / "rec*/[ab]").string(), (folder / "recordings/a").string()}), SizeIs(2)) << "once";
  EXPECT_THAT(captures_of({(folder / "recordings/c/capture.toml").string()}), ElementsAre(folder / "recordings/c"));
  EXPECT_THROW(captures_of({(folder / "recordings/x*").string()}), InputError);
  EXPECT_THROW(captures_of({(folder / "recordings/notes").string()}), InputError);
}

TEST_F(Jobs, AKeyIsOfRecordingChoicesAndProgram) {
  const std::string before = key_of(jobs(), "a");
  EXPECT_EQ(key_of(jobs(), "a"), before);
  EXPECT_NE(key_of(jobs("1.1"), "a"), before);
  FitOptions finer;
  finer.cells = 16;
  EXPECT_NE(key_of(jobs("1.0", finer), "a"), before);
  const std::string other = key_of(jobs(), "b");
  folder.write("recordings/a/000000.png", "a frame");
  EXPECT_NE(key_of(jobs(), "a"), before);
  EXPECT_EQ(key_of(jobs(), "b"), other);
}

TEST_F(Jobs, ACopyOfARecordingIsTheSameJob) {
  record("d", "name = \"a\"\n");
  EXPECT_THAT(jobs(), SizeIs(3));
}

TEST_F(Jobs, ShardsShareThemOut) {
  const std::vector<BatchJob> all = jobs();
  std::vector<std::string> keys;
  for (int part = 1; part <= 2; ++part)
    for (const BatchJob& job : shard_of(all, Shard{part, 2})) keys.push_back(job.key);
  EXPECT_THAT(keys, SizeIs(3));
  std::ranges::sort(keys);
  for (std::size_t k = 0; k < all.size(); ++k) EXPECT_EQ(keys[k], all[k].key);
}

TEST_F(Jobs, AnEndIsReadBackAndBelongsToItsKey) {
  const std::vector<BatchJob> all = jobs();
  const fs::path batch = folder / "fits";
  EXPECT_FALSE(read_status(batch, all[0]).has_value());
  const BatchStatus status{all[0].key, BatchStatus::State::Failed, "a reason, with \"words\""};
  write_status(batch, all[0], status);
  EXPECT_EQ(read_status(batch, all[0]), status);
  BatchJob other = all[0];
  other.key[0] = other.key[0] == 'a' ? 'b' : 'a';
  EXPECT_FALSE(read_status(batch, other).has_value());
  folder.write("fits/" + all[0].name + "/job.json", "{\"format\":");
  EXPECT_FALSE(read_status(batch, all[0]).has_value()) << "damaged: to be run again";
}

TEST_F(Jobs, TheTableHasARowEach) {
  const std::vector<BatchJob> all = jobs();
  const fs::path batch = folder / "fits";
  fs::create_directories(batch);
  write_status(batch, all[0], {all[0].key, BatchStatus::State::Failed, "no surface, \"none\""});
  const BatchSummary summary = write_batch_table(batch, all);
  EXPECT_EQ(summary.jobs, 3);
  EXPECT_EQ(summary.ended, 1);
  const std::string csv = read_file(batch / "results.csv");
  EXPECT_EQ(std::ranges::count(csv, '\n'), 4);
  EXPECT_THAT(csv, HasSubstr("failed,\"no surface, \"\"none\"\"\""));
  EXPECT_THAT(csv, HasSubstr("not run"));
  EXPECT_LT(csv.find("\na,"), csv.find("\nb,")) << "by the recordings' names";
  EXPECT_THAT(read_file(batch / "results.html"), HasSubstr("no surface, &quot;none&quot;"));
}

}  // namespace
}  // namespace pliant::job_list_test
