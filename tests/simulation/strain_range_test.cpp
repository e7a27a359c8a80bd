#include "simulation/strain_range.hpp"

#include <gtest/gtest.h>

#include "temporary_folder.hpp"

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
  tension.role = shear.role = "fit", test.role = "test";
  tension.strained = DeformationResult{0.3, 0.2}, shear.strained = DeformationResult{0.4, 0.1};
  test.strained = DeformationResult{2.0, 2.0};
  EXPECT_NEAR(strain_range({tension, test})->greatest_strain, 0.3, 1e-12);
  EXPECT_NEAR(strain_range({tension, shear})->greatest_strain, 0.4, 1e-12);
  EXPECT_NEAR(strain_range({tension, shear})->median_strain, 0.2, 1e-12);
  EXPECT_FALSE(strain_range({test}));
}

TEST(StrainRange, IsBeyondTheRecordedOneWhereAHundredthIsStrainedMore) {
  const DeformationResult recorded{0.25, 0.1};
  EXPECT_EQ(extrapolation_note(recorded, DeformationResult{0.26, 0.2}), "") << "as far as meshes tell";
  EXPECT_EQ(extrapolation_note(std::nullopt, DeformationResult{0.5, 0.2}), "");
  EXPECT_EQ(extrapolation_note(recorded, std::nullopt), "");
  EXPECT_EQ(
      extrapolation_note(recorded, DeformationResult{0.5, 0.2}),
      "The object is strained by up to 50 %, and was by up to 25 % while the model was fitted (a hundredth of the "
      "volume by more): beyond that the model is extrapolated.");
}

TEST(StrainRange, OfARecordingIsReadBesideItsModel) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(recorded_strain_range(folder.path() / "model.toml")) << "no result there";
  Result result;
  result.deformation = DeformationResult{0.25, 0.1};
  write_result(folder.path() / "result.json", result);
  const auto found = recorded_strain_range(folder.path() / "model.toml");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->greatest_strain, 0.25);
}

}  // namespace
}  // namespace pliant::strain_range_test
