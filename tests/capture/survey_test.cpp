#include "capture/survey.hpp"

#include "capture/small_capture.hpp"

namespace pliant {
namespace {

using test::SmallCapture;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

Survey surveyed(const Capture& capture) { return survey(capture, observe(capture)); }

Prospects prospects_of(const SmallCapture& small) {
  const Capture capture = small.read();
  return prospects(capture, surveyed(capture));
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

TEST(SurveyTest, SeesContact) {
  SmallCapture small;
  small.edit("point = [0.0, 0.5, 0.0]", "point = [0.0, 0.2, 0.0]");
  EXPECT_EQ(surveyed(small.read()).first_contact, 3);
}

TEST(ProspectsTest, FreeFallShowsNoStiffness) {
  EXPECT_THAT(prospects_of(SmallCapture()).impossible, Contains(HasSubstr("in free fall nothing strains it")));
}

TEST(ProspectsTest, AnImpactShowsStiffnessAndDamping) {
  SmallCapture small;
  small.edit("point = [0.0, 0.5, 0.0]", "point = [0.0, 0.2, 0.0]");
  const Prospects result = prospects_of(small);
  EXPECT_THAT(result.possible, Contains(HasSubstr("impact")));
  EXPECT_THAT(result.possible, Contains(HasSubstr("Damping")));
  EXPECT_TRUE(result.impossible.empty());
}

TEST(ProspectsTest, WithoutMassNothingAnchorsPascals) {
  SmallCapture small;
  small.edit("mass = 0.8\n", "");
  EXPECT_THAT(prospects_of(small).impossible, Contains(HasSubstr("Nothing anchors pascals")));
}

TEST(ProspectsTest, StaticShowsNoDamping) {
  SmallCapture small;
  small.edit("start_frame = 1", "static = true");
  EXPECT_THAT(prospects_of(small).impossible, Contains(HasSubstr("Damping does not show")));
}

TEST(ProspectsTest, WithoutRestScanNothingCanBeFitted) {
  SmallCapture small;
  small.edit("surface = \"rest.ply\"\n", "");
  const Prospects result = prospects_of(small);
  EXPECT_THAT(result.impossible, Contains(HasSubstr("Nothing can be fitted")));
  EXPECT_THAT(result.possible, Not(Contains(HasSubstr("Pascals"))));
}

}  // namespace
}  // namespace pliant
