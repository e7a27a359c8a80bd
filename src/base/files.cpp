#include "base/files.hpp"

#include <unistd.h>

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
  std::ostringstream content;
  if (stream && !fs::is_directory(path)) content << stream.rdbuf();
  if (!stream || fs::is_directory(path)) {
    const std::string why = fs::is_directory(path) ? "it is a folder" : std::strerror(errno ? errno : ENOENT);
    throw InputError({{path}, "cannot be read: " + why, "", ""});
  }
  return std::move(content).str();
}

}  // namespace pliant
