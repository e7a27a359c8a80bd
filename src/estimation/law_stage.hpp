#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "elasticity/law_layout.hpp"
#include "estimation/marker_noise.hpp"
#include "estimation/zone_cut.hpp"

namespace pliant {

/// A form of the law of a pressed object, and where on the object its control moduli lie.
struct LawShape {
  LawForm form;
  std::vector<Vector3> points = {};  ///< control points of a field [m]; none: regions, zones, or one modulus
  std::vector<ZoneCut> cuts = {};    ///< that made the zones, one after the other
};

/// What a stage of a search for the law of a pressed object does, beside what every `Stage` says.
struct LawTask {
  LawShape shape;
  MarkerNoise noise = {};  ///< at the beginning
  bool is_brief = false;   ///< of a minimisation: once and with that noise; else twice, the second time with its own
  double cost_to_reach = std::numeric_limits<double>::infinity();  ///< with that noise; above it, it may end early
  int cut = 0;  ///< of a move: which of the cuts; with evidence of a zone: the zone that it was cut from
  enum class Evidence { None, Zone, OwnLaws, Field } evidence = Evidence::None;  ///< to be computed where it ends
  LawShape before = {};  ///< what the evidence of a field is against
};

/// What a stage of a search for the law of a pressed object found, beside what every `StageRecord` says.
struct LawFinding {
  MarkerNoise noise = {};      ///< after it
  double deviation = 0.0;      ///< geometric mean of the coordinates' deviations by that noise [m]; 1 without any
  double track_squares = 0.0;  ///< of the residuals of markers, each by that mean over its own deviation [m^2]
  double stated_cost = 0.0;    ///< of curves and grips, whose deviations are stated [-]
  double observations = 0.0;   ///< independent ones
  int dimension = 0;           ///< numbers that were estimated
  double evidence = 0.0;       ///< ln of a Bayes factor; of a move the gain that is promised
  std::optional<ZoneCut> cut = {};
  std::vector<Vector3> points = {};  ///< [m] of a field

  /// Sum of the squares of all residuals [m^2], those of curves and grips times the square of a deviation [m].
  double squares(double unit) const { return track_squares + 2.0 * stated_cost * unit * unit; }
};

}  // namespace pliant
