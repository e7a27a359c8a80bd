#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <exception>
#include <utility>

namespace pliant::python {

/// Ctrl-C, and exceptions of the caller's functions, while a long call runs without the interpreter's lock: work is
/// asked to stop, ends where its files are whole, and what happened is thrown on then.
class Interruption {
 public:
  /// Whether the work is to stop. From any thread that does not hold the lock.
  bool asked() {
    if (has_happened_) return true;
    const pybind11::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() == 0) return has_happened_;
    keep(std::make_exception_ptr(pybind11::error_already_set()));
    return true;
  }
  /// Calls a function of the caller with the lock held. Nothing is called once something went wrong.
  template <class Function>
  void call(const Function& function) {
    if (has_happened_) return;
    const pybind11::gil_scoped_acquire lock;
    try {
      function();
    } catch (const std::exception&) {
      keep(std::current_exception());
    }
  }
  /// Throws on what happened. With the lock held.
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  /// The first one. With the lock held.
  void keep(std::exception_ptr error) {
    if (!has_happened_) error_ = std::move(error);
    has_happened_ = true;
  }
  std::exception_ptr error_;
  std::atomic<bool> has_happened_ = false;
};

}  // namespace pliant::python
