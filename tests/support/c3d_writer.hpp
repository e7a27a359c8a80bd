#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/types.hpp"

namespace pliant::test {

/// Writes C3D files for tests, also faulty ones: fields beyond the first four overrule what follows from them.
struct C3dWriter {
  std::vector<std::string> labels;
  std::vector<Points> frames;  ///< in units of the file; NaN rows where a marker was not seen
  std::optional<std::string> units = "mm";
  double rate = 100.0;  ///< [Hz]

  double integer_scale = 0.0;  ///< 0: floating point samples; else 16-bit integers times this
  bool writes_nan = false;     ///< a missing sample is NaN (zero of an integer file), not marked by its residual
  int analog_words = 0;        ///< of a frame, between the frames' trajectories
  int processor = 84;
  std::optional<int> used, last_frame;
  std::optional<float> scale_parameter, long_frames;
  std::optional<int> trial_end;    ///< TRIAL:ACTUAL_END_FIELD, from a start of 1
  int labels_per_parameter = 255;  ///< the rest in LABELS2, LABELS3, ...

  /// The file's bytes.
  std::string bytes() const {
    const std::string parameters = parameter_section();
    const std::size_t data_block = 2 + parameters.size() / block_size;
    return header(int(data_block)) + parameters + samples();
  }

 private:
  static constexpr std::size_t block_size = 512;

  template <class T>
  static void put(std::string& text, T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof value);
    text.append(raw, sizeof raw);
  }

  float scale() const { return integer_scale > 0 ? float(integer_scale) : -1.0F; }

  std::string header(int data_block) const {
    std::string text("\x02\x50", 2);
    put(text, std::uint16_t(labels.size()));
    put(text, std::uint16_t(analog_words));
    put(text, std::uint16_t(1));
    put(text, std::uint16_t(last_frame.value_or(int(frames.size()))));
    put(text, std::uint16_t(10));
    put(text, scale());
    put(text, std::uint16_t(data_block));
    put(text, std::uint16_t(analog_words > 0 ? 1 : 0));
    put(text, float(rate));
    text.resize(block_size, '\0');
    return text;
  }

  std::string parameter_section() const {
    std::string text;
    text += group(1, "POINT");
    text += number(1, "USED", std::int16_t(used.value_or(int(labels.size()))));
    text += number(1, "SCALE", scale_parameter.value_or(scale()));
    text += number(1, "RATE", float(rate));
    text += all_labels();
    if (units) text += texts(1, "UNITS", {*units}, 4);
    if (long_frames) text += number(1, "LONG_FRAMES", *long_frames);
    if (trial_end) {
      text += group(2, "TRIAL");
      text += two_words(2, "ACTUAL_START_FIELD", 1);
      text += two_words(2, "ACTUAL_END_FIELD", *trial_end);
    }
    text.append(2, '\0');
    const std::size_t blocks = (4 + text.size() + block_size - 1) / block_size;
    std::string section("\x01\x50", 2);
    section += char(blocks);
    section += char(processor);
    section += text;
    section.resize(blocks * block_size, '\0');
    return section;
  }

  std::string all_labels() const {
    std::string text;
    for (std::size_t begin = 0; begin < labels.size(); begin += std::size_t(labels_per_parameter)) {
      const std::size_t end = std::min(labels.size(), begin + std::size_t(labels_per_parameter));
      const std::string part = begin == 0 ? "" : std::to_string(1 + begin / std::size_t(labels_per_parameter));
      text +=
          texts(1, "LABELS" + part, {labels.begin() + std::ptrdiff_t(begin), labels.begin() + std::ptrdiff_t(end)}, 16);
    }
    return text;
  }

  // A record: name, group, offset of the next one, content, and a description.
  static std::string record(int group, std::string_view name, const std::string& content) {
    constexpr std::string_view description = "as tests write it";
    std::string text;
    text += char(name.size());
    text += char(group);
    text += name;
    put(text, std::uint16_t(2 + content.size() + 1 + description.size()));
    text += content;
    text += char(description.size());
    text += description;
    return text;
  }

  static std::string group(int number, std::string_view name) { return record(-number, name, ""); }

  template <class T>
  static std::string number(int group, std::string_view name, T value) {
    std::string content{char(sizeof(T)), '\0'};
    put(content, value);
    return record(group, name, content);
  }

  static std::string two_words(int group, std::string_view name, int value) {
    std::string content{2, 1, 2};
    put(content, std::uint32_t(value));
    return record(group, name, content);
  }

  static std::string texts(int group, std::string_view name, const std::vector<std::string>& lines,
                           std::size_t length) {
    std::string content{-1, 2, char(length), char(lines.size())};
    for (std::string line : lines) {
      line.resize(length, ' ');
      content += line;
    }
    return record(group, name, content);
  }

  std::string samples() const {
    std::string text;
    for (const Points& frame : frames) {
      for (Eigen::Index i = 0; i < frame.rows(); ++i)
        integer_scale > 0 ? put_integers(text, frame.row(i)) : put_floats(text, frame.row(i));
      for (int i = 0; i < analog_words; ++i) integer_scale > 0 ? put(text, std::int16_t(7777)) : put(text, 7777.0F);
    }
    return text;
  }

  void put_floats(std::string& text, const Eigen::RowVector3d& p) const {
    const bool seen = p.allFinite();
    for (const double x : p) put(text, seen || writes_nan ? float(x) : 3.0F);
    put(text, seen || writes_nan ? 5.0F : -1.0F);
  }

  void put_integers(std::string& text, const Eigen::RowVector3d& p) const {
    const bool seen = p.allFinite();
    for (const double x : p) put(text, std::int16_t(seen ? std::lround(x / integer_scale) : (writes_nan ? 0 : 3)));
    put(text, std::int16_t(seen || writes_nan ? 0x0105 : -1));
  }
};

}  // namespace pliant::test
