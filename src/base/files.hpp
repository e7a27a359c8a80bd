#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>
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

/// Whether a path leads to a file or to a folder. False, never an exception, where nobody can tell: a symbolic link
/// that points at itself, a folder that may not be entered.
bool is_file(const std::filesystem::path& path);
bool is_folder(const std::filesystem::path& path);

/// What a file's name ends with, in small letters: ".png"; empty where there is no dot.
std::string ending_of(const std::filesystem::path& path);

/// Why a path is no file that can be read, to follow the file's name in a complaint: "is not there", "is a folder", "is
/// a symbolic link that leads in a circle" and so on.
std::string why_no_file(const std::filesystem::path& path);

/// Makes a folder and those above it; nothing where it is there. Throws InputError where that cannot be.
void make_folder(const std::filesystem::path& path);

/// Removes a file if it is there. Throws InputError where it stays.
void remove_file(const std::filesystem::path& path);

}  // namespace pliant
