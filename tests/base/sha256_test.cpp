#include "base/sha256.hpp"

#include <gtest/gtest.h>

#include <string>

namespace pliant::sha256_test {
namespace {

/// The examples that NIST publishes for FIPS 180-4.
TEST(Sha256, OfThePublishedMessages) {
  EXPECT_EQ(sha256({}), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256({""}), sha256({}));
  EXPECT_EQ(sha256({"abc"}), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256({"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"}),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256({std::string(1'000'000, 'a')}), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

/// Padding begins in the last block, fills it, or needs one more: lengths about 56 and 64 bytes.
TEST(Sha256, DoesNotDependOnWhereThePartsAreCut) {
  for (const std::size_t size : {1U, 55U, 56U, 57U, 63U, 64U, 65U, 119U, 120U, 128U}) {
    std::string text;
    for (std::size_t i = 0; i < size; ++i) text += char(200 + 7 * i);
    const std::string whole = sha256({text});
    for (std::size_t cut = 0; cut <= size; ++cut)
      EXPECT_EQ(sha256({std::string_view(text).substr(0, cut), std::string_view(text).substr(cut)}), whole) << size;
    text.back() ^= 1;
    EXPECT_NE(sha256({text}), whole);
  }
}

/// Bytes above 127, as other programs hash them.
TEST(Sha256, OfBytes) {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += char(i);
  EXPECT_EQ(sha256({bytes}), "40aff2e9d2d8922e47afd4648e6967497158785fbd1da870e7110266bf944880");
}

}  // namespace
}  // namespace pliant::sha256_test
