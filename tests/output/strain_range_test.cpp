#include "output/strain_range.hpp"

#include <gtest/gtest.h>

namespace pliant::strain_range_test {
namespace {

/// A body of 200 elements of one volume each.
Body body() {
  Body body;
  body.element_volume.assign(200, 1.0);
  return body;
}

/// Element e is strained by e / 1000.
BodyFields strained(double factor) {
  BodyFields fields;
  for (int e = 0; e < 200; ++e) fields.greatest_strain.push_back(factor * e / 1000.0);
  return fields;
}

TEST(StrainRange, IsWhatSharesOfTheVolumeExceed) {
  StrainRange range(body());
  EXPECT_FALSE(range.result());
  range.add(strained(1.0), 0.0);
  range.add(strained(0.5), 0.01);
  const auto result = range.result();
  ASSERT_TRUE(result);
  EXPECT_DOUBLE_EQ(result->greatest_strain, 0.197) << "elements 198 and 199 are a hundredth";
  EXPECT_DOUBLE_EQ(result->median_strain, 0.099);
  EXPECT_NEAR(*result->greatest_rate, 0.5 * 0.197 / 0.01, 1e-9);
}

TEST(StrainRange, HasNoRateAtRest) {
  StrainRange range(body());
  range.add(strained(1.0), std::nullopt);
  range.add(strained(2.0), std::nullopt);
  EXPECT_DOUBLE_EQ(range.result()->greatest_strain, 0.394);
  EXPECT_FALSE(range.result()->greatest_rate);
}

TEST(StrainRange, OfCurvesIsThatOfThoseThatWereFitted) {
  CurvePrediction tension, shear, test;
  tension.kind = shear.kind = test.kind = "material curve";
  tension.role = shear.role = "fit", test.role = "test";
  tension.abscissa = test.abscissa = "stretch [-]", shear.abscissa = "shear [-]";
  tension.at = {0.8, 1.0, 1.3}, shear.at = {0.1, 0.4}, test.at = {3.0};
  EXPECT_NEAR(strain_range({tension, test})->greatest_strain, 0.3, 1e-12);
  EXPECT_NEAR(strain_range({tension, shear})->greatest_strain, 0.4, 1e-12);
  EXPECT_FALSE(strain_range({test}));
}

}  // namespace
}  // namespace pliant::strain_range_test
