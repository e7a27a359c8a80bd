#include "base/sha256.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace pliant {

namespace {

constexpr std::size_t block_size = 64;  // bytes
constexpr std::size_t length_size = 8;  // bytes of the message's length at its end

// The first 32 binary digits behind the point of the cube roots of the first 64 primes (FIPS 180-4, 4.2.2) ...
constexpr std::array<std::uint32_t, 64> round_constants = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};
// ... and of the square roots of the first 8 (5.3.3).
constexpr std::array<std::uint32_t, 8> initial_hash = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                                       0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};

/// The hash of a message that comes in pieces.
class Sha256 {
 public:
  void add(std::string_view bytes) {
    size_ += bytes.size();
    for (const char byte : bytes) push(std::uint8_t(byte));
  }

  std::string hexadecimal() {
    const std::uint64_t bits = 8 * size_;
    push(0x80);
    while (filled_ != block_size - length_size) push(0);
    for (int shift = 56; shift >= 0; shift -= 8) push(std::uint8_t(bits >> shift));
    std::string text;
    for (const std::uint32_t word : hash_)
      for (int shift = 28; shift >= 0; shift -= 4) text += "0123456789abcdef"[word >> shift & 15U];
    return text;
  }

 private:
  void push(std::uint8_t byte) {
    block_[filled_++] = byte;
    if (filled_ < block_size) return;
    compress();
    filled_ = 0;
  }

  /// FIPS 180-4, 6.2.2, with its letters.
  void compress() {
    std::array<std::uint32_t, 64> W;
    for (std::size_t t = 0; t < 16; ++t)
      W[t] = std::uint32_t(block_[4 * t]) << 24 | std::uint32_t(block_[4 * t + 1]) << 16 |
             std::uint32_t(block_[4 * t + 2]) << 8 | std::uint32_t(block_[4 * t + 3]);
    for (std::size_t t = 16; t < 64; ++t) {
      const std::uint32_t x = W[t - 15], y = W[t - 2];
      const std::uint32_t sigma0 = std::rotr(x, 7) ^ std::rotr(x, 18) ^ x >> 3;
      const std::uint32_t sigma1 = std::rotr(y, 17) ^ std::rotr(y, 19) ^ y >> 10;
      W[t] = sigma1 + W[t - 7] + sigma0 + W[t - 16];
    }
    auto [a, b, c, d, e, f, g, h] = hash_;
    for (std::size_t t = 0; t < 64; ++t) {
      const std::uint32_t sum1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
      const std::uint32_t choice = (e & f) ^ (~e & g);
      const std::uint32_t T1 = h + sum1 + choice + round_constants[t] + W[t];
      const std::uint32_t sum0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
      const std::uint32_t majority = (a & b) ^ (a & c) ^ (b & c);
      h = g, g = f, f = e, e = d + T1, d = c, c = b, b = a, a = T1 + sum0 + majority;
    }
    const std::array<std::uint32_t, 8> change = {a, b, c, d, e, f, g, h};
    for (std::size_t i = 0; i < hash_.size(); ++i) hash_[i] += change[i];
  }

  std::array<std::uint32_t, 8> hash_ = initial_hash;
  std::array<std::uint8_t, block_size> block_;
  std::size_t filled_ = 0;
  std::uint64_t size_ = 0;  // bytes added
};

}  // namespace

std::string sha256(std::initializer_list<std::string_view> parts) {
  Sha256 hash;
  for (const std::string_view part : parts) hash.add(part);
  return hash.hexadecimal();
}

}  // namespace pliant
