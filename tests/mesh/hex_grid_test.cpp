#include "mesh/hex_grid.hpp"

#include <numbers>
#include <random>

#include "elasticity/corotated.hpp"
#include "solvers/incomplete_cholesky.hpp"
#include "support/bodies.hpp"
#include "support/convergence.hpp"
#include "support/eigenvalues.hpp"
#include "support/tolerance.hpp"

namespace pliant::hex_grid_test {
namespace {

using std::numbers::pi;
using test::tolerance;

constexpr double radius = 0.1;

double monomial(const Vector3& p, int i, int j, int k) {
  return std::pow(p.x(), i) * std::pow(p.y(), j) * std::pow(p.z(), k);
}

/// Integral of x^i y^j z^k over the box [low, high] of the unit cube.
double box_moment(const Vector3& low, const Vector3& high, int i, int j, int k) {
  const int power[] = {i, j, k};
  double product = 1.0;
  for (int d = 0; d < 3; ++d)
    product *= (std::pow(high[d], power[d] + 1) - std::pow(low[d], power[d] + 1)) / (power[d] + 1);
  return product;
}

/// The quadrature of a box inside a cell: Gauss points of five an axis, exact far beyond what the cell's rule keeps.
CellQuadrature quadrature_of(const Vector3& low, const Vector3& high) {
  const double x[] = {0.0, std::sqrt(5.0 - 2.0 * std::sqrt(10.0 / 7.0)) / 3.0,
                      std::sqrt(5.0 + 2.0 * std::sqrt(10.0 / 7.0)) / 3.0};
  const double w[] = {128.0 / 225.0, (322.0 + 13.0 * std::sqrt(70.0)) / 900.0,
                      (322.0 - 13.0 * std::sqrt(70.0)) / 900.0};
  const auto node = [&](int n) {
    return std::pair(0.5 + 0.5 * (n < 3 ? x[n] : -x[n - 2]), 0.5 * w[n < 3 ? n : n - 2]);
  };
  CellQuadrature q;
  for (int a = 0; a < 5; ++a)
    for (int b = 0; b < 5; ++b)
      for (int c = 0; c < 5; ++c) {
        const Vector3 t(node(a).first, node(b).first, node(c).first);
        q.add(low + t.cwiseProduct(high - low), node(a).second * node(b).second * node(c).second * (high - low).prod());
      }
  return q;
}

double integral(const CellQuadrature& q, int i, int j, int k) {
  double sum = 0.0;
  for (int n = 0; n < CellQuadrature::count; ++n) sum += q.weights[n] * monomial(CellQuadrature::points()[n], i, j, k);
  return sum;
}

TEST(CellQuadrature, ExactToDegreeTwoInEachCoordinateAndNotBeyond) {
  const Vector3 low(0.15, 0.3, 0.0), high(0.6, 1.0, 0.45);
  const CellQuadrature q = quadrature_of(low, high);
  for (int i = 0; i <= 2; ++i)
    for (int j = 0; j <= 2; ++j)
      for (int k = 0; k <= 2; ++k)
        EXPECT_NEAR(integral(q, i, j, k), box_moment(low, high, i, j, k), tolerance(1e-15)) << i << j << k;
  EXPECT_NEAR(q.volume_fraction(), (high - low).prod(), tolerance(1e-15));
  for (const auto& [i, j, k] : {std::array{3, 0, 0}, std::array{0, 3, 0}, std::array{0, 0, 3}, std::array{3, 2, 1}})
    EXPECT_GT(std::abs(integral(q, i, j, k) - box_moment(low, high, i, j, k)), 1e-4) << i << j << k;
}

TEST(CellQuadrature, TakesPartsOutsideTheCell) {
  const Vector3 low(1.0, 0.2, -0.4), high(1.3, 0.9, 0.0);
  const CellQuadrature q = quadrature_of(low, high);
  EXPECT_NEAR(integral(q, 2, 1, 2), box_moment(low, high, 2, 1, 2), tolerance(1e-14));
}

TEST(ShapeFunctions, SumToOneReproduceLinearFunctionsAndMatchTheirGradients) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.5, 1.5);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector3 p(uniform(random), uniform(random), uniform(random));
    const auto N = shape_functions(p);
    const auto G = shape_gradients(p);
    double sum = 0.0;
    Vector3 at = Vector3::Zero();
    for (int a = 0; a < 8; ++a) sum += N[a], at += N[a] * Vector3(a & 1, a >> 1 & 1, a >> 2 & 1);
    EXPECT_NEAR(sum, 1.0, tolerance(1e-14));
    EXPECT_LT((at - p).norm(), tolerance(1e-14));
    EXPECT_LT(G.colwise().sum().norm(), tolerance(1e-14));
    const double h = 1e-3;  // the functions are linear along each axis: no truncation error
    for (int d = 0; d < 3; ++d) {
      const auto plus = shape_functions(p + h * Vector3::Unit(d)), minus = shape_functions(p - h * Vector3::Unit(d));
      for (int a = 0; a < 8; ++a) EXPECT_NEAR(G(a, d), (plus[a] - minus[a]) / (2 * h), tolerance(1e-11));
    }
  }
}

/// What a grid makes of a sphere, with the errors against the ideal one.
struct SphereErrors {
  double volume, centre, inertia, energy, area;
};

/// A smooth displacement and its strain.
Vector3 displacement(const Vector3& p) {
  const Vector3 s = p / radius;
  return 1e-3 * radius * Vector3(s.x() * s.x() - s.y() * s.z(), s.x() * s.y(), 0.5 * s.z() * s.z());
}
Matrix3 displacement_gradient(const Vector3& p) {
  const Vector3 s = p / radius;
  Matrix3 g;
  g << 2 * s.x(), -s.z(), -s.y(), s.y(), s.x(), 0.0, 0.0, 0.0, s.z();
  return 1e-3 * g;
}
double energy_density(const Matrix3& gradient, double nu) {
  const Matrix3 strain = 0.5 * (gradient + gradient.transpose());
  const UnitLame c = unit_lame(nu);
  return 0.5 * c.lambda * strain.trace() * strain.trace() + c.mu * strain.squaredNorm();
}
double exact_energy(double nu) {
  double sum = 0.0;
  const int n = 40;  // midpoints in radius, Gauss-free in the angles: quadratics in s converge quickly
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < n; ++b)
      for (int c = 0; c < n; ++c) {
        const double r = (a + 0.5) / n, z = -1.0 + 2.0 * (b + 0.5) / n, phi = 2 * pi * (c + 0.5) / n;
        const Vector3 p =
            radius * r * Vector3(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
        sum += energy_density(displacement_gradient(p), nu) * r * r * 4 * pi / (double(n) * n * n);
      }
  return sum * std::pow(radius, 3);
}

SphereErrors errors_of(HexGrid grid) {
  constexpr double nu = 0.3;
  BodyOptions trilinear;
  trilinear.formulation = HexFormulation::Trilinear;  // the energy of the displacement itself, no modes relaxed
  const auto body = std::make_shared<Body>(make_body(std::move(grid), trilinear));
  const Points& X = body->reference_positions();
  Points moment = Points::Zero(X.rows(), 3);
  body->add_mass_product(1.0, X, moment);
  const double volume = 4.0 / 3.0 * pi * std::pow(radius, 3);
  const double inertia = volume * radius * radius / 5.0;  // second moment about a plane through the centre
  const MotionLayout layout;
  const auto owned = make_elasticity(body, layout);
  Elasticity& elasticity = *owned;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 1.0);
  theta[layout.poissons_ratio] = nu;
  elasticity.set_parameters(theta);
  elasticity.linearise(X);
  Points z = X;
  for (Eigen::Index n = 0; n < X.rows(); ++n) z.row(n) += displacement(X.row(n).transpose()).transpose();
  double area = 0.0;
  for (const SurfacePoint& p : body->surface) area += p.area;
  return {std::abs(body->volume() / volume - 1.0), body->centre_of_mass().norm() / radius,
          (X.transpose() * moment - inertia * Matrix3::Identity()).norm() / inertia,
          std::abs(elasticity.energy(z) / exact_energy(nu) - 1.0), std::abs(area / (4 * pi * radius * radius) - 1.0)};
}

const std::vector<double> cell_sizes = {radius / 2, radius / 3, radius / 4, radius / 6, radius / 8};

/// Errors at each cell size, averaged over some places of the grid: one place alone is right or wrong by chance.
template <class MakeGrid>
std::vector<SphereErrors> refinement(MakeGrid&& make_grid) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::vector<SphereErrors> mean;
  for (const double h : cell_sizes) {
    const int places = h > radius / 5 ? 6 : 3;
    SphereErrors sum{};
    for (int place = 0; place < places; ++place) {
      const Vector3 shift(uniform(random), uniform(random), uniform(random));
      const SphereErrors e = errors_of(make_grid(h, shift));
      sum.volume += e.volume / places, sum.centre += e.centre / places, sum.inertia += e.inertia / places;
      sum.energy += e.energy / places, sum.area += e.area / places;
    }
    mean.push_back(sum);
  }
  return mean;
}

double order_of(const std::vector<SphereErrors>& errors, double SphereErrors::*member) {
  std::vector<double> values;
  for (const SphereErrors& e : errors) values.push_back(e.*member);
  return test::fitted_order(cell_sizes, values);
}

/// A linear surface in each sub-cell errs with h^2; chance in where the grid lies moves the fitted slope a little.
constexpr double order_low = 1.6, order_high = 2.8;

TEST(HexGrid, SphereConvergesWithSecondOrder) {
  const auto errors =
      refinement([](double h, const Vector3& shift) { return test::sphere_grid(radius, h, {}, shift, h / 8); });
  for (const auto& [name, member] :
       {std::pair{"volume", &SphereErrors::volume}, std::pair{"inertia", &SphereErrors::inertia},
        std::pair{"energy", &SphereErrors::energy}, std::pair{"area", &SphereErrors::area}}) {
    const double order = order_of(errors, member);
    RecordProperty(name, std::to_string(order));
    EXPECT_GT(order, order_low) << name << " " << errors.front().*member << " .. " << errors.back().*member;
    EXPECT_LT(order, order_high) << name;
  }
  // The errors on opposite sides of the centre cancel in part: it can only be better.
  EXPECT_GT(order_of(errors, &SphereErrors::centre), order_low);
  EXPECT_LT(errors[0].volume, 0.02);
  EXPECT_LT(errors.back().volume, 1e-3);
}

TEST(HexGrid, CountingEveryTouchedCellAsFullWouldFailThat) {
  const auto blocks = [](double h, const Vector3& shift) {
    HexGridOptions o;
    o.merge_below = 0.0;
    HexGrid grid = test::sphere_grid(radius, h, o, shift, h / 8);
    for (CellQuadrature& q : grid.quadrature) q = quadrature_of(Vector3::Zero(), Vector3::Ones());
    return grid;
  };
  const auto errors = refinement(blocks);
  for (const auto member : {&SphereErrors::volume, &SphereErrors::inertia, &SphereErrors::energy})
    EXPECT_LT(order_of(errors, member), order_low);
}

TEST(HexGrid, SurfaceSamplesLieOnTheSphereWithOutwardNormals) {
  const double h = radius / 4;
  const HexGrid grid = test::sphere_grid(radius, h, {}, Vector3(0.3, 0.1, -0.2), h / 12);
  ASSERT_GT(grid.surface.size(), 100u);
  for (const SurfacePoint& p : grid.surface) {
    EXPECT_NEAR(p.position.norm(), radius, 1e-3 * radius);
    EXPECT_GT(p.normal.dot(p.position.normalized()), 0.999);
    EXPECT_GT(p.area, 0.0);
  }
}

/// Conjugate gradients' iterations and the condition of stiffness + mass, as a time step sees them.
struct Conditioning {
  double volume;
  int iterations;
  double condition;
};

Conditioning conditioning_of(HexGrid grid) {
  const auto body = std::make_shared<Body>(make_body(std::move(grid)));
  const MotionLayout layout;
  const auto owned = make_elasticity(body, layout);
  Elasticity& elasticity = *owned;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 1.0);
  theta[layout.poissons_ratio] = 0.3;
  elasticity.set_parameters(theta);
  elasticity.linearise(body->reference_positions());
  BlockMatrix A(body->pattern);
  elasticity.add_matrix(1.0, A);
  const double mass_factor = 1.0 / (radius * radius);
  for (std::size_t b = 0; b < body->mass.size(); ++b)
    for (int d = 0; d < 3; ++d) A.block(int(b))[4 * d] += mass_factor * body->mass[b];
  MatrixX dense(A.rows(), A.rows());
  VectorX column;
  for (int c = 0; c < A.rows(); ++c) A.multiply(VectorX::Unit(A.rows(), c), column), dense.col(c) = column;
  const VectorX eigenvalues = test::eigenvalues(dense);
  IterativeSolver solver(body->pattern, {SolverKind::Iterative, 1e-8, 2000});
  VectorX x = VectorX::Zero(A.rows());
  int iterations = 2000;
  if (solver.factorise(A)) iterations = solver.solve(VectorX::LinSpaced(A.rows(), -1.0, 2.0), x).iterations;
  return {body->volume(), iterations, eigenvalues.maxCoeff() / std::max(eigenvalues.minCoeff(), 1e-300)};
}

struct Spread {
  double volume_low = 1e300, volume_high = 0.0, condition_low = 1e300, condition_high = 0.0;
  int iterations_low = 1 << 30, iterations_high = 0;
};

Spread slide(double merge_below) {
  HexGridOptions options;
  options.merge_below = merge_below;
  std::vector<Vector3> shifts = {Vector3::Zero(), Vector3(0.5, 0.5, 0.5), Vector3(0.02, 0.02, 0.02),
                                 Vector3(0.49, 0.0, 0.98)};
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int n = 0; n < 6; ++n) shifts.emplace_back(uniform(random), uniform(random), uniform(random));
  Spread s;
  for (const Vector3& shift : shifts) {
    const Conditioning c = conditioning_of(test::sphere_grid(radius, radius / 2.5, options, shift));
    s.volume_low = std::min(s.volume_low, c.volume), s.volume_high = std::max(s.volume_high, c.volume);
    s.condition_low = std::min(s.condition_low, c.condition),
    s.condition_high = std::max(s.condition_high, c.condition);
    s.iterations_low = std::min(s.iterations_low, c.iterations),
    s.iterations_high = std::max(s.iterations_high, c.iterations);
  }
  return s;
}

TEST(HexGrid, SlidingTheGridUnderTheObjectChangesLittle) {
  const Spread merged = slide(HexGridOptions{}.merge_below);
  RecordProperty("condition", std::to_string(merged.condition_low) + " .. " + std::to_string(merged.condition_high));
  RecordProperty("iterations", std::to_string(merged.iterations_low) + " .. " + std::to_string(merged.iterations_high));
  EXPECT_LT(merged.volume_high / merged.volume_low - 1.0, tolerance(0.01));
  EXPECT_LE(merged.iterations_high, 2 * merged.iterations_low);
  EXPECT_LT(merged.condition_high, tolerance(30.0) * merged.condition_low);
  // Without merging slivers remain: the same test sees them.
  const Spread cut = slide(0.0);
  EXPECT_GT(cut.condition_high, 100.0 * merged.condition_high) << "merging is not what keeps the condition";
}

TEST(HexGrid, LocateReproducesLinearFunctionsInsideAndOutside) {
  const double h = radius / 3;
  const HexGrid grid = test::sphere_grid(radius, h, {}, Vector3(0.2, 0.45, 0.7));
  int merged = 0;
  for (int l = 0; l < grid.lattice_count(); ++l)
    if (const int cell = grid.cell_of_lattice[l]; cell >= 0 && grid.lattice(grid.cell_index[cell]) != l) ++merged;
  ASSERT_GT(merged, 0) << "no merged cell: the test would prove less";
  Matrix3 A;
  A << 1, 2, -1, 0.5, -1, 3, 2, 0, 1;
  const Points field = (grid.nodes * A.transpose()).rowwise() + Eigen::RowVector3d(1, 2, 3);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int outside = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Vector3 p = 1.6 * radius * Vector3(uniform(random), uniform(random), uniform(random));
    const CellPoint at = grid.locate(p);
    ASSERT_GE(at.cell, 0);
    ASSERT_LT(at.cell, grid.cell_count());
    outside += p.norm() > radius;
    const auto N = shape_functions(at.local);
    Vector3 value = Vector3::Zero();
    for (int a = 0; a < 8; ++a) value += N[a] * field.row(grid.cells[at.cell][a]).transpose();
    EXPECT_LT((value - (A * p + Vector3(1, 2, 3))).norm(), tolerance(1e-12));
    if (p.norm() < 0.9 * radius) {
      EXPECT_LT((at.local.array() - 0.5).abs().maxCoeff(), 1.5 + 1e-12) << "a merged part is a neighbour's";
    }
  }
  EXPECT_GT(outside, 50);
}

/// Two balls that overlap are one part; where their neck lies about an edge of the lattice, coarse cells meet in no
/// face.
TEST(HexGrid, PartsAreJoinedByWholeFaces) {
  EXPECT_EQ(face_connected_parts(test::sphere_grid(0.1, 0.05)), 1);
  const auto two = [](const Vector3& away, double cell_size) {
    const auto distance = [&](const Vector3& p) { return std::min((p - away).norm(), (p + away).norm()) - 0.1; };
    const Box box = grown({-away, away}, 0.1);
    return make_hex_grid(SignedDistance(grown(box, 0.1), 0.01, distance), box, cell_size, {.merge_below = 0.0});
  };
  EXPECT_EQ(face_connected_parts(two({0.09, 0.0, 0.0}, 0.03)), 1);
  EXPECT_EQ(face_connected_parts(two({0.2, 0.0, 0.0}, 0.03)), 2);
}

TEST(HexGrid, RefusesCellsThatMissTheObject) {
  const SignedDistance distance(test::centred_box(Vector3::Constant(0.1)), 0.02, [](const Vector3&) { return 1.0; });
  EXPECT_ANY_THROW(make_hex_grid(distance, test::centred_box(Vector3::Constant(0.05)), 0.05));
}

}  // namespace
}  // namespace pliant::hex_grid_test
