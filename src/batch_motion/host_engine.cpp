#include <sys/mman.h>

#include <cstring>
#include <new>
#include <stdexcept>
#include <utility>

#include "batch_motion/engine.hpp"
#include "batch_motion/host_lane.hpp"
#include "batch_motion/owned_array.hpp"

namespace pliant::batch_motion {

namespace {

constexpr std::size_t cache_line = 64, huge_page = std::size_t(2) << 20;

/// Memory that begins with a cache line; where there is much of it, in huge pages, if the system has them: kernels read
/// matrices here and there, and looking up small pages would take as long as that.
struct AlignedMemory {
  static std::align_val_t alignment(std::size_t bytes) {
    return std::align_val_t(bytes < huge_page ? cache_line : huge_page);
  }
  static void* allocate(std::size_t bytes) {
    void* memory = ::operator new[](bytes, alignment(bytes));
#ifdef MADV_HUGEPAGE
    if (bytes >= huge_page) madvise(memory, bytes, MADV_HUGEPAGE);
#endif
    return std::memset(memory, 0, bytes);
  }
  static void release(void* memory, std::size_t bytes) { ::operator delete[](memory, alignment(bytes)); }
};

/// Items one after the other, `lane_width` members at once.
struct LaneBackend {
  static constexpr std::size_t stride = lane_width;
  std::shared_ptr<const MeshData> mesh;

  std::size_t set_members(int) { return stride; }
  template <class Kernel>
  void each(int items, const Kernel& kernel) const {
    for (int i = 0; i < items; ++i) kernel(i, HostLane());
  }
  template <class Kernel>
  void forward(const Kernel& kernel) const {
    for (int i = 0; i < mesh->nodes; ++i) kernel.gather(i, HostLane());
  }
  template <class Kernel>
  void backward(const Kernel& kernel) const {
    for (int i = mesh->nodes - 1; i >= 0; --i) kernel.scatter(i, HostLane());
  }
};

/// As a device does it: one member at a time, its numbers plain, rows of a colour in any order, by gathering alone.
struct MimicBackend {
  std::shared_ptr<const MeshData> mesh;
  std::size_t stride = 0;

  std::size_t set_members(int members) { return stride = (std::size_t(members) + 31) / 32 * 32; }
  template <class Kernel>
  void each(int items, const Kernel& kernel) const {
    for (int i = items - 1; i >= 0; --i)
      for (std::size_t m = 0; m < stride; ++m) kernel(i, DeviceLane{stride, m});
  }
  template <class Kernel>
  void gather(std::size_t colour, const Kernel& kernel) const {
    for (int i = mesh->colour_start[colour + 1] - 1; i >= mesh->colour_start[colour]; --i)
      for (std::size_t m = 0; m < stride; ++m) kernel.gather(i, DeviceLane{stride, m});
  }
  template <class Kernel>
  void forward(const Kernel& kernel) const {
    for (std::size_t c = 0; c + 1 < mesh->colour_start.size(); ++c) gather(c, kernel);
  }
  template <class Kernel>
  void backward(const Kernel& kernel) const {
    for (std::size_t c = mesh->colour_start.size() - 1; c-- > 0;) gather(c, kernel);
  }
};

/// A way of running kernels, with the host's memory.
template <class Runner>
struct HostBackend : Runner {
  template <class Number>
  using Array = OwnedArray<Number, AlignedMemory>;
  static constexpr int iterations_together = 1;

  /// The mesh stays where it is.
  template <class Number>
  const Number* place(const std::vector<Number>& values, std::vector<Array<int>>&, std::vector<Array<double>>&) const {
    return values.data();
  }
  void upload(const double* from, Array<double>& to) const {
    if (to.size() > 0) std::memcpy(to.data(), from, to.size() * sizeof(double));
  }
  void download(const Array<double>& from, double* to) const {
    if (from.size() > 0) std::memcpy(to, from.data(), from.size() * sizeof(double));
  }
  bool any(const double* numbers) const {
    for (std::size_t m = 0; m < this->stride; ++m)
      if (numbers[m] != 0.0) return true;
    return false;
  }
};

template <class Runner>
class HostEngines : public EngineMaker {
 public:
  using Backend = HostBackend<Runner>;
  HostEngines(const std::shared_ptr<const MeshData>& mesh, const StepNumbers& step, const SolverNumbers& solver)
      : shared_(std::make_shared<Shared<Backend>>(mesh, step, solver, Backend{{mesh}})) {}
  std::unique_ptr<BatchEngine> make(int members) override {
    if (shared_->data().nodes_per_element == 8) return std::make_unique<Engine<Backend, 8>>(shared_, members);
    return std::make_unique<Engine<Backend, 4>>(shared_, members);
  }

 private:
  std::shared_ptr<Shared<Backend>> shared_;
};

}  // namespace

std::unique_ptr<EngineMaker> make_host_engines(const std::shared_ptr<const MeshData>& mesh, const StepNumbers& step,
                                               const SolverNumbers& solver) {
  return std::make_unique<HostEngines<LaneBackend>>(mesh, step, solver);
}

std::unique_ptr<EngineMaker> make_mimic_engines(const std::shared_ptr<const MeshData>& mesh, const StepNumbers& step,
                                                const SolverNumbers& solver) {
  return std::make_unique<HostEngines<MimicBackend>>(mesh, step, solver);
}

}  // namespace pliant::batch_motion
