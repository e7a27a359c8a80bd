#include <stdexcept>

#include "batch_motion/batch_engine.hpp"

namespace pliant::batch_motion {

int count_cuda_devices(std::string& reason) {
  reason = "the program was built without CUDA (-DPLIANT_WITH_CUDA=ON)";
  return 0;
}

std::unique_ptr<EngineMaker> make_cuda_engines(const std::shared_ptr<const MeshData>&, const StepNumbers&,
                                               const SolverNumbers&) {
  std::string reason;
  count_cuda_devices(reason);
  throw std::runtime_error("no CUDA device: " + reason);
}

}  // namespace pliant::batch_motion
