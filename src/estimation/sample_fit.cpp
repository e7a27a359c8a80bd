#include "estimation/sample_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "elasticity/lame.hpp"

namespace pliant {

namespace {

constexpr double least_ratio = -0.5;
/// The misfit aimed at is a little above what noise makes: that is itself a matter of chance, and the last of it would
/// be bought by wild fields.
constexpr double slack = 1.2;
constexpr double least_fall = 0.005;  // of the cost in one iteration

using Sparse = Eigen::SparseMatrix<double>;

Sparse umbrella(const Body& body) {
  std::vector<std::vector<int>> elements_of(std::size_t(body.node_count()));
  for (int e = 0; e < body.element_count(); ++e)
    for (const int node : body.element(e)) elements_of[std::size_t(node)].push_back(e);
  std::vector<Eigen::Triplet<double>> entries;
  for (int e = 0; e < body.element_count(); ++e) {
    std::set<int> neighbours;
    for (const int node : body.element(e))
      neighbours.insert(elements_of[std::size_t(node)].begin(), elements_of[std::size_t(node)].end());
    neighbours.erase(e);
    entries.emplace_back(e, e, double(neighbours.size()));
    for (const int other : neighbours) entries.emplace_back(e, other, -1.0);
  }
  Sparse L(body.element_count(), body.element_count());
  L.setFromTriplets(entries.begin(), entries.end());
  return L;
}

}  // namespace

struct ElementSmoothness::Factors {
  Sparse A;
  // Every element has some seventy neighbours: up to a few thousand elements the factor is full anyway, and full
  // triangles are solved many columns at a time.
  static constexpr Eigen::Index most_dense = 4000;
  Eigen::LLT<MatrixX> dense;
  Eigen::SimplicialLLT<Sparse> sparse;
  bool is_dense() const { return A.rows() <= most_dense; }
};

ElementSmoothness::ElementSmoothness(const Body& body) : factors_(std::make_unique<Factors>()) {
  const Sparse L = umbrella(body);
  Sparse identity(L.rows(), L.cols());
  identity.setIdentity();
  factors_->A = Sparse(L.transpose() * L);
  // So that a field that is wrong by a constant everywhere costs little against one that changes between neighbours.
  factors_->A += 1e-7 * factors_->A.diagonal().mean() * identity;
  if (factors_->is_dense())
    factors_->dense.compute(MatrixX(factors_->A));
  else
    factors_->sparse.compute(factors_->A);
}
ElementSmoothness::~ElementSmoothness() = default;
ElementSmoothness::ElementSmoothness(ElementSmoothness&&) noexcept = default;
int ElementSmoothness::size() const { return int(factors_->A.rows()); }
MatrixX ElementSmoothness::times(const MatrixX& x) const { return factors_->A * x; }
MatrixX ElementSmoothness::solve(const MatrixX& x) const {
  if (factors_->is_dense()) return factors_->dense.solve(x);
  return factors_->sparse.solve(x);
}
MatrixX ElementSmoothness::half_solve(const MatrixX& x) const {
  if (factors_->is_dense()) return factors_->dense.matrixL().solve(x);
  const MatrixX permuted = factors_->sparse.permutationP() * x;
  return factors_->sparse.matrixL().solve(permuted);
}

double unconstrained_ratio(double nu) { return std::log((nu - least_ratio) / (0.5 - nu)); }
double ratio_of(double z) { return least_ratio + (0.5 - least_ratio) / (1.0 + std::exp(-z)); }

ChangedLaw::ChangedLaw(std::shared_ptr<const MaterialLaw> about, std::vector<SmallStrainModuli> secant, MatrixX table)
    : about_(std::move(about)), secant_(std::move(secant)) {
  set_table(std::move(table));
}

void ChangedLaw::check(const MatrixX& table) const {
  if (table.cols() != 2 || table.rows() != Eigen::Index(secant_.size()) || table.rows() != about_->element_count())
    throw std::invalid_argument("a changed law has two parameters an element");
  for (Eigen::Index e = 0; e < table.rows(); ++e)
    if (!(table(e, 0) > 0.0 && table(e, 1) > -1.0 && table(e, 1) < 0.5))
      throw std::invalid_argument("a changed law needs a factor > 0 and -1 < nu < 1/2");
}

void ChangedLaw::stress(int e, const Matrix3& F, bool with_tangent, PointStress& out) const {
  about_->stress(e, F, with_tangent, out);
  if (!std::isfinite(out.energy)) return;
  const double factor = table_(e, 0), E = secant_[std::size_t(e)].youngs_modulus;
  out.energy *= factor;
  out.P *= factor;
  if (with_tangent) out.tangent *= factor;
  const UnitLame now = unit_lame(table_(e, 1)), begin = unit_lame(secant_[std::size_t(e)].poissons_ratio);
  const double mu = factor * E * (now.mu - begin.mu), lambda = factor * E * (now.lambda - begin.lambda);
  if (mu == 0.0 && lambda == 0.0) return;
  const Polar polar = polar_decomposition(F);
  const Matrix3 strain = polar.S - Matrix3::Identity();
  Matrix3 T = 2.0 * mu * strain;
  T.diagonal().array() += lambda * strain.trace();
  out.energy += 0.5 * T.cwiseProduct(strain).sum();
  Matrix6 C = 2.0 * mu * Matrix6::Identity();
  C.topLeftCorner<3, 3>().array() += lambda;
  add_strain_stress(polar, T, with_tangent ? &C : nullptr, out);
}

void ChangedLaw::parameter_derivatives(int e, const Matrix3& F, std::span<Matrix3> out) const {
  PointStress at;
  stress(e, F, false, at);
  const double factor = table_(e, 0), E = secant_[std::size_t(e)].youngs_modulus;
  out[0] = at.P / factor;
  const UnitLame now = unit_lame(table_(e, 1));
  const Polar polar = polar_decomposition(F);
  const Matrix3 strain = polar.S - Matrix3::Identity();
  Matrix3 T = 2.0 * now.d_mu * strain;
  T.diagonal().array() += now.d_lambda * strain.trace();
  out[1] = factor * E * polar.R * T;
}

SmallStrainModuli ChangedLaw::small_strain(int e) const { return about_->small_strain(e); }

namespace {

MatrixX table_of(const VectorX& q) {
  const Eigen::Index count = q.size() / 2;
  MatrixX table(count, 2);
  for (Eigen::Index e = 0; e < count; ++e) table.row(e) << std::exp(q[e]), ratio_of(q[count + e]);
  return table;
}

/// d(factor, nu) / d(ln factor, z) of an element.
Eigen::Vector2d table_derivative(double factor, double nu) {
  return {factor, (nu - least_ratio) * (0.5 - nu) / (0.5 - least_ratio)};
}

}  // namespace

MatrixX sample_jacobian(PressedBody& body, const Body& mesh, const ChangedLaw& law, JacobianBy by) {
  const int n = mesh.node_count(), count = mesh.element_count();
  const Embedding& points = body.embedding();
  Equilibrium& equilibrium = body.equilibrium();
  const int rows = n + equilibrium.contact_count(), coordinates = 3 * body.point_count();
  MatrixX J(coordinates, 2 * count);
  // Derivatives of dW/dx by an element's two unknowns, 3 N x 2.
  const auto for_elements = [&](const auto& visit) {
    equilibrium.elasticity().for_parameter_derivatives(
        [&](int e, std::span<const int> nodes, const Eigen::Ref<const MatrixX>& by_q) {
          const MatrixX derivative = by_q * table_derivative(law.table()(e, 0), law.table()(e, 1)).asDiagonal();
          visit(e, nodes, derivative);
        });
  };
  if (by == JacobianBy::Tangents) {
    for_elements([&](int e, std::span<const int> nodes, const MatrixX& derivative) {
      for (int k = 0; k < 2; ++k) {
        Points forces = Points::Zero(rows, 3);
        for (std::size_t a = 0; a < nodes.size(); ++a)
          forces.row(nodes[a]) -= derivative.col(k).segment<3>(3 * Eigen::Index(a)).transpose();
        const Points& change = equilibrium.response(forces);
        Points moved = Points::Zero(body.point_count(), 3);
        moved.topRows(points.point_count()) = points.positions(change.topRows(n));
        if (body.has_probe()) moved.row(moved.rows() - 1) = change.row(n);
        J.col(k * count + e) = flat(moved);
      }
    });
    return J;
  }
  constexpr int together = 32;
  MatrixX responses(3 * rows, coordinates);  // H^-1 of each coordinate's own unit force
  std::vector<Points> some;
  for (int first = 0; first < coordinates; first += together) {
    some.assign(std::size_t(std::min(together, coordinates - first)), Points::Zero(rows, 3));
    for (int k = 0; k < int(some.size()); ++k) {
      const int point = (first + k) / 3, axis = (first + k) % 3;
      Points& forces = some[std::size_t(k)];
      if (point < points.point_count()) {
        Points nodal = Points::Zero(n, 3);
        points.add_transpose(point, Vector3::Unit(axis), nodal);
        forces.topRows(n) = nodal;
      } else {
        forces(n, axis) = 1.0;
      }
    }
    equilibrium.respond(some);
    for (int k = 0; k < int(some.size()); ++k) responses.col(first + k) = flat(some[std::size_t(k)]);
  }
  for_elements([&](int e, std::span<const int> nodes, const MatrixX& derivative) {
    MatrixX own(Eigen::Index(3 * nodes.size()), coordinates);
    for (std::size_t a = 0; a < nodes.size(); ++a)
      own.middleRows<3>(3 * Eigen::Index(a)) = responses.middleRows<3>(3 * Eigen::Index(nodes[a]));
    const MatrixX block = -own.transpose() * derivative;
    J.col(e) = block.col(0);
    J.col(count + e) = block.col(1);
  });
  return J;
}

namespace {

class SampleFit {
 public:
  SampleFit(const PressScene& scene, int press, const std::shared_ptr<const MaterialLaw>& about, const MatrixX& strains,
            const ElementSmoothness& smoothness, const SampleFitOptions& options)
      : mesh_(*scene.body),
        seen_(scene.presses[std::size_t(press)]),
        smoothness_(smoothness),
        options_(options),
        q_(2 * smoothness.size()) {
    std::vector<SmallStrainModuli> secant = secant_moduli(*about, strains);
    q_.setZero();
    for (Eigen::Index e = 0; e < smoothness.size(); ++e)
      q_[smoothness.size() + e] = unconstrained_ratio(secant[std::size_t(e)].poissons_ratio);
    start_ = q_;
    law_ = std::make_shared<ChangedLaw>(about, std::move(secant), table_of(q_));
    body_.emplace(scene, press, law_, mean_modulus(mesh_, *about));
  }

  PressSample run() {
    PressSample result;
    if (!solve(q_)) {
      result.failure = body_->equilibrium().failure();
      return result;
    }
    result.start_rms = rms();
    double damping = 0.0;
    bool is_new = true;
    for (int rejected = 0; result.iterations < options_.max_iterations; ++result.iterations) {
      if (is_new && !linearise()) {
        result.failure = "the equilibrium is not stable";
        return result;
      }
      const VectorX last = q_;
      const double last_weight = result.weight, gamma = std::max(choose_weight(), 1e-3 * last_weight),
                   cost = cost_of(gamma);
      VectorX step = step_for(gamma, damping);
      const double longest = step.cwiseAbs().maxCoeff();
      if (longest > 1.0) step /= longest;  // a factor of e at most
      q_ = last + step;
      const bool solved = solve(q_);
      is_new = solved && cost_of(gamma) < cost;
      result.weight = gamma;
      if (is_new) {
        rejected = 0;
        damping *= 0.3;
        // A cost that no longer falls is the end only where gamma has come to rest, too.
        const bool is_at_rest = std::abs(std::log(gamma / last_weight)) < 1.0;
        if (step.cwiseAbs().maxCoeff() < options_.step_tolerance ||
            (is_at_rest && cost - cost_of(gamma) < least_fall * cost))
          result.converged = true;
      } else {
        q_ = last;
        damping = std::max(0.3, 5.0 * damping);
        (void)solve(q_);
        if (step.cwiseAbs().maxCoeff() < options_.step_tolerance || ++rejected == 6) result.converged = true;
      }
      if (result.converged) break;
    }
    result.rms = rms();
    body_->equilibrium().elasticity().evaluate(body_->placement().nodes, false);
    result.sample.strains = body_->equilibrium().elasticity().strains();
    result.sample.stresses = stresses_of(*law_, result.sample.strains);
    result.succeeded = result.sample.stresses.allFinite();
    if (!result.succeeded) result.failure = "an element is turned inside out";
    return result;
  }

 private:
  bool solve(const VectorX& q) {
    law_ = std::dynamic_pointer_cast<const ChangedLaw>(law_->with_table(table_of(q)));
    body_->equilibrium().set_law(law_);
    if (!body_->solve().converged) return false;
    Points residuals = body_->points();
    for (Eigen::Index m = 0; m < residuals.rows(); ++m) residuals.row(m) -= seen_.loaded[std::size_t(m)].transpose();
    r_ = flat(residuals).cwiseQuotient(options_.deviations);
    return true;
  }
  double rms() const { return std::sqrt(3.0 * r_.cwiseProduct(options_.deviations).squaredNorm() / double(r_.size())); }

  VectorX smooth(const VectorX& d) const {
    VectorX out(d.size());
    out << smoothness_.times(d.head(d.size() / 2)), smoothness_.times(d.tail(d.size() / 2));
    return out;
  }
  double cost_of(double gamma) const {
    const VectorX d = q_ - start_;
    return 0.5 * r_.squaredNorm() + 0.5 * gamma * d.dot(smooth(d));
  }

  /// J over the noise, and G = J A^-1 J^T by its eigenvalues.
  bool linearise() {
    Equilibrium& equilibrium = body_->equilibrium();
    if (!equilibrium.prepare_derivatives(body_->placement())) return false;
    const auto by = r_.size() < q_.size() ? JacobianBy::Adjoints : JacobianBy::Tangents;
    J_ = options_.deviations.cwiseInverse().asDiagonal() * sample_jacobian(*body_, mesh_, *law_, by);
    const Eigen::Index half = q_.size() / 2;
    MatrixX G = MatrixX::Zero(J_.rows(), J_.rows());
    for (const Eigen::Index begin : {Eigen::Index(0), half}) {
      const MatrixX W = smoothness_.half_solve(J_.middleCols(begin, half).transpose());
      G.selfadjointView<Eigen::Lower>().rankUpdate(W.transpose());
    }
    G_.compute(G);
    return G_.info() == Eigen::Success;
  }

  /// Where the noise is known, the greatest weight with which the linearised misfit is what noise makes (discrepancy
  /// principle): where the field is fitted with gamma, the residual is gamma (gamma I + G)^-1 b, b = r - J (q - q0).
  /// Where its scale s is not, the weight of the greatest evidence: with fields of covariance s^2 A^-1 / gamma, b has
  /// s^2 (I + G / gamma), and with b_k along G's eigenvectors, for the best s,
  ///   ln p = -1/2 sum ln(1 + g_k / gamma) - n/2 ln sum b_k^2 / (1 + g_k / gamma).
  /// In either case no further in one step than the linear model is good for: to a tenth of the squares.
  double choose_weight() const {
    const VectorX b = G_.eigenvectors().transpose() * (r_ - J_ * (q_ - start_));
    const Eigen::ArrayXd squares = b.cwiseAbs2().array(), g = G_.eigenvalues().cwiseMax(0.0).array();
    const double top = std::max(g.maxCoeff(), 1e-300), count = double(b.size()), tenth = 0.1 * r_.squaredNorm();
    const auto misfit = [&](double t) { return ((1.0 + g * std::exp(-t)).inverse().square() * squares).sum(); };
    const auto against = [&](double t) {
      const Eigen::ArrayXd spread = 1.0 + g * std::exp(-t);
      return 0.5 * spread.log().sum() + 0.5 * count * std::log((squares / spread).sum() + 1e-300);
    };
    const double lowest = std::log(1e-13 * top), highest = std::log(1e3 * top);
    // The greatest with no more than this misfit.
    const auto greatest = [&](double aim) {
      double low = lowest, high = highest;
      if (misfit(low) > aim) return low;
      if (misfit(high) < aim) return high;
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (misfit(middle) > aim ? high : low) = middle;
      }
      return low;
    };
    if (options_.is_scale_known) return std::exp(greatest(std::max(slack * count, tenth)));
    constexpr double step = 0.7;
    const double end = greatest(tenth);
    double best = highest, least = against(highest);
    for (double t = highest - step; t >= end; t -= step)
      if (const double value = against(t); value < least) best = t, least = value;
    return std::exp(best);
  }

  /// -(J^T J + (1 + damping) gamma A)^-1 (J^T r + gamma A d), d = q - q0, by G alone:
  /// with g = (1 + damping) gamma, (J^T J + g A)^-1 J^T = A^-1 J^T (G + g I)^-1, and A d moves along the same way.
  VectorX step_for(double gamma, double damping) const {
    const double g = (1.0 + damping) * gamma, back = gamma / g;
    const VectorX d = q_ - start_;
    // (J^T J + g A)^-1 gamma A d = back (d - A^-1 J^T (G + g I)^-1 J d)
    const VectorX right = r_ - back * (J_ * d);
    const VectorX turned = G_.eigenvectors().transpose() * right;
    const VectorX scaled = (turned.array() / (G_.eigenvalues().array().max(0.0) + g)).matrix();
    const VectorX pulled = J_.transpose() * (G_.eigenvectors() * scaled);
    const Eigen::Index half = d.size() / 2;
    VectorX step = -back * d;
    step.head(half) -= smoothness_.solve(pulled.head(half));
    step.tail(half) -= smoothness_.solve(pulled.tail(half));
    return step;
  }

  const Body& mesh_;
  const ObservedPress& seen_;
  const ElementSmoothness& smoothness_;
  SampleFitOptions options_;
  VectorX q_, start_, r_;
  std::shared_ptr<const ChangedLaw> law_;
  std::optional<PressedBody> body_;
  MatrixX J_;
  Eigen::SelfAdjointEigenSolver<MatrixX> G_;
};

}  // namespace

SmallStrainModuli secant_moduli(const Matrix3& strain, const Matrix3& stress, const SmallStrainModuli& at_rest) {
  constexpr double hold = 0.01;  // of the moduli at rest, as a share of the squares of strain
  constexpr double least_part = 0.05, least_nu = -0.45, most_nu = 0.49;
  // Stress a e + b tr(e) I, with a = lambda (1 - 2 nu), b = lambda nu.
  const LambdaAlpha rest = lambda_alpha(at_rest);
  const Eigen::Vector2d before(rest.lambda - 2.0 * rest.alpha, rest.alpha);
  const double trace = strain.trace(), square = strain.squaredNorm();
  if (!(square > 0.0)) return at_rest;
  Eigen::Matrix2d A;
  A << square, trace * trace, trace * trace, 3.0 * trace * trace;
  A.diagonal().array() += hold * square;
  const Eigen::Vector2d right(stress.cwiseProduct(strain).sum(), trace * stress.trace());
  const Eigen::Vector2d ab = A.ldlt().solve(right + hold * square * before);
  const double lambda = std::max(ab[0] + 2.0 * ab[1], least_part * rest.lambda);
  const double nu = std::clamp(ab[1] / lambda, least_nu, most_nu);
  return moduli_of({lambda, lambda * nu});
}

std::vector<SmallStrainModuli> secant_moduli(const MaterialLaw& law, const MatrixX& strains) {
  const MatrixX stresses = stresses_of(law, strains);
  std::vector<SmallStrainModuli> moduli;
  for (int e = 0; e < int(strains.rows()); ++e) {
    const SmallStrainModuli rest = law.small_strain(e);
    moduli.push_back(stresses.row(e).allFinite() ? secant_moduli(tensor_of(strains.row(e).transpose()),
                                                                 tensor_of(stresses.row(e).transpose()), rest)
                                                 : rest);
  }
  return moduli;
}

MatrixX stresses_of(const MaterialLaw& law, const MatrixX& strains) {
  MatrixX stresses(strains.rows(), 6);
  PointStress point;
  for (int e = 0; e < int(strains.rows()); ++e) {
    law.stress(e, Matrix3::Identity() + tensor_of(strains.row(e).transpose()), false, point);
    if (std::isfinite(point.energy))
      stresses.row(e) = components_of(point.P).transpose();
    else
      stresses.row(e).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return stresses;
}

PressSample fit_sample(const PressScene& scene, int press, const std::shared_ptr<const MaterialLaw>& about,
                       const MatrixX& strains, const ElementSmoothness& smoothness, const SampleFitOptions& options) {
  return SampleFit(scene, press, about, strains, smoothness, options).run();
}

}  // namespace pliant
