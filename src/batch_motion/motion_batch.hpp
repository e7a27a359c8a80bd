#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "elasticity/body.hpp"
#include "motion/penalty.hpp"
#include "motion/stepper.hpp"

namespace pliant {

/// Where a batch is computed.
enum class BatchDevice {
  Host,   ///< in the lanes of this processor's registers, eight members at a time
  Cuda,   ///< on the first CUDA device, all members at once; needs PLIANT_WITH_CUDA
  Mimic,  ///< on this processor as a device does it, member by member: slow, a check of the device's kernels
};

/// CUDA devices that a batch can use; 0 where there is none or the program was built without CUDA.
/// @param reason  out, where given: why there is none, in words
int cuda_device_count(std::string* reason = nullptr);

/// What all members of a batch have in common.
struct BatchOptions {
  double dt = 0.0;                   ///< [s], > 0
  double newmark_theta = 0.51;       ///< [0.5, 1), see `StepOptions`
  double contact_weight = 0.6;       ///< (0.5, 1]
  double rotation_prediction = 0.5;  ///< [0, 1]
  double tolerance = 1e-6;           ///< of |b - A x| / |b| in double precision, [1e-12, 1)
  int max_iterations = 500;          ///< of one equation, >= 1
  std::vector<int> held;             ///< nodes that stay where they are
  /// Young's modulus of each element in units of the member's [-], > 0. Empty: the body's `ModulusField::relative`,
  /// where that has one control.
  std::vector<double> relative_moduli;
  bool with_plane = false;      ///< whether the surface meets each member's plane
  Penalty contact;              ///< of the surface with the plane; its stiffness is the members' where they give one
  double friction_speed = 0.0;  ///< below which friction fades to nothing [m/s]; 0: there is none
  BatchDevice device = BatchDevice::Host;
  std::size_t memory_budget = std::size_t(1) << 30;  ///< [bytes] for states kept for the adjoint, of all members
};

/// A member's numbers.
struct BatchMember {
  double youngs_modulus = 0.0;              ///< [Pa], > 0
  double poissons_ratio = 0.0;              ///< (-1, 0.5)
  double mass_damping = 0.0;                ///< Rayleigh, [1/s], >= 0
  double stiffness_damping = 0.0;           ///< Rayleigh, [s], >= 0
  double density = 0.0;                     ///< [kg/m^3], > 0
  Vector3 gravity = Vector3::Zero();        ///< [m/s^2]
  Vector3 plane_point = Vector3::Zero();    ///< [m]
  Vector3 plane_normal = Vector3::UnitY();  ///< unit length, out of the plane
  double friction = 0.0;                    ///< Coulomb's coefficient [-], >= 0
  double contact_stiffness = 0.0;           ///< [Pa/m]; 0: that of `BatchOptions::contact`
  State start;                              ///< n x 3 each; empty positions: where nodes rest, empty velocities: none
};

/// Derivatives of a scalar cost by a member's numbers, each by the number of the same name. By the contact's stiffness
/// also where it is the options'. Not numbers of a member that has failed.
struct BatchGradient {
  double youngs_modulus = 0.0, poissons_ratio = 0.0, mass_damping = 0.0, stiffness_damping = 0.0, density = 0.0;
  Vector3 gravity = Vector3::Zero(), plane_point = Vector3::Zero(), plane_normal = Vector3::Zero();
  double friction = 0.0, contact_stiffness = 0.0;
  State start;
};

/// How one member's run went.
struct BatchRun {
  bool succeeded = false;
  int steps = 0;               ///< that were taken: a member whose equation cannot be solved stays where it is
  long solver_iterations = 0;  ///< of conjugate gradients, of all its steps
};

/// Motions of many bodies of one mesh, each with a material, gravity, plane and start of its own: side by side in the
/// lanes of wide registers, or on a CUDA device. A step is that of `Stepper` in its default mode, the lagged scheme
/// with Rayleigh damping (Weiss 2020, eq. 14-15), for corotated hexahedra and linear tetrahedra, gravity, one plane
/// and nodes that are held strongly. Equations are solved by conjugate gradients in single precision within a
/// refinement whose residual is in double precision. A member's result does not depend on the members beside it, nor on
/// how many there are, nor on the number of threads, to the last bit.
/// Not for concurrent use.
class MotionBatch {
 public:
  /// Throws std::invalid_argument where options contradict each other or the body, std::runtime_error where there is no
  /// device as asked for.
  MotionBatch(std::shared_ptr<const Body> body, BatchOptions options, int members);
  ~MotionBatch();
  MotionBatch(MotionBatch&&) noexcept;
  MotionBatch& operator=(MotionBatch&&) noexcept;

  const Body& body() const { return *body_; }
  const BatchOptions& options() const { return options_; }
  int member_count() const { return int(members_.size()); }

  /// Every member is to be set before a run. Throws std::invalid_argument where there is no such member, and where a
  /// number or the start is none that a motion can have.
  void set_member(int index, BatchMember member);

  /// Called with the states of all members after a step, also of the start (step 0) where that is asked for.
  using OnStates = std::function<void(int step, std::span<const State> states)>;
  /// Takes so many steps from the members' starts.
  /// @param at  steps after which `on_states` is called, ascending, 0 to `steps`
  /// Returns one summary a member. Throws std::invalid_argument for steps that are not ascending, and std::logic_error
  /// where a member was never set.
  std::vector<BatchRun> run(int steps, const std::vector<int>& at, const OnStates& on_states);

  /// Adds a cost's derivatives by the states of that step to the cotangents, one a member.
  using AddCotangents = std::function<void(int step, std::span<const State> states, std::span<State> bars)>;
  /// The same run, and then backwards from its end: derivatives of a cost that is a sum over the states of the steps
  /// `at` for which `add_cotangents` is called.
  /// Keeps states within the memory budget, and beyond it the first one of each of about sqrt(steps) segments, which
  /// are run again.
  /// @param on_states  called forwards, as above; may be empty
  /// @param gradients  out: one a member
  std::vector<BatchRun> run_adjoint(int steps, const std::vector<int>& at, const OnStates& on_states,
                                    const AddCotangents& add_cotangents, std::vector<BatchGradient>& gradients);

  /// Members whose numbers stand beside each other in memory: those that an engine moves.
  int stride() const;

 private:
  struct Engines;
  void check(int steps, const std::vector<int>& at) const;
  void begin();
  std::vector<BatchRun> collect_gradients(std::vector<BatchRun> summaries, std::vector<BatchGradient>& gradients);

  std::shared_ptr<const Body> body_;
  BatchOptions options_;
  std::vector<BatchMember> members_;
  std::vector<bool> is_set_;
  std::unique_ptr<Engines> engines_;
};

}  // namespace pliant
