#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/result.hpp"

namespace pliant {

/// A material out of what a fit leaves open.
struct DrawnMaterial {
  double youngs_modulus = 0.0;     ///< [Pa]; where it varies, what all moduli are scaled by is its ratio to the fit's
  double poissons_ratio = 0.0;     ///< [-]
  double mass_damping = 0.0;       ///< [1/s]
  double stiffness_damping = 0.0;  ///< [s]
};

/// Materials drawn from a fit's result: normal numbers, correlated as the result says, each mapped so that the value is
/// the median and 90 % lie in its stated interval; modulus and dampings by their logarithm, Poisson's ratio by the
/// logit of its way from -1 to 0.5. What was given stays. The same seed gives the same materials.
/// The first ones are the same for every count.
/// @param file  of the result, for complaints
/// Throws InputError where the result states no interval of Young's modulus.
std::vector<DrawnMaterial> posterior_samples(const Result& result, int count, unsigned seed = 1,
                                             const std::filesystem::path& file = {});

/// The same from what the fit held likely before it saw the recording, by the medians and 90 % intervals of its priors;
/// independent of each other.
/// Throws InputError where something was estimated without a prior, as Young's modulus is where no fit chose one.
std::vector<DrawnMaterial> prior_samples(const Result& result, int count, unsigned seed = 1,
                                         const std::filesystem::path& file = {});

/// The model of that material: moduli of all elements are scaled alike.
Model with_material(Model model, const DrawnMaterial& sample);
/// The material of a model; of one whose modulus varies, the mean.
DrawnMaterial material_of(const Model& model);

/// Numbers of a material in the order of `material_columns`.
std::array<double, 4> numbers_of(const DrawnMaterial& material);
/// Names with units as columns of tables have them: "youngs_modulus [Pa]".
extern const std::array<std::string, 4> material_columns;

/// Materials of the rows of a CSV file, whose columns are some of `material_columns`, in any order; others are passed
/// over, so that tables of drawn materials, of batches and of ensembles will do.
/// @param otherwise  what the file has no column for
/// Throws InputError with every problem: none of the columns, one without its unit or misspelt, numbers that are not
/// finite or out of range.
std::vector<DrawnMaterial> read_materials(const std::filesystem::path& path, const DrawnMaterial& otherwise);

}  // namespace pliant
