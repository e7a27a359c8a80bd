#include "mesh/tet_mesh.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::tet_mesh_test {
namespace {

using test::tolerance;

Barycentric random_barycentric(std::mt19937& random, double low, double high) {
  std::uniform_real_distribution<double> uniform(low, high);
  Barycentric b(0.0, uniform(random), uniform(random), uniform(random));
  b[0] = 1.0 - b.sum();
  return b;
}

template <int N>
Eigen::Matrix<double, N, 1> shape(const Barycentric& at) {
  const auto values = tet_shape_functions<N>(at);
  return Eigen::Map<const Eigen::Matrix<double, N, 1>>(values.data());
}

/// Barycentric coordinates of the nodes.
template <int N>
std::vector<Barycentric> node_places() {
  std::vector<Barycentric> places;
  for (int i = 0; i < 4; ++i) places.emplace_back(Barycentric::Unit(i));
  if constexpr (N == 10)
    for (const auto& [i, j] : tet_edges) places.emplace_back(0.5 * (Barycentric::Unit(i) + Barycentric::Unit(j)));
  return places;
}

template <int N>
void expect_lagrange_shape_functions() {
  const auto places = node_places<N>();
  for (std::size_t a = 0; a < places.size(); ++a)
    EXPECT_LT((shape<N>(places[a]) - Eigen::Matrix<double, N, 1>::Unit(Eigen::Index(a))).norm(), tolerance(1e-15));
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Barycentric at = random_barycentric(random, -0.5, 1.5);  // outside too
    EXPECT_NEAR(shape<N>(at).sum(), 1.0, tolerance(1e-14));
    const auto derivatives = tet_shape_derivatives<N>(at);
    EXPECT_LT(derivatives.colwise().sum().norm(), tolerance(1e-13));
    for (int k = 0; k < 3; ++k) {
      Barycentric step = Barycentric::Zero();
      step[0] = -1e-3, step[k + 1] = 1e-3;
      const Eigen::Matrix<double, N, 1> difference =
          (shape<N>(at + step) - shape<N>(at - step)) / 2e-3;  // exact: quadratic
      EXPECT_LT((difference - derivatives.col(k)).norm(), tolerance(1e-11));
    }
  }
}

TEST(TetShape, FunctionsAreLagrangeAndHaveTheirDerivatives) {
  expect_lagrange_shape_functions<4>();
  expect_lagrange_shape_functions<10>();
}

/// Mean over a tetrahedron of b0^i b1^j b2^k b3^l: 3! i! j! k! l! / (i + j + k + l + 3)!.
double exact_mean(const std::array<int, 4>& powers) {
  double value = 6.0;
  int sum = 3;
  for (const int p : powers) value *= std::tgamma(p + 1.0), sum += p;
  return value / std::tgamma(sum + 1.0);
}

double quadrature_error(int rule_degree, int degree) {
  double worst = 0.0;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; i + j <= degree; ++j)
      for (int k = 0; i + j + k <= degree; ++k) {
        const std::array<int, 4> powers = {i, j, k, degree - i - j - k};
        double sum = 0.0;
        for (const TetQuadraturePoint& q : tet_quadrature(rule_degree)) {
          double term = q.weight;
          for (int c = 0; c < 4; ++c) term *= std::pow(q.at[c], powers[c]);
          sum += term;
        }
        worst = std::max(worst, std::abs(sum - exact_mean(powers)) / exact_mean(powers));
      }
  return worst;
}

TEST(TetShape, QuadratureIsExactUpToItsDegreeAndNotAbove) {
  for (int degree = 0; degree <= 5; ++degree) EXPECT_LT(quadrature_error(degree, degree), tolerance(1e-13)) << degree;
  for (const int degree : {1, 2, 5}) EXPECT_GT(quadrature_error(degree, degree + 1), 1e-3) << degree;
  for (const int degree : {0, 2, 3})
    for (const TetQuadraturePoint& q : tet_quadrature(degree)) {
      EXPECT_GT(q.weight, 0.0);
      EXPECT_GT(q.at.minCoeff(), 0.0);
    }
  EXPECT_THROW((void)tet_quadrature(6), std::invalid_argument);
  EXPECT_THROW((void)tet_quadrature(-1), std::invalid_argument);
}

Box unequal_box() {
  Box box;
  box.extend(Vector3(-0.1, 0.2, 0.05));
  box.extend(Vector3(0.4, 0.5, 0.15));
  return box;
}

TEST(TetBox, HasTheCountsVolumeAndSurfaceOfABox) {
  const TetMesh bar = make_tet_box(unequal_box(), {20, 5, 5}, false);
  EXPECT_EQ(bar.node_count(), 756);
  EXPECT_EQ(bar.tet_count(), 3000);
  EXPECT_EQ(bar.boundary.size(), 2u * 2u * (20 * 5 + 20 * 5 + 5 * 5));
  EXPECT_FALSE(bar.is_quadratic());
  const TetMesh quadratic = make_tet_box(unequal_box(), {4, 3, 2}, true);
  ASSERT_TRUE(quadratic.is_quadratic());
  EXPECT_EQ(quadratic.node_count(), 9 * 7 * 5);  // corner and mid nodes are those of a lattice twice as fine
  const double volume = 0.5 * 0.3 * 0.1, area = 2.0 * (0.5 * 0.3 + 0.5 * 0.1 + 0.3 * 0.1);
  for (const TetMesh* mesh : {&bar, &quadratic}) {
    EXPECT_NEAR(mesh->volume(), volume, tolerance(1e-13) * volume);
    EXPECT_EQ(mesh->surface.size(), 3 * mesh->boundary.size());
    double sum = 0.0;
    for (const SurfacePoint& p : mesh->surface) {
      sum += p.area;
      EXPECT_NEAR(p.normal.norm(), 1.0, tolerance(1e-14));
      const Vector3 beyond = p.position + 1e-6 * p.normal;
      EXPECT_TRUE((beyond.array() < unequal_box().min.array()).any() ||
                  (beyond.array() > unequal_box().max.array()).any());
    }
    EXPECT_NEAR(sum, area, tolerance(1e-13) * area);
  }
  EXPECT_THROW(make_tet_box(unequal_box(), {3, 0, 2}, false), std::invalid_argument);
  EXPECT_THROW(make_tet_box(Box{}, {1, 1, 1}, false), std::invalid_argument);
}

/// A box turned and sheared, so that no face is parallel to an axis.
TetMesh tilted_box(bool quadratic) {
  const TetMesh box = make_tet_box(unequal_box(), {3, 2, 2}, false);
  Matrix3 A;
  A << 0.9, -0.3, 0.2, 0.4, 1.1, -0.1, -0.2, 0.3, 0.8;
  const TetMesh tilted = make_tet_mesh(box.nodes * A.transpose(), box.tets);
  return quadratic ? with_mid_nodes(tilted) : tilted;
}

/// Integral over the volume, by the rule of degree 5.
template <class Function>
double volume_integral(const TetMesh& mesh, Function&& function) {
  double sum = 0.0;
  for (const auto& tet : mesh.tets) {
    Eigen::Matrix<double, 3, 4> x;
    for (int a = 0; a < 4; ++a) x.col(a) = mesh.nodes.row(tet[a]).transpose();
    const double volume = (x.rightCols<3>().colwise() - x.col(0)).determinant() / 6.0;
    for (const TetQuadraturePoint& q : tet_quadrature(5)) sum += q.weight * volume * function(Vector3(x * q.at));
  }
  return sum;
}

TEST(TetMesh, SurfaceSamplesIntegrateQuadraticPolynomialsAndNotCubicOnes) {
  const TetMesh box = tilted_box(false);
  const TetMesh one = make_tet_mesh(box.nodes(box.tets[7], Eigen::all), {{0, 1, 2, 3}});  // opposite faces would cancel
  for (const TetMesh& mesh : {one, with_mid_nodes(one), box, with_mid_nodes(box)}) {
    Vector3 closed = Vector3::Zero();
    double linear = 0.0, square = 0.0, cubic = 0.0;  // divergence theorem for x / 3, (x.x, 0, 0), (x x.x, 0, 0)
    for (const SurfacePoint& p : mesh.surface) {
      closed += p.area * p.normal;
      linear += p.area * p.normal.dot(p.position) / 3.0;
      square += p.area * p.normal.x() * p.position.squaredNorm();
      cubic += p.area * p.normal.x() * p.position.x() * p.position.squaredNorm();
    }
    const double volume = mesh.volume();
    EXPECT_LT(closed.norm(), tolerance(1e-14));
    EXPECT_NEAR(linear, volume, tolerance(1e-13) * volume);
    const double exact_square = volume_integral(mesh, [](const Vector3& x) { return 2.0 * x.x(); });
    ASSERT_GT(std::abs(exact_square), 0.01 * volume);
    EXPECT_NEAR(square, exact_square, tolerance(1e-12) * std::abs(exact_square));
    const double exact_cubic =
        volume_integral(mesh, [](const Vector3& x) { return 2.0 * x.x() * x.x() + x.squaredNorm(); });
    if (mesh.tet_count() == 1) {
      EXPECT_GT(std::abs(cubic - exact_cubic), 1e-6 * exact_cubic);
    }
  }
}

TEST(TetMesh, CurvedElementsHaveTheirVolumeAndOutwardSamples) {
  const TetMesh straight = make_tet_box(unequal_box(), {3, 2, 2}, true);
  Points bent = straight.nodes;
  for (Eigen::Index n = 0; n < bent.rows(); ++n)  // quadratic: such elements represent it exactly
    bent(n, 0) += 0.8 * bent(n, 0) * bent(n, 0), bent(n, 2) += 0.5 * bent(n, 1) * bent(n, 1);
  const TetMesh mesh = make_tet_mesh(bent, straight.tets, straight.mid_nodes);
  const double expected =
      volume_integral(straight, [](const Vector3& x) { return 1.0 + 1.6 * x.x(); });  // det of its gradient
  EXPECT_NEAR(mesh.volume(), expected, tolerance(1e-13) * expected);
  const double corners_only =
      make_tet_mesh(bent, straight.tets, straight.mid_nodes).volume() - with_mid_nodes(mesh).volume();
  EXPECT_EQ(corners_only, 0.0) << "a quadratic mesh comes back as it is";
  double flux = 0.0;
  Vector3 closed = Vector3::Zero();
  for (const SurfacePoint& p : mesh.surface) {
    flux += p.area * p.normal.dot(p.position) / 3.0;
    closed += p.area * p.normal;
  }
  EXPECT_LT(closed.norm(), tolerance(1e-14))
      << "the area vector of a curved face is quadratic, so samples give it exactly";
  EXPECT_NEAR(flux, expected, tolerance(1e-4) * expected);  // of degree four there: not exact
}

TEST(TetMesh, MidNodesAreSharedAndInTheMiddle) {
  const TetMesh linear = tilted_box(false), quadratic = with_mid_nodes(linear);
  EXPECT_EQ(quadratic.nodes.topRows(linear.node_count()), linear.nodes);
  std::set<std::pair<int, int>> edges;
  for (int e = 0; e < linear.tet_count(); ++e)
    for (int m = 0; m < 6; ++m) {
      const int a = linear.tets[e][tet_edges[m][0]], b = linear.tets[e][tet_edges[m][1]];
      edges.insert(std::minmax(a, b));
      EXPECT_LT(
          (quadratic.nodes.row(quadratic.mid_nodes[e][m]) - 0.5 * (linear.nodes.row(a) + linear.nodes.row(b))).norm(),
          tolerance(1e-16));
    }
  EXPECT_EQ(quadratic.node_count(), linear.node_count() + int(edges.size()));
  EXPECT_NEAR(quadratic.volume(), linear.volume(), tolerance(1e-14) * linear.volume());
}

TEST(TetMesh, AnOffsetMovesEveryFaceOfABoxByAsMuch) {
  const Vector3 size(0.4, 0.1, 0.05);
  const TetMesh box = make_tet_box({Vector3::Zero(), size}, {8, 4, 3}, true);
  const auto by = [](double offset) { return [=](const Vector3&) { return offset; }; };
  for (const double offset : {0.004, -0.004}) {
    const TetMesh moved = with_offset_boundary(box, by(offset));
    const Vector3 low = moved.nodes.colwise().minCoeff(), high = moved.nodes.colwise().maxCoeff();
    EXPECT_LT((low + Vector3::Constant(offset)).norm(), tolerance(1e-15)) << "edges and corners as far as faces";
    EXPECT_LT((high - size - Vector3::Constant(offset)).norm(), tolerance(1e-15));
    EXPECT_NEAR(moved.volume(), (high - low).prod(), tolerance(1e-12) * box.volume()) << "faces stay flat";
    for (int e = 0; e < moved.tet_count(); ++e)
      for (int m = 0; m < 6; ++m) {
        const int a = moved.tets[e][tet_edges[m][0]], b = moved.tets[e][tet_edges[m][1]];
        EXPECT_LT((moved.nodes.row(moved.mid_nodes[e][m]) - 0.5 * (moved.nodes.row(a) + moved.nodes.row(b))).norm(),
                  tolerance(1e-15));
      }
  }
  EXPECT_EQ(with_offset_boundary(box, by(0.0)).nodes, box.nodes);
  EXPECT_THROW((void)with_offset_boundary(box, by(-0.03)), std::invalid_argument) << "thicker than the box";
}

TEST(TetMesh, RefusesWhatIsNoMesh) {
  Points nodes(5, 3);
  nodes << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1;
  const std::vector<std::array<int, 4>> good = {{0, 1, 2, 3}, {1, 2, 3, 4}};
  const auto refused = [](const Points& points, std::vector<std::array<int, 4>> tets,
                          std::vector<std::array<int, 6>> mids = {}) {
    try {
      (void)make_tet_mesh(points, std::move(tets), std::move(mids));
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  using ::testing::HasSubstr;
  EXPECT_EQ(refused(nodes, good), "");
  EXPECT_THAT(refused(nodes, {}), HasSubstr("no elements"));
  EXPECT_THAT(refused(nodes, {{0, 1, 2, 3}, {1, 2, 3, 5}}), HasSubstr("element 1 names node 5 of 5"));
  EXPECT_THAT(refused(nodes, {{0, 1, 2, 3}, {1, 2, -1, 4}}), HasSubstr("names node -1"));
  EXPECT_THAT(refused(nodes, {{0, 1, 2, 3}}), HasSubstr("node 4 belongs to no element"));
  EXPECT_THAT(refused(nodes, {{0, 2, 1, 3}, {1, 2, 3, 4}}), HasSubstr("element 0 has no positive volume"));
  EXPECT_THAT(refused(nodes, {{0, 1, 2, 3}, {0, 1, 2, 3}, {1, 2, 3, 4}}), HasSubstr("belongs to 3 elements"));
  EXPECT_THAT(refused(nodes, good, {{0, 1, 2, 3, 4, 0}}), HasSubstr("mid nodes of 1 elements of 2"));
  Points infinite = nodes;
  infinite(4, 1) = INFINITY;
  EXPECT_NE(refused(infinite, good), "");
}

/// Distance to a tetrahedron as the least over its corners, edges, faces and inside of the distance to their affine
/// span, where the nearest point of the span lies within.
double brute_force_distance(const Eigen::Matrix<double, 3, 4>& x, const Vector3& point) {
  double nearest = std::numeric_limits<double>::max();
  for (int subset = 1; subset < 16; ++subset) {
    std::vector<int> members;
    for (int c = 0; c < 4; ++c)
      if (subset >> c & 1) members.push_back(c);
    VectorX offset = point - x.col(members[0]);
    if (members.size() > 1) {
      MatrixX span(3, members.size() - 1);
      for (std::size_t k = 1; k < members.size(); ++k)
        span.col(Eigen::Index(k) - 1) = x.col(members[k]) - x.col(members[0]);
      const VectorX b = span.colPivHouseholderQr().solve(offset);
      if (b.minCoeff() < -1e-14 || b.sum() > 1.0 + 1e-14) continue;
      offset -= span * b;
    }
    nearest = std::min(nearest, offset.norm());
  }
  return nearest;
}

Eigen::Matrix<double, 3, 4> corners(const TetMesh& mesh, int e) {
  Eigen::Matrix<double, 3, 4> x;
  for (int a = 0; a < 4; ++a) x.col(a) = mesh.nodes.row(mesh.tets[std::size_t(e)][a]).transpose();
  return x;
}

TEST(TetMesh, LocateFindsPointsInside) {
  const TetMesh mesh = tilted_box(false);
  std::mt19937 random(8);
  for (int trial = 0; trial < 2000; ++trial) {
    const int e = int(random() % unsigned(mesh.tet_count()));
    const Barycentric inside = random_barycentric(random, 0.02, 0.32);
    const Vector3 point = corners(mesh, e) * inside;
    const TetPoint at = mesh.locate(point);
    EXPECT_EQ(at.tet, e);
    EXPECT_LT((at.barycentric - inside).norm(), tolerance(1e-12));
  }
  for (int n = 0; n < mesh.node_count(); ++n) {  // shared by several elements
    const TetPoint at = mesh.locate(mesh.nodes.row(n).transpose());
    EXPECT_GT(at.barycentric.minCoeff(), -tolerance(1e-12));
    EXPECT_LT((corners(mesh, at.tet) * at.barycentric - mesh.nodes.row(n).transpose()).norm(), tolerance(1e-12));
  }
}

TEST(TetMesh, LocateGivesPointsOutsideToTheNearestElement) {
  const TetMesh mesh = tilted_box(false);
  Box box;
  for (Eigen::Index n = 0; n < mesh.nodes.rows(); ++n) box.extend(mesh.nodes.row(n).transpose());
  const double size = box.extent().maxCoeff();
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(-0.4, 1.4);
  int outside = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Vector3 point =
        box.min + Vector3(uniform(random), uniform(random), uniform(random)).cwiseProduct(box.extent());
    const TetPoint at = mesh.locate(point);
    EXPECT_LT((corners(mesh, at.tet) * at.barycentric - point).norm(), tolerance(1e-12)) << "extrapolated coordinates";
    EXPECT_NEAR(at.barycentric.sum(), 1.0, tolerance(1e-12));
    double nearest = 1e300;
    for (int e = 0; e < mesh.tet_count(); ++e)
      nearest = std::min(nearest, brute_force_distance(corners(mesh, e), point));
    outside += nearest > 1e-3 * size;
    EXPECT_NEAR(brute_force_distance(corners(mesh, at.tet), point), nearest, tolerance(1e-12) * size);
  }
  EXPECT_GT(outside, 150);
}

TEST(TetMesh, LocateFollowsSmoothlyAcrossTheBoundary) {
  const TetMesh mesh = tilted_box(false);
  for (const SurfacePoint& p : mesh.surface) {
    const TetPoint in = mesh.locate(p.position - 1e-7 * p.normal), out = mesh.locate(p.position + 1e-7 * p.normal);
    EXPECT_EQ(in.tet, out.tet);
    EXPECT_LT(out.barycentric.minCoeff(), 0.0);
    EXPECT_LT((in.barycentric - out.barycentric).norm(), 1e-4);
  }
}

TEST(TetQuality, KnowsRegularRightAndFlatElements) {
  Points regular(4, 3);
  regular << 1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1;
  const TetQuality best = quality(make_tet_mesh(regular, {{0, 2, 1, 3}}));
  const double angle = std::acos(1.0 / 3.0) * 180.0 / std::numbers::pi;
  EXPECT_NEAR(best.least_dihedral_deg, angle, tolerance(1e-12));
  EXPECT_NEAR(best.greatest_dihedral_deg, angle, tolerance(1e-12));
  EXPECT_NEAR(best.least_radius_ratio, 1.0, tolerance(1e-14));
  EXPECT_NEAR(best.mean_volume, 8.0 / 3.0, tolerance(1e-14));

  Points flat(5, 3);  // two elements: a flat one of four points around a square, and a good one
  flat << 1, 0, 0.05, -1, 0, 0.05, 0, 1, 0.0, 0, -1, 0.0, 0, 0, 1.5;
  const TetQuality poor = quality(make_tet_mesh(flat, {{0, 1, 2, 3}, {0, 2, 1, 4}}));
  const double edge = std::atan(0.05) * 180.0 / std::numbers::pi;
  EXPECT_NEAR(poor.greatest_dihedral_deg, 180.0 - 2.0 * edge, tolerance(1e-10)) << "along the diagonal of the square";
  EXPECT_EQ(poor.below_5_deg, 1);
  EXPECT_EQ(poor.below_10_deg, 1);
  EXPECT_LT(poor.least_radius_ratio, 0.1);
  EXPECT_NEAR(poor.least_volume, 2.0 * 2.0 * 0.05 / 6.0, tolerance(1e-14));
  EXPECT_GT(poor.greatest_volume, poor.least_volume);

  const TetQuality cubes = quality(make_tet_box(test::centred_box(Vector3::Ones()), {2, 3, 2}, false));
  EXPECT_GT(cubes.least_dihedral_deg, 30.0);
  EXPECT_EQ(cubes.below_10_deg, 0);
}

}  // namespace
}  // namespace pliant::tet_mesh_test
