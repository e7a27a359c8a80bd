#pragma once

#include <gmock/gmock.h>

#include "batch_motion/motion_batch.hpp"
#include "motion/simulation.hpp"
#include "support/scenes.hpp"

namespace pliant::test {

/// A body and what its members have in common, with the same scene for `Simulation`.
struct BatchScene {
  std::shared_ptr<const Body> body;
  MotionLayout layout;
  BatchOptions options;
  BatchMember member;  ///< the first; others are like it

  /// The parameter vector of a member. Its start is not in it.
  VectorX theta(const BatchMember& m) const {
    VectorX theta = layout.zero();
    layout.set_moduli(theta, m.youngs_modulus);
    theta[layout.poissons_ratio] = m.poissons_ratio;
    theta[layout.mass_damping] = m.mass_damping;
    theta[layout.stiffness_damping] = m.stiffness_damping;
    theta[layout.density] = m.density;
    theta.segment<3>(layout.gravity) = m.gravity;
    for (const PlaneBlock& plane : layout.planes) {
      theta.segment<3>(plane.point) = m.plane_point;
      theta.segment<3>(plane.normal) = m.plane_normal;
      theta[plane.friction] = m.friction;
      theta[plane.stiffness] = m.contact_stiffness;
    }
    return theta;
  }
  /// One step a frame, from the member's start.
  Simulation simulation(const BatchMember& m, int steps, double tolerance) const {
    SimulationOptions o;
    for (int s = 0; s <= steps; ++s) o.times.push_back(s * options.dt);
    o.max_dt = options.dt * (1.0 + 1e-6);
    o.newmark_theta = options.newmark_theta;
    o.contact_weight = options.contact_weight;
    o.rotation_prediction = options.rotation_prediction;
    o.material.elastic = ElasticLaw::Corotated;
    o.material.damping = StiffnessDamping::Rayleigh;
    o.solver = {SolverKind::Iterative, tolerance, 2000};
    o.contact = options.contact;
    o.friction_speed = options.friction_speed;
    o.blocks = layout;
    o.most_halvings = 0;
    if (!options.held.empty())
      o.holds.push_back({[](const Vector3& p) { return p.x() < -0.5 + 1e-6; }});
    else
      o.start = m.start.x, o.start_velocities = m.start.v;
    return {body, o};
  }
  /// One like the first, but in everything.
  BatchMember other(int index) const {
    BatchMember m = member;
    const double k = index;
    m.youngs_modulus *= 1.0 + 0.07 * k;
    m.poissons_ratio += 0.01 * (index % 5);
    m.mass_damping += 0.05 * k;
    m.stiffness_damping *= 1.0 + 0.02 * k;
    m.density *= 1.0 - 0.01 * k;
    m.gravity += Vector3(0.1, -0.2, 0.05) * k;
    m.plane_point.y() += 0.0003 * k;
    m.friction *= 1.0 + 0.1 * k;
    if (options.held.empty()) m.start.v.rowwise() += Eigen::RowVector3d(0.02, -0.03, 0.01) * k;
    return m;
  }
};

/// Turning about its middle, falling: of the torus, velocities that stretch it as well.
inline Points turning(const Points& x, const Vector3& linear, const Vector3& angular) {
  Points v(x.rows(), 3);
  for (Eigen::Index n = 0; n < x.rows(); ++n)
    v.row(n) = (linear + angular.cross(Vector3(x.row(n))) + 0.4 * Vector3(x.row(n))).transpose();
  return v;
}

/// A torus of hexahedra that spins onto a tilted plane, on which it rubs.
inline BatchScene batch_torus(double cell_size, double friction = 0.3) {
  BatchScene s;
  s.body = torus_body(0.1, 0.04, cell_size);
  s.layout = MotionLayout({.planes = 1});
  s.options.dt = 1.0 / 240.0;
  s.options.with_plane = true;
  s.options.contact = default_contact(*s.body, 100.0 * s.body->volume(), 9.81);
  s.options.contact.smoothing = 6e-4;
  s.options.friction_speed = friction > 0.0 ? 0.02 : 0.0;
  BatchMember& m = s.member;
  m.youngs_modulus = 4000.0, m.poissons_ratio = 0.35, m.mass_damping = 0.3, m.stiffness_damping = 0.003;
  m.density = 100.0, m.gravity = {0.1, -9.7, 0.2};
  m.plane_point = {0.01, -0.05, 0.02}, m.plane_normal = Vector3(0.1, 1.0, -0.05).normalized();
  m.friction = friction;
  m.contact_stiffness = 1.2 * s.options.contact.stiffness;
  m.start.x = s.body->nodes;
  m.start.v = turning(m.start.x, {0.3, -1.5, 0.1}, {1.0, -2.0, 3.0});
  return s;
}

/// A bar of linear tetrahedra that is held at one end and let go.
inline BatchScene batch_bar(const Eigen::Vector3i& cells) {
  BatchScene s;
  s.body = tet_body({1.0, 0.25, 0.25}, cells, false);
  s.options.dt = 0.01;
  for (int n = 0; n < s.body->node_count(); ++n)
    if (s.body->nodes(n, 0) < -0.5 + 1e-6) s.options.held.push_back(n);
  BatchMember& m = s.member;
  m.youngs_modulus = 1e6, m.poissons_ratio = 0.4, m.mass_damping = 0.1, m.stiffness_damping = 0.001, m.density = 1000.0;
  m.gravity = {0.3, -9.81, 0.5};
  m.start.x = s.body->nodes;
  m.start.v = Points::Zero(s.body->node_count(), 3);
  return s;
}

/// States of one member after each step.
inline std::vector<State> simulated(const BatchScene& scene, const BatchMember& m, int steps, double tolerance) {
  std::vector<State> states;
  Simulation simulation = scene.simulation(m, steps, tolerance);
  const RolloutSummary summary = simulation.run(scene.theta(m), [&](int, const State& state, std::span<const State>) {
    states.push_back(state);
    return true;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return states;
}

/// States of all members at the end.
inline std::vector<State> ends(MotionBatch& batch, int steps, std::vector<BatchRun>* runs = nullptr) {
  std::vector<State> end;
  const std::vector<BatchRun> all =
      batch.run(steps, {steps}, [&](int, std::span<const State> states) { end.assign(states.begin(), states.end()); });
  if (runs) *runs = all;
  return end;
}

/// Gradients of half the sum of squares of all nodes' positions at the end, one a member.
inline std::vector<BatchGradient> gradients_of_ends(MotionBatch& batch, int steps) {
  std::vector<BatchGradient> all;
  batch.run_adjoint(
      steps, {steps}, {},
      [](int, std::span<const State> states, std::span<State> bars) {
        for (std::size_t k = 0; k < states.size(); ++k) bars[k].x = states[k].x;
      },
      all);
  return all;
}

inline double farthest(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

}  // namespace pliant::test
