#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/lame.hpp"
#include "elasticity/material_law.hpp"
#include "parameters/motion_blocks.hpp"

namespace pliant {

/// The form of an object's law: how many numbers it has. One law may serve all control moduli, or each has its own.
struct LawForm {
  int controls = 1;                                ///< control moduli of the body's `ModulusField`
  int terms = 1;                                   ///< of Ogden's law; 0: a law of two numbers
  int laws = 1;                                    ///< 1, or as many as controls
  bool own_ratios = false;                         ///< whether each term has a Poisson's ratio, or all have the same
  ElasticLaw two_numbers = ElasticLaw::Corotated;  ///< which, where there are no terms
  bool operator==(const LawForm&) const = default;
};

/// Where the numbers of an object's law stand in a parameter vector: Young's moduli at rest; and of every law
/// Poisson's ratio, the terms' exponents, and of each further term how stiff it is against the first, mu_i / mu_1.
class LawLayout {
 public:
  /// @param modulus_names  of the control moduli, one each; empty: "youngs_modulus", or "youngs_modulus@1", ... of
  ///                       several. Where every control has its own law, its numbers take the "@1" of its modulus.
  /// Throws std::invalid_argument where there is not one name a control, or there are neither one law nor one a
  /// control.
  explicit LawLayout(const LawForm& form = {}, std::vector<std::string> modulus_names = {});

  /// The law of two numbers of a body in motion, its blocks those of the motion: `layout()` is empty, `size()` zero.
  static LawLayout of_moduli(const MaterialBlocks& blocks, ElasticLaw law);
  /// The law of a body in motion. Its moduli and its first Poisson's ratio are blocks of the motion, all others are
  /// appended to `layout` under the names above; `layout()` of what is returned is empty.
  /// @param form  `controls` is ignored: the blocks say how many there are
  /// Throws std::invalid_argument as the constructor does, and where a name is taken.
  static LawLayout of_motion(ParameterLayout& layout, const MaterialBlocks& blocks, LawForm form);

  /// The same law in the vectors of another layout; `layout()` of what is returned is empty.
  /// @param there  says where a handle's numbers stand in them
  LawLayout moved(const std::function<ParameterHandle(const ParameterHandle&)>& there) const;

  const LawForm& form() const { return form_; }
  const ParameterLayout& layout() const { return layout_; }
  int size() const { return layout_.size(); }
  const std::vector<std::string>& modulus_names() const { return names_; }

  ParameterHandle modulus(int control) const { return moduli_[std::size_t(control)]; }
  /// Geometric mean of the control moduli [Pa].
  double mean_modulus(const VectorX& theta) const;
  ParameterHandle exponent(int term, int law = 0) const { return laws_[std::size_t(law)].exponents[std::size_t(term)]; }
  /// Of a term but the first.
  ParameterHandle stiffness_ratio(int term, int law = 0) const {
    return laws_[std::size_t(law)].stiffness_ratios[std::size_t(term)];
  }
  /// Of the linear law, or of a term: the same for all terms where they do not have their own.
  ParameterHandle poissons_ratio(int term = 0, int law = 0) const {
    return laws_[std::size_t(law)].poissons_ratios[std::size_t(term)];
  }
  /// All numbers of a law in the order of their parameters: the control's modulus first, then those above.
  std::vector<ParameterHandle> numbers(int law) const;
  /// All blocks of the law, each once, in the order in which they were added.
  std::vector<ParameterHandle> all() const;

 private:
  struct Blocks {
    std::vector<ParameterHandle> poissons_ratios, exponents, stiffness_ratios;  // by term
  };
  /// Appends what a law has beside its moduli. The first law's first Poisson's ratio is `first_ratio` where it exists.
  void add_laws(ParameterLayout& layout, const ParameterHandle& first_ratio);

  LawForm form_;
  std::vector<std::string> names_;
  ParameterLayout layout_;
  std::vector<ParameterHandle> moduli_;
  std::vector<Blocks> laws_;
};

/// Parameters of one form of the law as those of another: control k of `to` gets the modulus of control `like[k]`, and
/// law k the numbers of law `like[k]`, or of the only one. What `from` does not have is left at zero.
VectorX carry_law(const LawLayout& from, const VectorX& theta, const LawLayout& to, const std::vector<int>& like);

/// The numbers of one element's law: Young's modulus [Pa], then of each term its Poisson's ratio, exponent and
/// stiffness ratio (the linear law has a Poisson's ratio alone, a first term has the ratio 1).
struct ElementNumbers {
  static constexpr int modulus = 0;
  static constexpr int poissons_ratio(int term) { return 1 + 3 * term; }
  static constexpr int exponent(int term) { return 2 + 3 * term; }
  static constexpr int stiffness_ratio(int term) { return 3 + 3 * term; }
  static constexpr int count(int terms) { return 1 + 3 * (terms > 1 ? terms : 1); }
};

/// The numbers of one element: those of the controls mixed by the weights of the body's `ModulusField`, moduli and
/// stiffness ratios in the logarithm, the others as they are.
VectorX element_numbers(const Body& body, const LawLayout& layout, const VectorX& theta, int element);

/// How much of a number in theta goes into one of an element's own.
struct NumberShare {
  int number;          ///< of `ElementNumbers`
  ParameterHandle at;  ///< in theta
  double share;        ///< d number / d theta; of ln E for the modulus
};
std::vector<NumberShare> number_shares(const Body& body, const LawLayout& layout, const VectorX& theta,
                                       const VectorX& numbers, int element);

/// Derivatives of one element's parameters q of the law by its numbers.
/// @return  rows as the law has q, columns as `ElementNumbers`, the first by ln E
MatrixX law_parameter_derivatives(const LawForm& form, const VectorX& numbers);

/// Derivatives of one element's parameters q of the law by theta, q x theta.
MatrixX law_parameters_by_theta(const Body& body, const LawLayout& layout, const VectorX& theta, int element);

/// The law of all elements for theta. Throws std::invalid_argument where theta has no such material.
std::shared_ptr<const TabulatedLaw> law_at(const Body& body, const LawLayout& layout, const VectorX& theta);

}  // namespace pliant
