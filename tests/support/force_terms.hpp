#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "elasticity/corotated.hpp"
#include "elasticity/force_term.hpp"
#include "elasticity/law_layout.hpp"
#include "parameters/motion_blocks.hpp"
#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::test {

/// One battery for every force: a room's test instantiates it for its own.
inline constexpr int pulls = 2;

/// Blocks of the battery's parameter vector: those of a motion and, where a family has a law, the law's.
struct SceneBlocks : MotionBlocks {
  LawLayout law;
};

struct Family {
  std::string name;
  std::function<std::shared_ptr<const Body>()> body;
  std::function<std::unique_ptr<ForceTerm>(std::shared_ptr<const Body>, const SceneBlocks&)> make;
  bool depends_on_lag, depends_on_position;
  std::function<std::vector<ParameterHandle>(const SceneBlocks&)> parameters;  ///< that it depends on
  /// Whether its lag matrix is exact wherever z is; else it is where z is the lag point, and zero there.
  bool has_lag_matrix = false;
  bool depends_on_reference = false;  ///< an `Elasticity` with derivatives by where the nodes are stress-free
  std::optional<LawForm> law = {};    ///< whose blocks the parameter vector has too
  bool has_potential = false;
  bool sees_start = false;  ///< depends on the step's start by itself
  bool rests = false;       ///< nothing where there is no step
  bool has_row = false;     ///< acts on a row below the nodes', of a rigid body whose place is unknown: `with_row`
};

/// The body's pattern with a row for a rigid body, which meets all nodes.
inline std::shared_ptr<const BlockPattern> with_row(const Body& body) {
  const BlockPattern& own = *body.pattern;
  auto pattern = std::make_shared<BlockPattern>();
  pattern->rows = own.rows + 1;
  pattern->row_start.push_back(0);
  const auto end_row = [&] { pattern->row_start.push_back(int(pattern->column.size())); };
  for (int row = 0; row < own.rows; ++row) {
    for (int b = own.row_start[std::size_t(row)]; b < own.row_start[std::size_t(row) + 1]; ++b) {
      if (own.column[std::size_t(b)] == row) pattern->diagonal.push_back(int(pattern->column.size()));
      pattern->column.push_back(own.column[std::size_t(b)]);
    }
    pattern->column.push_back(own.rows);
    end_row();
  }
  for (int column = 0; column <= own.rows; ++column) pattern->column.push_back(column);
  pattern->diagonal.push_back(int(pattern->column.size()) - 1);
  end_row();
  return pattern;
}

/// Positions of the nodes with that of a rigid body below.
inline Points with_row(const Points& nodes, const Vector3& translation) {
  Points all(nodes.rows() + 1, 3);
  all << nodes, translation.transpose();
  return all;
}

inline void PrintTo(const Family& family, std::ostream* out) { *out << family.name; }

struct ForceTerms : ::testing::TestWithParam<Family> {
  ForceTerms()
      : body(GetParam().body()),
        layout(add_blocks()),
        term(GetParam().make(body, layout)),
        theta(VectorX::Zero(all.size())) {
    // Of laws: terms that stiffen in tension and in compression.
    for (const auto& [name, value] : std::initializer_list<std::pair<std::string, double>>{
             {"exponent_1", 5.0}, {"exponent_2", -4.0}, {"stiffness_ratio_2", 0.6}, {"poissons_ratio_2", 0.2}})
      if (all.contains(name)) theta[all.at(name)] = value;
    constexpr std::array moduli = {3000.0, 2000.0, 5000.0};
    for (std::size_t k = 0; k < layout.youngs_moduli.size(); ++k) theta[layout.youngs_moduli[k]] = moduli[k];
    theta[layout.poissons_ratio] = 0.35;
    theta[layout.mass_damping] = 0.4;
    theta[layout.stiffness_damping] = 0.002;
    theta[layout.density] = 120.0;
    theta.segment<3>(layout.gravity) = Vector3(0.3, -9.7, 0.2);
    theta.segment<3>(layout.planes[0].normal) = Vector3::UnitX();
    theta.segment<3>(layout.planes[0].point) = Vector3(-1, 0, 0);
    theta.segment<3>(layout.planes[1].normal) = Vector3(0.2, 0.9, -0.3).normalized();
    theta.segment<3>(layout.planes[1].point) = Vector3(0.01, 0.0, -0.02);  // through the middle: gaps of both signs
    theta[layout.planes[1].friction] = 0.4;
    theta[layout.obstacles[0].friction] = 0.6;
    theta[layout.contact_stiffness] = 2e5;
    theta.segment<3>(layout.pulls[0]) = Vector3(0.1, -0.2, 0.05);
    theta.segment<3>(layout.pulls[1]) = Vector3(0.02, 0.15, -0.1);
    theta.segment<3>(layout.wind) = Vector3(4.0, -1.0, 2.0);
    theta[layout.strengths[0]] = 0.7;
    lag = deformed(body->reference_positions(), 0.3);
    z = deformed(body->reference_positions(), 0.28, 1.93);
    d_lag = deformed(body->reference_positions(), 0.6, -0.7);
    d_z = deformed(body->reference_positions(), 0.9, 0.6);
    start = deformed(body->reference_positions(), 0.2, 1.85);
    d_start = deformed(body->reference_positions(), 0.4, 2.2);
    d_start_velocity = deformed(body->reference_positions(), 0.8, -1.1);
    if (GetParam().has_row) {
      lag = with_row(lag, {0.01, -0.005, 0.003}), z = with_row(z, {0.012, -0.006, 0.001});
      d_lag = with_row(d_lag, {0.1, 0.2, -0.1}), d_z = with_row(d_z, {-0.1, 0.05, 0.2});
      start = with_row(start, {0.0, 0.002, 0.0}), d_start = with_row(d_start, {0.05, -0.1, 0.1});
      d_start_velocity = with_row(d_start_velocity, {0.0, 0.3, 0.1});
    }
    start_velocity = 3.0 * (lag - start);
    pattern = GetParam().has_row ? with_row(*body) : body->pattern;
  }

  SceneBlocks add_blocks() {
    SceneBlocks blocks;
    const MotionCounts counts{
        .moduli = body->modulus.controls, .planes = 2, .obstacles = 1, .pulls = pulls, .wind = true, .strengths = 1};
    static_cast<MotionBlocks&>(blocks) = add_motion_blocks(all, counts);
    if (GetParam().law) blocks.law = LawLayout::of_motion(all, blocks, *GetParam().law);
    return blocks;
  }

  Points force(const Points& at_lag, const Points& at_z, const VectorX& at_theta) {
    term->set_parameters(at_theta);
    linearise(at_lag);
    Points f = Points::Zero(at_z.rows(), 3);
    term->add_force(at_z, f);
    return f;
  }
  Points tangent(const Points& change_lag, const Points& change_z, const VectorX& change_theta) {
    term->set_parameters(theta);
    linearise(lag);
    Points df = Points::Zero(z.rows(), 3);
    term->add_force_tangent(z, change_lag, change_z, change_theta, df);
    return df;
  }
  /// In the step at hand.
  void linearise(const Points& at_lag) {
    term->begin_step({&start, &start_velocity, 0.1, 0.01});
    term->linearise(at_lag);
  }
  /// Of f(x | x), at rest: there is no step.
  Points static_force(const Points& x) {
    term->begin_step({});
    term->linearise(x);
    Points f = Points::Zero(x.rows(), 3);
    term->add_force(x, f);
    return f;
  }
  Points any(double amount, double angle) const {
    const Points nodes = deformed(body->reference_positions(), amount, angle);
    return GetParam().has_row ? with_row(nodes, {0.1, -0.3, 0.2}) : nodes;
  }
  Points none() const { return Points::Zero(z.rows(), 3); }

  /// Whether the force depends on this number of the parameter vector.
  bool depends_on(int number) const {
    return std::ranges::any_of(GetParam().parameters(layout), [&](const ParameterHandle& block) {
      return number >= block.first && number < block.first + block.size;
    });
  }

  std::shared_ptr<const Body> body;
  ParameterLayout all;
  SceneBlocks layout;
  std::unique_ptr<ForceTerm> term;
  VectorX theta;
  Points lag, z, d_lag, d_z, start, start_velocity, d_start, d_start_velocity;
  std::shared_ptr<const BlockPattern> pattern;
};

// Bottom of the V of central differences: truncation h^2 against rounding 1e-16 / h.
inline constexpr double difference_error = 1e-7;

TEST_P(ForceTerms, AddsToWhatIsThere) {
  const Points f = force(lag, z, theta);
  ASSERT_GT(f.norm(), 0.0);
  Points twice = f;
  term->add_force(z, twice);
  EXPECT_LT((twice - 2 * f).norm(), tolerance(1e-14) * f.norm());
}

TEST_P(ForceTerms, MatrixIsMinusTheDerivativeByPosition) {
  const VectorX change = flat(Points(force(lag, z + d_z, theta) - force(lag, z, theta)));
  BlockMatrix K(pattern);
  term->add_matrix(3.0, K);
  const MatrixX whole = dense(K);
  EXPECT_LE((whole - whole.transpose()).norm(), tolerance(1e-13) * whole.norm());
  ASSERT_EQ(change.norm() > 0.0, GetParam().depends_on_position);
  EXPECT_LE((whole * flat(d_z) + 3.0 * change).norm(), tolerance(1e-10) * change.norm());  // affine: rounding alone
}

TEST_P(ForceTerms, TangentByLagPoint) {
  const Points df = tangent(d_lag, none(), VectorX::Zero(theta.size()));
  ASSERT_EQ(df.norm() > 0.0, GetParam().depends_on_lag);
  if (!GetParam().depends_on_lag) return;
  const auto along = [&](double s) -> VectorX { return flat(force(lag + s * d_lag, z, theta)); };
  EXPECT_LT(best_relative_error(along, flat(df), 0.1), tolerance(difference_error));
  EXPECT_GT(best_relative_error(along, 1.001 * flat(df), 0.1), 1e-4) << "a wrong derivative would pass";
}

TEST_P(ForceTerms, TangentsAlongSeveralDirectionsAreThoseAlongEach) {
  constexpr int count = 6;  // a register of four, one of another, and one on its own
  std::vector<Points> lags, ways, forces;
  std::vector<const Points*> of_lag, of_z;
  MatrixX d_theta = MatrixX::Zero(theta.size(), count);
  for (int c = 0; c < count; ++c) {
    lags.push_back(any(0.1 * c, 0.7 * c - 1.0)), ways.push_back(any(0.2 + 0.1 * c, 1.3 - 0.4 * c));
    for (Eigen::Index i = 0; i < theta.size(); ++i)
      d_theta(i, c) = c == 2 ? 0.0 : theta[i] * std::sin(double(i + 3 * c));
  }
  for (int c = 0; c < count; ++c) of_lag.push_back(&lags[std::size_t(c)]), of_z.push_back(&ways[std::size_t(c)]);
  forces.assign(count, any(0.3, 0.2));  // added to what is there
  term->set_parameters(theta);
  linearise(lag);
  term->prepare_tangents(z, d_theta);
  const std::span<const Points*const> all_lags = of_lag, all_ways = of_z;
  const std::span<Points> all_forces = forces;
  for (const auto& [first, some] : {std::pair<Eigen::Index, Eigen::Index>{5, 1}, {0, 5}}) {  // in any order
    const auto from = std::size_t(first), number = std::size_t(some);
    term->add_force_tangents(
        z, {all_lags.subspan(from, number), all_ways.subspan(from, number), d_theta.middleCols(first, some), first},
        all_forces.subspan(from, number));
  }
  for (int c = 0; c < count; ++c) {
    const auto k = std::size_t(c);
    const Points alone = tangent(lags[k], ways[k], d_theta.col(c));
    EXPECT_LE((forces[k] - any(0.3, 0.2) - alone).norm(), 1e-12 * (alone.norm() + any(0.3, 0.2).norm())) << c;
  }
}

TEST_P(ForceTerms, TangentByPosition) {
  const Points df = tangent(none(), d_z, VectorX::Zero(theta.size()));
  const Points difference = force(lag, z + d_z, theta) - force(lag, z, theta);
  EXPECT_LE((df - difference).norm(), tolerance(1e-10) * difference.norm());
}

TEST_P(ForceTerms, TangentByEveryParameter) {
  for (int i = 0; i < theta.size(); ++i) {
    const VectorX direction = VectorX::Unit(theta.size(), i);
    const Points df = tangent(none(), none(), direction);
    const bool is_active = depends_on(i);
    ASSERT_EQ(df.norm() > 0.0, is_active) << "theta[" << i << "]";
    const double step = 0.1 * std::max(std::abs(theta[i]), 0.05);
    if (!is_active) {
      EXPECT_EQ((force(lag, z, theta + step * direction) - force(lag, z, theta)).norm(), 0.0) << "theta[" << i << "]";
      continue;
    }
    const auto along = [&](double s) -> VectorX { return flat(force(lag, z, theta + s * direction)); };
    EXPECT_LT(best_relative_error(along, flat(df), step), tolerance(difference_error)) << "theta[" << i << "]";
  }
}

TEST_P(ForceTerms, AdjointIsTheTransposeOfTheTangent) {
  term->set_parameters(theta);
  linearise(lag);
  const Points w = any(-0.8, 2.9);
  Points lag_bar = none(), z_bar = none();
  VectorX theta_bar = VectorX::Zero(theta.size());
  term->add_force_adjoint(z, w, lag_bar, z_bar, theta_bar);
  const VectorX zero = VectorX::Zero(theta.size());
  const auto expect_same = [&](double by_adjoint, const Points& df, const char* what) {
    EXPECT_LE(std::abs(by_adjoint - w.cwiseProduct(df).sum()), tolerance(1e-12) * w.norm() * df.norm()) << what;
  };
  expect_same(lag_bar.cwiseProduct(d_lag).sum(), tangent(d_lag, none(), zero), "lag");
  expect_same(z_bar.cwiseProduct(d_z).sum(), tangent(none(), d_z, zero), "z");
  for (int i = 0; i < theta.size(); ++i)
    expect_same(theta_bar[i], tangent(none(), none(), VectorX::Unit(theta.size(), i)), "theta");
  // It adds: a second call doubles.
  term->add_force_adjoint(z, w, lag_bar, z_bar, theta_bar);
  expect_same(0.5 * z_bar.cwiseProduct(d_z).sum(), tangent(none(), d_z, zero), "z, twice");
}

/// The lag point's share, as a matrix.
TEST_P(ForceTerms, LagMatrixIsMinusTheDerivativeByLagPoint) {
  term->set_parameters(theta);
  const auto product = [&](const Points& at_lag, const Points& at_z) {
    linearise(at_lag);
    BlockMatrix K(pattern);
    term->add_lag_matrix(at_z, 3.0, K);
    VectorX y;
    K.multiply(flat(d_lag), y);
    return y;
  };
  const bool is_elastic = GetParam().has_lag_matrix;
  const Points& at_lag = is_elastic ? lag : z;
  const VectorX y = product(at_lag, z);
  linearise(at_lag);
  Points df = none();
  term->add_force_tangent(z, d_lag, none(), VectorX::Zero(theta.size()), df);
  EXPECT_EQ(df.norm() > 0.0, is_elastic);
  EXPECT_LE((y + 3.0 * flat(df)).norm(), tolerance(1e-11) * df.norm());
}

TEST_P(ForceTerms, TangentByTheStepsStart) {
  term->set_parameters(theta);
  linearise(lag);
  ASSERT_EQ(term->sees_start(), GetParam().sees_start);
  if (!GetParam().sees_start) return;
  Points df = none();
  term->add_start_tangent(z, d_start, d_start_velocity, df);
  ASSERT_GT(df.norm(), 0.0);
  const Points start_here = start, velocity_here = start_velocity;
  const auto along = [&](double s) -> VectorX {
    start = start_here + s * d_start, start_velocity = velocity_here + s * d_start_velocity;
    return flat(force(lag, z, theta));
  };
  EXPECT_LT(best_relative_error(along, flat(df), 0.1), tolerance(difference_error));
  EXPECT_GT(best_relative_error(along, 1.001 * flat(df), 0.1), 1e-4) << "a wrong derivative would pass";
  start = start_here, start_velocity = velocity_here;
  linearise(lag);
  const Points w = any(-0.8, 2.9);
  Points start_bar = none(), velocity_bar = none();
  term->add_start_adjoint(z, w, start_bar, velocity_bar);
  const double by_adjoint = start_bar.cwiseProduct(d_start).sum() + velocity_bar.cwiseProduct(d_start_velocity).sum();
  EXPECT_LE(std::abs(by_adjoint - w.cwiseProduct(df).sum()), tolerance(1e-12) * w.norm() * df.norm());
}

TEST_P(ForceTerms, ForceIsMinusTheGradientOfThePotential) {
  term->set_parameters(theta);
  const Points f = static_force(lag);
  ASSERT_EQ(term->potential(lag).has_value(), GetParam().has_potential);
  if (!GetParam().has_potential) return;
  const auto along = [&](double s) -> VectorX {
    const Points x = lag + s * d_lag;
    term->linearise(x);
    return VectorX::Constant(1, *term->potential(x));
  };
  const VectorX slope = VectorX::Constant(1, -f.cwiseProduct(d_lag).sum());
  ASSERT_NE(slope[0], 0.0);
  EXPECT_LT(best_relative_error(along, slope, 0.1), tolerance(difference_error));
  EXPECT_GT(best_relative_error(along, 1.001 * slope, 0.1), 1e-4) << "a wrong force would pass";
}

/// The exact stiffness of f(x | x), which is symmetric where there is a potential.
TEST_P(ForceTerms, TangentStiffnessIsMinusTheDerivativeAtRest) {
  term->set_parameters(theta);
  (void)static_force(lag);
  BlockMatrix K(pattern);
  K.set_zero();
  term->add_tangent_stiffness(lag, 3.0, K);
  VectorX y;
  K.multiply(flat(d_lag), y);
  ASSERT_EQ(y.norm() > 0.0, GetParam().depends_on_position && !GetParam().rests);
  if (GetParam().has_potential) {
    const MatrixX whole = dense(K);
    EXPECT_LE((whole - whole.transpose()).norm(), tolerance(1e-12) * whole.norm());
  }
  if (!GetParam().depends_on_position || GetParam().rests) return;
  const auto along = [&](double s) -> VectorX { return -3.0 * flat(static_force(lag + s * d_lag)); };
  EXPECT_LT(best_relative_error(along, y, 0.1), tolerance(difference_error));
  EXPECT_GT(best_relative_error(along, 1.001 * y, 0.1), 1e-4) << "a wrong stiffness would pass";
}

/// The force with the nodes stress-free elsewhere, the lag point, z and theta the same; then both products.
TEST_P(ForceTerms, DerivativesByTheReference) {
  Points reference_bar = none(), by_reference = none();
  const Points& X = body->reference_positions();
  const Points d_X = deformed(X, 0.5, 0.4), w = any(-0.8, 2.9);
  auto* elasticity = dynamic_cast<Elasticity*>(term.get());
  if (elasticity && GetParam().depends_on_reference) elasticity->set_reference(body);
  term->set_parameters(theta);
  linearise(lag);
  term->linearise_reference(z);
  term->add_reference_tangent(d_X, by_reference);
  term->add_reference_adjoint(w, reference_bar);
  ASSERT_EQ(by_reference.norm() > 0.0, GetParam().depends_on_reference);
  EXPECT_LE(std::abs(reference_bar.cwiseProduct(d_X).sum() - w.cwiseProduct(by_reference).sum()),
            tolerance(1e-12) * w.norm() * by_reference.norm());
  if (!GetParam().depends_on_reference) return;
  const auto along = [&](double s) -> VectorX {
    elasticity->set_reference(std::make_shared<Body>(with_reference(*body, X + s * d_X)));
    return flat(force(lag, z, theta));
  };
  EXPECT_LT(best_relative_error(along, flat(by_reference), 0.1), tolerance(difference_error));
  EXPECT_GT(best_relative_error(along, 1.001 * flat(by_reference), 0.1), 1e-4) << "a wrong derivative would pass";
}

}  // namespace pliant::test
