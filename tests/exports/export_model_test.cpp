#include "exports/export_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "base/error.hpp"
#include "elasticity/modes.hpp"
#include "simulation/model_simulation.hpp"
#include "support/models.hpp"

namespace pliant::export_model_test {
namespace {

constexpr double length = 0.2;

/// A slender bar of quadratic tetrahedra of two moduli, held at its low end.
Model bar(bool is_quadratic = true) {
  Model model = test::block(true);
  model.scene.fixed = {{RegionHalfSpace{{-0.0999, 0, 0}, {-1, 0, 0}}, std::nullopt}};
  model.scene.planes.clear();
  model.scene.object.surface = make_box(Vector3(length, 0.02, 0.02), 0.01);
  const auto body = test::tet_body({length, 0.02, 0.02}, {10, 2, 2}, is_quadratic, 0.0);
  model.volume.nodes = body->nodes;
  model.volume.kind = is_quadratic ? VtuCell::QuadraticTetrahedron : VtuCell::Tetrahedron;
  model.volume.connectivity = body->connectivity;
  for (int e = 0; e < body->element_count(); ++e) model.volume.youngs_modulus.push_back(e % 2 ? 2e5 : 2.5e5);
  model.youngs_modulus = 2.2e5;
  return model;
}

/// The lowest frequencies [Hz] of what was exported, found anew from its elements and their moduli.
std::vector<double> found_anew(const ExportModel& exported, int count) {
  Body body = *exported.body;
  for (std::size_t e = 0; e < exported.moduli.size(); ++e) body.modulus.relative[e] = exported.moduli[e];
  const MotionLayout layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 1.0);
  theta[layout.poissons_ratio] = exported.poissons_ratio;
  theta[layout.density] = exported.density;
  const int rigid = exported.held.empty() ? 6 : 0;
  const Modes found = modes(std::make_shared<Body>(std::move(body)), layout, theta, exported.held, rigid + count);
  EXPECT_TRUE(found.converged) << found.failure;
  std::vector<double> hertz;
  for (int k = rigid; k < found.count(); ++k) hertz.push_back(found.frequency(k));
  return hertz;
}

void expect_frequencies_of_what_is_written(const ExportModel& exported) {
  const std::vector<double> hertz = found_anew(exported, 6);
  ASSERT_EQ(hertz.size(), exported.exported.frequencies.size());
  for (std::size_t k = 0; k < hertz.size(); ++k)
    EXPECT_NEAR(exported.exported.frequencies[k], hertz[k], 1e-5 * hertz[k]) << k;
  EXPECT_NEAR(hertz[0], exported.model.frequencies[0], 1e-5 * hertz[0]) << "the model's own";
}

TEST(ExportModel, OfTheSameElementsIsTheModel) {
  const Model model = bar();
  const ExportModel exported = export_model(model, ElementKind::QuadraticTetrahedron);
  EXPECT_EQ(exported.identified, 1.0);
  ASSERT_EQ(exported.moduli.size(), model.volume.youngs_modulus.size());
  for (std::size_t e = 0; e < exported.moduli.size(); ++e)
    EXPECT_NEAR(exported.moduli[e], model.volume.youngs_modulus[e], 1e-9 * exported.moduli[e]);
  EXPECT_EQ(exported.exported.frequencies, exported.model.frequencies);
  EXPECT_EQ(exported.exported.sag, exported.model.sag);
  EXPECT_EQ(exported.density, 500.0);
  EXPECT_EQ(exported.gravity, Vector3(0.0, -9.81, 0.0));
  EXPECT_FALSE(exported.held.empty());
}

/// A sheet of 1 mm, 100 mm long, with one linear tetrahedron through its thickness.
TEST(ExportModel, ToldThatTheModelsLinearElementsLock) {
  const auto sheet = [](bool is_quadratic) {
    Model model = bar(is_quadratic);
    model.scene.object.surface = make_box(Vector3(length, 0.001, 0.02), 0.01);
    const auto body = test::tet_body({length, 0.001, 0.02}, {20, 1, 2}, is_quadratic, 0.0);
    model.volume.nodes = body->nodes;
    model.volume.connectivity = body->connectivity;
    model.volume.youngs_modulus.assign(std::size_t(body->element_count()), 2e5);
    return model;
  };
  const auto locks = ::testing::Contains(::testing::HasSubstr("linear tetrahedra lock"));
  EXPECT_THAT(export_model(sheet(false), ElementKind::Tetrahedron).notes, locks);
  EXPECT_THAT(export_model(sheet(true), ElementKind::QuadraticTetrahedron).notes, ::testing::Not(locks));
}

/// Subspace iteration beside Lanczos's method.
TEST(ExportModel, FrequenciesAreThoseOfModalAnalysis) {
  const Model model = bar();
  const ExportModel exported = export_model(model, ElementKind::QuadraticTetrahedron);
  const ModelScene scene = make_scene(model);
  const Modes modes = pliant::modes(scene.body, scene.simulation.blocks, scene.theta, exported.held, 6);
  ASSERT_TRUE(modes.converged);
  ASSERT_EQ(exported.model.frequencies.size(), 6u);
  for (int k = 0; k < 6; ++k)
    EXPECT_NEAR(exported.model.frequencies[std::size_t(k)], modes.frequency(k), 1e-6 * modes.frequency(k)) << k;
}

/// An even cantilever: f = 1.8751^2 / (2 pi L^2) sqrt(E I / (rho A)), sag rho A g L^4 / (8 E I).
TEST(ExportModel, KnowsHowABeamVibratesAndSags) {
  Model model = bar();
  std::ranges::fill(model.volume.youngs_modulus, 2.2e5);
  const ExportModel exported = export_model(model, ElementKind::QuadraticTetrahedron);
  const double b = 0.02, bending = 2.2e5 * std::pow(b, 4) / 12.0, mass = 500.0 * b * b;
  const double hertz = std::pow(1.8751 / length, 2) / (2.0 * std::numbers::pi) * std::sqrt(bending / mass);
  EXPECT_NEAR(exported.model.frequencies[0], hertz, 0.02 * hertz);
  EXPECT_NEAR(exported.model.frequencies[1], exported.model.frequencies[0], 0.01 * hertz) << "either way";
  const double sag = mass * 9.81 * std::pow(length, 4) / (8.0 * bending);
  EXPECT_NEAR(exported.model.sag, sag, 0.03 * sag);
}

TEST(ModelBody, SplitsQuadraticElementsInEightOfTheSameModulus) {
  const Model model = bar();
  const auto body = model_body(model, ElementKind::Tetrahedron);
  const std::size_t count = model.volume.youngs_modulus.size();
  ASSERT_EQ(body->modulus.relative.size(), 8 * count);
  EXPECT_EQ(body->node_count(), int(model.volume.nodes.rows()));
  EXPECT_NEAR(body->volume(), length * 4e-4, 1e-9);
  for (std::size_t e = 0; e < 8 * count; ++e)
    EXPECT_NEAR(body->modulus.relative[e], model.volume.youngs_modulus[e / 8] / model.youngs_modulus, 1e-9);
}

/// Two halves of different stiffness: a mesh laid anew has the modulus of the half that an element lies in.
TEST(ModelBody, LaidAnewHasTheModuliOfTheNearestElements) {
  Model model = bar();
  for (std::size_t e = 0; e < model.volume.youngs_modulus.size(); ++e) {
    double middle = 0.0;
    for (std::size_t k = 0; k < 4; ++k) middle += 0.25 * model.volume.nodes(model.volume.connectivity[10 * e + k], 0);
    model.volume.youngs_modulus[e] = middle < 0.0 ? 1e5 : 4e5;
  }
  for (const ElementKind kind : {ElementKind::Tetrahedron, ElementKind::QuadraticTetrahedron}) {
    const auto body = model_body(model, kind, 20.0);
    EXPECT_EQ(body->kind, kind);
    EXPECT_NEAR(body->volume(), length * 4e-4, 1e-3 * length * 4e-4);
    int low = 0, high = 0;
    for (int e = 0; e < body->element_count(); ++e) {
      double middle = 0.0;
      for (const int node : body->element(e)) middle += body->nodes(node, 0) / double(body->element(e).size());
      if (std::abs(middle) < 0.01) continue;  // within half an element of the halves' border
      const double modulus = body->modulus.relative[std::size_t(e)] * model.youngs_modulus;
      EXPECT_NEAR(modulus, middle < 0.0 ? 1e5 : 4e5, 1.0) << middle;
      ++(middle < 0.0 ? low : high);
    }
    EXPECT_GT(low, 20);
    EXPECT_GT(high, 20);
  }
}

/// Linear elements lock: frequencies of coarse ones are off, and the mesh that is chosen is not.
TEST(ExportModel, OfLinearElementsIsFineEnough) {
  Model model = bar();
  std::ranges::fill(model.volume.youngs_modulus, 2.2e5);
  const auto off = [](const ExportModel& exported) {
    double most = 0.0;
    for (std::size_t k = 0; k < 6; ++k)
      most = std::max(most, std::abs(exported.exported.frequencies[k] / exported.model.frequencies[k] - 1.0));
    return most;
  };
  const ExportModel coarse = export_model(model, ElementKind::Tetrahedron, 10.0);
  const ExportModel chosen = export_model(model, ElementKind::Tetrahedron);
  EXPECT_GT(off(coarse), 0.03);
  EXPECT_THAT(coarse.notes, ::testing::Contains(::testing::HasSubstr("off the model's")));
  EXPECT_LT(off(chosen), 0.02);
  EXPECT_THAT(chosen.notes, ::testing::Not(::testing::Contains(::testing::HasSubstr("off the model's"))));
  EXPECT_LE(chosen.body->node_count(), 8000);
  EXPECT_LT(coarse.identified, chosen.identified);
  EXPECT_LT(chosen.identified, 1.0) << "linear elements are stiffer";
  expect_frequencies_of_what_is_written(chosen);
}

/// Nearly incompressible material: Poisson's ratio gives way, and frequencies come closer than with the model's.
TEST(ExportModel, OfLinearElementsLowersPoissonsRatioWhereTheyLock) {
  Model model = bar();
  std::ranges::fill(model.volume.youngs_modulus, 2.2e5);
  model.poissons_ratio = 0.495;
  const ExportModel exported = export_model(model, ElementKind::Tetrahedron, 16.0);
  EXPECT_LT(exported.poissons_ratio, 0.49);
  EXPECT_GE(exported.poissons_ratio, 0.3);
  EXPECT_THAT(exported.notes, ::testing::Contains(::testing::HasSubstr("Poisson's ratio")));
  expect_frequencies_of_what_is_written(exported);
}

TEST(ExportModel, GivesLinearElementsMidNodes) {
  const Model model = bar(false);
  const ExportModel exported = export_model(model, ElementKind::QuadraticTetrahedron);
  EXPECT_EQ(exported.moduli.size(), model.volume.youngs_modulus.size());
  EXPECT_TRUE(exported.is_quadratic());
  EXPECT_GT(exported.identified, 1.0) << "the model's own elements were stiffer than its modulus";
}

TEST(ExportModel, OfHexahedraVibratesAsFast) {
  const Model model = test::block(true);
  for (const ElementKind kind : {ElementKind::Tetrahedron, ElementKind::QuadraticTetrahedron}) {
    const ExportModel exported = export_model(model, kind, 6.0);
    EXPECT_EQ(exported.body->kind, kind);
    expect_frequencies_of_what_is_written(exported);
    if (kind == ElementKind::QuadraticTetrahedron) {
      EXPECT_NEAR(exported.identified, 1.0, 0.1);
      EXPECT_NEAR(exported.exported.sag, exported.model.sag, 0.05 * exported.model.sag);
      EXPECT_NEAR(exported.exported.frequencies[1], exported.model.frequencies[1],
                  0.02 * exported.model.frequencies[1]);
    } else {
      EXPECT_LT(exported.identified, 0.9) << "linear elements lock";
    }
    EXPECT_THAT(exported.notes, ::testing::Contains(::testing::HasSubstr("Planes")));
  }
}

TEST(ExportModel, OfAFreeObjectHasNoRigidFrequencyAndNoSag) {
  const ExportModel exported = export_model(test::block(false), ElementKind::Tetrahedron, 6.0);
  EXPECT_TRUE(exported.held.empty());
  EXPECT_EQ(exported.model.sag, 0.0);
  ASSERT_EQ(exported.model.frequencies.size(), 6u);
  EXPECT_GT(exported.model.frequencies[0], 1.0);
  expect_frequencies_of_what_is_written(exported);
}

TEST(ExportModel, RefusesMeshesThatNobodyCanMean) {
  for (const double cells : {0.0, 1.0, 1e4, std::nan("")}) {
    try {
      (void)export_model(bar(), ElementKind::Tetrahedron, cells);
      FAIL() << cells;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(),
                  ::testing::AllOf(::testing::HasSubstr("longest axis"), ::testing::HasSubstr("2 to 300")));
    }
  }
}

TEST(ExportModel, SaysThatALawIsToldByItsModuli) {
  const ExportModel exported = export_model(test::pressed_block(), ElementKind::Tetrahedron);
  EXPECT_THAT(exported.notes, ::testing::Contains(::testing::HasSubstr("ogden")));
}

/// The highest frequency of linear elements with lumped masses bounds what explicit steps may be: sqrt(3) c / h for a
/// regular lattice is a lower bound here.
TEST(ExportModel, KnowsItsHighestFrequency) {
  const ExportModel exported = export_model(bar(), ElementKind::Tetrahedron, 20.0);
  const double nu = 0.3, E = 2e5 * exported.identified;
  const double speed = std::sqrt(E * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) / 500.0), edge = 0.01;
  EXPECT_GT(exported.stiffest, speed / edge);
  EXPECT_LT(exported.stiffest, 20.0 * speed / edge);
}

TEST(GroupedModuli, AreThemselvesWhereTheyAreFew) {
  const ModulusGroups groups = grouped_moduli({3.0, 1.0, 3.0, 2.0}, 8);
  EXPECT_EQ(groups.moduli, (std::vector<double>{1.0, 2.0, 3.0}));
  EXPECT_EQ(groups.group, (std::vector<int>{2, 0, 2, 1}));
}

TEST(GroupedModuli, AreStepsOfTheLogarithmWhereTheyAreMany) {
  std::vector<double> moduli;
  for (int i = 0; i < 1000; ++i) moduli.push_back(std::pow(10.0, 3.0 * i / 999.0));
  const ModulusGroups groups = grouped_moduli(moduli, 50);
  ASSERT_LE(groups.moduli.size(), 50u);
  const double half_a_step = 0.5 * std::log(1e3) / 50;
  for (std::size_t i = 0; i < moduli.size(); ++i)
    EXPECT_LT(std::abs(std::log(groups.moduli[std::size_t(groups.group[i])] / moduli[i])), 1.001 * half_a_step);
}

}  // namespace
}  // namespace pliant::export_model_test
