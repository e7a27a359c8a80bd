#include <pybind11/stl.h>

#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"
#include "elasticity/body_fields.hpp"
#include "elasticity/modulus_field.hpp"
#include "geometry/volume_mesh.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant::python {

namespace {

ElementKind element_kind(const std::string& name) {
  if (name == "hexahedra") return ElementKind::Hexahedron;
  if (name == "tetrahedra") return ElementKind::Tetrahedron;
  if (name == "quadratic_tetrahedra") return ElementKind::QuadraticTetrahedron;
  throw py::value_error("element: expected hexahedra, tetrahedra or quadratic_tetrahedra, got " + name);
}

TriangleMesh surface_of(const Doubles& vertices, const Integers& triangles) {
  const Points points = points_of(vertices, "vertices");
  check_shape(triangles, "triangles", {-1, 3});
  TriangleMesh mesh;
  for (Eigen::Index n = 0; n < points.rows(); ++n) mesh.vertices.emplace_back(points.row(n));
  for (py::ssize_t t = 0; t < triangles.shape()[0]; ++t) {
    for (py::ssize_t k = 0; k < 3; ++k)
      if (const int v = triangles.at(t, k); v < 0 || v >= points.rows())
        throw py::value_error("triangles: triangle " + std::to_string(t) + " names vertex " + std::to_string(v) +
                              ", and there are " + std::to_string(points.rows()));
    mesh.triangles.push_back({triangles.at(t, 0), triangles.at(t, 1), triangles.at(t, 2)});
  }
  return mesh;
}

std::shared_ptr<Body> body_of_surface(const Doubles& vertices, const Integers& triangles, double cells,
                                      const std::string& element) {
  Scene scene;
  scene.object.surface = surface_of(vertices, triangles);
  if (!(cells >= 1.0)) throw py::value_error("cells: expected a number of 1 or more");
  Resolution resolution;
  resolution.element = element_kind(element);
  resolution.cells = cells;
  const py::gil_scoped_release unlocked;
  const auto distance = scene_distance(scene, resolution.band);
  std::vector<Vector3> no_points;
  return std::make_shared<Body>(*make_body_of(scene, *distance, resolution, no_points));
}

std::shared_ptr<Body> body_of_tetrahedra(const Doubles& nodes, const Integers& tetrahedra, bool quadratic) {
  const Points points = points_of(nodes, "nodes");
  const bool has_mid_nodes = tetrahedra.ndim() == 2 && tetrahedra.shape()[1] == 10;
  check_shape(tetrahedra, "tetrahedra", {-1, has_mid_nodes ? 10 : 4});
  std::vector<std::array<int, 4>> corners;
  std::vector<std::array<int, 6>> mid_nodes;
  for (py::ssize_t e = 0; e < tetrahedra.shape()[0]; ++e) {
    const int* const element = tetrahedra.data(e, 0);
    for (py::ssize_t k = 0; k < tetrahedra.shape()[1]; ++k)
      if (element[k] < 0 || element[k] >= points.rows())
        throw py::value_error("tetrahedra: element " + std::to_string(e) + " names node " + std::to_string(element[k]) +
                              ", and there are " + std::to_string(points.rows()));
    std::copy_n(element, 4, corners.emplace_back().begin());
    if (has_mid_nodes) std::copy_n(element + 4, 6, mid_nodes.emplace_back().begin());
  }
  TetMesh mesh = make_tet_mesh(points, std::move(corners), std::move(mid_nodes));
  if (quadratic && !has_mid_nodes) mesh = with_mid_nodes(mesh);
  return std::make_shared<Body>(make_body(std::move(mesh)));
}

std::shared_ptr<Body> box(const Doubles& least, const Doubles& greatest, const std::array<int, 3>& cells,
                          bool quadratic) {
  return std::make_shared<Body>(make_body(
      make_tet_box({vector_of(least, "least"), vector_of(greatest, "greatest")}, {cells[0], cells[1], cells[2]},
                   quadratic)));
}

std::shared_ptr<Body> with_weights(const Body& body, const Doubles& weights) {
  check_shape(weights, "weights", {body.element_count(), -1});
  check_finite(weights, "weights");
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const MatrixX given = Eigen::Map<const RowMajor>(weights.data(), weights.shape()[0], weights.shape()[1]);
  for (Eigen::Index e = 0; e < given.rows(); ++e)
    if (std::abs(given.row(e).sum() - 1.0) > 1e-9)
      throw py::value_error("weights: those of an element sum to one; those of element " + std::to_string(e) +
                            " sum to " + std::to_string(given.row(e).sum()));
  auto made = std::make_shared<Body>(body);
  made->modulus.controls = int(given.cols());
  made->modulus.weights = given.cols() == 1 ? MatrixX() : given;
  return made;
}

/// Nodes and weights of points of the object, one row a point.
py::tuple weights_at(const Body& body, const Doubles& points) {
  const Points at = points_of(points, "points");
  std::vector<Vector3> rest;
  for (Eigen::Index i = 0; i < at.rows(); ++i) rest.emplace_back(at.row(i));
  const Embedding embedding(body, rest);
  std::vector<int> nodes;
  std::vector<double> weights;
  for (int i = 0; i < embedding.point_count(); ++i) {
    nodes.insert(nodes.end(), embedding.nodes(i).begin(), embedding.nodes(i).end());
    weights.insert(weights.end(), embedding.weights(i).begin(), embedding.weights(i).end());
  }
  const std::vector<py::ssize_t> shape = {embedding.point_count(), embedding.nodes_per_point()};
  return py::make_tuple(array_of(std::move(nodes), shape), array_of(std::move(weights), shape));
}

const char* kind_name(ElementKind kind) {
  return kind == ElementKind::Hexahedron    ? "hexahedra"
         : kind == ElementKind::Tetrahedron ? "tetrahedra"
                                            : "quadratic_tetrahedra";
}

}  // namespace

void bind_bodies(py::module_& module) {
  const auto read_only = [](py::class_<Body, std::shared_ptr<Body>>& type, const char* name, auto get, const char* doc) {
    type.def_property_readonly(name, get, doc);
  };
  py::class_<Body, std::shared_ptr<Body>> type(
      module, "Body", "Elements of an elastic object, stress-free: nodes in metres, of one kind of element.");
  type.def_static("of_surface", &body_of_surface, py::arg("vertices"), py::arg("triangles"), py::kw_only(),
                  py::arg("cells") = 12.0, py::arg("element") = "hexahedra",
                  "From a closed surface, n x 3 [m] and m x 3: hexahedra that it cuts, tetrahedra or "
                  "quadratic_tetrahedra; so many cells along its longest axis.");
  type.def_static("of_tetrahedra", &body_of_tetrahedra, py::arg("nodes"), py::arg("tetrahedra"), py::kw_only(),
                  py::arg("quadratic") = false,
                  "From elements of 4 nodes, or of 10 (mid nodes of the edges 01 02 03 12 13 23); quadratic puts mid "
                  "nodes into those of 4.");
  type.def_static("box", &box, py::arg("least"), py::arg("greatest"), py::arg("cells"), py::kw_only(),
                  py::arg("quadratic") = true, "A box [m] of so many cells along each axis, of six tetrahedra each.");
  type.def("with_control_weights", &with_weights, py::arg("weights"),
           "The same body with several moduli: ln E of an element is the sum over the controls of its weights, elements "
           "x controls, whose rows sum to one, times ln E of the controls.");
  type.def("weights_at", &weights_at, py::arg("points"),
           "Points of the object, m x 3 [m] at rest, as weighted sums of nodes: the nodes, m x k, and the weights, m x k.");
  read_only(type, "element", [](const Body& body) { return kind_name(body.kind); }, "The kind of its elements.");
  read_only(
      type, "nodes",
      [](const py::object& self) {
        const Body& body = self.cast<const Body&>();
        return view_of(body.nodes.data(), {body.node_count(), 3}, self);
      },
      "n x 3 [m], at rest; a view.");
  read_only(
      type, "elements",
      [](const py::object& self) {
        const Body& body = self.cast<const Body&>();
        return view_of(body.connectivity.data(), {body.element_count(), body.nodes_per_element()}, self);
      },
      "Nodes of each element; a view.");
  read_only(
      type, "element_volumes",
      [](const py::object& self) {
        const Body& body = self.cast<const Body&>();
        return view_of(body.element_volume.data(), {body.element_count()}, self);
      },
      "[m^3], of a cut cell its inside part; a view.");
  read_only(
      type, "element_centres",
      [](const Body& body) {
        Points centres(body.element_count(), 3);
        for (int e = 0; e < body.element_count(); ++e) centres.row(e) = element_centre(body, e).transpose();
        return array_of(std::move(centres));
      },
      "Mean of each element's nodes [m].");
  read_only(type, "controls", [](const Body& body) { return body.modulus.controls; }, "Number of control moduli.");
  read_only(type, "volume", &Body::volume, "[m^3]");
  read_only(type, "size", &Body::size, "Longest edge of the nodes' box [m].");
  read_only(
      type, "centre", [](const Body& body) { return array_of(VectorX(body.centre_of_mass())); },
      "Centre of mass [m].");
}

}  // namespace pliant::python
