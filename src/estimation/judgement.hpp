#pragma once

#include <array>
#include <bit>

namespace pliant {

/// A number set by hand by which estimates are judged.
struct Judged {
  const char* name;  ///< in `result.json`
  double value;
  const char* meaning;  ///< for people, with what it was set on

  constexpr operator double() const { return value; }
};

/// Numbers set by hand that widen an interval, set a verdict, or decide between hypotheses, so that one place says what
/// a stated uncertainty rests on; every `result.json` repeats the values. Priors are those of `default_parameters`.
/// What only steers a search (starts, iterations, horizons) is not among them. "Second physics" is an independent
/// simulator with neo-Hookean elasticity and Kelvin-Voigt damping, whose recordings set the numbers of which it is
/// said.
struct Judgement {
  // Verdict: is the recording explained, and are moduli determined?
  Judged residual{"verdict.residual", 1.6,
                  "rms residual over the noise of the sensor, above which a recording is unexplained"};
  Judged residual_for_a_while{"verdict.residual_for_a_while", 2.2,
                              "the same over a tenth of the frames, three at least"};
  Judged residual_of_part{"verdict.residual_of_part", 1.4,
                          "rms residual over the noise, up to which a part of a recording is chosen for being "
                          "explained: what lay between was seen to put moduli off by a third (second physics)"};
  Judged residual_of_part_for_a_while{"verdict.residual_of_part_for_a_while", 1.7,
                                      "the same over a tenth of the frames, three at least"};
  Judged relative_residual{
      "verdict.relative_residual", 0.05,
      "rms residual of static tests over the greatest measured of its kind, above which, and above "
      "the noise, they are unexplained"};
  Judged least_matched{"verdict.least_matched", 0.85, "share of observed points that a model must match"};
  Judged poorly_known{"verdict.poorly_known", 0.25,
                      "standard deviation of the logarithm of Young's modulus, above which it is undetermined"};
  Judged model_share{"verdict.model_share", 0.3,
                     "part of that deviation by other models, above which the reason names them"};

  // Intervals: noise, alternatives, what no alternative stands for.
  Judged independent_points{"interval.independent_points", 50.0,
                            "points of a frame of a moving object that count as independent: neighbours err together"};
  Judged independent_points_at_rest{"interval.independent_points_at_rest", 200.0,
                                    "the same of an object that stands as it was scanned: no model errs there"};
  Judged parts_of_motion{"interval.parts_of_motion", 4.0,
                         "parts of a single motion whose differing estimates widen the interval (jackknife)"};
  Judged freedom_of_alternative{"interval.freedom_of_alternative", 4.0,
                                "degrees of freedom: how well the size of an alternative is known"};
  Judged freedom_of_floor{"interval.freedom_of_floor", 20.0, "degrees of freedom of the floors below"};
  Judged floor_youngs_modulus{"interval.floor.youngs_modulus", 0.05,
                              "deviation of ln E by laws and dampings that no alternative stands for, of objects that "
                              "meet obstacles; set, like the floors below, by errors of fits to second physics"};
  Judged floor_poissons_ratio{"interval.floor.poissons_ratio", 0.047, "the same of Poisson's ratio"};
  Judged floor_mass_damping{"interval.floor.mass_damping", 0.06, "the same of mass damping, a share"};
  Judged floor_stiffness_damping{"interval.floor.stiffness_damping", 0.16, "the same of stiffness damping, a share"};
  Judged free_floor_youngs_modulus{"interval.free_floor.youngs_modulus", 0.015,
                                   "the same of ln E, of objects that swing or rest and meet no obstacle"};
  Judged free_floor_poissons_ratio{"interval.free_floor.poissons_ratio", 0.016, "the same of Poisson's ratio"};
  Judged free_floor_mass_damping{"interval.free_floor.mass_damping", 0.10, "the same of mass damping, a share"};
  Judged free_floor_stiffness_damping{"interval.free_floor.stiffness_damping", 0.08,
                                      "the same of stiffness damping, a share"};
  Judged test_floor_youngs_modulus{"interval.test_floor.youngs_modulus", 0.06,
                                   "deviation of ln E at small strain by the form of the law, of objects that are "
                                   "pressed or pulled: errors of fits to second physics are 1 to 10 %"};
  Judged test_floor_poissons_ratio{
      "interval.test_floor.poissons_ratio", 0.035,
      "the same of Poisson's ratio: where strains are large it makes up for how the law meets changes of volume, and "
      "errors of fits to second physics are up to 0.07"};
  Judged size_of_finer_mesh{"interval.size.finer_mesh", 1.8,
                            "error of the fit's mesh over what a finer one changes: second order"};
  Judged size_of_coarser_mesh{"interval.size.coarser_mesh", 0.8, "the same over what a coarser one changes"};
  Judged size_of_longer_step{"interval.size.longer_step", 0.6, "error of the time step over what a longer one changes"};
  Judged size_of_small_strain{"interval.size.small_strain", 0.5,
                              "share of what corotated linear elasticity changes, by which the law of a motion may "
                              "differ at large strain"};
  Judged size_of_small_strain_at_rest{"interval.size.small_strain_at_rest", 1.0, "the same of an equilibrium"};
  Judged safety_of_two{"interval.safety_of_two_spacings", 3.0, "factor of a refinement of two spacings (Roache 1994)"};
  Judged safety_of_three{"interval.safety_of_three_spacings", 1.25, "the same of three"};
  Judged given_turn{"interval.given.turn", 0.002, "deviation [rad] of a given sensor's direction"};
  Judged given_shift{"interval.given.shift", 0.001,
                     "deviation of a given sensor's place along each axis, and of its range, over the object's size"};
  Judged given_gravity{"interval.given.gravity", 0.003, "deviation [rad] of gravity's given direction: a level"};
  Judged given_density{"interval.given.density", 0.01,
                       "deviation of the logarithm of a given density: a kitchen scale, and the volume of a scan"};
  Judged scan_error{
      "interval.given.scan_error", 0.0025,
      "deviation of a scan along its normals where `surface_noise` is not stated, over the object's size: "
      "hand-held scanners and photogrammetry, and the cover of plush; half of the variance is common to all of it"};
  Judged scan_error_of_thickness{"interval.given.scan_error_of_thickness", 0.03,
                                 "the most of that over the object's thickness: what a scan shows at all"};
  Judged unevenness{"interval.given.unevenness", 0.08,
                    "deviation of the logarithm of the stiffness over an object of one material where `stiffness_std` "
                    "is not stated: stuffing and foam vary by 5 to 20 %, cast rubber hardly"};
  Judged given_friction{"interval.given.friction", 0.05, "deviation of a given coefficient of friction"};
  Judged given_contact{"interval.given.contact_stiffness", 0.3,
                       "deviation of the logarithm of the stiffness of contact, where it was chosen"};

  // Hypotheses: how much of an object and a recording is taken into the model.
  Judged strong_evidence{"hypothesis.strong_evidence", 3.0,
                         "logarithm of the Bayes factor by which a richer model is kept; as far below zero it is ruled "
                         "out (Kass and Raftery 1995: 2 ln B > 6)"};
  Judged evidence_of_parts{
      "hypothesis.evidence_of_parts", 10.0,
      "the same of moduli of their own for parts of a pressed or pulled object: what a law or a "
      "mesh lacks made up 6 and 13 of even ones, layers of a ratio of two 440 (second physics); of "
      "what hangs or swings, with what other models leave open: about 4 of an even strip of "
      "silicone, 36 of a bar of two stiffnesses (second physics)"};
  Judged gain_of_second_modulus{"hypothesis.gain_of_second_modulus", 0.10,
                                "least share of the cost that a field takes off that of an even object: 0.04 was seen "
                                "of an even bar, 0.18 of one of two stiffnesses (second physics)"};
  Judged gain_of_further_moduli{"hypothesis.gain_of_further_moduli", 0.03, "the same beside a field"};
  Judged gain_of_zone{"hypothesis.gain_of_zone", 0.03,
                      "least share of the squared residuals of presses that a zone or a further number takes off"};
  Judged tolerated_excess{"hypothesis.tolerated_excess", 1.0,
                          "cost beyond that of noise, over that, from which a given quantity is corrected"};
  Judged least_part{"hypothesis.least_part", 0.15, "smallest part of a recording that is fitted for being explained"};
  Judged nearly_whole{"hypothesis.nearly_whole", 0.9, "part of a recording from which on the whole is fitted"};
  Judged plane_deviations{"hypothesis.plane_deviations", 4.0,
                          "deviations of a plane that a camera sees from a given one, up to which it is that one"};
  Judged share_of_shifted_times{"hypothesis.share_of_shifted_times", 0.5,
                                "least part of the cost beyond noise that other times of a recording take off, from "
                                "which on they are suspected"};
  Judged onset_of_shifted_times{"hypothesis.onset_of_shifted_times", 4.0,
                                "cost of the first frame that fits at another time, over that of the one before it, "
                                "and over what it has at that time"};
  Judged press_outlier{"hypothesis.press_outlier", 6.0,
                       "deviations of a marker under a press, from which on it is an outlier"};
};
inline constexpr Judgement judgement;

/// The same, one after the other.
inline std::array<Judged, sizeof(Judgement) / sizeof(Judged)> all_judged() {
  return std::bit_cast<std::array<Judged, sizeof(Judgement) / sizeof(Judged)>>(judgement);
}

}  // namespace pliant
