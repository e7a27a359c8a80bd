// Meshes of elements with displacements given on their boundary: what is linear is found exactly on distorted meshes,
// and an exact solution of elasticity is approached with the order of the elements.
#include <random>
#include <utility>

#include "elasticity/corotated.hpp"
#include "solvers/linear_solver.hpp"
#include "support/bodies.hpp"
#include "support/convergence.hpp"
#include "support/tolerance.hpp"

namespace pliant::statics_test {
namespace {

using test::tolerance;
using Field = std::function<Vector3(const Vector3&)>;

constexpr double modulus = 3e4;
const Vector3 box_size(0.2, 0.16, 0.12);

/// Nodes whose displacement has to be given: those on the boundary of tetrahedra, and those of a grid that lack one of
/// their eight cells or belong to a cut one.
std::vector<bool> boundary_nodes(const Body& body) {
  std::vector<bool> boundary(std::size_t(body.node_count()), false);
  if (body.kind != ElementKind::Hexahedron) {
    const auto& mesh = std::get<TetMesh>(body.mesh);
    for (const auto& face : mesh.boundary)
      for (const int n : face) boundary[std::size_t(n)] = true;
    for (std::size_t e = 0; e < mesh.mid_nodes.size(); ++e)
      for (int m = 0; m < 6; ++m) {
        const int a = mesh.tets[e][tet_edges[m][0]], b = mesh.tets[e][tet_edges[m][1]];
        const auto of_edge = [&](const std::array<int, 3>& face) {
          return std::ranges::count(face, a) + std::ranges::count(face, b) == 2;
        };
        if (boundary[std::size_t(a)] && boundary[std::size_t(b)] && std::ranges::any_of(mesh.boundary, of_edge))
          boundary[std::size_t(mesh.mid_nodes[e][m])] = true;
      }
    return boundary;
  }
  std::vector<int> full_cells(boundary.size(), 0);
  for (int e = 0; e < body.element_count(); ++e)
    if (std::abs(body.element_volume[std::size_t(e)] / std::pow(body.grid().cell_size, 3) - 1.0) < 1e-6)
      for (const int n : body.element(e)) ++full_cells[std::size_t(n)];
  for (std::size_t n = 0; n < boundary.size(); ++n) boundary[n] = full_cells[n] < 8;
  return boundary;
}

/// Displacements in equilibrium inside, as the field says on the boundary.
Points displacements(const std::shared_ptr<const Body>& body, double nu, const Field& field) {
  const MotionLayout layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, modulus);
  theta[layout.poissons_ratio] = nu;
  const auto elasticity = make_elasticity(body, layout);
  elasticity->set_parameters(theta);
  elasticity->linearise(body->reference_positions());
  BlockMatrix K(body->pattern);
  elasticity->add_matrix(1.0, K);

  const std::vector<bool> boundary = boundary_nodes(*body);
  Points given = Points::Zero(body->node_count(), 3);
  int inside = 0;
  for (int n = 0; n < body->node_count(); ++n)
    if (boundary[std::size_t(n)])
      given.row(n) = field(body->nodes.row(n).transpose()).transpose();
    else
      ++inside;
  EXPECT_GT(inside, 0) << "nothing is solved for";
  VectorX force;
  K.multiply(flat(given), force);
  Points load = -as_points(std::as_const(force));
  for (int n = 0; n < body->node_count(); ++n)
    if (boundary[std::size_t(n)]) {
      load.row(n).setZero();
      K.constrain(n);
    }
  const auto solver = make_linear_solver(body->pattern, {best_direct_kind()});
  EXPECT_TRUE(solver->factorise(K));
  VectorX u = VectorX::Zero(load.size());
  solver->solve(flat(load), u);
  return given + as_points(std::as_const(u));
}

/// Quadratic elements whose inner edges are curved.
std::shared_ptr<const Body> curved_box() {
  const auto straight = test::tet_body(box_size, {3, 3, 3}, true, 0.2);
  const std::vector<bool> boundary = boundary_nodes(*straight);
  TetMesh mesh = std::get<TetMesh>(straight->mesh);
  for (const auto& mids : mesh.mid_nodes)
    for (const int n : mids)
      if (!boundary[std::size_t(n)])
        for (int d = 0; d < 3; ++d) mesh.nodes(n, d) = straight->nodes(n, d) + 0.003 * std::sin(5.0 * n + 2.0 * d);
  return std::make_shared<Body>(make_body(make_tet_mesh(mesh.nodes, mesh.tets, mesh.mid_nodes)));
}

class MeshPatch : public ::testing::TestWithParam<test::BodyKind> {};

TEST_P(MeshPatch, LinearDisplacementsAreExactInside) {
  const auto body = GetParam().make();
  Matrix3 gradient;
  gradient << 0.3, -0.2, 0.5, 0.1, -0.4, 0.25, 0.7, 0.35, 0.15;
  const Field linear = [&](const Vector3& p) -> Vector3 { return gradient * p + Vector3(0.01, 0.02, 0.03); };
  for (const double nu : {0.0, 0.3, 0.49}) {
    const Points u = displacements(body, nu, linear);
    double error = 0.0, scale = 0.0;
    for (int n = 0; n < body->node_count(); ++n) {
      const Vector3 exact = linear(body->nodes.row(n).transpose());
      error = std::max(error, (u.row(n).transpose() - exact).norm());
      scale = std::max(scale, exact.norm());
    }
    EXPECT_LT(error, tolerance(1e-11) * scale) << nu;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, MeshPatch,
    ::testing::Values(test::BodyKind{"Hexahedra", [] { return test::torus_body(0.1, 0.06, 0.02); }},
                      test::BodyKind{
                          "TrilinearHexahedra",
                          [] {
                            return test::torus_body(0.1, 0.06, 0.02, {HexFormulation::Trilinear, MassKind::Consistent});
                          }},
                      test::BodyKind{"Tetrahedra",
                                     [] {
                                       return test::tet_body(box_size, {4, 3, 3}, false, 0.2);
                                     }},
                      test::BodyKind{"QuadraticTetrahedra",
                                     [] {
                                       return test::tet_body(box_size, {3, 3, 3}, true, 0.2);
                                     }},
                      test::BodyKind{"CurvedQuadraticTetrahedra", curved_box}),
    [](const auto& kind) { return kind.param.name; });

/// Balances itself without load at every Poisson's ratio (Papkovich 1932, Neuber 1934): u = 4 (1 - nu) B - grad(x . B)
/// of harmonic B = b e_y. Neither its rotation nor its divergence vanishes.
Vector3 papkovich_neuber(const Vector3& p, double nu) {
  constexpr double k = 12.0, l = 0.6 * k, m = 0.8 * k;  // [1/m]; k^2 = l^2 + m^2 makes b harmonic
  const double e = std::exp(k * p.x()), s = std::sin(l * p.y() + 0.3), c = std::cos(m * p.z() - 0.5);
  const double b = e * s * c;
  const Vector3 gradient(k * b, l * e * std::cos(l * p.y() + 0.3) * c, -m * e * s * std::sin(m * p.z() - 0.5));
  return 0.01 * ((4.0 * (1.0 - nu) - 1.0) * b * Vector3::UnitY() - p.y() * gradient);
}

/// Root mean square over the body [m], at points that lie anywhere in their elements.
double rms_error(const Body& body, const Points& u, const Field& exact) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.499, 0.499);
  std::vector<Vector3> points(4000);
  for (Vector3& p : points) p = box_size.cwiseProduct(Vector3(uniform(random), uniform(random), uniform(random)));
  const Embedding embedding(body, points);
  double squares = 0.0;
  for (int i = 0; i < embedding.point_count(); ++i)
    squares += (embedding.position(i, u) - exact(points[std::size_t(i)])).squaredNorm();
  return std::sqrt(squares / double(points.size()));
}

struct OrderOf {
  const char* name;
  std::function<std::shared_ptr<const Body>(int)> make;  ///< of cells along 0.04 m
  std::vector<int> cells;
  double order;
  friend void PrintTo(const OrderOf& kind, std::ostream* out) { *out << kind.name; }
};

class Convergence : public ::testing::TestWithParam<OrderOf> {};

/// The displacement's error falls with the square of the elements' size, of quadratic elements with its cube. The band
/// is narrower than the step between the orders, so that an element of another order fails.
TEST_P(Convergence, IsOfTheElementsOrder) {
  for (const double nu : {0.0, 0.3}) {
    const Field exact = [&](const Vector3& p) { return papkovich_neuber(p, nu); };
    std::vector<double> sizes, errors;
    for (const int cells : GetParam().cells) {
      const auto body = GetParam().make(cells);
      sizes.push_back(1.0 / cells);
      errors.push_back(rms_error(*body, displacements(body, nu, exact), exact));
      RecordProperty("error at " + std::to_string(cells), std::to_string(errors.back()));
    }
    const double order = test::fitted_order(sizes, errors);
    RecordProperty("order", std::to_string(order));
    EXPECT_NEAR(order, GetParam().order, tolerance(0.25)) << "nu " << nu << ", last error " << errors.back();
  }
}

Eigen::Vector3i cells_of_box(int cells) { return cells * Eigen::Vector3i(5, 4, 3); }

INSTANTIATE_TEST_SUITE_P(
    Kinds, Convergence,
    ::testing::Values(
        OrderOf{"Hexahedra", [](int n) { return test::box_body(box_size, 0.04 / n); }, {1, 2, 3}, 2.0},
        OrderOf{"TrilinearHexahedra",
                [](int n) {
                  return test::box_body(box_size, 0.04 / n, {HexFormulation::Trilinear, MassKind::Consistent});
                },
                {1, 2, 3},
                2.0},
        OrderOf{"Tetrahedra", [](int n) { return test::tet_body(box_size, cells_of_box(n), false); }, {1, 2, 3}, 2.0},
        OrderOf{"QuadraticTetrahedra",
                [](int n) { return test::tet_body(box_size, n * Eigen::Vector3i(2, 2, 2), true); },
                {1, 2, 3},
                3.0}),
    [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace pliant::statics_test
