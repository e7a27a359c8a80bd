#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <utility>

namespace pliant::python {

/// Ctrl-C, and exceptions of the caller's functions, while a long call runs without the interpreter's lock: work is
/// asked to stop, ends where its files are whole, and what happened is thrown on then.
class Interruption {
 public:
  /// Whether the work is to stop. From any thread that does not hold the lock.
  bool asked() {
    if (error_) return true;
    const pybind11::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() == 0) return false;
    error_ = std::make_exception_ptr(pybind11::error_already_set());
    return true;
  }
  /// Calls a function of the caller with the lock held. Nothing is called once something went wrong.
  template <class Function>
  void call(const Function& function) {
    if (error_) return;
    const pybind11::gil_scoped_acquire lock;
    try {
      function();
    } catch (const std::exception&) {
      error_ = std::current_exception();
    }
  }
  /// Throws on what happened. With the lock held.
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }
  bool happened() const { return error_ != nullptr; }

 private:
  std::exception_ptr error_;
};

}  // namespace pliant::python
