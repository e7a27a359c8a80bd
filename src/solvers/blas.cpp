#include "solvers/blas.hpp"

#ifdef PLIANT_WITH_CHOLMOD
#include <dlfcn.h>
#endif

namespace pliant {

#ifdef PLIANT_WITH_CHOLMOD

namespace {

/// A function of a library that may be loaded with this program, or not.
template <class Function>
Function* loaded_function(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_DEFAULT, name));
}

/// CHOLMOD as packaged opens its supernodal loops with four OpenMP threads whatever the machine has. Its OpenMP
/// runtime, where one is loaded, is told to stay serial: a setting of each thread that calls it.
void keep_openmp_serial() {
  static const auto set = loaded_function<void(int)>("omp_set_max_active_levels");
  if (set) set(0);
}

/// Whether several threads may call the BLAS at once. Asked once; OpenBLAS is told to start no threads then.
bool takes_several_callers() {
  static const bool takes = [] {
    if (const auto set = loaded_function<void(int)>("openblas_set_num_threads")) set(1);
    const auto threading = loaded_function<int()>("openblas_get_parallel");  // 0: built without threads
    return !threading || threading() != 0;
  }();
  return takes;
}

std::mutex& single_caller() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

BlasCall::BlasCall() {
  keep_openmp_serial();
  if (!takes_several_callers()) alone_ = std::unique_lock(single_caller());
}

#else

BlasCall::BlasCall() = default;

#endif

}  // namespace pliant
