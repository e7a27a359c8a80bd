#pragma once

#include <vector>

#include "estimation/followed.hpp"

namespace pliant {

/// Prior deviation of pulls about none, of each axis, in the unit of `Pull`.
inline constexpr double pull_std = 0.5;

/// Where an object was held, in the scan [m]: as few places as the pose asks for in which the tracker registered it.
/// Forces F would have to be added for the body to stay in that pose x; pulls P c in the place of F hold it away from
/// there by K^-1 (P c - F), to first order and with the exact stiffness K at x. Each place is the one of many over the
/// surface that with those before it brings the registered points nearest, until they are as near as they were
/// registered; one more has to pay for its three numbers by Schwarz's criterion (1978). Pulls where nothing holds the
/// object bend what hangs there to the registration's errors, and let it swing from there. None where the stiffness
/// cannot be factorised, or where the pose needs no pulls.
/// @param track  of `held`, from its start parameters
/// @param pose   one of its frames
/// @param seen   marks of the track in that frame
/// @param most   places
std::vector<Vector3> pull_places(const FollowedRecording& held, const Track& track, const TrackedFrame& pose,
                                 const std::vector<TrackObservation>& seen, int most);

}  // namespace pliant
