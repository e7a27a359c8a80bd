// From the scan of an object that sags to its shape stress-free, the whole way of `pliant rest`.
#include "estimation/load_free.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"
#include "geometry/primitives.hpp"

namespace pliant::load_free_test {
namespace {

constexpr double length = 0.3;

/// A bar along x as it was scanned, clamped at its low end.
Capture scanned_bar() {
  Capture capture;
  capture.scene.object.surface = make_box(Vector3(length, 0.02, 0.03), 0.02);
  for (Vector3& v : capture.scene.object.surface->vertices)
    v += 0.5 * Vector3(length, 0.02, 0.03);  // one corner at the origin
  capture.scene.object.mass = 0.18;
  capture.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
  capture.scene.fixed = {{RegionBox{Vector3::Constant(-0.01), Vector3(0.001, 0.04, 0.04)}, {}}};
  return at_rest(capture);
}

LoadFree load_free(const Capture& capture, double youngs_modulus) {
  Resolution resolution;
  resolution.element = ElementKind::QuadraticTetrahedron;
  resolution.cells = 8.0;
  const auto [parameters, blocks] = default_parameters(capture, enclosed_volume(*capture.scene.object.surface));
  VectorX theta = parameters.reference();
  blocks.motion.set_moduli(theta, youngs_modulus);
  return find_load_free(capture, resolution, blocks, theta);
}

TEST(LoadFree, AScannedBarStoodHigherAndSagsBackIntoItsScan) {
  const LoadFree found = load_free(scanned_bar(), 1e7);
  ASSERT_TRUE(found.shape.found) << found.shape.reason;
  // By the theory of slender beams the end of the bar sags by w L^4 / (8 E I).
  const double weight = 0.18 * 9.81 / length, inertia = 0.03 * std::pow(0.02, 3) / 12.0;
  const double theory = weight * std::pow(length, 4) / (8.0 * 1e7 * inertia);
  ASSERT_GT(theory, 0.09 * length);
  EXPECT_NEAR(found.sag / theory, 1.0, 0.05) << "it shears a little, and the clamp keeps it wide";
  EXPECT_LT(found.re_sag_error, 1e-6 * length);
  double highest = 0.0;
  for (const Vector3& v : found.surface.vertices) highest = std::max(highest, v.y());
  EXPECT_NEAR(highest, 0.02 + theory, 0.05 * theory);
  EXPECT_NEAR(enclosed_volume(found.surface) / enclosed_volume(*scanned_bar().scene.object.surface), 1.0, 0.02);
}

TEST(LoadFree, AMaterialThatCannotCarryTheBarIsNamed) {
  const LoadFree found = load_free(scanned_bar(), 2e5);
  EXPECT_FALSE(found.shape.found);
  ASSERT_GT(found.shape.carried, 0.0);
  EXPECT_LT(found.shape.carried, 1.0);
}

TEST(LoadFree, WhatCannotBeDoneIsRefused) {
  Capture loose = scanned_bar();
  loose.scene.fixed.clear();
  EXPECT_THROW((void)load_free(loose, 1e6), InputError);
  const Capture capture = scanned_bar();
  const CaptureParameters p = default_parameters(capture, enclosed_volume(*capture.scene.object.surface));
  EXPECT_THROW((void)find_load_free(capture, Resolution{}, p.blocks, p.set.reference()), InputError) << "hexahedra";
}

}  // namespace
}  // namespace pliant::load_free_test
