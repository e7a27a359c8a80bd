#include "capture/c3d.hpp"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

static_assert(std::endian::native == std::endian::little, "numbers are taken from the file as they lie there");

constexpr std::size_t block_size = 512;
constexpr int key_of_format = 0x50, intel = 84, dec = 85, mips = 86;
constexpr std::size_t words_per_sample = 4;  // x, y, z, and camera mask with residual
constexpr double greatest_frame_count = 4294967295.0;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blank(" \t\0", 3);
  const auto begin = text.find_first_not_of(blank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(blank) - begin + 1);
}

std::string in_upper_case(std::string_view text) {
  std::string upper(text);
  std::ranges::transform(upper, upper.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  return upper;
}

std::string in_quotes(std::string_view text) {
  std::string shown(text.substr(0, 40));
  for (char& c : shown)
    if (c < 32 || c > 126) c = '?';
  return '"' + shown + '"';
}

// A parameter as it lies in the file.
struct Parameter {
  int type = 0;  // bytes an item; -1: text
  std::vector<std::size_t> sizes;
  std::string_view data;

  // Any number type, as double; 16-bit integers without sign, since counts use all bits.
  std::vector<double> numbers() const {
    std::vector<double> values;
    const auto size = std::size_t(std::abs(type));
    for (std::size_t at = 0; at + size <= data.size(); at += size) values.push_back(number(data.data() + at));
    return values;
  }

  std::vector<std::string> texts() const {
    std::vector<std::string> lines;
    const std::size_t length = sizes.empty() ? data.size() : sizes.front();
    if (type != -1 || length == 0) return lines;
    for (std::size_t at = 0; at + length <= data.size(); at += length)
      lines.emplace_back(trimmed(data.substr(at, length)));
    return lines;
  }

 private:
  double number(const char* bytes) const {
    if (type == 4) {
      float value;
      std::memcpy(&value, bytes, sizeof value);
      return double(value);
    }
    if (type != 2) return double(static_cast<unsigned char>(*bytes));
    std::uint16_t value;
    std::memcpy(&value, bytes, sizeof value);
    return double(value);
  }
};

struct Header {
  std::size_t parameter_block = 0, data_block = 0;
  std::size_t points = 0, analog_words = 0;  // of a frame
  int first_frame = 0, last_frame = 0;
  float scale = 0.0F, frame_rate = 0.0F;
};

class C3dReader {
 public:
  C3dReader(const fs::path& path, std::string_view content) : path_(path), content_(content) {}

  C3dTrajectories read() {
    read_header();
    read_parameters();
    C3dTrajectories result;
    const double metres = metres_per_unit();
    const bool is_float = samples_are_float();
    result.frame_rate = frame_rate();
    result.labels = labels();
    check_point_count();
    const std::size_t frames = frame_count();
    if (problems_.empty()) check_size(frames, is_float);
    if (!problems_.empty()) throw InputError(std::move(problems_));
    read_frames(result, frames, is_float ? metres : metres * integer_scale(), is_float);
    return result;
  }

 private:
  [[noreturn]] void fail(std::string found, std::string expected, std::string advice = "") const {
    throw InputError(Problem{{path_}, std::move(found), std::move(expected), std::move(advice)});
  }
  void complain(std::string found, std::string expected, std::string advice = "") {
    problems_.push_back({{path_}, std::move(found), std::move(expected), std::move(advice)});
  }

  template <class T>
  T at(std::size_t offset) const {
    T value;
    std::memcpy(&value, bytes(offset, sizeof value, "parameters").data(), sizeof value);
    return value;
  }

  int signed_byte(std::size_t offset) const {
    const int value = at<std::uint8_t>(offset);
    return value < 128 ? value : value - 256;
  }

  std::string_view bytes(std::size_t offset, std::size_t count, const char* what) const {
    if (offset > content_.size() || content_.size() - offset < count)
      fail("the file ends after " + std::to_string(content_.size()) + " bytes, in its " + what, "a whole C3D file",
           "the file was cut short; export or copy it again");
    return content_.substr(offset, count);
  }

  void read_header() {
    if (content_.size() < 2 || int(at<std::uint8_t>(1)) != key_of_format)
      fail("the second byte is not 80", "a C3D file", "export the recording as C3D, or as CSV");
    (void)bytes(0, block_size, "header");
    header_.parameter_block = at<std::uint8_t>(0);
    header_.points = at<std::uint16_t>(2);
    header_.analog_words = at<std::uint16_t>(4);
    header_.first_frame = at<std::uint16_t>(6);
    header_.last_frame = at<std::uint16_t>(8);
    header_.scale = at<float>(12);
    header_.data_block = at<std::uint16_t>(16);
    header_.frame_rate = at<float>(20);
    if (header_.parameter_block == 0 || header_.data_block <= header_.parameter_block)
      fail("a header that puts parameters into block " + std::to_string(header_.parameter_block) +
               " and samples into block " + std::to_string(header_.data_block),
           "parameters from block 1 on, samples behind them", "export the recording again");
  }

  void read_parameters() {
    const std::size_t begin = (header_.parameter_block - 1) * block_size;
    check_byte_order(at<std::uint8_t>(begin + 3));
    std::map<int, std::string> groups;
    std::map<std::pair<int, std::string>, Parameter> found;
    for (std::size_t record = begin + 4; signed_byte(record) != 0;) {
      const auto length = std::size_t(std::abs(signed_byte(record)));  // negative: locked
      const int group = signed_byte(record + 1);
      if (group == 0) break;
      const std::string name = in_upper_case(bytes(record + 2, length, "parameters"));
      const std::size_t offset_at = record + 2 + length;
      const std::size_t offset = at<std::uint16_t>(offset_at);
      if (group < 0)
        groups[-group] = name;
      else
        found[{group, name}] = read_parameter(offset_at + 2, name);
      if (offset == 0) break;
      record = offset_at + offset;
    }
    for (auto& [key, parameter] : found) parameters_[groups[key.first] + ":" + key.second] = std::move(parameter);
  }

  void check_byte_order(int processor) const {
    if (processor == intel) return;
    const std::string found = processor == dec ? "numbers in the byte order of DEC machines"
                              : processor == mips
                                  ? "numbers in the byte order of MIPS and SGI machines"
                                  : "numbers of the unknown processor type " + std::to_string(processor);
    fail(found, "little-endian numbers (Intel, processor type 84)", "export the recording for PC (Intel), or as CSV");
  }

  Parameter read_parameter(std::size_t offset, const std::string& name) const {
    Parameter parameter;
    parameter.type = signed_byte(offset);
    if (parameter.type != -1 && parameter.type != 1 && parameter.type != 2 && parameter.type != 4)
      fail("the parameter " + in_quotes(name) + " has items of type " + std::to_string(parameter.type),
           "-1 (text), 1, 2 (integers) or 4 (numbers)", "export the recording again");
    const std::size_t dimensions = at<std::uint8_t>(offset + 1);
    std::size_t size = std::size_t(std::abs(parameter.type));
    for (std::size_t i = 0; i < dimensions; ++i) {
      parameter.sizes.push_back(at<std::uint8_t>(offset + 2 + i));
      size *= parameter.sizes.back();
      if (size > content_.size()) break;
    }
    parameter.data = bytes(offset + 2 + dimensions, size, "parameters");
    return parameter;
  }

  const Parameter* parameter(const std::string& name) const {
    const auto found = parameters_.find(name);
    return found == parameters_.end() ? nullptr : &found->second;
  }

  // Numbers of a parameter where it has `count` of them at least.
  std::optional<std::vector<double>> numbers(const std::string& name, std::size_t count = 1) const {
    const Parameter* own = parameter(name);
    if (!own || own->type == -1) return std::nullopt;
    std::vector<double> values = own->numbers();
    return values.size() < count ? std::nullopt : std::optional(std::move(values));
  }

  double metres_per_unit() {
    const std::vector<std::string> units =
        parameter("POINT:UNITS") ? parameter("POINT:UNITS")->texts() : std::vector<std::string>();
    const std::string unit = units.empty() ? "" : in_upper_case(units.front());
    if (unit == "M") return 1.0;
    if (unit == "CM") return 1e-2;
    if (unit == "MM") return 1e-3;
    const char* advice = "set the unit when the recording is exported, or write the track as CSV in metres";
    if (unit.empty())
      complain("no unit of length (POINT:UNITS)", "m, cm or mm", advice);
    else
      complain("the unit of length " + in_quotes(units.front()) + " (POINT:UNITS)", "m, cm or mm", advice);
    return std::numeric_limits<double>::quiet_NaN();
  }

  // The sign of the scale tells how samples are written; parameters and header must agree about it.
  bool samples_are_float() {
    const auto own = numbers("POINT:SCALE");
    const double scale = own ? own->front() : double(header_.scale);
    if (!std::isfinite(scale) || scale == 0.0)
      complain("a scale of " + std::to_string(scale) + " (POINT:SCALE)", "a number that is not zero",
               "export the recording again");
    else if ((scale < 0) != (header_.scale < 0))
      complain("a header that says " + std::string(header_.scale < 0 ? "floating point" : "integer") +
                   " samples where POINT:SCALE says the other",
               "the same sign of both scales", "export the recording again");
    return scale < 0;
  }

  double integer_scale() const {
    const auto own = numbers("POINT:SCALE");
    return own ? own->front() : double(header_.scale);
  }

  std::optional<double> frame_rate() const {
    const auto own = numbers("POINT:RATE");
    const double rate = own ? own->front() : double(header_.frame_rate);
    return std::isfinite(rate) && rate > 0 ? std::optional(rate) : std::nullopt;
  }

  // LABELS, and where there are more than 255, LABELS2 and so on.
  std::vector<std::string> labels() const {
    std::vector<std::string> all;
    for (int part = 1;; ++part) {
      const Parameter* own = parameter("POINT:LABELS" + (part > 1 ? std::to_string(part) : std::string()));
      if (!own) break;
      for (std::string& label : own->texts()) all.push_back(std::move(label));
    }
    all.resize(header_.points);
    return all;
  }

  void check_point_count() {
    if (const auto used = numbers("POINT:USED"); used && used->front() != double(header_.points))
      complain("a header with " + std::to_string(header_.points) + " trajectories where POINT:USED is " +
                   std::to_string(used->front()),
               "the same number in both", "export the recording again");
    if (header_.points == 0) complain("no trajectories", "markers", "export the recording with its 3-D trajectories");
  }

  // The header's 16 bits do not hold the frames of a long recording; then parameters do.
  std::size_t frame_count() {
    const auto first = numbers("TRIAL:ACTUAL_START_FIELD", 2), last = numbers("TRIAL:ACTUAL_END_FIELD", 2);
    const auto joined = [](const std::vector<double>& words) { return words[0] + 65536.0 * words[1]; };
    double count = 1.0 + header_.last_frame - header_.first_frame;
    if (first && last)
      count = 1.0 + joined(*last) - joined(*first);
    else if (const auto frames = numbers("POINT:LONG_FRAMES"))
      count = frames->front();
    if (count >= 1.0 && count <= greatest_frame_count && count == std::floor(count)) return std::size_t(count);
    complain("frames from " + std::to_string(header_.first_frame) + " to " + std::to_string(header_.last_frame),
             "one frame at least", "export the recording again");
    return 0;
  }

  std::size_t frame_size(bool is_float) const {
    return (words_per_sample * header_.points + header_.analog_words) * (is_float ? 4U : 2U);
  }

  void check_size(std::size_t frames, bool is_float) {
    const std::size_t begin = (header_.data_block - 1) * block_size;
    const std::size_t there = content_.size() > begin ? (content_.size() - begin) / frame_size(is_float) : 0;
    if (there < frames)
      complain("the file ends after " + std::to_string(there) + " of " + std::to_string(frames) + " frames",
               "all frames that it announces", "the file was cut short; export or copy it again");
  }

  void read_frames(C3dTrajectories& result, std::size_t frames, double scale, bool is_float) const {
    result.frames.resize(frames);
    std::size_t frame_begin = (header_.data_block - 1) * block_size;
    for (Points& frame : result.frames) {
      frame.resize(Eigen::Index(header_.points), 3);
      for (std::size_t i = 0; i < header_.points; ++i)
        frame.row(Eigen::Index(i)) =
            is_float ? sample<float>(frame_begin, i, scale) : sample<std::int16_t>(frame_begin, i, scale);
      frame_begin += frame_size(is_float);
    }
  }

  template <class T>
  Eigen::RowVector3d sample(std::size_t frame_begin, std::size_t i, double scale) const {
    T words[words_per_sample];
    std::memcpy(words, content_.data() + frame_begin + i * sizeof words, sizeof words);
    const Eigen::RowVector3d position{double(words[0]), double(words[1]), double(words[2])};
    const bool is_seen = double(words[3]) >= 0 && position.allFinite() && !position.isZero(0.0);
    return is_seen ? (position * scale).eval() : Eigen::RowVector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  }

  const fs::path& path_;
  std::string_view content_;
  Header header_;
  std::map<std::string, Parameter> parameters_;  // "GROUP:NAME", upper case
  std::vector<Problem> problems_;
};

}  // namespace

C3dTrajectories read_c3d(const fs::path& path) {
  const std::string content = read_file(path);
  return C3dReader(path, content).read();
}

}  // namespace pliant
