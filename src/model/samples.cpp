#include "model/samples.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <set>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "scene/toml_table.hpp"

namespace pliant {

namespace {

constexpr std::array names = {"youngs_modulus", "poissons_ratio", "mass_damping", "stiffness_damping"};
constexpr double least_ratio = -1.0, greatest_ratio = 0.5;  // Poisson's

/// To where a parameter has no bounds, and back.
double unbounded(std::size_t k, double value) {
  return k == 1 ? std::log((value - least_ratio) / (greatest_ratio - value)) : std::log(value);
}
double bounded(std::size_t k, double x) {
  return k == 1 ? least_ratio + (greatest_ratio - least_ratio) / (1.0 + std::exp(-x)) : std::exp(x);
}

/// A value and its interval, for a normal number.
struct Quantiles {
  double value = 0.0, low = 0.0, high = 0.0;
  bool varies = false;

  double at(std::size_t k, double z) const {
    constexpr double of_90_percent = 1.6449;
    if (!varies) return value;
    const double end = unbounded(k, z < 0.0 ? low : high), middle = unbounded(k, value);
    return bounded(k, middle + std::abs(z) / of_90_percent * (end - middle));
  }
};

/// Of a value and its 90 % interval, where a normal number can have them.
Quantiles quantiles_of(std::size_t k, double value, const std::pair<double, double>& interval) {
  Quantiles q{value, interval.first, interval.second};
  const double tiny = 1e-6 * q.high;  // of a damping whose interval begins at nothing
  if (k >= 2) q.low = std::max(q.low, tiny), q.value = std::max(q.value, tiny);
  q.varies = q.low < q.value && q.value < q.high && (k != 1 || (q.low > least_ratio && q.high < greatest_ratio));
  return q;
}

/// The value of a scalar of the result; zero where there is none.
double value_of(const ParameterResult* p) {
  return p && std::holds_alternative<double>(p->value) ? std::get<double>(p->value) : 0.0;
}

Quantiles posterior_of(const Result& result, std::size_t k) {
  const ParameterResult* p = result.find(names[k]);
  if (!p || !p->estimated || !p->interval_90) return {value_of(p)};
  return quantiles_of(k, value_of(p), *p->interval_90);
}

Quantiles prior_of(const Result& result, std::size_t k, const std::filesystem::path& file) {
  const ParameterResult* p = result.find(names[k]);
  if (!p || !p->estimated) return {value_of(p)};
  if (!p->prior)
    throw InputError({{file},
                      std::string("the result states no prior of ") + names[k],
                      "a fit that chose one, by a program that states it",
                      std::string("fit with `--set ") + names[k] + ".start=VALUE --set " + names[k] +
                          ".prior_std=0.5`, or draw from `posterior`, or from a CSV file of your own"});
  return quantiles_of(k, std::get<double>(p->prior->median), *p->prior->interval_90);
}

/// Of the numbers that are drawn, by name.
MatrixX correlations_of(const Result& result) {
  const auto n = Eigen::Index(names.size());
  MatrixX correlations = MatrixX::Identity(n, n);
  const auto number = [](const std::string& name) { return std::ranges::find(names, name) - names.begin(); };
  for (const CorrelationResult& c : result.identifiability) {
    const auto a = number(c.parameters.first), b = number(c.parameters.second);
    if (a < n && b < n) correlations(a, b) = correlations(b, a) = c.correlation;
  }
  return correlations;
}

using AllQuantiles = std::array<Quantiles, names.size()>;

/// @param factor  of the correlations: lower triangular
std::vector<DrawnMaterial> drawn(const AllQuantiles& quantiles, const MatrixX& factor, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<DrawnMaterial> samples;
  for (int i = 0; i < count; ++i) {
    VectorX z(factor.rows());
    for (double& value : z) value = normal(random);
    z = (factor.triangularView<Eigen::Lower>() * z).eval();
    const auto at = [&](std::size_t k) { return quantiles[k].at(k, z[Eigen::Index(k)]); };
    samples.push_back({at(0), at(1), at(2), at(3)});
  }
  return samples;
}

}  // namespace

std::vector<DrawnMaterial> posterior_samples(const Result& result, int count, unsigned seed,
                                             const std::filesystem::path& file) {
  AllQuantiles quantiles;
  for (std::size_t k = 0; k < names.size(); ++k) quantiles[k] = posterior_of(result, k);
  if (!quantiles[0].varies)
    throw InputError({{file},
                      "the result states no interval of Young's modulus",
                      "a fit that came to its end and estimated it",
                      "go on with `pliant fit ... --resume`"});
  // Rounded correlations may make a matrix that is not quite one of correlations.
  const MatrixX correlations = 0.999 * correlations_of(result) + 0.001 * MatrixX::Identity(4, 4);
  const Eigen::LLT<MatrixX> factor(correlations);
  if (factor.info() != Eigen::Success)
    throw InputError({{file}, "the result's correlations contradict each other", "those that `pliant fit` wrote", ""});
  return drawn(quantiles, factor.matrixL(), count, seed);
}

std::vector<DrawnMaterial> prior_samples(const Result& result, int count, unsigned seed,
                                         const std::filesystem::path& file) {
  AllQuantiles quantiles;
  for (std::size_t k = 0; k < names.size(); ++k) quantiles[k] = prior_of(result, k, file);
  return drawn(quantiles, MatrixX::Identity(4, 4), count, seed);
}

Model with_material(Model model, const DrawnMaterial& sample) {
  const double ratio = sample.youngs_modulus / model.youngs_modulus;
  model.youngs_modulus = sample.youngs_modulus;
  for (double& modulus : model.volume.youngs_modulus) modulus *= ratio;
  model.poissons_ratio = sample.poissons_ratio;
  std::ranges::fill(model.volume.poissons_ratio, sample.poissons_ratio);
  model.mass_damping = sample.mass_damping, model.stiffness_damping = sample.stiffness_damping;
  return model;
}

DrawnMaterial material_of(const Model& model) {
  return {model.youngs_modulus, model.poissons_ratio, model.mass_damping, model.stiffness_damping};
}

std::array<double, 4> numbers_of(const DrawnMaterial& m) {
  return {m.youngs_modulus, m.poissons_ratio, m.mass_damping, m.stiffness_damping};
}

const std::array<std::string, 4> material_columns = {"youngs_modulus [Pa]", "poissons_ratio [1]", "mass_damping [1/s]",
                                                     "stiffness_damping [s]"};

namespace {

/// Where a table has each number of a material; -1: nowhere.
using Columns = std::array<int, names.size()>;

/// A name of a column without its unit.
std::string bare(const std::string& column) { return column.substr(0, column.find(" [")); }

/// Finds the columns of a material. Of others, those that may be meant as one of them are complained about.
Columns columns_in(const std::filesystem::path& path, const std::vector<std::string>& header,
                   std::vector<Problem>& problems) {
  Columns columns;
  columns.fill(-1);
  const std::set<std::string> known(names.begin(), names.end());
  const std::size_t before = problems.size();
  for (std::size_t i = 0; i < header.size(); ++i) {
    const std::string name = bare(header[i]);
    const std::string meant = known.contains(name)                  ? name
                              : name.find(' ') == std::string::npos ? nearest_name(name, known)
                                                                    : std::string();
    if (meant.empty()) continue;
    const auto k = std::size_t(std::ranges::find(names, meant) - names.begin());
    if (header[i] != material_columns[k])
      problems.push_back({{path, 1, 1}, "the column `" + header[i] + "`", "`" + material_columns[k] + "`", ""});
    else if (columns[k] >= 0)
      problems.push_back({{path, 1, 1}, "the column `" + header[i] + "` twice", "each column once", ""});
    columns[k] = int(i);
  }
  if (problems.size() == before && std::ranges::all_of(columns, [](int column) { return column < 0; }))
    problems.push_back({{path, 1, 1},
                        "no column of a material",
                        "some of `" + material_columns[0] + "`, `" + material_columns[1] + "`, `" +
                            material_columns[2] + "`, `" + material_columns[3] + "`",
                        "name the columns so, with their units"});
  return columns;
}

/// Whether the k-th number of a material may be so large, and which may.
bool is_in_range(std::size_t k, double value) {
  return k == 0 ? value > 0.0 : k == 1 ? value > least_ratio && value < greatest_ratio : value >= 0.0;
}
constexpr std::array ranges = {"a number above 0", "a number between -1 and 0.5", "a number from 0", "a number from 0"};

}  // namespace

std::vector<DrawnMaterial> read_materials(const std::filesystem::path& path, const DrawnMaterial& otherwise) {
  std::vector<Problem> problems;
  std::vector<DrawnMaterial> materials;
  Columns columns{};
  read_csv(
      path,
      [&](const std::vector<std::string>& header) {
        const std::size_t before = problems.size();
        columns = columns_in(path, header, problems);
        return problems.size() == before;
      },
      problems,
      [&](CsvRow& row) {
        std::array<double, names.size()> numbers = numbers_of(otherwise);
        for (std::size_t k = 0; k < names.size(); ++k) {
          if (columns[k] < 0) continue;
          const auto column = std::size_t(columns[k]);
          const std::optional<double> value = row.number(column);
          if (!value) continue;
          if (!is_in_range(k, *value)) row.complain(column, row.raw(column), ranges[k]);
          numbers[k] = *value;
        }
        materials.push_back({numbers[0], numbers[1], numbers[2], numbers[3]});
      });
  if (!problems.empty()) throw InputError(std::move(problems));
  return materials;
}

}  // namespace pliant
