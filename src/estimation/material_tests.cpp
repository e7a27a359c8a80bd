#include "estimation/material_tests.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pliant {

namespace {

/// dP for a change of F, by a law's tangent in its frame.
Matrix3 stress_change(const PointStress& at, const Matrix3& dF) {
  const Matrix3 in_frame = at.left.transpose() * dF * at.right;
  Matrix3 change;
  Eigen::Map<Eigen::Matrix<double, 9, 1>>(change.data()).noalias() =
      at.tangent * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(in_frame.data());
  return at.left * change * at.right.transpose();
}

/// A cube whose sides that are free share one stretch, exp(x).
struct Cube {
  Matrix3 led;   // F but for the free sides, which are zero; without shear
  Vector3 free;  // 1 where a side is free
  Matrix3 at(double x) const {
    Matrix3 F = led;
    F.diagonal() += std::exp(x) * free;
    return F;
  }
};

Cube cube_of(const MaterialTest& test, std::size_t i) {
  const double l = test.stretch[i];
  switch (test.mode) {
    case TestMode::Uniaxial:
      return {Vector3(l, 0.0, 0.0).asDiagonal(), {0.0, 1.0, 1.0}};
    case TestMode::PureShear:
      return {Vector3(l, 1.0, 0.0).asDiagonal(), {0.0, 0.0, 1.0}};
    case TestMode::Equibiaxial:
      return {Vector3(l, l, 0.0).asDiagonal(), {0.0, 0.0, 1.0}};
    case TestMode::Biaxial:
      return {Vector3(l, test.second[i], 0.0).asDiagonal(), {0.0, 0.0, 1.0}};
    case TestMode::SimpleShear:
      return {Vector3(test.prestretch, 0.0, 0.0).asDiagonal(), {0.0, 1.0, 1.0}};
    case TestMode::ConfinedUniaxial:
      break;
  }
  return {Vector3(l, 1.0, 1.0).asDiagonal(), Vector3::Zero()};
}

/// Slope of the energy by x and the slope's own, at the law's answer `s`. False where they are not finite.
bool slopes(const Cube& cube, double x, const PointStress& s, double& g, double& h) {
  const double side = std::exp(x);
  const Matrix3 direction = cube.free.asDiagonal();
  g = side * s.P.cwiseProduct(direction).sum();
  h = g + side * side * stress_change(s, direction).cwiseProduct(direction).sum();
  return std::isfinite(s.energy) && std::isfinite(g) && std::isfinite(h);
}

/// The free stretch's logarithm. `s` is the law's answer there.
bool find_free_stretch(const MaterialLaw& law, int e, const Cube& cube, double& x, PointStress& s) {
  constexpr int most = 200;
  constexpr double longest = 0.5, farthest = 12.0;
  // Of a material that keeps its volume.
  double volume = 1.0;
  for (int d = 0; d < 3; ++d)
    if (cube.free[d] == 0.0) volume *= cube.led(d, d);
  x = -std::log(volume) / cube.free.sum();
  double low = -farthest, high = farthest, g = 0.0, h = 0.0, last = x, slope_before = 0.0;
  for (int k = 0; k < most; ++k) {
    law.stress(e, cube.at(x), true, s);
    if (!slopes(cube, x, s, g, h)) {  // too far
      if (k == 0) return false;
      (x > last ? high : low) = x;
      x = 0.5 * (x + last);
      continue;
    }
    (g < 0.0 ? low : high) = x;
    last = x;
    // On the steep side of an exponential Newton's steps are short: halve the bracket where they gain too little.
    const bool slow = k > 0 && std::abs(g) > 0.25 * std::abs(slope_before) && high - low < 2.0 * longest;
    slope_before = g;
    const double step = h > 0.0 ? -g / h : g < 0.0 ? longest : -longest;
    if (g == 0.0 || (h > 0.0 && std::abs(step) < 1e-14) || high - low < 1e-14) return true;
    double next = x + std::clamp(step, -longest, longest);
    if (slow || next <= low || next >= high) next = 0.5 * (low + high);
    if (std::abs(next - x) <= 4e-16 * std::max(1.0, std::abs(x))) return true;
    if (next < 1.0 - farthest) return false;  // the side shrinks to nothing: the linear law, stretched too far
    x = next;
  }
  return false;
}

/// The test's stress, and by what it changes with P and F.
double measured(const MaterialTest& test, const Matrix3& F, const Matrix3& P, Matrix3& by_P, Matrix3& by_F) {
  by_P.setZero(), by_F.setZero();
  if (test.measure == StressMeasure::CauchyDifference) {
    const double J = F.determinant();
    const Matrix3 cauchy = P * F.transpose() / J;
    const double difference = cauchy(0, 0) - cauchy(1, 1);
    by_P.row(0) = F.row(0) / J, by_P.row(1) = -F.row(1) / J;
    by_F.row(0) = P.row(0) / J, by_F.row(1) = -P.row(1) / J;
    by_F -= difference * F.inverse().transpose();
    return difference;
  }
  const int row = test.measure == StressMeasure::Second ? 1 : 0;
  const int column = test.mode == TestMode::SimpleShear && row == 0 ? 1 : row;
  by_P(row, column) = 1.0;
  return P(row, column);
}

}  // namespace

double MaterialTest::greatest_stress() const {
  double greatest = 0.0;
  for (const double s : stress) greatest = std::max(greatest, std::abs(s));
  return greatest;
}

void check_test(const MaterialTest& test) {
  const auto refuse = [&](const char* what) { throw std::invalid_argument(test.name + ": " + what); };
  if (test.stretch.empty() || test.stretch.size() != test.stress.size())
    refuse("a test has as many stresses as stretches, at least one");
  if (test.mode == TestMode::Biaxial && test.second.size() != test.stretch.size())
    refuse("a biaxial test has a second stretch a point");
  const auto finite = [](double v) { return std::isfinite(v); };
  const auto positive = [](double v) { return std::isfinite(v) && v > 0.0; };
  if (!std::ranges::all_of(test.stress, finite)) refuse("stresses must be finite");
  if (test.mode == TestMode::SimpleShear ? !std::ranges::all_of(test.stretch, finite) || !positive(test.prestretch)
                                         : !std::ranges::all_of(test.stretch, positive))
    refuse("stretches must be positive and shears finite");
  if (test.mode == TestMode::Biaxial && !std::ranges::all_of(test.second, positive))
    refuse("stretches must be positive");
  if (!test.std.empty() && (test.std.size() != test.stress.size() || !std::ranges::all_of(test.std, positive)))
    refuse("a test has as many standard deviations as stresses, above zero, or none");
  if (test.greatest_stress() == 0.0) refuse("all stresses are zero");
}

TestPoint solve_test(const MaterialLaw& law, int element, const MaterialTest& test, std::size_t i,
                     bool with_derivatives) {
  TestPoint point;
  const Cube cube = cube_of(test, i);
  const bool has_free = cube.free.sum() > 0.0;
  double x = 0.0;
  PointStress free_state;
  if (has_free && !find_free_stretch(law, element, cube, x, free_state)) return point;
  point.F = cube.at(x);
  if (test.mode == TestMode::SimpleShear) point.F(0, 1) = test.stretch[i];
  PointStress s;
  law.stress(element, point.F, with_derivatives, s);
  if (!std::isfinite(s.energy)) return point;
  point.P = s.P;
  Matrix3 by_P, by_F;
  point.stress = measured(test, point.F, point.P, by_P, by_F);
  point.found = std::isfinite(point.stress);
  if (!with_derivatives || !point.found) return point;
  const std::size_t parameters = law.parameter_names().size();
  std::vector<Matrix3> by_q(parameters), free_by_q(parameters);
  law.parameter_derivatives(element, point.F, by_q);
  point.by_parameters.resize(Eigen::Index(parameters));
  // One more of x changes the free sides by their stretch, and the stress with them.
  double by_x = 0.0, g = 0.0, h = 1.0;
  if (has_free) {
    const Matrix3 dF = (std::exp(x) * cube.free).asDiagonal();
    by_x = by_P.cwiseProduct(stress_change(s, dF)).sum() + by_F.cwiseProduct(dF).sum();
    slopes(cube, x, free_state, g, h);
    law.parameter_derivatives(element, cube.at(x), free_by_q);
    for (std::size_t k = 0; k < parameters; ++k)
      point.by_parameters[Eigen::Index(k)] = -by_x / h * free_by_q[k].cwiseProduct(dF).sum();
  } else {
    point.by_parameters.setZero();
  }
  for (std::size_t k = 0; k < parameters; ++k) point.by_parameters[Eigen::Index(k)] += by_P.cwiseProduct(by_q[k]).sum();
  return point;
}

std::vector<double> predict_test(const MaterialLaw& law, const MaterialTest& test) {
  std::vector<double> stresses;
  for (std::size_t i = 0; i < test.stretch.size(); ++i) {
    const TestPoint point = solve_test(law, 0, test, i);
    stresses.push_back(point.found ? point.stress : not_a_number);
  }
  return stresses;
}

double relative_rms(const MaterialTest& test, const std::vector<double>& predicted) {
  double sum = 0.0;
  for (std::size_t i = 0; i < predicted.size(); ++i)
    sum += (predicted[i] - test.stress[i]) * (predicted[i] - test.stress[i]);
  return std::sqrt(sum / double(predicted.size())) / test.greatest_stress();
}

std::vector<double> secant_moduli(const MaterialTest& test) {
  std::vector<double> secants;
  for (std::size_t i = 0; i < test.stretch.size(); ++i) {
    const double strain = test.mode == TestMode::SimpleShear ? test.stretch[i] / 3.0 : test.stretch[i] - 1.0;
    if (std::abs(strain) > 1e-3 && test.stress[i] / strain > 0.0) secants.push_back(test.stress[i] / strain);
  }
  return secants;
}

std::shared_ptr<const Body> unit_element(int controls) {
  Points nodes(4, 3);
  nodes << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  auto body = std::make_shared<Body>(make_body(make_tet_mesh(nodes, {{0, 1, 2, 3}})));
  if (controls > 1) {
    body->modulus.controls = controls;
    body->modulus.weights = MatrixX::Zero(1, controls);
    body->modulus.weights(0, 0) = 1.0;
  }
  return body;
}

CurveTrial::CurveTrial(MaterialTest test, int number, const LawLayout& layout, double noise,
                       const ParameterSet& parameters)
    : test_(std::move(test)), number_(number), layout_(layout), noise_(noise) {
  if (!(noise_ > 0.0)) throw std::invalid_argument("curves need a noise above zero");
  check_test(test_);
  set_layout(layout, parameters);
}

void CurveTrial::set_layout(const LawLayout& layout, const ParameterSet& parameters) {
  layout_ = layout;
  body_ = unit_element(layout.form().controls);
  bounded_.clear();
  const std::vector<ParameterHandle> own = layout.all();
  for (const Parameter& p : parameters.parameters())
    if (p.transform == Transform::Shift && std::ranges::find(own, p.at) != own.end()) bounded_.push_back(p);
}

double CurveTrial::std_of(std::size_t point) const {
  return test_.std.empty() ? noise_ * test_.greatest_stress() : test_.std[point];
}

CostEvaluation CurveTrial::run(const VectorX& theta, const MatrixX& directions) {
  CostEvaluation result;
  if (!theta.allFinite()) return result.failure = test_.name + ": the law's numbers are not finite", result;
  for (const Parameter& p : bounded_)
    if (!(theta[p.at] >= p.lower && theta[p.at] <= p.upper))
      return result.failure = p.name + " leaves its bounds", result;
  const auto law = press_law(*body_, layout_, theta);
  const Eigen::Index n = directions.cols();
  const MatrixX by_p = n > 0 ? MatrixX(law_parameters_by_theta(*body_, layout_, theta, 0) * directions) : MatrixX();
  FrameFit fit;
  fit.recording = recording_;
  fit.frame = number_;
  fit.independent = double(test_.stretch.size());
  if (n > 0) fit.gradient = VectorX::Zero(n), fit.gauss_newton = MatrixX::Zero(n, n);
  for (std::size_t i = 0; i < test_.stretch.size(); ++i) {
    const TestPoint point = solve_test(*law, 0, test_, i, n > 0);
    if (!point.found) return result.failure = test_.name + ": no state without stress on the free faces", result;
    const double inverse = 1.0 / std_of(i), r = inverse * (point.stress - test_.stress[i]);
    fit.cost += 0.5 * r * r;
    if (n == 0) continue;
    const VectorX J = inverse * (by_p.transpose() * point.by_parameters);
    fit.gradient += r * J;
    fit.gauss_newton += J * J.transpose();
  }
  result.cost = fit.cost;
  result.steps = 1;
  result.frames.push_back(std::move(fit));
  result.succeeded = true;
  return result;
}

CostEvaluation CurveTrial::gradient(const VectorX& theta, VectorX& theta_bar) {
  CostEvaluation result = run(theta, MatrixX::Identity(theta.size(), theta.size()));
  if (result.succeeded) theta_bar = result.frames.front().gradient;
  return result;
}

}  // namespace pliant
