#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

// The programs ffmpeg and ffprobe, which take films apart.

namespace pliant {

/// What a program writes, while it runs; it is waited for in the end.
using ProgramPipe = std::unique_ptr<FILE, int (*)(FILE*)>;

/// Starts a command of the shell. Throws std::runtime_error where no process can be started.
ProgramPipe open_pipe(const std::string& command);

/// All that a command writes. Throws as `open_pipe` does.
std::string output_of(const std::string& command);

/// A text as one word of the shell.
std::string shell_word(const std::string& text);

/// A file as an argument of ffmpeg: whole, so that a name that begins with a dash is a file all the same.
std::string ffmpeg_argument(const std::filesystem::path& file);

/// Whether both programs are installed.
bool has_ffmpeg();

/// Throws InputError, with `otherwise` as what else a user can do, where they are not.
void require_ffmpeg(const std::filesystem::path& file, const std::string& otherwise);

/// What ffprobe says of a file, as an object: {"streams": [...]} and what else `entries` asks for, such as
/// "-show_streams -show_format". Null where it can make nothing of the file.
nlohmann::json probed(const std::filesystem::path& file, const std::string& entries);

}  // namespace pliant
