#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "ensemble/record.hpp"

namespace pliant {

/// A part of an ensemble's members, one after another: what one process simulates at a time.
struct EnsembleChunk {
  int first = 0, members = 0;  ///< number of its first member from 0, and how many it has
  std::string key;             ///< SHA-256 of all that they depend on: 64 digits
  std::string name;            ///< of its file
};

/// The file of a chunk that is being made: records are added in the order of the members, and one that is there whole
/// stays, whoever goes on. It has its own name until all are there.
class ChunkWriter {
 public:
  /// @param folder  of the chunks, which exists
  /// Throws InputError where the file cannot be written, here and below.
  ChunkWriter(const std::filesystem::path& folder, const EnsembleChunk& chunk, const RecordShape& shape);
  ChunkWriter(const ChunkWriter&) = delete;
  ChunkWriter& operator=(const ChunkWriter&) = delete;
  ~ChunkWriter();

  /// Records that are there.
  int done() const { return done_; }
  /// Adds the next one. Throws std::invalid_argument where it has another shape.
  void add(const MemberRecord& record);
  /// Gives the file of all members its name.
  void finish();

 private:
  std::filesystem::path file_, part_;
  EnsembleChunk chunk_;
  RecordShape shape_;
  int handle_ = -1, done_ = 0;
};

/// Whether all members of a chunk are there.
bool is_whole(const std::filesystem::path& folder, const EnsembleChunk& chunk, const RecordShape& shape);

/// The file of a whole chunk.
class ChunkReader {
 public:
  /// Throws InputError where it cannot be read or is another's, here and below.
  ChunkReader(const std::filesystem::path& folder, const EnsembleChunk& chunk, const RecordShape& shape);
  ChunkReader(const ChunkReader&) = delete;
  ChunkReader& operator=(const ChunkReader&) = delete;
  ~ChunkReader();

  /// A member's record, by its number within the chunk, without its positions.
  MemberRecord record(int member) const;
  /// Positions of some of a member's points in a frame [m]: count x 3.
  void positions(int member, int frame, int first_point, int count, float* out) const;

 private:
  std::filesystem::path file_;
  RecordShape shape_;
  int handle_ = -1;
};

}  // namespace pliant
