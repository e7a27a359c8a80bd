#include "base/files.hpp"

#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "base/error.hpp"

namespace pliant {

namespace fs = std::filesystem;

void write_file(const fs::path& path, const std::function<void(std::ostream&)>& write) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  const fs::path temporary = path.string() + "." + std::to_string(::getpid()) + ".tmp";
  const auto fail = [&](const std::string& why) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw InputError({{path}, "cannot be written: " + why, "", "check that the folder exists and has room"});
  };
  errno = 0;
  std::ofstream stream(temporary, std::ios::binary);
  if (!stream) fail(std::strerror(errno));
  try {
    write(stream);
  } catch (...) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw;
  }
  stream.close();
  if (!stream) fail(std::strerror(errno));
  fs::rename(temporary, path, error);
  if (error) fail(error.message());
}

void write_file(const fs::path& path, std::string_view content) {
  write_file(path, [&](std::ostream& stream) { stream.write(content.data(), std::streamsize(content.size())); });
}

std::string read_file(const fs::path& path) {
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  const int error = errno;
  std::ostringstream content;
  const bool is_readable = stream && !is_folder(path);
  if (is_readable) content << stream.rdbuf();
  if (!is_readable || !stream) {
    const std::string why = is_folder(path) ? "it is a folder" : std::strerror(error ? error : ENOENT);
    throw InputError(
        {{path}, "cannot be read: " + why, "a file", "check the path, what it links to and its permissions"});
  }
  return std::move(content).str();
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = char(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

std::string why_no_file(const fs::path& path) {
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  if (error == std::errc::too_many_symbolic_link_levels) return "is a symbolic link that leads in a circle";
  if (type == fs::file_type::not_found) return "is not there";
  if (error) return "cannot be reached: " + error.message();
  return type == fs::file_type::directory ? "is a folder" : "is no file";
}

void make_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (is_folder(path)) return;
  const std::string why = error ? error.message() : why_no_file(path);
  throw InputError({{path},
                    "the folder cannot be made: " + why,
                    "a folder, or a name that is free",
                    "name another folder, or remove what is there"});
}

void remove_file(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error)
    throw InputError({{path}, "cannot be removed: " + error.message(), "a file", "remove it, or name another folder"});
}

}  // namespace pliant
