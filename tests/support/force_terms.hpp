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
  bool depends_on_reference = false;  ///< an `Elasticity` with derivatives by where the nodes are free of load
  std::optional<LawForm> law = {};    ///< whose blocks the parameter vector has too
};

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
    theta.segment<3>(layout.pulls[0]) = Vector3(0.1, -0.2, 0.05);
    theta.segment<3>(layout.pulls[1]) = Vector3(0.02, 0.15, -0.1);
    lag = deformed(body->reference_positions(), 0.3);
    z = deformed(body->reference_positions(), 0.28, 1.93);
    d_lag = deformed(body->reference_positions(), 0.6, -0.7);
    d_z = deformed(body->reference_positions(), 0.9, 0.6);
  }

  SceneBlocks add_blocks() {
    SceneBlocks blocks;
    const MotionCounts counts{.moduli = body->modulus.controls, .planes = 2, .pulls = pulls};
    static_cast<MotionBlocks&>(blocks) = add_motion_blocks(all, counts);
    if (GetParam().law) blocks.law = LawLayout::of_motion(all, blocks, *GetParam().law);
    return blocks;
  }

  Points force(const Points& at_lag, const Points& at_z, const VectorX& at_theta) {
    term->set_parameters(at_theta);
    term->linearise(at_lag);
    Points f = Points::Zero(at_z.rows(), 3);
    term->add_force(at_z, f);
    return f;
  }
  Points tangent(const Points& change_lag, const Points& change_z, const VectorX& change_theta) {
    term->set_parameters(theta);
    term->linearise(lag);
    Points df = Points::Zero(z.rows(), 3);
    term->add_force_tangent(z, change_lag, change_z, change_theta, df);
    return df;
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
  Points lag, z, d_lag, d_z;
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
  BlockMatrix K(body->pattern);
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
  term->linearise(lag);
  const Points w = deformed(body->reference_positions(), -0.8, 2.9);
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
    term->linearise(at_lag);
    BlockMatrix K(body->pattern);
    term->add_lag_matrix(at_z, 3.0, K);
    VectorX y;
    K.multiply(flat(d_lag), y);
    return y;
  };
  // Contact gives its share where it is needed, with the lag point at z itself: there is none.
  const bool is_elastic = GetParam().has_lag_matrix;
  const Points& at_lag = is_elastic ? lag : z;
  const VectorX y = product(at_lag, z);
  term->linearise(at_lag);
  Points df = none();
  term->add_force_tangent(z, d_lag, none(), VectorX::Zero(theta.size()), df);
  EXPECT_EQ(df.norm() > 0.0, is_elastic);
  EXPECT_LE((y + 3.0 * flat(df)).norm(), tolerance(1e-11) * df.norm());
}

/// The force with the nodes free of load elsewhere, the lag point, z and theta the same; then both products.
TEST_P(ForceTerms, DerivativesByTheReference) {
  Points reference_bar = none(), by_reference = none();
  const Points& X = body->reference_positions();
  const Points d_X = deformed(X, 0.5, 0.4), w = deformed(X, -0.8, 2.9);
  auto* elasticity = dynamic_cast<Elasticity*>(term.get());
  if (elasticity && GetParam().depends_on_reference) elasticity->set_reference(body);
  term->set_parameters(theta);
  term->linearise(lag);
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
