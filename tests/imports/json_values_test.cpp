#include "imports/json_values.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace pliant::json_values_test {

using nlohmann::json;

TEST(JsonValues, AreReadWhereTheyAreOfTheirKind) {
  const json said = json::parse(R"({"tags": {"title": "DEPTH", "width": 640}, "all": [1, 2]})");
  EXPECT_EQ(text_at(said, "/tags/title"), "DEPTH");
  EXPECT_EQ(whole_number_at(said, "/tags/width", 7), 640);
  EXPECT_EQ(value_at(said, "/all").size(), 2u);
}

TEST(JsonValues, AreNothingElsewhere) {
  const json said =
      json::parse(R"({"tags": {"title": 3, "width": 1e30, "height": 18446744073709551615, "left": 0.5}})");
  for (const char* pointer : {"/tags/title", "/tags/none", "/none/title", "/tags", "/tags/title/deeper", "/tags/0"})
    EXPECT_EQ(text_at(said, pointer), "") << pointer;
  for (const char* pointer : {"/tags/width", "/tags/height", "/tags/left", "/tags", "/none"})
    EXPECT_EQ(whole_number_at(said, pointer, 7), 7) << pointer;
  for (const json& other : {json(), json(5), json::array(), json("text")}) {
    EXPECT_TRUE(value_at(other, "/a/b").is_null());
    EXPECT_EQ(text_at(other, "/a"), "");
  }
}

}  // namespace pliant::json_values_test
