#include "base/files.hpp"

#include <stdexcept>

#include "base/error.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using ::testing::HasSubstr;

std::size_t files_in(const std::filesystem::path& folder) {
  return std::size_t(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(Files, ComeBackByteForByte) {
  const TemporaryFolder folder;
  const std::string bytes("a\0b\r\n\xff", 6);
  write_file(folder / "deep/er/file.bin", bytes);
  EXPECT_EQ(read_file(folder / "deep/er/file.bin"), bytes);
}

TEST(Files, EmptyFileIsRead) {
  const TemporaryFolder folder;
  EXPECT_EQ(read_file(folder.write("empty", "")), "");
}

TEST(Files, AnInterruptedWriteLeavesTheOldFile) {
  const TemporaryFolder folder;
  folder.write("file", "old");
  const auto interrupted = [](std::ostream& stream) {
    stream << "half";
    throw std::runtime_error("stopped");
  };
  EXPECT_THROW(write_file(folder / "file", interrupted), std::runtime_error);
  EXPECT_EQ(read_file(folder / "file"), "old");
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(Files, SayWhyTheyCannotBeUsed) {
  const TemporaryFolder folder;
  EXPECT_THAT(complaint_of([&] { (void)read_file(folder / "none"); }), HasSubstr("No such file"));
  EXPECT_THAT(complaint_of([&] { (void)read_file(folder.path()); }), HasSubstr("it is a folder"));
  folder.write("file", "x");
  EXPECT_THAT(complaint_of([&] { write_file(folder / "file/below", "y"); }), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace pliant
