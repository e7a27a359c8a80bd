#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "base/types.hpp"
#include "geometry/triangle_mesh.hpp"

/// NumPy arrays in and out.
namespace pliant::python {

namespace py = pybind11;

/// Doubles in the order of C; others are converted, and only they are copied.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<int, py::array::c_style | py::array::forcecast>;

/// "(812, 3)"
std::string shape_of(const py::array& array);

/// Throws ValueError that names the argument, its shape and the one it should have; -1: any length.
void check_shape(const py::array& array, const char* name, std::initializer_list<py::ssize_t> shape);

/// Throws ValueError where a number is not finite.
void check_finite(const Doubles& array, const char* name);

/// n x 3 numbers of an argument, all finite.
/// @param rows  -1: any number
Points points_of(const Doubles& array, const char* name, py::ssize_t rows = -1);

Vector3 vector_of(const Doubles& array, const char* name);

/// An array that owns what is moved into it.
py::array_t<double> array_of(Points points);
py::array_t<double> array_of(VectorX vector);
py::array_t<double> array_of(std::vector<double> values, std::vector<py::ssize_t> shape);
py::array_t<int> array_of(std::vector<int> values, std::vector<py::ssize_t> shape);

/// A surface: n x 3 [m], and m x 3 vertices.
py::array_t<double> vertices_of(const TriangleMesh& mesh);
py::array_t<int> triangles_of(const TriangleMesh& mesh);

/// An array that looks at numbers of `owner`, which it keeps alive; it cannot be written to.
template <class Number>
py::array_t<Number> view_of(const Number* data, std::vector<py::ssize_t> shape, py::handle owner) {
  py::array_t<Number> view(std::move(shape), data, owner);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

}  // namespace pliant::python
