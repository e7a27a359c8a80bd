#include "ensemble/ensemble.hpp"

#include <fmt/format.h>

#include <string_view>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/sha256.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

constexpr int fine = 0, bad_input = 2, was_interrupted = 130;  // exit codes of the program
constexpr int key_digits_of_name = 8;

template <class Number>
std::string_view bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), sizeof(Number) * numbers.size()};
}
std::string_view bytes_of(const Points& points) {
  return {reinterpret_cast<const char*>(points.data()), sizeof(double) * std::size_t(points.size())};
}

/// All of a model that its simulation depends on.
std::string fingerprint(const Model& model, const fs::path& file) {
  const TriangleMesh surface = model.scene.object.surface.value_or(TriangleMesh{});
  const ModelVolume& v = model.volume;
  return sha256({read_file(file), bytes_of(surface.vertices), bytes_of(surface.triangles), bytes_of(v.nodes),
                 bytes_of(v.connectivity), bytes_of(v.youngs_modulus), bytes_of(v.poissons_ratio), bytes_of(v.fill)});
}

/// What all chunks have in common.
std::string common_key(const Model& model, const fs::path& file, const EnsembleQuestion& question,
                       const std::string& program) {
  std::string ids;
  for (const std::string& id : question.points.ids) ids += id + ",";
  return sha256({"ensemble-chunk/1", program, fingerprint(model, file), ids, bytes_of(question.points.positions),
                 question.keeps_surface ? "surface" : ""});
}

EnsembleChunk chunk_of(const std::vector<DrawnMaterial>& materials, int first, int members, const std::string& common) {
  EnsembleChunk chunk{first, members, {}, {}};
  std::string numbers;
  for (int i = first; i < first + members; ++i) {
    numbers += fmt::format("\n{}", i);
    for (const double number : numbers_of(materials[std::size_t(i)])) numbers += fmt::format(",{:.17g}", number);
  }
  chunk.key = sha256({common, numbers});
  chunk.name = fmt::format("{:06}-{}.bin", first + 1, chunk.key.substr(0, key_digits_of_name));
  return chunk;
}

/// Where the process of a chunk says what goes wrong.
fs::path messages_of(const fs::path& folder, const EnsembleChunk& chunk) { return folder / (chunk.name + ".txt"); }

class ChunkJob : public Job {
 public:
  ChunkJob(const fs::path& ensemble, EnsembleChunk chunk, RecordShape shape,
           std::function<std::vector<std::string>(int)> words, std::function<void()> on_end)
      : folder_(chunks_of(ensemble)),
        chunk_(std::move(chunk)),
        shape_(shape),
        words_(std::move(words)),
        on_end_(std::move(on_end)) {}

  std::string key() const override { return chunk_.key; }
  bool has_ended() const override { return is_whole(folder_, chunk_, shape_); }
  std::vector<std::string> words(int threads) const override {
    make_folder(folder_);
    return words_(threads);
  }
  fs::path messages() const override { return messages_of(folder_, chunk_); }

  Next end(const ProcessEnd& end) override {
    if (has_ended()) return ended();
    if (end.was_asked || (end.signal == 0 && end.exit_code == was_interrupted)) {
      remove_file(messages());
      return Next::Open;
    }
    const std::string said = last_line(messages());
    if (end.signal == 0 && (end.exit_code == bad_input || end.exit_code == fine))
      throw InputError({{folder_ / chunk_.name},
                        "it was not simulated: " + (said.empty() ? "its process ended early" : said),
                        "",
                        "was the model changed meanwhile? The same command goes on"});
    std::string reason = said;
    if (end.signal != 0)
      reason = fmt::format("killed by signal {}", end.signal);
    else if (reason.empty())
      reason = fmt::format("exit code {}", end.exit_code);
    ChunkWriter chunk(folder_, chunk_, shape_);
    if (chunk.done() < chunk_.members) chunk.add(failed_record(shape_, reason));
    if (chunk.done() < chunk_.members) return Next::Again;
    chunk.finish();
    return ended();
  }

 private:
  Next ended() const {
    remove_file(messages());
    if (on_end_) on_end_();
    return Next::Ended;
  }

  fs::path folder_;
  EnsembleChunk chunk_;
  RecordShape shape_;
  std::function<std::vector<std::string>(int)> words_;
  std::function<void()> on_end_;
};

}  // namespace

EnsemblePlan plan_ensemble(const Model& model, const fs::path& model_file, const EnsembleScene& scene,
                           std::vector<DrawnMaterial> materials, std::string source, int chunk_size,
                           const std::string& program) {
  EnsemblePlan plan;
  plan.model = model.name, plan.source = std::move(source), plan.materials = std::move(materials);
  plan.outputs = scene.outputs(), plan.points = scene.question().points.ids;
  plan.shape = scene.shape(), plan.times = scene.times();
  plan.vertices = plan.shape.points - int(plan.points.size());
  const std::string common = common_key(model, model_file, scene.question(), program);
  std::string keys = plan.source;
  for (int first = 0; first < plan.members(); first += chunk_size) {
    const int members = std::min(chunk_size, plan.members() - first);
    plan.chunks.push_back(chunk_of(plan.materials, first, members, common));
    keys += "\n" + plan.chunks.back().key;
  }
  plan.key = sha256({keys});
  return plan;
}

fs::path chunks_of(const fs::path& ensemble) { return ensemble / "chunks"; }

void simulate_chunk(const fs::path& ensemble, const EnsembleScene& scene, const EnsemblePlan& plan, std::size_t chunk,
                    const std::function<bool()>& interrupted) {
  const fs::path folder = chunks_of(ensemble);
  const EnsembleChunk& members = plan.chunks[chunk];
  if (is_whole(folder, members, plan.shape)) return;
  make_folder(folder);
  ChunkWriter file(folder, members, plan.shape);
  while (file.done() < members.members) {
    const std::size_t next = std::size_t(members.first) + std::size_t(file.done());
    file.add(scene.simulate(plan.materials[next], interrupted));
  }
  file.finish();
}

std::unique_ptr<Job> chunk_job(const fs::path& ensemble, const EnsemblePlan& plan, std::size_t chunk,
                               std::function<std::vector<std::string>(int)> words, std::function<void()> on_end) {
  return std::make_unique<ChunkJob>(ensemble, plan.chunks[chunk], plan.shape, std::move(words), std::move(on_end));
}

void remove_messages(const fs::path& ensemble, const EnsemblePlan& plan) {
  for (const EnsembleChunk& chunk : plan.chunks)
    if (is_whole(chunks_of(ensemble), chunk, plan.shape)) remove_file(messages_of(chunks_of(ensemble), chunk));
}

int members_ended(const fs::path& ensemble, const EnsemblePlan& plan) {
  int members = 0;
  for (const EnsembleChunk& chunk : plan.chunks)
    if (is_whole(chunks_of(ensemble), chunk, plan.shape)) members += chunk.members;
  return members;
}

std::vector<FailedMember> failed_members(const fs::path& ensemble, const EnsemblePlan& plan) {
  std::vector<FailedMember> failed;
  for (const EnsembleChunk& chunk : plan.chunks) {
    if (!is_whole(chunks_of(ensemble), chunk, plan.shape)) continue;
    const ChunkReader reader(chunks_of(ensemble), chunk, plan.shape);
    for (int i = 0; i < chunk.members; ++i)
      if (MemberRecord record = reader.record(i); record.state != MemberRecord::State::Simulated)
        failed.push_back({chunk.first + i + 1, std::move(record.reason)});
  }
  return failed;
}

}  // namespace pliant
