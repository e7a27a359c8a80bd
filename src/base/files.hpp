#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string_view>

namespace pliant {

/// Writes a file so that a reader never sees half of it: `write` fills a stream to a temporary name beside `path`,
/// which is then renamed. Missing parent folders are made.
/// Throws InputError where the file cannot be written; then nothing is left behind and an old file stays as it was.
void write_file(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write);

/// The same for a text or bytes already at hand.
void write_file(const std::filesystem::path& path, std::string_view content);

/// The whole content of a file. Throws InputError where it cannot be read.
std::string read_file(const std::filesystem::path& path);

}  // namespace pliant
