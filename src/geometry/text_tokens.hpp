#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "base/error.hpp"

namespace pliant {

/// Words of a text file one after the other, with their places.
class TextTokens {
 public:
  /// The content has to stay.
  TextTokens(std::string_view content, std::filesystem::path path, int first_line = 1)
      : content_(content), path_(std::move(path)), line_(first_line) {}

  bool at_end() {
    skip_space();
    return position_ == content_.size();
  }
  /// The next word; its place is `place()`. Throws InputError at the end of the file.
  std::string_view word(const char* expected) {
    if (at_end()) fail("the file ends", expected);
    const std::size_t begin = position_;
    place_ = {path_, line_, int(begin - line_start_) + 1};
    while (position_ < content_.size() && !is_space(content_[position_])) ++position_;
    return content_.substr(begin, position_ - begin);
  }
  template <class Number>
  Number number(const char* expected) {
    const std::string_view text = word(expected);
    Number value{};
    const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
    const auto [end, error] = std::from_chars(begin, text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) fail_word(text, expected);
    if constexpr (std::is_floating_point_v<Number>)
      if (!std::isfinite(value)) fail_word(text, expected);
    return value;
  }
  /// A count of things of which each takes two characters at least: more than the file can hold is refused at once.
  std::size_t count(const char* expected) { return checked_count(number<long long>(expected), expected); }
  std::size_t checked_count(long long value, const char* expected) const {
    if (value < 0 || std::size_t(value) > most_count())
      fail_at("a count of " + std::to_string(value), std::string(expected) + " that the file can hold");
    return std::size_t(value);
  }
  std::size_t most_count() const { return content_.size(); }
  /// The rest of the line.
  std::string_view rest_of_line() {
    const std::size_t begin = position_, end = std::min(content_.find('\n', begin), content_.size());
    position_ = std::min(end + 1, content_.size());
    if (end < content_.size()) ++line_, line_start_ = position_;
    return content_.substr(begin, end - begin);
  }
  /// Raw bytes that follow. Throws InputError where there are fewer.
  std::string_view bytes(std::size_t size, const char* what) {
    if (content_.size() - position_ < size)
      throw InputError({{path_, line_, 0},
                        "the file ends within " + std::string(what),
                        std::to_string(size) + " bytes of them",
                        "copy the file again; it is cut off"});
    position_ += size;
    line_start_ = position_;
    return content_.substr(position_ - size, size);
  }
  /// To behind the next `mark`. Throws InputError where there is none.
  void skip_past(const std::string& mark) {
    const std::size_t found = content_.find(mark, position_);
    if (found == std::string_view::npos) fail("the file ends", mark);
    for (; position_ < found + mark.size(); ++position_)
      if (content_[position_] == '\n') ++line_, line_start_ = position_ + 1;
  }
  const Place& place() const { return place_; }
  [[noreturn]] void fail_word(std::string_view found, const std::string& expected) const {
    fail_at("\"" + std::string(found.substr(0, 40)) + "\"", expected);
  }
  [[noreturn]] void fail_at(const std::string& found, const std::string& expected) const {
    throw InputError({place_, found, expected, "export the mesh again"});
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  void skip_space() {
    for (; position_ < content_.size() && is_space(content_[position_]); ++position_)
      if (content_[position_] == '\n') ++line_, line_start_ = position_ + 1;
  }
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw InputError({{path_, line_, 0}, found, expected, "copy or export the mesh again; it is cut off"});
  }

  std::string_view content_;
  std::filesystem::path path_;
  std::size_t position_ = 0, line_start_ = 0;
  int line_ = 1;
  Place place_;
};

}  // namespace pliant
