#pragma once

#include <array>
#include <optional>
#include <vector>

#include "capture/capture.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"

namespace pliant {

/// Standard deviations from the ground's plane within which a reading does not tell the object.
inline constexpr double scan_plane_reach = 3.5;

/// Which frames and which object a scan is made of.
struct ScanChoice {
  std::optional<int> last_frame;            ///< nothing: the frame before `start_frame`, 0 at least; static: the last
  std::optional<std::array<int, 2>> pixel;  ///< column, row of the first camera, on the object; only without masks
  bool floating = false;                    ///< the object stands on no plane
};

/// What one camera saw of an object at rest, the mean of several frames.
struct ScanView {
  PinholeCamera camera;
  DepthNoise noise;
  DepthImage depth;                ///< [m] readings on the object's surface, flying pixels removed; else 0
  Image<std::uint8_t> silhouette;  ///< 255 inside the object's outline, also where nothing was read
  int frames = 0;                  ///< that took part
  double moved = 0.0;  ///< share of the readings that changed beyond noise from the first frames to the last
};

struct ScanViews {
  std::vector<ScanView> views;  ///< of the cameras that see the object
  std::optional<Plane> plane;   ///< on which it stands; nothing where it is floating
  double plane_rms = 0.0;       ///< [m], of the readings on it; 0 where no reading found it
};

/// Reads the frames in which the object rests: readings averaged per pixel around their median; of the object those of
/// the masks, else the connected part at `choice.pixel`, else the largest one that stands on a plane. The plane is the
/// capture's first [[plane]], refined where it is not `known`, else the largest one within 40 degrees of `up`.
/// Throws InputError where there is no depth camera, a frame is out of range, no plane or no object is found, a mask is
/// empty, or an image cannot be decoded.
[[nodiscard]] ScanViews read_scan_views(const Capture& capture, const ScanChoice& choice = {});

}  // namespace pliant
