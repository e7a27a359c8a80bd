// Modes of vibration: against beam theory, against a dense solver, and what must hold of any modes.
#include "elasticity/modes.hpp"

#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "elasticity/modulus_field.hpp"
#include "input_errors.hpp"
#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/derivatives.hpp"
#include "support/eigenvalues.hpp"
#include "support/tolerance.hpp"

namespace pliant::modes_test {
namespace {

using test::tolerance;

MotionLayout layout_of(const Body& body) { return MotionLayout({.moduli = body.modulus.controls}); }

VectorX material(const Body& body, double youngs_modulus, double poissons_ratio, double density) {
  const MotionLayout layout = layout_of(body);
  VectorX theta = layout.zero();
  for (int k = 0; k < body.modulus.controls; ++k)
    theta[layout.youngs_moduli[std::size_t(k)]] = youngs_modulus * (1.0 + 0.7 * k);
  theta[layout.poissons_ratio] = poissons_ratio;
  theta[layout.density] = density;
  return theta;
}

/// Nodes of the low end along x.
std::vector<int> low_end(const Body& body, double share) {
  const double least = body.nodes.col(0).minCoeff(), most = body.nodes.col(0).maxCoeff();
  std::vector<int> held;
  for (int n = 0; n < body.node_count(); ++n)
    if (body.nodes(n, 0) < least + share * (most - least) + 1e-6) held.push_back(n);
  return held;
}

/// K at rest.
BlockMatrix stiffness(const std::shared_ptr<const Body>& body, const VectorX& theta) {
  const auto elasticity = make_elasticity(body, layout_of(*body));
  elasticity->set_parameters(theta);
  elasticity->linearise(body->reference_positions());
  BlockMatrix K(body->pattern);
  elasticity->add_matrix(1.0, K);
  return K;
}

/// K and M with held nodes in them.
std::pair<MatrixX, MatrixX> dense_matrices(const std::shared_ptr<const Body>& body, const VectorX& theta) {
  const ModalAnalysis free(body, layout_of(*body), {});
  const int n = 3 * body->node_count();
  MatrixX M(n, n);
  for (int i = 0; i < n; ++i) {
    const VectorX unit = VectorX::Unit(n, i);
    M.col(i) = flat(free.mass_product(theta, as_points(unit)));
  }
  return {test::dense(stiffness(body, theta)), M};
}

// A clamped bar, 1 x 0.1 x 0.1 m.
constexpr double length = 1.0, edge = 0.1, modulus = 1e5, density = 100.0, nu = 0.3;
constexpr double area = edge * edge, second_moment = edge * edge * edge * edge / 12.0;
// Theory leaves out that the clamp keeps the end from contracting.
constexpr double beam_tolerance = 0.02;

/// Bending frequencies of Timoshenko's cantilever [rad/s], ascending, to rounding. With deflection w, turn psi, moment
/// M = E I psi' and shear force Q = k G A (w' - psi), harmonic motion is (w, psi, M, Q)' = S (w, psi, M, Q); from the
/// clamp, w = psi = 0, to the free end, M = Q = 0, the part of exp(S L) that takes (M, Q) to (M, Q) is singular.
std::vector<double> theory_bending(int count) {
  const double shear_stiffness = 5.0 / 6.0 * modulus / (2.0 * (1.0 + nu)) * area;
  const auto end = [&](double omega) {
    Eigen::Matrix4d S = Eigen::Matrix4d::Zero();
    S(0, 1) = 1.0, S(0, 3) = 1.0 / shear_stiffness;
    S(1, 2) = 1.0 / (modulus * second_moment);
    S(2, 1) = -density * second_moment * omega * omega, S(2, 3) = -1.0;
    S(3, 0) = -density * area * omega * omega;
    const Eigen::Vector4d scale(1.0, 1.0, modulus * second_moment, modulus * second_moment);  // of length one
    const Eigen::Matrix4d scaled = scale.cwiseInverse().asDiagonal() * S * scale.asDiagonal();
    return Eigen::Matrix4d((scaled * length).exp()).bottomRightCorner<2, 2>().determinant();
  };
  std::vector<double> roots;
  const double step = 0.02 * std::sqrt(modulus * second_moment / (density * area)) / (length * length);
  for (double omega = step; int(roots.size()) < count; omega += step) {
    if (end(omega) * end(omega + step) > 0.0) continue;
    double low = omega, high = omega + step;
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = 0.5 * (low + high);
      (end(low) * end(middle) > 0.0 ? low : high) = middle;
    }
    roots.push_back(low);
  }
  return roots;
}
double theory_stretching() { return 0.5 * std::numbers::pi / length * std::sqrt(modulus / density); }

struct BarKind {
  const char* name;
  std::function<std::shared_ptr<const Body>(MassKind)> make;
  friend void PrintTo(const BarKind& kind, std::ostream* out) { *out << kind.name; }
};

/// Slender beams follow Euler and Bernoulli, of whom Timoshenko's beam of 1 : 10 has lost less than a hundredth in the
/// first mode and several in the third.
TEST(BeamModesTheory, IsEulersLessShear) {
  const std::vector<double> timoshenko = theory_bending(3);
  const std::array<double, 3> roots = {1.8751040687, 4.6940911330, 7.8547574382};
  const std::array<double, 3> least = {0.98, 0.90, 0.80};
  for (std::size_t i = 0; i < 3; ++i) {
    const double euler =
        roots[i] * roots[i] * std::sqrt(modulus * second_moment / (density * area)) / (length * length);
    EXPECT_LT(timoshenko[i], euler) << i;
    EXPECT_GT(timoshenko[i], least[i] * euler) << i;
  }
}

class BeamModes : public ::testing::TestWithParam<BarKind> {};

/// Of the bar's mass, what moves along an axis with this mode (its effective modal mass): the shares of all modes sum
/// to one, but for held nodes.
double momentum_share(const ModalAnalysis& analysis, const VectorX& theta, const Points& shape, int axis) {
  Points along = Points::Zero(shape.rows(), 3);
  along.col(axis).setOnes();
  const double momentum = flat(analysis.mass_product(theta, along)).dot(flat(shape));
  return momentum * momentum / (density * area * length);
}

TEST_P(BeamModes, BendAndStretchAsTheorySays) {
  for (const MassKind mass : {MassKind::Consistent, MassKind::Lumped}) {
    const auto body = GetParam().make(mass);
    const VectorX theta = material(*body, modulus, nu, density);
    ModalAnalysis analysis(body, layout_of(*body), low_end(*body, 0.0));
    const Modes modes = analysis.lowest(theta, 10);
    ASSERT_TRUE(modes.converged) << modes.failure;
    // Bendings come in pairs, one a plane, and are the modes that carry momentum across the bar.
    const std::vector<double> theory = theory_bending(3);
    std::vector<double> bending;
    for (int i = 0; i < modes.count(); ++i)
      if (momentum_share(analysis, theta, modes.shapes[std::size_t(i)], 1) +
              momentum_share(analysis, theta, modes.shapes[std::size_t(i)], 2) >
          0.02)
        bending.push_back(std::sqrt(modes.squared_frequencies[i]));
    ASSERT_GE(bending.size(), 6u);
    for (std::size_t i = 0; i < 6; ++i) {
      // The mesh's own error grows with the wave number's square.
      EXPECT_NEAR(bending[i] / theory[i / 2], 1.0, tolerance(beam_tolerance * (i < 4 ? 1.0 : 2.0))) << i;
      RecordProperty("bending " + std::to_string(i), std::to_string(bending[i] / theory[i / 2] - 1));
    }
    // The stretching mode is the one that carries most momentum along the bar.
    int stretching = 0;
    double most = 0.0;
    for (int i = 0; i < modes.count(); ++i)
      if (const double share = momentum_share(analysis, theta, modes.shapes[std::size_t(i)], 0); share > most)
        most = share, stretching = i;
    EXPECT_GT(stretching, 3);
    EXPECT_NEAR(std::sqrt(modes.squared_frequencies[stretching]) / theory_stretching(), 1.0, tolerance(beam_tolerance));
    RecordProperty("stretching",
                   std::to_string(std::sqrt(modes.squared_frequencies[stretching]) / theory_stretching() - 1));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Bars, BeamModes,
    ::testing::Values(
        BarKind{"Hexahedra",
                [](MassKind mass) {
                  return test::box_body({length, edge, edge}, edge / 2, {HexFormulation::IncompatibleModes, mass});
                }},
        BarKind{"QuadraticTetrahedra",
                [](MassKind mass) {
                  return test::tet_body({length, edge, edge}, {16, 2, 2}, true, 0.0,
                                        {HexFormulation::IncompatibleModes, mass});
                }}),
    [](const auto& kind) { return kind.param.name; });

/// Linear tetrahedra of that size are far too stiff in bending: the tolerance above can tell.
TEST(BeamModesOfLinearTetrahedra, AreTooHigh) {
  const auto body = test::tet_body({length, edge, edge}, {16, 2, 2}, false, 0.0);
  const Modes found = modes(body, layout_of(*body), material(*body, modulus, nu, density), low_end(*body, 0.0), 2);
  EXPECT_GT(std::sqrt(found.squared_frequencies[0]) / theory_bending(1)[0], 1.0 + 3.0 * beam_tolerance);
}

class ModesOf : public ::testing::TestWithParam<test::BodyKind> {
 protected:
  std::shared_ptr<const Body> body() const {
    Body graded = *GetParam().make();
    graded.modulus = linear_field(graded, Vector3::UnitX(), 3).field;
    return std::make_shared<Body>(std::move(graded));
  }
};

TEST_P(ModesOf, AreMassOrthonormalAndSolveTheEquation) {
  const auto body = this->body();
  const VectorX theta = material(*body, 5e4, 0.4, 900.0);
  const BlockMatrix K = stiffness(body, theta);
  for (const double share : {0.0, 0.3}) {
    ModalAnalysis analysis(body, layout_of(*body), low_end(*body, share));
    const Modes modes = analysis.lowest(theta, 8);
    ASSERT_TRUE(modes.converged) << modes.failure;
    ASSERT_EQ(modes.count(), 8);
    for (int i = 0; i < modes.count(); ++i) {
      const Points& shape = modes.shapes[std::size_t(i)];
      const Points momentum = analysis.mass_product(theta, shape);
      for (int j = 0; j < modes.count(); ++j)
        EXPECT_NEAR(flat(momentum).dot(flat(modes.shapes[std::size_t(j)])), i == j, tolerance(1e-9)) << i << " " << j;
      VectorX force;
      K.multiply(flat(shape), force);
      Points residual = as_points(force) - modes.squared_frequencies[i] * momentum;
      for (const int node : analysis.held()) {
        EXPECT_EQ(shape.row(node).norm(), 0.0);
        residual.row(node).setZero();
      }
      // The iteration's tolerance times the spread of the matrix, which the residual weighs high modes by.
      EXPECT_LT(residual.norm(), tolerance(1e-6) * modes.squared_frequencies[i] * momentum.norm()) << i;
      if (i > 0) {
        EXPECT_GE(modes.squared_frequencies[i], modes.squared_frequencies[i - 1]);
      }
    }
  }
}

TEST_P(ModesOf, AreThoseOfADenseSolver) {
  const auto body = this->body();
  const VectorX theta = material(*body, 5e4, 0.4, 900.0);
  ModalAnalysis analysis(body, layout_of(*body), low_end(*body, 0.3));
  const auto [K, M] = dense_matrices(body, theta);
  std::vector<int> free;
  for (int node = 0; node < body->node_count(); ++node)
    if (!std::ranges::binary_search(analysis.held(), node))
      for (int d = 0; d < 3; ++d) free.push_back(3 * node + d);
  const VectorX exact = test::generalised_eigen(K(free, free), M(free, free)).values;
  const Modes modes = analysis.lowest(theta, 12);
  ASSERT_TRUE(modes.converged) << modes.failure;
  for (int i = 0; i < modes.count(); ++i)
    EXPECT_NEAR(modes.squared_frequencies[i] / exact[i], 1.0, tolerance(1e-8)) << i;
}

TEST_P(ModesOf, ChangeWithTheModuliAsCentralDifferencesDo) {
  const auto body = this->body();
  const VectorX theta = material(*body, 5e4, 0.4, 900.0);
  ModalAnalysis analysis(body, layout_of(*body), low_end(*body, 0.3));
  const Modes modes = analysis.lowest(theta, 5);
  const MatrixX derivatives = analysis.modulus_derivatives(theta, modes);
  ASSERT_EQ(derivatives.cols(), 3);
  VectorX scaled = VectorX::Zero(5);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Index index = layout_of(*body).youngs_moduli[std::size_t(k)];
    scaled += theta[index] * derivatives.col(k);
    const auto along = [&](double h) -> VectorX {
      VectorX moved = theta;
      moved[index] += h;
      return analysis.lowest(moved, 5).squared_frequencies;
    };
    EXPECT_GT(derivatives.col(k).norm() * theta[index], 1e-3 * modes.squared_frequencies[0]);
    EXPECT_LT(test::best_relative_error(along, derivatives.col(k), theta[index]), tolerance(1e-6)) << k;
  }
  // lambda is proportional to all moduli together.
  EXPECT_LT((scaled - modes.squared_frequencies).norm(), tolerance(1e-8) * modes.squared_frequencies.norm());
}

TEST_P(ModesOf, BeginWithSixRigidMotionsWhereNothingIsHeld) {
  const auto body = this->body();
  const VectorX theta = material(*body, 5e4, 0.4, 900.0);
  ModalAnalysis analysis(body, layout_of(*body), {});
  const Modes modes = analysis.lowest(theta, 9);
  ASSERT_TRUE(modes.converged) << modes.failure;
  for (int i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(modes.squared_frequencies[i]), tolerance(1e-8) * modes.squared_frequencies[6]) << i;
  EXPECT_GT(modes.squared_frequencies[6], 1.0);
  // They span all rigid motions: such a motion has no part outside them.
  Points turn(body->node_count(), 3);
  for (Eigen::Index n = 0; n < turn.rows(); ++n)
    turn.row(n) =
        Vector3(0.3, -0.2, 0.5).cross(Vector3(body->nodes.row(n))).transpose() + Eigen::RowVector3d(0.1, 0.2, -0.05);
  Points outside = turn;
  for (int i = 0; i < 6; ++i)
    outside -=
        flat(analysis.mass_product(theta, turn)).dot(flat(modes.shapes[std::size_t(i)])) * modes.shapes[std::size_t(i)];
  EXPECT_LT(outside.norm(), tolerance(1e-7) * turn.norm());
}

INSTANTIATE_TEST_SUITE_P(Kinds, ModesOf, ::testing::ValuesIn(test::body_kinds()),
                         [](const auto& kind) { return kind.param.name; });

/// A free cube of cells has its symmetries, so most eigenvalues occur two or three times.
TEST(RepeatedModes, AreAllFound) {
  const auto body = test::box_body({0.1, 0.1, 0.1}, 0.05);
  const VectorX theta = material(*body, 1e4, 0.3, 1000.0);
  ModalAnalysis analysis(body, layout_of(*body), {});
  const auto [K, M] = dense_matrices(body, theta);
  const VectorX exact = test::generalised_eigen(K, M).values;
  for (const int count : {7, 9, 16, 24}) {
    const Modes modes = analysis.lowest(theta, count);
    ASSERT_TRUE(modes.converged) << modes.failure;
    for (int i = 6; i < count; ++i)
      EXPECT_NEAR(modes.squared_frequencies[i] / exact[i], 1.0, tolerance(1e-8)) << count << " " << i;
  }
}

TEST(ModesThatCannotBe, AreToldInWords) {
  const auto body = test::tet_body({0.2, 0.1, 0.12}, {2, 1, 1}, false);
  const MotionLayout layout;
  VectorX theta = material(*body, 1e4, 0.3, 1000.0);
  EXPECT_THAT(test::complaint_of([&] { modes(body, layout, theta, {99}, 1); }), ::testing::HasSubstr("held node 99"));
  EXPECT_THAT(test::complaint_of([&] { modes(body, layout, theta, {}, 0); }), ::testing::HasSubstr("0 modes"));
  EXPECT_THAT(test::complaint_of([&] { modes(body, layout, theta, {}, 30); }), ::testing::HasSubstr("of 36 unknowns"));
  theta[layout.density] = 0.0;
  EXPECT_THAT(test::complaint_of([&] { modes(body, layout, theta, {}, 1); }), ::testing::HasSubstr("density"));
  theta[layout.density] = 1.0;
  layout.set_moduli(theta, std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(modes(body, layout, theta, {}, 1).converged);
}

}  // namespace
}  // namespace pliant::modes_test
