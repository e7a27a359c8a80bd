#include "exports/samples.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "support/models.hpp"

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

TEST(WithMaterial, ScalesAllModuli) {
  Model model = test::pressed_block();
  model.volume.youngs_modulus[0] = 1e5;
  const Model changed = with_material(model, {4e5, 0.25, 0.1, 1e-3});
  EXPECT_EQ(changed.youngs_modulus, 4e5);
  EXPECT_EQ(changed.volume.youngs_modulus[0], 2e5);
  EXPECT_EQ(changed.volume.youngs_modulus[1], 4e5);
  EXPECT_EQ(changed.volume.poissons_ratio[1], 0.25);
  EXPECT_EQ(changed.mass_damping, 0.1);
}

}  // namespace
}  // namespace pliant::samples_test
