#include "simulation/law_table.hpp"

#include <random>

#include "base/error.hpp"
#include "elasticity/sampled_law.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "support/samples.hpp"
#include "temporary_folder.hpp"

namespace pliant::law_table_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

constexpr int elements = 3;

Model model_with(const MaterialLaw& law) {
  Model m;
  m.name = "pressed";
  m.scene.object.surface = make_torus(0.15, 0.06, 12, 8);
  m.youngs_modulus = 5000.0, m.poissons_ratio = 0.3, m.scene.object.density = 95.0, m.scene.object.mass = 0.456,
  m.cell_size = 0.02;
  m.volume.kind = VtuCell::Tetrahedron;
  m.volume.nodes = Points::Random(6, 3);
  m.volume.connectivity = {0, 1, 2, 3, 1, 2, 3, 4, 2, 3, 4, 5};
  m.volume.youngs_modulus = {500, 680, 700}, m.volume.poissons_ratio = {0.3, 0.4, 0.2}, m.volume.fill = {1.0, 1.0, 1.0};
  m.law = model_law(law);
  return m;
}

std::shared_ptr<const MaterialLaw> ogden() {
  MatrixX q(elements, 6);
  q << 3500.0, 4.0, 0.30, 1500.0, -6.0, 0.10, 1200.0, 10.0, 0.15, 600.0, -9.0, 1.0 / 3.0, 2500.0, 3.0, 0.35, 400.0,
      -14.0, 0.20;
  return std::make_shared<OgdenLaw>(q);
}
std::shared_ptr<const MaterialLaw> linear() {
  MatrixX q(elements, 2);
  q << 5000.0, 1000.0, 7000.0, 1.0 / 3.0, 900.0, 300.0;
  return std::make_shared<LinearLaw>(q);
}
std::shared_ptr<const MaterialLaw> neo_hookean() {
  MatrixX q(elements, 2);
  for (int e = 0; e < elements; ++e) q.row(e) << 2000.0 + 300.0 * e, 4000.0 - 100.0 * e;
  return std::make_shared<NeoHookeanLaw>(q);
}
std::shared_ptr<const MaterialLaw> sampled() {
  std::vector<MaterialSample> samples;
  MatrixX strains(elements, 6);
  for (int k = 0; k < 5; ++k) {
    for (int e = 0; e < elements; ++e)
      for (int i = 0; i < 6; ++i) strains(e, i) = 0.1 * std::sin(1.0 + e + 3.1 * i + 7.3 * k);
    samples.push_back(test::stiffening_sample(strains, 5000.0 * (1.0 + 0.2 * k), 4.0, 0.2 + 0.03 * k));
  }
  return sample_material(test::one_term_ogden(elements, 2000.0, 0.25), samples, {1e-9, 5}).law;
}

struct KeptLaw : ::testing::TestWithParam<std::shared_ptr<const MaterialLaw> (*)()> {};

TEST_P(KeptLaw, PullsBackAsBeforeItWasSaved) {
  const TemporaryFolder folder;
  const auto law = GetParam()();
  const Model model = model_with(*law);
  save_model(folder.path(), model);
  const Model read = load_model(folder / "model.toml");
  ASSERT_TRUE(read.law);
  EXPECT_EQ(*read.law, *model.law);
  const auto back = make_law(*read.law, elements);
  EXPECT_EQ(back->name(), law->name());
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int e = 0; e < elements; ++e)
    for (int k = 0; k < 5; ++k) {
      const Matrix3 F = Matrix3::Identity() + 0.1 * Matrix3::NullaryExpr([&] { return normal(random); });
      PointStress before, after;
      law->stress(e, F, true, before);
      back->stress(e, F, true, after);
      ASSERT_GT(before.P.norm(), 0.0);
      EXPECT_LT((after.P - before.P).norm(), 1e-12 * before.P.norm());
      EXPECT_LT((after.tangent - before.tangent).norm(), 1e-12 * before.tangent.norm());
    }
}

INSTANTIATE_TEST_SUITE_P(Laws, KeptLaw, ::testing::Values(&ogden, &linear, &neo_hookean, &sampled), [](const auto& c) {
  return c.param == &ogden ? "Ogden" : c.param == &linear ? "Linear" : c.param == &sampled ? "Sampled" : "NeoHookean";
});

TEST(KeptLaws, ThatAreDamagedAreToldWithWhatToDo) {
  const auto refusal = [](ModelLaw law, int count = elements) {
    return complaint_of([&] { (void)make_law(law, count); });
  };
  const ModelLaw good = model_law(*ogden());
  EXPECT_THAT(refusal(good, elements + 1), HasSubstr("one for each of 4 elements"));
  ModelLaw other = good;
  other.name = "gent";
  EXPECT_THAT(refusal(other), HasSubstr("ogden, neo_hookean, linear or sampled"));
  other = good;
  other.rows[1][3] = 0.7;
  EXPECT_THAT(refusal(other), HasSubstr("nu < 1/2"));
  other = model_law(*sampled());
  ASSERT_FALSE(other.samples.empty());
  other.samples[0][0] = 17;
  EXPECT_THAT(refusal(other), HasSubstr("element 17"));
  other = model_law(*sampled());
  other.samples[0][1] = 0.0;
  EXPECT_THAT(refusal(other), HasSubstr("one width in all rows"));
  for (std::vector<double>& row : other.samples) row[1] = 0.0;
  EXPECT_THAT(refusal(other), HasSubstr("a width > 0"));
  const TemporaryFolder folder;
  save_model(folder.path(), model_with(*ogden()));
  folder.write("material.csv", "mu_1,exponent_1\n1,2\n");
  EXPECT_THAT(complaint_of([&] { (void)load_model(folder / "model.toml"); }), HasSubstr("material.csv"));
  save_model(folder.path(), model_with(*sampled()));
  folder.write("samples.csv", "element,width\n1,2\n");
  EXPECT_THAT(complaint_of([&] { (void)load_model(folder / "model.toml"); }), HasSubstr("samples.csv"));
}

TEST(KeptLaws, OfSampledStiffnessAreRefusedWithWhatToDo) {
  const TemporaryFolder folder;
  save_model(folder.path(), model_with(*sampled()));
  std::string text = read_file(folder / "model.toml");
  const std::size_t begin = text.find("own_law"), end = text.find("\n", text.find("samples = "));
  text.replace(begin, end - begin, "metric_nu = 0.2");
  folder.write("model.toml", text);
  EXPECT_THAT(complaint_of([&] { (void)load_model(folder / "model.toml"); }), HasSubstr("fit the presses again"));
}

}  // namespace
}  // namespace pliant::law_table_test
