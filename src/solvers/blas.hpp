#pragma once

#include <mutex>

namespace pliant {

/// The BLAS under CHOLMOD and UMFPACK during a call of theirs: held by each thread that calls them. It keeps to the
/// calling thread then: threads of its own cost a multiple of the factorisations themselves at our sizes. OpenBLAS in
/// its build without threads may not be called by two threads at once (now and then it finds a good matrix indefinite):
/// there one waits for the other.
class BlasCall {
 public:
  BlasCall();

 private:
  std::unique_lock<std::mutex> alone_;
};

}  // namespace pliant
