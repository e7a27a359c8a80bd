// Bodies at rest at sizes that take seconds: near incompressibility, and large deflections of a slender strip.
#include "support/hanging.hpp"
#include "support/tolerance.hpp"

namespace pliant::large_equilibrium_test {
namespace {

using namespace test::hanging;
using test::tolerance;

/// The tip's small deflection over that of theory, with Poisson's ratio 0.49.
double nearly_incompressible_deflection(std::shared_ptr<const Body> body) {
  Hanging bar(std::move(body));
  bar.theta[bar.layout.poissons_ratio] = 0.49;
  bar.theta.segment<3>(bar.layout.gravity) *= 1e-3;
  return -bar.tip(bar.positions(bar.theta)).z() / bar.slender_deflection(0.49);
}

/// Four elements through the thickness.
TEST(Equilibrium, NearlyIncompressibleBeamDoesNotLock) {
  EXPECT_NEAR(nearly_incompressible_deflection(quadratic_bar(50, 4)), 1.0, tolerance(0.03));
  EXPECT_NEAR(nearly_incompressible_deflection(hex_bar(4)), 1.0, tolerance(0.03));
}

/// The test above can fail: elements without bending of their own do, on the same meshes.
TEST(Equilibrium, LinearTetrahedraAndTrilinearCellsLock) {
  const double tetrahedra =
      nearly_incompressible_deflection(test::tet_body({length, edge, edge}, {50, 4, 4}, false, 0.0));
  const double cells = nearly_incompressible_deflection(
      test::box_body({length, edge, edge}, edge / 4, {HexFormulation::Trilinear, MassKind::Consistent}));
  RecordProperty("tetrahedra", std::to_string(tetrahedra));
  RecordProperty("cells", std::to_string(cells));
  EXPECT_LT(tetrahedra, 0.7);
  EXPECT_LT(cells, 0.9);
}

/// A clamped strip under a dead load at its end, both large: the elastica with Z = 2 P L^2 / (E I) has its tip at
/// (x, y) / L that elliptic integrals give (Bisshopp and Drucker 1945): for P L^2 / (E I) = 2, y / L = 0.4935, x / L =
/// 0.8394.
TEST(Equilibrium, LargeDeflectionFollowsTheElastica) {
  const double thickness = 0.012;
  for (const bool quadratic : {true, false}) {
    const auto body = quadratic ? test::tet_body({length, 0.036, thickness}, {60, 2, 2}, true, 0.0)
                                : test::box_body({length, 0.036, thickness}, thickness / 2);
    Hanging bar(body);
    bar.theta[bar.layout.poissons_ratio] = 0.0;
    bar.theta[bar.layout.density] = 1e-6;
    const double EI = bar.theta[bar.layout.youngs_moduli[0]] * 0.036 * std::pow(thickness, 3) / 12.0;
    bar.options.weights = {{Vector3(0.5 * length, 0, 0), 2.0 * EI / (length * length) / 9.81}};
    const Points x = bar.positions(bar.theta);

    EXPECT_NEAR(-bar.tip(x).z() / length, 0.4935, tolerance(0.01)) << body->node_count();
    EXPECT_NEAR(1.0 + bar.tip(x).x() / length, 0.8394, tolerance(0.01));
  }
}

}  // namespace
}  // namespace pliant::large_equilibrium_test
