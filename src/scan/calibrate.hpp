#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "capture/capture.hpp"

namespace pliant {

/// One depth camera after its calibration, and how well it agrees with the others.
struct SensorCalibration {
  std::string name;
  RigidMotion camera_to_world;
  LensDistortion lens;
  double time_offset = 0.0;  ///< [s]

  double turned = 0.0;                       ///< [rad] angle of the correction of its pose
  double moved = 0.0;                        ///< [m] how far the correction moves the middle of what it saw
  double turn_std = 0.0, shift_std = 0.0;    ///< [rad], [m] standard deviations of its pose, the worst direction
  std::optional<double> time_offset_std;     ///< [s]; nothing: not told, kept as the capture has it
  bool lens_is_found = false;                ///< k1 and k2; else kept as the capture has them
  double k1_std = 0.0;                       ///< [-] where they were found
  double rms_before = 0.0, rms_after = 0.0;  ///< [m] of its centres from the reference's path, or points from the scan
  int count = 0;                             ///< of centres, or points
  bool is_reference = false;                 ///< defines the world: nothing of it but its lens is changed
};

struct CalibrationOptions {
  std::string reference;          ///< camera whose pose and clock are kept, of a ball; empty: the one that sees most
  bool finds_lenses = true;       ///< k1 and k2 too, where the data tell them
  std::optional<int> last_frame;  ///< of the object at rest; nothing: `start_frame`, of a static capture the last
};

/// Poses, time offsets and lenses of the depth cameras from a ball of known radius that was moved about before them.
/// Each frame of each camera gives the ball's centre (`find_ball`); centres of a camera, at its frames' times plus its
/// offset, are to lie on the path of the reference's, a cubic between its centres. Least squares with Tukey's weights
/// from the best of many offsets, each with its rotation by Kabsch 1976.
/// @param radius  of the ball [m], > 0
/// Throws InputError where there are fewer than two depth cameras, the ball is seen in fewer than six common frames, or
/// its centres do not span the space that a pose takes.
[[nodiscard]] std::vector<SensorCalibration> calibrate_by_ball(const Capture& capture, double radius,
                                                               const CalibrationOptions& options = {});

/// Poses and lenses of the depth cameras from the object at rest: what each sees is moved onto the scan, least squares
/// of signed distances with Geman and McClure's weights (point to plane; Chen and Medioni 1992).
/// Throws InputError where there is no scan, the object is not at rest where it was scanned, or its shape leaves a
/// camera's pose free, as that of a ball does.
[[nodiscard]] std::vector<SensorCalibration> calibrate_by_object(const Capture& capture,
                                                                 const CalibrationOptions& options = {});

/// A capture with calibrated cameras in the place of those of the same names, their poses known as well as was found:
/// those of a ball against the reference's, whose own against the scan stays as it was stated.
/// Throws InputError where a name is not in the capture.
[[nodiscard]] Capture with_calibration(Capture capture, const std::vector<SensorCalibration>& sensors);

}  // namespace pliant
