#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

#include "imports/recording.hpp"

namespace pliant {

/// Reads numbers and texts one after the other, and never beyond the end: then it throws InputError with the file, the
/// byte and what was wanted there.
class BinaryCursor {
 public:
  /// @param content  stays alive as long as the cursor
  /// @param from     byte of the file at which `content` begins, for complaints
  BinaryCursor(std::string_view content, std::filesystem::path file, std::size_t from = 0)
      : content_(content), file_(std::move(file)), from_(from) {}

  std::size_t position() const { return at_; }
  std::size_t left() const { return content_.size() - at_; }
  bool at_end() const { return left() == 0; }
  void set_big_endian(bool is_big) { swaps_ = is_big; }

  std::string_view bytes(std::size_t count, const char* what) {
    if (count > left())
      refuse(file_, std::string(what) + " at byte " + std::to_string(from_ + at_) + " goes beyond the end",
             "a whole file", "the file was cut short; copy or record it again");
    const std::string_view result = content_.substr(at_, count);
    at_ += count;
    return result;
  }
  void skip(std::size_t count, const char* what) { (void)bytes(count, what); }

  template <class Number>
  Number number(const char* what) {
    static_assert(std::is_trivially_copyable_v<Number> && std::endian::native == std::endian::little);
    char raw[sizeof(Number)];
    std::memcpy(raw, bytes(sizeof(Number), what).data(), sizeof(Number));
    if (swaps_) std::reverse(raw, raw + sizeof(Number));
    Number value;
    std::memcpy(&value, raw, sizeof(Number));
    return value;
  }

  const std::filesystem::path& file() const { return file_; }
  /// Complaint about what was read last.
  [[noreturn]] void fail(const std::string& found, const std::string& expected, const std::string& advice = "") const {
    refuse(file_, found + " before byte " + std::to_string(from_ + at_), expected, advice);
  }

 private:
  std::string_view content_;
  std::filesystem::path file_;
  std::size_t from_ = 0, at_ = 0;
  bool swaps_ = false;
};

}  // namespace pliant
