// Times of frames as recorders write them.
#include "imports/time_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/frame_numbers.hpp"
#include "import_tools.hpp"

namespace pliant::time_list_test {
namespace {

using namespace test;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Four frames at 60 Hz, one of them late, as lines.
constexpr double seconds[] = {1650000000.0, 1650000000.016667, 1650000000.033333, 1650000000.066667};

struct Written {
  const char* name;
  std::string heading;
  std::string (*line)(int frame);
  const char* says;  // a note; "": none
};

void PrintTo(const Written& written, std::ostream* stream) { *stream << written.name; }

std::string formatted(const char* format, auto... values) {
  char text[128];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

class TimeLists : public ::testing::TestWithParam<Written> {};

TEST_P(TimeLists, AreReadInSeconds) {
  const Written& written = GetParam();
  const TemporaryFolder folder;
  std::string text = written.heading;
  for (int i = 0; i < 4; ++i) text += written.line(i) + "\n";
  std::vector<std::string> notes;
  const std::vector<double> times = read_time_list(folder.write("timestamps.txt", text), {}, {}, notes);
  ASSERT_EQ(times.size(), 4u);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(times[std::size_t(i)], seconds[i] - seconds[0], 2e-6) << i;
  if (*written.says == 0)
    EXPECT_THAT(notes, IsEmpty());
  else
    EXPECT_THAT(notes, ElementsAre(HasSubstr(written.says)));
}

INSTANTIATE_TEST_SUITE_P(
    Recorders, TimeLists,
    ::testing::Values(
        Written{"Seconds", "", [](int i) { return formatted("%.6f", seconds[i]); }, ""},
        Written{"Milliseconds", "", [](int i) { return formatted("%.3f", 1e3 * (seconds[i] - 1.65e9) + 768753.3); },
                "taken for ms"},
        Written{"Microseconds", "", [](int i) { return formatted("%.0f", 1e6 * seconds[i]); }, "taken for us"},
        Written{"Nanoseconds", "", [](int i) { return formatted("%.0f", 1e9 * seconds[i]); }, "taken for ns"},
        Written{"UnitInABracket", "#timestamp [ns],filename\n",
                [](int i) { return formatted("%.0f,%06d.png", 1e9 * seconds[i], i); }, ""},
        Written{"UnitInTheTitle", "frame,time_ms\n",
                [](int i) { return formatted("%d,%.3f", i, 1e3 * (seconds[i] - seconds[0])); }, ""},
        Written{"Heading", "timestamp\n", [](int i) { return formatted("%.6f", seconds[i]); }, ""},
        Written{"NumberBefore", "", [](int i) { return formatted("%d %.6f", i, seconds[i]); }, ""},
        Written{"NumberBehind", "", [](int i) { return formatted("%.6f, %d", seconds[i], 100 + i); }, ""},
        Written{"DecimalComma", "Bild;Zeit\n",
                [](int i) {
                  std::string line = formatted("%d;%.6f", i, seconds[i]);
                  line[line.rfind('.')] = ',';
                  return line;
                },
                ""},
        Written{"SecondsAndNanoseconds", "",
                [](int i) { return formatted("%d %09.0f", 1650000000, 1e9 * (seconds[i] - 1.65e9)); }, ""},
        Written{"TimeOfTheDay", "",
                [](int i) { return formatted("2024-05-01 12:30:%09.6f", 5.0 + seconds[i] - seconds[0]); }, ""}),
    [](const auto& written) { return written.param.name; });

std::string said_of(const std::string& text, const ImportOptions& options = {}, std::optional<double> rate = {}) {
  const TemporaryFolder folder;
  std::vector<std::string> notes;
  return complaint_of([&] { (void)read_time_list(folder.write("timestamps.txt", text), rate, options, notes); });
}

TEST(TimeList, RefusesWhatIsNoTime) {
  EXPECT_THAT(said_of("0\n1\n2\n3\n"), HasSubstr("numbers of frames, and no times"));
  EXPECT_THAT(said_of("0.1\nx\n"), HasSubstr("timestamps.txt"));
  EXPECT_THAT(said_of(""), HasSubstr("no time"));
  EXPECT_THAT(said_of("0.5\n0.5\n0.5\n"), HasSubstr("no column of times that grow"));
  EXPECT_THAT(said_of("5e12\n1e13\n2e13\n"), HasSubstr("--time-unit"));
}

TEST(TimeList, TakesTheUnitThatTheUserSays) {
  const TemporaryFolder folder;
  std::vector<std::string> notes;
  ImportOptions options;
  options.time_unit = "s";
  const auto times = read_time_list(folder.write("t.txt", "0\n5.5\n11.5\n"), {}, options, notes);
  EXPECT_THAT(times, ElementsAre(0.0, 5.5, 11.5));
  EXPECT_THAT(notes, IsEmpty());
}

TEST(TimeList, TakesTheUnitThatTheCamerasRateTells) {
  const TemporaryFolder folder;
  std::vector<std::string> notes;
  // Without the rate 0.5 between frames would be two frames a second.
  const auto times = read_time_list(folder.write("t.txt", "0\n0.5\n1.0\n"), 2000.0, {}, notes);
  EXPECT_NEAR(times[2], 1e-3, 1e-12);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("taken for ms")));
}

TEST(ImageFolder, TakesGapsInTheNumbersForGapsInTime) {
  const TemporaryFolder folder;
  for (const int i : {10, 11, 14, 15}) write_png(folder / ("in/" + std::to_string(i) + ".png"), ramp_image(24, 18, i));
  folder.write(
      "in/camera.json",
      R"({"width": 24, "height": 18, "fx": 30, "fy": 31, "cx": 11.5, "cy": 8.5, "depth_scale": 1000, "fps": 50})");
  const auto recording = import_format("", folder / "in").read(folder / "in", {});
  const auto made = write_recording(folder / "out", recording, {});
  const Capture capture = read_capture(folder / "out");
  ASSERT_EQ(capture.frame_count(), 4);
  EXPECT_NEAR(capture.scene.timing.times[2], 4.0 / 50.0, 1e-9);
  EXPECT_THAT(made.notes, ::testing::Contains(HasSubstr("2 of 6 frames are missing")));
}

TEST(ImageFolder, TellsImagesThatRepeat) {
  const TemporaryFolder folder;
  for (int i = 0; i < 4; ++i)
    write_png(folder / ("in/" + std::to_string(i) + ".png"), ramp_image(24, 18, i == 3 ? 2 : i));
  folder.write(
      "in/camera.json",
      R"({"width": 24, "height": 18, "fx": 30, "fy": 31, "cx": 11.5, "cy": 8.5, "depth_scale": 1000, "fps": 50})");
  const auto made = write_recording(folder / "out", import_format("", folder / "in").read(folder / "in", {}), {});
  EXPECT_THAT(made.notes, ::testing::Contains(HasSubstr("repeat the one before, to the last bit: 3")));
}

TEST(ImageFolder, TakesNamesThatAreTimes) {
  const TemporaryFolder folder;
  for (const char* name : {"1650000000016", "1650000000033", "1650000000083"})
    write_png(folder / (std::string("in/") + name + ".png"), ramp_image(24, 18, 0));
  folder.write("in/camera.json",
               R"({"width": 24, "height": 18, "fx": 30, "fy": 31, "cx": 11.5, "cy": 8.5, "depth_scale": 1000})");
  const auto recording = import_format("", folder / "in").read(folder / "in", {});
  EXPECT_THAT(recording.depth.front().times,
              ElementsAre(0.0, ::testing::DoubleNear(0.017, 1e-9), ::testing::DoubleNear(0.067, 1e-9)));
}

TEST(MarkerCsv, TakesTimesInMillisecondsAndGapsInThem) {
  const TemporaryFolder folder;
  const auto file = folder.write("m.csv", "time_ms,a_x_mm,a_y_mm,a_z_mm\n0,1,2,3\n10,1,2,3\n20,1,2,3\n50,1,2,4\n");
  const ImportedRecording recording = import_format("markers", file).read(file, {});
  EXPECT_NEAR(*recording.markers->frame_rate, 100.0, 1e-9);
  ASSERT_EQ(recording.markers->frames.size(), 6u);
  EXPECT_TRUE(std::isnan(recording.markers->frames[3](0, 0)));
  EXPECT_NEAR(recording.markers->frames[5](0, 2), 0.004, 1e-12);
  EXPECT_THAT(recording.notes, ElementsAre(HasSubstr("2 of 6 frames are missing")));
}

TEST(PeriodsOf, CountByTheUsualStep) {
  EXPECT_THAT(periods_of(std::vector<long long>{5, 10, 15, 25}), ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(periods_of(std::vector<long long>{0, 16, 33, 50}), IsEmpty()) << "numbers that are times";
}

}  // namespace
}  // namespace pliant::time_list_test
