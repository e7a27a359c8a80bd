// `pliant import`: from another program's file to a capture that `pliant check` takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "apps/program.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::import_test {
namespace {

using testing::HasSubstr;

std::string data_file(const std::string& name) {
  return std::string(PLIANT_SOURCE_DIR) + "/tests/imports/data/" + name;
}

TEST(Import, MakesACaptureOfABag) {
  const TemporaryFolder folder;
  const std::string out = (folder / "bag").string();
  const ProgramRun run = run_pliant({"import", data_file("lz4.bag"), "--out", out, "--mass", "0.2", "--up", "0,-1,0"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("4 in 3.000 s"));
  EXPECT_THAT(run.out, HasSubstr("24 x 18 pixels"));
  const std::string toml = read_file(folder / "bag/capture.toml");
  EXPECT_THAT(toml, HasSubstr("# Still to say: `surface`"));
  EXPECT_THAT(toml, HasSubstr("gravity = "));
  EXPECT_EQ(toml.find("A guess"), std::string::npos);
  const ProgramRun check = run_pliant({"check", out});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  const ProgramRun again = run_pliant({"import", data_file("lz4.bag"), "--out", out});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("there already"));
}

TEST(Import, MakesACaptureOfAPhoneThatMoves) {
  const TemporaryFolder folder;
  const std::string out = (folder / "phone").string();
  const ProgramRun run = run_pliant({"import", data_file("phone.r3d"), "--out", out, "--first", "1"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(read_file(folder / "phone/capture.toml"), HasSubstr("poses = \"iphone/poses.csv\""));
  const ProgramRun check = run_pliant({"check", out});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  EXPECT_THAT(check.out, HasSubstr("moves"));
  const ProgramRun scan = run_pliant({"scan", out, "--out", (folder / "scan").string()});
  EXPECT_EQ(scan.exit_code, 2);
  EXPECT_THAT(scan.err, HasSubstr("moves while it records"));
}

TEST(Import, MakesMasksOfAVideoByWhatTheUserSays) {
  const TemporaryFolder folder;
  const std::string film = (folder / "film.avi").string(), out = (folder / "out").string();
  if (std::system("command -v ffmpeg >/dev/null && command -v ffprobe >/dev/null") != 0)
    GTEST_SKIP() << "ffmpeg is not installed: no video is made";
  ASSERT_EQ(std::system(("ffmpeg -v error -f lavfi -i color=white:s=160x120:r=25:d=0.4 -f lavfi -i "
                         "color=gray:s=40x30:r=25:d=0.4 -filter_complex 'overlay=x=10+10*n:y=40' -c:v mjpeg -q:v 2 " +
                         film + " </dev/null")
                            .c_str()),
            0);
  const ProgramRun asked = run_pliant({"import", film, "--out", out});
  EXPECT_EQ(asked.exit_code, 2);
  EXPECT_THAT(asked.err, HasSubstr("--fov DEGREES"));
  const ProgramRun run = run_pliant({"import", film, "--fov", "90", "--background", "still", "--threshold", "50",
                                     "--rate", "100", "--first", "2", "--out", out});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("8 in 0.070 s, 100 Hz"));
  EXPECT_THAT(run.out, HasSubstr("fx 80.00"));
  EXPECT_THAT(run.out, HasSubstr("--background still"));
  EXPECT_THAT(run.out, HasSubstr("by more than 50"));
  const std::string toml = read_file(folder / "out/capture.toml");
  EXPECT_THAT(toml, HasSubstr("[[silhouette]]"));
  EXPECT_THAT(toml, HasSubstr("# Still to say: `surface`"));
  const ProgramRun check = run_pliant({"check", out});
  EXPECT_EQ(check.exit_code, 2);
  EXPECT_THAT(check.err, HasSubstr("silhouettes alone, and no scan"));
  EXPECT_THAT(check.err, HasSubstr("`gravity` is unknown"));
}

TEST(Import, SaysWhatItCannotRead) {
  const TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  const ProgramRun gone = run_pliant({"import", (folder / "gone.bag").string(), "--out", out});
  EXPECT_EQ(gone.exit_code, 2);
  EXPECT_THAT(gone.err, HasSubstr("is not there"));
  folder.write("notes.txt", "no recording");
  const ProgramRun unknown = run_pliant({"import", (folder / "notes.txt").string(), "--out", out});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("--from"));
  const ProgramRun wrong = run_pliant({"import", data_file("lz4.bag"), "--from", "bagg", "--out", out});
  EXPECT_THAT(wrong.err, HasSubstr("no format `bagg`"));
}

TEST(Import, HasItsFormatsInThePageInTheOrderInWhichTheyAreTried) {
  const std::string help = run_pliant({"import", "--help"}).out;
  const std::string page = read_file(std::string(PLIANT_SOURCE_DIR) + "/docs/imports.md");
  std::size_t in_help = help.find("Formats:"), in_page = page.find("| format |");
  ASSERT_NE(in_help, std::string::npos);
  int count = 0;
  for (std::size_t at = page.find("\n| `", in_page); at != std::string::npos && at < page.find("Files that were");
       ++count) {
    const std::string name = page.substr(at + 4, page.find('`', at + 4) - at - 4);
    in_help = help.find("\n  " + name + " ", in_help);
    EXPECT_NE(in_help, std::string::npos) << name;
    at = page.find("\n| `", at + 1);
  }
  EXPECT_EQ(count, 13);
}

}  // namespace
}  // namespace pliant::test::import_test
