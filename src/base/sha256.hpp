#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace pliant {

/// SHA-256 (FIPS 180-4) of the parts one after another, as 64 lower-case hexadecimal digits.
std::string sha256(std::initializer_list<std::string_view> parts);

}  // namespace pliant
