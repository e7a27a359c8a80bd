#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimation/cost.hpp"
#include "parameters/parameter_set.hpp"

namespace pliant {

/// By how much an estimate would move under another model, or if something that is taken as given were off by its
/// tolerance.
struct ModelShift {
  std::string cause;  ///< for people: "time step", "the pose of front"
  VectorX shift;      ///< of the unconstrained estimate
};

/// What one cause contributes to the deviations of an estimate.
struct UncertaintyShare {
  std::string cause;
  VectorX std;  ///< of each unconstrained coordinate
};

/// Half of the 90 % interval of a normal distribution, in deviations.
inline constexpr double normal_90 = 1.6448536269514722;

/// How sure an estimate is. Unconstrained coordinates throughout.
struct Uncertainty {
  MatrixX covariance;                    ///< noise and models together
  VectorX std, std_noise, std_model;     ///< of each coordinate
  VectorX low, high;                     ///< 90 % interval
  std::vector<UncertaintyShare> budget;  ///< noise first, then the causes of the model's part
};

/// The part of the covariance that noise makes: the sandwich of curvature and scatter of the frames' gradients (Newey
/// and West 1987), never below what the curvature alone gives.
MatrixX noise_covariance(const CostEvaluation& evaluation);

/// Groups of an evaluation's frames that ought to tell the same of one object.
struct FrameGroups {
  std::vector<int> of;  ///< the group of each frame; negative: it is taken along in all
  int count = 0;        ///< fewer than three: they tell nothing
  std::string cause;    ///< for people: what they differ by
};

/// From three recordings on, each of them; else the quarters of each motion: where an object is not what the model
/// says, flight, first touch and rest ask for other parameters, and frames beside each other err together for longer
/// than any correlation of neighbours tells.
/// @param recordings  how many: the trials before that number are one each, those after it (loads, presses) are in no
///                    group
FrameGroups frame_groups(const CostEvaluation& evaluation, int recordings);

/// Covariance of the estimate as groups of frames tell it by where each pulls: the jackknife over groups (Quenouille;
/// Efron 1982), each left out by one Gauss-Newton step of the others. What only the one left out tells, as a
/// recording's own throw, stays where it is.
/// @return  none for fewer than three groups
std::optional<MatrixX> covariance_between(const CostEvaluation& evaluation, const FrameGroups& groups);

/// Puts together what noise and models leave open: covariances add, each alternative model as if the truth lay as
/// likely as not beyond it (GUM, type B); the interval is Student's, with the degrees of freedom of Welch and
/// Satterthwaite.
/// @param evaluation  at the estimate, with derivatives
/// @param shifts      of alternative models and of what is taken as given, one standard deviation each
/// @param floor       deviation of each coordinate that no alternative here accounts for; empty: none
/// @param recordings  of the object: `frame_groups` says of what the differences beyond noise are a cause of their own
Uncertainty uncertainty_of(const CostEvaluation& evaluation, const std::vector<ModelShift>& shifts,
                           const VectorX& floor, int recordings = 1);

/// The situation in which an object was measured.
enum class MeasuredAs {
  MeetingObstacles,  ///< it moves and meets planes
  Free,              ///< it swings or hangs
  Tested,            ///< it is pressed or pulled with known force
};

/// What remains of models whose law and damping are not those of the object, for each unconstrained coordinate:
/// set by the errors of fits to recordings of an independent simulator with neo-Hookean elasticity and Kelvin-Voigt
/// damping of the Green strain; not judged on others yet.
/// Of Poisson's ratio it is the same number whatever its value: near one half it is the more in the logit.
/// @param theta  the estimate
VectorX unmodelled_std(const ParameterSet& parameters, const VectorX& theta, MeasuredAs object);

/// Two-sided 90 % quantile of Student's t, by its expansion about the normal one; within 1 % from two degrees of
/// freedom on.
double t_quantile_90(double degrees_of_freedom);

/// The shift of one Gauss-Newton step of a cost [-], at most `most` long in each coordinate.
VectorX gauss_newton_shift(const CostEvaluation& evaluation, double most);

/// Shifts of an estimate, one for each quantity that is taken as given, moved by as much as prior and recording leave
/// it open, what is estimated following: - H_ee^-1 H_eg s with s^-2 = H_gg - H_ge H_ee^-1 H_eg, one g at a time (the
/// implicit function theorem, and Schur's complement).
/// @param gauss_newton  H by all coordinates, the given ones' priors among it
/// @return              estimated x given
MatrixX shifts_of_given(const MatrixX& gauss_newton, const std::vector<Eigen::Index>& estimated,
                        const std::vector<Eigen::Index>& given);

}  // namespace pliant
