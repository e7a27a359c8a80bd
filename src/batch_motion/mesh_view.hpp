#pragma once

namespace pliant::batch_motion {

/// What members share, as arrays that kernels read: nothing here has a number of each member. Nodes are in the order in
/// which the solver sweeps. Entry (i, j) of a block is [3 i + j].
struct MeshView {
  int nodes = 0, elements = 0, samples = 0;
  int lower_blocks = 0;            ///< blocks below the diagonal; those of the diagonal follow them
  int chunks = 0, chunk_rows = 0;  ///< of rows, for sums: fixed, so that sums do not depend on who takes them

  // Elements, N nodes each.
  const int* connectivity = nullptr;
  const int* element_class = nullptr;        ///< whose stiffness it has
  const double* gradient = nullptr;          ///< of mean strain, N x 3 [1/m]
  const double* volume = nullptr;            ///< [m^3]
  const double* relative_modulus = nullptr;  ///< [-]

  // Nodes.
  const double* rest = nullptr;          ///< [m], 3 each
  const double* nodal_volume = nullptr;  ///< [m^3]
  const int* held = nullptr;             ///< 0 or 1
  const int* corner_start = nullptr;     ///< of each node: the corners e N + a of elements that it is
  const int* corner = nullptr;

  // Blocks below the diagonal, row by row, and those right of it by the row that they are in as transposed ones.
  const int *row_start = nullptr, *row = nullptr, *column = nullptr;
  const int *upper_start = nullptr, *upper_block = nullptr, *upper_column = nullptr;
  const double* mass = nullptr;  ///< of each block, for unit density [m^3]
  const int *part_start = nullptr, *part_element = nullptr, *part_corners = nullptr;  ///< corners: N a + b

  // Samples of the surface, N nodes each.
  const int* sample_node = nullptr;
  const double *sample_weight = nullptr, *sample_area = nullptr;
  const int *touch_start = nullptr, *touch_sample = nullptr;  ///< of each node
  const double* touch_weight = nullptr;
  const int *pair_start = nullptr, *pair_sample = nullptr;  ///< of each block
  const double* pair_weight = nullptr;
};

/// Numbers of each member that a step depends on, rows of one array.
enum MemberNumber : int {
  YoungsModulus,
  MassDamping,
  StiffnessDamping,
  Density,
  Gravity,                       // 3
  PlanePoint = Gravity + 3,      // 3
  PlaneNormal = PlanePoint + 3,  // 3
  Friction = PlaneNormal + 3,
  ContactStiffness,
  Lambda,  // Lame's constants for a unit modulus, and their derivatives by Poisson's ratio
  Mu,
  LambdaChange,
  MuChange,
  member_number_count
};

/// Derivatives, likewise.
enum GradientNumber : int {
  ByLogModulus,
  ByPoissonsRatio,
  ByStiffnessDamping,
  ByMassDamping,
  ByDensity,
  ByGravity,                         // 3
  ByPlanePoint = ByGravity + 3,      // 3
  ByPlaneNormal = ByPlanePoint + 3,  // 3
  ByFriction = ByPlaneNormal + 3,
  ByLogContactStiffness,
  gradient_number_count
};

/// What all members' steps have in common.
struct StepNumbers {
  double dt = 0.0, theta = 0.5;  ///< [s], Newmark's weight of the end
  double contact_weight = 0.6;
  double rotation_lag = 0.0, contact_lag = 0.0;  ///< how far ahead of the start points are predicted [s]
  double smoothing = 0.0, reach = 0.0;           ///< of the penalty [m]
  bool is_quadratic = false;                     ///< its onset
  double friction_way = 0.0;                     ///< below which friction fades [m]; 0: none
};

}  // namespace pliant::batch_motion
