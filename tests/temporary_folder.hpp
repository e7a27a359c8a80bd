#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/files.hpp"

namespace pliant::test {

/// A folder of one test's own; gone when the test ends.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string(info->test_suite_name()) + "." + info->name() + "." + std::to_string(::getpid());
    for (char& c : name)
      if (c == '/') c = '_';
    path_ = std::filesystem::temp_directory_path() / ("pliant." + name);
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(std::string_view name) const { return path_ / name; }

  /// Writes a text file into the folder and returns its path.
  std::filesystem::path write(std::string_view name, std::string_view content) const {
    write_file(path_ / name, content);
    return path_ / name;
  }

  /// Puts a symbolic link that points at itself where `name` is, and returns its path.
  std::filesystem::path link_to_itself(std::string_view name) const {
    const std::filesystem::path path = path_ / name;
    std::filesystem::remove_all(path);
    std::filesystem::create_symlink(path.filename(), path);
    return path;
  }

 private:
  std::filesystem::path path_;
};

/// The folder of shared recordings: PLIANT_SHARED_DATA, or beside the source tree. It need not exist.
inline std::filesystem::path shared_data() {
  if (const char* folder = std::getenv("PLIANT_SHARED_DATA")) return folder;
  return std::filesystem::path(PLIANT_SOURCE_DIR) / ".." / "shared" / "data";
}

}  // namespace pliant::test
