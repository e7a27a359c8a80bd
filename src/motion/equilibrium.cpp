#include "motion/equilibrium.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pliant {

namespace {

/// The body's pattern with a row for each rigid body that is led by force, linked with all nodes that it can touch.
std::shared_ptr<const BlockPattern> with_rigid_bodies(const Body& body, const std::vector<RigidContact>& contacts) {
  const int n = body.node_count();
  std::vector<std::vector<int>> rows(std::size_t(n) + contacts.size());
  const BlockPattern& own = *body.pattern;
  for (int row = 0; row < n; ++row)
    rows[std::size_t(row)].assign(own.column.begin() + own.row_start[row], own.column.begin() + own.row_start[row + 1]);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const int probe = n + int(c);
    std::vector<int>& touched = rows[std::size_t(probe)];
    for (int i = 0; i < contacts[c].points().point_count(); ++i) {
      const auto nodes = contacts[c].points().nodes(i);
      const auto weights = contacts[c].points().weights(i);
      for (std::size_t a = 0; a < nodes.size(); ++a)
        if (std::abs(weights[a]) > 1e-12) touched.push_back(nodes[a]);
    }
    std::ranges::sort(touched);
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    for (const int node : touched) rows[std::size_t(node)].push_back(probe);
    touched.push_back(probe);
  }
  auto pattern = std::make_shared<BlockPattern>();
  pattern->rows = int(rows.size());
  pattern->row_start.push_back(0);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (const int column : rows[row]) {
      if (column == int(row)) pattern->diagonal.push_back(int(pattern->column.size()));
      pattern->column.push_back(column);
    }
    pattern->row_start.push_back(int(pattern->column.size()));
  }
  return pattern;
}

}  // namespace

class Equilibrium::Solver {
 public:
  Solver(std::shared_ptr<const Body> body, std::shared_ptr<const MaterialLaw> law, std::vector<int> held,
         std::vector<RigidContact> contacts, const EquilibriumOptions& options)
      : body_(std::move(body)),
        held_(std::move(held)),
        contacts_(std::move(contacts)),
        options_(options),
        controls_(contacts_.size()),
        pattern_(with_rigid_bodies(*body_, contacts_)),
        elasticity_(LawElasticity::make(body_, std::move(law), pattern_)),
        matrix_(pattern_),
        factor_(make_linear_solver(pattern_, {best_direct_kind(), 1e-10, 1})) {
    dead_load_ = Points::Zero(n(), 3);
    find_contact_blocks();
  }

  int n() const { return body_->node_count(); }
  int rows() const { return pattern_->rows; }

  /// Takes a placement apart and together.
  Points joined(const Placement& p) const {
    Points z(rows(), 3);
    z.topRows(n()) = p.nodes;
    z.bottomRows(rows() - n()) = p.translations;
    return z;
  }
  Placement parted(const Points& z) const { return {z.topRows(n()), z.bottomRows(rows() - n())}; }

  /// What the loads are on the way from those that were balanced last (0) to those of now (1).
  struct Load {
    Points dead;
    std::vector<ProbeControl> controls;
  };
  Load load_at(const Load& from, double share) const {
    Load load{(1.0 - share) * from.dead + share * dead_load_, controls_};
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
      load.controls[c].force = (1.0 - share) * from.controls[c].force + share * controls_[c].force;
      load.controls[c].translation = (1.0 - share) * from.controls[c].translation + share * controls_[c].translation;
    }
    return load;
  }

  SolveSummary solve(Placement& placement) {
    Points z = joined(placement);
    failure_.clear();
    SolveSummary summary = follow(z, load_at(now(), 1.0));
    if (!summary.converged) summary = in_steps(z = joined(placement), placement, summary.iterations);
    placement = parted(z);
    if (summary.converged) failure_.clear();
    return summary;
  }

  SolveSummary in_steps(Points& z, const Placement& from, int iterations) {
    // The start: what balances the placement's own pose, which bodies led to a place define by where they are.
    Load begin{Points::Zero(n(), 3), controls_};
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
      begin.controls[c].force = contacts_[c].force(from.nodes, from.translations.row(Eigen::Index(c)).transpose());
      begin.controls[c].translation = from.translations.row(Eigen::Index(c)).transpose();
    }
    double done = 0.0, step = 0.5;
    const double least = std::ldexp(1.0, -options_.max_halvings - 1);
    Points good = z;
    SolveSummary summary;
    while (done < 1.0) {
      step = std::min(step, 1.0 - done);
      z = good;
      summary = follow(z, load_at(begin, done + step));
      iterations += summary.iterations;
      if (summary.converged) {
        done += step, good = z, step *= 1.5;
      } else if ((step *= 0.5) < least) {
        z = good;
        failure_ += "; the load was followed up to " + std::to_string(int(100.0 * done)) + " %";
        break;
      }
    }
    summary.iterations = iterations;
    return summary;
  }

  /// Newton's method under one load.
  SolveSummary follow(Points& z, const Load& load) {
    place_led(z, load);
    SolveSummary summary;
    double energy = evaluate(z, load, true);
    if (!std::isfinite(energy)) {
      failure_ = "the energy is not finite at the initial configuration";
      return summary;
    }
    for (;; ++summary.iterations) {
      const double scale = assemble_gradient(z, load);
      summary.residual = gradient_.norm() / scale;
      if (summary.residual <= options_.tolerance) {
        summary.converged = true;
        return summary;
      }
      if (summary.iterations == options_.max_iterations) {
        failure_ = "no equilibrium within " + std::to_string(options_.max_iterations) + " iterations";
        return summary;
      }
      right_ = -flat(gradient_);
      if (!step_by_last_factor(z, load)) {
        if (!factorise(z, load, LawElasticity::Stiffness::Exact) &&
            !factorise(z, load, LawElasticity::Stiffness::Positive) && !factorise_lifted()) {
          failure_ = "the stiffness matrix is singular: insufficient Dirichlet constraints";
          return summary;
        }
        factor_->solve(right_, step_);
      }
      const double slope = flat(gradient_).dot(step_);
      if (!std::isfinite(slope) || slope >= 0.0) {
        failure_ = "the stiffness is nearly singular";
        return summary;
      }
      // What rounding leaves of the energy says nothing about steps that are smaller.
      const double rounding = 1e-13 * (std::abs(energies_.elastic) + energies_.contact + std::abs(energies_.total));
      const double last_norm = gradient_.norm();
      double share = first_share();
      bool moved = false;
      for (int halving = 0; halving < 40; ++halving, share *= 0.5) {
        trial_ = z + share * as_points(step_);
        const double trial_energy = evaluate(trial_, load, true);
        if (!std::isfinite(trial_energy)) continue;
        bool accepted = trial_energy <= energy + 1e-4 * share * slope;
        if (!accepted && -share * slope < 1e3 * rounding) {
          assemble_gradient(trial_, load);
          accepted = gradient_.norm() < last_norm;
        }
        if (!accepted) continue;
        z.swap(trial_);
        energy = trial_energy;
        moved = true;
        break;
      }
      if (!moved) {
        evaluate(z, load, true);
        assemble_gradient(z, load);
        summary.converged = summary.residual < 1e3 * options_.tolerance;  // as far as rounding lets it
        if (!summary.converged) failure_ = "no step lowers the energy";
        return summary;
      }
    }
  }

  /// A rigid body that slides must not jump through the object.
  double first_share() const {
    if (std::ranges::all_of(contacts_, &RigidContact::is_glued)) return 1.0;
    const double longest = as_points(step_).rowwise().norm().maxCoeff(), most = 0.1 * body_->size();
    return longest > most ? most / longest : 1.0;
  }

  /// Loads as they are asked for.
  Load now() const { return {dead_load_, controls_}; }

  void place_led(Points& z, const Load& load) const {
    for (std::size_t c = 0; c < contacts_.size(); ++c)
      if (load.controls[c].kind == ProbeControl::Kind::Position)
        z.row(n() + Eigen::Index(c)) = load.controls[c].translation.transpose();
  }

  double evaluate(const Points& z, const Load& load, bool with_tangent) {
    x_ = z.topRows(n());
    energies_ = {};
    energies_.elastic = elasticity_->evaluate(x_, with_tangent);
    if (!std::isfinite(energies_.elastic)) return energies_.elastic;
    double loads = -load.dead.cwiseProduct(x_ - body_->nodes).sum();
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
      const RigidContact& contact = contacts_[c];
      const Vector3 u = z.row(n() + Eigen::Index(c)).transpose();
      for (int i = 0; i < contact.points().point_count(); ++i)
        energies_.contact += contact.potential(i, contact.points().position(i, x_) - u, false).energy;
      const ProbeControl& control = load.controls[c];
      if (control.kind == ProbeControl::Kind::Position) continue;
      loads -= control.force.dot(u);
      if (control.axis)
        loads += 0.5 * guide_stiffness() * off_axis(*control.axis, u - control.translation).squaredNorm();
    }
    return energies_.total = energies_.elastic + energies_.contact + loads;
  }

  static Vector3 off_axis(const Vector3& axis, const Vector3& offset) { return offset - axis * axis.dot(offset); }
  /// A guide is much stiffer than the object.
  double guide_stiffness() const {
    const double E = elasticity_->law().small_strain(0).youngs_modulus;
    return 1e4 * E * body_->size();
  }

  /// Sets gradient_ (zero for what is held) at the last evaluation; returns the size of the forces that meet in it.
  double assemble_gradient(const Points& z, const Load& load) {
    gradient_ = Points::Zero(rows(), 3);
    x_ = z.topRows(n());
    nodal_ = Points::Zero(n(), 3);
    elasticity_->add_gradient(nodal_);
    double scale = nodal_.squaredNorm() + load.dead.squaredNorm();
    nodal_ -= load.dead;
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
      const RigidContact& contact = contacts_[c];
      const Vector3 u = z.row(n() + Eigen::Index(c)).transpose();
      Vector3 sum = Vector3::Zero();
      double size = 0.0;
      for (int i = 0; i < contact.points().point_count(); ++i) {
        const auto p = contact.potential(i, contact.points().position(i, x_) - u, false);
        if (p.energy == 0.0 && !contact.is_glued()) continue;  // does not touch
        contact.points().add_transpose(i, p.gradient, nodal_);
        sum -= p.gradient;
        size += p.gradient.norm();
      }
      scale += size * size;
      const ProbeControl& control = load.controls[c];
      if (control.kind == ProbeControl::Kind::Position) continue;
      scale += control.force.squaredNorm();
      sum -= control.force;
      if (control.axis) sum += guide_stiffness() * off_axis(*control.axis, u - control.translation);
      gradient_.row(n() + Eigen::Index(c)) = sum.transpose();
    }
    gradient_.topRows(n()) = nodal_;
    for (const int node : held_) gradient_.row(node).setZero();
    return std::max(std::sqrt(scale), smallest_force());
  }
  /// Forces that meet count at least as that which strains the object by a thousandth.
  double smallest_force() const {
    const double size = body_->size();
    return 1e-3 * elasticity_->law().small_strain(0).youngs_modulus * size * size;
  }

  /// Newton's step by conjugate gradients with the last factorisation as preconditioner. False where there is none,
  /// they take too long, or the Hessian is not positive definite along the way. CHOLMOD keeps its factors when the
  /// matrix changes.
  bool step_by_last_factor(const Points& z, const Load& load) {
    constexpr int most = 12;
    if (!options_.reuse_factor || !has_factor_) return false;
    assemble(z, load, LawElasticity::Stiffness::Exact);
    step_.setZero(right_.size());
    cg_r_ = right_;
    factor_->solve(cg_r_, cg_z_);
    cg_p_ = cg_z_;
    double rz = cg_r_.dot(cg_z_);
    const double aim = 1e-4 * cg_r_.norm();
    for (int k = 0; k < most; ++k) {
      matrix_.multiply(cg_p_, cg_product_);
      const double curvature = cg_p_.dot(cg_product_);
      if (!(curvature > 0.0)) return false;
      const double a = rz / curvature;
      step_ += a * cg_p_;
      cg_r_ -= a * cg_product_;
      if (cg_r_.norm() <= aim) return true;
      factor_->solve(cg_r_, cg_z_);
      const double next = cg_r_.dot(cg_z_);
      cg_p_ = cg_z_ + next / rz * cg_p_;
      rz = next;
    }
    return false;
  }

  bool factorise(const Points& z, const Load& load, LawElasticity::Stiffness which) {
    assemble(z, load, which);
    return has_factor_ = factor_->factorise(matrix_);
  }

  void assemble(const Points& z, const Load& load, LawElasticity::Stiffness which) {
    matrix_.set_zero();
    elasticity_->add_stiffness(which, 1.0, matrix_);
    const bool positive = which == LawElasticity::Stiffness::Positive;
    for (std::size_t c = 0; c < contacts_.size(); ++c) add_contact(z, load, c, positive);
    for (const int node : held_) matrix_.constrain(node);
    for (std::size_t c = 0; c < contacts_.size(); ++c)
      if (load.controls[c].kind == ProbeControl::Kind::Position) matrix_.constrain(n() + int(c));
  }

  void add_contact(const Points& z, const Load& load, std::size_t c, bool positive) {
    const RigidContact& contact = contacts_[c];
    const int probe = n() + int(c), stride = contact.points().nodes_per_point();
    const Vector3 u = z.row(probe).transpose();
    const std::vector<int>& where = contact_blocks_[c];
    Matrix3 all = Matrix3::Zero();
    for (int i = 0; i < contact.points().point_count(); ++i) {
      const auto p = contact.potential(i, contact.points().position(i, x_) - u, positive);
      if (p.energy == 0.0 && !contact.is_glued()) continue;  // does not touch
      const auto weights = contact.points().weights(i);
      const int* blocks = where.data() + std::size_t(i) * std::size_t((stride + 2) * stride);
      for (int a = 0; a < stride; ++a) {
        if (blocks[a] < 0) continue;  // weighs nothing
        for (int b = 0; b < stride; ++b)
          if (const int block = blocks[(2 + b) * stride + a]; block >= 0)
            Eigen::Map<Matrix3>(matrix_.block(block)) += weights[a] * weights[b] * p.hessian;
        Eigen::Map<Matrix3>(matrix_.block(blocks[a])) -= weights[a] * p.hessian;
        Eigen::Map<Matrix3>(matrix_.block(blocks[stride + a])) -= weights[a] * p.hessian;
      }
      all += p.hessian;
    }
    const ProbeControl& control = load.controls[c];
    if (control.kind == ProbeControl::Kind::Force && control.axis)
      all += guide_stiffness() * (Matrix3::Identity() - *control.axis * control.axis->transpose());
    Eigen::Map<Matrix3>(matrix_.block(pattern_->diagonal[probe])) += all;
  }

  /// The positive stiffness at hand, its diagonal raised until it can be factorised: a body that touches nothing yet
  /// can move freely.
  bool factorise_lifted() {
    double mean = 0.0;
    for (const int d : pattern_->diagonal) mean += Eigen::Map<const Matrix3>(matrix_.block(d)).trace();
    mean /= 3.0 * rows();
    for (double lift = 1e-8; lift < 1e2; lift *= 100.0) {
      for (const int d : pattern_->diagonal) Eigen::Map<Matrix3>(matrix_.block(d)).diagonal().array() += lift * mean;
      if (factor_->factorise(matrix_)) return true;
    }
    return false;
  }

  /// Of each sample: blocks (node, probe), (probe, node), and (a, b) of its nodes; -1 for nodes that weigh nothing.
  void find_contact_blocks() {
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
      const Embedding& points = contacts_[c].points();
      const int probe = n() + int(c), stride = points.nodes_per_point();
      std::vector<int>& blocks = contact_blocks_.emplace_back();
      for (int i = 0; i < points.point_count(); ++i) {
        const auto nodes = points.nodes(i);
        const auto weights = points.weights(i);
        const auto weighs = [&](int a) { return std::abs(weights[std::size_t(a)]) > 1e-12; };
        for (int a = 0; a < stride; ++a) blocks.push_back(weighs(a) ? pattern_->find(nodes[a], probe) : -1);
        for (int a = 0; a < stride; ++a) blocks.push_back(weighs(a) ? pattern_->find(probe, nodes[a]) : -1);
        for (int b = 0; b < stride; ++b)
          for (int a = 0; a < stride; ++a)
            blocks.push_back(weighs(a) && weighs(b) ? pattern_->find(nodes[a], nodes[b]) : -1);
      }
    }
  }

  bool prepare_derivatives(const Placement& placement) {
    const Points z = joined(placement);
    if (!std::isfinite(evaluate(z, now(), true))) return false;
    return factorise(z, now(), LawElasticity::Stiffness::Exact);
  }

  const Points& response(const Points& forces) {
    right_ = flat(forces);
    auto rows_of = as_points(right_);
    for (const int node : held_) rows_of.row(node).setZero();
    for (std::size_t c = 0; c < contacts_.size(); ++c)
      if (controls_[c].kind == ProbeControl::Kind::Position) rows_of.row(n() + Eigen::Index(c)).setZero();
    factor_->solve(right_, step_);
    response_ = as_points(step_);
    return response_;
  }

  std::shared_ptr<const Body> body_;
  std::vector<int> held_;
  std::vector<RigidContact> contacts_;
  EquilibriumOptions options_;
  std::vector<ProbeControl> controls_;
  std::shared_ptr<const BlockPattern> pattern_;
  std::unique_ptr<LawElasticity> elasticity_;
  BlockMatrix matrix_;
  std::unique_ptr<LinearSolver> factor_;
  std::vector<std::vector<int>> contact_blocks_;
  Points dead_load_, x_, nodal_, gradient_, trial_, response_;
  VectorX right_, step_, cg_r_, cg_z_, cg_p_, cg_product_;
  bool has_factor_ = false;
  Energies energies_;
  std::string failure_;
};

Equilibrium::Equilibrium(std::shared_ptr<const Body> body, std::shared_ptr<const MaterialLaw> law,
                         std::vector<int> held, std::vector<RigidContact> contacts, const EquilibriumOptions& options)
    : solver_(
          std::make_unique<Solver>(std::move(body), std::move(law), std::move(held), std::move(contacts), options)) {}
Equilibrium::~Equilibrium() = default;
Equilibrium::Equilibrium(Equilibrium&&) noexcept = default;

const Body& Equilibrium::body() const { return *solver_->body_; }
int Equilibrium::contact_count() const { return int(solver_->contacts_.size()); }
const RigidContact& Equilibrium::contact(int i) const { return solver_->contacts_[std::size_t(i)]; }
void Equilibrium::set_law(std::shared_ptr<const MaterialLaw> law) { solver_->elasticity_->set_law(std::move(law)); }
void Equilibrium::set_dead_load(Points forces) { solver_->dead_load_ = std::move(forces); }
void Equilibrium::set_control(int contact, const ProbeControl& control) {
  solver_->controls_[std::size_t(contact)] = control;
}

Placement Equilibrium::rest() const {
  Placement placement{solver_->body_->nodes, Points::Zero(contact_count(), 3)};
  for (int c = 0; c < contact_count(); ++c)
    placement.translations.row(c) = solver_->controls_[std::size_t(c)].translation.transpose();
  return placement;
}

SolveSummary Equilibrium::solve(Placement& placement) { return solver_->solve(placement); }
const std::string& Equilibrium::failure() const { return solver_->failure_; }
const Equilibrium::Energies& Equilibrium::energies() const { return solver_->energies_; }
Vector3 Equilibrium::contact_force(int contact, const Placement& placement) const {
  return solver_->contacts_[std::size_t(contact)].force(placement.nodes,
                                                        placement.translations.row(contact).transpose());
}
LawElasticity& Equilibrium::elasticity() { return *solver_->elasticity_; }
bool Equilibrium::prepare_derivatives(const Placement& placement) { return solver_->prepare_derivatives(placement); }
const Points& Equilibrium::response(const Points& forces) { return solver_->response(forces); }

}  // namespace pliant
