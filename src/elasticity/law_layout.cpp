#include "elasticity/law_layout.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "elasticity/lame.hpp"

namespace pliant {

namespace {

using Numbers = ElementNumbers;

double weight_of(const Body& body, int e, int control) {
  return body.modulus.controls == 1 ? 1.0 : body.modulus.weights(e, control);
}

/// Ogden's law of one element by its own numbers: terms share the shear modulus, and its E is that at rest.
struct OgdenShares {
  VectorX share;              // mu_i / mu
  VectorX bulk;               // b_i = nu_i / (1 - 2 nu_i)
  double nu = 0.0, mu = 0.0;  // of all terms together, at rest
  double mean_bulk = 0.0;     // sum of share times bulk
};
OgdenShares ogden_shares(int terms, const VectorX& own) {
  OgdenShares s;
  s.share = VectorX::Ones(terms);
  s.bulk.resize(terms);
  for (int i = 0; i < terms; ++i) {
    if (i > 0) s.share[i] = own[Numbers::stiffness_ratio(i)];
    const double nu = own[Numbers::poissons_ratio(i)];
    s.bulk[i] = nu / (1.0 - 2.0 * nu);
  }
  s.share /= s.share.sum();
  s.mean_bulk = s.share.dot(s.bulk);
  s.nu = s.mean_bulk / (1.0 + 2.0 * s.mean_bulk);
  s.mu = own[0] / (2.0 * (1.0 + s.nu));
  return s;
}

/// The numbers of a law and where they stand in theta, the modulus left out.
std::vector<std::pair<int, ParameterHandle>> numbers_of(const LawLayout& layout, int law) {
  std::vector<std::pair<int, ParameterHandle>> all = {{Numbers::poissons_ratio(0), layout.poissons_ratio(0, law)}};
  for (int i = 0; i < layout.form().terms; ++i) {
    all.emplace_back(Numbers::exponent(i), layout.exponent(i, law));
    if (i == 0) continue;
    all.emplace_back(Numbers::stiffness_ratio(i), layout.stiffness_ratio(i, law));
    all.emplace_back(Numbers::poissons_ratio(i), layout.poissons_ratio(i, law));
  }
  return all;
}

bool is_mixed_in_logarithm(int number) { return number >= Numbers::stiffness_ratio(1) && number % 3 == 0; }

}  // namespace

LawLayout::LawLayout(const LawForm& form, std::vector<std::string> modulus_names)
    : form_(form), names_(std::move(modulus_names)) {
  if (names_.empty() && form.controls == 1) names_ = {"youngs_modulus"};
  for (int k = 1; names_.size() < std::size_t(form.controls) && int(names_.size()) == k - 1; ++k)
    names_.push_back("youngs_modulus@" + std::to_string(k));
  if (int(names_.size()) != form.controls) throw std::invalid_argument("a name a control modulus is needed");
  if (form.laws != 1 && form.laws != form.controls) throw std::invalid_argument("one law, or one a control modulus");
  for (const std::string& name : names_) moduli_.push_back(layout_.add({name, "Pa", 1, Role::Material}));
  add_laws(layout_, {});
}

void LawLayout::add_laws(ParameterLayout& layout, const ParameterHandle& first_ratio) {
  for (int law = 0; law < form_.laws; ++law) {
    const std::string& owner = names_[std::size_t(law)];
    const std::string place =
        form_.laws == 1 || owner.find('@') == std::string::npos ? "" : owner.substr(owner.find('@'));
    const auto add = [&](const std::string& name) { return layout.add({name + place, "1", 1, Role::Material}); };
    Blocks blocks;
    const char* const ratio = form_.own_ratios ? "poissons_ratio_1" : "poissons_ratio";
    blocks.poissons_ratios = {law == 0 && first_ratio.exists() ? first_ratio : add(ratio)};
    for (int i = 0; i < form_.terms; ++i) {
      const std::string number = "_" + std::to_string(i + 1);
      blocks.exponents.push_back(add("exponent" + number));
      blocks.stiffness_ratios.push_back(i > 0 ? add("stiffness_ratio" + number) : ParameterHandle{});
      if (i > 0)
        blocks.poissons_ratios.push_back(form_.own_ratios ? add("poissons_ratio" + number)
                                                          : blocks.poissons_ratios.front());
    }
    laws_.push_back(std::move(blocks));
  }
}

LawLayout LawLayout::of_moduli(const MaterialBlocks& blocks, ElasticLaw law) {
  ParameterLayout nothing;
  return of_motion(nothing, blocks, {1, 0, 1, false, law});
}

LawLayout LawLayout::of_motion(ParameterLayout& layout, const MaterialBlocks& blocks, LawForm form) {
  LawLayout law;
  law.names_.clear();
  law.layout_ = {};
  law.laws_.clear();
  law.form_ = form;
  law.form_.controls = int(blocks.youngs_moduli.size());
  if (form.laws != 1 && form.laws != law.form_.controls)
    throw std::invalid_argument("one law, or one a control modulus");
  law.moduli_ = blocks.youngs_moduli;
  for (const ParameterHandle& modulus : law.moduli_)
    law.names_.push_back(form.laws == 1 ? "" : layout.block_of(modulus).name);
  law.add_laws(layout, blocks.poissons_ratio);
  return law;
}

LawLayout LawLayout::moved(const std::function<ParameterHandle(const ParameterHandle&)>& there) const {
  LawLayout law = *this;
  law.layout_ = {};
  const auto move = [&](std::vector<ParameterHandle>& handles) {
    for (ParameterHandle& at : handles)
      if (at.exists()) at = there(at);
  };
  move(law.moduli_);
  for (Blocks& blocks : law.laws_) move(blocks.poissons_ratios), move(blocks.exponents), move(blocks.stiffness_ratios);
  return law;
}

double LawLayout::mean_modulus(const VectorX& theta) const {
  double log = 0.0;
  for (const ParameterHandle& modulus : moduli_) log += std::log(theta[modulus]) / double(moduli_.size());
  return std::exp(log);
}

std::vector<ParameterHandle> LawLayout::numbers(int law) const {
  std::vector<ParameterHandle> all = {modulus(law), poissons_ratio(0, law)};
  for (int i = 0; i < form_.terms; ++i) {
    all.push_back(exponent(i, law));
    if (i > 0) all.push_back(stiffness_ratio(i, law));
    if (i > 0 && form_.own_ratios) all.push_back(poissons_ratio(i, law));
  }
  return all;
}

std::vector<ParameterHandle> LawLayout::all() const {
  std::vector<ParameterHandle> blocks = moduli_;
  for (int law = 0; law < form_.laws; ++law) {
    const std::vector<ParameterHandle> own = numbers(law);
    blocks.insert(blocks.end(), own.begin() + 1, own.end());
  }
  return blocks;
}

VectorX carry_law(const LawLayout& from, const VectorX& theta, const LawLayout& to, const std::vector<int>& like) {
  VectorX carried = VectorX::Zero(to.size());
  for (int k = 0; k < to.form().controls; ++k) carried[to.modulus(k)] = theta[from.modulus(like[std::size_t(k)])];
  for (int law = 0; law < to.form().laws; ++law) {
    const int own = from.form().laws == 1 ? 0 : like[std::size_t(law)];
    carried[to.poissons_ratio(0, law)] = theta[from.poissons_ratio(0, own)];
    for (int i = 0; i < std::min(from.form().terms, to.form().terms); ++i) {
      carried[to.exponent(i, law)] = theta[from.exponent(i, own)];
      if (i == 0) continue;
      carried[to.stiffness_ratio(i, law)] = theta[from.stiffness_ratio(i, own)];
      if (to.form().own_ratios) carried[to.poissons_ratio(i, law)] = theta[from.poissons_ratio(i, own)];
    }
  }
  return carried;
}

VectorX element_numbers(const Body& body, const LawLayout& layout, const VectorX& theta, int e) {
  const LawForm& form = layout.form();
  VectorX own = VectorX::Zero(Numbers::count(form.terms));
  double log = std::log(body.modulus.relative[std::size_t(e)]);
  for (int k = 0; k < form.controls; ++k)
    if (const double w = weight_of(body, e, k); w != 0.0) log += w * std::log(theta[layout.modulus(k)]);
  own[Numbers::modulus] = std::exp(log);
  if (form.laws == 1) {
    for (const auto& [number, at] : numbers_of(layout, 0)) own[number] = theta[at];
  } else {
    for (int k = 0; k < form.controls; ++k) {
      const double w = weight_of(body, e, k);
      if (w == 0.0) continue;
      for (const auto& [number, at] : numbers_of(layout, k))
        own[number] += w * (is_mixed_in_logarithm(number) ? std::log(theta[at]) : theta[at]);
    }
    for (int i = 1; i < form.terms; ++i) own[Numbers::stiffness_ratio(i)] = std::exp(own[Numbers::stiffness_ratio(i)]);
  }
  own[Numbers::stiffness_ratio(0)] = 1.0;
  return own;
}

std::vector<NumberShare> number_shares(const Body& body, const LawLayout& layout, const VectorX& theta,
                                       const VectorX& own, int e) {
  std::vector<NumberShare> shares;
  for (int k = 0; k < layout.form().controls; ++k) {
    const double w = weight_of(body, e, k);
    if (w == 0.0) continue;
    shares.push_back({Numbers::modulus, layout.modulus(k), w / theta[layout.modulus(k)]});
    if (layout.form().laws == 1) continue;
    for (const auto& [number, at] : numbers_of(layout, k))
      shares.push_back({number, at, is_mixed_in_logarithm(number) ? w * own[number] / theta[at] : w});
  }
  if (layout.form().laws == 1)
    for (const auto& [number, at] : numbers_of(layout, 0)) shares.push_back({number, at, 1.0});
  return shares;
}

MatrixX law_parameter_derivatives(const LawForm& form, const VectorX& own) {
  const int terms = form.terms;
  if (terms == 0 && form.two_numbers == ElasticLaw::NeoHookean) {
    const double E = own[Numbers::modulus], nu = own[Numbers::poissons_ratio(0)];
    const UnitLame lame = unit_lame(nu);
    MatrixX by = MatrixX::Zero(2, Numbers::count(terms));
    by(0, 0) = E * lame.mu, by(0, 1) = E * lame.d_mu;
    by(1, 0) = E * lame.lambda, by(1, 1) = E * lame.d_lambda;
    return by;
  }
  if (terms == 0) {
    const double E = own[Numbers::modulus], nu = own[Numbers::poissons_ratio(0)];
    MatrixX by = MatrixX::Zero(2, Numbers::count(terms));
    const LambdaAlpha p = lambda_alpha({E, nu});
    by(0, 0) = p.lambda, by(1, 0) = p.alpha;
    by(0, 1) = p.lambda * (1.0 + 4.0 * nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    by(1, 1) = p.lambda + nu * by(0, 1);
    return by;
  }
  const OgdenShares o = ogden_shares(terms, own);
  const double mu_by_bulk = -o.mu / (1.0 + o.nu) / std::pow(1.0 + 2.0 * o.mean_bulk, 2);
  MatrixX by = MatrixX::Zero(3 * terms, Numbers::count(terms));
  for (int i = 0; i < terms; ++i) {
    by(3 * i, 0) = o.mu * o.share[i];
    by(3 * i + 1, Numbers::exponent(i)) = 1.0;
    by(3 * i + 2, Numbers::poissons_ratio(i)) = 1.0;
    for (int j = 0; j < terms; ++j) {
      const double nu = own[Numbers::poissons_ratio(j)], bulk_by_nu = 1.0 / std::pow(1.0 - 2.0 * nu, 2);
      by(3 * i, Numbers::poissons_ratio(j)) = o.share[i] * mu_by_bulk * o.share[j] * bulk_by_nu;
      if (j == 0) continue;
      const int ratio = Numbers::stiffness_ratio(j);
      by(3 * i, ratio) = o.share[j] / own[ratio] *
                         (o.mu * ((i == j) - o.share[i]) + o.share[i] * mu_by_bulk * (o.bulk[j] - o.mean_bulk));
    }
  }
  return by;
}

MatrixX law_parameters_by_theta(const Body& body, const LawLayout& layout, const VectorX& theta, int e) {
  const VectorX own = element_numbers(body, layout, theta, e);
  const MatrixX by_own = law_parameter_derivatives(layout.form(), own);
  MatrixX by_theta = MatrixX::Zero(by_own.rows(), theta.size());
  for (const auto& [number, at, share] : number_shares(body, layout, theta, own, e))
    by_theta.col(at) += share * by_own.col(number);
  return by_theta;
}

std::shared_ptr<const TabulatedLaw> law_at(const Body& body, const LawLayout& layout, const VectorX& theta) {
  const int terms = layout.form().terms;
  const bool neo_hookean = terms == 0 && layout.form().two_numbers == ElasticLaw::NeoHookean;
  MatrixX table(body.element_count(), terms == 0 ? 2 : 3 * terms);
  for (int e = 0; e < body.element_count(); ++e) {
    const VectorX own = element_numbers(body, layout, theta, e);
    if (neo_hookean) {
      const UnitLame lame = unit_lame(own[Numbers::poissons_ratio(0)]);
      table.row(e) << own[Numbers::modulus] * lame.mu, own[Numbers::modulus] * lame.lambda;
      continue;
    }
    if (terms == 0) {
      const LambdaAlpha p = lambda_alpha({own[Numbers::modulus], own[Numbers::poissons_ratio(0)]});
      table.row(e) << p.lambda, p.alpha;
      continue;
    }
    const OgdenShares o = ogden_shares(terms, own);
    for (int i = 0; i < terms; ++i)
      table.row(e).segment<3>(3 * i) << o.mu * o.share[i], own[Numbers::exponent(i)], own[Numbers::poissons_ratio(i)];
  }
  if (neo_hookean) return std::make_shared<NeoHookeanLaw>(std::move(table));
  if (terms == 0) return std::make_shared<LinearLaw>(std::move(table));
  return std::make_shared<OgdenLaw>(std::move(table));
}

}  // namespace pliant
