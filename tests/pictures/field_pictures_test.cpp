#include "pictures/field_pictures.hpp"

#include <gmock/gmock.h>

#include "elasticity/law_elasticity.hpp"
#include "geometry/primitives.hpp"
#include "support/bodies.hpp"

namespace pliant::field_pictures_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const Vector3 size(0.2, 0.1, 0.1);

/// A block of Ogden's law that is pushed together along x, by 0, 2, 4, ... per cent of its length.
struct PushedBlock {
  std::shared_ptr<const Body> body = test::tet_body(size, {4, 2, 2}, false);
  TriangleMesh surface = make_box(size, 0.05);
  std::vector<double> moduli;

  std::unique_ptr<LawElasticity> elasticity(double exponent = -6.0) const {
    MatrixX table(body->element_count(), 3);
    for (int e = 0; e < body->element_count(); ++e)
      table.row(e) << (moduli.empty() ? 1e3 : moduli[std::size_t(e)]), exponent, 0.1;
    return LawElasticity::make(body, std::make_shared<OgdenLaw>(table));
  }
  Points nodes(int state) const {
    return body->reference_positions() * Vector3(1.0 - 0.02 * state, 1.0, 1.0).asDiagonal();
  }
  std::vector<ReportField> drawn(const std::vector<int>& order, std::vector<double> modulus_std = {},
                                 double exponent = -6.0) const {
    const auto law = elasticity(exponent);
    FieldStates states{"press"};
    for (std::size_t i = 0; i < order.size(); ++i)
      states.at.push_back(double(i)), states.names.push_back("Press " + std::to_string(i));
    FieldPictures pictures(body, *law, surface, std::move(modulus_std), states);
    for (std::size_t i = 0; i < order.size(); ++i) {
      const Points x = nodes(order[i]);
      pictures.add(int(i), x, body_fields(*body, *law, x));
    }
    Gallery gallery;
    gallery.triangles = surface.triangles;
    gallery.width = 60, gallery.height = 40, gallery.samples = 1;
    return pictures.draw(gallery);
  }
};

std::vector<std::string> names_of(const std::vector<ReportField>& fields) {
  std::vector<std::string> names;
  for (const ReportField& field : fields) names.push_back(field.name);
  return names;
}

TEST(FieldPictures, ShowSomeStatesAndTheHardestOne) {
  const PushedBlock block;
  const auto fields = block.drawn({0, 1, 10, 1, 2, 3, 4});  // 0, 2, 4, 6 are spread evenly
  ASSERT_THAT(names_of(fields),
              ElementsAre("von Mises stress", "greatest principal strain", "Young's modulus under strain"));
  for (const ReportField& field : fields) {
    ASSERT_EQ(field.pictures.size(), 4u) << "the hardest is one of the four";
    EXPECT_THAT(field.pictures[1].caption, HasSubstr("Press 2"));
    EXPECT_EQ(field.at.size(), 7u);
    EXPECT_EQ(field.abscissa, "press");
  }
  EXPECT_THAT(fields[1].greatest, testing::Pointwise(testing::DoubleNear(1e-9), {0.0, 2.0, 20.0, 2.0, 4.0, 6.0, 8.0}))
      << "per cent";
  EXPECT_THAT(fields[1].mean, testing::Pointwise(testing::DoubleNear(1e-9), fields[1].greatest)) << "even strain";
  EXPECT_NEAR(fields[1].scale.high, 20.0, 1e-9);
  const auto between = block.drawn({0, 10, 1, 1, 2, 3, 4});
  ASSERT_EQ(between[0].pictures.size(), 5u);
  EXPECT_THAT(between[0].pictures[1].caption, HasSubstr("Press 1: the greatest stress"));
}

TEST(FieldPictures, ShowTheModulusUnderStrainWhereItChanges) {
  const PushedBlock block;
  EXPECT_EQ(block.drawn({0, 1}).size(), 2u) << "by less than a fifth";
  const auto fields = block.drawn({0, 10});
  ASSERT_EQ(fields.size(), 3u);
  const auto law = block.elasticity();
  const double rest = law->law().small_strain(0).youngs_modulus;
  EXPECT_NEAR(fields[2].scale.low, rest, 1e-6 * rest);
  EXPECT_GT(fields[2].scale.high, 1.2 * rest);
}

TEST(FieldPictures, ShowAModulusThatVariesWithItsDeviation) {
  PushedBlock block;
  std::vector<double> deviations;
  for (int e = 0; e < block.body->element_count(); ++e) {
    block.moduli.push_back(e % 2 ? 1e3 : 5e4);
    deviations.push_back(0.1 * block.moduli.back());
  }
  const auto fields = block.drawn({0, 1}, deviations);
  ASSERT_THAT(names_of(fields), ElementsAre("von Mises stress", "greatest principal strain", "Young's modulus at rest",
                                            "standard deviation of Young's modulus"));
  EXPECT_EQ(block.drawn({0, 1}).size(), 3u) << "no deviation is known";
  EXPECT_EQ(PushedBlock().drawn({0, 1}, deviations).size(), 2u) << "one modulus";
}

TEST(FieldPictures, FramesAreTimedFromTheFirst) {
  const FieldStates states = frames_at({2.0, 2.5, 3.0}, 7);
  EXPECT_THAT(states.at, ElementsAre(0.0, 0.5, 1.0));
  EXPECT_EQ(states.names[1], "Frame 8, 0.5 s");
}

}  // namespace
}  // namespace pliant::field_pictures_test
