#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimation/fit.hpp"

namespace pliant {

/// One choice of a fit, as help, documentation and error messages know it.
struct FitKey {
  std::string name, type, unit, standard, range, sentence;
};

/// All keys, in the order of their importance. Parameters have keys of their own: see `parameter_key_help`.
const std::vector<FitKey>& fit_keys();
std::string parameter_key_help();

/// Sets one key from "key=value" (the form of `--set`). Parameters: "youngs_modulus=5000" is a start value,
/// "poissons_ratio.estimate=false" a choice, "density.prior_std=0.1" a prior's width.
/// Throws InputError for an unknown key (with the nearest known one) or a value of another type.
void set_fit_option(FitOptions& options, const std::string& assignment);

/// Applies the options' choices of parameters. "range_error" stands for those of all sensors, and so do names without
/// the "[2]" of a recording. A start with the width of a prior moves the prior there.
/// Throws InputError for a parameter that is not there, and for a start that does not suit it.
void apply_overrides(ParameterSet& parameters, const FitOptions& options);

/// Reads a configuration (TOML) over the options. Throws InputError with every problem found and its place.
void read_fit_options(const std::filesystem::path& path, FitOptions& options);

/// A sentence for each choice that differs from the standard and that a fit of what the captures hold does not ask for.
/// @param has_motion   whether it compares motions or equilibria of the object
/// @param has_presses  whether it compares presses with known force
std::vector<std::string> unused_choices(const FitOptions& options, bool has_motion, bool has_presses);

/// Key by key what `--set` would be given, the values as JSON and TOML write them: of all keys or of those alone that
/// differ from the standard, and of what is chosen of parameters.
std::vector<std::pair<std::string, std::string>> written_choices(const FitOptions& options, bool standard_too);

/// The options as TOML that `read_fit_options` reads back.
std::string to_toml(const FitOptions& options);

}  // namespace pliant
