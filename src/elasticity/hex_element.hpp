#pragma once

#include "base/types.hpp"
#include "elasticity/lame.hpp"
#include "mesh/hex_grid.hpp"

namespace pliant {

using Matrix24 = Eigen::Matrix<double, 24, 24>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;

enum class HexFormulation {
  IncompatibleModes,  ///< trilinear with nine internal bending modes, condensed (Taylor et al. 1976): neither shear nor
                      ///< volumetric locking on coarse grids
  Trilinear,          ///< as in Weiss 2020, eq. 28
};

/// Linear elastic stiffness of one cell's inside part [N/m] for E = 1 Pa, and its derivative with respect to Poisson's
/// ratio. Unknowns node by node (x0 y0 z0 x1 ...).
struct HexStiffness {
  Matrix24 value;
  Matrix24 d_poissons_ratio;
};
HexStiffness hex_stiffness(const CellQuadrature& inside, double cell_size, double poissons_ratio,
                           HexFormulation formulation = HexFormulation::IncompatibleModes);

/// Consistent mass of the inside part for unit density [m^3], 8 x 8 (the same for x, y and z).
Matrix8 hex_mass(const CellQuadrature& inside, double cell_size);

/// Mean over the inside part of the shape functions' gradients [1/m], 8 x 3: F = sum_a x_a g_a^T (Weiss 2020, eq. 30,
/// with the mean taken over the inside part of a cut cell).
Eigen::Matrix<double, 8, 3> hex_mean_gradients(const CellQuadrature& inside, double cell_size);

}  // namespace pliant
