#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace pliant {

/// Base64 of bytes (RFC 4648, with padding, one line).
std::string encode_base64(std::string_view bytes);

/// The bytes of a padded base64 text; white space is skipped. Nothing where a character or the padding is wrong.
std::optional<std::string> decode_base64(std::string_view text);

}  // namespace pliant
