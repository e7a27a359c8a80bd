#include "elasticity/material_law.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "elasticity/polar.hpp"
#include "elasticity/third_derivatives.hpp"

namespace pliant {

namespace {

// Differences of fourth order: (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12 h. Their error is h^4 against 1e-16 / h.
constexpr double difference_step = 2e-4;  // |dF| of a step
constexpr std::array<std::pair<double, double>, 4> difference_rule = {
    {{1.0, 8.0 / 12.0}, {-1.0, -8.0 / 12.0}, {2.0, -1.0 / 12.0}, {-2.0, 1.0 / 12.0}}};

}  // namespace

Matrix9 MaterialLaw::tangent_derivative(int element, const Matrix3& F, const Matrix3& dF) const {
  Matrix9 change = Matrix9::Zero();
  const double size = dF.norm();
  if (size == 0.0) return change;
  const double h = difference_step / size;
  PointStress at;
  for (const auto& [steps, weight] : difference_rule) {
    stress(element, F + steps * h * dF, true, at);
    if (!std::isfinite(at.energy)) return Matrix9::Constant(std::numeric_limits<double>::quiet_NaN());
    change += weight / h * world_tangent(at);
  }
  return change;
}

void MaterialLaw::parameter_derivative_changes(int element, const Matrix3& F, const Matrix3& dF,
                                               std::span<Matrix3> out) const {
  for (Matrix3& change : out) change.setZero();
  const double size = dF.norm();
  if (size == 0.0) return;
  const double h = difference_step / size;
  std::vector<Matrix3> at(out.size());
  for (const auto& [steps, weight] : difference_rule) {
    parameter_derivatives(element, F + steps * h * dF, at);
    for (std::size_t k = 0; k < out.size(); ++k) out[k] += weight / h * at[k];
  }
}

Matrix9 world_tangent(const PointStress& s) {
  Matrix9 turn;  // vec(left A right^T) = turn vec(A)
  for (int j = 0; j < 3; ++j)
    for (int l = 0; l < 3; ++l) turn.block<3, 3>(3 * j, 3 * l) = s.right(j, l) * s.left;
  const Matrix9 left = turn.lazyProduct(s.tangent);  // small: without the blocking of large products
  return left.lazyProduct(turn.transpose());
}

double tangent_modulus(const MaterialLaw& law, int element, const Matrix3& F) {
  PointStress at;
  law.stress(element, F, true, at);
  if (!std::isfinite(at.energy)) return std::numeric_limits<double>::quiet_NaN();
  return tangent_modulus(world_tangent(at), polar_decomposition(F));
}

double tangent_modulus(const Matrix9& tangent, const Polar& polar) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> strain(Matrix3(polar.S - Matrix3::Identity()));
  Eigen::Index greatest = 0;
  strain.eigenvalues().cwiseAbs().maxCoeff(&greatest);
  // Symmetric matrices in Mandel's components; with R fixed, dP = R d(dW/dU) but for its antisymmetric part.
  constexpr std::array<std::pair<int, int>, 6> pairs = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  const auto component = [&](const Matrix3& m, std::size_t k) {
    const auto [i, j] = pairs[k];
    return i == j ? m(i, i) : std::sqrt(0.5) * (m(i, j) + m(j, i));
  };
  Matrix6 stiffness;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [i, j] = pairs[k];
    Matrix3 dU = Matrix3::Zero();
    dU(i, j) = dU(j, i) = i == j ? 1.0 : std::sqrt(0.5);
    const Vector9 change = tangent * vec(Matrix3(polar.R * dU));
    const Matrix3 dP = Eigen::Map<const Matrix3>(change.data());
    for (std::size_t l = 0; l < pairs.size(); ++l)
      stiffness(Eigen::Index(l), Eigen::Index(k)) = component(polar.R.transpose() * dP, l);
  }
  const Vector3 n = strain.eigenvectors().col(greatest);
  Strain6 along;
  for (std::size_t k = 0; k < pairs.size(); ++k) along[Eigen::Index(k)] = component(n * n.transpose(), k);
  return 1.0 / along.dot(stiffness.partialPivLu().solve(along));
}

namespace {

class ScaledLaw : public MaterialLaw {
 public:
  ScaledLaw(std::shared_ptr<const MaterialLaw> law, double factor) : law_(std::move(law)), factor_(factor) {}
  std::string name() const override { return law_->name(); }
  int element_count() const override { return law_->element_count(); }
  void stress(int element, const Matrix3& F, bool with_tangent, PointStress& out) const override {
    law_->stress(element, F, with_tangent, out);
    out.energy *= factor_;
    out.P *= factor_;
    if (with_tangent) out.tangent *= factor_;
  }
  SmallStrainModuli small_strain(int element) const override {
    const SmallStrainModuli m = law_->small_strain(element);
    return {factor_ * m.youngs_modulus, m.poissons_ratio};
  }
  bool is_isotropic() const override { return law_->is_isotropic(); }
  bool has_principal_frame() const override { return law_->has_principal_frame(); }
  Matrix9 tangent_derivative(int element, const Matrix3& F, const Matrix3& dF) const override {
    return factor_ * law_->tangent_derivative(element, F, dF);
  }

 private:
  std::shared_ptr<const MaterialLaw> law_;
  double factor_;
};

}  // namespace

std::shared_ptr<const MaterialLaw> scaled_law(std::shared_ptr<const MaterialLaw> law, double factor) {
  if (!(factor > 0.0)) throw std::invalid_argument("a material's factor must be positive");
  return factor == 1.0 ? law : std::make_shared<ScaledLaw>(std::move(law), factor);
}

void TabulatedLaw::set_table(MatrixX table) {
  if (!table.allFinite()) throw std::invalid_argument("a material's parameters must be finite");
  check(table);
  table_ = std::move(table);
}

LambdaAlpha lambda_alpha(const SmallStrainModuli& m) {
  const double lambda = m.youngs_modulus / ((1.0 + m.poissons_ratio) * (1.0 - 2.0 * m.poissons_ratio));
  return {lambda, lambda * m.poissons_ratio};
}

SmallStrainModuli moduli_of(const LambdaAlpha& p) {
  const double nu = p.alpha / p.lambda;
  return {p.lambda * (1.0 + nu) * (1.0 - 2.0 * nu), nu};
}

namespace {

using Vector9 = Eigen::Matrix<double, 9, 1>;

/// vee(A - A^T); vee(T S - S T) is that of A = T S.
Vector3 twice_axis(const Matrix3& A) { return {A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)}; }

const double root_half = std::sqrt(0.5);

/// Mandel's components of the symmetric part.
Strain6 mandel_of(const Matrix3& A) {
  Strain6 m;
  m << A(0, 0), A(1, 1), A(2, 2), root_half * (A(0, 1) + A(1, 0)), root_half * (A(0, 2) + A(2, 0)),
      root_half * (A(1, 2) + A(2, 1));
  return m;
}
Matrix3 symmetric_of(const Strain6& m) {
  Matrix3 A;
  A << m[0], root_half * m[3], root_half * m[4],  //
      root_half * m[3], m[1], root_half * m[5],   //
      root_half * m[4], root_half * m[5], m[2];
  return A;
}

}  // namespace

/// R^T dF = [w]x S + dS with (tr(S) I - S) w = vee(skew part). So Z = R^T P, whose work must be that of T alone, has
/// the symmetric part T and a skew part [a]x such that Z S is symmetric: (tr(S) I - S) a = -vee(T S - S T), which
/// vanishes where T has the axes of S, as it does in isotropic materials. With A = R^T dF, w = M A and dS = D A,
///   R^T dP = [w]x Z + D^T C D A - [Q (vee(T dS - dS T) + tr(dS) a - dS a)]x,   Q = (tr(S) I - S)^-1.
void set_strain_stress(const Polar& polar, const Matrix3& T, const Matrix6* C, PointStress& out) {
  const Matrix3 &S = polar.S, &Q = polar.rate_inverse;
  const Vector3 a = -(Q * twice_axis(T * S));
  const Matrix3 Z = T + cross_matrix(a);
  out.P = polar.R * Z;
  if (!C) return;
  out.left = polar.R;
  out.right.setIdentity();
  Eigen::Matrix<double, 3, 9> M = Eigen::Matrix<double, 3, 9>::Zero();
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 2) % 3, j = (k + 1) % 3;  // A(i, j) - A(j, i) turns about axis k
    M.col(i + 3 * j) = Q.col(k);
    M.col(j + 3 * i) = -Q.col(k);
  }
  Eigen::Matrix<double, 6, 3> turned;   // of S, by each axis
  Eigen::Matrix<double, 9, 3> along_Z;  // [w]x Z
  for (int k = 0; k < 3; ++k) {
    const Matrix3 turn = cross_matrix(Vector3::Unit(k));
    turned.col(k) = mandel_of(turn * S);
    const Matrix3 z = turn * Z;
    along_Z.col(k) = Eigen::Map<const Vector9>(z.data());
  }
  Eigen::Matrix<double, 6, 9> D = Eigen::Matrix<double, 6, 9>::Zero();
  D(0, 0) = D(1, 4) = D(2, 8) = 1.0;
  D(3, 1) = D(3, 3) = D(4, 2) = D(4, 6) = D(5, 5) = D(5, 7) = root_half;
  D.noalias() -= turned * M;
  Eigen::Matrix<double, 3, 6> rate;  // of a by dS at the same T
  for (int c = 0; c < 6; ++c) {
    const Matrix3 dS = symmetric_of(Strain6::Unit(c));
    rate.col(c) = twice_axis(T * dS) + dS.trace() * a - dS * a;
  }
  const Eigen::Matrix<double, 3, 9> da = -Q * (rate * D);
  const Eigen::Matrix<double, 6, 9> CD = *C * D;
  out.tangent.noalias() = D.transpose() * CD;
  out.tangent.noalias() += along_Z * M;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 2) % 3, j = (k + 1) % 3;
    out.tangent.row(i + 3 * j) += da.row(k);
    out.tangent.row(j + 3 * i) -= da.row(k);
  }
}

void add_strain_stress(const Polar& polar, const Matrix3& T, const Matrix6* C, PointStress& out) {
  PointStress own;
  set_strain_stress(polar, T, C, own);
  out.P += own.P;
  if (!C) return;
  const Matrix3 left = polar.R.transpose() * out.left;
  Matrix9 turn;  // vec(left A right^T) = turn vec(A)
  for (int j = 0; j < 3; ++j)
    for (int l = 0; l < 3; ++l) turn.block<3, 3>(3 * j, 3 * l) = out.right(j, l) * left;
  const Matrix9 turned = turn * out.tangent;
  own.tangent.noalias() += turned * turn.transpose();
  out.left = own.left, out.right = own.right, out.tangent = own.tangent;
}

std::shared_ptr<TabulatedLaw> tabulated_law(const std::string& name, MatrixX table) {
  if (name == "linear") return std::make_shared<LinearLaw>(std::move(table));
  if (name == "neo_hookean") return std::make_shared<NeoHookeanLaw>(std::move(table));
  if (name == "ogden") return std::make_shared<OgdenLaw>(std::move(table));
  return nullptr;
}

Matrix3 tensor_of(const Strain6& e) {
  Matrix3 tensor;
  tensor << e[0], e[3], e[4],  //
      e[3], e[1], e[5],        //
      e[4], e[5], e[2];
  return tensor;
}

Strain6 components_of(const Matrix3& t) {
  Strain6 components;
  components << t(0, 0), t(1, 1), t(2, 2), 0.5 * (t(0, 1) + t(1, 0)), 0.5 * (t(0, 2) + t(2, 0)),
      0.5 * (t(1, 2) + t(2, 1));
  return components;
}

Strain6 to_mandel(const Strain6& components) {
  Strain6 m = components;
  m.tail<3>() *= std::sqrt(2.0);
  return m;
}

Strain6 from_mandel(const Strain6& mandel) {
  Strain6 e = mandel;
  e.tail<3>() *= root_half;
  return e;
}

// ---- linear

void LinearLaw::check(const MatrixX& table) const {
  if (table.cols() != 2) throw std::invalid_argument("the linear law has two parameters an element");
  for (Eigen::Index e = 0; e < table.rows(); ++e)
    if (const auto [E, nu] = moduli_of({table(e, 0), table(e, 1)}); !(table(e, 0) > 0.0 && nu > -1.0 && nu < 0.5))
      throw std::invalid_argument("the linear law needs lambda > 0 and -lambda < alpha < lambda / 2");
}

void LinearLaw::stress(int e, const Matrix3& F, bool with_tangent, PointStress& out) const {
  const Polar polar = polar_decomposition(F);
  const double alpha = table_(e, 1), twice_mu = table_(e, 0) - 2.0 * alpha;
  Matrix3 strain = polar.S - Matrix3::Identity();
  Matrix3 T = twice_mu * strain;
  T.diagonal().array() += alpha * strain.trace();
  out.energy = 0.5 * T.cwiseProduct(strain).sum();
  if (!with_tangent) {
    out.P = polar.R * T;
    return;
  }
  Matrix6 C = twice_mu * Matrix6::Identity();
  C.topLeftCorner<3, 3>().array() += alpha;
  set_strain_stress(polar, T, &C, out);
}

void LinearLaw::parameter_derivatives(int, const Matrix3& F, std::span<Matrix3> out) const {
  const Polar polar = polar_decomposition(F);
  const Matrix3 strain = polar.S - Matrix3::Identity();
  out[0] = polar.R * strain;
  out[1] = polar.R * (strain.trace() * Matrix3::Identity() - 2.0 * strain);
}

SmallStrainModuli LinearLaw::small_strain(int e) const { return moduli_of({table_(e, 0), table_(e, 1)}); }

// ---- Ogden

PrincipalStretches::PrincipalStretches(const Matrix3& F) {
  if (!(F.determinant() > 0.0)) return;
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(F.transpose() * F);
  stretch = solver.eigenvalues().cwiseMax(1e-300).cwiseSqrt();
  V = solver.eigenvectors();
  U = F * V * stretch.cwiseInverse().asDiagonal();
  is_valid = stretch.allFinite() && stretch.minCoeff() > 1e-100;
}

namespace {

using StretchLanes = Eigen::Array<double, int(PrincipalStretches::lanes), 1>;

/// Symmetric 3 x 3 matrices, one a lane, on their way to diagonal ones, and the rotations that lead there.
struct JacobiLanes {
  std::array<StretchLanes, 3> diagonal, off;                // off[k] is entry (k + 1, k + 2), indices modulo three
  std::array<std::array<StretchLanes, 3>, 3> eigenvectors;  // by column

  /// Takes the entry off[k] away.
  void rotate(std::size_t k) {
    const std::size_t p = (k + 1) % 3, q = (k + 2) % 3;
    const StretchLanes gap = diagonal[q] - diagonal[p], twice = 2.0 * off[k];
    // The tangent of the smaller angle; the last term is for what is diagonal and equal.
    const StretchLanes t =
        (gap < 0.0).select(-twice, twice) / (gap.abs() + (gap * gap + twice * twice).sqrt() + 1e-300);
    const StretchLanes c = (1.0 + t * t).sqrt().inverse(), s = t * c;
    diagonal[p] -= t * off[k];
    diagonal[q] += t * off[k];
    off[k].setZero();
    const auto turn = [&](StretchLanes& at_p, StretchLanes& at_q) {
      const StretchLanes before = at_p;
      at_p = c * before - s * at_q;
      at_q = s * before + c * at_q;
    };
    turn(off[q], off[p]);
    for (std::size_t i = 0; i < 3; ++i) turn(eigenvectors[p][i], eigenvectors[q][i]);
  }
  bool is_diagonal() const {
    constexpr double negligible = 1e-34;  // squared, against the two diagonal entries
    for (std::size_t k = 0; k < 3; ++k)
      if ((off[k] * off[k] > negligible * diagonal[(k + 1) % 3] * diagonal[(k + 2) % 3]).any()) return false;
    return true;
  }
};

}  // namespace

void PrincipalStretches::find(std::span<const Matrix3* const> F, std::span<PrincipalStretches> out) {
  constexpr int most_sweeps = 12;
  if (F.empty()) return;
  JacobiLanes jacobi;
  for (std::size_t l = 0; l < lanes; ++l) {
    const Matrix3& own = *F[l < F.size() ? l : 0];
    const Matrix3 C = own.transpose() * own;
    const auto lane = Eigen::Index(l);
    for (std::size_t k = 0; k < 3; ++k) {
      jacobi.diagonal[k][lane] = C(Eigen::Index(k), Eigen::Index(k));
      jacobi.off[k][lane] = C(Eigen::Index((k + 1) % 3), Eigen::Index((k + 2) % 3));
      for (std::size_t i = 0; i < 3; ++i) jacobi.eigenvectors[k][i][lane] = i == k ? 1.0 : 0.0;
    }
  }
  for (int sweep = 0; sweep < most_sweeps && !jacobi.is_diagonal(); ++sweep)
    for (std::size_t k = 0; k < 3; ++k) jacobi.rotate(k);
  for (std::size_t l = 0; l < F.size(); ++l) {
    PrincipalStretches& p = out[l];
    p.is_valid = F[l]->determinant() > 0.0;
    if (!p.is_valid) continue;
    std::array<std::size_t, 3> order = {0, 1, 2};
    const auto square = [&](std::size_t k) { return jacobi.diagonal[k][Eigen::Index(l)]; };
    std::ranges::sort(order, {}, square);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto column = Eigen::Index(k);
      p.stretch[column] = std::sqrt(std::max(square(order[k]), 1e-300));
      for (std::size_t i = 0; i < 3; ++i)
        p.V(Eigen::Index(i), column) = jacobi.eigenvectors[order[k]][i][Eigen::Index(l)];
    }
    p.U = *F[l] * p.V * p.stretch.cwiseInverse().asDiagonal();
    p.is_valid = p.stretch.allFinite() && p.stretch.minCoeff() > 1e-100;
  }
}

namespace {

/// (exp(-a b ln J) - 1) / b, also for b = 0.
/// @param bulk_1  exp(-a b ln J) - 1
double volumetric(double a, double b, double log_J, double bulk_1) {
  const double x = -a * b * log_J;
  return std::abs(x) < 1e-8 ? -a * log_J * (1.0 + 0.5 * x) : bulk_1 / b;
}

double beta_of(double nu) { return nu / (1.0 - 2.0 * nu); }

}  // namespace

std::vector<std::string> OgdenLaw::parameter_names() const {
  std::vector<std::string> names;
  for (int i = 1; i <= terms(); ++i)
    for (const char* name : {"mu_", "exponent_", "poissons_ratio_"}) names.push_back(name + std::to_string(i));
  return names;
}

void OgdenLaw::check(const MatrixX& table) const {
  if (table.cols() == 0 || table.cols() % 3 != 0)
    throw std::invalid_argument("Ogden's law has three parameters a term");
  for (Eigen::Index e = 0; e < table.rows(); ++e)
    for (Eigen::Index c = 0; c < table.cols(); c += 3)
      if (!(table(e, c) > 0.0 && table(e, c + 1) != 0.0 && table(e, c + 2) > -1.0 && table(e, c + 2) < 0.5))
        throw std::invalid_argument("Ogden's law needs mu > 0, an exponent other than 0 and -1 < nu < 1/2");
}

void OgdenLaw::stress(int e, const Matrix3& F, bool with_tangent, PointStress& out) const {
  stress_of(e, PrincipalStretches(F), with_tangent, out);
}

void OgdenLaw::stresses(std::span<const DeformedPoint> points, bool with_tangent) const {
  std::array<PrincipalStretches, PrincipalStretches::lanes> stretches;
  std::array<const Matrix3*, PrincipalStretches::lanes> F;
  for (std::size_t first = 0; first < points.size(); first += stretches.size()) {
    const auto some = points.subspan(first, std::min(stretches.size(), points.size() - first));
    for (std::size_t l = 0; l < some.size(); ++l) F[l] = some[l].F;
    PrincipalStretches::find({F.data(), some.size()}, stretches);
    for (std::size_t l = 0; l < some.size(); ++l)
      stress_of(some[l].element, stretches[l], with_tangent, *some[l].stress);
  }
}

void OgdenLaw::stress_of(int e, const PrincipalStretches& p, bool with_tangent, PointStress& out) const {
  if (!p.is_valid) {
    out.energy = std::numeric_limits<double>::infinity();
    return;
  }
  const Vector3 l = p.stretch, log_l = l.array().log();
  const double log_J = log_l.sum();
  out.energy = 0.0;
  Vector3 first = Vector3::Zero();     // dW/dl_k
  Matrix3 second = Matrix3::Zero();    // d2W/dl_k dl_m
  Matrix3 quotient = Matrix3::Zero();  // (W_k - W_m) / (l_k - l_m), k < m
  for (int i = 0; i < terms(); ++i) {
    const double mu = table_(e, 3 * i), a = table_(e, 3 * i + 1), b = beta_of(table_(e, 3 * i + 2));
    const double factor = 2.0 * mu / a;
    // l^a - 1 and J^(-a b) - 1 by expm1, which keeps their digits near rest
    const Vector3 power_1{std::expm1(a * log_l[0]), std::expm1(a * log_l[1]), std::expm1(a * log_l[2])};
    const double bulk_1 = std::expm1(-a * b * log_J);
    out.energy += factor / a * (power_1.sum() + volumetric(a, b, log_J, bulk_1));
    for (int k = 0; k < 3; ++k) first[k] += factor * (power_1[k] - bulk_1) / l[k];
    if (!with_tangent) continue;
    const double bulk = 1.0 + bulk_1;
    for (int k = 0; k < 3; ++k)
      for (int m = 0; m < 3; ++m) {
        second(k, m) += factor * a * b * bulk / (l[k] * l[m]);
        if (k == m) second(k, k) += factor * ((a - 1.0) * (1.0 + power_1[k]) + bulk) / (l[k] * l[k]);
      }
  }
  out.P = p.U * first.asDiagonal() * p.V.transpose();
  if (!with_tangent) return;
  out.left = p.U;
  out.right = p.V;
  out.tangent.setZero();
  const auto at = [](int i, int j) { return i + 3 * j; };
  for (int k = 0; k < 3; ++k)
    for (int m = 0; m < 3; ++m) out.tangent(at(k, k), at(m, m)) = second(k, m);
  for (int k = 0; k < 3; ++k)
    for (int m = k + 1; m < 3; ++m) {
      const double gap = l[k] - l[m];
      // Where two stretches meet the quotient is W_kk - W_km, up to the square of their gap by the mean of both ends.
      quotient(k, m) = std::abs(gap) > 1e-5 * (l[k] + l[m]) ? (first[k] - first[m]) / gap
                                                            : 0.5 * (second(k, k) + second(m, m)) - second(k, m);
      const double twist = (first[k] + first[m]) / (l[k] + l[m]);
      const double same = 0.5 * (quotient(k, m) + twist), other = 0.5 * (quotient(k, m) - twist);
      out.tangent(at(k, m), at(k, m)) = out.tangent(at(m, k), at(m, k)) = same;
      out.tangent(at(k, m), at(m, k)) = out.tangent(at(m, k), at(k, m)) = other;
    }
}

/// Each term is one of the stretches one by one and one of ln J: 2 mu / (a^2 b) (exp(-a b ln J) - 1).
Matrix9 OgdenLaw::tangent_derivative(int e, const Matrix3& F, const Matrix3& dF) const {
  const PrincipalStretches p(F);
  if (!p.is_valid) return Matrix9::Constant(std::numeric_limits<double>::quiet_NaN());
  const double log_J = p.stretch.array().log().sum();
  OddPowers powers;
  double first = 0.0, second = 0.0, third = 0.0;  // by ln J
  for (int i = 0; i < terms(); ++i) {
    const double a = table_(e, 3 * i + 1), ab = a * beta_of(table_(e, 3 * i + 2)), factor = 2.0 * table_(e, 3 * i) / a;
    const double bulk = factor * std::exp(-ab * log_J);
    powers.add(factor, a - 1.0);
    first -= bulk, second += ab * bulk, third -= ab * ab * bulk;
  }
  return spectral_tangent_change(powers, p.stretch, p.U, p.V, dF) +
         volumetric_tangent_change(first, second, third, F, dF);
}

void OgdenLaw::parameter_derivatives(int e, const Matrix3& F, std::span<Matrix3> out) const {
  const PrincipalStretches p(F);
  for (Matrix3& derivative : out) derivative.setZero();
  if (!p.is_valid) return;
  const Vector3 l = p.stretch, log_l = l.array().log();
  const double log_J = log_l.sum();
  const auto in_frame = [&](const Vector3& principal_stress) -> Matrix3 {
    return p.U * principal_stress.asDiagonal() * p.V.transpose();
  };
  for (int i = 0; i < terms(); ++i) {
    const double mu = table_(e, 3 * i), a = table_(e, 3 * i + 1), nu = table_(e, 3 * i + 2), b = beta_of(nu);
    const double bulk_1 = std::expm1(-a * b * log_J), bulk = 1.0 + bulk_1;
    Vector3 by_mu, by_a, by_nu;
    for (int k = 0; k < 3; ++k) {
      const double power_1 = std::expm1(a * log_l[k]);
      by_mu[k] = 2.0 / a * (power_1 - bulk_1) / l[k];
      by_a[k] = -mu / a * by_mu[k] + 2.0 * mu / a * (log_l[k] * (1.0 + power_1) + b * log_J * bulk) / l[k];
      by_nu[k] = 2.0 * mu * log_J * bulk / l[k] / ((1.0 - 2.0 * nu) * (1.0 - 2.0 * nu));
    }
    out[3 * i] = in_frame(by_mu);
    out[3 * i + 1] = in_frame(by_a);
    out[3 * i + 2] = in_frame(by_nu);
  }
}

SmallStrainModuli OgdenLaw::small_strain(int e) const {
  double mu = 0.0, bulk = 0.0;
  for (int i = 0; i < terms(); ++i) {
    mu += table_(e, 3 * i);
    bulk += 2.0 * table_(e, 3 * i) * (1.0 / 3.0 + beta_of(table_(e, 3 * i + 2)));
  }
  return {9.0 * bulk * mu / (3.0 * bulk + mu), (3.0 * bulk - 2.0 * mu) / (2.0 * (3.0 * bulk + mu))};
}

}  // namespace pliant
