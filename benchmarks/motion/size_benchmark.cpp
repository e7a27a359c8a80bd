// What a time step costs at one size of body, in seconds and bytes: one line of comma-separated values. A process for
// each size, so that its memory is that size's alone; `size_benchmark.py` runs them all and draws them.
//
//   size_benchmark --case torus|bar|stiff_bar --nodes N [--steps S] [--solver KIND] [--threads T] [--dt SECONDS]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include "base/parallel.hpp"
#include "motion/sized_scenes.hpp"

namespace pliant {
namespace {

struct Choices {
  std::string scene = "torus", solver = "automatic";
  int nodes = 1000, steps = 4, threads = 1;
  double dt = 0.0;  // [s]; 0: the program's default
};

Choices read_choices(int count, char** arguments) {
  Choices choices;
  for (int i = 1; i + 1 < count; i += 2) {
    const std::string name = arguments[i], value = arguments[i + 1];
    if (name == "--case")
      choices.scene = value;
    else if (name == "--nodes")
      choices.nodes = std::stoi(value);
    else if (name == "--steps")
      choices.steps = std::stoi(value);
    else if (name == "--solver")
      choices.solver = value;
    else if (name == "--threads")
      choices.threads = std::stoi(value);
    else if (name == "--dt")
      choices.dt = std::stod(value);
    else
      throw std::invalid_argument("no such option: " + name);
  }
  return choices;
}

SolverKind solver_kind(const std::string& name) {
  static const std::map<std::string, SolverKind> kinds = {{"automatic", SolverKind::Automatic},
                                                          {"iterative", SolverKind::Iterative},
                                                          {"multigrid", SolverKind::Multigrid},
                                                          {"cholmod", SolverKind::Cholmod}};
  return kinds.at(name);
}

double processor_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}
double wall_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// A line of /proc/self/status in bytes: VmRSS, or VmHWM, the most that there was.
double memory_bytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(name + ":")) return 1024.0 * std::stod(line.substr(name.size() + 1));
  return 0.0;
}

int run(const Choices& choices) {
  const ThreadLimit limit(choices.threads);
  const double empty = memory_bytes("VmRSS"), start = wall_s();
  benchmark::SizedScene scene = benchmark::sized_scene(choices.scene, choices.nodes);
  const double made = wall_s() - start, body_bytes = memory_bytes("VmRSS") - empty;
  scene.options.solver.kind = solver_kind(choices.solver);
  scene.options.solver.tolerance = 1e-8;
  if (choices.dt > 0.0) scene.options.max_dt = choices.dt;
  scene.options.most_halvings = 0;
  for (int s = 0; s <= choices.steps; ++s) scene.options.times.push_back(s * scene.options.max_dt);
  Simulation simulation(scene.body, scene.options);
  std::vector<double> processor, wall;
  const RolloutSummary summary = simulation.run(scene.theta, [&](int, const State&, auto) {
    processor.push_back(processor_s()), wall.push_back(wall_s());
    return true;
  });
  if (!summary.succeeded) throw std::runtime_error(summary.failure);
  const auto median = [](std::vector<double>& at) {
    std::vector<double> steps;
    for (std::size_t s = 1; s < at.size(); ++s) steps.push_back(at[s] - at[s - 1]);
    std::nth_element(steps.begin(), steps.begin() + std::ptrdiff_t(steps.size() / 2), steps.end());
    return steps[steps.size() / 2];
  };
  const double nodes = scene.body->node_count();
  std::printf("%s,%s,%d,%d,%d,%.4g,%.4g,%.4g,%.4g,%.1f,%.0f,%.0f,%.0f\n", choices.scene.c_str(), choices.solver.c_str(),
              choices.threads, scene.body->node_count(), scene.body->element_count(), scene.options.max_dt, made,
              median(processor), median(wall), double(summary.solver_iterations) / summary.steps,
              (memory_bytes("VmRSS") - empty) / nodes, (memory_bytes("VmHWM") - empty) / nodes, body_bytes / nodes);
  return 0;
}

}  // namespace
}  // namespace pliant

int main(int count, char** arguments) {
  try {
    return pliant::run(pliant::read_choices(count, arguments));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "size_benchmark: %s\n", error.what());
    return 1;
  }
}
