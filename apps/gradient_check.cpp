#include "gradient_check.hpp"

#include <algorithm>
#include <iostream>
#include <ostream>

#include "base/files.hpp"
#include "commands.hpp"
#include "estimation/gradient_check.hpp"
#include "estimation/press_scene.hpp"
#include "estimation/start_objective.hpp"
#include "scan/scan_pose.hpp"

namespace pliant::apps {

namespace {

void write_csv(const std::filesystem::path& path, const GradientCheck& check) {
  write_file(path, [&](std::ostream& out) {
    out.precision(17);
    out << "parameter,step,difference,tangents,adjoint\n";
    for (const CheckedDerivative& d : check.derivatives)
      for (std::size_t k = 0; k < d.steps.size(); ++k)
        out << d.name << "," << d.steps[k] << "," << d.differences[k] << "," << d.by_tangents << "," << d.by_adjoint
            << "\n";
  });
}

}  // namespace

int run_gradient_check(std::vector<RecordedCapture> recordings, const FitOptions& options,
                       const std::filesystem::path& out, const std::shared_ptr<ProcessGroup>& processes) {
  ObserveOptions observe_options;
  observe_options.max_points_per_frame = options.points_per_frame;
  const auto progress = [&](int done, int total) {
    if (processes->is_first()) show_progress("read", done, total);
  };
  (void)processes->gather("a gradient's check", [&] {
    for (RecordedCapture& recording : recordings) {
      if (is_of_static_tests(recording.capture)) continue;
      recording.observed = observe_placed(recording.capture, observe_options, progress);
      stop_if_interrupted();
    }
    return std::string();
  });
  FitOptions exact = options;  // solved for as well as differences can tell, which a fit's tangents are not
  exact.solver_tolerance = std::min(options.solver_tolerance, 1e-11);
  const StartObjective start = start_objective(std::move(recordings), exact, processes);
  const GradientCheck check = check_gradient(*start.cost, start.p);
  if (processes->is_first()) {
    make_folder(out);
    std::cout << describe(check);
    write_csv(out / "gradient.csv", check);
  }
  return check.succeeded && check.agrees() ? Fine : NotConverged;
}

}  // namespace pliant::apps
