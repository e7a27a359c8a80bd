#include "model/result.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "base/files.hpp"
#include "base/old_names.hpp"

namespace pliant {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

// ---- writing

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json number(const std::optional<double>& value) { return value ? number(*value) : Json(nullptr); }
Json vector(const Vector3& v) { return Json::array({number(v.x()), number(v.y()), number(v.z())}); }

Json value_json(const ParameterValue& value) {
  if (const auto* scalar = std::get_if<double>(&value)) return number(*scalar);
  if (const auto* v = std::get_if<Vector3>(&value)) return vector(*v);
  const auto& plane = std::get<PlaneValue>(value);
  return {{"point", vector(plane.point)}, {"normal", vector(plane.normal)}};
}

Json parameter_json(const ParameterResult& parameter) {
  Json json;
  json["value"] = value_json(parameter.value);
  if (!parameter.unit.empty()) json["unit"] = parameter.unit;
  if (parameter.std) json["std"] = value_json(*parameter.std);
  if (parameter.interval_90) json["interval_90"] = {parameter.interval_90->first, parameter.interval_90->second};
  if (parameter.std_noise) json["std_noise"] = value_json(*parameter.std_noise);
  if (parameter.std_model) json["std_model"] = value_json(*parameter.std_model);
  if (parameter.mesh_error) json["mesh_error"] = value_json(*parameter.mesh_error);
  if (parameter.step_error) json["step_error"] = value_json(*parameter.step_error);
  if (parameter.extrapolated) json["extrapolated"] = value_json(*parameter.extrapolated);
  if (parameter.start) json["start"] = value_json(*parameter.start);
  if (const auto& prior = parameter.prior) {
    json["prior"] = {{"median", value_json(prior->median)}};
    if (prior->interval_90)
      json["prior"]["interval_90"] = {number(prior->interval_90->first), number(prior->interval_90->second)};
    if (prior->std) json["prior"]["std"] = vector(*prior->std);
  }
  json["estimated"] = parameter.estimated;
  return json;
}

Json field_json(const FieldResult& field) {
  Json points = Json::array();
  for (const ControlPoint& p : field.control_points)
    points.push_back(
        {number(p.position.x()), number(p.position.y()), number(p.position.z()), number(p.value), number(p.std)});
  Json json{{"control_points", points}};
  if (!field.per_element.empty()) json["per_element"] = field.per_element;
  for (const TriedFieldResult& t : field.tried)
    json["tried"].push_back({{"control_points", t.control_points},
                             {"estimated", t.estimated},
                             {"cost", number(t.cost)},
                             {"log_bayes_factor", number(t.log_bayes_factor)}});
  return json;
}

Json error_json(const ErrorResult& error) {
  Json json = {{"surface_rms", number(error.surface_rms)},
               {"surface_median", number(error.surface_median)},
               {"surface_max", number(error.surface_max)},
               {"marker_rms", number(error.marker_rms)},
               {"unit", "m"},
               {"points", error.points}};
  if (error.outline_rms) json["outline_rms"] = *error.outline_rms;
  for (const ErrorResult::Frame& f : error.frames)
    json["frames"].push_back({{"frame", f.frame}, {"rms", f.rms}, {"noise", f.noise}, {"points", f.points}});
  return json;
}

Json deformation_json(const DeformationResult& deformation) {
  return {{"greatest_strain", number(deformation.greatest_strain)},
          {"median_strain", number(deformation.median_strain)},
          {"greatest_rate", number(deformation.greatest_rate)}};
}

Json choices_json(const std::map<std::string, std::string>& choices) {
  Json json = Json::object();
  for (const auto& [name, text] : choices) json[name] = Json::parse(text);
  return json;
}

Json values_json(const std::map<std::string, double>& values) {
  Json json = Json::object();
  for (const auto& [name, value] : values) json[name] = number(value);
  return json;
}

Json start_json(const StartResult& start) {
  return {{"start", values_json(start.start)}, {"final", values_json(start.final)}, {"cost", number(start.cost)},
          {"iterations", start.iterations},    {"converged", start.converged},      {"reason", start.reason}};
}

Json resolution_json(const ResolutionResult& resolution) {
  return {{"cells", number(resolution.cells)}, {"steps", number(resolution.steps)},
          {"elements", resolution.elements},   {"values", values_json(resolution.values)},
          {"cost", number(resolution.cost)},   {"converged", resolution.converged},
          {"reason", resolution.reason}};
}

template <class Items, class Write>
Json list(const Items& items, const Write& write) {
  Json json = Json::array();
  for (const auto& item : items) json.push_back(write(item));
  return json;
}

Json activity_json(const ActivityTime& activity) {
  return {{"name", activity.name}, {"count", activity.count}, {"seconds", number(activity.seconds)}};
}

Json stage_json(const StageTime& stage) {
  return {{"name", stage.name},         {"start", stage.start},       {"iterations", stage.iterations},
          {"elements", stage.elements}, {"work", number(stage.work)}, {"seconds", number(stage.seconds)}};
}

Json time_json(const TimeResult& time) {
  Json json = {{"wall_seconds", number(time.wall_seconds)},
               {"forward_steps", time.forward_steps},
               {"ms_per_forward_step", number(time.ms_per_forward_step)},
               {"ms_per_adjoint_step", number(time.ms_per_adjoint_step)}};
  if (!time.activities.empty()) json["activities"] = list(time.activities, activity_json);
  if (!time.stages.empty()) json["stages"] = list(time.stages, stage_json);
  return json;
}

Json recording_json(const RecordingResult& recording) {
  return {{"name", recording.name}, {"sha256", recording.sha256}, {"error", error_json(recording.error)}};
}

Json static_json(const StaticError& error) {
  return {{"name", error.name},
          {"role", error.role},
          {"marker_rms", number(error.marker_rms)},
          {"marker_max", number(error.marker_max)},
          {"max_displacement", number(error.max_displacement)},
          {"relative_error", number(error.relative_error)}};
}

Json load_json(const LoadError& error) {
  Json json = static_json(error);
  json["observed"] = error.observed.empty() ? Json(nullptr) : Json(error.observed);
  json["points"] = error.points;
  json["outliers"] = error.outliers;
  json["mean"] = number(error.mean);
  json["max"] = number(error.max);
  json["relative_mean"] = number(error.relative_mean);
  json["relative_max"] = number(error.relative_max);
  if (!error.failure.empty()) json["failure"] = error.failure;
  return json;
}

Json numbers_json(const std::vector<double>& values) {
  return list(values, [](double value) { return number(value); });
}

Json curve_json(const CurvePrediction& curve) {
  Json json = {{"name", curve.name},
               {"kind", curve.kind},
               {"role", curve.role},
               {"abscissa", curve.abscissa},
               {"unit", curve.unit},
               {"at", numbers_json(curve.at)},
               {"measured", numbers_json(curve.measured)},
               {"std", numbers_json(curve.std)},
               {"predicted", numbers_json(curve.predicted)},
               {"rms", number(curve.rms())},
               {"relative_rms", number(curve.relative_rms())}};
  if (curve.depth_offset) json["depth_offset"] = number(*curve.depth_offset);
  if (!curve.failure.empty()) json["failure"] = curve.failure;
  return json;
}

Json tracking_json(const TrackingResult& tracking) {
  const auto held_out = [](const std::optional<HeldOutFramesResult>& h) {
    return h ? Json{{"frames", h->frames}, {"cost", number(h->cost)}, {"surface_rms", number(h->surface_rms)}} : Json();
  };
  Json json = {{"kept", tracking.kept}, {"why", tracking.why}};
  json["rounds"] = list(tracking.rounds, [](const TrackingRoundResult& r) {
    return Json{{"tracked_with", number(r.tracked_with)}, {"youngs_modulus", number(r.youngs_modulus)},
                {"surface_rms", number(r.surface_rms)},   {"fit_rms", number(r.fit_rms)},
                {"confidence", number(r.confidence)},     {"lost", r.lost}};
  });
  if (tracking.loop || tracking.direct)
    json["held_out_frames"] = {{"tracked motion", held_out(tracking.loop)}, {"points", held_out(tracking.direct)}};
  return json;
}

std::string text(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

// ---- reading

// A member of the document with its path from the top, for messages.
class Member {
 public:
  Member(const Json& json, std::string path, const fs::path& file) : json_(json), path_(std::move(path)), file_(file) {}

  [[noreturn]] void fail(const std::string& expected) const {
    throw InputError({{file_}, "\"" + path_ + "\" is " + json_.dump().substr(0, 60), expected, ""});
  }
  std::string name_of(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  bool has(const char* key) const { return json_.is_object() && json_.contains(key) && !json_[key].is_null(); }

  Member operator[](const std::string& key) const {
    if (!json_.is_object()) fail("an object");
    if (!json_.contains(key)) throw InputError({{file_}, "\"" + name_of(key) + "\" is missing", "", ""});
    return {json_[key], name_of(key), file_};
  }
  template <class Each>
  void each_key(const Each& each) const {
    if (!json_.is_object()) fail("an object");
    for (const auto& [key, value] : json_.items()) each(key, Member(value, name_of(key), file_));
  }
  template <class Each>
  void each_item(const Each& each) const {
    if (!json_.is_array()) fail("a list");
    for (size_t i = 0; i < json_.size(); ++i) each(Member(json_[i], path_ + "[" + std::to_string(i) + "]", file_));
  }

  double number() const { return json_.is_number() ? json_.get<double>() : (fail("a number"), 0.0); }
  bool boolean() const { return json_.is_boolean() ? json_.get<bool>() : (fail("true or false"), false); }
  std::string string() const { return json_.is_string() ? json_.get<std::string>() : (fail("a text"), ""); }
  Vector3 vector() const {
    if (!json_.is_array() || json_.size() != 3) fail("three numbers");
    Vector3 v;
    for (int k = 0; k < 3; ++k) v[k] = json_[k].is_number() ? json_[k].get<double>() : (fail("three numbers"), 0.0);
    return v;
  }
  ParameterValue value() const {
    if (json_.is_number()) return number();
    if (json_.is_array()) return vector();
    if (json_.is_object()) return PlaneValue{(*this)["point"].vector(), (*this)["normal"].vector()};
    fail("a number, three numbers or a plane");
  }
  const Json& json() const { return json_; }

 private:
  const Json& json_;
  std::string path_;
  const fs::path& file_;
};

std::string optional_string(const Member& parent, const char* key) {
  return parent.has(key) ? parent[key].string() : "";
}

std::optional<double> optional_number(const Member& parent, const char* key) {
  return parent.has(key) ? std::optional(parent[key].number()) : std::nullopt;
}

// A standard deviation may hold null where it could not be computed; then it is left out.
std::optional<ParameterValue> optional_value(const Member& parent, const char* key) {
  if (!parent.has(key) || parent[key].json().dump().find("null") != std::string::npos) return std::nullopt;
  return parent[key].value();
}

std::optional<std::pair<double, double>> read_interval(const Member& member) {
  if (!member.has("interval_90")) return std::nullopt;
  std::vector<double> ends;
  member["interval_90"].each_item([&](const Member& item) { ends.push_back(item.number()); });
  if (ends.size() != 2) member["interval_90"].fail("two numbers");
  return std::pair(ends[0], ends[1]);
}

std::optional<PriorResult> read_prior(const Member& parameter) {
  if (!parameter.has("prior")) return std::nullopt;
  const Member prior = parameter["prior"];
  const auto interval = read_interval(prior);
  const auto std = optional_value(prior, "std");
  if (!interval && !std) prior.fail("a `median` and an `interval_90`, or a `std`");
  return PriorResult{prior["median"].value(), interval, std ? std::optional(prior["std"].vector()) : std::nullopt};
}

ParameterResult read_parameter(const std::string& name, const Member& member) {
  ParameterResult parameter;
  parameter.name = name;
  parameter.value = member["value"].value();
  parameter.unit = optional_string(member, "unit");
  parameter.std = optional_value(member, "std");
  parameter.estimated = member["estimated"].boolean();
  parameter.interval_90 = read_interval(member);
  parameter.prior = read_prior(member);
  return parameter;
}

CorrelationResult read_correlation(const Member& member) {
  std::vector<std::string> names;
  member["parameters"].each_item([&](const Member& item) { names.push_back(item.string()); });
  if (names.size() != 2) member["parameters"].fail("two names");
  return {{names[0], names[1]}, member["correlation"].number()};
}

Json parse(const fs::path& path) {
  constexpr int deepest = 64;
  const std::string content = read_file(path);
  const auto require_shallow = [&](int depth, Json::parse_event_t, const Json&) {
    if (depth > deepest)
      throw InputError({{path}, "values nested more than " + std::to_string(deepest) + " deep", "a result.json", ""});
    return true;
  };
  try {
    return Json::parse(content, require_shallow);
  } catch (const Json::out_of_range& error) {
    throw InputError({{path}, std::string("a number that is too great (") + error.what() + ")", "a result.json", ""});
  } catch (const Json::parse_error& error) {
    Place place{path, 1, 1};
    for (size_t i = 0; i + 1 < std::min(error.byte, content.size() + 1); ++i)
      content[i] == '\n' ? (++place.line, place.column = 1) : ++place.column;
    throw InputError({place, "not JSON, or cut off", "a result.json", ""});
  }
}

Result read_needed(const Member& top) {
  if (const std::string format = top["format"].string(); format != "result/1") top["format"].fail("\"result/1\"");
  Result result;
  top["parameters"].each_key([&](const std::string& name, const Member& m) {
    const std::string present = present_name(name);  // a former name may stand alone, or beside the present one
    if (!result.find(present)) result.parameters.push_back(read_parameter(present, m));
  });
  result.error.surface_rms = optional_number(top["error"], "surface_rms");
  if (top.has("identifiability"))
    top["identifiability"].each_item([&](const Member& m) { result.identifiability.push_back(read_correlation(m)); });
  result.verdict = optional_string(top, "verdict");
  if (top.has("deformation")) {
    const Member strains = top["deformation"];
    const auto greatest = optional_number(strains, "greatest_strain"), half = optional_number(strains, "median_strain");
    if (greatest && half)
      result.deformation = DeformationResult{*greatest, *half, optional_number(strains, "greatest_rate")};
  }
  return result;
}

std::string csv_number(double value) {
  std::ostringstream out;
  out.precision(9);
  out << value;
  return out.str();
}

}  // namespace

double CurvePrediction::rms() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < at.size(); ++i) sum += (predicted[i] - measured[i]) * (predicted[i] - measured[i]);
  return at.empty() ? NAN : std::sqrt(sum / double(at.size()));
}

double CurvePrediction::relative_rms() const {
  double greatest = 0.0;
  for (const double value : measured) greatest = std::max(greatest, std::abs(value));
  return greatest > 0.0 ? rms() / greatest : NAN;
}

const ParameterResult* Result::find(const std::string& name) const {
  for (const ParameterResult& parameter : parameters)
    if (parameter.name == name) return &parameter;
  return nullptr;
}

std::string to_json(const Result& result) {
  Json json{{"format", "result/1"}};
  json["software"] = {
      {"name", result.software.name}, {"version", result.software.version}, {"commit", result.software.commit}};
  json["capture"] = {{"name", result.capture.name}, {"sha256", result.capture.sha256}};
  if (!result.material.empty()) json["material"] = result.material;
  if (!result.verdict.empty()) {
    json["verdict"] = result.verdict;
    json["reasons"] = result.reasons;
  }
  if (!result.judgement.empty()) json["judgement"] = result.judgement;
  if (!result.options_used.empty())
    json["options"] = {{"given", choices_json(result.options_given)}, {"used", choices_json(result.options_used)}};
  json["parameters"] = Json::object();
  for (const ParameterResult& parameter : result.parameters)
    for (const std::string& name : {parameter.name, former_name(parameter.name)})
      if (!name.empty()) json["parameters"][name] = parameter_json(parameter);  // result/1 promises former names
  json["fields"] = Json::object();
  for (const FieldResult& field : result.fields) json["fields"][field.name] = field_json(field);
  json["error"] = error_json(result.error);
  if (!result.recordings.empty()) json["recordings"] = list(result.recordings, recording_json);
  if (result.held_out) json["held_out"] = recording_json(*result.held_out);
  if (result.deformation) json["deformation"] = deformation_json(*result.deformation);
  json["cost"] = {{"start", number(result.cost.start)}, {"final", number(result.cost.final)}};
  json["identifiability"] = list(result.identifiability, [](const CorrelationResult& c) {
    return Json{{"parameters", {c.parameters.first, c.parameters.second}}, {"correlation", number(c.correlation)}};
  });
  json["starts"] = list(result.starts, start_json);
  if (!result.resolutions.empty()) json["resolutions"] = list(result.resolutions, resolution_json);
  if (result.tracking) json["tracking"] = tracking_json(*result.tracking);
  if (!result.curves.empty()) json["curves"] = list(result.curves, curve_json);
  json["time"] = time_json(result.time);
  if (!result.uncertainty.empty())
    json["uncertainty"] = list(result.uncertainty, [](const UncertaintyResult& u) {
      return Json{{"cause", u.cause}, {"std", values_json(u.std)}};
    });
  if (!result.notes.empty()) json["notes"] = result.notes;
  return text(json);
}

void write_result(const fs::path& path, const Result& result) { write_file(path, to_json(result)); }

Result read_result(const fs::path& path) {
  const Json json = parse(path);
  return read_needed(Member(json, "", path));
}

void write_convergence(const fs::path& path, const ConvergenceHistory& history) {
  if (history.units.size() != history.parameters.size())
    throw std::invalid_argument("write_convergence: as many units as parameters are needed");
  std::string csv = "start,stage,iteration,cost,damping";
  for (size_t i = 0; i < history.parameters.size(); ++i)
    csv += "," + csv_cell(history.parameters[i] + " [" + history.units[i] + "]");
  csv += "\n";
  for (const ConvergenceRow& row : history.rows) {
    if (row.parameters.size() != history.parameters.size())
      throw std::invalid_argument("write_convergence: a row of " + std::to_string(row.parameters.size()) +
                                  " parameters under a header of " + std::to_string(history.parameters.size()));
    csv += std::to_string(row.start) + "," + csv_cell(row.stage) + "," + std::to_string(row.iteration) + "," +
           csv_number(row.cost) + "," + csv_number(row.damping);
    for (const double value : row.parameters) csv += "," + csv_number(value);
    csv += "\n";
  }
  write_file(path, csv);
}

std::string to_json(const Evaluation& evaluation) {
  return text({{"format", "evaluation/1"},
               {"error", error_json(evaluation.error)},
               {"presses", list(evaluation.presses, static_json)},
               {"curves", list(evaluation.curves, curve_json)},
               {"loads", list(evaluation.loads, load_json)}});
}

void write_evaluation(const fs::path& path, const Evaluation& evaluation) { write_file(path, to_json(evaluation)); }

}  // namespace pliant
