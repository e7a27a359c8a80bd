#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "estimation/press_law.hpp"
#include "estimation/press_scene.hpp"
#include "estimation/trial.hpp"

namespace pliant {

/// The law of a pressed object as a function of the parameters, computed once for all presses that ask for the same.
class PressedMaterial {
 public:
  PressedMaterial(std::shared_ptr<const Body> body, LawLayout layout);

  const Body& body() const { return *body_; }
  const std::shared_ptr<const Body>& shared_body() const { return body_; }
  const LawLayout& layout() const { return layout_; }
  /// The law of all elements for theta; from any thread.
  std::shared_ptr<const MaterialLaw> law(const VectorX& theta);
  /// Goes on with another form of the law.
  /// @param body  the same but for its modulus field
  void set_form(std::shared_ptr<const Body> body, LawLayout layout);
  /// How many forms it has had before this one.
  int form() const { return form_; }

 private:
  std::shared_ptr<const Body> body_;
  LawLayout layout_;
  int form_ = 0;
  std::mutex mutex_;
  VectorX theta_;
  std::shared_ptr<const MaterialLaw> law_;
};

/// An equilibrium and how it changes with each number of the law, by which those of other parameters are guessed.
class LinearisedEquilibrium {
 public:
  /// @param form     of the law (`PressedMaterial::form`)
  /// @param rows     of the law's numbers, in theta
  /// @param changes  by each number, nodes' and then rigid bodies' [m]; of too many none is kept
  void set(int form, const VectorX& theta, const Placement& placement, const std::vector<Eigen::Index>& rows,
           std::vector<Points> changes);
  /// Nothing where there is none of this form, or where it leads too far to be trusted.
  /// @param size  of the object [m]
  std::optional<Placement> at(int form, const VectorX& theta, double size) const;

 private:
  int form_ = -1;  // none
  VectorX theta_;
  Placement placement_;
  std::vector<Eigen::Index> rows_;
  std::vector<Points> changes_;
};

/// A trial of a body at rest under one load or several, whose equilibria a trial of the same may set out from.
class EquilibriumTrial : public Trial {
 public:
  /// Of the last run, one a load; without nodes where none was found.
  [[nodiscard]] virtual std::vector<Placement> placements() const = 0;
  /// The next run sets out from those of another trial of the same.
  virtual void begin_from(const std::vector<Placement>& placements) = 0;
  [[nodiscard]] double expected_work() const override { return steps_of_an_equilibrium * scene_->body->node_count(); }

 protected:
  EquilibriumTrial(std::shared_ptr<const PressScene> scene, std::shared_ptr<PressedMaterial> material, int number)
      : scene_(std::move(scene)), material_(std::move(material)), number_(number) {}

  /// An evaluation that has failed since its equilibrium has no derivatives.
  static CostEvaluation unstable(CostEvaluation result, const std::string& name) {
    result.succeeded = false;
    result.failure = name + ": the equilibrium is not stable";
    return result;
  }

  /// Where a linearised equilibrium leads for theta.
  std::optional<Placement> guess(const LinearisedEquilibrium& from, const VectorX& theta) const {
    return from.at(material_->form(), theta, scene_->body->size());
  }

  std::shared_ptr<const PressScene> scene_;
  std::shared_ptr<PressedMaterial> material_;
  int number_;
};

struct PressTrialOptions {
  MarkerNoise noise;           ///< of a coordinate, > 0
  double outlier_scale = 0.0;  ///< residuals beyond this many deviations count less (pseudo-Huber), > 0
};

/// One press with known force: over points' coordinates, half the square of where the equilibrium has them less where
/// they were seen, over the noise, robust beyond `outlier_scale`. Noise that grows with displacement goes by where the
/// simulation has the points when the options are set (by what was measured before it has any): measured displacements
/// would weigh those markers most that noise has moved least. Derivatives are those of the equilibrium, by its
/// exact Hessian: a back-substitution a parameter, or one for all by the adjoint. Each run sets out from where the last
/// derivatives lead from their equilibrium, or from the last equilibrium where there are none.
class PressTrial : public EquilibriumTrial {
 public:
  /// @param reference  parameters whose modulus says how stiff the contact is
  /// @param number     what its frame calls it (`FrameFit::recording`)
  /// @param begin      a placement that the first run sets out from, of another trial of the press; null: at rest
  PressTrial(std::shared_ptr<const PressScene> scene, int press, const std::shared_ptr<PressedMaterial>& material,
             const VectorX& reference, const PressTrialOptions& options, int number = 0,
             const Placement* begin = nullptr);

  [[nodiscard]] CostEvaluation run(const VectorX& theta, const MatrixX& directions) override;
  [[nodiscard]] CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override;
  [[nodiscard]] std::unique_ptr<Trial> anew() const override;

  void set_options(const PressTrialOptions& options);
  /// Residuals of the last run [m], and deviations they are weighed by [m], n x 3.
  const Points& residuals() const { return residuals_; }
  const Points& deviations() const { return deviations_; }
  [[nodiscard]] std::vector<Placement> placements() const override;
  void begin_from(const std::vector<Placement>& placements) override { body_.begin_from(placements.front()); }
  const ObservedPress& seen() const { return scene_->presses[std::size_t(press_)]; }
  /// Newton's iterations of the last run.
  int iterations() const { return iterations_; }
  /// How far each point was moved in the last run [m]; as measured where none has succeeded.
  VectorX displacements() const;

 private:
  /// How stiff the contact is: the law at the reference, and its mean modulus [Pa].
  struct ContactMaterial {
    std::shared_ptr<const MaterialLaw> law;
    double youngs_modulus = 0.0;
  };
  PressTrial(std::shared_ptr<const PressScene> scene, int press, std::shared_ptr<PressedMaterial> material,
             const ContactMaterial& contact, const PressTrialOptions& options, int number, const Placement* begin);

  /// The equilibrium and its cost. `slope` and `weight` are those of each coordinate's loss.
  bool compare(const VectorX& theta, CostEvaluation& result, VectorX& slope, VectorX& weight);

  int press_;
  PressTrialOptions options_;
  ContactMaterial contact_;
  PressedBody body_;
  bool is_placed_ = false;
  int iterations_ = 0;
  VectorX placed_for_;  // parameters of the placement
  LinearisedEquilibrium linearised_;
  Points residuals_, deviations_;
};

}  // namespace pliant
