// Where a body is free of load that was scanned as it sags, by three schemes: steps of pseudo-time, the virtual forces
// of Wang 2015 (section 6.1), and plain Newton steps from the scan. Bodies are a clamped beam of 0.6 x 0.03 x 0.03 m as
// it sags slightly, far, and hangs, and a leaf, 0.4 x 0.1 x 0.008 m. The scan is the equilibrium of the known shape, so
// all that is compared is how the schemes get back to it; `error` is how far from it they end, relative to the size.

#include <benchmark/benchmark.h>

#include <stdexcept>

#include "motion/reference_shape.hpp"
#include "motion/simulation.hpp"

namespace pliant {
namespace {

const MotionLayout layout;

struct Scan {
  std::shared_ptr<const Body> known, scanned;
  std::vector<int> held;
  VectorX theta;
};

/// A box along x, clamped at its low end, under gravity across it.
Scan sagging_box(const Vector3& extent, Eigen::Vector3i cells, bool is_quadratic, double youngs_modulus) {
  Scan scan;
  Box box;
  box.extend(Vector3::Zero()), box.extend(extent);
  scan.known = std::make_shared<Body>(make_body(make_tet_box(box, cells, is_quadratic)));
  scan.theta = layout.zero();
  layout.set_moduli(scan.theta, youngs_modulus);
  scan.theta[layout.poissons_ratio] = 0.3;
  scan.theta[layout.density] = 1000.0;
  scan.theta.segment<3>(layout.gravity) = Vector3(0.0, 0.0, -9.81);
  SimulationOptions options;
  options.blocks = layout;
  options.times = {0.0};
  options.is_static = true;
  options.material.elastic = ElasticLaw::Corotated;
  options.newton.tolerance = 1e-10;
  options.holds = {{[](const Vector3& p) { return p.x() < 1e-9; }}};
  scan.held = held_nodes(*scan.known, options.holds);
  Points sagged;
  Simulation simulation(scan.known, options);
  const RolloutSummary summary =
      simulation.run(scan.theta, [&](int, const State& state, auto) { return sagged = state.x, true; });
  if (!summary.succeeded) throw std::runtime_error("the box does not sag: " + summary.failure);
  const TetMesh& mesh = std::get<TetMesh>(scan.known->mesh);
  Body scanned = make_body(make_tet_mesh(sagged, mesh.tets, mesh.mid_nodes));
  scanned.mass = scan.known->mass;
  scan.scanned = std::make_shared<Body>(std::move(scanned));
  return scan;
}

Scan beam(bool is_quadratic, double youngs_modulus) {
  return sagging_box({0.6, 0.03, 0.03}, is_quadratic ? Eigen::Vector3i(12, 1, 1) : Eigen::Vector3i(24, 2, 2),
                     is_quadratic, youngs_modulus);
}
Scan slight(bool is_quadratic) { return beam(is_quadratic, 3e7); }
Scan far(bool is_quadratic) { return beam(is_quadratic, 3e6); }
Scan hanging(bool is_quadratic) { return beam(is_quadratic, 1e6); }
Scan leaf(bool is_quadratic) {
  return sagging_box({0.4, 0.1, 0.008}, is_quadratic ? Eigen::Vector3i(8, 2, 1) : Eigen::Vector3i(16, 4, 1),
                     is_quadratic, 1e8);
}

using MakeScan = Scan (*)(bool);

void find(benchmark::State& state, MakeScan make, ReferenceScheme scheme, bool is_quadratic) {
  const Scan scan = make(is_quadratic);
  ReferenceShapeOptions options;
  options.scheme = scheme;
  options.tolerance = 1e-8;
  options.max_iterations = 400;
  const Points load = scan_load(*scan.scanned, layout, scan.theta, {});
  ReferenceShape shape;
  for (auto _ : state) {
    ReferenceShapeSolver solver(scan.scanned, scan.held, Material{ElasticLaw::Corotated}, layout, options);
    shape = solver.find(scan.theta, load);
    benchmark::DoNotOptimize(shape.X.data());
  }
  const Points& X = scan.known->nodes;
  const double size = scan.known->size();
  state.counters["found"] = shape.found;
  state.counters["iterations"] = shape.iterations;
  state.counters["residual"] = shape.residual;
  state.counters["error"] = (shape.X - X).rowwise().norm().maxCoeff() / size;
  state.counters["sag"] = (scan.scanned->nodes - X).rowwise().norm().maxCoeff() / size;
  state.counters["nodes"] = scan.known->node_count();
  if (scheme == ReferenceScheme::PseudoTransient && !shape.found) state.SkipWithError("the default finds no shape");
}

#define PLIANT_REFERENCE_SHAPE_BENCHMARK(scan, scheme)                                  \
  BENCHMARK_CAPTURE(find, scan##_linear_##scheme, scan, ReferenceScheme::scheme, false) \
      ->Unit(benchmark::kMillisecond);                                                  \
  BENCHMARK_CAPTURE(find, scan##_quadratic_##scheme, scan, ReferenceScheme::scheme, true)->Unit(benchmark::kMillisecond)
#define PLIANT_REFERENCE_SHAPE_BENCHMARKS(scan)            \
  PLIANT_REFERENCE_SHAPE_BENCHMARK(scan, PseudoTransient); \
  PLIANT_REFERENCE_SHAPE_BENCHMARK(scan, VirtualForce);    \
  PLIANT_REFERENCE_SHAPE_BENCHMARK(scan, Newton)

PLIANT_REFERENCE_SHAPE_BENCHMARKS(slight);
PLIANT_REFERENCE_SHAPE_BENCHMARKS(far);
PLIANT_REFERENCE_SHAPE_BENCHMARKS(hanging);
PLIANT_REFERENCE_SHAPE_BENCHMARKS(leaf);

}  // namespace
}  // namespace pliant
