#include "simulation/law_table.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "base/error.hpp"
#include "elasticity/lame.hpp"
#include "elasticity/sampled_law.hpp"

namespace pliant {

namespace {

[[noreturn]] void refuse(const char* file, const std::string& found, const std::string& expected,
                         const char* advice = "save the model again") {
  throw InputError({{file}, found, expected, advice});
}

ModelLaw table_of(const TabulatedLaw& law) {
  ModelLaw table;
  table.name = law.name(), table.columns = {"element"};
  for (const std::string& name : law.parameter_names()) table.columns.push_back(name);
  for (Eigen::Index e = 0; e < law.table().rows(); ++e) {
    std::vector<double> row = {double(e)};
    for (Eigen::Index k = 0; k < law.table().cols(); ++k) row.push_back(law.table()(e, k));
    table.rows.push_back(std::move(row));
  }
  return table;
}

ModelLaw sampled_table(const SampledLaw& law) {
  ModelLaw table = table_of(law.law());
  table.own_law = std::exchange(table.name, law.name());
  for (int e = 0; e < law.element_count(); ++e) {
    const StressSamples& s = law.samples(e);
    for (std::size_t i = 0; i < s.strains.size(); ++i) {
      std::vector<double>& row = table.samples.emplace_back();
      row = {double(e), s.width};
      row.insert(row.end(), s.strains[i].begin(), s.strains[i].end());
      row.insert(row.end(), s.weights[i].begin(), s.weights[i].end());
    }
  }
  return table;
}

std::shared_ptr<const TabulatedLaw> tabulated(const ModelLaw& law, const std::string& name, int elements) try {
  if (int(law.rows.size()) != elements)
    refuse("material.csv", fmt::format("{} rows", law.rows.size()),
           fmt::format("one for each of {} elements", elements));
  MatrixX table(elements, Eigen::Index(law.columns.size()) - 1);
  for (int e = 0; e < elements; ++e)
    for (Eigen::Index k = 0; k < table.cols(); ++k) table(e, k) = law.rows[std::size_t(e)][std::size_t(k) + 1];
  auto made = tabulated_law(name, std::move(table));
  if (!made) refuse("material.csv", "the law \"" + name + "\"", "ogden, neo_hookean, linear or sampled");
  return made;
} catch (const std::invalid_argument& error) {
  refuse("material.csv", error.what(), "the parameters of a material");
}

std::shared_ptr<const MaterialLaw> sampled_law(const ModelLaw& table, int elements) try {
  std::vector<StressSamples> samples{std::size_t(elements)};
  for (const std::vector<double>& row : table.samples) {
    const int e = int(row[0]);
    if (!(row[0] >= 0.0) || e >= elements)
      refuse("samples.csv", fmt::format("element {}", row[0]), fmt::format("0..{}", elements - 1));
    StressSamples& s = samples[std::size_t(e)];
    if (!s.strains.empty() && s.width != row[1])
      refuse("samples.csv", fmt::format("the widths {} and {} of element {}", s.width, row[1], e),
             "one width in all rows of an element");
    s.width = row[1];
    s.strains.emplace_back(Eigen::Map<const Strain6>(row.data() + 2));
    s.weights.emplace_back(Eigen::Map<const Strain6>(row.data() + 8));
  }
  return std::make_shared<SampledLaw>(tabulated(table, table.own_law, elements), std::move(samples));
} catch (const std::invalid_argument& error) {
  refuse("samples.csv", error.what(), "the samples of a material");
}

}  // namespace

ModelLaw model_law(const MaterialLaw& law) {
  if (const auto* sampled = dynamic_cast<const SampledLaw*>(&law)) return sampled_table(*sampled);
  return table_of(dynamic_cast<const TabulatedLaw&>(law));
}

std::shared_ptr<const MaterialLaw> make_law(const ModelLaw& law, int elements) {
  if (law.name == "sampled") return sampled_law(law, elements);
  return tabulated(law, law.name, elements);
}

std::shared_ptr<const MaterialLaw> law_of(const Model& model, const Body& body) {
  if (model.law) return make_law(*model.law, body.element_count());
  MatrixX table(body.element_count(), 2);
  const bool is_neo_hookean = model.material.of_mean_strain() == ElasticLaw::NeoHookean;
  for (int e = 0; e < body.element_count(); ++e) {
    const auto i = std::size_t(e);
    const bool has_field = model.volume.poissons_ratio.size() == std::size_t(body.element_count());
    const double E = model.youngs_modulus * body.modulus.relative[i];
    const double nu = has_field ? model.volume.poissons_ratio[i] : model.poissons_ratio;
    if (is_neo_hookean) {
      const UnitLame unit = unit_lame(nu);
      table.row(e) << E * unit.mu, E * unit.lambda;
    } else {
      const LambdaAlpha p = lambda_alpha({E, nu});
      table.row(e) << p.lambda, p.alpha;
    }
  }
  if (is_neo_hookean) return std::make_shared<NeoHookeanLaw>(std::move(table));
  return std::make_shared<LinearLaw>(std::move(table));
}

}  // namespace pliant
