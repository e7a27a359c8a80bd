#pragma once

#include <cstddef>
#include <vector>

#include "batch_motion/mesh_view.hpp"

namespace pliant::batch_motion {

/// What members share, as a `MeshView` has it. Everything is in the order in which the solver sweeps over the nodes:
/// the body's own, or by colours of nodes that do not meet, within which rows do not depend on each other.
struct MeshData {
  int nodes_per_element = 8, nodes = 0, elements = 0, samples = 0, lower_blocks = 0, classes = 0;
  std::vector<int> order;         ///< of each node of the body, where it stands here
  std::vector<int> colour_start;  ///< nodes of a colour stand beside each other; one colour a node where not coloured

  std::vector<int> connectivity, element_class;
  std::vector<double> gradient, volume, relative_modulus;
  std::vector<double> rest, nodal_volume;
  std::vector<int> held, corner_start, corner;
  std::vector<int> row_start, row, column, upper_start, upper_block, upper_column;
  std::vector<double> mass;
  std::vector<int> part_start, part_element, part_corners;
  std::vector<int> sample_node, touch_start, touch_sample, pair_start, pair_sample;
  std::vector<double> sample_weight, sample_area, touch_weight, pair_weight;

  static constexpr int chunk_rows = 16;
  /// @param place  takes a vector and returns where kernels find it
  template <class Place>
  [[nodiscard]] MeshView view(Place&& place) const {
    MeshView v;
    v.nodes = nodes, v.elements = elements, v.samples = samples, v.lower_blocks = lower_blocks;
    v.chunk_rows = chunk_rows, v.chunks = (nodes + chunk_rows - 1) / chunk_rows;
    v.connectivity = place(connectivity), v.element_class = place(element_class);
    v.gradient = place(gradient), v.volume = place(volume), v.relative_modulus = place(relative_modulus);
    v.rest = place(rest), v.nodal_volume = place(nodal_volume), v.held = place(held);
    v.corner_start = place(corner_start), v.corner = place(corner);
    v.row_start = place(row_start), v.row = place(row), v.column = place(column);
    v.upper_start = place(upper_start), v.upper_block = place(upper_block), v.upper_column = place(upper_column);
    v.mass = place(mass);
    v.part_start = place(part_start), v.part_element = place(part_element), v.part_corners = place(part_corners);
    v.sample_node = place(sample_node), v.sample_weight = place(sample_weight), v.sample_area = place(sample_area);
    v.touch_start = place(touch_start), v.touch_sample = place(touch_sample), v.touch_weight = place(touch_weight);
    v.pair_start = place(pair_start), v.pair_sample = place(pair_sample), v.pair_weight = place(pair_weight);
    return v;
  }
};

}  // namespace pliant::batch_motion
