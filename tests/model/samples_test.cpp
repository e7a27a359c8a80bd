#include "model/samples.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::samples_test {
namespace {

ParameterResult parameter(const std::string& name, double value, std::optional<std::pair<double, double>> interval) {
  ParameterResult p{name, value, "", {}, {}, interval.has_value()};
  p.interval_90 = interval;
  return p;
}

Result result() {
  Result r;
  r.parameters = {parameter("youngs_modulus", 2e5, {{1.8e5, 2.5e5}}), parameter("poissons_ratio", 0.4, {{0.2, 0.48}}),
                  parameter("mass_damping", 0.3, {{0.0005, 0.9}}), parameter("stiffness_damping", 2e-3, std::nullopt)};
  r.identifiability = {{{"youngs_modulus", "poissons_ratio"}, -0.8}, {{"pull@1.x", "youngs_modulus"}, 0.9}};
  return r;
}

/// Part of the draws below a number.
template <class Of>
double below(const std::vector<DrawnMaterial>& samples, double number, const Of& of) {
  return double(std::ranges::count_if(samples, [&](const DrawnMaterial& s) { return of(s) < number; })) /
         double(samples.size());
}

TEST(PosteriorSamples, HaveTheStatedIntervals) {
  const std::vector<DrawnMaterial> samples = posterior_samples(result(), 20000);
  ASSERT_EQ(samples.size(), 20000u);
  const auto E = [](const DrawnMaterial& s) { return s.youngs_modulus; };
  const auto nu = [](const DrawnMaterial& s) { return s.poissons_ratio; };
  const auto mass = [](const DrawnMaterial& s) { return s.mass_damping; };
  constexpr double scatter = 0.01;  // five deviations of a share of 20,000
  EXPECT_NEAR(below(samples, 1.8e5, E), 0.05, scatter);
  EXPECT_NEAR(below(samples, 2e5, E), 0.5, 2 * scatter);
  EXPECT_NEAR(below(samples, 2.5e5, E), 0.95, scatter);
  EXPECT_NEAR(below(samples, 0.2, nu), 0.05, scatter);
  EXPECT_NEAR(below(samples, 0.48, nu), 0.95, scatter);
  EXPECT_NEAR(below(samples, 0.0005, mass), 0.05, scatter);
  EXPECT_NEAR(below(samples, 0.9, mass), 0.95, scatter);
  for (const DrawnMaterial& s : samples) {
    EXPECT_LT(s.poissons_ratio, 0.5);
    EXPECT_GT(s.mass_damping, 0.0);
    EXPECT_EQ(s.stiffness_damping, 2e-3) << "it was given";
  }
}

TEST(PosteriorSamples, AreCorrelatedAsTheResultSays) {
  const std::vector<DrawnMaterial> samples = posterior_samples(result(), 20000);
  // Of ranks: both above or both below their medians, 1/2 + asin(rho) / pi of the draws (Sheppard 1899).
  const double together =
      double(std::ranges::count_if(
          samples, [](const DrawnMaterial& s) { return (s.youngs_modulus < 2e5) == (s.poissons_ratio < 0.4); })) /
      20000.0;
  EXPECT_NEAR(together, 0.5 + std::asin(-0.8 * 0.999) / std::numbers::pi, 0.015);
}

TEST(PosteriorSamples, AreTheSameForASeed) {
  const auto a = posterior_samples(result(), 3), b = posterior_samples(result(), 3),
             c = posterior_samples(result(), 3, 2);
  EXPECT_EQ(a[2].youngs_modulus, b[2].youngs_modulus);
  EXPECT_NE(a[2].youngs_modulus, c[2].youngs_modulus);
}

TEST(PosteriorSamples, NeedAnInterval) {
  Result r = result();
  r.parameters[0].interval_90.reset();
  EXPECT_THROW((void)posterior_samples(r, 3), InputError);
}

TEST(PosteriorSamples, TheFirstOnesAreTheSameForEveryCount) {
  const auto few = posterior_samples(result(), 3), many = posterior_samples(result(), 50);
  for (std::size_t k = 0; k < few.size(); ++k) EXPECT_EQ(numbers_of(few[k]), numbers_of(many[k]));
}

Result with_priors() {
  Result r = result();
  r.parameters[0].prior = PriorResult{1e5, std::pair(5e4, 4e5)};
  r.parameters[1].prior = PriorResult{0.35, std::pair(0.25, 0.45)};
  r.parameters[2].prior = PriorResult{0.2, std::pair(0.01, 2.0)};
  return r;
}

TEST(PriorSamples, HaveTheStatedIntervals) {
  const std::vector<DrawnMaterial> samples = prior_samples(with_priors(), 20000);
  constexpr double scatter = 0.01;  // as above
  const auto E = [](const DrawnMaterial& s) { return s.youngs_modulus; };
  EXPECT_NEAR(below(samples, 5e4, E), 0.05, scatter);
  EXPECT_NEAR(below(samples, 1e5, E), 0.5, 2 * scatter);
  EXPECT_NEAR(below(samples, 4e5, E), 0.95, scatter);
  EXPECT_NEAR(below(samples, 0.45, [](const DrawnMaterial& s) { return s.poissons_ratio; }), 0.95, scatter);
  EXPECT_EQ(samples[7].stiffness_damping, 2e-3) << "it was given";
  const double together =
      double(std::ranges::count_if(
          samples, [](const DrawnMaterial& s) { return (s.youngs_modulus < 1e5) == (s.poissons_ratio < 0.35); })) /
      20000.0;
  EXPECT_NEAR(together, 0.5, 0.02) << "they know nothing of each other";
}

TEST(PriorSamples, NeedAPriorOfAllThatWasEstimated) {
  Result r = with_priors();
  r.parameters[0].prior.reset();
  const std::string said = test::complaint_of([&] { (void)prior_samples(r, 3, 1, "fit/result.json"); });
  EXPECT_THAT(said, testing::HasSubstr("fit/result.json: the result states no prior of youngs_modulus"));
  EXPECT_THAT(said, testing::HasSubstr("youngs_modulus.prior_std"));
}

TEST(WithMaterial, ScalesAllModuli) {
  Model model;
  model.youngs_modulus = 2e5, model.poissons_ratio = 0.3;
  model.volume.youngs_modulus = {1e5, 2e5}, model.volume.poissons_ratio = {0.3, 0.3};
  const Model changed = with_material(model, {4e5, 0.25, 0.1, 1e-3});
  EXPECT_EQ(changed.youngs_modulus, 4e5);
  EXPECT_EQ(changed.volume.youngs_modulus[0], 2e5);
  EXPECT_EQ(changed.volume.youngs_modulus[1], 4e5);
  EXPECT_EQ(changed.volume.poissons_ratio[1], 0.25);
  EXPECT_EQ(changed.mass_damping, 0.1);
  EXPECT_EQ(numbers_of(material_of(changed)), (std::array{4e5, 0.25, 0.1, 1e-3}));
}

/// What is read of a table, or what is said about it.
struct ReadTable {
  explicit ReadTable(const std::string& content) {
    const test::TemporaryFolder folder;
    said = test::complaint_of([&] {
      materials = read_materials(folder.write("m.csv", content), {1e5, 0.3, 0.5, 2e-3});
    });
  }
  std::vector<DrawnMaterial> materials;
  std::string said;
};

TEST(ReadMaterials, TakesColumnsInAnyOrderAndPassesOverOthers) {
  const ReadTable read(
      "recording,reason,poissons_ratio [1],youngs_modulus [Pa],youngs_modulus std [Pa],youngs_modulus 5 % [Pa]\n"
      "a,\"one, two\",0.4,2e5,1,1\nb,,0.45,3e5,,\n");
  ASSERT_EQ(read.materials.size(), 2u) << read.said;
  EXPECT_EQ(numbers_of(read.materials[0]), (std::array{2e5, 0.4, 0.5, 2e-3}));
  EXPECT_EQ(numbers_of(read.materials[1]), (std::array{3e5, 0.45, 0.5, 2e-3}));
}

TEST(ReadMaterials, NamesWhatIsWrong) {
  EXPECT_THAT(ReadTable("a,b\n1,2\n").said, testing::HasSubstr("m.csv:1:1: no column of a material"));
  EXPECT_THAT(ReadTable("youngs_modulus [kPa]\n1\n").said, testing::HasSubstr("expected `youngs_modulus [Pa]`"));
  EXPECT_THAT(ReadTable("youngs_modulus\n1\n").said, testing::HasSubstr("expected `youngs_modulus [Pa]`"));
  EXPECT_THAT(ReadTable("young_modulus [Pa]\n1\n").said, testing::HasSubstr("expected `youngs_modulus [Pa]`"));
  EXPECT_THAT(ReadTable("mass_damping [1/s],mass_damping [1/s]\n1,2\n").said, testing::HasSubstr("twice"));
  const std::string said = ReadTable("poissons_ratio [1],youngs_modulus [Pa]\n0.5,0\n0.2,x\n").said;
  EXPECT_THAT(said, testing::HasSubstr("m.csv:2:1: 0.5; expected a number between -1 and 0.5"));
  EXPECT_THAT(said, testing::HasSubstr("m.csv:2:5: 0; expected a number above 0"));
  EXPECT_THAT(said, testing::HasSubstr("m.csv:3:5: \"x\"; expected a finite number"));
  EXPECT_THAT(ReadTable("youngs_modulus [Pa]\n").said, testing::HasSubstr("no row below the header"));
}

}  // namespace
}  // namespace pliant::samples_test
