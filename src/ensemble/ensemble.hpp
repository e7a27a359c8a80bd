#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ensemble/chunk_file.hpp"
#include "ensemble/member.hpp"
#include "jobs/processes.hpp"

namespace pliant {

/// Members of an ensemble, what is told of them, and the chunks that they are simulated in. Whoever makes a plan of the
/// same model, materials and question has the same one.
struct EnsemblePlan {
  std::string model;                      ///< its name
  std::string source;                     ///< of the materials, in words
  std::vector<DrawnMaterial> materials;   ///< one a member
  std::vector<EnsembleQuantity> outputs;  ///< see `EnsembleScene`, here and below
  std::vector<std::string> points;        ///< ids of those that were asked for
  int vertices = 0;                       ///< of the surface, where their paths are kept
  std::vector<double> times;              ///< [s]
  RecordShape shape;
  std::vector<EnsembleChunk> chunks;
  std::string key;  ///< SHA-256 of all of it: 64 digits

  int members() const { return int(materials.size()); }
  /// Of all chunks [bytes].
  double bytes() const { return double(members()) * double(shape.bytes()); }
};

/// @param model_file   its `model.toml`, which is read for the key
/// @param chunk_size   members of a chunk, >= 1: the last one may have fewer
/// @param program      version and commit
/// Chunks' keys hold the model, the program, what is asked and the materials of their own members: other numbers of
/// members share the chunks that they have in common.
EnsemblePlan plan_ensemble(const Model& model, const std::filesystem::path& model_file, const EnsembleScene& scene,
                           std::vector<DrawnMaterial> materials, std::string source, int chunk_size,
                           const std::string& program);

/// Folder of the chunks of an ensemble.
std::filesystem::path chunks_of(const std::filesystem::path& ensemble);

/// Simulates the members of a chunk that are not there yet. Throws Interrupted where it is interrupted: what is there
/// stays. Throws InputError where files cannot be written.
void simulate_chunk(const std::filesystem::path& ensemble, const EnsembleScene& scene, const EnsemblePlan& plan,
                    std::size_t chunk, const std::function<bool()>& interrupted);

/// A chunk as a job of `run_processes`. A member that its process does not survive has failed, and the chunk is gone on
/// with behind it.
/// @param words   of the program that simulates this chunk, by the number of threads
/// @param on_end  called when the chunk is whole; may be empty
std::unique_ptr<Job> chunk_job(const std::filesystem::path& ensemble, const EnsemblePlan& plan, std::size_t chunk,
                               std::function<std::vector<std::string>(int threads)> words,
                               std::function<void()> on_end);

/// Removes what processes said of chunks that are whole: the file of a process outlives a run that was killed.
void remove_messages(const std::filesystem::path& ensemble, const EnsemblePlan& plan);

/// How many members are there, in whole chunks.
int members_ended(const std::filesystem::path& ensemble, const EnsemblePlan& plan);

/// A member that failed.
struct FailedMember {
  int number = 0;  ///< from 1
  std::string reason;
};
/// Those of all whole chunks, by their numbers.
std::vector<FailedMember> failed_members(const std::filesystem::path& ensemble, const EnsemblePlan& plan);

}  // namespace pliant
