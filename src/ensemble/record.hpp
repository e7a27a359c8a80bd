#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace pliant {

/// How much is kept of each member of an ensemble.
struct RecordShape {
  int outputs = 0, series = 0, frames = 0, points = 0;

  /// Of a record in a file [bytes].
  std::size_t bytes() const { return series_offset() + sizeof(float) * (frame_series() + frame_points()); }
  /// @name Where the parts of a record begin [bytes]
  /// @{
  static constexpr std::size_t reason_offset = 8, reason_bytes = 240, outputs_offset = reason_offset + reason_bytes;
  std::size_t check_offset() const { return outputs_offset + sizeof(double) * std::size_t(outputs); }
  std::size_t series_offset() const { return check_offset() + sizeof(std::uint64_t); }
  std::size_t positions_offset() const { return series_offset() + sizeof(float) * frame_series(); }
  /// @}
  std::size_t frame_series() const { return std::size_t(frames) * std::size_t(series); }
  std::size_t frame_points() const { return std::size_t(frames) * std::size_t(points) * 3; }
  bool operator==(const RecordShape&) const = default;
};

/// What is kept of a member.
struct MemberRecord {
  enum class State : std::int32_t { Open = 0, Simulated = 1, Failed = 2 };
  State state = State::Open;
  std::string reason;            ///< why it failed, in words
  std::vector<double> outputs;   ///< as many as the shape says; not a number where there is none, as of failed ones
  std::vector<float> series;     ///< frames x series
  std::vector<float> positions;  ///< [m], frames x points x 3
};

/// A record without numbers of a member that failed.
MemberRecord failed_record(const RecordShape& shape, std::string reason);

}  // namespace pliant
