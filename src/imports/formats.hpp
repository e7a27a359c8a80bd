#pragma once

#include <string>
#include <vector>

#include "imports/recording.hpp"

namespace pliant {

/// A format that `pliant import` reads: see docs/imports.md for what each holds.
struct ImportFormat {
  std::string name;  ///< after `--from`
  std::string what;  ///< the program or sensor, in words
  /// Whether a file or folder looks like this format; never throws.
  bool (*recognises)(const std::filesystem::path& source);
  /// Reads what is needed to describe the recording; images are read later. Throws InputError for what cannot be used.
  ImportedRecording (*read)(const std::filesystem::path& source, const ImportOptions& options);
};

/// All formats, the more particular ones first.
const std::vector<ImportFormat>& import_formats();

/// The format of a source: by name, or, with an empty name, the first that recognises it.
/// Throws InputError for a source that is not there, a name that is none, and where no format recognises the source.
const ImportFormat& import_format(const std::string& name, const std::filesystem::path& source);

/// @name Readers and recognisers of the formats
/// @{
bool is_image_folder(const std::filesystem::path& source);
ImportedRecording read_image_folder(const std::filesystem::path& source, const ImportOptions& options);
bool is_redwood_folder(const std::filesystem::path& source);
ImportedRecording read_redwood_folder(const std::filesystem::path& source, const ImportOptions& options);
bool is_tum_folder(const std::filesystem::path& source);
ImportedRecording read_tum_folder(const std::filesystem::path& source, const ImportOptions& options);
bool is_ros1_bag(const std::filesystem::path& source);
ImportedRecording read_ros1_bag(const std::filesystem::path& source, const ImportOptions& options);
bool is_ros2_bag(const std::filesystem::path& source);
ImportedRecording read_ros2_bag(const std::filesystem::path& source, const ImportOptions& options);
bool is_record3d(const std::filesystem::path& source);
ImportedRecording read_record3d(const std::filesystem::path& source, const ImportOptions& options);
bool is_stray_scanner(const std::filesystem::path& source);
ImportedRecording read_stray_scanner(const std::filesystem::path& source, const ImportOptions& options);
bool is_c3d(const std::filesystem::path& source);
ImportedRecording read_c3d_markers(const std::filesystem::path& source, const ImportOptions& options);
bool is_marker_csv(const std::filesystem::path& source);
ImportedRecording read_marker_csv(const std::filesystem::path& source, const ImportOptions& options);
bool is_machine_csv(const std::filesystem::path& source);
ImportedRecording read_machine_csv(const std::filesystem::path& source, const ImportOptions& options);
bool is_matroska(const std::filesystem::path& source);
ImportedRecording read_matroska(const std::filesystem::path& source, const ImportOptions& options);
bool is_video(const std::filesystem::path& source);
ImportedRecording read_video(const std::filesystem::path& source, const ImportOptions& options);
bool is_weiss_folder(const std::filesystem::path& source);
ImportedRecording read_weiss_folder(const std::filesystem::path& source, const ImportOptions& options);
/// @}

}  // namespace pliant
