#pragma once

#include <memory>
#include <string>

#include "batch_motion/mesh_data.hpp"

namespace pliant::batch_motion {

/// What the equations are solved to.
struct SolverNumbers {
  double tolerance = 1e-6;        ///< of |b - A x| / |b|
  double least_reduction = 1e-4;  ///< of one run of conjugate gradients in single precision
  int most_refinements = 20, most_iterations = 500;
};

/// Members in motion, some at a time: `stride` of them. Arrays of a member's numbers have the member as their fastest
/// index; nodes are in the mesh's order.
class BatchEngine {
 public:
  virtual ~BatchEngine() = default;
  [[nodiscard]] virtual int stride() const = 0;

  /// @param numbers  `member_number_count` rows
  virtual void set_numbers(const double* numbers) = 0;
  /// Of hexahedra: blocks of each class of elements for E = 1 Pa, as `MemberStiffness<8>` has them, of one member.
  virtual void set_stiffness(int member, const double* value, const double* change) = 0;
  virtual void set_state(const double* x, const double* v) = 0;
  virtual void get_state(double* x, double* v) const = 0;
  /// Of all members at once, which then share it.
  virtual void set_shared_stiffness(const double* value, const double* change) = 0;
  /// A run begins: members whose number is 1 go along, and rotations are looked for from none.
  virtual void begin(const double* alive) = 0;
  virtual void steps(int count) = 0;

  /// States kept.
  virtual void reserve(int slots) = 0;
  virtual void save(int slot) = 0;
  virtual void restore(int slot) = 0;

  /// A reverse sweep begins, with no cotangents. `alive` as above.
  virtual void begin_adjoint(const double* alive) = 0;
  virtual void add_cotangents(const double* x_bar, const double* v_bar) = 0;
  /// From the state at hand back to that of the slot, whence a step had led to it.
  virtual void adjoint_step(int slot) = 0;
  virtual void get_cotangents(double* x_bar, double* v_bar) const = 0;
  /// @param gradient  `gradient_number_count` rows
  virtual void get_gradient(double* gradient) const = 0;
  /// @param numbers  `solver_number_count` rows
  virtual void get_solver_numbers(double* numbers) const = 0;
};

/// Makes engines of some members each that share the mesh.
class EngineMaker {
 public:
  virtual ~EngineMaker() = default;
  /// @param members  for how many; the engine's stride may be another, larger or smaller
  [[nodiscard]] virtual std::unique_ptr<BatchEngine> make(int members) = 0;
};

/// In the lanes of this processor's registers.
std::unique_ptr<EngineMaker> make_host_engines(const std::shared_ptr<const MeshData>& mesh, const StepNumbers& step,
                                               const SolverNumbers& solver);
/// On this processor, but with a device's kernels and order: slow, a check of what only devices do. The mesh is one by
/// colours.
std::unique_ptr<EngineMaker> make_mimic_engines(const std::shared_ptr<const MeshData>& mesh, const StepNumbers& step,
                                                const SolverNumbers& solver);
/// On the first CUDA device. Throws std::runtime_error where there is none, or the program was built without CUDA.
std::unique_ptr<EngineMaker> make_cuda_engines(const std::shared_ptr<const MeshData>& mesh, const StepNumbers& step,
                                               const SolverNumbers& solver);
/// Devices that can be used; why there is none in `reason`.
int count_cuda_devices(std::string& reason);

}  // namespace pliant::batch_motion
