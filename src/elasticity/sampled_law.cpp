#include "elasticity/sampled_law.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "base/dense.hpp"
#include "base/parallel.hpp"
#include "elasticity/polar.hpp"

namespace pliant {

namespace {

/// Derivative by d of d / rho, rho^2 = |d|^2 + width^2: I / rho - d d^T / rho^3.
Matrix6 kernel(const Strain6& d, double width) {
  const double square = d.squaredNorm() + width * width, inverse = 1.0 / std::sqrt(square);
  Matrix6 H = inverse * Matrix6::Identity();
  H.noalias() -= (inverse / square) * d * d.transpose();
  return H;
}

/// Energy, stress and, where asked for, stiffness of weights v at d from their sample.
struct FieldAt {
  double energy = 0.0;
  Strain6 stress = Strain6::Zero();
  Matrix6 stiffness = Matrix6::Zero();

  void add(const Strain6& d, const Strain6& v, double width, bool with_stiffness) {
    const double square = d.squaredNorm() + width * width, inverse = 1.0 / std::sqrt(square), along = d.dot(v);
    const double cubed = inverse / square;
    energy += inverse * along;
    stress += inverse * v - cubed * along * d;
    if (!with_stiffness) return;
    stiffness.diagonal().array() -= cubed * along;
    stiffness.noalias() -= cubed * (v * d.transpose() + d * v.transpose());
    stiffness.noalias() += (3.0 * cubed / square * along) * d * d.transpose();
  }
};

}  // namespace

SampledLaw::SampledLaw(std::shared_ptr<const TabulatedLaw> law, std::vector<StressSamples> elements)
    : law_(std::move(law)) {
  if (!law_ || law_->element_count() != int(elements.size()))
    throw std::invalid_argument("sampled stresses need a law of as many elements");
  for (StressSamples& samples : elements) {
    if (samples.strains.size() != samples.weights.size() || !(samples.width > 0.0))
      throw std::invalid_argument("sampled stresses need a width > 0, and a weight a strain");
    Element& element = elements_.emplace_back();
    element.centres.emplace_back(Strain6::Zero());
    element.weights.emplace_back(Strain6::Zero());
    for (std::size_t i = 0; i < samples.strains.size(); ++i) {
      element.centres.push_back(to_mandel(samples.strains[i]));
      element.weights.push_back(to_mandel(samples.weights[i]));
      element.weights[0] -= samples.width * kernel(element.centres.back(), samples.width) * element.weights.back();
    }
    element.given = std::move(samples);
  }
}

void SampledLaw::stress(int e, const Matrix3& F, bool with_tangent, PointStress& out) const {
  law_->stress(e, F, with_tangent, out);
  const Element& element = elements_[std::size_t(e)];
  if (element.given.strains.empty() || !std::isfinite(out.energy)) return;
  const Polar polar = polar_decomposition(F);
  const Strain6 m = to_mandel(components_of(polar.S - Matrix3::Identity()));
  FieldAt at, rest;
  for (std::size_t i = 0; i < element.centres.size(); ++i) {
    at.add(m - element.centres[i], element.weights[i], element.given.width, with_tangent);
    rest.add(-element.centres[i], element.weights[i], element.given.width, false);
  }
  out.energy += at.energy - rest.energy;
  add_strain_stress(polar, tensor_of(from_mandel(at.stress)), with_tangent ? &at.stiffness : nullptr, out);
}

SmallStrainModuli SampledLaw::small_strain(int e) const {
  constexpr double least_part = 0.05;  // of the law's own
  const SmallStrainModuli own = law_->small_strain(e);
  const Element& element = elements_[std::size_t(e)];
  FieldAt rest;
  for (std::size_t i = 0; i < element.centres.size(); ++i)
    rest.add(-element.centres[i], element.weights[i], element.given.width, true);
  const double bulk = own.youngs_modulus / (3.0 * (1.0 - 2.0 * own.poissons_ratio)),
               mu = own.youngs_modulus / (2.0 * (1.0 + own.poissons_ratio));
  // Of an isotropic stiffness, 3 K along the identity and 2 mu five times across.
  const double thrice = rest.stiffness.topLeftCorner<3, 3>().sum() / 3.0;
  const double K = std::max(bulk + thrice / 3.0, least_part * bulk),
               G = std::max(mu + (rest.stiffness.trace() - thrice) / 10.0, least_part * mu);
  return {9.0 * K * G / (3.0 * K + G), (3.0 * K - 2.0 * G) / (2.0 * (3.0 * K + G))};
}

// ---- from fits

namespace {

constexpr double least_share = 0.05;  // of the greatest strain: what is strained less says little

/// One element's samples, in Mandel's components.
struct ElementSamples {
  std::vector<Strain6> strains, stresses;
  double greatest_strain = 0.0, greatest_stress = 0.0;

  void add(const Strain6& strain, const Strain6& stress) {
    strains.push_back(to_mandel(strain));
    stresses.push_back(to_mandel(stress));
    greatest_strain = std::max(greatest_strain, strains.back().norm());
    greatest_stress = std::max(greatest_stress, stresses.back().norm());
  }
};

/// dW/de of a law's only element in Mandel's components; nothing where the law knows no such strain.
std::optional<Strain6> stress_of(const MaterialLaw& law, const Strain6& strain) {
  const Matrix3 S = Matrix3::Identity() + tensor_of(from_mandel(strain));
  PointStress at;
  law.stress(0, S, false, at);
  if (!std::isfinite(at.energy) || !(S.determinant() > 0.0)) return std::nullopt;
  return to_mandel(components_of(at.P));
}

/// The numbers of one element's law by its samples' stresses: Levenberg-Marquardt from the shared numbers, and held to
/// them, as normal priors are. Unknowns are logarithms of moduli, exponents over three, and logits of Poisson's ratios
/// over (-1/2, 1/2); laws without exponents have one factor of all moduli.
class OwnLaw {
 public:
  OwnLaw(const TabulatedLaw& shared, int e, const ElementSamples& samples)
      : samples_(samples), shared_(shared.with_table(shared.table().row(e))), law_(shared_) {
    const std::vector<std::string> names = shared.parameter_names();
    const bool has_exponents = std::ranges::any_of(names, &OwnLaw::is_exponent);
    int moduli = -1;
    for (const std::string& name : names) {
      const bool is_modulus = !is_exponent(name) && !is_ratio(name);
      if (is_modulus && !has_exponents && moduli >= 0) {
        unknown_.push_back(moduli);
        continue;
      }
      if (is_modulus) moduli = count_;
      unknown_.push_back(count_++);
    }
    names_ = names;
  }

  /// Three times: the samples are trusted as far as the law before can meet them.
  std::shared_ptr<const TabulatedLaw> run() {
    if (!(samples_.greatest_stress > 0.0)) return law_;
    VectorX x = VectorX::Zero(count_);
    for (int pass = 0; pass < 3; ++pass) {
      minimise(x);
      trusted_ = std::clamp(1.5 * misfit_, most_trusted, least_trusted);
    }
    return law_;
  }

 private:
  void minimise(VectorX& x) {
    constexpr int most_iterations = 15;
    MatrixX H;
    VectorX g;
    double cost = linearise(x, H, g), damping = 1e-3;
    for (int iteration = 0; iteration < most_iterations && std::isfinite(cost); ++iteration) {
      MatrixX damped = H;
      damped.diagonal() *= 1.0 + damping;
      VectorX step = -solve_symmetric(damped, g);
      step *= 1.0 / std::max(1.0, step.cwiseAbs().maxCoeff());
      const auto before = law_;
      const double misfit_before = misfit_;
      MatrixX next_H;
      VectorX next_g;
      const double next = set(x + step) ? linearise(x + step, next_H, next_g) : std::numeric_limits<double>::infinity();
      if (next < cost) {
        const bool is_done = cost - next < 1e-4 * cost;
        x += step, cost = next, H = std::move(next_H), g = std::move(next_g);
        damping *= 0.2;
        if (is_done) break;
      } else {
        law_ = before, misfit_ = misfit_before;
        damping = 10.0 * std::max(damping, 1e-3);
        if (damping > 1e6) break;
      }
    }
  }

  static constexpr double exponent_unit = 3.0;
  /// Of stress, relative to the greatest: what the samples are trusted to against the shared numbers.
  static constexpr double most_trusted = 0.002, least_trusted = 0.1;
  static bool is_exponent(const std::string& name) { return name.starts_with("exponent"); }
  static bool is_ratio(const std::string& name) { return name.starts_with("poissons_ratio"); }

  double number(std::size_t c, double x) const {
    const double before = shared_->table()(0, Eigen::Index(c));
    if (is_exponent(names_[c])) return before + exponent_unit * x;
    if (is_ratio(names_[c])) return 1.0 / (1.0 + (0.5 - before) / (0.5 + before) * std::exp(-x)) - 0.5;
    return before * std::exp(x);
  }
  double slope(std::size_t c, double value) const {
    if (is_exponent(names_[c])) return exponent_unit;
    if (is_ratio(names_[c])) return (0.5 + value) * (0.5 - value);
    return value;
  }
  bool set(const VectorX& x) {
    MatrixX table = shared_->table();
    for (std::size_t c = 0; c < names_.size(); ++c) {
      double& value = table(0, Eigen::Index(c));
      value = number(c, x[unknown_[c]]);
      if (!std::isfinite(value) || (is_exponent(names_[c]) && std::abs(value) < 0.01)) return false;
    }
    law_ = shared_->with_table(table);
    return true;
  }
  /// Half the squares with the priors', their gradient and Gauss and Newton's matrix.
  double linearise(const VectorX& x, MatrixX& H, VectorX& g) {
    const double weight = 1.0 / (trusted_ * samples_.greatest_stress);
    H = MatrixX::Identity(count_, count_);
    g = x;
    double cost = 0.5 * x.squaredNorm(), squares = 0.0, told = 1e-12;
    std::vector<Matrix3> by(names_.size());
    MatrixX J(6, count_);
    for (std::size_t i = 0; i < samples_.strains.size(); ++i) {
      const std::optional<Strain6> stress = stress_of(*law_, samples_.strains[i]);
      if (!stress) continue;
      law_->parameter_derivatives(0, Matrix3::Identity() + tensor_of(from_mandel(samples_.strains[i])), by);
      J.setZero();
      for (std::size_t c = 0; c < names_.size(); ++c)
        J.col(unknown_[c]) += weight * slope(c, law_->table()(0, Eigen::Index(c))) * to_mandel(components_of(by[c]));
      const VectorX r = weight * (*stress - samples_.stresses[i]);
      cost += 0.5 * r.squaredNorm();
      const double telling = samples_.stresses[i].norm() / samples_.greatest_stress;
      squares += telling * r.squaredNorm(), told += telling;
      H.noalias() += J.transpose() * J;
      g.noalias() += J.transpose() * r;
    }
    misfit_ = trusted_ * std::sqrt(squares / told);
    return cost;
  }

  const ElementSamples& samples_;
  std::shared_ptr<const TabulatedLaw> shared_, law_;
  std::vector<std::string> names_;
  std::vector<int> unknown_;  // of each number
  int count_ = 0;
  double trusted_ = 0.05;
  double misfit_ = 0.0;  // relative to the greatest stress, by how much each sample tells
};

struct Selection {
  std::shared_ptr<const TabulatedLaw> law;
  StressSamples samples;
  double square_misfit = 0.0;        // of the law's stress, summed over the element's samples
  std::vector<double> square_error;  // summed over the element's samples, with 0, 1, ... in the basis
};

/// What an element's law leaves of its samples, by few of them.
class Remainder {
 public:
  Remainder(const ElementSamples& samples, const TabulatedLaw& law, const BasisOptions& options)
      : samples_(samples), law_(law), options_(options), n_(Eigen::Index(samples.strains.size())) {}

  void select(Selection& selection) {
    selection.samples.width = width_ = width_share * std::max(samples_.greatest_strain, 1e-9);
    left_ = VectorX::Zero(6 * n_);
    for (Eigen::Index i = 0; i < n_; ++i)
      if (const auto own = stress_of(law_, samples_.strains[std::size_t(i)]))
        left_.segment<6>(6 * i) = samples_.stresses[std::size_t(i)] - *own;
    const double unit = samples_.greatest_stress;
    selection.square_error.push_back(unit > 0.0 ? left_.squaredNorm() / (unit * unit) : 0.0);
    if (!(unit > 0.0)) return;
    VectorX error = left_, weights;
    for (;;) {
      const Eigen::Index worst = worst_of(error);
      if (worst < 0 || int(taken_.size()) == options_.max_samples) break;
      take(worst);
      weights = weights_at(choice_ridge);
      error = left_ - basis() * weights;
      selection.square_error.push_back(error.squaredNorm() / (unit * unit));
    }
    if (taken_.empty()) {
      selection.square_misfit = selection.square_error.back();
      return;
    }
    weights = weights_at(best_ridge());
    double share = 1.0;
    while (share > 0.1 && !is_stiff_enough(share * weights)) share *= 0.5;
    if (share < 0.1) share = 0.0;
    selection.square_misfit = (left_ - share * basis() * weights).squaredNorm() / (unit * unit);
    if (share == 0.0) return;
    for (std::size_t k = 0; k < taken_.size(); ++k) {
      selection.samples.strains.push_back(from_mandel(samples_.strains[std::size_t(taken_[k])]));
      // The basis is the kernel times the width.
      selection.samples.weights.push_back(from_mandel(share * width_ * weights.segment<6>(6 * Eigen::Index(k))));
    }
  }

 private:
  static constexpr double width_share = 0.5;  // of the greatest strain
  static constexpr double choice_ridge = 1e-3;
  static constexpr double telling_share = 0.1;  // of the greatest stress

  Eigen::Index worst_of(const VectorX& error) const {
    double greatest = options_.tolerance * samples_.greatest_stress;
    Eigen::Index worst = -1;
    for (Eigen::Index i = 0; i < n_; ++i)
      if (const double size = error.segment<6>(6 * i).norm();
          size > greatest && std::ranges::find(taken_, i) == taken_.end())
        greatest = size, worst = i;
    return worst;
  }

  /// Covariance of stresses at two strains, with no stress at no strain, times the width.
  Matrix6 covariance(const Strain6& a, const Strain6& b) const {
    return width_ * kernel(a - b, width_) - width_ * width_ * kernel(a, width_) * kernel(b, width_);
  }
  MatrixX::ConstColsBlockXpr basis() const { return basis_.leftCols(6 * Eigen::Index(taken_.size())); }

  void take(Eigen::Index sample) {
    const Eigen::Index before = 6 * Eigen::Index(taken_.size());
    if (basis_.size() == 0) {
      const Eigen::Index most = 6 * std::min<Eigen::Index>(options_.max_samples, n_);
      basis_.resize(6 * n_, most), squares_.resize(most, most), norm_.resize(most, most);
    }
    taken_.push_back(sample);
    for (Eigen::Index i = 0; i < n_; ++i)
      basis_.block<6, 6>(6 * i, before) =
          covariance(samples_.strains[std::size_t(i)], samples_.strains[std::size_t(sample)]);
    const MatrixX cross = basis().transpose() * basis_.middleCols<6>(before);
    squares_.block(0, before, before + 6, 6) = cross;
    squares_.block(before, 0, 6, before + 6) = cross.transpose();
    for (std::size_t k = 0; k < taken_.size(); ++k) {
      const Matrix6 between = basis_.block<6, 6>(6 * taken_[k], before);
      norm_.block<6, 6>(6 * Eigen::Index(k), before) = between;
      norm_.block<6, 6>(before, 6 * Eigen::Index(k)) = between.transpose();
    }
  }
  /// Least |left - B w|^2 + ridge w . K w.
  VectorX weights_at(double ridge) const {
    const Eigen::Index m = 6 * Eigen::Index(taken_.size());
    MatrixX A = squares_.topLeftCorner(m, m) + ridge * norm_.topLeftCorner(m, m);
    A.diagonal().array() += 1e-9;
    return A.llt().solve(basis().transpose() * left_);
  }

  /// Of the greatest evidence: where stresses are a Gaussian process with the kernel as covariance and errors of ridge
  /// times its scale, which is unknown. Samples of little stress have little to say about errors.
  double best_ridge() const {
    const Eigen::Index m = 6 * Eigen::Index(taken_.size());
    Eigen::Index n = 0;
    MatrixX B(6 * n_, m);
    VectorX left(6 * n_);
    for (Eigen::Index i = 0; i < n_; ++i) {
      if (samples_.stresses[std::size_t(i)].norm() < telling_share * samples_.greatest_stress) continue;
      B.middleRows<6>(n) = basis().middleRows<6>(6 * i);
      left.segment<6>(n) = left_.segment<6>(6 * i);
      n += 6;
    }
    MatrixX K = norm_.topLeftCorner(m, m);
    K.diagonal().array() += 1e-9;
    const Eigen::LLT<MatrixX> root(K);
    const MatrixX half = root.matrixL().solve(MatrixX(B.topRows(n).transpose()));
    const SymmetricEigen eigen = symmetric_eigen(half * half.transpose());
    const Eigen::ArrayXd z = (eigen.vectors.transpose() * (half * left.head(n))).array().square();
    const Eigen::ArrayXd lambda = eigen.values.array().max(0.0);
    const double square = left.head(n).squaredNorm();
    double best = choice_ridge, least = std::numeric_limits<double>::infinity();
    for (double ridge = 1e-5; ridge < 200.0; ridge *= std::sqrt(10.0)) {
      const double form = (square - (z / (lambda + ridge)).sum()) / ridge;
      const double against = 0.5 * ((lambda + ridge).log().sum() + double(n - m) * std::log(ridge)) +
                             0.5 * double(n) * std::log(std::max(form, 1e-300));
      if (against < least) best = ridge, least = against;
    }
    return best;
  }

  Strain6 own(const Strain6& m, const VectorX& weights) const {
    Strain6 stress = Strain6::Zero();
    for (std::size_t k = 0; k < taken_.size(); ++k)
      stress += covariance(m, samples_.strains[std::size_t(taken_[k])]) * weights.segment<6>(6 * Eigen::Index(k));
    return stress;
  }
  /// Whether the work of stress grows along the straight paths through the samples, and three times as far, at least a
  /// fifth as much as that of the law alone.
  bool is_stiff_enough(const VectorX& weights) const {
    constexpr std::array parts = {0.1, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0};
    constexpr double least_part = 0.2;
    for (const Strain6& strain : samples_.strains) {
      if (strain.norm() < least_share * samples_.greatest_strain) continue;
      double law_before = 0.0, all_before = 0.0;
      for (const double t : parts) {
        const Strain6 m = t * strain;
        const std::optional<Strain6> of_law = stress_of(law_, m);
        if (!of_law) break;
        const double by_law = strain.dot(*of_law), all = by_law + strain.dot(own(m, weights));
        if (all < least_part * by_law) return false;
        if (all - all_before < least_part * std::min(by_law - law_before, by_law / t * 0.5)) return false;
        law_before = by_law, all_before = all;
      }
    }
    return true;
  }

  const ElementSamples& samples_;
  const TabulatedLaw& law_;
  const BasisOptions& options_;
  Eigen::Index n_;
  double width_ = 1.0;
  VectorX left_;                     // of the samples' stresses by the law
  std::vector<Eigen::Index> taken_;  // numbers of samples
  MatrixX basis_, squares_, norm_;   // B, B^T B, K of those
};

}  // namespace

SampledMaterial sample_material(const std::shared_ptr<const TabulatedLaw>& shared,
                                const std::vector<MaterialSample>& samples, const BasisOptions& options) {
  if (samples.empty()) throw std::invalid_argument("a sampled material needs samples");
  const int count = shared->element_count();
  std::vector<Selection> selections{std::size_t(count)};
  parallel_for(0, count, [&](int e) {
    ElementSamples own;
    for (const MaterialSample& sample : samples)
      own.add(sample.strains.row(e).transpose(), sample.stresses.row(e).transpose());
    Selection& selection = selections[std::size_t(e)];
    selection.law = OwnLaw(*shared, e, own).run();
    Remainder(own, *selection.law, options).select(selection);
  });
  SampledMaterial material;
  std::vector<StressSamples> elements;
  for (std::size_t size = 0; size <= std::size_t(options.max_samples); ++size) {
    double sum = 0.0;
    for (const Selection& s : selections) sum += s.square_error[std::min(size, s.square_error.size() - 1)];
    material.error_by_size.push_back(std::sqrt(sum / double(count) / double(samples.size())));
  }
  double misfit = 0.0;
  MatrixX table(count, shared->table().cols());
  for (int e = 0; e < count; ++e) {
    Selection& s = selections[std::size_t(e)];
    table.row(e) = s.law->table();
    misfit += s.square_misfit;
    material.mean_samples += double(s.samples.strains.size()) / double(count);
    elements.push_back(std::move(s.samples));
  }
  material.stress_misfit = std::sqrt(misfit / double(count) / double(samples.size()));
  material.law = std::make_shared<SampledLaw>(shared->with_table(std::move(table)), std::move(elements));
  return material;
}

}  // namespace pliant
