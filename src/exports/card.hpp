#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "exports/export_model.hpp"

namespace pliant {

/// What someone who is handed an exported model must know of it, JSON by docs/card.schema.json ("card/1"): values with
/// deviations and intervals, verdict, the hash of the recording, the strains and rates it was fitted at, how the
/// exported model differs from the fitted one, and how that was tested. SI units.
/// @param to      the format's name
/// @param result  `result.json` of the fit; nothing: what was fitted is not known, and the card says so
/// Throws InputError where the result cannot be read.
std::string card_of(const ExportModel& model, const std::string& to,
                    const std::optional<std::filesystem::path>& result);

}  // namespace pliant
