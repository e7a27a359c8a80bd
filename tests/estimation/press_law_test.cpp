// Where the numbers of a pressed object's law stand, and how they are carried from one form of it to another.
#include "estimation/press_law.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace pliant::press_law_test {
namespace {

std::vector<std::string> names_of(const LawLayout& layout) {
  std::vector<std::string> names;
  for (const ParameterBlock& block : layout.layout().blocks()) names.push_back(block.name);
  return names;
}

TEST(LawLayouts, NameTheNumbersOfALaw) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(names_of(LawLayout({1, 0})), (Names{"youngs_modulus", "poissons_ratio"}));
  EXPECT_EQ(names_of(LawLayout({1, 2})),
            (Names{"youngs_modulus", "poissons_ratio", "exponent_1", "exponent_2", "stiffness_ratio_2"}));
  EXPECT_EQ(names_of(LawLayout({2, 1, 1}, {"youngs_modulus", "youngs_modulus@top"})),
            (Names{"youngs_modulus", "youngs_modulus@top", "poissons_ratio", "exponent_1"}));
  EXPECT_EQ(names_of(LawLayout({2, 1, 2}, {"youngs_modulus", "youngs_modulus@top"})),
            (Names{"youngs_modulus", "youngs_modulus@top", "poissons_ratio", "exponent_1", "poissons_ratio@top",
                   "exponent_1@top"}));
  EXPECT_EQ(LawLayout({3, 1}).modulus_names(), (Names{"youngs_modulus@1", "youngs_modulus@2", "youngs_modulus@3"}));
}

TEST(LawLayouts, TermsShareAPoissonsRatioOrHaveTheirOwn) {
  const LawLayout one({1, 3}), own({1, 3, 1, true});
  EXPECT_EQ(one.poissons_ratio(2), one.poissons_ratio());
  EXPECT_EQ(own.poissons_ratio(2), own.layout().at("poissons_ratio_3"));
  EXPECT_EQ(own.size(), one.size() + 2);
}

TEST(LawLayouts, AllNumbersAreThoseOfTheirParameters) {
  for (const LawForm& form : {LawForm{1, 0}, LawForm{2, 2, 2}, LawForm{2, 3, 2, true}}) {
    const LawLayout layout(form);
    const ParameterSet set = law_parameters(layout, 5000.0);
    std::size_t count = 0;
    for (int law = 0; law < form.laws; ++law)
      for (const ParameterHandle& number : layout.numbers(law)) {
        EXPECT_GE(set.coordinate(number), 0);
        ++count;
      }
    EXPECT_EQ(count, std::size_t(layout.size()));
    EXPECT_EQ(set.dimension(), layout.size());
  }
}

TEST(LawLayouts, RefuseNamesAndLawsThatDoNotFit) {
  EXPECT_THROW(LawLayout({2, 1}, {"youngs_modulus"}), std::invalid_argument);
  EXPECT_THROW(LawLayout({1, 1}, {"stiff", "soft"}), std::invalid_argument);
  EXPECT_THROW(LawLayout({3, 1, 2}), std::invalid_argument);
}

/// To a law for each of three controls, two of them like the second before, and with a term more.
TEST(CarriedLaw, TakesTheNumbersOfThoseItIsLike) {
  const LawLayout from({2, 1, 2}), to({3, 2, 3});
  VectorX theta = VectorX::Zero(from.size());
  for (int k = 0; k < 2; ++k) {
    theta[from.modulus(k)] = 1000.0 * (k + 1);
    theta[from.poissons_ratio(0, k)] = 0.1 * (k + 1);
    theta[from.exponent(0, k)] = 4.0 * (k + 1);
  }
  const std::vector<int> like = {1, 0, 1};
  const VectorX carried = carry_law(from, theta, to, like);
  for (int k = 0; k < 3; ++k) {
    const int before = like[std::size_t(k)];
    EXPECT_EQ(carried[to.modulus(k)], theta[from.modulus(before)]);
    EXPECT_EQ(carried[to.poissons_ratio(0, k)], theta[from.poissons_ratio(0, before)]);
    EXPECT_EQ(carried[to.exponent(0, k)], theta[from.exponent(0, before)]);
    EXPECT_EQ(carried[to.exponent(1, k)], 0.0) << "what there was not before";
    EXPECT_EQ(carried[to.stiffness_ratio(1, k)], 0.0);
  }
}

TEST(CarriedLaw, GivesOneLawForAllToEachControl) {
  const LawLayout from({2, 2}), to({2, 2, 2});
  const VectorX theta = VectorX::LinSpaced(from.size(), 1.0, from.size()), carried = carry_law(from, theta, to, {0, 1});
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(carried[to.modulus(k)], theta[from.modulus(k)]);
    EXPECT_EQ(carried[to.exponent(1, k)], theta[from.exponent(1)]);
    EXPECT_EQ(carried[to.stiffness_ratio(1, k)], theta[from.stiffness_ratio(1)]);
    EXPECT_EQ(carried[to.poissons_ratio(1, k)], theta[from.poissons_ratio()]);
  }
}

}  // namespace
}  // namespace pliant::press_law_test
