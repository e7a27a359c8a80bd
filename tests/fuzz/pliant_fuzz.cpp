// libFuzzer's program: `pliant_fuzz --reader=NAME FOLDER...`, and whatever libFuzzer takes beside; `pliant_fuzz --list`
// names the readers. See scripts/fuzz.sh.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "fuzz/fuzzed_readers.hpp"

namespace {

std::unique_ptr<const pliant::fuzz::Feeder> feeder;

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): libFuzzer's names

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  constexpr std::string_view option = "--reader=";
  char **begin = *arguments, **end = begin + *count;
  if (*count == 2 && std::string_view(begin[1]) == "--list") {
    for (const pliant::fuzz::FuzzedReader& reader : pliant::fuzz::fuzzed_readers()) std::puts(reader.name);
    std::exit(0);
  }
  char** found =
      std::find_if(begin, end, [&](const char* argument) { return std::string_view(argument).starts_with(option); });
  try {
    feeder =
        std::make_unique<pliant::fuzz::Feeder>(pliant::fuzz::fuzzed_reader(found == end ? "" : *found + option.size()));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pliant_fuzz: %s\n", error.what());
    std::exit(2);
  }
  std::atexit([] { feeder.reset(); });
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* bytes, std::size_t size) {
  (void)feeder->complaint_about({reinterpret_cast<const char*>(bytes), size});
  return 0;
}

// NOLINTEND(readability-identifier-naming)
