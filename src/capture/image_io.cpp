#include "capture/image_io.hpp"

#include <png.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <ostream>
#include <string>

#include "base/files.hpp"
#include "base/plausible_size.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const fs::path& path, std::string found, std::string expected, std::string advice = "") {
  throw InputError(Problem{{path}, std::move(found), std::move(expected), std::move(advice)});
}

[[noreturn]] void fail_damaged(const fs::path& path, const std::string& why) {
  fail(path, "the image cannot be decoded: " + why, "a whole image file",
       "the file was cut short; write or copy it again");
}

bool is_png(std::string_view content) {
  return content.size() >= 8 && png_sig_cmp(reinterpret_cast<png_const_bytep>(content.data()), 0, 8) == 0;
}

bool is_pgm(std::string_view content) { return content.starts_with("P5") && content.size() > 2; }

std::uint32_t big_endian_32(const char* bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

std::optional<ImageHeader> png_header(std::string_view content) {
  if (content.size() < 26 || content.substr(12, 4) != "IHDR") return std::nullopt;
  const std::uint32_t width = big_endian_32(&content[16]), height = big_endian_32(&content[20]);
  if (width == 0 || height == 0 || width > largest_side || height > largest_side) return std::nullopt;
  static constexpr int channels_of[] = {1, 0, 3, 3, 2, 0, 4};
  const auto bits = static_cast<unsigned char>(content[24]), kind = static_cast<unsigned char>(content[25]);
  if (kind > 6 || channels_of[kind] == 0) return std::nullopt;
  return ImageHeader{int(width), int(height), bits, channels_of[kind]};
}

struct PgmHeader {
  int width = 0, height = 0, greatest = 0;
  std::size_t body = 0;
};

// "P5 width height maxval" and one white space; comments begin with #.
std::optional<PgmHeader> pgm_header(std::string_view content) {
  std::size_t at = 2;
  const auto next_number = [&]() -> int {
    while (at < content.size() && (std::isspace(static_cast<unsigned char>(content[at])) || content[at] == '#')) {
      if (content[at] == '#')
        at = std::min(content.find('\n', at), content.size());
      else
        ++at;
    }
    int value = 0;
    const std::size_t begin = at;
    for (; at < content.size() && std::isdigit(static_cast<unsigned char>(content[at])) && at < begin + 6; ++at)
      value = value * 10 + (content[at] - '0');
    return at == begin ? -1 : value;
  };
  PgmHeader header;
  header.width = next_number();
  header.height = next_number();
  header.greatest = next_number();
  header.body = at + 1;
  const auto in_range = [](int n, int limit) { return n > 0 && n <= limit; };
  if (!in_range(header.width, largest_side) || !in_range(header.height, largest_side) ||
      !in_range(header.greatest, 65535))
    return std::nullopt;
  return header;
}

std::size_t pixel_bytes(const ImageHeader& header) {
  return std::size_t(header.width) * std::size_t(header.height) * std::size_t(header.channels) *
         std::size_t(header.bits > 8 ? 2 : 1);
}

ImageHeader header_of(std::string_view content, const fs::path& path) {
  if (content.empty()) fail(path, "the file is empty", "a PNG or PGM image");
  if (is_png(content)) {
    if (const auto header = png_header(content)) return *header;
    fail_damaged(path, "its PNG header is damaged");
  }
  if (is_pgm(content)) {
    if (const auto header = pgm_header(content))
      return {header->width, header->height, header->greatest > 255 ? 16 : 8, 1};
    fail_damaged(path, "its PGM header is damaged");
  }
  fail(path, "neither a PNG nor a PGM (P5) image", "an image file", "convert it to 16-bit grey PNG");
}

// Feeds libpng from memory; libpng's errors become a return value, since it jumps over C++ destructors.
struct PngSource {
  std::string_view content;
  std::size_t at = 0;
  std::string error;
};

void read_bytes(png_structp png, png_bytep bytes, std::size_t count) {
  auto& source = *static_cast<PngSource*>(png_get_io_ptr(png));
  if (source.content.size() - source.at < count) png_error(png, "the file ends too early");
  std::memcpy(bytes, source.content.data() + source.at, count);
  source.at += count;
}

void on_error(png_structp png, png_const_charp message) {
  static_cast<PngSource*>(png_get_error_ptr(png))->error = message;
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

// Decodes all rows with the channels of the file, 8 or 16 bits each (16: native byte order). False: see source.error.
bool decode_png(PngSource& source, std::vector<png_byte>& bytes, std::vector<png_bytep>& rows, ImageHeader& header) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &source, on_error, on_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  if (!info || setjmp(png_jmpbuf(png))) {
    png_destroy_read_struct(&png, &info, nullptr);
    return false;
  }
  png_set_read_fn(png, &source, read_bytes);
  png_read_info(png, info);
  png_set_expand(png);
  png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  header = {int(png_get_image_width(png, info)), int(png_get_image_height(png, info)), png_get_bit_depth(png, info),
            png_get_channels(png, info)};
  const std::size_t stride = png_get_rowbytes(png, info);
  bytes.resize(stride * std::size_t(header.height));
  rows.resize(std::size_t(header.height));
  for (std::size_t row = 0; row < rows.size(); ++row) rows[row] = bytes.data() + row * stride;
  png_read_image(png, rows.data());
  png_read_end(png, nullptr);
  png_destroy_read_struct(&png, &info, nullptr);
  return true;
}

std::vector<png_byte> png_pixels(const std::string& content, const fs::path& path, ImageHeader& header) {
  require_plausible_size(content.size(), pixel_bytes(header), {path}, "an image");
  PngSource source{content, 0, {}};
  std::vector<png_byte> bytes;
  std::vector<png_bytep> rows;
  if (!decode_png(source, bytes, rows, header)) fail_damaged(path, source.error);
  return bytes;
}

std::vector<png_byte> pgm_pixels(const std::string& content, const fs::path& path, const ImageHeader& header) {
  const PgmHeader pgm = *pgm_header(content);
  const std::size_t size = pixel_bytes(header);
  if (content.size() < pgm.body + size) fail_damaged(path, "the file ends too early");
  std::vector<png_byte> bytes(content.begin() + std::ptrdiff_t(pgm.body),
                              content.begin() + std::ptrdiff_t(pgm.body + size));
  if (header.bits == 16)  // PGM is big endian
    for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) std::swap(bytes[i], bytes[i + 1]);
  return bytes;
}

std::vector<png_byte> pixels_of(const std::string& content, const fs::path& path, ImageHeader& header) {
  return is_png(content) ? png_pixels(content, path, header) : pgm_pixels(content, path, header);
}

std::string describe(const ImageHeader& header) {
  static constexpr const char* kinds[] = {"", "grey", "grey and alpha", "RGB", "RGBA"};
  return std::to_string(header.bits) + "-bit " + kinds[header.channels];
}

struct PngSink {
  std::ostream* stream;
};

void write_bytes(png_structp png, png_bytep bytes, std::size_t count) {
  static_cast<PngSink*>(png_get_io_ptr(png))
      ->stream->write(reinterpret_cast<const char*>(bytes), std::streamsize(count));
}

void flush_nothing(png_structp) {}

bool encode_png(PngSink& sink, int width, int height, int bits, int kind, const std::vector<png_bytep>& rows) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  if (!info || setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &sink, write_bytes, flush_nothing);
  png_set_IHDR(png, info, png_uint_32(width), png_uint_32(height), bits, kind, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  png_set_swap(png);
  png_write_image(png, const_cast<png_bytepp>(rows.data()));
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return true;
}

template <class Pixel>
void write_any(const fs::path& path, const Image<Pixel>& image, int bits, int kind) {
  std::vector<png_bytep> rows(std::size_t(image.height));
  for (int row = 0; row < image.height; ++row)
    rows[std::size_t(row)] = reinterpret_cast<png_bytep>(const_cast<Pixel*>(&image(0, row)));
  write_file(path, [&](std::ostream& stream) {
    PngSink sink{&stream};
    if (!encode_png(sink, image.width, image.height, bits, kind, rows))
      fail(path, "the image cannot be encoded: " + std::to_string(image.width) + " x " + std::to_string(image.height),
           "");
  });
}

}  // namespace

ImageHeader read_image_header(const fs::path& path) {
  char bytes[512] = {};
  std::ifstream stream(path, std::ios::binary);
  if (!stream || is_folder(path)) fail(path, "the image cannot be read", "an image file", "check the path");
  stream.read(bytes, sizeof bytes);
  return header_of(std::string_view(bytes, std::size_t(stream.gcount())), path);
}

Image<std::uint16_t> read_depth_image(const fs::path& path) { return decode_depth_image(read_file(path), path); }

Image<std::uint16_t> decode_depth_image(const std::string& content, const fs::path& path) {
  ImageHeader header = header_of(content, path);
  if (header.bits != 16 || header.channels != 1)
    fail(path, "a " + describe(header) + " image", "16-bit grey", "write depth without colour mapping");
  const auto bytes = pixels_of(content, path, header);
  Image<std::uint16_t> image(header.width, header.height);
  // A grey that is named as transparent comes with a second channel.
  const std::size_t stride = 2 * std::size_t(header.channels);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) std::memcpy(&image.pixels[i], bytes.data() + i * stride, 2);
  return image;
}

Image<std::uint8_t> read_mask(const fs::path& path) {
  const std::string content = read_file(path);
  ImageHeader header = header_of(content, path);
  if (header.bits > 8) fail(path, "a " + describe(header) + " mask", "8 bits a channel");
  const auto bytes = pixels_of(content, path, header);
  Image<std::uint8_t> mask(header.width, header.height);
  const std::size_t channels = std::size_t(header.channels);
  // Alpha is the mask where it differs over the image; elsewhere colours are.
  bool has_alpha = false;
  for (std::size_t i = 0; (channels == 2 || channels == 4) && i < mask.pixels.size() && !has_alpha; ++i)
    has_alpha = bytes[(i + 1) * channels - 1] != bytes[channels - 1];
  const std::size_t colours = channels == 2 || channels == 4 ? channels - 1 : channels;
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
    const auto* pixel = bytes.data() + i * channels;
    const bool shown = has_alpha ? pixel[channels - 1] != 0
                                 : std::any_of(pixel, pixel + colours, [](png_byte value) { return value != 0; });
    mask.pixels[i] = shown ? 255 : 0;
  }
  return mask;
}

void write_png(const fs::path& path, const Image<std::uint16_t>& grey) {
  write_any(path, grey, 16, PNG_COLOR_TYPE_GRAY);
}
void write_png(const fs::path& path, const Image<std::uint8_t>& grey) { write_any(path, grey, 8, PNG_COLOR_TYPE_GRAY); }
void write_png(const fs::path& path, const Image<Rgb>& rgb) { write_any(path, rgb, 8, PNG_COLOR_TYPE_RGB); }

}  // namespace pliant
