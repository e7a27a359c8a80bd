#include "exports/card.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/files.hpp"

namespace pliant {

namespace {

using Json = nlohmann::ordered_json;

/// Members of a result that a card repeats as they are.
constexpr const char* of_the_fit[] = {"software", "capture", "recordings", "material",
                                      "verdict",  "reasons", "deformation"};

Json read_fit(const std::filesystem::path& file) {
  const Json result = Json::parse(read_file(file), nullptr, false);
  if (!result.is_object() || !result.contains("parameters"))
    throw InputError({{file}, "no result of a fit", "a result.json as `pliant fit` writes it", "move it elsewhere"});
  return result;
}

/// Values with their deviation and interval, of the material and of nothing else: those of regions ("@left"), and of
/// the terms of Ogden's law ("exponent_2"), too.
Json values_of(const Json& parameters) {
  Json values = Json::object();
  for (const auto& [name, parameter] : parameters.items()) {
    constexpr const char* of_material[] = {"youngs_modulus", "poissons_ratio",    "density",  "mass_damping",
                                           "exponent_",      "stiffness_damping", "friction", "stiffness_ratio_"};
    const auto begins = [&](const char* word) { return name.starts_with(word); };
    if (std::ranges::none_of(of_material, begins) || !parameter.is_object()) continue;
    Json value;
    for (const char* member : {"value", "unit", "std", "interval_90", "estimated"})
      if (parameter.contains(member)) value[member] = parameter[member];
    values[name] = std::move(value);
  }
  return values;
}

double mean_modulus(const ExportModel& model) {
  double mean = 0.0;
  for (std::size_t e = 0; e < model.moduli.size(); ++e)
    mean += model.moduli[e] * model.body->element_volume[e] / model.body->volume();
  return mean;
}

/// The greatest relative difference of two lists of frequencies; null where there is none to compare.
Json greatest_difference(const SmallMotions& a, const SmallMotions& b) {
  double greatest = -1.0;
  for (std::size_t i = 0; i < std::min(a.frequencies.size(), b.frequencies.size()); ++i)
    if (a.frequencies[i] > 0.0) greatest = std::max(greatest, std::abs(b.frequencies[i] / a.frequencies[i] - 1.0));
  return greatest < 0.0 ? Json() : Json(greatest);
}

}  // namespace

std::string card_of(const ExportModel& model, const std::string& to,
                    const std::optional<std::filesystem::path>& result) {
  Json card = {{"format", "card/1"}, {"name", model.name}};
  if (result) {
    const Json fit = read_fit(*result);
    for (const char* member : of_the_fit)
      if (fit.contains(member)) card["fit"][member] = fit[member];
    card["fit"]["values"] = values_of(fit["parameters"]);
    if (fit.contains("error") && fit["error"].contains("surface_rms"))
      card["fit"]["surface_rms"] = fit["error"]["surface_rms"];
  } else {
    card["fit"] = Json();
  }
  card["exported"] = {{"to", to},
                      {"elements", model.body->element_count()},
                      {"quadratic", model.is_quadratic()},
                      {"youngs_modulus", mean_modulus(model)},
                      {"moduli_were_multiplied_by", model.identified},
                      {"poissons_ratio", model.poissons_ratio},
                      {"density", model.density},
                      {"mass_damping", model.mass_damping},
                      {"stiffness_damping", model.stiffness_damping},
                      {"differs", model.notes}};
  card["tested"] = {
      {"how",
       "frequencies and sag of small motions of the fitted model and of the elements that were written, both "
       "computed by pliant; the program that reads the files was not run"},
      {"frequencies",
       {{"unit", "Hz"},
        {"model", model.model.frequencies},
        {"exported", model.exported.frequencies},
        {"greatest_difference", greatest_difference(model.model, model.exported)}}},
      {"sag", {{"unit", "m"}, {"model", model.model.sag}, {"exported", model.exported.sag}}}};
  return card.dump(2) + "\n";
}

}  // namespace pliant
