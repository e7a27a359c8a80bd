#include "elasticity/tet_element.hpp"

#include <Eigen/Sparse>
#include <map>
#include <random>

#include "mesh/tet_mesh.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/eigenvalues.hpp"
#include "support/tolerance.hpp"

namespace pliant::tet_element_test {
namespace {

using test::tolerance;

template <int Nodes, bool Curved>
struct Kind {
  static constexpr int nodes = Nodes;
  static constexpr bool curved = Curved;
};

template <int N>
using NodeMatrix = Eigen::Matrix<double, N, 3>;
template <int N>
using NodeVector = Eigen::Matrix<double, 3 * N, 1>;

constexpr double size = 0.05;  // of an element [m]

/// Badly shaped, but valid: no two edges or angles are alike.
template <class K>
std::vector<NodeMatrix<K::nodes>> elements() {
  std::vector<NodeMatrix<K::nodes>> list;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-0.25, 0.25);
  while (list.size() < 6) {
    NodeMatrix<K::nodes> X;
    X.template topRows<4>() << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
    for (int a = 0; a < 4; ++a) X.row(a) += Eigen::RowVector3d(uniform(random), uniform(random), uniform(random));
    if constexpr (K::nodes == 10)
      for (int m = 0; m < 6; ++m) {
        X.row(4 + m) = 0.5 * (X.row(tet_edges[m][0]) + X.row(tet_edges[m][1]));
        if (K::curved) X.row(4 + m) += 0.2 * Eigen::RowVector3d(uniform(random), uniform(random), uniform(random));
      }
    list.push_back(size * X);
  }
  return list;
}

template <int N>
NodeVector<N> nodal(const NodeMatrix<N>& X, const std::function<Vector3(const Vector3&)>& field) {
  NodeVector<N> u;
  for (int a = 0; a < N; ++a) u.template segment<3>(3 * a) = field(X.row(a).transpose());
  return u;
}

/// Work-equivalent nodal forces of tractions t = stress(x) n over the element's own, possibly curved, faces, by a
/// product of Gauss rules that is exact for the polynomials met here.
template <int N>
NodeVector<N> traction_forces(const NodeMatrix<N>& X, const std::function<Matrix3(const Vector3&)>& stress) {
  static constexpr std::array<double, 4> gauss = {0.3399810435848563, -0.3399810435848563, 0.8611363115940526,
                                                  -0.8611363115940526};
  static constexpr std::array<double, 4> weight = {0.6521451548625461, 0.6521451548625461, 0.3478548451374538,
                                                   0.3478548451374538};
  NodeVector<N> forces = NodeVector<N>::Zero();
  for (const auto& [i, j, k] : tet_faces)
    for (int p = 0; p < 4; ++p)
      for (int q = 0; q < 4; ++q) {
        const double s = 0.5 * (1.0 + gauss[p]),
                     t = 0.5 * (1.0 + gauss[q]) * (1.0 - s);  // the square folded to a triangle
        Barycentric at = Barycentric::Zero();
        at[j] = s, at[k] = t, at[i] = 1.0 - s - t;
        const auto derivatives = tet_shape_derivatives<N>(at);
        const Matrix3 J = X.transpose() * derivatives;
        const auto towards = [&](int c) -> Vector3 { return c == 0 ? Vector3::Zero() : Vector3(J.col(c - 1)); };
        const Vector3 area =
            (towards(j) - towards(i)).cross(towards(k) - towards(i)) * (0.25 * weight[p] * weight[q] * (1.0 - s));
        const auto shape = tet_shape_functions<N>(at);
        Vector3 x = Vector3::Zero();
        for (int a = 0; a < N; ++a) x += shape[a] * X.row(a).transpose();
        for (int a = 0; a < N; ++a) forces.template segment<3>(3 * a) += shape[a] * (stress(x) * area);
      }
  return forces;
}

Matrix3 stress_of(const Matrix3& gradient, double nu) {
  const UnitLame c = unit_lame(nu);
  const Matrix3 strain = 0.5 * (gradient + gradient.transpose());
  return c.lambda * strain.trace() * Matrix3::Identity() + 2.0 * c.mu * strain;
}

Matrix3 some_gradient() {
  Matrix3 gradient;
  gradient << 0.3, -0.2, 0.5, 0.1, -0.4, 0.25, 0.7, 0.35, 0.15;
  return gradient;
}

template <class K>
class TetElement : public ::testing::Test {};
using Kinds = ::testing::Types<Kind<4, false>, Kind<10, false>, Kind<10, true>>;

class KindNames {
 public:
  template <class K>
  static std::string GetName(int) {
    return K::nodes == 4 ? "Linear" : K::curved ? "QuadraticCurved" : "QuadraticStraight";
  }
};
TYPED_TEST_SUITE(TetElement, Kinds, KindNames);

TYPED_TEST(TetElement, HasSixRigidModesAndIsOtherwisePositive) {
  constexpr int N = TypeParam::nodes;
  for (const NodeMatrix<N>& X : elements<TypeParam>()) {
    const auto K = tet_stiffness<N>(X, 0.3).value;
    const double scale = K.norm();
    EXPECT_LT((K - K.transpose()).norm(), tolerance(1e-15) * scale);
    for (int d = 0; d < 3; ++d) {
      EXPECT_LT((K * nodal<N>(X, [&](const Vector3&) -> Vector3 { return Vector3::Unit(d); })).norm(),
                tolerance(1e-13) * scale);
      EXPECT_LT((K * nodal<N>(X, [&](const Vector3& p) -> Vector3 { return Vector3::Unit(d).cross(p) / size; })).norm(),
                tolerance(1e-13) * scale);
    }
    const VectorX eigenvalues = test::eigenvalues(K);
    EXPECT_LT(eigenvalues.head<6>().cwiseAbs().maxCoeff(), tolerance(1e-13) * scale);
    EXPECT_GT(eigenvalues[6], 1e-4 * scale) << "a zero-energy mode that is not rigid";
  }
}

TYPED_TEST(TetElement, PatchTest) {
  constexpr int N = TypeParam::nodes;
  const Matrix3 gradient = some_gradient();
  for (const double nu : {0.0, 0.3, 0.499})
    for (const NodeMatrix<N>& X : elements<TypeParam>()) {
      const Matrix3 stress = stress_of(gradient, nu);
      const NodeVector<N> u =
          nodal<N>(X, [&](const Vector3& p) -> Vector3 { return gradient * p + Vector3(0.1, 0.2, 0.3); });
      const NodeVector<N> force = tet_stiffness<N>(X, nu).value * u;
      const NodeVector<N> expected = traction_forces<N>(X, [&](const Vector3&) { return stress; });
      ASSERT_GT(expected.norm(), 0.0);
      EXPECT_LT((force - expected).norm(), tolerance(1e-11) * expected.norm());
      const double volume = MatrixX(tet_mass<N>(X)).sum();
      const auto mean = tet_mean_gradients<N>(X);
      NodeVector<N> by_mean;  // virtual work of a constant stress: V sigma grad N
      for (int a = 0; a < N; ++a) by_mean.template segment<3>(3 * a) = volume * stress * mean.row(a).transpose();
      EXPECT_LT((force - by_mean).norm(), tolerance(1e-11) * expected.norm());
    }
}

TYPED_TEST(TetElement, DerivativeByPoissonsRatioMatchesCentralDifferences) {
  constexpr int N = TypeParam::nodes;
  for (const NodeMatrix<N>& X : elements<TypeParam>())
    for (const double nu : {0.1, 0.35, 0.48}) {
      const auto dK = tet_stiffness<N>(X, nu).d_poissons_ratio;
      ASSERT_GT(dK.norm(), 0.0);
      const auto along = [&](double step) -> VectorX { return tet_stiffness<N>(X, nu + step).value.reshaped(); };
      EXPECT_LT(test::best_relative_error(along, dK.reshaped(), 0.1), tolerance(1e-8));
    }
}

TYPED_TEST(TetElement, MassHasTheVolumeTheCentroidAndIsPositive) {
  constexpr int N = TypeParam::nodes;
  for (const NodeMatrix<N>& X : elements<TypeParam>()) {
    const MatrixX M = tet_mass<N>(X);
    // By the divergence theorem over the faces: volume from x / 3, its first moments from x_d^2 / 2.
    const auto flux = [&](const std::function<Matrix3(const Vector3&)>& field) {
      const NodeVector<N> forces = traction_forces<N>(X, field);  // nodes' shares sum to the whole
      Vector3 sum = Vector3::Zero();
      for (int a = 0; a < N; ++a) sum += forces.template segment<3>(3 * a);
      return sum;
    };
    const double volume = flux([](const Vector3& x) { return Matrix3(Vector3::UnitX() * x.transpose() / 3.0); }).x();
    const Vector3 moment = flux([](const Vector3& x) { return Matrix3((0.5 * x.cwiseAbs2()).asDiagonal()); });
    EXPECT_NEAR(M.sum(), volume, tolerance(1e-13) * volume);
    EXPECT_LT((X.transpose() * M.rowwise().sum() - moment).norm(), tolerance(1e-12) * volume * size);
    EXPECT_LT((M - M.transpose()).norm(), tolerance(1e-15) * M.norm());
    const VectorX eigenvalues = test::eigenvalues(M);
    EXPECT_GT(eigenvalues[0], 1e-3 * eigenvalues[N - 1]);
  }
}

TYPED_TEST(TetElement, GradientsAndTheirMeanGiveTheDeformationGradient) {
  constexpr int N = TypeParam::nodes;
  Matrix3 F;
  F << 1.3, -0.2, 0.5, 0.1, 0.7, 0.25, 0.7, 0.35, 1.15;
  for (const NodeMatrix<N>& X : elements<TypeParam>()) {
    const NodeMatrix<N> x = (X * F.transpose()).rowwise() + Eigen::RowVector3d(1, 2, 3);
    EXPECT_LT((x.transpose() * tet_mean_gradients<N>(X) - F).norm(), tolerance(1e-11));
    EXPECT_LT((x.transpose() * tet_gradients<N>(X, Barycentric(0.1, 0.2, 0.4, 0.3)) - F).norm(), tolerance(1e-11));
  }
}

TEST(LinearTet, MassIsExact) {
  const MatrixX M = tet_mass<4>(elements<Kind<4, false>>().front());
  const double V = M.sum();
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) EXPECT_NEAR(M(a, b), V / (a == b ? 10.0 : 20.0), tolerance(1e-15) * V);
}

TEST(QuadraticTet, MassOfStraightElementsIsExact) {
  const MatrixX M = tet_mass<10>(elements<Kind<10, false>>().front());
  const double V = M.sum(), near = tolerance(1e-15) * V;
  // Integrals of products of the shape functions, from those of barycentric coordinates: multiples of V / 420.
  EXPECT_NEAR(M(0, 0), 6.0 / 420.0 * V, near);
  EXPECT_NEAR(M(0, 1), 1.0 / 420.0 * V, near);
  EXPECT_NEAR(M(0, 4), -4.0 / 420.0 * V, near);  // on an edge of the corner
  EXPECT_NEAR(M(0, 7), -6.0 / 420.0 * V, near);  // on an edge opposite
  EXPECT_NEAR(M(4, 4), 32.0 / 420.0 * V, near);
  EXPECT_NEAR(M(4, 5), 16.0 / 420.0 * V, near);  // edges 01 and 02 share a corner
  EXPECT_NEAR(M(4, 9), 8.0 / 420.0 * V, near);   // edges 01 and 23 do not
}

/// Pure bending of a bar along x with curvature 1: stress E y along x and nothing else, whatever Poisson's ratio.
Vector3 bending(const Vector3& p, double nu) {
  return {p.x() * p.y(), -0.5 * (p.x() * p.x() + nu * (p.y() * p.y() - p.z() * p.z())), -nu * p.y() * p.z()};
}

TEST(QuadraticTet, BendsExactlyAtAnyPoissonsRatio) {
  for (const double nu : {0.0, 0.3, 0.499})
    for (const NodeMatrix<10>& X : elements<Kind<10, false>>()) {
      const NodeVector<10> force =
          tet_stiffness<10>(X, nu).value * nodal<10>(X, [&](const Vector3& p) { return bending(p, nu); });
      const NodeVector<10> expected =
          traction_forces<10>(X, [](const Vector3& p) -> Matrix3 { return Vector3(p.y(), 0.0, 0.0).asDiagonal(); });
      ASSERT_GT(expected.norm(), 0.0);
      EXPECT_LT((force - expected).norm(), tolerance(1e-9) * expected.norm()) << nu;  // parts cancel by 1 / (1 - 2 nu)
    }
}

/// Deflection of a cantilever under a shear force at its end over Timoshenko's, E = 1.
template <int N>
double cantilever(double nu) {
  const double length = 8.0;
  Box box;
  box.extend(Vector3(0.0, -0.5, -0.5));
  box.extend(Vector3(length, 0.5, 0.5));
  const TetMesh mesh = make_tet_box(box, {8, 2, 2}, N == 10);
  std::vector<Eigen::Triplet<double>> entries;
  VectorX load = VectorX::Zero(3 * mesh.node_count());
  const auto element = [&](int e) {
    std::array<int, N> nodes;
    for (int a = 0; a < N; ++a) nodes[a] = a < 4 ? mesh.tets[e][a] : mesh.mid_nodes[e][a - 4];
    return nodes;
  };
  // End faces are held along the bar only, and by its axis otherwise, so that it may narrow there.
  const auto held = [&](int node, int d) {
    const Vector3 p = mesh.nodes.row(node);
    if (p.x() > 1e-9) return false;
    return d == 0 || (std::abs(p.y()) < 1e-9 && std::abs(p.z()) < 1e-9) || (d == 2 && std::abs(p.z()) < 1e-9);
  };
  for (int e = 0; e < mesh.tet_count(); ++e) {
    const auto nodes = element(e);
    NodeMatrix<N> X;
    for (int a = 0; a < N; ++a) X.row(a) = mesh.nodes.row(nodes[a]);
    const auto K = tet_stiffness<N>(X, nu).value;
    for (int a = 0; a < N; ++a)
      for (int b = 0; b < N; ++b)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j)
            if (!held(nodes[a], i) && !held(nodes[b], j))
              entries.emplace_back(3 * nodes[a] + i, 3 * nodes[b] + j, K(3 * a + i, 3 * b + j));
    // Parabolic shear over the end face, of resultant one.
    const NodeVector<N> forces = traction_forces<N>(X, [&](const Vector3& p) -> Matrix3 {
      return p.x() > length - 1e-9
                 ? Matrix3(Vector3::UnitY() * Vector3::UnitX().transpose() * (1.5 - 6.0 * p.y() * p.y()))
                 : Matrix3::Zero();
    });
    for (int a = 0; a < N; ++a)
      if (mesh.nodes(nodes[a], 0) > length - 1e-9) load[3 * nodes[a] + 1] += forces[3 * a + 1];
  }
  for (int n = 0; n < mesh.node_count(); ++n)
    for (int d = 0; d < 3; ++d)
      if (held(n, d)) {
        entries.emplace_back(3 * n + d, 3 * n + d, 1.0);
        load[3 * n + d] = 0.0;
      }
  Eigen::SparseMatrix<double> K(load.size(), load.size());
  K.setFromTriplets(entries.begin(), entries.end());
  const VectorX u = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(K).solve(load);
  const double total = load(Eigen::seq(1, Eigen::last, 3)).sum();
  EXPECT_NEAR(total, 1.0, 1e-12);
  const double bent = std::pow(length, 3) / (3.0 / 12.0), sheared = length * 2.0 * (1.0 + nu) * 1.2;
  return u.dot(load) / (bent + sheared);
}

TEST(QuadraticTet, BarsBendWithoutLockingUpToNearlyIncompressible) {
  for (const double nu : {0.0, 0.3, 0.499}) EXPECT_NEAR(cantilever<10>(nu), 1.0, tolerance(0.03)) << nu;
  EXPECT_LT(cantilever<4>(0.3), 0.7) << "linear elements are too stiff: the test would see it";
  EXPECT_LT(cantilever<4>(0.499), 0.3);
}

}  // namespace
}  // namespace pliant::tet_element_test
