// The parts of a tracked frame and the whole of it: a swinging bar of 2,303 nodes (linear tetrahedra) and about 12,000
// vertices of its surface, seen by three depth cameras with about 5,000 points a frame, noise of 3 mm. The expectation
// step is compared with the sum over all pairs.

#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "geometry/primitives.hpp"
#include "motion/simulation.hpp"
#include "support/swinging.hpp"
#include "tracking/neighbours.hpp"

namespace pliant {
namespace {

struct Scene {
  Scene() : swing(options()) {
    swing.surface = make_box({0.06, 0.06, 0.6}, 0.00725);
    for (Vector3& v : swing.surface.vertices) v.z() -= 0.3;
    swing.surface_in_truth = Embedding(*swing.truth, swing.surface.vertices);
    sensors = test::three_sensors(swing, 184);
    for (int f = 0; f < swing.frame_count(); ++f) views.push_back(sensors.see(swing, f));
    sampled = subdivided(swing.surface, TrackOptions{}.sample_spacing * swing.size, TrackOptions{}.most_samples);
    levels = sample_levels(sampled);
    samples_in_body = Embedding(*swing.body, sampled.vertices);
    for (const double area : levels.front().area) whole += area;
  }
  static test::SwingOptions options() {
    test::SwingOptions options;
    options.tracked_cells = {6, 6, 46};
    options.frames = 10;
    return options;
  }
  Tracker tracker() const {
    return {swing.body, swing.scene, swing.theta, swing.surface, sensors.cameras, {}, points(), sensors.noise};
  }
  int points() const { return int(views.front().points.size()); }
  const TrackView& view(int frame) const { return views[std::size_t(frame)]; }
  /// The samples that a deviation asks for, where the object is in a frame.
  const SampleLevel& level(double deviation) const {
    std::size_t l = 0;
    while (l + 1 < levels.size() && levels[l + 1].spacing <= 1.2 * deviation) ++l;
    return levels[l];
  }
  Points samples(const SampleLevel& of, int frame) const {
    const Points all = samples_in_body.positions(swing.true_nodes(frame));
    Points chosen(Eigen::Index(of.vertex.size()), 3);
    for (std::size_t i = 0; i < of.vertex.size(); ++i) chosen.row(Eigen::Index(i)) = all.row(of.vertex[i]);
    return chosen;
  }
  std::vector<double> shares(const SampleLevel& of) const {
    std::vector<double> shares = of.area;
    for (double& share : shares) share /= whole;
    return shares;
  }
  void label(benchmark::State& state, std::size_t samples) const {
    state.counters["points"] = points();
    state.counters["samples"] = double(samples);
  }

  test::Swing swing;
  test::Sensors sensors;
  std::vector<TrackView> views;
  TriangleMesh sampled;
  std::vector<SampleLevel> levels;
  Embedding samples_in_body;
  double whole = 0.0;
};

const Scene& scene() {
  static const Scene scene;
  return scene;
}

constexpr int frame = 5;
constexpr double narrow = 0.004, wide = 0.05;  // [m]

MixtureOptions mixture(double sigma) { return {sigma, 0.05, 1.7}; }

void expectation(benchmark::State& state, double sigma, double of_samples) {
  const SampleLevel& level = scene().level(of_samples);
  const Points samples = scene().samples(level, frame);
  const std::vector<double> shares = scene().shares(level);
  const TrackView& view = scene().view(frame);
  for (auto _ : state)
    benchmark::DoNotOptimize(expect(samples, shares, {view.points, view.noise}, mixture(sigma)).sum_squares);
  scene().label(state, level.vertex.size());
}
BENCHMARK_CAPTURE(expectation, narrow_all_samples, narrow, 0.0)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK_CAPTURE(expectation, wide_few_samples, wide, wide)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

/// All pairs of points and samples, one thread.
void expectation_of_all_pairs(benchmark::State& state) {
  const SampleLevel& level = scene().level(0.0);
  const Points samples = scene().samples(level, frame);
  const std::vector<double> shares = scene().shares(level);
  const TrackView& view = scene().view(frame);
  const MixtureOptions o = mixture(narrow);
  const Eigen::Map<const VectorX> share(shares.data(), Eigen::Index(shares.size()));
  double sum_squares = 0.0;
  for (auto _ : state) {
    VectorX precision = VectorX::Zero(samples.rows()), mass = precision;
    Points target = Points::Zero(samples.rows(), 3);
    sum_squares = 0.0;
    VectorX squared, p;
    for (std::size_t n = 0; n < view.points.size(); ++n) {
      const double s2 = o.sigma * o.sigma + double(view.noise[n]) * double(view.noise[n]);
      squared = (samples.rowwise() - view.points[n].transpose()).rowwise().squaredNorm();
      p = share.array() * (-squared.array() / (2.0 * s2)).exp();
      p /= p.sum() + o.outlier_share / o.volume * std::pow(2.0 * std::numbers::pi * s2, 1.5) / (1.0 - o.outlier_share);
      precision += p / s2;
      mass += p;
      target += p / s2 * view.points[n].transpose();
      sum_squares += p.dot(squared);
    }
    benchmark::DoNotOptimize(target.data());
    benchmark::DoNotOptimize(mass.data());
  }
  const double truncated = expect(samples, shares, {view.points, view.noise}, o).sum_squares;
  state.counters["difference"] = std::abs(truncated / sum_squares - 1.0);
  scene().label(state, level.vertex.size());
}
BENCHMARK(expectation_of_all_pairs)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

/// Once a recording: the surface cut into small triangles, and its levels.
void surface_samples(benchmark::State& state) {
  for (auto _ : state) {
    const TriangleMesh fine = subdivided(scene().swing.surface, 0.006, 16000);
    benchmark::DoNotOptimize(sample_levels(fine).size());
  }
  scene().label(state, scene().sampled.vertices.size());
}
BENCHMARK(surface_samples)->Unit(benchmark::kMillisecond);

/// The tree over all samples, and each point's nearest one.
void neighbours(benchmark::State& state) {
  const Points samples = scene().samples(scene().levels.front(), frame);
  for (auto _ : state) {
    const Neighbours near(samples);
    double sum = 0.0;
    for (const Vector3& point : scene().view(frame).points) sum += near.nearest(point).squared_distance;
    benchmark::DoNotOptimize(sum);
  }
  scene().label(state, std::size_t(samples.rows()));
}
BENCHMARK(neighbours)->Unit(benchmark::kMillisecond);

/// What every camera sees of every sample.
void visibility(benchmark::State& state) {
  Tracker tracker = scene().tracker();
  for (auto _ : state) {
    const double before = tracker.times().visibility;
    benchmark::DoNotOptimize(tracker.compare(scene().view(frame)).explained);
    state.SetIterationTime(tracker.times().visibility - before);
  }
  scene().label(state, scene().sampled.vertices.size());
}
BENCHMARK(visibility)->Unit(benchmark::kMillisecond)->UseManualTime();

/// A frame of a motion that goes on; counters are milliseconds of each part, of them all.
void whole_frame(benchmark::State& state) {
  const Scene& s = scene();
  Tracker tracker = s.tracker();
  const int first = s.swing.options.held, count = s.swing.frame_count();
  int next = count, frames = 0, rounds = 0;
  double error = 0.0;
  for (auto _ : state) {
    if (next == count) {
      state.PauseTiming();
      next = first;
      const Points start = s.swing.true_nodes(first - 1);
      tracker.set_state({start, Points::Zero(start.rows(), 3)});
      state.ResumeTiming();
    }
    const TrackedFrame tracked = tracker.advance(1.0 / s.swing.options.rate, s.view(next));
    error = std::max(error, s.swing.error(next, tracked.nodes));
    rounds += tracked.rounds;
    ++next, ++frames;
  }
  const TrackTimes& times = tracker.times();
  s.label(state, s.sampled.vertices.size());
  state.counters["nodes"] = s.swing.body->node_count();
  state.counters["rounds"] = double(rounds) / frames;
  state.counters["expectation_ms"] = 1e3 * times.correspondence / frames;
  state.counters["maximisation_ms"] = 1e3 * times.motion / frames;
  state.counters["visibility_ms"] = 1e3 * times.visibility / frames;
  state.counters["worst_error"] = error;
  if (!(error < 0.01)) state.SkipWithError("the object was not followed");
}
BENCHMARK(whole_frame)->Iterations(8)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

/// One maximisation step: springs of all samples, one linear system; a frame takes a few of them each round.
void spring_step(benchmark::State& state) {
  const Scene& s = scene();
  const SampleLevel& level = s.levels.front();
  const TrackView& view = s.view(frame + 1);
  const Correspondence c = expect(s.samples(level, frame), s.shares(level), {view.points, view.noise}, mixture(0.03));
  std::vector<std::unique_ptr<ForceTerm>> terms = scene_forces(s.swing.body, s.swing.scene);
  auto springs = std::make_unique<PointSprings>(*s.swing.body, s.samples_in_body);
  const double mass = s.swing.theta[s.swing.layout.density] * s.swing.body->volume();
  const double stiffness = 1000.0 * mass * s.swing.options.rate * s.swing.options.rate;
  springs->set(c.precision * (stiffness / c.precision.sum()), c.target,
               Points::Zero(s.samples_in_body.point_count(), 3), 1.0);
  terms.push_back(std::move(springs));
  StepOptions options;
  options.dt = 1.0 / s.swing.options.rate;
  options.newmark_theta = 0.999;
  Stepper stepper(s.swing.body, std::move(terms), s.swing.layout, options);
  stepper.hold(eliminated_nodes(*s.swing.body, s.swing.scene));
  stepper.set_parameters(s.swing.theta);
  const Points start = s.swing.true_nodes(frame);
  const State at{start, (start - s.swing.true_nodes(frame - 1)) * s.swing.options.rate};
  int iterations = 0;
  for (auto _ : state) {
    Points delta = options.dt * at.v;
    benchmark::DoNotOptimize(stepper.prepare(at, delta));
    iterations = stepper.solve(at, delta).iterations;
  }
  state.counters["iterations"] = iterations;
  state.counters["nodes"] = s.swing.body->node_count();
}
BENCHMARK(spring_step)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pliant
