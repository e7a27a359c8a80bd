#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace pliant::fuzz {

/// A reader of files as it is fed with any bytes.
struct FuzzedReader {
  const char* name;
  const char* file;  ///< that holds the bytes; where a recording is a folder, as it is called there
  /// Reads the file and whatever it leads to. Throws InputError for what cannot be used; anything else that it throws,
  /// or does, is a fault.
  void (*read)(const std::filesystem::path& file);
};

std::span<const FuzzedReader> fuzzed_readers();

/// The reader of that name. Throws std::invalid_argument that lists all names where there is none.
const FuzzedReader& fuzzed_reader(std::string_view name);

/// Bytes before a reader, in a folder of their own, which lies in memory where it can: beside the file stands what
/// `tests/fuzz/surroundings/NAME` has.
class Feeder {
 public:
  explicit Feeder(const FuzzedReader& reader);
  ~Feeder();
  Feeder(const Feeder&) = delete;
  Feeder& operator=(const Feeder&) = delete;

  /// What the reader's InputError says of these bytes; empty where it takes them. Passes on what else it throws.
  std::string complaint_about(std::string_view bytes) const;

 private:
  const FuzzedReader& reader_;
  std::filesystem::path folder_;
};

}  // namespace pliant::fuzz
