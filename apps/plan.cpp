#include "plan.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "base/files.hpp"
#include "commands.hpp"
#include "estimation/press_scene.hpp"
#include "output/fit_output.hpp"
#include "scan/scan_pose.hpp"
#include "speech.hpp"
#include "synthetic_recording.hpp"

namespace pliant::apps {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

/// A folder that is gone in the end.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (fs::temp_directory_path() / "pliant-plan-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder can be made: " + name);
    path_ = name;
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// The fit begins where the scene says that the truth is: what it states there is asked, not whether it is found. (Fits
/// of static tests find their start themselves.)
FitOptions options_at(const SyntheticScene& scene, bool finds_start) {
  FitOptions options;
  const auto start = [&](const std::string& name, double value) {
    options.parameters[name].start = VectorX::Constant(1, value);
  };
  const LawLayout layout = scene.law_layout();
  const VectorX numbers = scene.law_parameters(layout);
  for (const ParameterHandle& handle : layout.all()) start(layout.layout().block_of(handle).name, numbers[handle]);
  const Timing& timing = scene.scene.timing;
  if (!timing.times.empty() && !timing.is_static) {
    start("mass_damping", scene.mass_damping);
    start("stiffness_damping", scene.stiffness_damping);
  }
  if (finds_start) {
    options.parameters.clear();
    options.law_zones = scene.law ? scene.law->laws : 1;
    if (named_moduli(scene.scene).empty()) options.control_points = 1;
  }
  options.material =
      scene.material.of_mean_strain() == ElasticLaw::Corotated ? MaterialKind::Linear : MaterialKind::NeoHookean;
  if (scene.law && scene.law->terms > 0) options.material = MaterialKind::Ogden, options.law_terms = scene.law->terms;
  options.starts = options.most_starts = 1;
  options.budget = 0.0;
  return options;
}

/// The cause with the largest part in a parameter's deviation; null where nothing is known of it.
const UncertaintyResult* largest_cause(const Result& result, const std::string& name) {
  const UncertaintyResult* largest = nullptr;
  for (const UncertaintyResult& u : result.uncertainty) {
    const auto own = u.std.find(name);
    if (own != u.std.end() && (!largest || own->second > largest->std.at(name))) largest = &u;
  }
  return largest;
}

void tell(const Result& result, const SyntheticScene& scene, Json& json) {
  std::cout << scene.name << ": what a recording like this would tell (90 % intervals)\n";
  for (const ParameterResult& p : result.parameters) {
    if (!p.estimated || !p.interval_90) continue;
    const double value = std::get<double>(p.value), half = 0.5 * (p.interval_90->second - p.interval_90->first);
    const UncertaintyResult* cause = largest_cause(result, p.name);
    const std::string unit = p.unit == "1" ? "" : " " + p.unit;
    std::string text =
        formatted("%.3g%s, %.3g to %.3g", value, unit.c_str(), p.interval_90->first, p.interval_90->second);
    if (half < std::abs(value)) text += formatted(" (± %.0f %%)", 100.0 * half / std::abs(value));
    say(p.name, text + (cause ? ", most of it from " + cause->cause : ""), 20);
    json["parameters"][p.name] = {{"value", value}, {"interval_90", {p.interval_90->first, p.interval_90->second}}};
    if (cause) json["parameters"][p.name]["largest_cause"] = cause->cause;
  }
  for (const std::string& reason : result.reasons) std::cout << "- " << reason << '\n';
  for (const std::string& note : result.notes) std::cout << "note: " << note << '\n';
}

}  // namespace

void plan(const fs::path& path, const fs::path& out) {
  const SyntheticScene scene = read_synthetic_scene(path);
  std::optional<ScratchFolder> scratch;
  if (out.empty()) scratch.emplace();
  const fs::path folder = out.empty() ? scratch->path() : out;
  write_recording(folder, scene);
  RecordedCapture recording{read_capture(folder), {}};
  const FitOptions options = options_at(scene, is_of_static_tests(recording.capture));
  ObserveOptions observe_options;
  observe_options.max_points_per_frame = options.points_per_frame;
  recording.observed = observe_placed(recording.capture, observe_options);
  stop_if_interrupted();
  FitMonitor monitor;
  monitor.interrupted = [] { return is_interrupted(); };
  monitor.on_event = [](const FitEvent& event) { show_progress("per cent", int(100.0 * event.fraction_done), 100); };
  const std::vector<RecordedCapture> recordings = {std::move(recording)};
  const FitOutcome outcome = fit(recordings, options, monitor);
  stop_if_interrupted();
  if (!outcome.evaluation.succeeded)
    throw InputError({{path}, "a recording of the scene cannot be fitted: " + outcome.reason, "", ""});
  Json json = {{"format", "plan/1"}, {"scene", scene.name}};
  tell(make_result(recordings, outcome, {}), scene, json);
  if (!out.empty()) write_file(out / "plan.json", json.dump(2) + "\n");
}

}  // namespace pliant::apps
