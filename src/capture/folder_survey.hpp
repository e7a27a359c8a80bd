#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/image_io.hpp"

namespace pliant {

/// Files of one name but for a number, such as depth_0012.png.
struct NumberedFiles {
  std::string pattern;             ///< with one %d, relative to the folder, like "depth/frame_%04d.png"
  std::vector<long long> numbers;  ///< growing
  ImageHeader header;              ///< of the first; of images alone
  int first() const { return int(numbers.front()); }
  int count() const { return int(numbers.size()); }
  /// Whether the files are numbered from 0 without gaps, as the frames of a capture are.
  bool count_from_zero() const { return first() == 0 && numbers.back() + 1 == count(); }
};

/// What lies in a folder without a capture.toml that a capture could be made of. Paths are relative to the folder.
struct FolderSurvey {
  std::vector<NumberedFiles> depth;                  ///< 16-bit grey images, most files first
  std::vector<NumberedFiles> pictures;               ///< images of 8 bits: colour, masks, or depth that was painted
  std::vector<NumberedFiles> clouds;                 ///< PLY or PCD
  std::vector<std::filesystem::path> surfaces;       ///< closed meshes
  std::vector<std::filesystem::path> open_surfaces;  ///< meshes with holes
  bool has_frames() const { return !depth.empty() || !pictures.empty() || !clouds.empty(); }
};

/// Looks into a folder and the folders in it, two deep. Files that cannot be read are passed over.
/// @param with_surfaces  false: meshes are not read
/// Throws InputError where it is no folder.
FolderSurvey survey_folder(const std::filesystem::path& folder, bool with_surfaces = true);

}  // namespace pliant
