#pragma once

#include <random>

#include "estimation/objective.hpp"
#include "support/scenes.hpp"

namespace pliant::test {

/// A simulated recording of the torus scene: points on its surface with noise, and what a fit of it needs.
struct Recording {
  TorusScene scene;
  std::shared_ptr<const SurfaceConstraints> constraints;
  std::shared_ptr<std::vector<FrameObservations>> observations;
  ParameterSet parameters;  ///< all that a torus scene has, at the truth; none is estimated yet
  VectorX truth;

  Objective objective(const ParameterSet& fitted, double outlier_scale = 0.03) const {
    ObjectiveOptions options;
    options.outlier_scale = outlier_scale;
    options.last_frame = int(scene.options.times.size()) - 1;
    return {{constraints, nullptr}, scene.body, scene.options, observations, fitted, options};
  }
};

/// Every so many of the body's surface samples are seen in each frame, with noise along all three axes.
inline Recording torus_recording(double cell_size, int frames, int planes, double noise, unsigned seed = 1,
                                 int points = 40, double true_cell_size = 0.0, double true_step_share = 1.0,
                                 double solver_tolerance = 1e-13, double spacing = 0.004) {
  const auto make_scene = [&](double cell) {
    TorusScene scene = torus_scene(cell, frames, SolverKind::Iterative, solver_tolerance, planes);
    if (planes == 0) scene.theta.segment<3>(scene.layout.angular_velocity) *= 4.0;  // so that stiffness shows
    return scene;
  };
  Recording r;
  r.scene = make_scene(cell_size);
  r.truth = r.scene.theta;
  TorusScene real = make_scene(true_cell_size > 0.0 ? true_cell_size : cell_size);
  real.options.max_dt *= true_step_share;
  real.options.contact = r.scene.options.contact;
  const auto distance = std::make_shared<SignedDistance>(torus_distance(0.1, 0.04, spacing, 0.1));
  r.constraints = std::make_shared<SurfaceConstraints>(r.scene.body, distance, 0.035);
  r.observations = std::make_shared<std::vector<FrameObservations>>();
  r.parameters = torus_parameters(r.scene.layout, r.truth);

  std::vector<Vector3> samples;
  for (const SurfacePoint& p : real.body->surface) samples.push_back(p.position);
  const Embedding surface(*real.body, samples);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Simulation simulation(real.body, real.options);
  simulation.run(r.truth, [&](int frame, const State& state, auto) {
    if (frame == 0) return true;
    const Points x = surface.positions(state.x);
    FrameObservations seen{frame, {}};
    for (int i = 0; i < points; ++i) {
      const Eigen::Index row = (Eigen::Index(i) * x.rows() / points + 7 * frame) % x.rows();
      const double sigma = noise > 0.0 ? noise : 1e-3;
      seen.points.push_back(
          {Vector3(x.row(row).transpose()) + noise * Vector3(normal(random), normal(random), normal(random)), sigma});
    }
    r.observations->push_back(std::move(seen));
    return true;
  });
  return r;
}

}  // namespace pliant::test
