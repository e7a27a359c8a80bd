// Markers: C3D files that ezc3d and Python's c3d wrote (data/README.md), CSV written here, and real files beside the
// source tree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/markers.hpp"
#include "import_tools.hpp"

namespace pliant::marker_import_test {

using namespace test;
using ::testing::HasSubstr;

class C3dFiles : public ::testing::TestWithParam<const char*> {};

TEST_P(C3dFiles, BecomeMarkersInMetres) {
  const TemporaryFolder folder;
  CaptureFacts facts;
  facts.first = 1, facts.up = Vector3(0, 0, 1);
  const Capture capture = imported(import_data(GetParam()), folder / "out", "", {}, facts);
  EXPECT_EQ(capture.frame_count(), 4);
  EXPECT_NEAR(capture.scene.timing.frame_rate, 200.0, 1e-6);
  const MarkerSet markers = read_markers(capture.markers.front(), capture.frame_count());
  EXPECT_EQ(markers.ids, (std::vector<std::string>{"tip", "side", "base"}));
  EXPECT_NEAR((Vector3(markers.rest.row(0)) - Vector3(0.011, 0.022, 0.0305)).norm(), 0.0, 1e-7);
  EXPECT_FALSE(markers.is_seen(2, 1));
  EXPECT_TRUE(markers.is_seen(3, 1));
  EXPECT_NEAR((Vector3(markers.frames[3].row(2)) - Vector3(0.074, -0.072, 0.0925)).norm(), 0.0, 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Writers, C3dFiles, ::testing::Values("ezc3d.c3d", "py_c3d.c3d"));

TEST(MarkerCsv, TakesRowsOfMarkersWithARate) {
  const TemporaryFolder folder;
  folder.write("m.csv", "frame,id,x,y,z\n0,a,0,0,0\n0,b,1,2,3\n2,a,0.5,0,0\n");
  EXPECT_EQ(import_format("", folder / "m.csv").name, "markers");
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "m.csv", folder / "out"); }), HasSubstr("--rate"));
  ImportOptions options;
  options.frame_rate = 50.0;
  const Capture capture = imported(folder / "m.csv", folder / "out", "", options);
  ASSERT_EQ(capture.frame_count(), 3);
  const MarkerSet markers = read_markers(capture.markers.front(), 3);
  EXPECT_EQ(markers.frames[2](0, 0), 0.5);
  EXPECT_FALSE(markers.is_seen(2, 1));
  EXPECT_EQ(markers.rest(1, 2), 3.0);
}

TEST(MarkerCsv, RefusesFramesThatTheFileCannotMean) {
  const TemporaryFolder folder;
  folder.write("far.csv", "frame,id,x,y,z\n0,a,0,0,0\n9999999,a,0,0,0\n");
  EXPECT_THAT(complaint_of([&] { (void)read_marker_csv(folder / "far.csv", {}); }),
              HasSubstr("10000000 frames of markers"));
  folder.write("late.csv", "time_s,a_x_m,a_y_m,a_z_m\n0,0,0,0\n1,0,0,0\n2,0,0,0\n9000000,0,0,0\n");
  EXPECT_THAT(complaint_of([&] { (void)read_marker_csv(folder / "late.csv", {}); }),
              HasSubstr("9000001 frames of markers"));
}

TEST(MarkerCsv, TakesColumnsWithUnitsAndTimes) {
  const TemporaryFolder folder;
  folder.write("m.csv",
               "Time (s),tip X (mm),tip Y (mm),tip Z (mm),base_x_cm,base_y_cm,base_z_cm\n"
               "2.00,10,20,30,1,2,3\n2.01,11,20,30,,,\n2.02,12,20,30,1,2,4\n");
  const Capture capture = imported(folder / "m.csv", folder / "out");
  EXPECT_NEAR(capture.scene.timing.frame_rate, 100.0, 1e-6);
  const MarkerSet markers = read_markers(capture.markers.front(), 3);
  EXPECT_EQ(markers.ids, (std::vector<std::string>{"tip", "base"}));
  EXPECT_NEAR(markers.frames[1](0, 0), 0.011, 1e-9);
  EXPECT_FALSE(markers.is_seen(1, 1));
  EXPECT_NEAR(markers.frames[2](1, 2), 0.04, 1e-9);
  folder.write("m.csv", "time,a_x,a_y,a_z\n0,1,2,3\n1,1,2,3\n");
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "m.csv", folder / "no"); }), HasSubstr("without a unit"));
  folder.write("m.csv", "time,a_x_m,a_y_m,a_z_m\n0,1,2,3\n0.1,1,2,3\n0.4,1,2,3\n");
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "m.csv", folder / "no"); }), HasSubstr("not even"));
  folder.write("m.csv", "time,a_x_m,a_y_m,a_z_m\n0,1,2,3\n0.1,1,two,3\n");
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "m.csv", folder / "no"); }), HasSubstr("m.csv:3"));
}

TEST(MarkerCsv, ReadsARealRecordingAsItsC3dFile) {
  const std::filesystem::path beam = shared_data() / "silicone-beam-mocap";
  if (!is_folder(beam)) GTEST_SKIP() << "no folder " << beam;
  const TemporaryFolder folder;
  const Capture csv = imported(beam / "beam_gravity_V2_a.csv", folder / "csv");
  const Capture c3d = imported(beam / "c3d/beam_gravity_V2_a.c3d", folder / "c3d");
  EXPECT_NEAR(csv.scene.timing.frame_rate, c3d.scene.timing.frame_rate, 0.1);
  const MarkerSet a = read_markers(csv.markers.front(), csv.frame_count());
  const MarkerSet b = read_markers(c3d.markers.front(), c3d.frame_count());
  ASSERT_EQ(a.marker_count(), 6);  // tip1 .. base3, in the C3D file "Tip - 1" .. "Base - 3"
  ASSERT_EQ(b.marker_count(), 6);
  EXPECT_EQ(b.ids.front(), "Tip - 1");
  constexpr double rounding = 1e-5;  // of the CSV file's numbers
  for (const std::size_t frame : {std::size_t(0), std::size_t(37), std::size_t(200)})
    EXPECT_LT((a.frames[frame] - b.frames[frame]).cwiseAbs().maxCoeff(), rounding);
}

}  // namespace pliant::marker_import_test
