#pragma once

#include "geometry/primitives.hpp"
#include "model/model.hpp"
#include "support/bodies.hpp"

namespace pliant::test {

inline constexpr double block_edge = 0.05;  // [m]

/// A block of four cells, free or held at its low end, above a rough floor.
inline Model block(bool held) {
  Model model;
  model.name = "block";
  model.scene.object.surface = make_box(Vector3(0.2, block_edge, block_edge), 0.025);
  model.scene.object.density = 500.0, model.scene.object.mass = 0.25;
  model.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
  model.scene.timing = evenly_timed(50.0, 3);
  if (held) model.scene.fixed = {{RegionHalfSpace{{-0.07, 0, 0}, {-1, 0, 0}}, std::nullopt}};
  model.scene.planes = {{{0, -0.1, 0}, Vector3::UnitY(), true, 0.5}};
  model.youngs_modulus = 2e5, model.poissons_ratio = 0.3, model.stiffness_damping = 2e-3, model.mass_damping = 0.5;
  model.cell_size = block_edge, model.substeps = 8, model.newmark_theta = 0.51;
  return model;
}

/// The same block of tetrahedra, held at its low end and pressed: an Ogden law, no frames, no gravity.
/// @param cells  along the block and across it: six tetrahedra each
inline Model pressed_block(const Eigen::Vector3i& cells = {8, 2, 2}) {
  Model model = block(true);
  const auto body = tet_body({0.2, block_edge, block_edge}, cells, false, 0.0);
  model.volume.nodes = body->nodes;
  model.volume.kind = VtuCell::Tetrahedron;
  model.volume.connectivity = body->connectivity;
  model.law = ModelLaw{"ogden", {"element", "mu_1", "alpha_1", "nu_1"}, {}};
  for (int e = 0; e < body->element_count(); ++e) {
    model.law->rows.push_back({double(e), 4000.0, 6.0, 0.3});
    model.volume.youngs_modulus.push_back(2e5);
    model.volume.youngs_modulus_std.push_back(2e4);
    model.volume.poissons_ratio.push_back(0.3);
    model.volume.fill.push_back(1.0);
  }
  model.scene.timing = {};
  model.scene.world.gravity.reset();
  model.scene.planes.clear();
  return model;
}

}  // namespace pliant::test
