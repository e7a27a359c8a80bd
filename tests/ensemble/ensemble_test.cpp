// Chunks, their jobs and what is gathered of them.
#include "ensemble/ensemble.hpp"

#include <gmock/gmock.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "base/error.hpp"
#include "ensemble/gather.hpp"
#include "ensemble/quantiles.hpp"
#include "ensemble/tables.hpp"
#include "support/models.hpp"
#include "temporary_folder.hpp"

namespace pliant::ensemble_test {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<DrawnMaterial> materials(int count) {
  std::vector<DrawnMaterial> all;
  for (int i = 0; i < count; ++i) all.push_back({1e5 + 1e4 * ((7 * i) % count), 0.3 + 0.01 * i, 0.5, 2e-3});
  return all;
}

class Ensembles : public testing::Test {
 protected:
  Ensembles() : model(test::block(true)) {
    save_model(folder / "fit", model);
    MarkerPositions points;
    points.ids = {"tip", "mid, dle"};
    points.positions.resize(2, 3);
    points.positions << 0.1, 0.0, 0.0, 0.0, 0.0, 0.0;
    scene = std::make_unique<EnsembleScene>(model, EnsembleQuestion{points, true});
  }
  EnsemblePlan plan(int members = 7, int chunk = 3, const std::string& program = "1.0") const {
    return plan_ensemble(model, folder / "fit/model.toml", *scene, materials(members), "the posterior (seed 1)", chunk,
                         program);
  }
  void simulate(const fs::path& out, const EnsemblePlan& p, std::vector<std::size_t> chunks = {}) const {
    if (chunks.empty())
      for (std::size_t k = 0; k < p.chunks.size(); ++k) chunks.push_back(k);
    for (const std::size_t k : chunks) simulate_chunk(out, *scene, p, k, [] { return false; });
  }
  /// Files of results by their names, with what is in them.
  static std::map<std::string, std::string> results(const fs::path& out) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(out))
      if (const fs::path name = entry.path().lexically_relative(out);
          entry.is_regular_file() && *name.begin() != "chunks" && name != "ensemble.json")
        files[name.generic_string()] = read_file(entry.path());
    return files;
  }
  TemporaryFolder folder;
  Model model;
  std::unique_ptr<EnsembleScene> scene;
};

TEST_F(Ensembles, ChunksHaveKeysOfAllThatTheyDependOn) {
  const EnsemblePlan all = plan();
  ASSERT_EQ(all.chunks.size(), 3u);
  EXPECT_EQ(all.chunks[2].first, 6);
  EXPECT_EQ(all.chunks[2].members, 1);
  EXPECT_EQ(plan().key, all.key);
  EXPECT_NE(plan(7, 3, "1.1").chunks[0].key, all.chunks[0].key);
  std::vector<DrawnMaterial> other = materials(7);
  other[1].mass_damping = 0.6;
  const EnsemblePlan changed = plan_ensemble(model, folder / "fit/model.toml", *scene, other, "", 3, "1.0");
  EXPECT_NE(changed.chunks[0].key, all.chunks[0].key);
  EXPECT_EQ(changed.chunks[1].key, all.chunks[1].key) << "other members are as they were";
  Model moved = model;
  moved.scene.object.surface->vertices[3].x() += 1e-9;
  EXPECT_NE(plan_ensemble(moved, folder / "fit/model.toml", *scene, materials(7), "", 3, "1.0").chunks[1].key,
            all.chunks[1].key);
}

TEST_F(Ensembles, MoreMembersGoOnFromThoseThereAre) {
  std::vector<DrawnMaterial> nine = materials(9), six(nine.begin(), nine.begin() + 6);
  const auto planned = [&](const std::vector<DrawnMaterial>& m) {
    return plan_ensemble(model, folder / "fit/model.toml", *scene, m, "", 3, "1.0");
  };
  simulate(folder / "out", planned(six));
  EXPECT_EQ(members_ended(folder / "out", planned(nine)), 6);
}

TEST_F(Ensembles, HaveTheSameBytesHoweverTheyWereCut) {
  const EnsemblePlan threes = plan(7, 3), fives = plan(7, 5);
  simulate(folder / "a", threes);
  simulate(folder / "b", fives, {1, 0});
  ASSERT_TRUE(gather_ensemble(folder / "a", model, *scene, threes));
  ASSERT_TRUE(gather_ensemble(folder / "b", model, *scene, fives));
  const auto a = results(folder / "a"), b = results(folder / "b");
  for (const char* file : {"members.csv", "quantiles.csv", "frames.csv", "points.csv", "surface.pvd",
                           "surface/000002.vtu", "ensemble.html"})
    EXPECT_TRUE(a.contains(file)) << file;
  EXPECT_EQ(a, b);
}

/// Cells of a row.
std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> all;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) all.push_back(cell);
  return all;
}

TEST_F(Ensembles, QuantilesAreThoseOfTheMembers) {
  const EnsemblePlan p = plan();
  simulate(folder / "out", p);
  const MemberRecords members = read_members(folder / "out", p);
  std::vector<double> heights;  // of the tip in the last frame
  for (const MemberRecord& member : members) heights.push_back(member.outputs[13]);
  ASSERT_EQ(p.outputs[13].name, "y@tip");
  const std::string csv = quantiles_csv(columns_of(p, members));
  const std::string row = csv.substr(csv.find("y@tip,"), csv.find('\n', csv.find("y@tip,")) - csv.find("y@tip,"));
  const auto told = told_quantiles(heights);
  ASSERT_EQ(cells(row).size(), 8u) << row;
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(std::stod(cells(row)[3 + k]), told[k], 1e-9);

  // The same paths whether many points are read at once, or one after the other.
  const PositionQuantiles at_once = position_quantiles(folder / "out", p, 2);
  const PositionQuantiles one_by_one = position_quantiles(folder / "out", p, 2, 1);
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_EQ(at_once[k], one_by_one[k]);
    EXPECT_NEAR(at_once[k](p.vertices, 1), told[k], 1e-8) << "of floats";
  }
  EXPECT_LT(at_once[0](p.vertices, 1), at_once[4](p.vertices, 1)) << "members differ";
}

TEST_F(Ensembles, AreGatheredOnceByOneProcess) {
  const EnsemblePlan p = plan();
  simulate(folder / "out", p);
  fs::create_directories(folder / "out/claims");
  folder.write("out/claims/" + p.key, "another process\n");
  EXPECT_FALSE(gather_ensemble(folder / "out", model, *scene, p)) << "another one is at it";
  fs::remove(folder / "out/claims" / p.key);
  EXPECT_THROW(gather_ensemble(folder / "out", model, *scene, p, [](int, int) { return false; }), Interrupted);
  EXPECT_FALSE(fs::exists(folder / "out/ensemble.json")) << "it is not done";
  EXPECT_TRUE(gather_ensemble(folder / "out", model, *scene, p));
  const auto begin = fs::last_write_time(folder / "out/ensemble.html");
  EXPECT_TRUE(gather_ensemble(folder / "out", model, *scene, p));
  EXPECT_EQ(fs::last_write_time(folder / "out/ensemble.html"), begin);
  fs::remove(folder / "out/points.csv");
  EXPECT_TRUE(gather_ensemble(folder / "out", model, *scene, p));
  EXPECT_TRUE(fs::exists(folder / "out/points.csv")) << "what is missing is made again";
}

TEST_F(Ensembles, OneThatFailsIsNamedAndCountsNowhere) {
  const EnsemblePlan p = plan(4, 2);
  fs::create_directories(chunks_of(folder / "out"));
  {
    ChunkWriter chunk(chunks_of(folder / "out"), p.chunks[0], p.shape);
    chunk.add(scene->simulate(p.materials[0]));
    chunk.add(failed_record(p.shape, "stopped in frame 1: a reason, with commas"));
    chunk.finish();
  }
  simulate(folder / "out", p);
  const std::vector<FailedMember> failed = failed_members(folder / "out", p);
  ASSERT_EQ(failed.size(), 1u);
  EXPECT_EQ(failed[0].number, 2);
  ASSERT_TRUE(gather_ensemble(folder / "out", model, *scene, p));
  const std::string members = read_file(folder / "out/members.csv");
  EXPECT_THAT(members, HasSubstr(",failed,\"stopped in frame 1: a reason, with commas\",,,"));
  EXPECT_THAT(members, HasSubstr("\"x@mid, dle [m]\""));
  EXPECT_THAT(read_file(folder / "out/quantiles.csv"), HasSubstr("first_frequency,Hz,3,"));
  EXPECT_THAT(read_file(folder / "out/ensemble.html"), HasSubstr("Member 2: stopped in frame 1"));
}

TEST_F(Ensembles, WithoutAnyThatWasSimulatedHaveAPageNevertheless) {
  const EnsemblePlan p = plan(2, 2);
  fs::create_directories(chunks_of(folder / "out"));
  {
    ChunkWriter chunk(chunks_of(folder / "out"), p.chunks[0], p.shape);
    chunk.add(failed_record(p.shape, "one")), chunk.add(failed_record(p.shape, "two"));
    chunk.finish();
  }
  ASSERT_TRUE(gather_ensemble(folder / "out", model, *scene, p));
  EXPECT_THAT(read_file(folder / "out/ensemble.html"), HasSubstr("2 of them could not be simulated"));
}

TEST_F(Ensembles, AnInterruptedChunkKeepsWhatIsThere) {
  const EnsemblePlan p = plan(3, 3);
  int asked = 0;
  EXPECT_THROW(simulate_chunk(folder / "out", *scene, p, 0, [&] { return ++asked > 4; }), Interrupted);
  EXPECT_EQ(members_ended(folder / "out", p), 0);
  EXPECT_EQ(ChunkWriter(chunks_of(folder / "out"), p.chunks[0], p.shape).done(), 1) << "of three frames each";
  simulate(folder / "out", p);
  EXPECT_EQ(members_ended(folder / "out", p), 3);
}

/// Chunks in processes of a shell, which crash.
class ChunkJobs : public Ensembles {
 protected:
  std::unique_ptr<Job> job(const EnsemblePlan& p) {
    return chunk_job(
        folder / "out", p, 0, [](int) { return std::vector<std::string>{"true"}; }, [this] { ++ended; });
  }
  static ProcessEnd killed(int signal) {
    ProcessEnd end;
    end.signal = signal;
    return end;
  }
  static ProcessEnd code(int code) {
    ProcessEnd end;
    end.exit_code = code;
    return end;
  }
  int ended = 0;
};

TEST_F(ChunkJobs, AMemberThatItsProcessDoesNotSurviveHasFailed) {
  const EnsemblePlan p = plan(3, 3);
  const auto chunk = job(p);
  (void)chunk->words(1);
  {
    ChunkWriter writer(chunks_of(folder / "out"), p.chunks[0], p.shape);
    writer.add(scene->simulate(p.materials[0]));
  }
  EXPECT_EQ(chunk->end(killed(SIGSEGV)), Job::Next::Again) << "behind the second";
  write_file(chunk->messages(), "pliant: out of memory\n");
  EXPECT_EQ(chunk->end(code(1)), Job::Next::Ended);
  EXPECT_EQ(ended, 1);
  EXPECT_FALSE(fs::exists(chunk->messages()));
  const auto failed = failed_members(folder / "out", p);
  ASSERT_EQ(failed.size(), 2u);
  EXPECT_EQ(failed[0].number, 2);
  EXPECT_EQ(failed[0].reason, "killed by signal 11");
  EXPECT_EQ(failed[1].reason, "pliant: out of memory");
}

TEST_F(ChunkJobs, AnInterruptedOneStaysOpen) {
  const auto chunk = job(plan(3, 3));
  (void)chunk->words(1);
  EXPECT_EQ(chunk->end(code(130)), Job::Next::Open);
  ProcessEnd asked = killed(SIGINT);
  asked.was_asked = true;
  EXPECT_EQ(chunk->end(asked), Job::Next::Open);
  EXPECT_EQ(ended, 0);
}

TEST_F(ChunkJobs, BadInputEndsAll) {
  const auto chunk = job(plan(3, 3));
  (void)chunk->words(1);
  write_file(chunk->messages(), "model.toml:3:1: no such key\n");
  try {
    (void)chunk->end(code(2));
    FAIL() << "it ends all";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("model.toml:3:1: no such key"));
  }
}

}  // namespace
}  // namespace pliant::ensemble_test
