#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/error.hpp"

namespace pliant {

/// Pixels row by row, the top row first.
template <class Pixel>
struct Image {
  int width = 0, height = 0;
  std::vector<Pixel> pixels;

  Image() = default;
  Image(int w, int h, Pixel value = {}) : width(w), height(h), pixels(std::size_t(w) * std::size_t(h), value) {}
  Pixel& operator()(int column, int row) { return pixels[std::size_t(row) * std::size_t(width) + std::size_t(column)]; }
  const Pixel& operator()(int column, int row) const {
    return pixels[std::size_t(row) * std::size_t(width) + std::size_t(column)];
  }
  bool contains(int column, int row) const { return column >= 0 && row >= 0 && column < width && row < height; }
};

/// Pixels beyond any sensor: a damaged header must not become a huge allocation.
inline constexpr int largest_side = 32768;

using Rgb = std::array<std::uint8_t, 3>;

/// What the first bytes of an image file say.
struct ImageHeader {
  int width = 0, height = 0;
  int bits = 0;      ///< of a channel
  int channels = 0;  ///< 1 grey, 2 grey and alpha, 3 RGB (also a palette), 4 RGBA
};

/// Reads the header of a PNG or a PGM (P5) alone. Throws InputError where the file is neither.
ImageHeader read_image_header(const std::filesystem::path& path);

/// Reads a 16-bit grey image, PNG or PGM (P5), raw units. Throws InputError for any other kind or a damaged file.
Image<std::uint16_t> read_depth_image(const std::filesystem::path& path);

/// The same of a file's bytes; `source` stands for the file in complaints.
Image<std::uint16_t> decode_depth_image(const std::string& content, const std::filesystem::path& source);

/// Reads a mask, PNG or PGM with at most 8 bits a channel: 255 where it shows the object, else 0.
/// Alpha decides where it differs over the image, else any colour that is not zero. Throws InputError for a damaged
/// file.
Image<std::uint8_t> read_mask(const std::filesystem::path& path);

/// Write PNG files, whole or not at all.
void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& grey);
void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& grey);
void write_png(const std::filesystem::path& path, const Image<Rgb>& rgb);

}  // namespace pliant
