#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimation/press_objective.hpp"
#include "estimation/zone_cut.hpp"

namespace pliant {

/// "zone 1 cut at y = 33 mm: above it zone 3", zones counted from 1.
std::string describe(const ZoneCut& cut, int zones_before);

/// What cuts go by, of the centres of all elements: elements x 4, columns as in `ZoneCut::By` [m].
MatrixX zone_coordinates(const Body& body);

/// The zone of each element after cuts, one after the other.
std::vector<int> zones_after(const MatrixX& coordinates, const std::vector<ZoneCut>& cuts);

/// A modulus, and a law, of its own for each zone: weights of 0 and 1.
ModulusField zone_field(const ModulusField& before, const std::vector<int>& zone_of, int zones);

/// The form with one zone more, each with a law of its own.
LawForm with_zone(const LawForm& form);
/// Parameters of one zone more, which is as the one that it was cut from.
/// @param to  of `with_zone`
VectorX with_zone(const LawLayout& from, const VectorX& theta, const LawLayout& to, int zone);

/// How far the numbers of two zones' laws lie apart by the prior: standard deviations of the differences of the
/// unconstrained numbers, of one law, in the order of `LawLayout::numbers`.
VectorX law_contrast_deviations(const LawForm& form, double modulus_variation);

/// The parameters of laws of zones: `law_parameters`, and where there are several a prior of ln E about their mean.
ParameterSet zone_parameters(const LawLayout& layout, double youngs_modulus, double modulus_variation);

/// ln of the Bayes factor of the last zone's own law against that of the zone it was cut from (`log_bayes_factor`).
/// @param evaluation  with derivatives, at p of `parameters`, which are those of zones
double zone_evidence(const CostEvaluation& evaluation, const ParameterSet& parameters, const VectorX& p,
                     const LawLayout& layout, int cut_from, double modulus_variation);

/// The same of all laws but the first against one shape of the law for all: the moduli are free under both.
double own_laws_evidence(const CostEvaluation& evaluation, const ParameterSet& parameters, const VectorX& p,
                         const LawLayout& layout, double modulus_variation);

/// Where a zone is best cut, and ln of the Bayes factor that a Gauss-Newton step promises for it.
struct PromisedCut {
  ZoneCut cut;
  double evidence = 0.0;
};

/// The cut that promises most: every zone is cut into slabs by each coordinate, the presses are differentiated by every
/// slab's own law at the present estimate, and the slabs' derivatives summed on either side of each cut (refinement
/// indicators: Ben Ameur, Chavent and Jaffre 2002, but by the evidence instead of the gradient alone). Nothing where no
/// cut leaves two parts of 2 % of the volume each.
/// @param layout  of zones, or of one law for all
/// @param cuts    that made the zones
std::optional<PromisedCut> most_promising_cut(PressObjective& objective, const PressScene& scene,
                                              const LawLayout& layout, const VectorX& theta,
                                              const std::vector<ZoneCut>& cuts, double modulus_variation);

/// Another place for a cut, and by how much a Gauss-Newton step promises to lower the cost there.
struct PromisedMove {
  double at = 0.0;  ///< [m]
  double gain = 0.0;
};
/// The best place for one of the cuts, the others staying: by the slabs' derivatives as above. Nothing where none
/// promises more than where it is.
std::optional<PromisedMove> best_move(PressObjective& objective, const PressScene& scene, const LawLayout& layout,
                                      const VectorX& theta, const std::vector<ZoneCut>& cuts, std::size_t moved,
                                      double modulus_variation);

}  // namespace pliant
