#include "capture/survey.hpp"

#include <random>

#include "base/files.hpp"
#include "capture/small_capture.hpp"

namespace pliant::survey_test {
namespace {

using test::SmallCapture;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

Survey surveyed(const Capture& capture) { return survey(capture, observe(capture)); }

Identifiability identifiability_of(const SmallCapture& small) {
  const Capture capture = small.read();
  return identifiability(capture, surveyed(capture));
}

TEST(SurveyTest, SeesMotionAndPlane) {
  SmallCapture small;
  const Survey seen = surveyed(small.read());
  EXPECT_EQ(seen.points.median, 256);
  EXPECT_TRUE(seen.moves);
  EXPECT_NEAR(seen.travel, 0.18, 0.01);
  EXPECT_EQ(seen.first_contact, std::nullopt);
  ASSERT_TRUE(seen.planes.at(0).seen);
  EXPECT_LT(seen.planes[0].angle, 2e-3);
  EXPECT_TRUE(seen.seen_share.has_value());
}

TEST(SurveyTest, CountsImagesThatRepeatAfterTheStart) {
  SmallCapture small;  // which starts at frame 1
  EXPECT_THAT(surveyed(small.read()).repeated_images.at(0), ::testing::IsEmpty());
  const auto image = [&](int frame) { return small.folder / ("front/00000" + std::to_string(frame) + ".png"); };
  write_file(image(1), read_file(image(0)));
  write_file(image(3), read_file(image(2)));
  EXPECT_THAT(surveyed(small.read()).repeated_images.at(0), ElementsAre(3));
}

TEST(SurveyTest, SeesContact) {
  SmallCapture small;
  small.edit("point = [0.0, 0.5, 0.0]", "point = [0.0, 0.2, 0.0]");
  EXPECT_EQ(surveyed(small.read()).first_contact, 3);
}

/// The small capture followed by four markers instead of a camera. One is hidden in the last frame, all in the one
/// before, and a fifth is never seen. They fall in the last frame alone.
struct CaptureWithMarkers : SmallCapture {
  explicit CaptureWithMarkers(double last_fall) {
    text.resize(text.find("[[depth]]"));
    append("[[markers]]\nrest = \"rest.csv\"\ntrack = \"track.csv\"\n");
    std::string rest = "id,x,y,z\nlost,0,0,0\n", track = "frame,id,x,y,z\n";
    for (const char* id : {"a", "b", "c", "d"}) {
      const std::string cells = std::string(id) + "," + std::to_string(0.02 * (*id - 'a'));
      rest += cells + ",0,0\n";
      for (const int frame : {0, 1, 3})
        if (frame < 3 || *id != 'a')
          track += std::to_string(frame) + "," + cells + "," + std::to_string(frame == 3 ? last_fall : 0.0) + ",0\n";
    }
    folder.write("rest.csv", rest);
    folder.write("track.csv", track);
  }
};

TEST(SurveyTest, CountsMarkers) {
  const Survey seen = surveyed(CaptureWithMarkers(0.1).read());
  ASSERT_EQ(seen.markers.size(), 1u);
  EXPECT_EQ(seen.markers[0].markers, 5);
  EXPECT_EQ(seen.markers[0].frames, 4);
  EXPECT_THAT(seen.markers[0].empty_frames, ElementsAre(2));
  EXPECT_THAT(seen.markers[0].never_seen, ElementsAre("lost"));
  EXPECT_DOUBLE_EQ(seen.markers[0].missing, 9.0 / 20.0);
  EXPECT_NEAR(seen.markers[0].travel, 0.1, 1e-12);
  EXPECT_EQ(seen.markers[0].noise, std::nullopt) << "no three frames in a row";
  EXPECT_TRUE(seen.moves);
  EXPECT_EQ(seen.first_contact, std::nullopt);
  EXPECT_FALSE(seen.loaded_markers);
}

TEST(SurveyTest, MarkersShowContactAndRest) {
  EXPECT_EQ(surveyed(CaptureWithMarkers(0.4).read()).first_contact, 3) << "the floor lies 0.4 m below the box";
  EXPECT_FALSE(surveyed(CaptureWithMarkers(0.0).read()).moves);
}

TEST(SurveyTest, NoiseOfMarkersIsTheirScatter) {
  constexpr double deviation = 2e-4;
  constexpr int frames = 200;
  CaptureWithMarkers small(0.0);
  small.edit("frame_count = 4", "frame_count = 200");
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, deviation);
  std::string track = "frame,id,x,y,z\n";
  for (int frame = 0; frame < frames; ++frame)
    for (const char* id : {"a", "b", "c", "d"}) {
      track += std::to_string(frame) + "," + id;
      for (int axis = 0; axis < 3; ++axis) track.append(",").append(std::to_string(1e-3 * frame + noise(random)));
      track += "\n";
    }
  small.folder.write("track.csv", track);
  const Survey seen = surveyed(small.read());
  ASSERT_TRUE(seen.markers.at(0).noise);
  EXPECT_NEAR(*seen.markers[0].noise / deviation, 1.0, 0.1) << "2400 numbers, each in three differences";
}

TEST(SurveyTest, CountsMarkersUnderLoad) {
  SmallCapture small;
  small.folder.write("pressed.csv", "id,x,y,z\n0,0,0.01,-0.1\n");
  small.append(R"(
[[press]]
force = [0.0, 0.0, 3.0]
contact = { centre = [0.0, 0.0, -0.1], radius = 0.01 }
markers = "pressed.csv"
markers_rest = "markers_rest.csv"
)");
  const Survey seen = surveyed(small.read());
  ASSERT_TRUE(seen.loaded_markers);
  EXPECT_EQ(seen.loaded_markers->markers, 2);
  EXPECT_EQ(seen.loaded_markers->frames, 1);
  EXPECT_DOUBLE_EQ(seen.loaded_markers->missing, 0.5);
  EXPECT_DOUBLE_EQ(seen.loaded_markers->travel, 0.01);
}

TEST(IdentifiabilityTest, FreeFallShowsNoStiffness) {
  EXPECT_THAT(identifiability_of(SmallCapture()).impossible, Contains(HasSubstr("in free fall nothing strains it")));
}

TEST(IdentifiabilityTest, AnImpactShowsStiffnessAndDamping) {
  SmallCapture small;
  small.edit("point = [0.0, 0.5, 0.0]", "point = [0.0, 0.2, 0.0]");
  const Identifiability result = identifiability_of(small);
  EXPECT_THAT(result.possible, Contains(HasSubstr("impact")));
  EXPECT_THAT(result.possible, Contains(HasSubstr("Damping")));
  EXPECT_TRUE(result.impossible.empty());
}

TEST(IdentifiabilityTest, WithoutMassTheScaleOfStiffnessIsNotIdentifiable) {
  SmallCapture small;
  small.edit("mass = 0.8\n", "");
  EXPECT_THAT(identifiability_of(small).impossible,
              Contains(HasSubstr("The absolute scale of stiffness is not identifiable")));
}

TEST(IdentifiabilityTest, StaticShowsNoDamping) {
  SmallCapture small;
  small.edit("start_frame = 1", "static = true");
  EXPECT_THAT(identifiability_of(small).impossible, Contains(HasSubstr("Damping is not identifiable")));
}

TEST(IdentifiabilityTest, WithoutRestScanNothingCanBeFitted) {
  SmallCapture small;
  small.edit("surface = \"rest.ply\"\n", "");
  const Identifiability result = identifiability_of(small);
  EXPECT_THAT(result.impossible, Contains(HasSubstr("Nothing can be fitted")));
  EXPECT_THAT(result.possible, Not(Contains(HasSubstr("absolute scale"))));
}

}  // namespace
}  // namespace pliant::survey_test
