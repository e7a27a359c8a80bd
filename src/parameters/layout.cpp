#include "parameters/layout.hpp"

#include <algorithm>
#include <stdexcept>

namespace pliant {

bool changes_any(std::span<const ParameterHandle> blocks, const Eigen::Ref<const VectorX>& d_theta) {
  return std::ranges::any_of(
      blocks, [&](const ParameterHandle& block) { return !d_theta.segment(block.first, block.size).isZero(0.0); });
}

int ParameterLayout::find_index(std::string_view name) const {
  for (std::size_t i = 0; i < blocks_.size(); ++i)
    if (blocks_[i].name == name) return int(i);
  return -1;
}

ParameterHandle ParameterLayout::add(ParameterBlock block) {
  if (block.size < 1) throw std::invalid_argument("the parameter block " + block.name + " is empty");
  if (contains(block.name)) throw std::invalid_argument("there are two parameter blocks " + block.name);
  handles_.push_back({size_, block.size});
  size_ += block.size;
  blocks_.push_back(std::move(block));
  return handles_.back();
}

ParameterHandle ParameterLayout::at(std::string_view name) const {
  const int i = find_index(name);
  if (i < 0) throw std::invalid_argument("there is no parameter block " + std::string(name));
  return handles_[std::size_t(i)];
}

const ParameterBlock& ParameterLayout::block_of(const ParameterHandle& handle) const {
  for (std::size_t i = 0; i < blocks_.size(); ++i)
    if (handle.first >= handles_[i].first && handle.first < handles_[i].first + handles_[i].size) return blocks_[i];
  throw std::invalid_argument("the handle is not of this layout");
}

VectorX carry(const ParameterLayout& from, const VectorX& theta, const ParameterLayout& to, VectorX onto,
              const BlockNames& name_in_from) {
  if (theta.size() != from.size() || onto.size() != to.size())
    throw std::invalid_argument("a parameter vector is not as long as its layout");
  for (std::size_t i = 0; i < to.blocks().size(); ++i) {
    const std::string& name = to.blocks()[i].name;
    const std::string there = name_in_from ? name_in_from(name) : name;
    if (!from.contains(there)) continue;
    const ParameterHandle read = from.at(there), written = to.handle(i);
    if (read.size != written.size) throw std::invalid_argument("parameter blocks " + name + " differ in size");
    onto.segment(written.first, written.size) = theta.segment(read.first, read.size);
  }
  return onto;
}

}  // namespace pliant
