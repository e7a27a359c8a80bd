#include "motion/equilibrium.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/profile.hpp"
#include "motion/body_forces.hpp"
#include "motion/continuation.hpp"
#include "motion/statics.hpp"

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

/// What drives rigid bodies under force control: F on each, and the linear guide that it may keep to, a stiff spring
/// across its axis. A force on the rows below the nodes'.
class Drives : public ForceTerm {
 public:
  explicit Drives(int first_row, std::size_t count) : first_row_(first_row), controls_(count) {}
  void set_controls(const std::vector<ProbeControl>& controls) { controls_ = controls; }
  void set_guide_stiffness(double stiffness) { guide_stiffness_ = stiffness; }

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  void set_parameters(const VectorX&) override {}
  void linearise(const Points&) override {}
  void add_force(const Points& z, Points& force) override {
    for_driven([&](Eigen::Index row, const ProbeControl& c) {
      Vector3 f = c.force;
      if (c.axis) f -= guide_stiffness_ * off_axis(c, z.row(row).transpose());
      force.row(row) += f.transpose();
    });
  }
  void add_matrix(double scale, BlockMatrix& matrix) override {
    for_driven([&](Eigen::Index row, const ProbeControl& c) {
      if (!c.axis) return;
      const int diagonal = matrix.pattern().diagonal[std::size_t(row)];
      Eigen::Map<Matrix3>(matrix.block(diagonal)) +=
          scale * guide_stiffness_ * (Matrix3::Identity() - *c.axis * c.axis->transpose());
    });
  }
  std::optional<double> potential(const Points& x) override {
    double sum = 0.0;
    for_driven([&](Eigen::Index row, const ProbeControl& c) {
      const Vector3 u = x.row(row).transpose();
      sum -= c.force.dot(u);
      if (c.axis) sum += 0.5 * guide_stiffness_ * off_axis(c, u).squaredNorm();
    });
    return sum;
  }
  void add_force_tangent(const Points&, const Points&, const Points& d_z, const VectorX&, Points& force) override {
    for_driven([&](Eigen::Index row, const ProbeControl& c) {
      if (c.axis) force.row(row) -= guide_stiffness_ * across(*c.axis, d_z.row(row).transpose()).transpose();
    });
  }
  void add_force_adjoint(const Points&, const Points& w, Points&, Points& z_bar, VectorX&) override {
    for_driven([&](Eigen::Index row, const ProbeControl& c) {
      if (c.axis) z_bar.row(row) -= guide_stiffness_ * across(*c.axis, w.row(row).transpose()).transpose();
    });
  }

 private:
  static Vector3 across(const Vector3& axis, const Vector3& v) { return v - axis * axis.dot(v); }
  static Vector3 off_axis(const ProbeControl& c, const Vector3& u) { return across(*c.axis, u - c.translation); }
  template <class Visit>
  void for_driven(Visit&& visit) const {
    for (std::size_t c = 0; c < controls_.size(); ++c)
      if (controls_[c].kind == ProbeControl::Kind::Force) visit(first_row_ + Eigen::Index(c), controls_[c]);
  }

  int first_row_;
  std::vector<ProbeControl> controls_;
  double guide_stiffness_ = 0.0;
};

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
        load_(*body_),
        drives_(n(), contacts_.size()),
        statics_(body_, terms(), statics_options(), pattern_) {
    for (std::size_t c = 0; c < contacts_.size(); ++c) contacts_[c].set_row(*body_, n() + int(c), *pattern_);
    dead_load_ = Points::Zero(n(), 3);
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
    std::optional<Load> begin;
    LoadContinuation steps({.first = 1.0, .least = std::ldexp(1.0, -options_.max_halvings - 1)});
    Points good = joined(placement);
    SolveSummary summary;
    int iterations = 0;
    failure_.clear();
    while (const auto share = steps.next()) {
      Points z = good;
      if (*share < 1.0 && !begin) begin = balanced_by(placement);
      summary = follow(z, *share < 1.0 ? load_at(*begin, *share) : Load{dead_load_, controls_});
      iterations += summary.iterations;
      if (summary.converged) good = z;
      steps.report(summary.converged ? LoadContinuation::Outcome::Carried : LoadContinuation::Outcome::NotFollowed);
    }
    if (!steps.is_complete())
      failure_ =
          statics_.failure() + "; the load was followed up to " + std::to_string(int(100.0 * steps.carried())) + " %";
    placement = parted(good);
    is_linearised_ = steps.is_complete();
    summary.iterations = iterations;
    return summary;
  }

  /// What balances the placement's own pose: there is no other load, and bodies are where they are.
  Load balanced_by(const Placement& placement) const {
    Load begin{Points::Zero(n(), 3), controls_};
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
      begin.controls[c].force =
          contacts_[c].force(placement.nodes, placement.translations.row(Eigen::Index(c)).transpose());
      begin.controls[c].translation = placement.translations.row(Eigen::Index(c)).transpose();
    }
    return begin;
  }

  /// Newton's method under one load.
  SolveSummary follow(Points& z, const Load& load) {
    for (std::size_t c = 0; c < contacts_.size(); ++c)
      if (load.controls[c].kind == ProbeControl::Kind::Position)
        z.row(n() + Eigen::Index(c)) = load.controls[c].translation.transpose();
    set_load(load);
    return statics_.solve(z);
  }

  void set_load(const Load& load) {
    const double E = elasticity_->law().small_strain(0).youngs_modulus, size = body_->size();
    load_.set_forces(load.dead);
    drives_.set_controls(load.controls);
    drives_.set_guide_stiffness(1e4 * E * size);          // a guide is much stiffer than the object
    statics_.set_smallest_force(1e-3 * E * size * size);  // that which strains the object by a thousandth
    std::vector<int> held = held_;
    for (std::size_t c = 0; c < contacts_.size(); ++c)
      if (load.controls[c].kind == ProbeControl::Kind::Position) held.push_back(n() + int(c));
    statics_.hold(std::move(held));
  }

  Energies energies(const Points& z) {
    Energies energies;
    energies.elastic = *elasticity_->potential(z);
    for (RigidContact& contact : contacts_) energies.contact += *contact.potential(z);
    energies.total = energies.elastic + energies.contact + *load_.potential(z) + *drives_.potential(z);
    return energies;
  }

  bool prepare_derivatives(const Placement& placement) {
    set_load({dead_load_, controls_});
    const Points z = joined(placement);
    if (is_linearised_ && statics_.linearised_at() == z) return statics_.prepare_derivatives_there();
    is_linearised_ = false;
    return statics_.prepare_derivatives(z);
  }

  std::vector<ForceTerm*> terms() {
    std::vector<ForceTerm*> all = {elasticity_.get(), &load_, &drives_};
    for (RigidContact& contact : contacts_) all.push_back(&contact);
    return all;
  }
  /// A rigid body that slides must not jump through the object.
  StaticsOptions statics_options() const {
    StaticsOptions o;
    o.newton = {options_.tolerance, options_.max_iterations};
    o.reuse_factor = options_.reuse_factor;
    if (!std::ranges::all_of(contacts_, &RigidContact::is_bonded)) o.longest_step = 0.1 * body_->size();
    return o;
  }

  std::shared_ptr<const Body> body_;
  std::vector<int> held_;
  std::vector<RigidContact> contacts_;
  EquilibriumOptions options_;
  std::vector<ProbeControl> controls_;
  std::shared_ptr<const BlockPattern> pattern_;
  std::unique_ptr<LawElasticity> elasticity_;
  NodalLoad load_;
  Drives drives_;
  Statics statics_;
  Points dead_load_;
  bool is_linearised_ = false;  // by the last `solve`, where it ended, with the law and the controls of now
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
void Equilibrium::set_law(std::shared_ptr<const MaterialLaw> law) {
  solver_->elasticity_->set_law(std::move(law));
  solver_->is_linearised_ = false;
}
void Equilibrium::set_dead_load(Points forces) {
  solver_->dead_load_ = std::move(forces);
  solver_->is_linearised_ = false;
}
void Equilibrium::set_control(int contact, const ProbeControl& control) {
  solver_->controls_[std::size_t(contact)] = control;
  solver_->is_linearised_ = false;
}

void Equilibrium::turn(int contact, const Matrix3& rotation, const Vector3& centre) {
  solver_->contacts_[std::size_t(contact)].turn(rotation, centre);
  solver_->is_linearised_ = false;
}

Placement Equilibrium::rest() const {
  Placement placement{solver_->body_->nodes, Points::Zero(contact_count(), 3)};
  for (int c = 0; c < contact_count(); ++c)
    placement.translations.row(c) = solver_->controls_[std::size_t(c)].translation.transpose();
  return placement;
}

SolveSummary Equilibrium::solve(Placement& placement) {
  const Timed timed(Activity::Equilibria);
  const SolveSummary summary = solver_->solve(placement);
  if (summary.converged) solver_->energies_ = solver_->energies(solver_->joined(placement));
  return summary;
}
const std::string& Equilibrium::failure() const { return solver_->failure_; }
const Equilibrium::Energies& Equilibrium::energies() const { return solver_->energies_; }
Vector3 Equilibrium::contact_force(int contact, const Placement& placement) const {
  return solver_->contacts_[std::size_t(contact)].force(placement.nodes,
                                                        placement.translations.row(contact).transpose());
}
LawElasticity& Equilibrium::elasticity() {
  solver_->is_linearised_ = false;  // who has it may evaluate it elsewhere
  return *solver_->elasticity_;
}
const LawElasticity& Equilibrium::elasticity() const { return *solver_->elasticity_; }
bool Equilibrium::prepare_derivatives(const Placement& placement) { return solver_->prepare_derivatives(placement); }
const Points& Equilibrium::response(const Points& forces) { return solver_->statics_.response(forces); }
void Equilibrium::respond(std::span<Points> changes) { solver_->statics_.respond(changes); }

}  // namespace pliant
