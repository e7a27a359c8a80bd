#include "batch_motion/batch_mesh.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

#include "motion/contact_samples.hpp"

namespace pliant::batch_motion {

namespace {

/// Lists of one item each, gathered in the order of the items.
struct Lists {
  explicit Lists(std::size_t count) : of(count) {}
  std::vector<std::vector<std::pair<int, double>>> of;

  void flatten(std::vector<int>& start, std::vector<int>& item, std::vector<double>* weight = nullptr) const {
    start.assign(1, 0);
    for (const auto& list : of) {
      for (const auto& [index, value] : list) {
        item.push_back(index);
        if (weight) weight->push_back(value);
      }
      start.push_back(int(item.size()));
    }
  }
};

/// The first colour that no neighbour has, node by node.
std::vector<int> greedy_colours(const BlockPattern& pattern) {
  std::vector<int> colour(std::size_t(pattern.rows), -1);
  for (int row = 0; row < pattern.rows; ++row) {
    std::vector<bool> is_taken;
    for (int k = pattern.row_start[std::size_t(row)]; k < pattern.row_start[std::size_t(row) + 1]; ++k) {
      const int other = colour[std::size_t(pattern.column[std::size_t(k)])];
      if (other < 0) continue;
      if (other >= int(is_taken.size())) is_taken.resize(std::size_t(other) + 1, false);
      is_taken[std::size_t(other)] = true;
    }
    colour[std::size_t(row)] = int(std::ranges::find(is_taken, false) - is_taken.begin());
  }
  return colour;
}

void set_order(const BlockPattern& pattern, SweepOrder order, MeshData& mesh) {
  std::vector<int> by_place(std::size_t(pattern.rows));
  std::iota(by_place.begin(), by_place.end(), 0);
  if (order == SweepOrder::Colours) {
    const std::vector<int> colour = greedy_colours(pattern);
    std::ranges::stable_sort(by_place, {}, [&](int node) { return colour[std::size_t(node)]; });
    for (int place = 0; place < pattern.rows; ++place)
      if (place == 0 ||
          colour[std::size_t(by_place[std::size_t(place)])] != colour[std::size_t(by_place[std::size_t(place) - 1])])
        mesh.colour_start.push_back(place);
    mesh.colour_start.push_back(pattern.rows);
  }
  mesh.order.resize(by_place.size());
  for (std::size_t place = 0; place < by_place.size(); ++place) mesh.order[std::size_t(by_place[place])] = int(place);
}

/// Where the block (row, column), row > column, is.
int find_block(const MeshData& mesh, int row, int column) {
  const auto first = mesh.column.begin() + mesh.row_start[std::size_t(row)],
             last = mesh.column.begin() + mesh.row_start[std::size_t(row) + 1];
  return int(std::lower_bound(first, last, column) - mesh.column.begin());
}

void set_blocks(const Body& body, MeshData& mesh) {
  const BlockPattern& pattern = *body.pattern;
  Lists lower(std::size_t(mesh.nodes)), upper(std::size_t(mesh.nodes));
  std::vector<double> diagonal(std::size_t(mesh.nodes));
  for (int row = 0; row < pattern.rows; ++row)
    for (int k = pattern.row_start[std::size_t(row)]; k < pattern.row_start[std::size_t(row) + 1]; ++k) {
      const int i = mesh.order[std::size_t(row)], j = mesh.order[std::size_t(pattern.column[std::size_t(k)])];
      if (i == j) diagonal[std::size_t(i)] = body.mass[std::size_t(k)];
      if (i > j) lower.of[std::size_t(i)].emplace_back(j, body.mass[std::size_t(k)]);
    }
  for (auto& list : lower.of) std::ranges::sort(list);
  lower.flatten(mesh.row_start, mesh.column, &mesh.mass);
  mesh.mass.insert(mesh.mass.end(), diagonal.begin(), diagonal.end());
  mesh.lower_blocks = int(mesh.column.size());
  for (int i = 0; i < mesh.nodes; ++i)
    for (int k = mesh.row_start[std::size_t(i)]; k < mesh.row_start[std::size_t(i) + 1]; ++k) {
      mesh.row.push_back(i);
      upper.of[std::size_t(mesh.column[std::size_t(k)])].emplace_back(k, 0.0);
    }
  upper.flatten(mesh.upper_start, mesh.upper_block);
  for (const int block : mesh.upper_block) mesh.upper_column.push_back(mesh.row[std::size_t(block)]);
}

void set_elements(const Body& body, MeshData& mesh) {
  const int corners = body.nodes_per_element();
  Lists of_node(std::size_t(mesh.nodes)), of_block(std::size_t(mesh.lower_blocks + mesh.nodes));
  for (const int node : body.connectivity) mesh.connectivity.push_back(mesh.order[std::size_t(node)]);
  for (int e = 0; e < mesh.elements; ++e) {
    const int* nodes = mesh.connectivity.data() + std::size_t(e) * std::size_t(corners);
    for (int a = 0; a < corners; ++a) {
      of_node.of[std::size_t(nodes[a])].emplace_back(e * corners + a, 0.0);
      for (int b = 0; b < corners; ++b) {
        if (nodes[a] < nodes[b]) continue;
        const int block = a == b ? mesh.lower_blocks + nodes[a] : find_block(mesh, nodes[a], nodes[b]);
        of_block.of[std::size_t(block)].emplace_back(e, double(corners * a + b));
      }
    }
  }
  of_node.flatten(mesh.corner_start, mesh.corner);
  std::vector<double> codes;
  of_block.flatten(mesh.part_start, mesh.part_element, &codes);
  for (const double code : codes) mesh.part_corners.push_back(int(code));
  for (int i = 0; i < 4; ++i) {  // `AssembleBlock` looks so far ahead
    mesh.part_element.push_back(mesh.part_element.back());
    mesh.part_corners.push_back(mesh.part_corners.back());
  }
  mesh.gradient.assign(body.mean_gradient.data(), body.mean_gradient.data() + body.mean_gradient.size());
  mesh.volume = body.element_volume;
  mesh.element_class = body.element_class;
}

void set_nodes(const Body& body, const std::vector<int>& held, MeshData& mesh) {
  const Points ones = Points::Ones(mesh.nodes, 3);
  Points sum = Points::Zero(mesh.nodes, 3);
  body.add_mass_product(1.0, ones, sum);
  mesh.rest.resize(3 * std::size_t(mesh.nodes));
  mesh.nodal_volume.resize(std::size_t(mesh.nodes));
  mesh.held.assign(std::size_t(mesh.nodes), 0);
  for (int node = 0; node < mesh.nodes; ++node) {
    const auto place = std::size_t(mesh.order[std::size_t(node)]);
    for (std::size_t d = 0; d < 3; ++d) mesh.rest[3 * place + d] = body.nodes(node, Eigen::Index(d));
    mesh.nodal_volume[place] = sum(node, 0);
  }
  for (const int node : held) {
    if (node < 0 || node >= mesh.nodes)
      throw std::invalid_argument("node " + std::to_string(node) + " is held, and the body has nodes 0 to " +
                                  std::to_string(mesh.nodes - 1));
    mesh.held[std::size_t(mesh.order[std::size_t(node)])] = 1;
  }
}

void set_samples(const Body& body, MeshData& mesh, bool with_samples) {
  const ContactSamples samples = with_samples ? surface_samples(body) : ContactSamples();
  const Embedding points(body, samples.rest);
  mesh.samples = points.point_count();
  mesh.sample_area = samples.area;
  Lists of_node(std::size_t(mesh.nodes)), of_block(std::size_t(mesh.lower_blocks + mesh.nodes));
  for (int s = 0; s < mesh.samples; ++s) {
    const auto nodes = points.nodes(s);
    const auto weights = points.weights(s);
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      const int i = mesh.order[std::size_t(nodes[a])];
      mesh.sample_node.push_back(i);
      mesh.sample_weight.push_back(weights[a]);
      of_node.of[std::size_t(i)].emplace_back(s, weights[a]);
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        const int j = mesh.order[std::size_t(nodes[b])];
        if (i < j) continue;
        const int block = i == j ? mesh.lower_blocks + i : find_block(mesh, i, j);
        of_block.of[std::size_t(block)].emplace_back(s, weights[a] * weights[b]);
      }
    }
  }
  of_node.flatten(mesh.touch_start, mesh.touch_sample, &mesh.touch_weight);
  of_block.flatten(mesh.pair_start, mesh.pair_sample, &mesh.pair_weight);
}

}  // namespace

MeshData make_mesh_data(const Body& body, std::vector<double> relative_moduli, const std::vector<int>& held,
                        bool with_samples, SweepOrder order) {
  if (body.kind == ElementKind::QuadraticTetrahedron)
    throw std::invalid_argument("a batch moves hexahedra and linear tetrahedra, not quadratic ones");
  if (int(relative_moduli.size()) != body.element_count())
    throw std::invalid_argument(
        "a batch needs one relative modulus an element: " + std::to_string(relative_moduli.size()) + " for " +
        std::to_string(body.element_count()) + " elements");
  for (const double r : relative_moduli)
    if (!(r > 0.0 && r < 1e300)) throw std::invalid_argument("relative moduli are positive and finite");
  MeshData mesh;
  mesh.nodes_per_element = body.nodes_per_element();
  mesh.nodes = body.node_count();
  mesh.elements = body.element_count();
  mesh.classes = int(body.class_representative.size());
  mesh.relative_modulus = std::move(relative_moduli);
  set_order(*body.pattern, order, mesh);
  set_blocks(body, mesh);
  set_elements(body, mesh);
  set_nodes(body, held, mesh);
  set_samples(body, mesh, with_samples);
  return mesh;
}

ClassStiffness class_stiffness(const Body& body, double poissons_ratio) {
  ClassStiffness all;
  if (body.kind != ElementKind::Hexahedron) return all;
  const auto append = [](const Eigen::Matrix<double, 24, 24>& K, std::vector<double>& out) {
    for (int a = 0; a < 8; ++a)
      for (int b = a; b < 8; ++b)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) out.push_back(K(3 * a + i, 3 * b + j));
  };
  for (const int element : body.class_representative) {
    const UnitStiffness<8> unit = unit_stiffness<8>(body, element, poissons_ratio);
    append(unit.value, all.value);
    append(unit.d_poissons_ratio, all.change);
  }
  return all;
}

}  // namespace pliant::batch_motion
