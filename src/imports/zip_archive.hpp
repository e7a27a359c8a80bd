#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "imports/recording.hpp"

namespace pliant {

/// A zip archive of stored and deflated files (PKWARE's APPNOTE), of less than 4 GB. Files are read one by one.
class ZipArchive {
 public:
  /// Reads the directory. Throws InputError for what is no such archive.
  explicit ZipArchive(const std::filesystem::path& file);

  bool has(const std::string& name) const { return entries_.contains(name); }
  /// Content of a file in it. Throws InputError where it is not there, or damaged.
  std::string read(const std::string& name) const;
  const std::filesystem::path& file() const { return file_; }

 private:
  struct Entry {
    std::size_t at, packed, size;
    int method;
    std::uint32_t crc;
  };
  std::string bytes(std::size_t at, std::size_t count, const char* what) const;

  std::filesystem::path file_;
  std::size_t size_ = 0;
  std::map<std::string, Entry> entries_;
};

}  // namespace pliant
