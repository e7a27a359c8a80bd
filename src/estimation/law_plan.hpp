#pragma once

#include <memory>

#include "estimation/fit.hpp"

namespace pliant {

/// What the plan of a search for a law depends on, beside what was done: facts about the object and its tests, and the
/// choices.
struct LawFacts {
  FitOptions options;
  std::vector<std::string> modulus_names;  ///< of the object's regions; empty: it has none
  double start_modulus = 0.0;              ///< [Pa]
  MarkerNoise noise = {};                  ///< before any fit
  double size = 0.0;                       ///< of the object [m]
  int presses = 0;                         ///< to be fitted
  bool has_curves = false;                 ///< forces at given depths or stresses are to be fitted
  bool is_specimen = false;                ///< stresses at given strains are: the object is of one material
  /// Exponents that a term begins from where stresses at given strains are all there is to fit: an evaluation costs
  /// nothing, and valleys are many. Empty: there is more to fit.
  std::vector<double> curve_exponents = {};

  /// Whether stress-strain curves are all there is to fit: nothing of the mesh is in them.
  bool are_curves() const { return !curve_exponents.empty(); }

  int controls() const { return modulus_names.empty() ? 1 : int(modulus_names.size()); }
  LawLayout layout(const LawForm& form) const;
  /// Where the parameters of a form begin, with the choices; those of a field with its prior.
  ParameterSet parameters(const LawShape& shape) const;
};

/// The stages of a search for the law of a pressed object: the law of one term (or of two numbers); more terms, and
/// Poisson's ratios of their own for them, by half the BIC; zones with a law of their own, one after the other where
/// one is promised most, their cuts moved to where they fit better, or a law for each region; where there is one law
/// for all, a field of more and more control points; and the stiffness that each press shows of itself, where the
/// material is sampled; at last a few steps on a coarser mesh and
/// with another weight. Every decision follows from the records of the stages
/// before it: the plan replays them.
class LawPlan {
 public:
  explicit LawPlan(LawFacts facts) : facts_(std::move(facts)) {}

  /// A form of the law that was fitted.
  struct Estimate {
    LawShape shape;
    LawLayout layout;
    VectorX theta;
    StageId id;    ///< of the stage that ended there
    VectorX from;  ///< where it began: numbers of the same form
    double cost = 0.0;
    bool converged = false;
    std::string reason = {};
    LawFinding found = {};
  };
  /// What the records say.
  struct Standing {
    std::optional<Stage> next;       ///< nothing: all is done
    std::optional<Estimate> best;    ///< nothing: no law could be fitted yet
    std::vector<TriedLaw> tried;     ///< in order
    MarkerNoise noise = {};          ///< with the best
    std::vector<ModelShift> shifts;  ///< of the best under other models of the object: how far it goes there
    std::string untried;             ///< why that of another mesh is not known; empty: it is, or was not asked for
  };
  /// Throws InputError where the records are of another plan.
  Standing after(const std::vector<StageRecord>& done) const;

  const LawFacts& facts() const { return facts_; }

 private:
  class Replay;
  LawFacts facts_;
};

/// How many presses are sampled in one stage: few, so that an interruption loses little.
inline constexpr std::size_t samples_a_stage = 4;

}  // namespace pliant
