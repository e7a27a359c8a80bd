#pragma once

#include <functional>
#include <random>

#include "estimation/fit.hpp"
#include "estimation/recordings.hpp"
#include "geometry/primitives.hpp"
#include "rays/look_at.hpp"
#include "rays/ray_scene.hpp"

namespace pliant::test {

/// Choices of a fit on six elements along the block alone, without models beside it: seconds.
inline FitOptions six_cells() {
  FitOptions options;
  options.cells = options.coarse_cells = 6.0;
  options.budget = 0.0;
  options.alternatives = false;
  return options;
}

/// A parameter of one number as it was fitted.
inline double value(const FitOutcome& outcome, const std::string& name) {
  return outcome.theta[outcome.parameters.find(name)->at];
}

/// A block that falls, turned, on a tilted ground that rubs, seen from above as points with noise, or from aside as
/// masks of cameras without depth. Made by the same
/// elements and law as it is fitted with, on a finer mesh: an inverse crime in part.
struct Dropped {
  static constexpr double youngs_modulus = 6000.0, noise = 1.5e-3;  // [Pa], [m]
  double cells = 9.0;                                               // along the block
  int frames = 30;                                                  // at 60 Hz, from when it is let go
  Vector3 normal = Vector3(0.3, 1.0, 0.1).normalized();
  double friction = 0.25;
  /// What the points are moved by beyond the simulation, frame by frame; empty: nothing.
  std::function<Vector3(int frame)> moved = {};
  /// Cameras whose masks are all that is seen; empty: points are.
  std::vector<SilhouetteCamera> silhouettes = {};
  /// What else the scene has, or has in the ground's place; empty: nothing.
  std::function<void(Scene& scene)> change = {};

  RecordedCapture record(unsigned seed = 5) const {
    RecordedCapture recorded;
    Capture& capture = recorded.capture;
    capture.name = "block";
    TriangleMesh block = make_box(Vector3(0.2, 0.12, 0.15), 0.02);
    const Matrix3 turn = Eigen::AngleAxisd(0.5, Vector3(0.3, 0.2, 1.0).normalized()).toRotationMatrix();
    for (Vector3& v : block.vertices) v = turn * v + Vector3(0.0, 0.19, 0.0);
    capture.scene.object.surface = block;
    capture.scene.object.surface_noise = 0.0;
    capture.scene.object.density = 100.0;
    capture.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
    for (int frame = 0; frame < frames; ++frame) capture.scene.timing.times.push_back(frame / 60.0);
    capture.scene.planes = {{Vector3::Zero(), normal, true, friction}};
    if (change) change(capture.scene);
    if (silhouettes.empty())
      capture.clouds = {{{"cloud.ply"}, 1, noise}};
    else
      capture.silhouettes = silhouettes;
    const auto [parameters, blocks] = default_parameters(capture, enclosed_volume(block));
    VectorX theta = parameters.reference();
    blocks.motion.set_moduli(theta, youngs_modulus);
    theta[blocks.motion.poissons_ratio] = 0.3;
    theta[blocks.motion.mass_damping] = 0.2;
    theta[blocks.motion.stiffness_damping] = 0.004;
    Resolution resolution;
    resolution.cells = cells;
    resolution.follows_thickness = true;
    const Discretisation d = discretise(capture, capture_distance(capture, 0.2), resolution, blocks, theta);
    const Embedding embedding(*d.body, block.vertices);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal_number;
    (void)Simulation(d.body, d.simulation).run(theta, [&](int frame, const State& state, auto) {
      ObservedFrame seen;
      seen.frame = frame;
      const Points x = embedding.positions(state.x);
      RayScene rays;
      if (!silhouettes.empty()) rays.add(x, block.triangles);
      for (std::size_t c = 0; c < silhouettes.size(); ++c) {
        const PinholeCamera& camera = silhouettes[c].camera;
        Image<std::uint8_t> mask(camera.width, camera.height);
        std::ranges::transform(rays.render_depth(camera).depth, mask.pixels.begin(),
                               [](float depth) { return std::uint8_t(depth > 0.0f ? 255 : 0); });
        seen.outlines.push_back({int(c), outline_of(mask, camera)});
      }
      const double middle = silhouettes.empty() ? x.col(1).mean() : 1e300;
      for (Eigen::Index v = 0; v < x.rows(); ++v) {
        if (x(v, 1) < middle) continue;  // the ground's side
        const Vector3 noise_of(normal_number(random), normal_number(random), normal_number(random));
        seen.points.push_back(Vector3(x.row(v)) + noise * noise_of + (moved ? moved(frame) : Vector3(Vector3::Zero())));
        seen.noise.push_back(float(noise));
        seen.view.emplace_back(Vector3::Zero());
        seen.camera.push_back(-1);
        seen.pixel.push_back(-1);
      }
      recorded.observed.push_back(std::move(seen));
      return true;
    });
    return recorded;
  }
};

}  // namespace pliant::test
