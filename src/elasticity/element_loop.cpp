#include "elasticity/element_loop.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>

namespace pliant {

namespace {

constexpr std::size_t elements_of_a_part = 2048;
constexpr std::size_t most_of_a_small_body = 4 * elements_of_a_part;

/// Every third bit of the result is one of x's lowest 21.
std::uint64_t spread_bits(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/// Elements along Morton's curve through their middles.
std::vector<int> along_a_curve(const Points& nodes, std::span<const int> connectivity, int stride) {
  const std::size_t count = connectivity.size() / std::size_t(stride);
  const Eigen::RowVector3d low = nodes.colwise().minCoeff();
  const double scale = 1048575.0 / (nodes.colwise().maxCoeff() - low).maxCoeff();
  std::vector<std::uint64_t> key(count);
  for (std::size_t e = 0; e < count; ++e) {
    Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
    for (int a = 0; a < stride; ++a)
      middle += nodes.row(connectivity[e * std::size_t(stride) + std::size_t(a)]) / stride;
    const Eigen::RowVector3d at = scale * (middle - low);
    key[e] = spread_bits(std::uint64_t(at.x())) | spread_bits(std::uint64_t(at.y())) << 1 |
             spread_bits(std::uint64_t(at.z())) << 2;
  }
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](int e) { return std::pair(key[std::size_t(e)], e); });
  return order;
}

}  // namespace

ElementLoop::ElementLoop(const Points& nodes, std::span<const int> connectivity, int stride)
    : count_(int(connectivity.size()) / stride) {
  if (std::size_t(count_) <= most_of_a_small_body) return;
  std::vector<int> curve = along_a_curve(nodes, connectivity, stride);
  const std::size_t parts = (curve.size() + elements_of_a_part - 1) / elements_of_a_part;
  const auto begin = [&](std::size_t part) { return part * elements_of_a_part; };
  const auto end = [&](std::size_t part) { return std::min(curve.size(), begin(part + 1)); };
  std::vector<std::uint64_t> colours_at(std::size_t(nodes.rows()), 0);  // of the parts that have each node
  std::vector<std::vector<std::size_t>> parts_of;
  for (std::size_t part = 0; part < parts; ++part) {
    std::sort(curve.begin() + std::ptrdiff_t(begin(part)), curve.begin() + std::ptrdiff_t(end(part)));
    const auto each_node = [&](const auto& body) {
      for (std::size_t k = begin(part); k < end(part); ++k)
        for (int a = 0; a < stride; ++a)
          body(colours_at[std::size_t(connectivity[std::size_t(curve[k]) * std::size_t(stride) + std::size_t(a)])]);
    };
    std::uint64_t taken = 0;
    each_node([&](std::uint64_t colours) { taken |= colours; });
    const auto colour = std::size_t(std::countr_one(taken));
    if (colour == 64) return;  // no mesh has so many neighbours in space; it would be walked through by one thread
    each_node([&](std::uint64_t& colours) { colours |= std::uint64_t(1) << colour; });
    if (parts_of.size() <= colour) parts_of.resize(colour + 1);
    parts_of[colour].push_back(part);
  }
  order_.reserve(curve.size());
  colour_start_.push_back(0);
  for (const auto& all : parts_of) {
    for (const std::size_t part : all) {
      part_start_.push_back(int(order_.size()));
      order_.insert(order_.end(), curve.begin() + std::ptrdiff_t(begin(part)),
                    curve.begin() + std::ptrdiff_t(end(part)));
    }
    colour_start_.push_back(part_start_.size());
  }
  part_start_.push_back(int(order_.size()));
}

}  // namespace pliant
