#include "base/error.hpp"

namespace pliant::error_test {
namespace {

TEST(Place, NamesWhatIsKnown) {
  EXPECT_EQ(to_string(Place{"a.toml", 3, 7}), "a.toml:3:7");
  EXPECT_EQ(to_string(Place{"a.toml", 3, 0}), "a.toml:3");
  EXPECT_EQ(to_string(Place{"a.ply"}), "a.ply");
}

TEST(Problem, LeavesOutWhatIsEmpty) {
  EXPECT_EQ(to_string(Problem{{"a.toml", 1, 2}, "mass -1 kg", "a mass above 0", "weigh it"}),
            "a.toml:1:2: mass -1 kg; expected a mass above 0; weigh it");
  EXPECT_EQ(to_string(Problem{{"a.toml"}, "nothing there", "", ""}), "a.toml: nothing there");
}

TEST(InputErrorTest, ListsEveryProblemOnItsLine) {
  const InputError error({Problem{{"a"}, "one", "", ""}, Problem{{"b"}, "two", "", ""}});
  EXPECT_STREQ(error.what(), "a: one\nb: two");
  EXPECT_EQ(error.problems().size(), 2u);
}

}  // namespace
}  // namespace pliant::error_test
