#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "elasticity/sampled_law.hpp"
#include "estimation/sample_fit.hpp"

namespace pliant {

/// Samples of all presses, and the material that is interpolated between them (Bickel 2009, section 4), in rounds. In
/// each round every press shows a field of its own (`fit_sample`), smooth about what the material of the round before
/// is under that press; in the first, the law that all presses share. So fields of different presses contradict each
/// other only where their markers do. A round counts only where its material is closer to the markers than the one
/// before: the fields are led back towards that one until it is.
class PressSampling {
 public:
  struct State {
    std::vector<PressSample> kept;   ///< of the last round that counts, one a press
    std::vector<PressSample> under;  ///< of the round that is under way
  };
  /// What came of a round.
  struct Round {
    bool is_kept = false;
    double cost_before = 0.0, cost = 0.0;  ///< half the squares of the residuals over the noise, robust
  };

  /// @param presses  numbers of those that take part
  /// @param is_given the noise that comes with the rounds is known, not what residuals say
  PressSampling(std::shared_ptr<const PressScene> scene, std::vector<int> presses, const BasisOptions& basis,
                bool is_given, State state);

  /// The next presses of the round, at most `count`.
  /// @param law    that all presses share; of its body
  /// @param noise  that its residuals show
  std::vector<PressSample> sample(std::size_t count, const std::shared_ptr<const TabulatedLaw>& law,
                                  const MarkerNoise& noise, int iterations);
  bool is_round_done() const { return state_.under.size() == presses_.size(); }
  /// Ends a round that is done, and begins the next.
  Round conclude(const std::shared_ptr<const TabulatedLaw>& law, const MarkerNoise& noise);

  const State& state() const { return state_; }
  /// Of the rounds that count; nothing where there are none.
  std::optional<SampledMaterial> material(const std::shared_ptr<const TabulatedLaw>& law) const {
    return material_of(law, state_.kept);
  }

 private:
  struct Pressed {
    bool succeeded = false;
    MatrixX strains;  // elements x 6
    Points points;
  };
  std::shared_ptr<const MaterialLaw> before(const std::shared_ptr<const TabulatedLaw>& law);
  Pressed pressed(int press, const std::shared_ptr<const MaterialLaw>& law, double modulus) const;
  std::vector<Pressed> all_pressed(const std::shared_ptr<const MaterialLaw>& law) const;
  double cost_of(const std::vector<Pressed>& presses, const MarkerNoise& noise) const;
  MarkerNoise own_noise(const std::vector<Pressed>& presses) const;
  std::optional<SampledMaterial> material_of(const std::shared_ptr<const TabulatedLaw>& shared,
                                             const std::vector<PressSample>& samples) const;
  double least_noise() const;

  std::shared_ptr<const PressScene> scene_;
  std::vector<int> presses_;
  BasisOptions basis_;
  bool is_given_;
  State state_;
  ElementSmoothness smoothness_;
  MarkerNoise local_;
  // Of this round, once they are asked for.
  std::shared_ptr<const MaterialLaw> before_;
  std::vector<Pressed> placed_;  // by that law
  MarkerNoise noise_;            // of its residuals
};

}  // namespace pliant
