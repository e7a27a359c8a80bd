#pragma once

#include "estimation/damped_sinusoid.hpp"
#include "estimation/mode_coordinates.hpp"
#include "estimation/problem.hpp"

namespace pliant {

struct ModalStartOptions {
  int modes = 8;                                          ///< lowest vibrations that are looked for, >= 1
  int first_frame = 0;                                    ///< from which the object moves freely, but for what is held
  double least_modulus = 1e3, most_modulus = 1e8;         ///< where moduli are sought [Pa]
  ModeProjection projection = ModeProjection::Automatic;  ///< see `TrackedMotion`
  int curve_samples = 50;                                 ///< of `MatchCurve`; 0: no curves
};

/// One of the body's vibrations, as seen and as the found moduli have it.
struct ObservedMode {
  int mode = 0;                     ///< from 0, the lowest vibration about rest for equal moduli
  bool is_used = false;             ///< in the match
  std::string reason;               ///< why not, in words
  double observed_frequency = 0.0;  ///< [Hz], as it would be without damping
  double modelled_frequency = 0.0;  ///< [Hz], at the found moduli
  double relative_deviation = 0.0;  ///< standard deviation of the observed frequency [-]
  double damping_ratio = 0.0;       ///< observed [-]
  double energy = 0.0;              ///< at the first instant, share of all used modes' [-]
  double weight = 0.0;              ///< in the match; all sum to one
};

/// How well the frequencies match over one control modulus, all others as found (Wang 2015, fig. 7).
struct MatchCurve {
  int control = 0;
  VectorX moduli;    ///< [Pa], evenly spaced in the logarithm
  VectorX mismatch;  ///< sum_j weight_j ln^2(modelled_j / observed_j) [-]; not a number where modes were not found
};

/// Where a fit of stiffness may begin.
struct ModalStart {
  bool found = false;
  std::string reason;  ///< why nothing was found; else what is uncertain about it, or empty
  VectorX moduli;      ///< control moduli [Pa]
  /// Standard deviations of ln moduli: by the frequencies' and the model's errors, and the pull towards equal ones. A
  /// modulus that hardly shows in the frequencies has one near two.
  VectorX log_deviations;
  double mismatch = 0.0;                               ///< as in `MatchCurve`
  double mass_damping = 0.0, stiffness_damping = 0.0;  ///< Rayleigh's [1/s], [s], >= 0
  bool dampings_are_told_apart = false;  ///< by two modes' decays; else each has half of the strongest mode's
  std::vector<ObservedMode> modes;
  std::vector<MatchCurve> curves;
  ModeCoordinates coordinates;    ///< of the vibrations at the found moduli, for plots
  double largest_rotation = 0.0;  ///< of any part of the body [rad]; 0 where too few points are seen to tell
};

/// Warm start from modal analysis (Wang 2015, section 6.3): the control moduli for which the body vibrates as fast as
/// followed points do.
///
/// The points' motion is projected on the body's vibrations about rest (`TrackedMotion`). In each coordinate the
/// strongest oscillation is looked for where the strongest one of all leads to expect it, with what it takes up of
/// stronger modes' oscillations fitted along. For one modulus lambda is proportional to E and the match is closed form;
/// for several it is Gauss and Newton's method in all ln E_k at once with the eigenvalues' derivatives, where the paper
/// goes through them one after the other. Shapes depend on the moduli's ratios, so projection and match are repeated
/// until the moduli stay: from equal ones, and from each in turn stiffer than the rest. The best match with the most
/// vibrations counts. Where there are fewer oscillations than moduli, a weak pull towards equal ones decides.
///
/// Modes count by how well their frequency is known (its deviation beside the sinusoid, which falls with the square
/// root of the energy) and by a model error of 2 %, so that no strong mode drowns out all others.
///
/// The frequencies are those about the shape at rest, without load: an object that sags or swings far stiffens or
/// softens, which a start may neglect and a fit must not. Nodes are held as with `hold_strongly`.
///
/// @param theta    Poisson's ratio and density count; the moduli do not matter, gravity and dampings neither
/// @param held     nodes that do not move; none: rigid motion is taken out of the points' first
/// @param tracked  frames number `times`; frames without observations are left out
/// Throws InputError for options and arguments that cannot be. Where nothing oscillates the result says so.
ModalStart modal_start(std::shared_ptr<const Body> body, const MotionBlocks& blocks, const VectorX& theta,
                       const std::vector<int>& held, const TrackedPoints& tracked, const std::vector<double>& times,
                       const ModalStartOptions& options = {});

}  // namespace pliant
