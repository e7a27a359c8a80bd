#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.hpp"
#include "base/error.hpp"
#include "base/parallel.hpp"
#include "bindings.hpp"
#include "estimation/fit_config.hpp"
#include "interruption.hpp"
#include "output/fit_job.hpp"

namespace pliant::python {

namespace {

namespace fs = std::filesystem;

py::dict told(const FitEvent& event) {
  py::dict out;
  out["stage"] = event.stage;
  out["start"] = event.start;
  out["iteration"] = event.iteration;
  out["cost"] = event.cost;
  out["youngs_modulus"] = event.youngs_modulus;
  out["fraction_done"] = event.fraction_done;
  return out;
}

/// @param on_line, on_event  functions of the caller, or None
py::dict run_fit(const std::vector<fs::path>& captures, const std::optional<fs::path>& held_out, const fs::path& out,
             const std::optional<fs::path>& config, const std::vector<std::string>& settings, int threads, bool resume,
             const py::object& on_line, const py::object& on_event) {
  FitJob job;
  job.captures = captures, job.held_out = held_out, job.out = out, job.resume = resume;
  job.version = PLIANT_VERSION, job.commit = PLIANT_COMMIT;
  if (config) read_fit_options(*config, job.options);
  for (const std::string& assignment : settings) set_fit_option(job.options, assignment);
  if (const std::string wrong = job.options.validate(); !wrong.empty())
    throw InputError({{config.value_or(fs::path())}, wrong, "", "see `pliant fit --help`"});
  Interruption interruption;
  FitWatch watch;
  if (!on_line.is_none())
    watch.on_line = [&](const std::string& line) { interruption.call([&] { on_line(line); }); };
  if (!on_event.is_none())
    watch.on_event = [&](const FitEvent& event, const std::string& line) {
      interruption.call([&] { on_event(told(event), line); });
    };
  watch.interrupted = [&] { return interruption.asked(); };
  FitJobOutcome done;
  try {
    const py::gil_scoped_release unlocked;
    std::optional<ThreadLimit> limit;
    if (threads > 0) limit.emplace(threads);
    done = run_fit_job(job, watch);
  } catch (const Interrupted&) {
    interruption.rethrow();
    throw;
  }
  interruption.rethrow();
  py::dict ended;
  ended["has_result"] = done.result.has_value();
  ended["converged"] = done.outcome.converged;
  ended["reason"] = done.outcome.reason;
  return ended;
}

}  // namespace

void bind_fits(py::module_& module) {
  module.def("fit", &run_fit);
  module.def("fit_keys", [] {
    py::list keys;
    for (const FitKey& key : fit_keys()) keys.append(py::make_tuple(key.name, key.standard, key.sentence));
    return keys;
  });
}

}  // namespace pliant::python
