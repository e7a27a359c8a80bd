#include "estimation/fit_state.hpp"

#include <limits>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/files.hpp"

namespace pliant {

namespace {

using Json = nlohmann::json;
constexpr const char* format = "fit-state/18";

Json from_vector(const VectorX& v) { return std::vector<double>(v.data(), v.data() + v.size()); }
VectorX to_vector(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const VectorX>(values.data(), Eigen::Index(values.size()));
}
/// JSON knows no infinity: null stands for it.
double to_cost(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}
Json from_cost(double cost) { return std::isfinite(cost) ? Json(cost) : Json(); }

Json from_pass(const PassState& pass);
PassState to_pass(const Json& json);

Json from_tried(const std::vector<TriedField>& fields) {
  Json json = Json::array();
  for (const TriedField& t : fields)
    json.push_back({{"control_points", t.control_points},
                    {"estimated", t.estimated},
                    {"cost", from_cost(t.cost)},
                    {"against", from_cost(-t.log_bayes_factor)}});
  return json;
}

std::vector<TriedField> to_tried(const Json& json) {
  std::vector<TriedField> fields;
  for (const Json& t : json)
    fields.push_back({t.at("control_points").get<int>(), t.at("estimated").get<bool>(), to_cost(t.at("cost")),
                      -to_cost(t.at("against"))});
  return fields;
}

Json from_field(const FitState::FieldChoice& field) {
  Json json = {{"tried", from_tried(field.tried)}, {"best", field.best}, {"under_way", field.under_way}};
  if (field.state) json["state"] = from_pass(*field.state);
  return json;
}

FitState::FieldChoice to_field(const Json& json) {
  FitState::FieldChoice field;
  field.best = json.at("best").get<int>();
  field.under_way = json.at("under_way").get<int>();
  field.tried = to_tried(json.at("tried"));
  if (json.contains("state")) field.state = to_pass(json["state"]);
  return field;
}

Json from_tracking(const FitState::Tracking& tracking) {
  Json json = {{"phase", int(tracking.phase)}, {"keeps_loop", tracking.keeps_loop}, {"rounds", Json::array()}};
  for (const TrackingRound& r : tracking.rounds)
    json["rounds"].push_back({{"youngs_modulus", r.youngs_modulus},
                              {"surface_rms", r.surface_rms},
                              {"confidence", r.confidence},
                              {"fit_rms", r.fit_rms},
                              {"change", r.change},
                              {"lost", r.lost},
                              {"theta", from_vector(r.theta)},
                              {"controls", r.controls},
                              {"fields", from_tried(r.fields)}});
  if (tracking.loop) json["loop"] = from_pass(*tracking.loop);
  if (tracking.direct) json["direct"] = from_pass(*tracking.direct);
  return json;
}

FitState::Tracking to_tracking(const Json& json) {
  FitState::Tracking tracking;
  tracking.phase = FitState::Tracking::Phase(json.at("phase").get<int>());
  tracking.keeps_loop = json.at("keeps_loop").get<bool>();
  for (const Json& r : json.at("rounds"))
    tracking.rounds.push_back({r.at("youngs_modulus").get<double>(), r.at("surface_rms").get<double>(),
                               r.at("confidence").get<double>(), r.at("fit_rms").get<double>(),
                               r.at("change").get<double>(), r.at("lost").get<bool>(), to_vector(r.at("theta")),
                               r.at("controls").get<int>(), to_tried(r.at("fields"))});
  if (json.contains("loop")) tracking.loop = to_pass(json["loop"]);
  if (json.contains("direct")) tracking.direct = to_pass(json["direct"]);
  return tracking;
}

Json from_matrix(const MatrixX& m) {
  return {{"rows", m.rows()}, {"values", std::vector<double>(m.data(), m.data() + m.size())}};
}
MatrixX to_matrix(const Json& json) {
  const auto values = json.at("values").get<std::vector<double>>();
  const auto rows = json.at("rows").get<Eigen::Index>();
  return Eigen::Map<const MatrixX>(values.data(), rows, rows == 0 ? 0 : Eigen::Index(values.size()) / rows);
}

Json from_sample(const PressSample& s) {
  return {{"succeeded", s.succeeded},
          {"converged", s.converged},
          {"failure", s.failure},
          {"strains", from_matrix(s.sample.strains)},
          {"stresses", from_matrix(s.sample.stresses)},
          {"weight", s.weight},
          {"start_rms", s.start_rms},
          {"rms", s.rms},
          {"iterations", s.iterations}};
}

PressSample to_sample(const Json& json) {
  PressSample s;
  s.succeeded = json.at("succeeded").get<bool>();
  s.converged = json.at("converged").get<bool>();
  s.failure = json.at("failure").get<std::string>();
  s.sample.strains = to_matrix(json.at("strains"));
  s.sample.stresses = to_matrix(json.at("stresses"));
  s.weight = json.at("weight").get<double>();
  s.start_rms = json.at("start_rms").get<double>();
  s.rms = json.at("rms").get<double>();
  s.iterations = json.at("iterations").get<int>();
  return s;
}

Json from_optimiser(const OptimiserState& o) {
  return {{"iterations", o.iterations}, {"p", from_vector(o.p)}, {"memory", from_vector(o.memory)}};
}
OptimiserState to_optimiser(const Json& json) {
  return {json.at("iterations").get<int>(), to_vector(json.at("p")), to_vector(json.at("memory"))};
}

Json from_sampled(const PressSampling::State& sampled) {
  Json json = {{"kept", Json::array()}, {"under", Json::array()}};
  for (const PressSample& s : sampled.kept) json["kept"].push_back(from_sample(s));
  for (const PressSample& s : sampled.under) json["under"].push_back(from_sample(s));
  return json;
}
PressSampling::State to_sampled(const Json& json) {
  PressSampling::State sampled;
  for (const Json& s : json.at("kept")) sampled.kept.push_back(to_sample(s));
  for (const Json& s : json.at("under")) sampled.under.push_back(to_sample(s));
  return sampled;
}

Json from_finding(const LawFinding& law) {
  Json json = {
      {"noise", law.noise.at_rest},         {"noise_growth", law.noise.growth},    {"deviation", law.deviation},
      {"track_squares", law.track_squares}, {"stated_cost", law.stated_cost},      {"observations", law.observations},
      {"dimension", law.dimension},         {"against", from_cost(-law.evidence)}, {"points", Json::array()}};
  if (law.cut) json["cut"] = {law.cut->zone, int(law.cut->by), law.cut->at};
  for (const Vector3& p : law.points) json["points"].push_back({p.x(), p.y(), p.z()});
  return json;
}
LawFinding to_finding(const Json& json) {
  LawFinding law;
  law.noise = {json.at("noise").get<double>(), json.at("noise_growth").get<double>()};
  law.deviation = json.at("deviation").get<double>();
  law.track_squares = json.at("track_squares").get<double>();
  law.stated_cost = json.at("stated_cost").get<double>();
  law.observations = json.at("observations").get<double>();
  law.dimension = json.at("dimension").get<int>();
  law.evidence = -to_cost(json.at("against"));
  if (json.contains("cut")) {
    const Json& cut = json["cut"];
    law.cut = {cut.at(0).get<int>(), ZoneCut::By(cut.at(1).get<int>()), cut.at(2).get<double>()};
  }
  for (const Json& p : json.at("points"))
    law.points.emplace_back(p.at(0).get<double>(), p.at(1).get<double>(), p.at(2).get<double>());
  return law;
}

Json from_id(const StageId& id) { return {int(id.kind), id.start, id.number}; }
StageId to_id(const Json& json) {
  const int kind = json.at(0).get<int>();
  if (kind < 0 || kind > int(StageKind::Sample)) throw std::runtime_error("a stage of an unknown kind");
  return {StageKind(kind), json.at(1).get<int>(), json.at(2).get<int>()};
}

Json from_record(const StageRecord& r) {
  Json json = {{"stage", from_id(r.id)},
               {"name", r.name},
               {"from", from_vector(r.from)},
               {"theta", from_vector(r.theta)},
               {"start_cost", from_cost(r.start_cost)},
               {"cost", from_cost(r.cost)},
               {"misfit", from_cost(r.misfit)},
               {"is_explained", r.is_explained},
               {"iterations", r.iterations},
               {"succeeded", r.succeeded},
               {"converged", r.converged},
               {"reason", r.reason},
               {"elements", r.elements},
               {"work", r.work},
               {"corrected", r.corrected},
               {"told", r.told},
               {"trials", Json::array()}};
  for (const auto& [modulus, cost] : r.trials) json["trials"].push_back({modulus, from_cost(cost)});
  for (const ModelShift& s : r.shifts) json["shifts"].push_back({s.cause, from_vector(s.shift)});
  if (r.joined) json["joined"] = *r.joined;
  if (r.law) json["law"] = from_finding(*r.law);
  return json;
}

StageRecord to_record(const Json& json) {
  StageRecord r;
  r.id = to_id(json.at("stage"));
  r.name = json.at("name").get<std::string>();
  r.from = to_vector(json.at("from")), r.theta = to_vector(json.at("theta"));
  r.start_cost = to_cost(json.at("start_cost")), r.cost = to_cost(json.at("cost"));
  r.misfit = to_cost(json.at("misfit"));
  r.is_explained = json.at("is_explained").get<bool>();
  r.iterations = json.at("iterations").get<int>();
  r.succeeded = json.at("succeeded").get<bool>(), r.converged = json.at("converged").get<bool>();
  r.reason = json.at("reason").get<std::string>();
  r.elements = json.at("elements").get<int>();
  r.work = json.at("work").get<double>();
  r.corrected = json.at("corrected").get<std::vector<std::string>>();
  r.told = json.at("told").get<std::string>();
  for (const Json& t : json.at("trials")) r.trials.emplace_back(t.at(0).get<double>(), to_cost(t.at(1)));
  if (json.contains("shifts"))
    for (const Json& s : json["shifts"]) r.shifts.push_back({s.at(0).get<std::string>(), to_vector(s.at(1))});
  if (json.contains("joined")) r.joined = json["joined"].get<int>();
  if (json.contains("law")) r.law = to_finding(json["law"]);
  return r;
}

Json from_pass(const PassState& pass) {
  Json json = {{"controls", pass.controls}, {"done", Json::array()}};
  for (const StageRecord& r : pass.done) json["done"].push_back(from_record(r));
  if (const auto& stage = pass.under_way)
    json["under_way"] = {{"stage", from_id(stage->id)},
                         {"from", from_vector(stage->from)},
                         {"optimiser", from_optimiser(stage->optimiser)}};
  if (const auto& begin = pass.begin) json["begin"] = {{"theta", from_vector(begin->theta)}, {"stage", begin->stage}};
  return json;
}

PassState to_pass(const Json& json) {
  PassState pass;
  pass.controls = json.at("controls").get<int>();
  for (const Json& r : json.at("done")) pass.done.push_back(to_record(r));
  if (json.contains("under_way")) {
    const Json& stage = json["under_way"];
    pass.under_way = {to_id(stage.at("stage")), to_vector(stage.at("from")), to_optimiser(stage.at("optimiser"))};
  }
  if (json.contains("begin")) pass.begin = {to_vector(json["begin"].at("theta")), json["begin"].at("stage").get<int>()};
  return pass;
}

Json from_span(const FitState::SpanSearch& span) {
  Json json = {{"has_whole", span.has_whole},
               {"is_ended", span.is_ended},
               {"part", span.part},
               {"next_part", span.next_part},
               {"has_parts", span.has_parts}};
  if (span.state) json["state"] = from_pass(*span.state);
  return json;
}

FitState::SpanSearch to_span(const Json& json) {
  FitState::SpanSearch span;
  span.has_whole = json.at("has_whole").get<bool>(), span.is_ended = json.at("is_ended").get<bool>();
  span.part = json.at("part").get<double>(), span.next_part = json.at("next_part").get<double>();
  span.has_parts = json.at("has_parts").get<bool>();
  if (json.contains("state")) span.state = to_pass(json["state"]);
  return span;
}

Json to_json(const FitState& state) {
  Json json = {{"pass", from_pass(state.pass)}};
  if (state.field) json["field"] = from_field(*state.field);
  if (state.tracking) json["tracking"] = from_tracking(*state.tracking);
  if (state.span) json["span"] = from_span(*state.span);
  if (state.sampled) json["sampled"] = from_sampled(*state.sampled);
  return json;
}

FitState to_state(const Json& json) {
  FitState state;
  state.pass = to_pass(json.at("pass"));
  if (json.contains("field")) state.field = to_field(json["field"]);
  if (json.contains("tracking")) state.tracking = to_tracking(json["tracking"]);
  if (json.contains("span")) state.span = to_span(json["span"]);
  if (json.contains("sampled")) state.sampled = to_sampled(json["sampled"]);
  return state;
}

}  // namespace

void write_fit_state(const std::filesystem::path& path, const FitState& state, const std::string& key) {
  Json json = to_json(state);
  json["format"] = format;
  json["key"] = key;
  write_file(path, json.dump(1));
}

FitState read_fit_state(const std::filesystem::path& path, const std::string& key) {
  return to_fit_state(read_file(path), path, key);
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
    return to_state(json);
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
