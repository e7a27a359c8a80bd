#include <pybind11/stl.h>

#include "base/error.hpp"
#include "bindings.hpp"
#include "motion.hpp"
#include "program.hpp"

namespace pliant::python {

void bind_errors(py::module_& module) {
  // The classes are made in Python, where they have members; these turn exceptions into them.
  py::register_exception_translator([](std::exception_ptr thrown) {
    const auto raise = [](const char* name, auto&&... values) {
      const py::object type = py::module_::import("pliant._errors").attr(name);
      PyErr_SetObject(type.ptr(), type(values...).ptr());
    };
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      py::list problems;
      for (const Problem& problem : error.problems()) problems.append(to_string(problem));
      raise("InputError", error.what(), problems);
    } catch (const SimulationFailure& error) {
      raise("SimulationError", error.what());
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
  module.attr("version") = PLIANT_VERSION;
  module.def(
      "command",
      [](std::vector<std::string> words) {
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        return apps::run_program(int(arguments.size()), arguments.data());
      },
      py::arg("words"));
}

}  // namespace pliant::python

PYBIND11_MODULE(_pliant, module) {
  using namespace pliant::python;
  bind_errors(module);
  bind_bodies(module);
  bind_motions(module);
  bind_captures(module);
  bind_models(module);
  bind_fits(module);
}
