#include "estimation/fit_config.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <functional>
#include <optional>
#include <sstream>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/old_names.hpp"
#include "base/types.hpp"
#include "scene/toml_table.hpp"

namespace pliant {

namespace {

const std::vector<std::pair<std::string, OptimiserKind>> optimisers = {
    {"levenberg_marquardt", OptimiserKind::LevenbergMarquardt},
    {"rprop", OptimiserKind::Rprop},
    {"gradient_descent", OptimiserKind::GradientDescent},
    {"lbfgs", OptimiserKind::Lbfgs},
    {"nelder_mead", OptimiserKind::NelderMead}};
const std::vector<std::pair<std::string, SolverKind>> solvers = {{"automatic", SolverKind::Automatic},
                                                                 {"iterative", SolverKind::Iterative},
                                                                 {"multigrid", SolverKind::Multigrid},
                                                                 {"cholmod", SolverKind::Cholmod},
                                                                 {"simplicial", SolverKind::Simplicial}};
const std::vector<std::pair<std::string, StiffnessDamping>> dampings = {{"kelvin_voigt", StiffnessDamping::KelvinVoigt},
                                                                        {"rayleigh", StiffnessDamping::Rayleigh}};
const std::vector<std::pair<std::string, MaterialKind>> materials = {{"automatic", MaterialKind::Automatic},
                                                                     {"linear", MaterialKind::Linear},
                                                                     {"neo_hookean", MaterialKind::NeoHookean},
                                                                     {"ogden", MaterialKind::Ogden},
                                                                     {"sampled", MaterialKind::Sampled}};
const std::vector<std::pair<std::string, TrackingUse>> tracking_uses = {{"auto", TrackingUse::Automatic},
                                                                        {"off", TrackingUse::Off},
                                                                        {"loop", TrackingUse::Loop},
                                                                        {"both", TrackingUse::Both}};
const std::vector<std::pair<std::string, LoadFreeScheme>> load_free_schemes = {
    {"monolithic", LoadFreeScheme::Monolithic}, {"staggered", LoadFreeScheme::Staggered}};
const std::vector<std::pair<std::string, std::optional<ElementKind>>> element_names = {
    {"automatic", std::nullopt},
    {"hexahedra", ElementKind::Hexahedron},
    {"tetrahedra", ElementKind::Tetrahedron},
    {"quadratic_tetrahedra", ElementKind::QuadraticTetrahedron}};
const std::vector<std::pair<std::string, Integrator>> integrators = {{"lagged", Integrator::Lagged},
                                                                     {"newton", Integrator::Newton}};
const std::vector<std::pair<std::string, FieldOptions::Weights>> control_weights = {
    {"linear", FieldOptions::Weights::Linear},
    {"harmonic", FieldOptions::Weights::Harmonic},
    {"inverse_distance", FieldOptions::Weights::InverseDistance}};
const std::set<std::string> parameter_names = {"youngs_modulus",
                                               "poissons_ratio",
                                               "mass_damping",
                                               "stiffness_damping",
                                               "density",
                                               "gravity",
                                               "linear_velocity",
                                               "angular_velocity",
                                               "plane",
                                               "friction",
                                               "wind",
                                               "strength",
                                               "pull",
                                               "range_error",
                                               "outline_error",
                                               "sensor_turn",
                                               "sensor_shift",
                                               "range_scale",
                                               "focal_error",
                                               "scan_correction",
                                               "contact_stiffness"};
/// Of planes from the second on, and of an Ogden law's terms.
const std::set<std::string> numbered_names = {"plane", "friction", "exponent", "stiffness_ratio", "poissons_ratio"};

/// Whether a fit may have a parameter of that name, without what stands behind "@" or "[".
bool is_parameter_name(const std::string& base) {
  if (parameter_names.contains(base)) return true;
  const std::size_t at = base.rfind('_');
  return at != std::string::npos && numbered_names.contains(base.substr(0, at)) && at + 1 < base.size() &&
         base.find_first_not_of("0123456789", at + 1) == std::string::npos;
}

std::string text_of(double value) {
  std::ostringstream out;
  out.precision(12);
  out << value;
  return out.str();
}

template <class Kind>
std::string name_of(const std::vector<std::pair<std::string, Kind>>& names, Kind kind) {
  for (const auto& [name, k] : names)
    if (k == kind) return name;
  return "";
}

/// One key with how its value is written and read as text. `read` returns what was expected, or nothing if fine.
struct Entry {
  FitKey key;
  std::function<std::string(const FitOptions&)> write;
  std::function<std::optional<std::string>(FitOptions&, const std::string&)> read;
};

std::optional<double> number(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

template <class Part>
Entry real_entry(const char* name, const char* unit, const char* range, const char* sentence, double Part::*member) {
  return {{name, "number", unit, text_of(FitOptions{}.*member), range, sentence},
          [=](const FitOptions& o) { return text_of(o.*member); },
          [=](FitOptions& o, const std::string& text) -> std::optional<std::string> {
            const auto value = number(text);
            if (!value) return "a number";
            o.*member = *value;
            return std::nullopt;
          }};
}

template <class Part>
Entry integer_entry(const char* name, const char* range, const char* sentence, int Part::*member) {
  return {{name, "whole number", "", std::to_string(FitOptions{}.*member), range, sentence},
          [=](const FitOptions& o) { return std::to_string(o.*member); },
          [=](FitOptions& o, const std::string& text) -> std::optional<std::string> {
            const auto value = number(text);
            if (!value || *value != double(int(*value)) || *value < 0) return "a whole number, not negative";
            o.*member = int(*value);
            return std::nullopt;
          }};
}

template <class Kind, class Part>
Entry choice_entry(const char* name, const char* sentence, const std::vector<std::pair<std::string, Kind>>& names,
                   Kind Part::*member) {
  std::string range;
  for (const auto& [text, kind] : names) range += (range.empty() ? "" : ", ") + text;
  return {{name, "name", "", name_of(names, FitOptions{}.*member), range, sentence},
          [&names, member](const FitOptions& o) { return '"' + name_of(names, o.*member) + '"'; },
          [&names, member, range](FitOptions& o, const std::string& text) -> std::optional<std::string> {
            for (const auto& [known, kind] : names)
              if (known == text) {
                o.*member = kind;
                return std::nullopt;
              }
            return "one of " + range;
          }};
}

template <class Part>
Entry flag_entry(const char* name, const char* sentence, bool Part::*member) {
  return {{name, "true or false", "", FitOptions{}.*member ? "true" : "false", "", sentence},
          [=](const FitOptions& o) { return std::string(o.*member ? "true" : "false"); },
          [=](FitOptions& o, const std::string& text) -> std::optional<std::string> {
            if (text != "true" && text != "false") return "true or false";
            o.*member = text == "true";
            return std::nullopt;
          }};
}

Entry control_points_entry() {
  Entry entry =
      integer_entry("control_points",
                    "1..500, auto: as many as the recordings support, or default: auto where an object that is held "
                    "swings before depth cameras, and with tracking=both; else 1",
                    "number of control points of the field of Young's modulus, where the capture names no regions",
                    &FitOptions::control_points);
  entry.key.type = "whole number or auto";
  entry.key.standard = "default";
  entry.write = [](const FitOptions& o) {
    if (o.control_points == FitOptions::unsaid) return std::string("\"default\"");
    return o.control_points == FitOptions::automatic ? std::string("\"auto\"") : std::to_string(o.control_points);
  };
  entry.read = [count = entry.read](FitOptions& o, const std::string& text) -> std::optional<std::string> {
    if (text == "default") return o.control_points = FitOptions::unsaid, std::nullopt;
    if (text == "auto") return o.control_points = FitOptions::automatic, std::nullopt;
    if (!number(text) || count(o, text) || o.control_points == 0) return "a whole number from 1, or auto";
    return std::nullopt;
  };
  return entry;
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = {
      real_entry("cells", "", "4..64",
                 "elements along the object's longest axis, of presses and pulls two thirds as many quadratic ones; "
                 "more is finer and "
                 "slower",
                 &FitOptions::cells),
      real_entry("steps", "", "0..16", "time steps per default step; 2 halves the step", &FitOptions::steps),
      integer_entry("refine", "1..3",
                    "number of resolutions of mesh and time step for Richardson extrapolation; 1: no extrapolation",
                    &FitOptions::refine),
      real_entry(
          "budget", "minutes", "0 and more",
          "about how long the fit may take on two cores of a laptop, counted in steps, with repetitions on finer "
          "meshes, made as long as the mesh's part in the uncertainty of a modulus is more than half of the "
          "noise's; 10 % slower where the mesh is not what contributes most; 0: never",
          &FitOptions::budget),
      real_entry("span", "", "0..1",
                 "part of each recording that is compared, from where it begins; 0: all of it, or the part that the "
                 "model explains where the object meets obstacles",
                 &FitOptions::span),
      integer_entry("points_per_frame", "0, or 10 and more",
                    "greatest number of observed points used of each frame, evenly spread; 0: all",
                    &FitOptions::points_per_frame),
      integer_entry("starts", "1 and more",
                    "number of local minimisations, from the best values of the scan over Young's modulus",
                    &FitOptions::starts),
      integer_entry(
          "most_starts", "1 and more",
          "greatest number of them, with those that are drawn at random (Young's modulus about the best values, "
          "Poisson's ratio and dampings from their priors) as long as no start fits well",
          &FitOptions::most_starts),
      integer_entry("max_iterations", "1 and more", "greatest number of iterations of each stage of the optimiser",
                    &FitOptions::max_iterations),
      real_entry("coarse_cells", "", "4..64",
                 "elements along the longest axis of the coarse grid on which starts are followed",
                 &FitOptions::coarse_cells),
      integer_entry("scan_per_decade", "1 and more", "values of Young's modulus tried in each decade by the scan",
                    &FitOptions::scan_per_decade),
      real_entry("wide_band", "object sizes", "0..0.5",
                 "outlier scale of the robust loss (Tukey's biweight) in the early stages", &FitOptions::wide_band),
      real_entry("fine_band", "object sizes", "0..0.5",
                 "outlier scale of the robust loss (Tukey's biweight) in the last stage", &FitOptions::fine_band),
      choice_entry("element",
                   "finite elements; automatic: hexahedra, or quadratic_tetrahedra of what is pressed or pulled and "
                   "where the stress-free reference shape is unknown",
                   element_names, &FitOptions::element),
      choice_entry("tracking",
                   "alternate model-based tracking with the fit of the tracked motion (loop), fit the observed surface "
                   "points (off), "
                   "or both, keeping what predicts held-out frames better; auto: both for clouds and several cameras, "
                   "else off",
                   tracking_uses, &FitOptions::tracking),
      integer_entry("tracking_rounds", "1..10", "greatest number of alternations of tracking and fit",
                    &FitOptions::tracking_rounds),
      choice_entry("load_free",
                   "coupling of the material and the stress-free shape of an object scanned under gravity: monolithic, "
                   "or staggered",
                   load_free_schemes, &FitOptions::load_free),
      integer_entry("scan_points", "0..50", "control points of the scan-correction field; 0 disables it",
                    &FitOptions::scan_points),
      real_entry("scan_std", "object sizes", "0..0.2", "prior standard deviation of the scan-correction field",
                 &FitOptions::scan_std),
      choice_entry("integrator",
                   "time integration: rotations and a law's tangent predicted (semi-implicit), or fully implicit by "
                   "Newton's method",
                   integrators, &FitOptions::integrator),
      integer_entry("pull_points", "1..50",
                    "application points of the unknown loads that hold a released object before its release, at most: "
                    "as few as its "
                    "registered pose asks for",
                    &FitOptions::pull_points),
      control_points_entry(),
      real_entry("modulus_variation", "", "0..10",
                 "prior standard deviation of ln E over the object's length, where there are control points",
                 &FitOptions::modulus_variation),
      choice_entry("control_weights", "interpolation of moduli between control points", control_weights,
                   &FitOptions::control_weights),
      choice_entry("optimiser", "optimiser of the cost", optimisers, &FitOptions::optimiser),
      choice_entry("solver", "linear solver of a time step", solvers, &FitOptions::solver),
      real_entry("solver_tolerance", "", "0..1", "relative residual of the iterative solver",
                 &FitOptions::solver_tolerance),
      real_entry("newmark_theta", "", "0.5..1",
                 "parameter of Newmark's scheme: weight of a time step's end; above 0.5 adds numerical damping",
                 &FitOptions::newmark_theta),
      flag_entry("correct",
                 "estimate systematic errors (range bias and extrinsics of sensors, direction of gravity) where a "
                 "score test on the "
                 "residuals requires it",
                 &FitOptions::correct),
      flag_entry("alternatives",
                 "try the estimate under other models (mesh, time step, law, given quantities) and add what "
                 "they differ by to its intervals",
                 &FitOptions::alternatives),
      flag_entry("hold_strongly",
                 "impose Dirichlet conditions of held regions strongly, by elimination of nodes, instead of weakly by "
                 "Nitsche's method",
                 &FitOptions::hold_strongly),
      choice_entry(
          "damping",
          "law of stiffness damping at large strain: kelvin_voigt, on the rate of the Green strain, or rayleigh, "
          "by the corotated stiffness",
          dampings, &FitOptions::damping),
      choice_entry(
          "material",
          "material law of whatever moves, rests and is pressed; automatic: neo-Hookean, or Ogden's law where static "
          "tests are all there is; linear: corotated linear elasticity; sampled: the stiffness of each press "
          "interpolated in strain space, for presses alone",
          materials, &FitOptions::material),
      integer_entry("law_terms", "0..3",
                    "number of terms of Ogden's law; 0: one for motions and equilibria, else as many as the static "
                    "tests support",
                    &FitOptions::law_terms),
      integer_entry("law_zones", "0..12",
                    "number of zones with a law of their own each; 0: as many as the static tests support; 1: a "
                    "homogeneous object",
                    &FitOptions::law_zones),
      real_entry("marker_noise", "m", ">= 0",
                 "standard deviation of a marker's coordinate under a press; 0: estimated from the residuals",
                 &FitOptions::marker_noise),
      real_entry("basis_tolerance", "", "> 0", "tolerance of stress, relative to the greatest, of a sampled material",
                 &FitOptions::basis_tolerance),
      integer_entry("basis_samples", ">= 1", "greatest number of samples of an element of a sampled material",
                    &FitOptions::basis_samples),
  };
  return all;
}

const Entry* find_entry(const std::string& name) {
  for (const Entry& e : entries())
    if (e.key.name == name) return &e;
  return nullptr;
}

/// What a choice's value is called now.
std::string present_value(const std::string& key, const std::string& value) {
  if (key == "load_free" && value == "together") return "monolithic";
  if (key == "load_free" && value == "in_turns") return "staggered";
  return value;
}

[[noreturn]] void reject_unknown(const std::string& key) {
  std::set<std::string> known = parameter_names;
  for (const Entry& e : entries()) known.insert(e.key.name);
  const std::string near = nearest_name(key, known);
  throw InputError({{},
                    "unknown key \"" + key + "\"",
                    near.empty() ? "" : '"' + near + '"',
                    "see `pliant fit --help` for all keys"});
}

void set_parameter(FitOptions& options, const std::string& name, const std::string& part, const std::string& value) {
  FitOptions::Override& change = options.parameters[name];
  const auto fail = [&](const char* expected) {
    throw InputError({{}, name + (part.empty() ? "" : "." + part) + " is \"" + value + "\"", expected, ""});
  };
  if (part == "estimate") {
    if (value != "true" && value != "false") fail("true or false");
    change.estimated = value == "true";
  } else if (part == "prior_std") {
    const auto std = number(value);
    if (!std || !(*std > 0.0)) fail("a positive number");
    change.prior_std = *std;
  } else if (part.empty() || part == "start") {
    std::vector<double> numbers;
    std::string list = value;
    for (char& c : list)
      if (c == ',' || c == '[' || c == ']') c = ' ';
    std::istringstream words(list);
    for (std::string word; words >> word;) {
      const auto n = number(word);
      if (!n) fail("a number, or three");
      numbers.push_back(*n);
    }
    if (numbers.size() != 1 && numbers.size() != 3) fail("a number, or three");
    change.start = Eigen::Map<VectorX>(numbers.data(), Eigen::Index(numbers.size()));
  } else {
    reject_unknown(name + "." + part);
  }
}

}  // namespace

const std::vector<FitKey>& fit_keys() {
  static const std::vector<FitKey> keys = [] {
    std::vector<FitKey> list;
    for (const Entry& e : entries()) list.push_back(e.key);
    return list;
  }();
  return keys;
}

std::string parameter_key_help() {
  return "Parameters (youngs_modulus, poissons_ratio, mass_damping, stiffness_damping, density, gravity, "
         "linear_velocity,\n"
         "angular_velocity, plane, plane_2 .., friction, contact_stiffness, youngs_modulus@REGION, exponent_1 .. of "
         "Ogden's law, and for what "
         "sensors get wrong "
         "range_error@SENSOR, outline_error@SENSOR,\n"
         "sensor_turn@SENSOR, sensor_shift@SENSOR, range_scale@SENSOR, focal_error@SENSOR; [2] after a name means the "
         "second recording's) have three keys "
         "each:\n"
         "  NAME=VALUE           start value, SI units; three numbers with commas for vectors\n"
         "  NAME.estimate=BOOL   estimate it, or keep the start value\n"
         "  NAME.prior_std=X     width of the prior: of the logarithm for moduli and density, for dampings of "
         "asinh(value over what is usual);\n"
         "                       it lies about VALUE where both are given";
}

void set_fit_option(FitOptions& options, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0)
    throw InputError({{}, "\"" + assignment + "\"", "key=value", "for example --set cells=16"});
  const std::string key = assignment.substr(0, equals), value = assignment.substr(equals + 1);
  if (key == "seed") {  // older programs wrote it into fit.toml
    if (value == "0") return;
    throw InputError({{}, "seed is \"" + value + "\"", "no seed: a fit is deterministic", "leave it out"});
  }
  if (const std::string present = present_value(key, value); present != value) {
    note_former_word(value, present, key);
    return set_fit_option(options, key + "=" + present);
  }
  if (const Entry* entry = find_entry(key)) {
    if (const auto expected = entry->read(options, value))
      throw InputError({{}, key + " is \"" + value + "\"", *expected, ""});
    return;
  }
  if (const std::string present = present_name(key); present != key) {
    note_former_word(key, present, "");
    return set_fit_option(options, present + "=" + value);
  }
  // The name of a region, control point or sensor stands after an @ and may hold dots itself.
  std::string name = key, part;
  for (const char* known : {".estimate", ".prior_std", ".start"})
    if (key.ends_with(known))
      name = key.substr(0, key.size() - std::string_view(known).size()), part = std::string(known).substr(1);
  if (name.find('@') == std::string::npos) {
    const auto dot = key.find('.');
    name = key.substr(0, dot);
    part = dot == std::string::npos ? "" : key.substr(dot + 1);
  }
  if (const std::string base = name.substr(0, name.find_first_of("@[")); !is_parameter_name(base)) reject_unknown(base);
  set_parameter(options, name, part, value);
}

void read_fit_options(const std::filesystem::path& path, FitOptions& options) {
  const toml::table table = parse_toml(read_file(path), path);
  std::vector<Problem> problems;
  const auto place = [&](const toml::node& node) {
    return Place{path, int(node.source().begin.line), int(node.source().begin.column)};
  };
  const auto assign = [&](const std::string& key, const toml::node& node) {
    std::ostringstream text;
    if (const auto* array = node.as_array()) {
      for (const auto& item : *array) text << (&item == &array->front() ? "" : ",") << toml::node_view(item);
    } else if (const auto* string = node.as_string()) {
      text << string->get();
    } else if (const auto* real = node.as_floating_point()) {
      text << text_of(real->get());
    } else {
      text << toml::node_view(node);
    }
    try {
      set_fit_option(options, key + "=" + text.str());
    } catch (const InputError& error) {
      Problem problem = error.problems().front();
      problem.place = place(node);
      problems.push_back(std::move(problem));
    }
  };
  for (const auto& [key, node] : table) {
    const std::string name(key.str());
    if (name == "parameters" && node.is_table()) {
      for (const auto& [parameter, settings] : *node.as_table()) {
        if (!settings.is_table()) {
          assign(std::string(parameter.str()), settings);
          continue;
        }
        for (const auto& [part, value] : *settings.as_table())
          assign(std::string(parameter.str()) + "." + std::string(part.str()), value);
      }
    } else {
      assign(name, node);
    }
  }
  if (!problems.empty()) throw InputError(std::move(problems));
}

namespace {

/// What is chosen of a parameter, by the last part of its key.
std::vector<std::pair<std::string, std::string>> written(const FitOptions::Override& change) {
  std::vector<std::pair<std::string, std::string>> parts;
  if (change.start) {
    const VectorX& start = *change.start;
    std::string text = text_of(start[0]);
    if (start.size() == 3) text = "[" + text + ", " + text_of(start[1]) + ", " + text_of(start[2]) + "]";
    parts.emplace_back("start", text);
  }
  if (change.estimated) parts.emplace_back("estimate", *change.estimated ? "true" : "false");
  if (change.prior_std) parts.emplace_back("prior_std", text_of(*change.prior_std));
  return parts;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> written_choices(const FitOptions& options, bool standard_too) {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Entry& e : entries())
    if (standard_too || e.write(options) != e.write({})) all.emplace_back(e.key.name, e.write(options));
  for (const auto& [name, change] : options.parameters)
    for (const auto& [part, text] : written(change)) all.emplace_back(name + (part == "start" ? "" : "." + part), text);
  return all;
}

std::vector<std::string> unused_choices(const FitOptions& options, bool has_motion, bool has_presses) {
  static const std::set<std::string> of_pressed_laws = {"law_zones", "basis_tolerance", "basis_samples"};
  static const std::set<std::string> of_tracking = {"tracking", "tracking_rounds"};
  static const std::set<std::string> of_presses = {
      "cells",        "element",   "control_points", "modulus_variation", "material",     "max_iterations",
      "marker_noise", "law_terms", "law_zones",      "basis_tolerance",   "basis_samples"};
  std::vector<std::string> notes;
  FitOptions keys = options;
  keys.parameters.clear();
  for (const auto& [name, text] : written_choices(keys, false)) {
    const char* why = nullptr;
    if (has_motion && of_pressed_laws.contains(name))
      why = has_presses ? "it concerns objects that are pressed alone" : "it concerns presses with known force";
    else if (has_motion && name == "law_terms" && options.material != MaterialKind::Ogden)
      why = "it concerns Ogden's law, material=ogden";
    else if (has_motion && options.law_of_motion() && of_tracking.contains(name) &&
             options.tracking != TrackingUse::Off)
      why = "the tracker's own elasticity is linear, and the material is not";
    else if (has_motion && !has_presses && name == "marker_noise")
      why = "it concerns presses with known force";
    else if (!has_motion && !of_presses.contains(name))
      why = "it concerns objects that move or hang";
    if (why) notes.push_back("The choice " + name + " = " + text + " was not used: " + why + ".");
  }
  return notes;
}

std::string to_toml(const FitOptions& options) {
  std::ostringstream out;
  out << "# Choices of a fit; `pliant fit CAPTURE --config THIS` repeats them.\n";
  for (const Entry& e : entries()) {
    out << e.key.name << " = " << e.write(options) << "  # " << e.key.sentence;
    if (!e.key.range.empty()) out << " (" << e.key.range << (e.key.unit.empty() ? "" : " " + e.key.unit) << ")";
    out << "\n";
  }
  for (const auto& [name, change] : options.parameters) {
    out << "\n[parameters.\"" << name << "\"]\n";
    for (const auto& [part, text] : written(change)) out << part << " = " << text << "\n";
  }
  return out.str();
}

namespace {

/// What is given may be beyond what an estimate keeps to, but for its sign.
void refuse_out_of_bounds(const Parameter& parameter, double start) {
  const double lower = parameter.estimated ? parameter.lower : parameter.lower < 0.0 ? -infinite : 0.0;
  const double upper = parameter.estimated ? parameter.upper : infinite;
  if (start >= lower && start <= upper) return;
  throw InputError({{},
                    fmt::format("{} is {:.6g}", parameter.name, start),
                    start < lower ? fmt::format("{:.6g} or more", lower) : fmt::format("{:.6g} or less", upper),
                    ""});
}

void change_parameter(Parameter& parameter, const FitOptions::Override& change, const ParameterLayout& layout,
                      VectorX& theta) {
  if (change.start) {
    const int numbers = parameter.is_scalar() ? 1 : 3;
    if (change.start->size() != numbers || parameter.transform == Transform::PlanePosition)
      throw InputError({{},
                        "the start of " + parameter.name + " has " + std::to_string(change.start->size()) + " numbers",
                        parameter.transform == Transform::PlanePosition ? "planes to start where the capture has them"
                                                                        : std::to_string(numbers) + " numbers",
                        ""});
    if ((parameter.transform == Transform::Logarithm || parameter.transform == Transform::InverseSinh) &&
        !((*change.start)[0] > 0.0))
      throw InputError({{}, "the start of " + parameter.name + " is not positive", "a number above 0", ""});
    theta.segment(parameter.at.first, numbers) = *change.start;
    if (parameter.transform == Transform::Direction) parameter.origin = *change.start;
  }
  if (change.estimated) parameter.estimated = *change.estimated;
  if (change.start && parameter.is_scalar()) refuse_out_of_bounds(parameter, (*change.start)[0]);
  if (!change.prior_std) return;
  parameter.prior_std = *change.prior_std;
  if (!change.start) return;
  Parameter alone = parameter;
  alone.estimated = true;
  parameter.prior_mean = ParameterSet(layout, {std::move(alone)}, theta).to_unconstrained(theta);
}

}  // namespace

std::string FitOptions::validate() const {
  const auto outside = [](double v, double low, double high) { return !(v >= low && v <= high); };
  if (outside(cells, 4, 64)) return "cells must lie in 4..64";
  if (outside(coarse_cells, 4, 64)) return "coarse_cells must lie in 4..64";
  if (!(steps > 0.0 && steps <= 16.0)) return "steps must lie in (0, 16]";
  if (outside(span, 0.0, 1.0)) return "span must lie in 0..1";
  if (points_per_frame != 0 && points_per_frame < 10) return "points_per_frame must be 0 (all) or at least 10";
  if (scan_per_decade < 1) return "scan_per_decade must be at least 1";
  if (scan_points < 0 || scan_points > 50) return "scan_points must lie in 0..50";
  if (!(scan_std > 0.0 && scan_std <= 0.2)) return "scan_std must lie in (0, 0.2]";
  if (scan_points > 0 && load_free == LoadFreeScheme::Staggered)
    return "load_free=staggered keeps the shape while it minimises over parameters: it cannot correct the scan "
           "(scan_points)";
  if (tracking_rounds < 1 || tracking_rounds > 10) return "tracking_rounds must lie in 1..10";
  if (pull_points < 1 || pull_points > 50) return "pull_points must lie in 1..50";
  if (control_points != automatic && control_points != unsaid && (control_points < 1 || control_points > 500))
    return "control_points must lie in 1..500, or be auto";
  if (!(modulus_variation > 0.0 && modulus_variation <= 10.0)) return "modulus_variation must lie in (0, 10]";
  if (const auto modulus = parameters.find("youngs_modulus");
      control_points == automatic && modulus != parameters.end() && modulus->second.estimated == false)
    return "control_points = auto asks how Young's modulus varies, youngs_modulus.estimate = false keeps it as it is";
  if (refine < 1 || refine > 3) return "refine must lie in 1..3";
  if (const double finest = cells * std::pow(Refinement::mesh_ratio, refine - 1); finest > 64.0)
    return "refine takes " + text_of(cells) + " cells to " + text_of(finest) + ", more than 64: begin with fewer";
  if (!(budget >= 0.0 && std::isfinite(budget))) return "budget must be a time in minutes, not negative";
  if (starts < 1) return "starts must be at least 1";
  if (most_starts < 1) return "most_starts must be at least 1";
  if (max_iterations < 1) return "max_iterations must be at least 1";
  if (!(wide_band > 0.0 && wide_band < 0.5) || !(fine_band > 0.0 && fine_band < 0.5))
    return "bands must lie in (0, 0.5)";
  if (!(newmark_theta >= 0.5 && newmark_theta < 1.0)) return "newmark_theta must lie in [0.5, 1)";
  if (!(solver_tolerance > 0.0 && solver_tolerance < 1.0)) return "solver_tolerance must lie in (0, 1)";
  if (law_terms < 0 || law_terms > 3) return "law_terms must lie in 1..3, or be 0: as many as the presses support";
  if (law_zones < 0 || law_zones > 12) return "law_zones must lie in 1..12, or be 0: as many as the presses support";
  if (law_zones > 1 && control_points > 1) return "law_zones and control_points cannot both be chosen";
  if (!(marker_noise >= 0.0)) return "marker_noise must not be negative";
  if (!(basis_tolerance > 0.0) || basis_samples < 1) return "basis_tolerance must be positive, basis_samples >= 1";
  return "";
}

std::optional<LawForm> HypothesisOptions::law_of_motion() const {
  if (material == MaterialKind::Ogden) return LawForm{1, std::max(1, law_terms)};
  return std::nullopt;
}

void apply_overrides(ParameterSet& parameters, const FitOptions& options) {
  VectorX theta = parameters.reference();
  std::vector<Parameter> list = parameters.parameters();
  for (const auto& [name, change] : options.parameters) {
    std::vector<Parameter*> meant;
    for (Parameter& p : list)
      if (p.name == name) meant.push_back(&p);
    // A name alone means those of all sensors, pulls and recordings, but for the modulus of the object's own material.
    for (Parameter& p : list)
      if (meant.empty() || name != "youngs_modulus")
        if (p.name.size() > name.size() && p.name.starts_with(name) &&
            (p.name[name.size()] == '@' || p.name[name.size()] == '['))
          meant.push_back(&p);
    if (meant.empty())
      throw InputError({{}, "there is no parameter \"" + name + "\" in this recording", "", "see `pliant fit --help`"});
    for (Parameter* p : meant) change_parameter(*p, change, parameters.layout(), theta);
  }
  parameters = ParameterSet(parameters.layout(), std::move(list), std::move(theta));
}

}  // namespace pliant
