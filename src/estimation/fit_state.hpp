#pragma once

#include <filesystem>
#include <string>

#include "estimation/fit.hpp"

namespace pliant {

/// Writes where a fit stands, whole or not at all. `key` names the capture and the options that it belongs to.
void write_fit_state(const std::filesystem::path& path, const FitState& state, const std::string& key);

/// What such a file holds, as read from `path`. Throws InputError where it is damaged or belongs to another capture or
/// other options.
FitState to_fit_state(const std::string& text, const std::filesystem::path& path, const std::string& key);

}  // namespace pliant
