#pragma once

#include <random>

#include "estimation/recordings.hpp"
#include "geometry/primitives.hpp"

namespace pliant::test {

inline constexpr double stiffness_of_bar = 2e5;  ///< [Pa], of the half that is held

/// Few elements, one start, no finer mesh.
inline FitOptions quick_fit_of_bar() {
  FitOptions options;
  options.budget = 0.0;
  options.cells = options.coarse_cells = 8.0;
  options.parameters["poissons_ratio"].estimated = false;
  options.starts = 1;
  return options;
}

/// A bar along x, clamped at its low end, that sags to rest, seen as points with noise; beyond its middle its modulus
/// may be another. Made by the same elements and law as it is fitted with, on a finer mesh: an inverse crime in part.
inline RecordedCapture sagging_bar(double beyond, const Vector3& gravity = {0.0, -9.81, 0.0}, unsigned seed = 7) {
  constexpr double length = 0.4, edge = 0.05, stiff = stiffness_of_bar, noise = 1e-3;
  RecordedCapture recorded;
  Capture& capture = recorded.capture;
  capture.name = "bar";
  capture.scene.object.surface = make_box(Vector3(length, edge, edge), 0.0125);
  capture.scene.object.surface_noise = capture.scene.object.stiffness_std = 0.0;
  capture.scene.object.density = 400.0;
  capture.scene.world.gravity = gravity;
  capture.scene.world.up = -gravity.normalized();
  capture.scene.timing.is_static = true;
  capture.scene.timing.times = {0.0};
  capture.scene.fixed = {{RegionBox{Vector3(-1, -1, -1), Vector3(-0.5 * length + 1e-4, 1, 1)}, {}}};
  capture.clouds = {{{"cloud.ply"}, 1, noise}};
  Capture zoned = capture;
  zoned.scene.regions = {{"beyond", RegionHalfSpace{Vector3::Zero(), Vector3::UnitX()}}};
  const auto [parameters, blocks] = default_parameters(zoned, enclosed_volume(*capture.scene.object.surface), 2);
  VectorX theta = parameters.reference();
  theta[blocks.motion.youngs_moduli[0]] = stiff;
  theta[blocks.motion.youngs_moduli[1]] = beyond;
  Resolution resolution;
  resolution.cells = 16.0;
  const Discretisation d = discretise(zoned, capture_distance(zoned, 0.2), resolution, blocks, theta);
  const Embedding embedding(*d.body, capture.scene.object.surface->vertices);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  ObservedFrame seen;
  Simulation(d.body, d.simulation).run(theta, [&](int, const State& state, auto) {
    const Points x = embedding.positions(state.x);
    for (Eigen::Index v = 0; v < x.rows(); ++v) {
      seen.points.push_back(Vector3(x.row(v)) + noise * Vector3(normal(random), normal(random), normal(random)));
      seen.noise.push_back(float(noise));
      seen.view.emplace_back(Vector3::Zero());
      seen.camera.push_back(-1);
      seen.pixel.push_back(-1);
    }
    return true;
  });
  recorded.observed = {seen};
  return recorded;
}

}  // namespace pliant::test
