#include "geometry/vtk_xml.hpp"

#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>

#include "base/base64.hpp"
#include "base/files.hpp"
#include "base/plausible_size.hpp"
#include "geometry/raw_cells.hpp"
#include "geometry/text_tokens.hpp"

namespace pliant {

namespace {

bool unpack_zlib(std::string_view packed, char* bytes, std::size_t size) {
  uLongf length = size;
  return uncompress(reinterpret_cast<Bytef*>(bytes), &length, reinterpret_cast<const Bytef*>(packed.data()),
                    packed.size()) == Z_OK &&
         length == size;
}

bool unpack_lz4(std::string_view packed, char* bytes, std::size_t size) {
  constexpr std::size_t most = std::numeric_limits<int>::max();
  return packed.size() <= most && size <= most &&
         LZ4_decompress_safe(packed.data(), bytes, int(packed.size()), int(size)) == int(size);
}

bool unpack_lzma(std::string_view packed, char* bytes, std::size_t size) {
  std::uint64_t memory = std::uint64_t(1) << 30U;
  std::size_t read = 0, written = 0;
  return lzma_stream_buffer_decode(&memory, 0, nullptr, reinterpret_cast<const std::uint8_t*>(packed.data()), &read,
                                   packed.size(), reinterpret_cast<std::uint8_t*>(bytes), &written, size) == LZMA_OK &&
         written == size;
}

/// Bytes one after the other, raw or in base64. What was coded apart, as the sizes of blocks and the blocks are, ends
/// in a padding of its own.
class ByteSource {
 public:
  ByteSource(std::string_view content, bool is_raw) : content_(content), is_raw_(is_raw) {}

  /// How many bytes can be left.
  std::size_t most_left() const {
    const std::size_t coded = content_.size() - at_;
    return is_raw_ ? coded : decoded_.size() - taken_ + coded / 4 * 3;
  }
  /// The next ones, valid until the next call. Nothing where there are fewer.
  std::optional<std::string_view> take(std::size_t size) {
    if (size > most_left()) return std::nullopt;
    if (is_raw_) {
      at_ += size;
      return content_.substr(at_ - size, size);
    }
    decoded_.erase(0, taken_), taken_ = 0;
    while (decoded_.size() < size)
      if (!decode(size - decoded_.size())) return std::nullopt;
    taken_ = size;
    return std::string_view(decoded_).substr(0, size);
  }

 private:
  /// At least so many bytes more, or as far as the next padding.
  bool decode(std::size_t size) {
    const std::size_t wanted = (size + 2) / 3 * 4;
    std::string digits;
    while (digits.size() < wanted) {
      at_ = std::min(content_.find_first_not_of(" \t\r\n", at_), content_.size());
      if (at_ == content_.size()) return false;
      digits += content_[at_++];
      if (digits.back() == '=' && digits.size() % 4 == 0) break;
    }
    const auto bytes = decode_base64(digits);
    if (bytes) decoded_ += *bytes;
    return bytes.has_value();
  }

  std::string_view content_;
  bool is_raw_;
  std::size_t at_ = 0, taken_ = 0;
  std::string decoded_;
};

}  // namespace

VtkXmlFile::VtkXmlFile(const std::filesystem::path& path, const char* type)
    : path_(path), type_(type), content_(read_file(path)) {
  cut_appended_data();
  const pugi::xml_parse_result parsed = document_.load_buffer(content_.data(), content_.size());
  if (!parsed) fail(line_at(parsed.offset), std::string("broken XML (") + parsed.description() + ")", "a whole file");
  const pugi::xml_node root = document_.child("VTKFile");
  if (const std::string found = root.attribute("type").value(); found != type)
    fail(1, root ? "a VTK file of type \"" + found + "\"" : "no <VTKFile>", std::string("type \"") + type + "\"");
  read_coding(root);
}

std::string text_of_number(double value) {
  char text[400];  // the greatest has 309 digits
  std::snprintf(text, sizeof text, value == std::floor(value) ? "%.0f" : "%g", value);
  return text;
}

pugi::xml_node VtkXmlFile::data_set() const { return document_.child("VTKFile").child(type_.c_str()); }

void VtkXmlFile::fail(int line, const std::string& found, const std::string& expected) const {
  throw InputError({{path_, line, 0},
                    found,
                    expected,
                    "write it again, by meshio for example: meshio convert OLD.vtu NEW.vtu (pip install meshio)"});
}

int VtkXmlFile::line_at(std::ptrdiff_t offset) const {
  const auto end = content_.begin() + std::clamp<std::ptrdiff_t>(offset, 0, std::ptrdiff_t(content_.size()));
  return 1 + int(std::count(content_.begin(), end, '\n'));
}

/// Raw bytes are no XML: what is parsed is what stands before them, and the end.
void VtkXmlFile::cut_appended_data() {
  const std::size_t element = content_.find("<AppendedData");
  if (element == std::string::npos) return;
  const std::size_t begin = content_.find('>', element), mark = content_.find('_', begin),
                    end = content_.rfind("</AppendedData>");
  if (begin == std::string::npos || mark == std::string::npos || end == std::string::npos || end < mark)
    fail(line_at(std::ptrdiff_t(element)), "appended data that do not end", "a whole file");
  const std::string_view heading = std::string_view(content_).substr(element, begin - element);
  appended_raw_ = heading.find("base64") == std::string_view::npos;
  has_appended_ = true;
  appended_ = content_.substr(mark + 1, end - mark - 1);
  content_.erase(begin + 1, end - begin - 1);
}

void VtkXmlFile::read_coding(pugi::xml_node root) {
  const std::string order = root.attribute("byte_order").value(), header = root.attribute("header_type").value(),
                    compressor = root.attribute("compressor").value();
  if (!order.empty() && order != "LittleEndian" && order != "BigEndian")
    fail(line_of(root), "byte_order \"" + order + "\"", "\"LittleEndian\" or \"BigEndian\"");
  if (!header.empty() && header != "UInt32" && header != "UInt64")
    fail(line_of(root), "header_type \"" + header + "\"", "\"UInt32\" or \"UInt64\"");
  big_endian_ = order == "BigEndian";
  wide_header_ = header == "UInt64";
  if (compressor.empty()) return;
  if (compressor == "vtkZLibDataCompressor")
    unpack_ = unpack_zlib;
  else if (compressor == "vtkLZ4DataCompressor")
    unpack_ = unpack_lz4;
  else if (compressor == "vtkLZMADataCompressor")
    unpack_ = unpack_lzma;
  else
    fail(line_of(root), "arrays compressed by \"" + compressor + "\"",
         "vtkZLibDataCompressor, vtkLZ4DataCompressor, vtkLZMADataCompressor or none");
}

std::string VtkXmlFile::bytes_of(pugi::xml_node array, std::size_t size, const std::string& what) const {
  const std::string format = array.attribute("format").value();
  const int line = line_of(array);
  if (format != "binary" && format != "appended")
    fail(line, what + " in the encoding \"" + format + "\"", R"("ascii", "binary" or "appended")");
  std::string_view content = array.text().get();
  if (format == "appended") {
    const auto offset = array.attribute("offset").as_ullong(std::numeric_limits<std::size_t>::max());
    if (!has_appended_ || offset > appended_.size())
      fail(line, what + " beyond the appended data", "<AppendedData> that holds them");
    content = std::string_view(appended_).substr(offset);
  }
  ByteSource source(content, format == "appended" && appended_raw_);
  const auto take = [&](std::size_t length) {
    const auto bytes = source.take(length);
    if (!bytes) fail(line, what + " that are cut off or no base64", "all of their bytes");
    return *bytes;
  };
  const auto take_size = [&] {
    constexpr double beyond_all = 0x1p62;  // as a size of what a file holds, and an integer still
    const auto value = vtk_values(take(wide_header_ ? 8 : 4), wide_header_ ? "UInt64" : "UInt32", big_endian_)->front();
    return std::size_t(std::min(value, beyond_all));
  };
  const auto require_size = [&](std::size_t found) {
    if (found == size) return;
    const std::size_t one = *vtk_number_size(array.attribute("type").value());
    fail(line, std::to_string(found / one) + " numbers in " + what, std::to_string(size / one));
  };
  if (unpack_ == nullptr) {
    require_size(take_size());
    return std::string(take(size));
  }
  const std::size_t blocks = take_size(), block_size = take_size(), last_size = take_size();
  if (blocks > source.most_left())
    fail(line, what + " in " + std::to_string(blocks) + " blocks", "what the file can hold");
  if ((blocks > 1 && block_size > size / (blocks - 1)) || last_size > size)
    fail(line, what + " in blocks of " + std::to_string(std::max(block_size, last_size)) + " bytes",
         std::to_string(size) + " bytes in all");
  require_plausible_size(source.most_left(), size, {path_, line}, what);
  require_size(blocks == 0 ? 0 : last_size == 0 ? blocks * block_size : (blocks - 1) * block_size + last_size);
  std::vector<std::size_t> packed_sizes(blocks);
  for (std::size_t& packed : packed_sizes) packed = take_size();
  std::string bytes;
  for (std::size_t b = 0; b < blocks; ++b) {
    const std::size_t begin = b * block_size, length = b + 1 < blocks || last_size == 0 ? block_size : last_size;
    bytes.resize(begin + length);
    if (!unpack_(take(packed_sizes[b]), bytes.data() + begin, length))
      fail(line, "block " + std::to_string(b) + " of " + what + " that cannot be decompressed", "a whole file");
  }
  return bytes;
}

VtkValues VtkXmlFile::values(pugi::xml_node array, std::size_t length, const std::string& name) const {
  if (!array) fail(0, "there is no array of " + name, "points, connectivity, offsets and types");
  const std::string type = array.attribute("type").value();
  const int line = line_of(array);
  if (!vtk_number_size(type)) fail(line, "an array of type \"" + type + "\"", "numbers");
  const std::string what = "the array of " + name;
  VtkValues values;
  if (std::string_view(array.attribute("format").value()) == "ascii") {
    const pugi::xml_node text = array.first_child();
    TextTokens tokens(text.value(), path_, line_of(text ? text : array));
    while (!tokens.at_end()) {
      values.of.push_back(tokens.number<double>(("a number of " + name).c_str()));
      values.lines.push_back(tokens.place().line);
    }
    if (values.of.size() != length)
      fail(line, std::to_string(values.of.size()) + " numbers in " + what, std::to_string(length));
  } else {
    values.of = *vtk_values(bytes_of(array, length * *vtk_number_size(type), what), type, big_endian_);
  }
  return values;
}

}  // namespace pliant
