#include "base/files.hpp"

#include <stdexcept>

#include "base/error.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::files_test {
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

TEST(Files, ALinkThatPointsAtItselfIsNoFile) {
  const TemporaryFolder folder;
  const std::filesystem::path loop = folder.link_to_itself("loop");
  EXPECT_FALSE(is_file(loop));
  EXPECT_FALSE(is_folder(loop));
  EXPECT_FALSE(is_file(loop / "below"));
  EXPECT_EQ(why_no_file(loop), "is a symbolic link that leads in a circle");
  EXPECT_EQ(why_no_file(loop / "below"), "is a symbolic link that leads in a circle");
  EXPECT_THAT(complaint_of([&] { (void)read_file(loop); }), HasSubstr("loop: cannot be read: Too many levels"));
  EXPECT_THAT(complaint_of([&] { write_file(loop / "below", "y"); }), HasSubstr("cannot be written: Too many levels"));
  EXPECT_THAT(complaint_of([&] { make_folder(loop); }), HasSubstr("loop: the folder cannot be made"));
  EXPECT_THAT(complaint_of([&] { make_folder(loop / "below"); }), HasSubstr("below: the folder cannot be made"));
  write_file(loop, "in its place");
  EXPECT_EQ(read_file(loop), "in its place");
}

TEST(Files, ReasonsAreToldApart) {
  const TemporaryFolder folder;
  EXPECT_EQ(why_no_file(folder / "none"), "is not there");
  EXPECT_EQ(why_no_file(folder.path()), "is a folder");
  EXPECT_EQ(why_no_file("/dev/null"), "is no file");
  std::filesystem::create_symlink("none", folder / "dangling");
  EXPECT_EQ(why_no_file(folder / "dangling"), "is not there");
  folder.write("file", "x");
  EXPECT_TRUE(is_file(folder / "file"));
  EXPECT_TRUE(is_folder(folder.path()));
  std::filesystem::create_symlink("file", folder / "link");
  EXPECT_TRUE(is_file(folder / "link"));
}

TEST(Files, EndingsAreInSmallLetters) {
  EXPECT_EQ(ending_of("a.b/scan.old.PLY"), ".ply");
  EXPECT_EQ(ending_of("a.b/scan"), "");
}

TEST(Files, FoldersAreMadeOnceAndRemovedFilesAreGone) {
  const TemporaryFolder folder;
  make_folder(folder / "a/b/c");
  make_folder(folder / "a/b/c");
  EXPECT_TRUE(is_folder(folder / "a/b/c"));
  const auto file = folder.write("file", "x");
  EXPECT_THAT(complaint_of([&] { make_folder(file); }), HasSubstr("the folder cannot be made"));
  EXPECT_THAT(complaint_of([&] { remove_file(folder / "a"); }), HasSubstr("cannot be removed"));
  remove_file(file);
  remove_file(file);
  EXPECT_FALSE(is_file(file));
  remove_file(folder.link_to_itself("loop"));
  EXPECT_EQ(files_in(folder.path()), 1u);
}

}  // namespace
}  // namespace pliant::files_test
