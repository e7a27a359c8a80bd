#pragma once

#include <pybind11/pybind11.h>

/// The parts of the extension module.
namespace pliant::python {

void bind_errors(pybind11::module_& module);
void bind_bodies(pybind11::module_& module);
void bind_motions(pybind11::module_& module);
void bind_captures(pybind11::module_& module);
void bind_models(pybind11::module_& module);
void bind_fits(pybind11::module_& module);

}  // namespace pliant::python
