#include "elasticity/modes.hpp"

#include <Spectra/SymGEigsShiftSolver.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/error.hpp"
#include "base/profile.hpp"

namespace pliant {

namespace {

constexpr double iteration_tolerance = 1e-12;  // of Ritz values, relative
constexpr int most_restarts = 400;
constexpr double same_eigenvalue = 1e-9;  // relative: far above what the iteration leaves
/// s in units of E / (rho L^2), the square of a stretching wave's rate of crossing the body: below the first bending
/// mode of all but hair-thin bars, and far enough above zero that K + s M of a free body keeps ten digits.
constexpr double relative_shift = 1e-3;

/// Signs are free: the largest component is made positive, so that the same input gives the same shape.
void fix_sign(Points& shape) {
  Eigen::Index row = 0, column = 0;
  const double largest = shape.cwiseAbs().maxCoeff(&row, &column);
  if (largest > 0.0 && shape(row, column) < 0.0) shape = -shape;
}

void sort_ascending(Modes& modes) {
  std::vector<int> order(modes.shapes.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order,
                           [&](int a, int b) { return modes.squared_frequencies[a] < modes.squared_frequencies[b]; });
  VectorX values(modes.squared_frequencies.size());
  std::vector<Points> shapes;
  for (std::size_t i = 0; i < order.size(); ++i) {
    values[Eigen::Index(i)] = modes.squared_frequencies[order[i]];
    shapes.push_back(std::move(modes.shapes[std::size_t(order[i])]));
  }
  modes.squared_frequencies = std::move(values);
  modes.shapes = std::move(shapes);
}

}  // namespace

double Modes::frequency(int mode) const {
  return std::sqrt(std::max(0.0, squared_frequencies[mode])) / (2.0 * std::numbers::pi);
}

/// x -> M x over the free nodes' unknowns, as Spectra wants it.
class ModalAnalysis::Mass {
 public:
  using Scalar = double;
  Mass(const ModalAnalysis& analysis, const VectorX& theta) : analysis_(analysis), theta_(theta) {}
  Eigen::Index rows() const { return 3 * Eigen::Index(analysis_.free_.size()); }
  Eigen::Index cols() const { return rows(); }
  void perform_op(const double* x, double* y) const {
    Eigen::Map<VectorX>(y, rows()) = analysis_.gather(analysis_.mass_product(theta_, analysis_.scatter(x)));
  }

 private:
  const ModalAnalysis& analysis_;
  const VectorX& theta_;
};

/// b -> s (K + s M)^-1 b over the free nodes' unknowns, without the part along shapes that are known already.
class ModalAnalysis::Inverse {
 public:
  using Scalar = double;
  Inverse(const ModalAnalysis& analysis, const VectorX& theta, const std::vector<Points>& known)
      : analysis_(analysis), known_(known) {
    for (const Points& shape : known) known_momentum_.push_back(analysis.mass_product(theta, shape));
  }
  Eigen::Index rows() const { return 3 * Eigen::Index(analysis_.free_.size()); }
  Eigen::Index cols() const { return rows(); }
  void set_shift(double) {}  // the matrix is factorised already
  void perform_op(const double* b, double* y) const {
    Points x = analysis_.scatter(b);
    const VectorX rhs = flat(x);
    VectorX solution = VectorX::Zero(rhs.size());
    analysis_.solver_->solve(rhs, solution);
    x = as_points(solution);
    for (std::size_t k = 0; k < known_.size(); ++k) x -= flat(known_momentum_[k]).dot(flat(x)) * known_[k];
    Eigen::Map<VectorX>(y, rows()) = analysis_.shift_ * analysis_.gather(x);
  }

 private:
  const ModalAnalysis& analysis_;
  const std::vector<Points>& known_;
  std::vector<Points> known_momentum_;  // M phi
};

ModalAnalysis::ModalAnalysis(std::shared_ptr<const Body> body, const MotionBlocks& blocks, std::vector<int> held)
    : body_(std::move(body)),
      blocks_(blocks),
      held_(std::move(held)),
      elasticity_(make_elasticity(body_, blocks)),
      matrix_(body_->pattern) {
  std::ranges::sort(held_);
  held_.erase(std::unique(held_.begin(), held_.end()), held_.end());
  for (const int node : held_)
    if (node < 0 || node >= body_->node_count())
      throw InputError({{},
                        "held node " + std::to_string(node),
                        "nodes from 0 to " + std::to_string(body_->node_count() - 1),
                        "take them from the body whose modes are wanted"});
  for (int node = 0; node < body_->node_count(); ++node)
    if (!std::ranges::binary_search(held_, node)) free_.push_back(node);
  SolverOptions options;
  options.kind = best_direct_kind();
  solver_ = make_linear_solver(body_->pattern, options);
}

VectorX ModalAnalysis::gather(const Points& x) const {
  VectorX out(3 * Eigen::Index(free_.size()));
  for (std::size_t i = 0; i < free_.size(); ++i) out.segment<3>(3 * Eigen::Index(i)) = x.row(free_[i]).transpose();
  return out;
}

Points ModalAnalysis::scatter(const double* x) const {
  Points out = Points::Zero(body_->node_count(), 3);
  for (std::size_t i = 0; i < free_.size(); ++i) out.row(free_[i]) = Eigen::Map<const Eigen::RowVector3d>(x + 3 * i);
  return out;
}

Points ModalAnalysis::mass_product(const VectorX& parameters, const Points& x) const {
  Points out = Points::Zero(x.rows(), 3);
  body_->add_mass_product(parameters[blocks_.density], x, out);
  for (const int node : held_) out.row(node).setZero();
  return out;
}

bool ModalAnalysis::factorise(const VectorX& parameters) {
  const double density = parameters[blocks_.density];
  shift_ = relative_shift * blocks_.moduli(parameters).minCoeff() / (density * std::pow(body_->size(), 2));
  elasticity_->set_parameters(parameters);
  elasticity_->linearise(body_->reference_positions());
  matrix_.set_zero();
  elasticity_->add_matrix(1.0, matrix_);
  for (int b = 0; b < body_->pattern->block_count(); ++b)
    for (int d = 0; d < 3; ++d) matrix_.block(b)[4 * d] += shift_ * density * body_->mass[std::size_t(b)];
  for (const int node : held_) matrix_.constrain(node);
  return std::isfinite(shift_) && shift_ > 0.0 && solver_->factorise(matrix_);
}

bool ModalAnalysis::extend(const VectorX& parameters, int count, Modes& modes) {
  const Mass mass(*this, parameters);
  Inverse inverse(*this, parameters, modes.shapes);
  const Eigen::Index basis = std::min<Eigen::Index>(mass.rows(), std::max(2 * count + 8, 20));
  // In units of s, so that Spectra's absolute thresholds mean the same for all materials: lambda / s about the shift
  // -1.
  Spectra::SymGEigsShiftSolver<Inverse, const Mass, Spectra::GEigsMode::ShiftInvert> solver(inverse, mass, count, basis,
                                                                                            -1.0);
  try {
    solver.init();
    solver.compute(Spectra::SortRule::LargestMagn, most_restarts, iteration_tolerance);
  } catch (const std::exception&) {  // Spectra's word for numbers that are not finite
    return false;
  }
  if (solver.info() != Spectra::CompInfo::Successful) return false;
  const VectorX values = shift_ * solver.eigenvalues();
  const MatrixX vectors = solver.eigenvectors();
  const Eigen::Index there = modes.squared_frequencies.size();
  modes.squared_frequencies.conservativeResize(there + values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    Points shape = scatter(vectors.col(i).data());
    shape /= std::sqrt(flat(shape).dot(flat(mass_product(parameters, shape))));
    fix_sign(shape);
    modes.squared_frequencies[there + i] = values[i];
    modes.shapes.push_back(std::move(shape));
  }
  sort_ascending(modes);
  return true;
}

Modes ModalAnalysis::lowest(const VectorX& parameters, int count) {
  const Timed timed(Activity::Vibrations);
  const int unknowns = 3 * int(free_.size());
  if (count < 1 || 2 * count > unknowns)
    throw InputError({{},
                      std::to_string(count) + " modes of " + std::to_string(unknowns) + " unknowns",
                      "from 1 to half as many modes as unknowns",
                      "ask for fewer, or use smaller elements"});
  if (!(parameters[blocks_.density] > 0.0))
    throw InputError({{}, "a density that is not positive", "kg/m^3 > 0", "set the density or the object's mass"});
  Modes found;
  if (!factorise(parameters)) return found.failure = "the stiffness matrix cannot be factorised", found;
  if (!extend(parameters, count, found)) return found.failure = "the modes do not converge", found;
  // Lanczos's method sees one vector of each eigenspace but for rounding: look again until nothing lower turns up.
  for (int spare = unknowns - 2 * count; spare >= 0; --spare) {
    Modes more = found;
    if (!extend(parameters, 1, more)) return found.failure = "the modes do not converge", found;
    more.squared_frequencies.conservativeResize(count);
    more.shapes.pop_back();
    const double lowered = found.squared_frequencies.sum() - more.squared_frequencies.sum();
    if (lowered <= same_eigenvalue * std::abs(found.squared_frequencies[count - 1])) break;
    found = std::move(more);
  }
  found.converged = true;
  return found;
}

MatrixX ModalAnalysis::modulus_derivatives(const VectorX& parameters, const Modes& modes) {
  const int controls = body_->modulus.controls;
  elasticity_->set_parameters(parameters);
  elasticity_->linearise(body_->reference_positions());
  MatrixX derivatives(modes.count(), controls);
  for (int i = 0; i < modes.count(); ++i) {
    const Points& shape = modes.shapes[std::size_t(i)];
    // The force at X + phi is -K phi: its adjoint's product with phi holds every derivative at once.
    const Points moved = body_->reference_positions() + shape;
    Points lag_bar = Points::Zero(shape.rows(), 3), z_bar = lag_bar;
    VectorX theta_bar = VectorX::Zero(parameters.size());
    elasticity_->add_force_adjoint(moved, shape, lag_bar, z_bar, theta_bar);
    for (int k = 0; k < controls; ++k) derivatives(i, k) = -theta_bar[blocks_.youngs_moduli[std::size_t(k)]];
  }
  return derivatives;
}

Modes modes(std::shared_ptr<const Body> body, const MotionBlocks& blocks, const VectorX& parameters,
            const std::vector<int>& held, int count) {
  return ModalAnalysis(std::move(body), blocks, held).lowest(parameters, count);
}

}  // namespace pliant
