#include "estimation/fit_state.hpp"

#include <concepts>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/files.hpp"

namespace pliant {

namespace {

using Json = nlohmann::json;
constexpr const char* format = "fit-state/22";

/// A type that is const or not: each list of members below is written and read by the same lines.
template <class T, class Of>
concept Is = std::same_as<std::remove_const_t<T>, Of>;

// Members that are kept: calls each(name, member) ---------------------------------------------------------------------

template <class Each>
void members(Is<StageId> auto& id, const Each& each) {
  each("kind", id.kind), each("start", id.start), each("number", id.number);
}
template <class Each>
void members(Is<ModelShift> auto& s, const Each& each) {
  each("cause", s.cause), each("shift", s.shift);
}
template <class Each>
void members(Is<MarkerNoise> auto& noise, const Each& each) {
  each("at_rest", noise.at_rest), each("growth", noise.growth);
}
template <class Each>
void members(Is<ZoneCut> auto& cut, const Each& each) {
  each("zone", cut.zone), each("by", cut.by), each("at", cut.at);
}
template <class Each>
void members(Is<LawFinding> auto& law, const Each& each) {
  each("noise", law.noise), each("deviation", law.deviation), each("track_squares", law.track_squares);
  each("stated_cost", law.stated_cost), each("observations", law.observations), each("dimension", law.dimension);
  each("evidence", law.evidence), each("cut", law.cut), each("points", law.points);
}
/// All but what it was evaluated to.
template <class Each>
void members(Is<StageRecord> auto& r, const Each& each) {
  each("stage", r.id), each("name", r.name), each("from", r.from), each("theta", r.theta);
  each("start_cost", r.start_cost), each("cost", r.cost), each("misfit", r.misfit);
  each("is_explained", r.is_explained), each("iterations", r.iterations), each("succeeded", r.succeeded);
  each("converged", r.converged), each("reason", r.reason), each("elements", r.elements), each("work", r.work);
  each("joined", r.joined), each("trials", r.trials), each("corrected", r.corrected), each("told", r.told);
  each("shifts", r.shifts), each("law", r.law), each("scan_errors", r.scan_errors);
}
template <class Each>
void members(Is<OptimiserState> auto& o, const Each& each) {
  each("iterations", o.iterations), each("p", o.p), each("memory", o.memory);
}
template <class Each>
void members(Is<StageUnderWay> auto& stage, const Each& each) {
  each("stage", stage.id), each("from", stage.from), each("optimiser", stage.optimiser);
}
template <class Each>
void members(Is<PassState::Beginning> auto& begin, const Each& each) {
  each("theta", begin.theta), each("stage", begin.stage), each("scan_errors", begin.scan_errors);
}
template <class Each>
void members(Is<PassState> auto& pass, const Each& each) {
  each("controls", pass.controls), each("done", pass.done), each("under_way", pass.under_way);
  each("begin", pass.begin);
}
template <class Each>
void members(Is<TriedField> auto& t, const Each& each) {
  each("control_points", t.control_points), each("estimated", t.estimated), each("cost", t.cost);
  each("log_bayes_factor", t.log_bayes_factor), each("is_refused", t.is_refused);
}
template <class Each>
void members(Is<FitState::FieldChoice> auto& field, const Each& each) {
  each("tried", field.tried), each("best", field.best), each("state", field.state), each("even", field.even);
  each("under_way", field.under_way);
}
template <class Each>
void members(Is<TrackingRound> auto& r, const Each& each) {
  each("youngs_modulus", r.youngs_modulus), each("surface_rms", r.surface_rms), each("confidence", r.confidence);
  each("fit_rms", r.fit_rms), each("change", r.change), each("lost", r.lost), each("theta", r.theta);
  each("controls", r.controls), each("fields", r.fields);
}
template <class Each>
void members(Is<FitState::Tracking> auto& tracking, const Each& each) {
  each("phase", tracking.phase), each("rounds", tracking.rounds), each("loop", tracking.loop);
  each("direct", tracking.direct), each("keeps_loop", tracking.keeps_loop);
}
template <class Each>
void members(Is<MaterialSample> auto& sample, const Each& each) {
  each("strains", sample.strains), each("stresses", sample.stresses);
}
template <class Each>
void members(Is<PressSample> auto& s, const Each& each) {
  each("succeeded", s.succeeded), each("converged", s.converged), each("failure", s.failure);
  each("sample", s.sample), each("weight", s.weight), each("start_rms", s.start_rms), each("rms", s.rms);
  each("iterations", s.iterations);
}
template <class Each>
void members(Is<PressSampling::State> auto& sampled, const Each& each) {
  each("kept", sampled.kept), each("under", sampled.under);
}
template <class Each>
void members(Is<FitState::SpanSearch> auto& span, const Each& each) {
  each("has_whole", span.has_whole), each("is_ended", span.is_ended), each("part", span.part);
  each("next_part", span.next_part), each("has_parts", span.has_parts), each("state", span.state);
}
template <class Each>
void members(Is<FitState> auto& state, const Each& each) {
  each("pass", state.pass), each("field", state.field), each("tracking", state.tracking);
  each("sampled", state.sampled), each("span", state.span);
}

// Values --------------------------------------------------------------------------------------------------------------

Json json_of(double value) {
  if (std::isfinite(value)) return value;
  return value < 0.0 ? "-infinite" : "infinite";  // which JSON does not know
}
Json json_of(bool value) { return value; }
Json json_of(int value) { return value; }
Json json_of(const std::string& text) { return text; }
template <class T>
requires std::is_enum_v<T> Json json_of(const T& value) { return int(value); }
template <class Derived>
Json json_of(const Eigen::DenseBase<Derived>& m) {
  Json json = {{"rows", m.rows()}, {"values", Json::array()}};
  for (Eigen::Index c = 0; c < m.cols(); ++c)
    for (Eigen::Index r = 0; r < m.rows(); ++r) json["values"].push_back(json_of(double(m(r, c))));
  return json;
}
template <class T>
Json json_of(const std::pair<T, T>& pair) {
  return {json_of(pair.first), json_of(pair.second)};
}
template <class T>
Json json_of(const std::vector<T>& list);
template <class T>
Json json_of(const std::optional<T>& value);
template <class T>
requires requires(const T& all) {
  members(all, [](const char*, const auto&) {});
}
Json json_of(const T& all) {
  Json json = Json::object();
  members(all, [&](const char* name, const auto& member) { json[name] = json_of(member); });
  return json;
}
template <class T>
Json json_of(const std::vector<T>& list) {
  Json json = Json::array();
  for (const T& item : list) json.push_back(json_of(item));
  return json;
}
template <class T>
Json json_of(const std::optional<T>& value) {
  return value ? json_of(*value) : Json();
}

void read(const Json& json, double& value) {
  value = json == "infinite" ? infinite : json == "-infinite" ? -infinite : json.get<double>();
}
void read(const Json& json, bool& value) { value = json.get<bool>(); }
void read(const Json& json, int& value) { value = json.get<int>(); }
void read(const Json& json, std::string& text) { text = json.get<std::string>(); }
template <class T>
requires std::is_enum_v<T>
void read(const Json& json, T& value) {
  value = T(json.get<int>());
  if constexpr (std::same_as<T, StageKind>)
    if (value < StageKind::Pose || value > StageKind::Sample) throw std::runtime_error("a stage of an unknown kind");
}
template <class Derived>
void read(const Json& json, Eigen::PlainObjectBase<Derived>& m) {
  const Json& values = json.at("values");
  const auto rows = json.at("rows").get<Eigen::Index>(), size = Eigen::Index(values.size());
  constexpr auto fixed_rows = Eigen::Index(Derived::RowsAtCompileTime),
                 fixed_columns = Eigen::Index(Derived::ColsAtCompileTime);
  const Eigen::Index columns = fixed_columns > 0 ? fixed_columns : rows > 0 ? size / rows : 0;
  if (rows < 0 || rows * columns != size || (fixed_rows > 0 && rows != fixed_rows))
    throw std::runtime_error("a matrix of another size than it says");
  m.resize(rows, columns);
  for (Eigen::Index i = 0; i < m.size(); ++i) read(values.at(std::size_t(i)), m.data()[i]);
}
template <class T>
void read(const Json& json, std::pair<T, T>& pair) {
  read(json.at(0), pair.first), read(json.at(1), pair.second);
}
template <class T>
void read(const Json& json, std::vector<T>& list);
template <class T>
void read(const Json& json, std::optional<T>& value);
template <class T>
requires requires(T& all) {
  members(all, [](const char*, auto&) {});
}
void read(const Json& json, T& all) {
  members(all, [&](const char* name, auto& member) { read(json.at(name), member); });
}
template <class T>
void read(const Json& json, std::vector<T>& list) {
  for (const Json& item : json) read(item, list.emplace_back());
}
template <class T>
void read(const Json& json, std::optional<T>& value) {
  value.reset();
  if (!json.is_null()) read(json, value.emplace(T{}));
}

}  // namespace

void write_fit_state(const std::filesystem::path& path, const FitState& state, const std::string& key) {
  Json json = json_of(state);
  json["format"] = format;
  json["key"] = key;
  write_file(path, json.dump(1));
}

FitState to_fit_state(const std::string& text, const std::filesystem::path& path, const std::string& key) {
  try {
    const Json json = Json::parse(text);
    if (json.at("format") != format) throw std::runtime_error("another format");
    if (json.at("key") != key)
      throw InputError({{path},
                        "the interrupted fit was of another capture or with other choices",
                        "the same ones",
                        "leave out --resume to start anew, or give the same capture and options"});
    FitState state;
    read(json, state);
    return state;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError({{path},
                      std::string("cannot be read as the state of a fit: ") + error.what(),
                      "",
                      "leave out --resume to start anew"});
  }
}

}  // namespace pliant
