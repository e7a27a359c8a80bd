#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace pliant {

/// Decompresses Apple's LZFSE: blocks `bvx-` (stored), `bvx1` and `bvx2` (finite state entropy) and `bvxn` (LZVN), up
/// to `bvx$`. By the format as the reference implementation's header describes it (lzfse_internal.h).
/// @param largest  bytes that the result may have at most
/// @param source   stands for the file in complaints
/// Throws InputError for data that are cut short or damaged, and for more than `largest` bytes.
std::string lzfse_decompressed(std::string_view data, std::size_t largest, const std::filesystem::path& source);

}  // namespace pliant
