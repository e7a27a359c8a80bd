// Fits materials to stress-strain curves and predicts others, as JSON on stdout.
//   pliant_material_curves request=FILE
// The file: {"fits": [{"name", "tests": [numbers of those that are fitted], "law": "ogden" | "linear",
//   "poisson_ratio": nu (null: estimated), "max_terms": N, "positive_exponents": false}], "tests": [{"name", "mode":
//   "uniaxial" | "pure_shear" | "equibiaxial" | "biaxial" | "simple_shear" | "confined", "measure": "first" | "second"
//   | "cauchy_difference", "stretch": [...], "stress": [... Pa], "second": [...], "prestretch": l}]}
// Every fit has its law, and its stresses and relative rms error for every test.

#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "estimation/material_tests.hpp"
#include "request.hpp"

namespace pliant {
namespace {

using nlohmann::json;

template <class Kind>
Kind kind_named(const std::map<std::string, Kind>& kinds, const std::string& name) {
  const auto found = kinds.find(name);
  if (found == kinds.end()) throw std::invalid_argument("\"" + name + "\" is not known");
  return found->second;
}

MaterialTest read_test(const json& j) {
  MaterialTest test;
  test.name = j.at("name");
  test.mode = kind_named<TestMode>({{"uniaxial", TestMode::Uniaxial},
                                    {"pure_shear", TestMode::PureShear},
                                    {"equibiaxial", TestMode::Equibiaxial},
                                    {"biaxial", TestMode::Biaxial},
                                    {"simple_shear", TestMode::SimpleShear},
                                    {"confined", TestMode::ConfinedUniaxial}},
                                   j.at("mode"));
  test.measure = kind_named<StressMeasure>({{"first", StressMeasure::First},
                                            {"second", StressMeasure::Second},
                                            {"cauchy_difference", StressMeasure::CauchyDifference}},
                                           j.value("measure", "first"));
  test.stretch = j.at("stretch").get<std::vector<double>>();
  test.stress = j.at("stress").get<std::vector<double>>();
  test.second = j.value("second", std::vector<double>{});
  test.prestretch = j.value("prestretch", 1.0);
  check_test(test);
  return test;
}

json or_null(double value) { return std::isfinite(value) ? json(value) : json(); }

class Experiment {
 public:
  explicit Experiment(const Choices& choices) {
    request_ = read_request(choices);
    for (const json& test : request_.at("tests")) tests_.push_back(read_test(test));
  }

  json run() const {
    json report = json::array();
    for (const json& fit : request_.at("fits")) report.push_back(fitted(fit));
    return {{"fits", report}};
  }

 private:
  json fitted(const json& j) const {
    std::vector<MaterialTest> chosen;
    for (const std::size_t t : j.at("tests").get<std::vector<std::size_t>>()) chosen.push_back(tests_.at(t));
    CurveFitOptions options;
    options.max_terms = j.value("law", "ogden") == "linear" ? 0 : j.value("max_terms", 4);
    if (!j.at("poisson_ratio").is_null()) options.poissons_ratio = j.at("poisson_ratio").get<double>();
    options.positive_exponents = j.value("positive_exponents", false);
    const auto begin = std::chrono::steady_clock::now();
    const CurveFit fit = fit_curves(chosen, options);
    json report = {{"name", j.at("name")}, {"tests", j.at("tests")}, {"succeeded", fit.succeeded}};
    report["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (!fit.succeeded) {
      report["failure"] = fit.failure;
      return report;
    }
    const MatrixX& table = fit.law->table();
    report["law"] = {{"name", fit.law->name()},
                     {"parameters", std::vector<double>(table.data(), table.data() + table.size())},
                     {"youngs_modulus", fit.law->small_strain(0).youngs_modulus},
                     {"poisson_ratio", fit.law->small_strain(0).poissons_ratio}};
    for (const CurveFit::Tried& tried : fit.tried)
      report["tried"].push_back({{"terms", tried.terms}, {"bic", tried.bic}, {"rms", tried.rms}});
    for (const MaterialTest& test : tests_) {
      const std::vector<double> stresses = predict_test(*fit.law, test);
      json values = json::array();
      for (const double s : stresses) values.push_back(or_null(s));
      report["predictions"].push_back({{"rms", or_null(relative_rms(test, stresses))}, {"stress", values}});
    }
    return report;
  }

  json request_;
  std::vector<MaterialTest> tests_;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Experiment>("pliant_material_curves", argc, argv, {{"request", ""}});
}
