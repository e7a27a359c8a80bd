#include "simulation/law_table.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "base/error.hpp"
#include "elasticity/lame.hpp"
#include "elasticity/sampled_law.hpp"

namespace pliant {

namespace {

/// Rows of a sampled element's table: what kind each is.
enum class Row : int { Constant = 0, Least = 1, Most = 2, Sample = 3 };

const std::vector<std::string> sampled_columns = {"element", "row", "xx", "yy", "zz", "xy", "xz", "yz", "lambda", "nu"};

ModelLaw sampled_table(const SampledLaw& law) {
  ModelLaw table{law.name(), sampled_columns, {}, law.metric_nu()};
  const auto add = [&](int e, Row row, const Strain6& strain, const Eigen::Vector2d& value) {
    std::vector<double> numbers = {double(e), double(int(row))};
    numbers.insert(numbers.end(), strain.begin(), strain.end());
    numbers.insert(numbers.end(), {value[0], value[1]});
    table.rows.push_back(std::move(numbers));
  };
  for (int e = 0; e < law.element_count(); ++e) {
    const StrainSamples& s = law.samples(e);
    add(e, Row::Constant, Strain6::Zero(), s.constant);
    add(e, Row::Least, Strain6::Zero(), s.least);
    add(e, Row::Most, Strain6::Zero(), s.most);
    for (std::size_t i = 0; i < s.strains.size(); ++i) add(e, Row::Sample, s.strains[i], s.weights[i]);
  }
  return table;
}

[[noreturn]] void refuse(const std::string& found, const std::string& expected) {
  throw InputError({{"material.csv"}, found, expected, "save the model again"});
}

std::shared_ptr<const MaterialLaw> sampled_law(const ModelLaw& table, int elements) {
  if (table.columns != sampled_columns) refuse("other columns than a sampled law has", "element, row, xx, ...");
  std::vector<StrainSamples> samples{std::size_t(elements)};
  for (const std::vector<double>& row : table.rows) {
    const int e = int(row[0]);
    if (e < 0 || e >= elements) refuse(fmt::format("element {}", e), fmt::format("0..{}", elements - 1));
    StrainSamples& s = samples[std::size_t(e)];
    const Eigen::Vector2d value(row[8], row[9]);
    switch (Row(int(row[1]))) {
      case Row::Constant:
        s.constant = value;
        break;
      case Row::Least:
        s.least = value;
        break;
      case Row::Most:
        s.most = value;
        break;
      case Row::Sample:
        s.strains.emplace_back(Eigen::Map<const Strain6>(row.data() + 2));
        s.weights.push_back(value);
        break;
      default:
        refuse(fmt::format("a row of kind {}", row[1]), "0..3");
    }
  }
  return std::make_shared<SampledLaw>(std::move(samples), table.metric_nu);
}

}  // namespace

ModelLaw model_law(const MaterialLaw& law) {
  if (const auto* sampled = dynamic_cast<const SampledLaw*>(&law)) return sampled_table(*sampled);
  const auto& tabulated = dynamic_cast<const TabulatedLaw&>(law);
  ModelLaw table{law.name(), {"element"}, {}, 0.0};
  for (const std::string& name : law.parameter_names()) table.columns.push_back(name);
  for (Eigen::Index e = 0; e < tabulated.table().rows(); ++e) {
    std::vector<double> row = {double(e)};
    for (Eigen::Index k = 0; k < tabulated.table().cols(); ++k) row.push_back(tabulated.table()(e, k));
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::shared_ptr<const MaterialLaw> make_law(const ModelLaw& law, int elements) try {
  if (law.name == "sampled") return sampled_law(law, elements);
  if (law.name != "ogden" && law.name != "neo_hookean" && law.name != "linear")
    refuse("the law \"" + law.name + "\"", "ogden, neo_hookean, linear or sampled");
  if (int(law.rows.size()) != elements)
    refuse(fmt::format("{} rows", law.rows.size()), fmt::format("one for each of {} elements", elements));
  MatrixX table(elements, Eigen::Index(law.columns.size()) - 1);
  for (int e = 0; e < elements; ++e)
    for (Eigen::Index k = 0; k < table.cols(); ++k) table(e, k) = law.rows[std::size_t(e)][std::size_t(k) + 1];
  if (law.name == "linear") return std::make_shared<LinearLaw>(std::move(table));
  if (law.name == "neo_hookean") return std::make_shared<NeoHookeanLaw>(std::move(table));
  return std::make_shared<OgdenLaw>(std::move(table));
} catch (const std::invalid_argument& error) {
  refuse(error.what(), "the parameters of a material");
}

std::shared_ptr<const MaterialLaw> law_of(const Model& model, const Body& body) {
  if (model.law) return make_law(*model.law, body.element_count());
  MatrixX table(body.element_count(), 2);
  const bool is_neo_hookean = model.volume.kind == VtuCell::Hexahedron && !model.is_corotated;
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
