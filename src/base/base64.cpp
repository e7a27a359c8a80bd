#include "base/base64.hpp"

#include <array>
#include <cstdint>

namespace pliant {

namespace {

constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

constexpr std::array<int8_t, 256> digit_values() {
  std::array<int8_t, 256> values{};
  for (int8_t& value : values) value = -1;
  for (size_t i = 0; i < alphabet.size(); ++i) values[uint8_t(alphabet[i])] = int8_t(i);
  return values;
}

constexpr std::array<int8_t, 256> digit_value = digit_values();

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

}  // namespace

std::string encode_base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    for (size_t k = 0; k < 3; ++k) word = word << 8 | (k < count ? uint8_t(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) text += k <= count ? alphabet[word >> (18 - 6 * k) & 63u] : '=';
  }
  return text;
}

std::optional<std::string> decode_base64(std::string_view text) {
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  uint32_t word = 0;
  int digits = 0, padding = 0;
  for (const char c : text) {
    if (is_space(c)) continue;
    const int value = c == '=' ? 0 : digit_value[uint8_t(c)];
    if (value < 0 || (c != '=' && padding > 0)) return std::nullopt;
    padding += c == '=';
    word = word << 6 | uint32_t(value);
    if (++digits < 4) continue;
    for (int k = 0; k < 3 - padding; ++k) bytes += char(word >> (16 - 8 * k) & 255u);
    digits = 0;
    if (padding > 2) return std::nullopt;
  }
  if (digits != 0) return std::nullopt;
  return bytes;
}

}  // namespace pliant
