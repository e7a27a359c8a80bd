// Markers of real recordings. Their tables have a column for each marker and axis; a test turns them into tracks.

#include <cmath>
#include <filesystem>
#include <sstream>

#include "capture/c3d.hpp"
#include "capture/markers.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::shared_markers_test {
namespace {

namespace fs = std::filesystem;
using test::shared_data;
using test::TemporaryFolder;

constexpr double last_digit = 1e-5;  // [m] of the tables

/// A table `frame,time_s,tip1_x_m,tip1_y_m,tip1_z_m,...`.
struct WideTable {
  std::vector<std::string> ids;
  std::vector<Points> frames;
};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

WideTable read_wide_table(const fs::path& path) {
  WideTable table;
  std::istringstream lines(read_file(path));
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> header = cells_of(line);
  for (std::size_t column = 2; column < header.size(); column += 3)
    table.ids.push_back(header[column].substr(0, header[column].find('_')));
  while (std::getline(lines, line)) {
    const std::vector<std::string> cells = cells_of(line);
    Points& frame = table.frames.emplace_back(Eigen::Index(table.ids.size()), 3);
    for (Eigen::Index i = 0; i < frame.size(); ++i) frame.data()[i] = std::stod(cells[2 + std::size_t(i)]);
  }
  return table;
}

// "Tip - 1" of the C3D files is "tip1" of the tables.
std::string table_id(std::string label) {
  std::erase_if(label, [](char c) { return c == ' ' || c == '-'; });
  label[0] = char(std::tolower(static_cast<unsigned char>(label[0])));
  return label;
}

class SharedBeam : public ::testing::TestWithParam<const char*> {};

TEST_P(SharedBeam, C3dAgreesWithItsTable) {
  const fs::path folder = shared_data() / "silicone-beam-mocap";
  if (!fs::exists(folder)) GTEST_SKIP() << "no shared recording " << folder;
  const C3dTrajectories c3d = read_c3d(folder / "c3d" / (std::string(GetParam()) + ".c3d"));
  const WideTable table = read_wide_table(folder / (std::string(GetParam()) + ".csv"));
  EXPECT_EQ(c3d.frame_rate, 100.0);
  ASSERT_EQ(c3d.labels.size(), table.ids.size());
  ASSERT_EQ(c3d.frames.size(), table.frames.size());
  double greatest = 0.0;
  for (std::size_t i = 0; i < table.ids.size(); ++i) EXPECT_EQ(table_id(c3d.labels[i]), table.ids[i]);
  for (std::size_t f = 0; f < table.frames.size(); ++f) {
    ASSERT_TRUE(c3d.frames[f].allFinite()) << "no sample is missing, says the recording's README";
    greatest = std::max(greatest, (c3d.frames[f] - table.frames[f]).cwiseAbs().maxCoeff());
  }
  RecordProperty("greatest_difference_um", std::to_string(1e6 * greatest));
  EXPECT_LE(greatest, 0.5 * last_digit + 1e-8) << "what rounding to the table's last digit leaves";
}

INSTANTIATE_TEST_SUITE_P(Recordings, SharedBeam,
                         ::testing::Values("beam_gravity_V2_a", "beam_gravity_V2_b", "beam_load52_V2_a",
                                           "beam_load52_V2_b"),
                         [](const auto& name) { return std::string(name.param); });

class SharedTracks : public ::testing::TestWithParam<const char*> {};

// C3D or table, as a track of the format: the same markers come out.
TEST_P(SharedTracks, AreReadAsTracks) {
  const fs::path path = shared_data() / GetParam();
  if (!fs::exists(path)) GTEST_SKIP() << "no shared recording " << path;
  const WideTable table = read_wide_table(path);
  const TemporaryFolder folder;
  write_marker_positions(folder / "rest.csv", {table.ids, table.frames[0]});
  write_marker_track(folder / "track.csv", table.ids, table.frames);
  const MarkerSet set = read_markers({folder / "rest.csv", folder / "track.csv"}, int(table.frames.size()));
  EXPECT_EQ(set.ids, table.ids);
  ASSERT_EQ(set.frames.size(), table.frames.size());
  for (std::size_t f = 0; f < set.frames.size(); ++f) ASSERT_EQ(set.frames[f], table.frames[f]) << "frame " << f;
}

INSTANTIATE_TEST_SUITE_P(Recordings, SharedTracks,
                         ::testing::Values("silicone-beam-mocap/beam_gravity_V2_a.csv",
                                           "soft-arm-mocap/step_100mbar.csv", "soft-arm-mocap/step_450mbar.csv"),
                         [](const auto& name) {
                           const std::string stem = fs::path(name.param).stem();
                           return stem;
                         });

TEST(SharedBeamTrack, C3dIsMatchedWithMarkersAtRest) {
  const fs::path beam = shared_data() / "silicone-beam-mocap";
  if (!fs::exists(beam)) GTEST_SKIP() << "no shared recording " << beam;
  const TemporaryFolder folder;
  folder.write("rest.csv", "id,x,y,z\nTip - 3,0,0.036,0.006\nTip - 1,0,0.015,0.036\n");
  const MarkerSet set = read_markers({folder / "rest.csv", beam / "c3d/beam_load52_V2_a.c3d"}, 600);
  const WideTable table = read_wide_table(beam / "beam_load52_V2_a.csv");
  EXPECT_EQ(set.left_out.size(), 4u) << "another tip marker and those on the clamp";
  EXPECT_LE((set.frames[599].row(0) - table.frames[599].row(2)).cwiseAbs().maxCoeff(), 0.5 * last_digit + 1e-8);
  EXPECT_LE((set.frames[599].row(1) - table.frames[599].row(0)).cwiseAbs().maxCoeff(), 0.5 * last_digit + 1e-8);
}

TEST(SharedPresses, MarkersAreMatched) {
  const fs::path path = shared_data() / "oracle-press";
  if (!fs::exists(path)) GTEST_SKIP() << "no shared recording " << path;
  const Capture capture = read_capture(path);
  ASSERT_EQ(capture.presses.size(), 32u);
  int seen = 0, all = 0;
  for (const Press& press : capture.presses) {
    const MarkerSet set = read_marker_pair(press.markers_rest, press.markers);
    all += set.marker_count();
    for (int i = 0; i < set.marker_count(); ++i) {
      if (!set.is_seen(0, i)) continue;
      ++seen;
      EXPECT_LT((set.frames[0].row(i) - set.rest.row(i)).norm(), 0.05) << "half the block's height";
    }
  }
  EXPECT_GT(seen, 0.9 * all);
  EXPECT_LT(seen, all) << "the probe hides some";
}

}  // namespace
}  // namespace pliant::shared_markers_test
