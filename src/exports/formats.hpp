#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "exports/export_model.hpp"

namespace pliant {

/// Frames done and their total; false stops.
using ExportProgress = std::function<bool(int done, int total)>;

/// A format that models are written in: their elements, or the surface as it moves.
struct ExportFormat {
  std::string name;      ///< as `--to` takes it
  std::string program;   ///< that reads it
  bool takes_quadratic;  ///< elements; else linear ones alone
  /// Writes elements into a folder and returns the files' names; null: the format is one of surfaces.
  std::vector<std::string> (*write)(const ExportModel& model, const std::filesystem::path& folder);
  /// Simulates the model as its recording was and writes its surface in every frame; returns the files' names. Writes
  /// nothing and returns none where `progress` stopped it. Throws std::runtime_error where it cannot be simulated.
  std::vector<std::string> (*write_surface)(const Model& model, const std::filesystem::path& folder,
                                            const ExportProgress& progress) = nullptr;
};

const std::vector<ExportFormat>& export_formats();

/// By its name. Throws InputError with those that there are.
const ExportFormat& export_format(const std::string& name);

/// Writes a model in a format, `export.json`: elements, what moduli were multiplied by, frequencies and sag of the
/// model and of what was written, so that the other program can be checked (docs/exports.md); and `card.json`
/// (`card_of`).
/// @param result  `result.json` of the fit, where it is known
/// Returns the names of the files. Throws InputError where a file cannot be written, or the result not be read.
std::vector<std::string> write_export(ExportModel model, const ExportFormat& format,
                                      const std::filesystem::path& folder,
                                      const std::optional<std::filesystem::path>& result = std::nullopt);

// The formats, each in a file of its own.
std::vector<std::string> write_calculix(const ExportModel& model, const std::filesystem::path& folder);
std::vector<std::string> write_febio(const ExportModel& model, const std::filesystem::path& folder);
std::vector<std::string> write_gltf(const Model& model, const std::filesystem::path& folder,
                                    const ExportProgress& progress);
std::vector<std::string> write_gmsh(const ExportModel& model, const std::filesystem::path& folder);
std::vector<std::string> write_mujoco(const ExportModel& model, const std::filesystem::path& folder);
std::vector<std::string> write_newton(const ExportModel& model, const std::filesystem::path& folder);
std::vector<std::string> write_obj_frames(const Model& model, const std::filesystem::path& folder,
                                          const ExportProgress& progress);
std::vector<std::string> write_ply_frames(const Model& model, const std::filesystem::path& folder,
                                          const ExportProgress& progress);
std::vector<std::string> write_sofa(const ExportModel& model, const std::filesystem::path& folder);
std::vector<std::string> write_usd(const ExportModel& model, const std::filesystem::path& folder);
std::vector<std::string> write_vtu_frames(const Model& model, const std::filesystem::path& folder,
                                          const ExportProgress& progress);

}  // namespace pliant
