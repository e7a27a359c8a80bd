#include "arrays.hpp"

#include <cmath>
#include <cstring>
#include <utility>

namespace pliant::python {

namespace {

std::string told(const std::vector<py::ssize_t>& shape) {
  std::string text = "(";
  for (std::size_t k = 0; k < shape.size(); ++k)
    text += (k > 0 ? ", " : "") + (shape[k] < 0 ? "n" : std::to_string(shape[k]));
  return text + (shape.size() == 1 ? ",)" : ")");
}

template <class Number, class Owner>
py::array_t<Number> owned(Owner values, Number* (*data)(Owner&), std::vector<py::ssize_t> shape) {
  auto* const kept = new Owner(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<Owner*>(p); });
  return py::array_t<Number>(std::move(shape), data(*kept), owner);
}

}  // namespace

std::string shape_of(const py::array& array) { return told({array.shape(), array.shape() + array.ndim()}); }

void check_shape(const py::array& array, const char* name, std::initializer_list<py::ssize_t> shape) {
  bool fits = array.ndim() == py::ssize_t(shape.size());
  std::size_t k = 0;
  for (const py::ssize_t length : shape) {
    fits = fits && (length < 0 || array.shape()[k] == length);
    ++k;
  }
  if (!fits)
    throw py::value_error(std::string(name) + ": expected an array of shape " + told({shape.begin(), shape.end()}) +
                          ", got " + shape_of(array));
}

void check_finite(const Doubles& array, const char* name) {
  for (py::ssize_t i = 0; i < array.size(); ++i)
    if (!std::isfinite(array.data()[i]))
      throw py::value_error(std::string(name) + ": number " + std::to_string(i) + " of the array is not finite");
}

Points points_of(const Doubles& array, const char* name, py::ssize_t rows) {
  check_shape(array, name, {rows, 3});
  check_finite(array, name);
  return Eigen::Map<const Points>(array.data(), array.shape()[0], 3);
}

Vector3 vector_of(const Doubles& array, const char* name) {
  check_shape(array, name, {3});
  check_finite(array, name);
  return Eigen::Map<const Vector3>(array.data());
}

py::array_t<double> array_of(Points points) {
  const py::ssize_t rows = points.rows();
  return owned<double, Points>(std::move(points), [](Points& p) { return p.data(); }, {rows, 3});
}

py::array_t<double> array_of(VectorX vector) {
  const py::ssize_t size = vector.size();
  return owned<double, VectorX>(std::move(vector), [](VectorX& v) { return v.data(); }, {size});
}

py::array_t<double> array_of(std::vector<double> values, std::vector<py::ssize_t> shape) {
  return owned<double, std::vector<double>>(std::move(values), [](std::vector<double>& v) { return v.data(); },
                                            std::move(shape));
}

py::array_t<int> array_of(std::vector<int> values, std::vector<py::ssize_t> shape) {
  return owned<int, std::vector<int>>(std::move(values), [](std::vector<int>& v) { return v.data(); },
                                      std::move(shape));
}

py::array_t<double> vertices_of(const TriangleMesh& mesh) {
  Points points(Eigen::Index(mesh.vertices.size()), 3);
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n) points.row(Eigen::Index(n)) = mesh.vertices[n].transpose();
  return array_of(std::move(points));
}

py::array_t<int> triangles_of(const TriangleMesh& mesh) {
  std::vector<int> corners;
  for (const auto& triangle : mesh.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
  return array_of(std::move(corners), {py::ssize_t(mesh.triangles.size()), 3});
}

}  // namespace pliant::python
