#include "live/live_page.hpp"

#include <gmock/gmock.h>

#include "support/models.hpp"

namespace pliant::live_page_test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(LivePage, IsOneFileThatNeedsNoOther) {
  Model model = test::block(false);
  model.name = "a <block> & more";
  LiveRecording recording{{1.0, 1.1}, {}, {{Vector3(0, 0, 0)}, {Vector3(1, 0, 0), Vector3(2, 0, 0)}}};
  const std::string page = live_page(model, recording);
  EXPECT_THAT(page, HasSubstr("<title>a &lt;block&gt; &amp; more"));
  EXPECT_THAT(page, HasSubstr("\"times\":[0,0.1]"));
  EXPECT_THAT(page, HasSubstr("\"counts\":[1,2]"));
  EXPECT_THAT(page, Not(HasSubstr("@MODULE@")));
  EXPECT_THAT(page, Not(HasSubstr("@FACTS@")));
  for (const char* outside : {"http://", "https://", "src=\"", "import("}) EXPECT_THAT(page, Not(HasSubstr(outside)));
  EXPECT_LT(page.size(), std::size_t(3) << 20);
}

TEST(LivePage, OfAReleasedObjectLetsGoOfIt) {
  Model model = test::block(true);
  model.scene.initial.released = true;
  model.scene.initial.pulls = {Vector3(0.1, 0.0, 0.0), Vector3(0.0, -0.2, 0.0)};
  const LiveData data = live_data(model);
  EXPECT_EQ(data.theta.size(), live_data(test::block(true)).theta.size()) << "nothing pulls at it any more";
}

TEST(LivePage, OfPressesHoldsThem) {
  LiveRecording recording;
  recording.presses = {{{0.05, 0.025, 0.0}, 0.01, {0.0, -2.5, 0.0}}};
  recording.points = {{Vector3(0.05, 0.02, 0.0)}};
  const std::string page = live_page(test::pressed_block(), recording);
  EXPECT_THAT(page, HasSubstr("\"pressed\":true"));
  EXPECT_THAT(page, HasSubstr("\"strain\":0,")) << "nobody knows how far it was strained";
  EXPECT_THAT(page, HasSubstr("\"deviations\":true"));
  EXPECT_THAT(page, HasSubstr("\"presses\":[2.5]"));
  EXPECT_THAT(page, HasSubstr("\"gravity\":0,"));
}

}  // namespace
}  // namespace pliant::live_page_test
