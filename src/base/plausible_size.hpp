#pragma once

#include <cstddef>
#include <string>

#include "base/error.hpp"

namespace pliant {

/// Throws InputError where a file asks for far more room than its size bears out, before that room is made: for more
/// than 16 MB, and more than 1032 bytes for each of its own, which is the most that deflate makes of them.
/// @param held    bytes of the file, or of that part of it
/// @param needed  bytes of what it says that it holds
/// @param what    that is, for people
void require_plausible_size(std::size_t held, std::size_t needed, const Place& place, const std::string& what);

}  // namespace pliant
