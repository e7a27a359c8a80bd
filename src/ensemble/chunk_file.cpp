#include "ensemble/chunk_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <vector>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/types.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "chunks are written as memory has them");

constexpr std::size_t head_bytes = 1024;

[[noreturn]] void fail(const fs::path& file, const std::string& what, const std::string& advice) {
  throw InputError({{file}, what, "", advice});
}

/// A line of JSON, filled up with spaces.
std::string head_of(const EnsembleChunk& chunk, const RecordShape& shape) {
  const Json json = {{"format", "ensemble-chunk/1"}, {"key", chunk.key},        {"first", chunk.first + 1},
                     {"members", chunk.members},     {"record", shape.bytes()}, {"outputs", shape.outputs},
                     {"series", shape.series},       {"frames", shape.frames},  {"points", shape.points}};
  std::string head = json.dump();
  head.resize(head_bytes - 1, ' ');
  return head + "\n";
}

void write_all(int handle, const fs::path& file, const char* bytes, std::size_t count, std::size_t offset) {
  while (count > 0) {
    const ssize_t written = ::pwrite(handle, bytes, count, off_t(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0)
      fail(file, std::string("it cannot be written: ") + std::strerror(errno), "is there room on the disk?");
    bytes += written, count -= std::size_t(written), offset += std::size_t(written);
  }
}

/// False where the file ends before that.
bool read_all(int handle, char* bytes, std::size_t count, std::size_t offset) {
  while (count > 0) {
    const ssize_t got = ::pread(handle, bytes, count, off_t(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes += got, count -= std::size_t(got), offset += std::size_t(got);
  }
  return true;
}

/// Of the words of a record but those of the sum itself (FNV-1a): a record that was cut off is told from a whole one.
std::uint64_t check_of(std::span<const char> record, const RecordShape& shape) {
  std::uint64_t sum = 14695981039346656037ULL;
  for (std::size_t at = 0; at < record.size(); at += sizeof(std::uint32_t)) {
    if (at == shape.check_offset()) at = shape.series_offset();
    if (at >= record.size()) break;
    std::uint32_t word = 0;
    std::memcpy(&word, record.data() + at, sizeof word);
    sum = (sum ^ word) * 1099511628211ULL;
  }
  return sum;
}

std::vector<char> packed(const MemberRecord& record, const RecordShape& shape) {
  std::vector<char> bytes(shape.bytes(), 0);
  const auto put = [&](std::size_t offset, const void* from, std::size_t count) {
    if (count > 0) std::memcpy(bytes.data() + offset, from, count);
  };
  put(0, &record.state, sizeof record.state);
  std::size_t length = std::min(record.reason.size(), RecordShape::reason_bytes - 1);
  while (length > 0 && length < record.reason.size() && (record.reason[length] & 0xC0) == 0x80) --length;  // UTF-8
  put(RecordShape::reason_offset, record.reason.data(), length);
  put(RecordShape::outputs_offset, record.outputs.data(), sizeof(double) * record.outputs.size());
  put(shape.series_offset(), record.series.data(), sizeof(float) * record.series.size());
  put(shape.positions_offset(), record.positions.data(), sizeof(float) * record.positions.size());
  const std::uint64_t check = check_of(bytes, shape);
  put(shape.check_offset(), &check, sizeof check);
  return bytes;
}

std::size_t place_of(int member, const RecordShape& shape) { return head_bytes + std::size_t(member) * shape.bytes(); }

bool is_record(int handle, int member, const RecordShape& shape) {
  std::vector<char> bytes(shape.bytes());
  if (!read_all(handle, bytes.data(), bytes.size(), place_of(member, shape))) return false;
  std::uint64_t check = 0;
  std::memcpy(&check, bytes.data() + shape.check_offset(), sizeof check);
  return bytes[0] != 0 && check == check_of(bytes, shape);
}

bool has_head(int handle, const std::string& head) {
  std::string there(head.size(), '\0');
  return read_all(handle, there.data(), there.size(), 0) && there == head;
}

}  // namespace

MemberRecord failed_record(const RecordShape& shape, std::string reason) {
  MemberRecord record;
  record.state = MemberRecord::State::Failed;
  record.reason = std::move(reason);
  record.outputs.assign(std::size_t(shape.outputs), not_a_number);
  record.series.assign(shape.frame_series(), float(not_a_number));
  record.positions.assign(shape.frame_points(), float(not_a_number));
  return record;
}

ChunkWriter::ChunkWriter(const fs::path& folder, const EnsembleChunk& chunk, const RecordShape& shape)
    : file_(folder / chunk.name), part_(folder / (chunk.name + ".part")), chunk_(chunk), shape_(shape) {
  handle_ = ::open(part_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (handle_ < 0) fail(part_, std::string("it cannot be made: ") + std::strerror(errno), "is the folder writable?");
  const std::string head = head_of(chunk, shape);
  if (!has_head(handle_, head)) {
    if (::ftruncate(handle_, 0) != 0) fail(part_, std::string("it cannot be emptied: ") + std::strerror(errno), "");
    write_all(handle_, part_, head.data(), head.size(), 0);
  }
  while (done_ < chunk.members && is_record(handle_, done_, shape)) ++done_;
}

ChunkWriter::~ChunkWriter() { ::close(handle_); }

void ChunkWriter::add(const MemberRecord& record) {
  if (int(record.outputs.size()) != shape_.outputs || record.series.size() != shape_.frame_series() ||
      record.positions.size() != shape_.frame_points() || done_ >= chunk_.members)
    throw std::invalid_argument("a record that its chunk has no place for");
  const std::vector<char> bytes = packed(record, shape_);
  write_all(handle_, part_, bytes.data(), bytes.size(), place_of(done_, shape_));
  ++done_;
}

void ChunkWriter::finish() {
  std::error_code error;
  fs::rename(part_, file_, error);
  // Another process that was thought gone may have been first: with the same bytes.
  if (error && !is_file(file_)) fail(file_, "it cannot be written: " + error.message(), "is the folder writable?");
}

bool is_whole(const fs::path& folder, const EnsembleChunk& chunk, const RecordShape& shape) {
  std::error_code error;
  const auto size = fs::file_size(folder / chunk.name, error);
  return !error && size == place_of(chunk.members, shape);
}

ChunkReader::ChunkReader(const fs::path& folder, const EnsembleChunk& chunk, const RecordShape& shape)
    : file_(folder / chunk.name), shape_(shape) {
  handle_ = ::open(file_.c_str(), O_RDONLY | O_CLOEXEC);
  if (handle_ < 0) fail(file_, std::string("it cannot be read: ") + std::strerror(errno), "");
  if (!has_head(handle_, head_of(chunk, shape))) {
    ::close(handle_);
    fail(file_, "it is not the chunk that belongs there", "remove it: it is simulated again");
  }
}

ChunkReader::~ChunkReader() { ::close(handle_); }

MemberRecord ChunkReader::record(int member) const {
  std::vector<char> bytes(shape_.positions_offset());
  if (!read_all(handle_, bytes.data(), bytes.size(), place_of(member, shape_)))
    fail(file_, "it ends too early", "remove it: it is simulated again");
  MemberRecord record;
  record.outputs.resize(std::size_t(shape_.outputs)), record.series.resize(shape_.frame_series());
  const auto get = [&](std::size_t offset, void* to, std::size_t count) {
    if (count > 0) std::memcpy(to, bytes.data() + offset, count);
  };
  get(0, &record.state, sizeof record.state);
  bytes[RecordShape::outputs_offset - 1] = '\0';
  record.reason = bytes.data() + RecordShape::reason_offset;
  get(RecordShape::outputs_offset, record.outputs.data(), sizeof(double) * record.outputs.size());
  get(shape_.series_offset(), record.series.data(), sizeof(float) * record.series.size());
  return record;
}

void ChunkReader::positions(int member, int frame, int first_point, int count, float* out) const {
  const std::size_t before = 3 * (std::size_t(frame) * std::size_t(shape_.points) + std::size_t(first_point));
  if (!read_all(handle_, reinterpret_cast<char*>(out), 3 * sizeof(float) * std::size_t(count),
                place_of(member, shape_) + shape_.positions_offset() + sizeof(float) * before))
    fail(file_, "it ends too early", "remove it: it is simulated again");
}

}  // namespace pliant
