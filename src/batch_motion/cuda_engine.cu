#include <cuda_runtime.h>

#include <stdexcept>
#include <utility>

#include "batch_motion/engine.hpp"
#include "batch_motion/owned_array.hpp"

namespace pliant::batch_motion {

namespace {

void check(cudaError_t error, const char* what) {
  if (error == cudaSuccess) return;
  throw std::runtime_error(std::string("CUDA could not ") + what + ": " + cudaGetErrorString(error));
}

struct DeviceMemory {
  static void* allocate(std::size_t bytes) {
    void* memory = nullptr;
    check(cudaMalloc(&memory, bytes), "allocate memory for the batch: use fewer members at a time");
    if (const cudaError_t error = cudaMemset(memory, 0, bytes); error != cudaSuccess) {
      cudaFree(memory);
      check(error, "clear memory");
    }
    return memory;
  }
  static void release(void* memory, std::size_t) { cudaFree(memory); }
};

template <class Number>
using DeviceArray = OwnedArray<Number, DeviceMemory>;

constexpr unsigned members_of_block = 32, items_of_block = 8;

template <class Kernel>
__global__ void __launch_bounds__(members_of_block* items_of_block)
    run_items(Kernel kernel, int items, std::size_t stride) {
  const int item = int(blockIdx.x * items_of_block + threadIdx.y);
  if (item < items) kernel(item, DeviceLane{stride, blockIdx.y * members_of_block + threadIdx.x});
}

/// Rows from `first` on, none of which depends on another one.
template <class Kernel>
__global__ void __launch_bounds__(members_of_block* items_of_block)
    gather_rows(Kernel kernel, int first, int last, std::size_t stride) {
  const int row = first + int(blockIdx.x * items_of_block + threadIdx.y);
  if (row < last) kernel.gather(row, DeviceLane{stride, blockIdx.y * members_of_block + threadIdx.x});
}

__global__ void find_any(const double* numbers, std::size_t stride, int* found) {
  int own = 0;
  for (std::size_t i = threadIdx.x; i < stride; i += blockDim.x) own |= numbers[i] != 0.0;
  const int some = __syncthreads_or(own);
  if (threadIdx.x == 0) *found = some;
}

/// One number that the device writes and the host reads.
class Flag {
 public:
  Flag() { check(cudaMallocHost(&host_, sizeof(int)), "allocate memory of the host"); }
  Flag(const Flag&) = delete;
  Flag& operator=(const Flag&) = delete;
  ~Flag() { cudaFreeHost(host_); }
  int* on_device() { return device_.data(); }
  bool read() {
    check(cudaMemcpy(host_, device_.data(), sizeof(int), cudaMemcpyDeviceToHost), "run the batch");
    return *host_ != 0;
  }

 private:
  int* host_ = nullptr;
  DeviceArray<int> device_ = DeviceArray<int>(1);
};

/// One thread an item and member; members stand beside each other in a warp.
struct CudaBackend {
  template <class Number>
  using Array = DeviceArray<Number>;
  /// Iterations between two looks at whether any member goes on: those that do not stay as they are.
  static constexpr int iterations_together = 4;
  std::shared_ptr<const MeshData> mesh;
  std::shared_ptr<Flag> flag;
  std::size_t stride = 0;

  std::size_t set_members(int members) {
    const auto count = static_cast<std::size_t>(members);
    return stride = (count + members_of_block - 1) / members_of_block * members_of_block;
  }
  template <class Number>
  static const Number* place_in(const std::vector<Number>& values, std::vector<Array<Number>>& arrays) {
    arrays.emplace_back(values.size());
    if (!values.empty())
      check(cudaMemcpy(arrays.back().data(), values.data(), values.size() * sizeof(Number), cudaMemcpyHostToDevice),
            "copy the mesh to the device");
    return arrays.back().data();
  }
  const int* place(const std::vector<int>& values, std::vector<Array<int>>& ints, std::vector<Array<double>>&) const {
    return place_in(values, ints);
  }
  const double* place(const std::vector<double>& values, std::vector<Array<int>>&,
                      std::vector<Array<double>>& doubles) const {
    return place_in(values, doubles);
  }
  void upload(const double* from, Array<double>& to) const {
    if (to.size() > 0)
      check(cudaMemcpy(to.data(), from, to.size() * sizeof(double), cudaMemcpyHostToDevice), "copy to the device");
  }
  void download(const Array<double>& from, double* to) const {
    if (from.size() > 0)
      check(cudaMemcpy(to, from.data(), from.size() * sizeof(double), cudaMemcpyDeviceToHost), "copy from the device");
  }
  dim3 blocks(int items) const {
    return {(unsigned(items) + items_of_block - 1) / items_of_block, unsigned(stride / members_of_block)};
  }
  template <class Kernel>
  void each(int items, const Kernel& kernel) const {
    if (items == 0) return;
    run_items<<<blocks(items), dim3(members_of_block, items_of_block)>>>(kernel, items, stride);
    check(cudaPeekAtLastError(), "start a kernel");
  }
  template <class Kernel>
  void gather(const Kernel& kernel, int first, int last) const {
    gather_rows<<<blocks(last - first), dim3(members_of_block, items_of_block)>>>(kernel, first, last, stride);
    check(cudaPeekAtLastError(), "start a kernel");
  }
  template <class Kernel>
  void forward(const Kernel& kernel) const {
    for (std::size_t c = 0; c + 1 < mesh->colour_start.size(); ++c)
      gather(kernel, mesh->colour_start[c], mesh->colour_start[c + 1]);
  }
  template <class Kernel>
  void backward(const Kernel& kernel) const {
    for (std::size_t c = mesh->colour_start.size() - 1; c-- > 0;)
      gather(kernel, mesh->colour_start[c], mesh->colour_start[c + 1]);
  }
  bool any(const double* numbers) const {
    find_any<<<1, 256>>>(numbers, stride, flag->on_device());
    check(cudaPeekAtLastError(), "start a kernel");
    return flag->read();
  }
};

class CudaEngines : public EngineMaker {
 public:
  CudaEngines(const std::shared_ptr<const MeshData>& mesh, const StepNumbers& step, const SolverNumbers& solver)
      : shared_(
            std::make_shared<Shared<CudaBackend>>(mesh, step, solver, CudaBackend{mesh, std::make_shared<Flag>()})) {}
  std::unique_ptr<BatchEngine> make(int members) override {
    if (shared_->data().nodes_per_element == 8) return std::make_unique<Engine<CudaBackend, 8>>(shared_, members);
    return std::make_unique<Engine<CudaBackend, 4>>(shared_, members);
  }

 private:
  std::shared_ptr<Shared<CudaBackend>> shared_;
};

}  // namespace

int count_cuda_devices(std::string& reason) {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess) {
    reason = cudaGetErrorString(error);
    return 0;
  }
  if (count == 0) reason = "the driver knows of none";
  return count;
}

std::unique_ptr<EngineMaker> make_cuda_engines(const std::shared_ptr<const MeshData>& mesh, const StepNumbers& step,
                                               const SolverNumbers& solver) {
  std::string reason;
  if (count_cuda_devices(reason) == 0) throw std::runtime_error("no CUDA device: " + reason);
  return std::make_unique<CudaEngines>(mesh, step, solver);
}

}  // namespace pliant::batch_motion
