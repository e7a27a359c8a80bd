#pragma once

#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "capture/observe.hpp"
#include "estimation/motion_trial.hpp"
#include "geometry/signed_distance.hpp"

namespace pliant {

/// Thousands of readings fix a visible plane; what is left is the sensor's bias and the softness of contact, about this
/// part of the object's size, and as many radians.
constexpr double seen_plane_std = 0.003;

/// How well the pose of each sensor of `sensor_names` is known; zero where it is taken as exact.
std::vector<PoseStd> pose_stds(const Capture& capture);

/// Whether the pose of some sensor, or what its readings err by together, is an unknown of a fit.
bool estimates_sensors(const Capture& capture);

/// Whether the object stands as it was scanned when its motion begins: its shape then is known, whatever it is made of.
bool starts_as_scanned(const Scene& scene);

/// What tells sensors' poses before anything moves: the planes of the scene as each sensor saw them. A plane whose
/// place is known fixes three of a pose's six numbers; one that is known roughly moves with the pose of who saw it.
/// @param notes  what the user should know is added: planes seen where no error of a pose brings them from
[[nodiscard]] std::vector<PlaneObservation> planes_seen(const Capture& capture, std::vector<std::string>& notes);

/// The first frame from which on, to the start, the object stood still in the pose of its scan; `start_frame` where
/// there is none before. A frame belongs to them while one Gauss-Newton step of its points onto the scan (point to
/// plane; Chen and Medioni 1992) leads where that of the start frame leads.
/// @param distance  of the scan
[[nodiscard]] int first_frame_at_rest(const Capture& capture, const std::vector<ObservedFrame>& observed,
                                      const SignedDistance& distance);

}  // namespace pliant
