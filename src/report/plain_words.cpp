#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "report/plot.hpp"
#include "report/report.hpp"

namespace pliant {

SpokenUnit spoken_unit(double value, const std::string& unit) {
  const double size = std::abs(value);
  if (unit == "Pa" && size >= 1e9) return {1e-9, "GPa"};
  if (unit == "Pa" && size >= 1e6) return {1e-6, "MPa"};
  if (unit == "Pa" && size >= 1e4) return {1e-3, "kPa"};
  if (unit == "Pa/m" && size >= 1e6) return {1e-6, "MPa/m"};
  if (unit == "Pa/m" && size >= 1e4) return {1e-3, "kPa/m"};
  if (unit == "m" && size < 0.1 && size > 0.0) return {1e3, "mm"};
  if (unit == "s" && size < 0.1 && size > 0.0) return {1e3, "ms"};
  static const std::map<std::string, std::string> spoken{
      {"kg/m^3", "kg/m³"}, {"m/s^2", "m/s²"}, {"1", ""}, {"Pa/m", "Pa/m"}};
  const auto found = spoken.find(unit);
  return {1.0, found == spoken.end() ? unit : found->second};
}

namespace {

std::string with_unit(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + "\u00a0" + unit;
}

std::string millimetres(double metres) {
  const double mm = 1e3 * metres;
  return with_unit(mm >= 1.0 && mm < 9.95 ? fmt::format("{:.1f}", mm) : readable(mm, 2), "mm");
}

// People's names keep their capital.
std::string within_sentence(const std::string& name) {
  std::string words = spoken_name(name);
  if (words.find("'s ") == std::string::npos && words[0] >= 'A' && words[0] <= 'Z')
    words[0] = char(words[0] - 'A' + 'a');
  return words;
}

std::string agreement_sentence(const ReportData& data) {
  const ErrorResult& error = data.result.error;
  if (!error.surface_rms && error.marker_rms)
    return fmt::format("The simulated markers lie {} (root mean square) from the recorded ones.",
                       millimetres(*error.marker_rms));
  if (!error.surface_rms) return "";
  std::string text = fmt::format("The simulated surface lies {} (root mean square) from the {} observed points",
                                 millimetres(*error.surface_rms), readable(double(error.points), 6));
  if (error.outline_rms && *error.outline_rms != *error.surface_rms)
    text += fmt::format(", and {} from those on outlines", millimetres(*error.outline_rms));
  double squares = 0.0, points = 0.0;
  for (const FrameResidual& frame : data.residuals)
    if (frame.noise) squares += frame.points * *frame.noise * *frame.noise, points += frame.points;
  if (points <= 0.0 || squares <= 0.0) return text + ".";
  const double noise = std::sqrt(squares / points), ratio = *error.surface_rms / noise;
  text += fmt::format("; the sensor's noise alone would give {}. ", millimetres(noise));
  if (ratio < 0.7) return text + "The noise seems to be stated too high.";
  if (ratio < 1.3) return text + "The model explains the recording down to its noise.";
  if (ratio < 2.0) return text + "A little of the motion is not explained by the model.";
  return text +
         "Part of the motion is not explained by this model: look where in the pictures and when in the plot below.";
}

// A number in the unit in which the parameter's value is shown.
std::string in_unit(double number, int digits, const ParameterResult& p) {
  const SpokenUnit scaled = spoken_unit(std::get<double>(p.value), p.unit);
  return with_unit(readable(number * scaled.factor, digits), scaled.unit);
}

// How well a scalar is known, in words; empty where nothing can be said.
std::string trust_sentence(const ParameterResult& p) {
  const auto* value = std::get_if<double>(&p.value);
  if (!p.estimated || !value) return "";
  if (!p.std || !std::isfinite(std::get<double>(*p.std)))
    return fmt::format("{} has no uncertainty: the fit did not come to its end, or the recording hardly depends on it.",
                       spoken_name(p.name));
  const auto is_of = [&](const char* error) { return p.name.starts_with(error); };
  if (is_of("range_error@") || is_of("outline_error@") || is_of("range_scale@") || is_of("focal_error@"))
    return "";                            // none is expected: how far from that is told by the deviation alone
  constexpr double usual_friction = 0.3;  // beside which that of a smooth floor is known though it is nearly none
  const double std = std::get<double>(*p.std), relative = std / std::abs(*value);
  const double usual = p.name.starts_with("friction") ? usual_friction : 0.0;
  if (std < 0.3 * std::max(std::abs(*value), usual)) return "";
  return fmt::format("{} is known poorly (± {}): the recording depends little on it.", spoken_name(p.name),
                     std::isfinite(relative) ? readable(100.0 * relative, 2) + " %" : in_unit(std, 2, p));
}

// Where the limit lies outside the interval that the data give, the interval alone would mislead.
std::string discretisation_sentence(const ParameterResult& p) {
  const auto *value = std::get_if<double>(&p.value),
             *limit = p.extrapolated ? std::get_if<double>(&*p.extrapolated) : nullptr;
  if (!value || !limit || !p.std || std::abs(*limit - *value) < 2.0 * std::get<double>(*p.std)) return "";
  return fmt::format(
      "{} still depends on the mesh or the time step: {}. Its value here suits simulations as fine as the model; "
      "compare "
      "the limit with other measurements.",
      spoken_name(p.name), discretisation_words(p));
}

std::string given_sentence(const Result& result) {
  std::string names;
  for (const ParameterResult& p : result.parameters)
    if (!p.estimated && std::holds_alternative<double>(p.value))
      names += (names.empty() ? "" : ", ") + within_sentence(p.name) + " (" +
               value_with_uncertainty(std::get<double>(p.value), std::nullopt, p.unit) + ")";
  return names.empty() ? "" : "Taken as given, not estimated: " + names + ".";
}

}  // namespace

std::string spoken_name(const std::string& name) {
  static const std::map<std::string, std::string> spoken{{"youngs_modulus", "Young's modulus"},
                                                         {"poissons_ratio", "Poisson's ratio"},
                                                         {"mass_damping", "Mass damping"},
                                                         {"stiffness_damping", "Stiffness damping"}};
  const size_t at = name.find('@');
  const std::string base = name.substr(0, at), region = at == std::string::npos ? "" : " (" + name.substr(at + 1) + ")";
  if (const auto found = spoken.find(base); found != spoken.end()) return found->second + region;
  const size_t number = base.find_last_not_of("0123456789") + 1;  // of a law's term: "poissons_ratio_2"
  if (number > 0 && number < base.size() && base[number - 1] == '_')
    if (const auto found = spoken.find(base.substr(0, number - 1)); found != spoken.end())
      return found->second + " " + base.substr(number) + region;
  std::string words = base;
  std::replace(words.begin(), words.end(), '_', ' ');
  if (!words.empty() && words[0] >= 'a' && words[0] <= 'z') words[0] = char(words[0] - 'a' + 'A');
  return words + region;
}

std::string value_with_uncertainty(double value, std::optional<double> std, const std::string& unit) {
  const SpokenUnit scaled = spoken_unit(value, unit);
  const double shown = value * scaled.factor;
  if (!std || !std::isfinite(*std) || *std <= 0.0 || !std::isfinite(value))
    return with_unit(readable(shown, 4), scaled.unit);
  const double spread = *std * scaled.factor;
  const int spread_exponent = int(std::floor(std::log10(spread) + 1e-12));
  const int value_exponent = shown == 0.0 ? spread_exponent : int(std::floor(std::log10(std::abs(shown)) + 1e-12));
  const int digits = std::clamp(value_exponent - spread_exponent + 2, 1, 9);
  return with_unit(readable(shown, digits) + " ± " + readable(spread, 2), scaled.unit);
}

std::string discretisation_words(const ParameterResult& p) {
  if (!p.extrapolated || !std::holds_alternative<double>(*p.extrapolated)) return "";
  std::string words;
  const auto say = [&](const char* what, const std::optional<ParameterValue>& error) {
    if (error) words += fmt::format("{} ± {}, ", what, in_unit(std::get<double>(*error), 2, p));
  };
  say("mesh", p.mesh_error);
  say("time step", p.step_error);
  return words + "limit " + in_unit(std::get<double>(*p.extrapolated), 4, p);
}

std::string largest_share_sentence(const Result& result) {
  static const std::vector<std::pair<std::string, std::string>> remedies = {
      {"noise", "a longer recording, or a better sensor"},
      {"mesh", "a finer mesh (--set cells)"},
      {"time step", "smaller time steps (--set steps)"},
      {"errors of the scan", "a scan that errs less (surface_noise of [object])"},
      {"uneven stiffness",
       "a second recording that loads other places of the object, or saying how even it is "
       "(stiffness_std of [object])"},
      {"stiffness of contact", "a hard floor, or less of it in the recording"},
      {"form of the law", "presses of other sizes and at other places"},
      {"law at large strain", "smaller strains, or the law of the object's material (--set material)"},
      {"mass", "weighing the object more exactly"},
      {"direction of gravity", "a level: the direction of gravity in the capture"},
      {"pose of", "a calibration of the sensor's pose"},
      {"range", "a calibration of the sensor's range"},
      {"focal length of", "a calibration of the camera"},
      {"scale of lengths", "a length of the object that is measured (scale_std of [object])"},
      {"friction", "a coefficient of friction that is measured"},
      {"law and damping", "a second recording of the object in another situation"},
      {"what the recordings differ by", "more recordings of the object"},
      {"what parts of the motion differ by", "other recordings of the object, in which it moves less wildly"}};
  const UncertaintyResult* largest = nullptr;
  for (const UncertaintyResult& u : result.uncertainty) {
    const auto own = u.std.find("youngs_modulus");
    if (own != u.std.end() && (!largest || own->second > largest->std.at("youngs_modulus"))) largest = &u;
  }
  const ParameterResult* modulus = result.find("youngs_modulus");
  if (!largest || !modulus) return "";
  const double percent = 100.0 * largest->std.at("youngs_modulus") / std::abs(std::get<double>(modulus->value));
  std::string sentence = fmt::format("Most of the uncertainty of Young's modulus comes from {} ({} %)", largest->cause,
                                     readable(percent, 2));
  const bool are_curves = !result.curves.empty() && !result.error.surface_rms && !result.error.marker_rms;
  if (are_curves)
    return sentence + "; what would narrow it most is curves of other modes of loading, or with less scatter.";
  const auto is_estimated = [&](const char* name) {
    const ParameterResult* p = result.find(name);
    return p && p->estimated;
  };
  const bool is_at_rest = !is_estimated("mass_damping") && !is_estimated("stiffness_damping");
  if (is_at_rest && largest->cause == "noise")
    return sentence +
           "; what would narrow it most is more or larger loads, or forces and places that are measured better.";
  if (is_at_rest && largest->cause == "law and damping")
    return sentence + "; what would narrow it most is loads of other sizes and at other places.";
  for (const auto& [cause, remedy] : remedies)
    if (largest->cause.starts_with(cause)) return sentence + "; what would narrow it most is " + remedy + ".";
  return sentence + ".";
}

std::vector<std::string> plain_sentences(const ReportData& data) {
  std::vector<std::string> sentences{agreement_sentence(data)};
  for (const ParameterResult& p : data.result.parameters) sentences.push_back(trust_sentence(p));
  for (const ParameterResult& p : data.result.parameters) sentences.push_back(discretisation_sentence(p));
  sentences.push_back(given_sentence(data.result));
  for (const std::string& note : data.result.notes) sentences.push_back(note);
  std::erase(sentences, "");
  return sentences;
}

}  // namespace pliant
