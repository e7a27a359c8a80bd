#include "imports/lzfse.hpp"

#include <array>
#include <bit>
#include <span>
#include <vector>

#include "imports/binary_cursor.hpp"

namespace pliant {

namespace {

// Symbols and states of the four alphabets: lengths of literals and of matches, distances, literals.
constexpr int l_symbols = 20, m_symbols = 20, d_symbols = 64, literal_symbols = 256;
constexpr int l_states = 64, m_states = 64, d_states = 256, literal_states = 1024;
constexpr int all_symbols = l_symbols + m_symbols + d_symbols + literal_symbols;
constexpr std::uint32_t most_literals = 40000, most_matches = 10000;  // of a block

int l_extra_bits(int symbol) {
  constexpr std::array last = {2, 3, 5, 8};
  return symbol < 16 ? 0 : last[std::size_t(symbol - 16)];
}
int m_extra_bits(int symbol) {
  constexpr std::array last = {3, 5, 8, 11};
  return symbol < 16 ? 0 : last[std::size_t(symbol - 16)];
}
int d_extra_bits(int symbol) { return symbol / 4; }
int no_extra_bits(int) { return 0; }

// Bits that are read from the end of a payload towards its beginning.
class BackwardBits {
 public:
  /// @param unused  bits at the end that hold nothing, 0 to 7
  BackwardBits(std::string_view payload, int unused, const BinaryCursor& place)
      : payload_(payload), place_(place), at_(std::ptrdiff_t(8 * payload.size()) - unused) {
    if (at_ < 0) place_.fail("a payload of LZFSE without bits", "compressed data");
  }
  std::uint32_t pull(int count) {
    at_ -= count;
    if (at_ < 0) place_.fail("a payload of LZFSE that is too short", "compressed data", "the file is damaged");
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) {
      const auto bit = std::size_t(at_ + i);
      value |= std::uint32_t(static_cast<unsigned char>(payload_[bit / 8]) >> (bit % 8) & 1U) << i;
    }
    return value;
  }

 private:
  std::string_view payload_;
  const BinaryCursor& place_;
  std::ptrdiff_t at_;
};

// Finite state decoder: each state names a symbol's value, and how the next state comes of the bits that follow.
class EntropyDecoder {
 public:
  EntropyDecoder(std::span<const std::uint16_t> frequencies, int states, int (*extra_bits)(int), std::uint32_t start,
                 const BinaryCursor& place)
      : state_(start) {
    std::uint32_t base = 0;
    for (int symbol = 0; symbol < int(frequencies.size()); ++symbol) {
      const int f = frequencies[std::size_t(symbol)], extra = extra_bits(symbol);
      if (f > states) place.fail("a frequency beyond the states of LZFSE", "compressed data", "the file is damaged");
      if (f > 0) {
        // The least shift by which the symbol's states fill the range, of the first states; one less of the others.
        const int shift = std::countl_zero(std::uint32_t(f)) - std::countl_zero(std::uint32_t(states));
        const int with_more = ((2 * states) >> shift) - f;
        for (int j = 0; j < f; ++j) {
          const bool is_first = j < with_more;
          entries_.push_back({base, extra, is_first ? shift : shift - 1,
                              is_first ? ((f + j) << shift) - states : (j - with_more) << (shift - 1)});
        }
      }
      base += 1U << extra;
    }
    if (int(entries_.size()) > states || state_ >= std::uint32_t(states))
      place.fail("a table of LZFSE that does not add up", "compressed data", "the file is damaged");
  }

  std::uint32_t next(BackwardBits& bits, const BinaryCursor& place) {
    if (state_ >= entries_.size())
      place.fail("a state that LZFSE does not have", "compressed data", "the file is damaged");
    const Entry& entry = entries_[state_];
    const std::uint32_t pulled = bits.pull(entry.shift + entry.extra);
    state_ = std::uint32_t(entry.delta) + (pulled >> entry.extra);
    return entry.base + (pulled & ((1U << entry.extra) - 1U));
  }

 private:
  struct Entry {
    std::uint32_t base;
    int extra, shift, delta;
  };
  std::vector<Entry> entries_;
  std::uint32_t state_;
};

// Frequencies of all symbols: small ones in few bits, by a fixed prefix code, the lowest bit first.
std::array<std::uint16_t, all_symbols> frequencies_of(std::string_view bytes, const BinaryCursor& place) {
  std::array<std::uint16_t, all_symbols> result{};
  if (bytes.empty()) return result;
  std::uint64_t bits = 0;
  int count = 0;
  std::size_t at = 0;
  for (std::uint16_t& frequency : result) {
    for (; count <= 56 && at < bytes.size(); count += 8)
      bits |= std::uint64_t(static_cast<unsigned char>(bytes[at++])) << count;
    int length = 0;
    if ((bits & 1U) == 0)  // x0: 0 or 1
      length = 2, frequency = std::uint16_t(bits >> 1 & 1U);
    else if ((bits & 2U) == 0)  // x01: 2 or 3
      length = 3, frequency = std::uint16_t(2 + (bits >> 2 & 1U));
    else if ((bits & 4U) == 0)  // xx011: 4 to 7
      length = 5, frequency = std::uint16_t(4 + (bits >> 3 & 3U));
    else if ((bits & 8U) == 0)  // xxxx0111: 8 to 23
      length = 8, frequency = std::uint16_t(8 + (bits >> 4 & 15U));
    else  // ten bits and 1111: 24 and more
      length = 14, frequency = std::uint16_t(24 + (bits >> 4 & 1023U));
    if (length > count) place.fail("a table of LZFSE that is too short", "compressed data", "the file is damaged");
    bits >>= length, count -= length;
  }
  return result;
}

void repeat(std::string& out, std::size_t distance, std::size_t length, const BinaryCursor& place) {
  if (distance == 0 || distance > out.size())
    place.fail("a distance beyond the data before", "compressed data", "the file is damaged");
  for (std::size_t i = 0; i < length; ++i) out.push_back(out[out.size() - distance]);
}

void append_entropy_block(std::string& out, std::size_t end, BinaryCursor& cursor) {
  std::uint64_t fields[3];
  for (std::uint64_t& field : fields) field = cursor.number<std::uint64_t>("a header of LZFSE");
  const auto bits_of = [&](int field, int from, int count) {
    return std::uint32_t(fields[field] >> from & ((std::uint64_t(1) << count) - 1));
  };
  const std::uint32_t literals = bits_of(0, 0, 20), literal_bytes = bits_of(0, 20, 20), matches = bits_of(0, 40, 20);
  const std::uint32_t match_bytes = bits_of(1, 40, 20), header_size = bits_of(2, 0, 32);
  constexpr std::uint32_t fixed_header = 32;
  if (literals > most_literals || matches > most_matches || header_size < fixed_header)
    cursor.fail("a header that LZFSE does not have", "compressed data", "the file is damaged");
  const auto f = frequencies_of(cursor.bytes(header_size - fixed_header, "tables of LZFSE"), cursor);
  const std::span<const std::uint16_t> all(f);
  const std::string_view literal_payload = cursor.bytes(literal_bytes, "literals of LZFSE");
  const std::string_view match_payload = cursor.bytes(match_bytes, "matches of LZFSE");

  std::string text;
  BackwardBits from(literal_payload, literals > 0 ? 7 - int(bits_of(0, 60, 3)) : 0, cursor);
  std::vector<EntropyDecoder> four;
  for (int i = 0; i < 4; ++i)
    four.emplace_back(all.subspan(l_symbols + m_symbols + d_symbols, literal_symbols), literal_states, no_extra_bits,
                      bits_of(1, 10 * i, 10), cursor);
  for (std::uint32_t i = 0; i < literals; ++i) text.push_back(char(four[i % 4].next(from, cursor)));

  BackwardBits codes(match_payload, matches > 0 ? 7 - int(bits_of(1, 60, 3)) : 0, cursor);
  EntropyDecoder l(all.subspan(0, l_symbols), l_states, l_extra_bits, bits_of(2, 32, 10), cursor);
  EntropyDecoder m(all.subspan(l_symbols, m_symbols), m_states, m_extra_bits, bits_of(2, 42, 10), cursor);
  EntropyDecoder d(all.subspan(l_symbols + m_symbols, d_symbols), d_states, d_extra_bits, bits_of(2, 52, 10), cursor);
  std::size_t taken = 0, distance = 0;
  for (std::uint32_t i = 0; i < matches; ++i) {
    const std::size_t literal_length = l.next(codes, cursor), match_length = m.next(codes, cursor);
    if (const std::size_t next = d.next(codes, cursor)) distance = next;
    if (literal_length > text.size() - taken || literal_length + match_length > end - out.size())
      cursor.fail("a block of LZFSE that is longer than it says", "compressed data", "the file is damaged");
    out.append(text, taken, literal_length);
    taken += literal_length;
    if (match_length > 0) repeat(out, distance, match_length, cursor);
  }
}

// LZVN: an operation a byte or two, with the number of literals that follow it, and a match among what was made before.
void append_lzvn_block(std::string& out, std::size_t end, std::string_view payload, const BinaryCursor& place) {
  BinaryCursor cursor(payload, place.file(), place.position() - payload.size());
  std::size_t distance = 0;
  const auto byte = [&] { return std::size_t(cursor.number<std::uint8_t>("an operation of LZVN")); };
  while (true) {
    const std::size_t op = byte();
    std::size_t literals = op >> 6, length = (op >> 3 & 7) + 3;
    if (op == 0x06) return;
    if (op == 0x0e || op == 0x16) continue;
    if ((op & 0xf0) == 0xe0) {  // literals alone
      literals = op == 0xe0 ? byte() + 16 : op & 15, length = 0;
    } else if ((op & 0xf0) == 0xf0) {  // a match alone
      literals = 0, length = op == 0xf0 ? byte() + 16 : op & 15;
    } else if ((op & 0xf0) == 0x70 || (op & 0xf0) == 0xd0 || (op < 0x40 && (op & 7) == 6)) {
      cursor.fail("an operation that LZVN does not have", "compressed data", "the file is damaged");
    } else if ((op & 0xe0) == 0xa0) {
      const std::size_t low = byte(), more = byte() << 8 | low;
      literals = op >> 3 & 3, length = ((op & 7) << 2 | (more & 3)) + 3, distance = more >> 2;
    } else if ((op & 7) == 7) {
      const std::size_t low = byte();
      distance = byte() << 8 | low;
    } else if ((op & 7) != 6) {
      distance = (op & 7) << 8 | byte();
    }
    if (literals + length > end - out.size())
      cursor.fail("a block of LZVN that is longer than it says", "compressed data", "the file is damaged");
    out += cursor.bytes(literals, "literals of LZVN");
    if (length > 0) repeat(out, distance, length, cursor);
  }
}

}  // namespace

std::string lzfse_decompressed(std::string_view data, std::size_t largest, const std::filesystem::path& source) {
  BinaryCursor cursor(data, source);
  std::string out;
  while (true) {
    const std::string_view kind = cursor.bytes(4, "a block of LZFSE");
    if (kind == "bvx$") return out;
    const std::size_t size = cursor.number<std::uint32_t>("the size of a block");
    if (size > largest - out.size())
      cursor.fail("a block of " + std::to_string(size) + " bytes", "at most " + std::to_string(largest) + " in all");
    const std::size_t end = out.size() + size;
    if (kind == "bvx-") {
      out += cursor.bytes(size, "a stored block");
    } else if (kind == "bvxn") {
      const auto packed = cursor.number<std::uint32_t>("the size of a block");
      const std::string_view payload = cursor.bytes(packed, "a block of LZVN");
      append_lzvn_block(out, end, payload, cursor);
    } else if (kind == "bvx2") {
      append_entropy_block(out, end, cursor);
    } else {
      cursor.fail("a block that is none of LZFSE's", "bvx2, bvxn, bvx- or bvx$", "the file is damaged");
    }
    if (out.size() != end)
      cursor.fail("a block of LZFSE that is shorter than it says", "compressed data", "the file is damaged");
  }
}

}  // namespace pliant
