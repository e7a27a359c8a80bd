#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

namespace pliant {

/// The numbers 0 .. size - 1 in sets that are joined: union-find. One number of each set, its root, stands for it.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size), count_(int(size)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  int root(int i) {
    const auto parent = [&](int of) -> int& { return parent_[std::size_t(of)]; };
    while (parent(i) != i) i = parent(i) = parent(parent(i));
    return i;
  }

  /// Makes one set of those of `a` and `b`, with the root of `a`.
  void join(int a, int b) {
    a = root(a), b = root(b);
    if (a != b) parent_[std::size_t(b)] = a, --count_;
  }

  int count() const { return count_; }

 private:
  std::vector<int> parent_;
  int count_;
};

}  // namespace pliant
