#include "base/html.hpp"

#include <gtest/gtest.h>

namespace pliant::html_test {
namespace {

TEST(EscapeHtml, LeavesNoMarkup) { EXPECT_EQ(escape_html("<a b='c\"&>"), "&lt;a b=&#39;c&quot;&amp;&gt;"); }

}  // namespace
}  // namespace pliant::html_test
