#pragma once

#include "motion/contact_defaults.hpp"
#include "motion/equilibrium.hpp"

namespace pliant {

struct PressSessionOptions {
  std::vector<int> held;                 ///< nodes; as many as hold the object
  Points dead_load;                      ///< nodal forces [N]; empty: none
  std::vector<RigidContact> inner = {};  ///< rigid bodies that stay where they are: a skull, a table
  /// A millionth of the forces is left: far below what a picture or a force sensor shows.
  EquilibriumOptions equilibrium = {.tolerance = 1e-6, .reuse_factor = true};
};

/// What leads a probe to an equilibrium.
struct ProbeMove {
  enum class By { Displacement, Force };
  By by = By::Displacement;
  Vector3 vector = Vector3::Zero();  ///< from where it touches [m]; or of the probe on the object [N]
  Vector3 turn = Vector3::Zero();    ///< rotation vector [rad] about where it touches
};

/// An object and its probes, led interactively: each call goes on from the last equilibrium, further along the last way
/// where the probes go on as they did, with the factorisation at hand, so that small moves take one or two cheap
/// iterations. For one thread.
class PressSession {
 public:
  /// Without a probe: the object under its dead load alone. Throws InputError where a bonded probe touches nothing.
  PressSession(const std::shared_ptr<const Body>& body, const std::shared_ptr<const MaterialLaw>& law,
               const std::vector<ProbeOptions>& probes, const PressSessionOptions& options);
  /// With one probe.
  PressSession(const std::shared_ptr<const Body>& body, const std::shared_ptr<const MaterialLaw>& law,
               const ProbeOptions& probe, const PressSessionOptions& options)
      : PressSession(body, law, std::vector<ProbeOptions>{probe}, options) {}

  /// To the equilibrium with each probe where its move has it (of a sliding one a force acts along its axis alone,
  /// which turns along). Not converged: the last equilibrium stays, and `failure` says why.
  /// @param moves  one a probe; others throw std::invalid_argument
  SolveSummary lead(const std::vector<ProbeMove>& moves);
  /// The same of the first probe, the others as they were led last.
  SolveSummary move_to(const Vector3& displacement);
  SolveSummary push(const Vector3& force);

  int probe_count() const { return int(probes_.size()); }
  const ProbeOptions& probe(int i = 0) const { return probes_[std::size_t(i)]; }  ///< with its axis at rest
  const Points& nodes() const { return placement_.nodes; }                        ///< n x 3 [m]
  Vector3 displacement(int probe = 0) const { return placement_.translations.row(probe).transpose(); }
  /// Of a probe on the object [N].
  Vector3 force(int probe = 0) const { return equilibrium_.contact_force(probe, placement_); }
  const std::string& failure() const { return equilibrium_.failure(); }
  /// The next equilibrium is sought from these nodes, n x 3 [m].
  void start_from(Points nodes);
  Equilibrium& equilibrium() { return equilibrium_; }

 private:
  void apply(const std::vector<ProbeMove>& moves);
  /// How many times `changes` of the moves are the last ones; nothing where they lead elsewhere.
  std::optional<double> times_repeated(const std::vector<ProbeMove>& changes) const;
  std::vector<ProbeOptions> probes_;
  std::vector<ProbeMove> moves_;  // that led to the placement
  Equilibrium equilibrium_;
  Placement placement_;
  Placement way_;                   // of the last `lead`: where it goes on, the next one begins further along it
  std::vector<ProbeMove> changes_;  // that led along it; empty: there is none
};

/// Points of a finer surface that follow a coarse mesh by moving least squares (Kaufmann et al. 2008): the deformation
/// about each is the affine one that fits the nodes nearby best, weighted by a smooth bump; so a surface stays smooth
/// across elements' borders, and affine deformations are followed exactly.
class SurfaceFollower {
 public:
  /// @param rest  points at rest [m]
  SurfaceFollower(const Body& body, const std::vector<Vector3>& rest);
  int point_count() const { return int(start_.size()) - 1; }
  /// m x 3 for node positions n x 3 [m].
  [[nodiscard]] Points positions(const Points& nodes) const;

 private:
  std::vector<int> start_, node_;
  std::vector<double> weight_;  // of each node in each point: they sum to one and reproduce affine maps
};

/// Gravity's nodal forces [N], n x 3.
Points weight_of(const Body& body, double density, const Vector3& gravity);

}  // namespace pliant
