#include "base/old_names.hpp"

#include <gtest/gtest.h>

namespace pliant::old_names_test {
namespace {

TEST(OldNames, FormerNamesBecomePresentOnes) {
  EXPECT_EQ(present_name("poisson_ratio"), "poissons_ratio");
  EXPECT_EQ(present_name("poisson_ratio_2"), "poissons_ratio_2");
  EXPECT_EQ(present_name("poisson_ratio@red half"), "poissons_ratio@red half");
  EXPECT_EQ(present_name("poisson_ratio.estimate"), "poissons_ratio.estimate");
  EXPECT_EQ(former_name("poissons_ratio_2@top"), "poisson_ratio_2@top");
}

TEST(OldNames, OthersStay) {
  for (const char* name : {"poissons_ratio", "youngs_modulus", "poisson_ratios", "poisson", ""})
    EXPECT_EQ(present_name(name), name);
  for (const char* name : {"poisson_ratio", "youngs_modulus", "poissons_ratios", ""}) EXPECT_EQ(former_name(name), "");
}

TEST(OldNames, AreNotedOnceEach) {
  testing::internal::CaptureStderr();
  note_former_word("former of a test", "present", "file.toml");
  note_former_word("former of a test", "present", "file.toml");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "note: file.toml: \"former of a test\" is called \"present\" now; the old word is still read\n");
}

}  // namespace
}  // namespace pliant::old_names_test
