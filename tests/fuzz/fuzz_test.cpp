#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <vector>

#include "base/files.hpp"
#include "fuzz/fuzzed_readers.hpp"

// No reader needs more at once for what is kept here: room is made by what a file holds, not by what it says.
// Not inlined: else GCC sees `free` beside a `new` that it takes for the library's.
[[gnu::noinline]] void* operator new(std::size_t size) {
  constexpr std::size_t most = std::size_t(64) << 20;
  void* const room = size <= most ? std::malloc(size > 0 ? size : 1) : nullptr;
  if (!room) throw std::bad_alloc();
  return room;
}
[[gnu::noinline]] void operator delete(void* room) noexcept { std::free(room); }
[[gnu::noinline]] void operator delete(void* room, std::size_t) noexcept { std::free(room); }

namespace pliant::fuzz_test {

namespace fs = std::filesystem;
using fuzz::Feeder;
using fuzz::FuzzedReader;

std::vector<fs::path> files_of(const std::string& kind, const FuzzedReader& reader) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry :
       fs::directory_iterator(fs::path(PLIANT_SOURCE_DIR) / "tests/fuzz" / kind / reader.name, none))
    files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

class FuzzedReaders : public ::testing::TestWithParam<const char*> {};

// What libFuzzer begins with gets beyond a reader's first lines.
TEST_P(FuzzedReaders, TakesItsCorpus) {
  const FuzzedReader& reader = fuzz::fuzzed_reader(GetParam());
  const Feeder feeder(reader);
  const std::vector<fs::path> corpus = files_of("corpus", reader);
  EXPECT_FALSE(corpus.empty());
  for (const fs::path& file : corpus) EXPECT_EQ(feeder.complaint_about(read_file(file)), "") << file;
}

// What once made a reader fail it takes or refuses.
TEST_P(FuzzedReaders, SurvivesFindings) {
  const FuzzedReader& reader = fuzz::fuzzed_reader(GetParam());
  const Feeder feeder(reader);
  for (const fs::path& file : files_of("findings", reader))
    EXPECT_NO_THROW((void)feeder.complaint_about(read_file(file))) << file;
}

std::vector<const char*> names_of_readers() {
  std::vector<const char*> names;
  for (const FuzzedReader& reader : fuzz::fuzzed_readers()) names.push_back(reader.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(All, FuzzedReaders, ::testing::ValuesIn(names_of_readers()),
                         [](const auto& reader) { return std::string(reader.param); });

TEST(Feeder, TellsARefusalFromAFault) {
  const Feeder feeder(fuzz::fuzzed_reader("ply"));
  EXPECT_THAT(feeder.complaint_about("no mesh"), ::testing::HasSubstr("surface.ply"));
  const FuzzedReader faulty{"faulty", "any", [](const fs::path&) { throw std::bad_alloc(); }};
  EXPECT_THROW((void)Feeder(faulty).complaint_about(""), std::bad_alloc);
}

}  // namespace pliant::fuzz_test
