#pragma once

#include <memory>
#include <vector>

#include "capture/capture.hpp"
#include "capture/observe.hpp"
#include "estimation/objective.hpp"

namespace pliant {

/// How finely the body and its motion are resolved.
struct Resolution {
  double cells = 12.0;   ///< along the object's longest axis
  double steps = 1.0;    ///< time steps per default step: 2 halves the step
  double band = 0.15;    ///< of the mismatch, times the object's longest axis
};

/// A recording made ready for simulation at one resolution.
struct Discretisation {
  std::shared_ptr<const SignedDistance> distance;
  std::shared_ptr<const Body> body;
  std::shared_ptr<const SurfaceConstraints> constraints;  ///< null where nothing was observed
  SimulationOptions simulation;
};

/// Longest edge of the surface's box [m].
double object_size(const Capture& capture);

/// Signed distance of the capture's surface, fine enough for every resolution.
/// Throws InputError where the capture has no surface.
std::shared_ptr<const SignedDistance> capture_distance(const Capture& capture, double band);

/// Body, scene and constraints of a capture. `theta` gives the weight and gravity that contact is scaled by.
Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          const Resolution& resolution, const VectorX& theta, const SimulationOptions& settings = {});

/// All parameters of a capture with their start values, bounds and priors. What the capture leaves unknown is
/// estimated: always stiffness and both dampings, Poisson's ratio under a prior, and gravity, velocities or planes that
/// it does not give.
/// @param volume  of the object [m^3], for the density that belongs to a mass
ParameterSet default_parameters(const Capture& capture, double volume);

/// Observations of the frames from the start on, numbered from it.
std::vector<FrameObservations> frame_observations(const Capture& capture, const std::vector<ObservedFrame>& observed);

}  // namespace pliant
