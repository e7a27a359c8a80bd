#pragma once

#include <span>
#include <vector>

#include "base/parallel.hpp"
#include "base/types.hpp"

namespace pliant {

/// Loops over a body's elements in which each adds to what belongs to its nodes, on several threads: elements near each
/// other make a part, and parts that share no node have one colour; colours come one after the other. The order in
/// which anything is added follows from the mesh alone, and so does every rounded sum. Small bodies are one part, which
/// the calling thread walks through in the elements' order.
class ElementLoop {
 public:
  ElementLoop() = default;
  /// @param nodes         n x 3, rest positions [m]
  /// @param connectivity  so many nodes an element
  ElementLoop(const Points& nodes, std::span<const int> connectivity, int nodes_per_element);

  /// Calls body(e) for every element.
  template <class Body>
  void each(const Body& body) const {
    if (order_.empty()) {
      for (int e = 0; e < count_; ++e) body(e);
      return;
    }
    for (std::size_t colour = 0; colour + 1 < colour_start_.size(); ++colour) {
      const std::size_t first = colour_start_[colour], last = colour_start_[colour + 1];
      parallel_parts(last - first, [&](std::size_t i) {
        for (int k = part_start_[first + i]; k < part_start_[first + i + 1]; ++k) body(order_[std::size_t(k)]);
      });
    }
  }
  /// 1 where the body is small.
  int colour_count() const { return order_.empty() ? 1 : int(colour_start_.size()) - 1; }

 private:
  int count_ = 0;
  std::vector<int> order_;                 // elements, part by part; empty: one part, in their own order
  std::vector<int> part_start_;            // in `order_`; parts of one colour follow each other
  std::vector<std::size_t> colour_start_;  // in `part_start_`
};

}  // namespace pliant
