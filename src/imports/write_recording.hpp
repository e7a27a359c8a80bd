#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "imports/recording.hpp"

namespace pliant {

/// What a capture says beside a recording, and which of its images it takes.
struct CaptureFacts {
  std::optional<std::filesystem::path> surface;  ///< the scan at rest; copied into the capture's folder
  std::optional<double> mass, density;           ///< [kg], [kg/m^3]; one of them at most
  std::optional<Vector3> up;  ///< away from the ground; nothing: what the recording tells, else a guess
  int first = 0;              ///< image that becomes frame 0
  std::optional<int> last;    ///< last image; nothing: all
  int every = 1;              ///< images taken: every n-th from the first

  /// @name Of a test in a machine
  /// @{
  std::optional<double> length, area;  ///< [m], [m^2] of the specimen at rest, for a stress-strain curve of forces
  bool is_compression = false;         ///< the specimen is compressed, whatever the signs of extensions and forces
  bool is_tension = false;             ///< it is pulled, likewise
  std::vector<std::string> kept;       ///< what stays as recorded: "force-zero", "extension-zero", "break"
  std::optional<IndenterShape> probe;  ///< an indenter: a force-depth curve
  double probe_radius = 0.0;           ///< [m]
  std::optional<Vector3> contact;      ///< [m] point of the surface that the indenter touches first
  std::optional<double> force_std;     ///< [N]; nothing: what the curve shows, see first_loading.hpp
  /// @}
};

/// A capture made of a recording.
struct ImportedCapture {
  Capture capture;                 ///< as written
  std::vector<std::string> notes;  ///< what a user should know, a sentence each
};

/// Writes a capture: NAME/%06d.png of each sensor (16-bit, raw units as recorded; of a video masks, with
/// masks_overview.png, in which their outlines are drawn over twelve pictures), markers, curves, and capture.toml last.
/// Frames are those of the first sensor; others give the image that is nearest in time, and the median of how much
/// later that is becomes their `time_offset`. A camera that moves along gets NAME/poses.csv.
/// @param progress  called with the number of images written and their total; may be empty, and may throw
/// Throws InputError for a folder that holds a capture already, facts that contradict each other, images that do not
/// exist, and whatever the recording's images do.
ImportedCapture write_recording(const std::filesystem::path& out, const ImportedRecording& recording,
                                const CaptureFacts& facts, const std::function<void(int, int)>& progress = {});

}  // namespace pliant
