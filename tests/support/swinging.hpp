#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "geometry/subdivided.hpp"
#include "rays/look_at.hpp"
#include "tracking/tracker.hpp"

namespace pliant::test {

/// Swinging objects that depth sensors see, held at one end, pulled aside and let go.
enum class SwingShape { Bar, Leaf };

struct SwingOptions {
  SwingShape shape = SwingShape::Bar;
  double youngs_modulus = 5e5;                                          ///< [Pa]
  std::vector<Vector3> pulls = {{0.25, 0.1, 0.0}, {-0.02, 0.02, 0.0}};  ///< of the free end and of the middle
  double rate = 30.0;                                                   ///< [Hz]
  int held = 2, frames = 12;                                            ///< until it is let go, and altogether
  int steps = 4;                                                        ///< of the truth between frames
  Eigen::Vector3i true_cells = {2, 2, 12}, tracked_cells = {2, 2, 18};
  bool tracked_is_quadratic = false;
  double spacing = 0.02;  ///< of the scan's vertices, times the object's size
};

/// A bar that hangs down from z = 0, or a thin leaf, curved both ways, that sticks out along x from x = 0.
inline Body swinging_body(SwingShape shape, const Eigen::Vector3i& cells, bool is_quadratic) {
  const bool is_bar = shape == SwingShape::Bar;
  Box box;
  box.extend(is_bar ? Vector3(-0.03, -0.03, -0.6) : Vector3(0.0, -0.06, -0.003));
  box.extend(is_bar ? Vector3(0.03, 0.03, 0.0) : Vector3(0.3, 0.06, 0.003));
  TetMesh mesh = make_tet_box(box, cells, false);
  if (!is_bar) {
    for (Eigen::Index n = 0; n < mesh.nodes.rows(); ++n) {
      const double x = mesh.nodes(n, 0), y = mesh.nodes(n, 1);
      mesh.nodes(n, 2) += 0.8 * x * (0.3 - x) + 2.0 * y * y;
    }
    mesh = make_tet_mesh(std::move(mesh.nodes), std::move(mesh.tets));
  }
  return make_body(is_quadratic ? with_mid_nodes(mesh) : std::move(mesh));
}

inline TriangleMesh boundary_of(const Body& body) {
  const auto& mesh = std::get<TetMesh>(body.mesh);
  std::map<int, int> own;
  TriangleMesh surface;
  for (std::array<int, 3> face : mesh.boundary) {
    for (int& node : face) {
      const auto [at, is_new] = own.try_emplace(node, int(surface.vertices.size()));
      if (is_new) surface.vertices.push_back(mesh.nodes.row(node).transpose());
      node = at->second;
    }
    surface.triangles.push_back(face);
  }
  return surface;
}

/// What is true of a swing, and what a tracker is given of it: another mesh, other elements and other steps.
struct Swing {
  explicit Swing(const SwingOptions& of) : options(of) {
    truth = std::make_shared<Body>(swinging_body(of.shape, of.true_cells, true));
    body = std::make_shared<Body>(swinging_body(of.shape, of.tracked_cells, of.tracked_is_quadratic));
    size = truth->size();
    surface = subdivided(boundary_of(*truth), of.spacing * size, 20000);
    std::vector<Vector3> rest;
    for (Eigen::Index n = 0; n < body->nodes.rows(); ++n) rest.emplace_back(body->nodes.row(n).transpose());
    nodes_in_truth = Embedding(*truth, rest);
    surface_in_truth = Embedding(*truth, surface.vertices);

    const bool is_bar = of.shape == SwingShape::Bar;
    scene.holds = {{[is_bar](const Vector3& p) { return is_bar ? p.z() > -1e-6 : p.x() < 1e-6; }}};
    scene.blocks = layout;
    scene.times = {0.0};
    scene.max_dt = 1.0 / of.rate;
    theta = layout.zero();
    layout.set_moduli(theta, of.youngs_modulus);
    theta[layout.poissons_ratio] = 0.35;
    theta[layout.mass_damping] = 0.2;
    theta[layout.stiffness_damping] = 0.002;
    theta[layout.density] = 300.0;
    theta.segment<3>(layout.gravity) = Vector3(0.0, 0.0, -9.81);

    SimulationOptions moving = scene;
    moving.times.clear();
    for (int f = 0; f < of.frames - of.held + 1; ++f) moving.times.push_back(f / of.rate);
    moving.max_dt = (1.0 + 1e-9) / (of.rate * of.steps);
    moving.integrator = Integrator::Newton;
    const MotionLayout pulled({.pulls = int(of.pulls.size())});
    moving.blocks = pulled;
    moving.pull_points.size = size;
    for (std::size_t k = 0; k < of.pulls.size(); ++k)
      moving.pull_points.at.push_back((1.0 - 0.5 * double(k)) * (is_bar ? Vector3(0, 0, -0.6) : Vector3(0.3, 0, 0)));
    VectorX own = carry(layout.layout(), theta, pulled.layout(), pulled.zero());
    for (std::size_t k = 0; k < of.pulls.size(); ++k) own.segment<3>(pulled.pulls[k]) = of.pulls[k];
    Simulation simulation(truth, moving);
    const RolloutSummary summary = simulation.run(own, [&](int frame, const State& state, auto) {
      for (int f = frame == 0 ? 1 - of.held : 0; f <= 0; ++f) positions.push_back(state.x);
      return true;
    });
    if (!summary.succeeded) throw std::runtime_error(summary.failure);
  }

  int frame_count() const { return int(positions.size()); }
  double time(int frame) const { return frame / options.rate; }
  bool is_held(int frame) const { return frame < options.held; }
  Points true_nodes(int frame) const { return nodes_in_truth.positions(positions[std::size_t(frame)]); }
  Points true_surface(int frame) const { return surface_in_truth.positions(positions[std::size_t(frame)]); }
  /// Farthest way of a point of the surface between two frames, over the size.
  double fastest() const {
    double most = 0.0;
    for (int f = 1; f < frame_count(); ++f)
      most = std::max(most, (true_surface(f) - true_surface(f - 1)).rowwise().norm().maxCoeff());
    return most / size;
  }
  /// Mean over the tracked body's nodes, over the size.
  double error(int frame, const Points& nodes) const {
    return (nodes - true_nodes(frame)).rowwise().norm().mean() / size;
  }

  SwingOptions options;
  std::shared_ptr<const Body> truth, body;
  SimulationOptions scene;        ///< for the tracked body
  MotionLayout layout;            ///< of `theta`
  VectorX theta;                  ///< the true material
  TriangleMesh surface;           ///< the scan
  double size = 0.0;              ///< [m]
  std::vector<Points> positions;  ///< of the truth's nodes in each frame [m]
  Embedding nodes_in_truth, surface_in_truth;
};

/// Depth sensors around an object: what is in sight, with noise along the rays, and outliers within twice its box.
struct Sensors {
  std::vector<PinholeCamera> cameras;
  double noise = 0.003;  ///< [m]
  double outliers = 0.01;
  std::function<bool(const Vector3& rest)> hidden;  ///< part of the surface that no sensor sees
  unsigned seed = 1;

  TrackView see(const Swing& swing, int frame) const {
    const Points now = swing.true_surface(frame);
    RayScene scene;
    scene.add(now, swing.surface.triangles);
    std::mt19937 random(seed + 7919U * unsigned(frame));
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const Vector3 low = now.colwise().minCoeff(), high = now.colwise().maxCoeff();
    TrackView view;
    for (const PinholeCamera& camera : cameras) {
      const DepthRender seen = scene.render_depth(camera);
      for (int v = 0; v < seen.height; ++v)
        for (int u = 0; u < seen.width; ++u) {
          const auto pixel = std::size_t(seen.at(u, v));
          if (seen.mesh[pixel] < 0) continue;
          Vector3 rest = Vector3::Zero();
          for (const int corner : swing.surface.triangles[std::size_t(seen.triangle[pixel])])
            rest += swing.surface.vertices[std::size_t(corner)] / 3.0;
          if (hidden && hidden(rest)) continue;
          Vector3 point = camera.unproject(u, v, double(seen.depth[pixel]) + noise * normal(random));
          if (uniform(random) < 2.0 * outliers - 1.0)
            point = 0.5 * (low + high) + swing.size * Vector3(uniform(random), uniform(random), uniform(random));
          view.points.push_back(point);
          view.noise.push_back(float(noise));
        }
    }
    return view;
  }
};

/// Three around the object, whose images are `height` pixels high and wide.
inline Sensors three_sensors(const Swing& swing, int height) {
  const bool is_bar = swing.options.shape == SwingShape::Bar;
  const Vector3 middle = is_bar ? Vector3(0.0, 0.0, -0.3) : Vector3(0.15, 0.0, 0.0);
  Sensors sensors;
  for (int k = 0; k < 3; ++k) {
    const double angle = 0.4 + 2.0 * std::numbers::pi * k / 3.0;
    const Vector3 eye = middle + 2.0 * swing.size * Vector3(std::cos(angle), std::sin(angle), is_bar ? 0.2 : 0.9);
    sensors.cameras.push_back(look_at(eye, middle, Vector3::UnitZ(), height, height, 0.75));
  }
  return sensors;
}

/// In the middle third of the object, along it, or in the one at its free end.
inline bool is_in_middle_third(SwingShape shape, const Vector3& rest) {
  return shape == SwingShape::Bar ? rest.z() < -0.2 && rest.z() > -0.4 : rest.x() > 0.1 && rest.x() < 0.2;
}
inline bool is_in_end_third(SwingShape shape, const Vector3& rest) {
  return shape == SwingShape::Bar ? rest.z() <= -0.4 : rest.x() >= 0.2;
}

/// A recording as `track` takes it.
struct SwingRecording {
  Capture capture;
  std::vector<ObservedFrame> observed;
  std::vector<Vector3> markers;
  std::map<int, std::vector<TrackObservation>> seen_markers;

  SwingRecording(const Swing& swing, const Sensors& sensors) {
    capture.name = "swing";
    capture.scene.object.surface = swing.surface;
    capture.scene.object.surface_noise = 0.0;
    capture.scene.timing.start_frame = swing.options.held - 1;
    capture.scene.initial.released = true;
    for (int f = 0; f < swing.frame_count(); ++f) {
      capture.scene.timing.times.push_back(swing.time(f));
      TrackView view = sensors.see(swing, f);
      ObservedFrame frame;
      frame.frame = f, frame.points = std::move(view.points), frame.noise = std::move(view.noise);
      observed.push_back(std::move(frame));
    }
    for (const PinholeCamera& camera : sensors.cameras) {
      DepthCamera depth;
      depth.camera = camera;
      capture.depth.push_back(depth);
    }
  }
  Track track(const Swing& swing, const VectorX& theta, const TrackOptions& options = {}) const {
    return pliant::track(capture, swing.body, swing.scene, theta, observed, markers, seen_markers, options);
  }
  Track track(const Swing& swing) const { return track(swing, swing.theta); }
};

}  // namespace pliant::test
