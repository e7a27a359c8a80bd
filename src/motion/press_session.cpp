#include "motion/press_session.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "motion/body_forces.hpp"

namespace pliant {

namespace {

std::vector<RigidContact> contacts_of(const Body& body, const MaterialLaw& law, const std::vector<ProbeOptions>& probes,
                                      const std::vector<RigidContact>& inner) {
  std::vector<RigidContact> contacts;
  for (const ProbeOptions& probe : probes) contacts.push_back(probe_contact(body, probe, mean_modulus(body, law)));
  contacts.insert(contacts.end(), inner.begin(), inner.end());
  return contacts;
}

std::vector<ProbeMove> changes_between(const std::vector<ProbeMove>& before, const std::vector<ProbeMove>& after) {
  std::vector<ProbeMove> changes = after;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    changes[i].turn -= before[i].turn;
    if (after[i].by == before[i].by) changes[i].vector -= before[i].vector;
  }
  return changes;
}

}  // namespace

PressSession::PressSession(const std::shared_ptr<const Body>& body, const std::shared_ptr<const MaterialLaw>& law,
                           const std::vector<ProbeOptions>& probes, const PressSessionOptions& options)
    : probes_(probes),
      moves_(probes.size()),
      equilibrium_(body, law, options.held, contacts_of(*body, *law, probes, options.inner), options.equilibrium) {
  for (ProbeOptions& probe : probes_) probe.axis = probe_axis(*body, probe);
  if (options.dead_load.rows() > 0) equilibrium_.set_dead_load(options.dead_load);
  for (int i = 0; i < equilibrium_.contact_count(); ++i)
    equilibrium_.set_control(i, {ProbeControl::Kind::Position, {}, Vector3::Zero(), {}});
  placement_ = equilibrium_.rest();
}

void PressSession::apply(const std::vector<ProbeMove>& moves) {
  for (int i = 0; i < probe_count(); ++i) {
    const ProbeMove& move = moves[std::size_t(i)];
    const ProbeOptions& probe = probes_[std::size_t(i)];
    const Matrix3 turned = rotation_of(move.turn);
    if (move.turn != moves_[std::size_t(i)].turn) equilibrium_.turn(i, turned, probe.centre);
    ProbeControl control{ProbeControl::Kind::Position, {}, move.vector, {}};
    if (move.by == ProbeMove::By::Force) {
      control = {ProbeControl::Kind::Force, move.vector, Vector3::Zero(), {}};
      if (probe.kind != ProbeKind::BondedDisc) {
        control.axis = turned * *probe.axis;
        control.force = *control.axis * control.axis->dot(move.vector);
      }
    }
    equilibrium_.set_control(i, control);
  }
  moves_ = moves;
}

SolveSummary PressSession::lead(const std::vector<ProbeMove>& moves) {
  if (moves.size() != probes_.size()) throw std::invalid_argument("a session of presses needs a move for each probe");
  const std::vector<ProbeMove> before = moves_, changes = changes_between(before, moves);
  const std::optional<double> times = times_repeated(changes);
  apply(moves);
  SolveSummary summary;
  Placement next;
  if (times) {
    next = {placement_.nodes + *times * way_.nodes, placement_.translations + *times * way_.translations};
    summary = equilibrium_.solve(next);
  }
  if (!summary.converged) {
    const int in_vain = summary.iterations;
    next = placement_;
    summary = equilibrium_.solve(next);
    summary.iterations += in_vain;
  }
  if (summary.converged) {
    way_ = {next.nodes - placement_.nodes, next.translations - placement_.translations};
    changes_ = changes;
    placement_ = std::move(next);
  } else {
    apply(before);
  }
  return summary;
}

void PressSession::start_from(Points nodes) {
  placement_.nodes = std::move(nodes);
  changes_.clear();
}

std::optional<double> PressSession::times_repeated(const std::vector<ProbeMove>& changes) const {
  constexpr double most = 2.0, off = 0.3;  // farther, or this share to the side, the last way says little
  if (changes_.empty()) return std::nullopt;
  std::optional<double> times;
  for (int i = 0; i < probe_count(); ++i) {
    const ProbeMove &next = changes[std::size_t(i)], &last = changes_[std::size_t(i)];
    if (next.by != last.by) return std::nullopt;
    for (const auto part : {&ProbeMove::vector, &ProbeMove::turn}) {
      const double square = (last.*part).squaredNorm();
      if (!times && square > 0.0) times = (next.*part).dot(last.*part) / square;
      if ((next.*part - times.value_or(0.0) * last.*part).norm() > off * (next.*part).norm()) return std::nullopt;
    }
  }
  if (!times || *times <= 0.0 || *times > most) return std::nullopt;
  return times;
}

SolveSummary PressSession::move_to(const Vector3& displacement) {
  std::vector<ProbeMove> moves = moves_;
  moves.front() = {ProbeMove::By::Displacement, displacement, moves.front().turn};
  return lead(moves);
}

SolveSummary PressSession::push(const Vector3& force) {
  std::vector<ProbeMove> moves = moves_;
  moves.front() = {ProbeMove::By::Force, force, moves.front().turn};
  return lead(moves);
}

SurfaceFollower::SurfaceFollower(const Body& body, const std::vector<Vector3>& rest) : start_{0} {
  const int n = body.node_count();
  // Nodes near a point: those of the elements around it, and of theirs; at least a dozen, not in a plane.
  const Embedding embedding(body, rest);
  std::vector<std::vector<int>> elements_of(static_cast<std::size_t>(n));
  for (int e = 0; e < body.element_count(); ++e)
    for (const int node : body.element(e)) elements_of[std::size_t(node)].push_back(e);
  std::vector<int> near;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    near.clear();
    for (const int node : body.element(embedding.element(int(i))))
      for (const int e : elements_of[std::size_t(node)]) {
        const auto own = body.element(e);
        near.insert(near.end(), own.begin(), own.end());
      }
    std::ranges::sort(near);
    near.erase(std::unique(near.begin(), near.end()), near.end());
    double reach = 0.0;
    for (const int node : near) reach = std::max(reach, (body.nodes.row(node).transpose() - rest[i]).norm());
    reach *= 1.05;
    // Weights w_a(1 - |d|^2 / h^2)^2; the affine fit's value at the point is sum_a c_a x_a, c_a = w_a q_a . M^-1 e_1.
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    std::vector<Eigen::Vector4d> q;
    std::vector<double> bump;
    for (const int node : near) {
      const Vector3 d = (body.nodes.row(node).transpose() - rest[i]) / reach;
      const double w = std::pow(std::max(0.0, 1.0 - d.squaredNorm()), 2);
      q.emplace_back(1.0, d.x(), d.y(), d.z());
      bump.push_back(w);
      moments += w * q.back() * q.back().transpose();
    }
    const Eigen::Vector4d row = moments.fullPivLu().solve(Eigen::Vector4d::Unit(0));
    for (std::size_t a = 0; a < near.size(); ++a) {
      const double c = bump[a] * q[a].dot(row);
      if (c == 0.0) continue;
      node_.push_back(near[a]);
      weight_.push_back(c);
    }
    start_.push_back(int(node_.size()));
  }
}

Points SurfaceFollower::positions(const Points& nodes) const {
  Points out(point_count(), 3);
  for (int i = 0; i < point_count(); ++i) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (int k = start_[std::size_t(i)]; k < start_[std::size_t(i) + 1]; ++k)
      sum += weight_[std::size_t(k)] * nodes.row(node_[std::size_t(k)]);
    out.row(i) = sum;
  }
  return out;
}

Points weight_of(const Body& body, double density, const Vector3& gravity) {
  const MotionLayout layout;
  VectorX theta = layout.zero();
  theta[layout.density] = density;
  theta.segment<3>(layout.gravity) = gravity;
  Gravity term(body, layout);
  term.set_parameters(theta);
  Points force = Points::Zero(body.node_count(), 3);
  term.add_force(body.nodes, force);
  return force;
}

}  // namespace pliant
