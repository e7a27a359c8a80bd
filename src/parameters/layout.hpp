#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// What a block of parameters describes.
enum class Role {
  Material,  ///< elastic moduli and Poisson's ratios, exponents of laws
  Damping,   ///< Rayleigh damping
  Inertia,   ///< density
  Load,      ///< gravity and applied forces
  Initial,   ///< the state at the start of a motion
  Obstacle,  ///< where planes stand
  Sensor,    ///< systematic errors of sensors
  Shape,     ///< corrections of the scanned shape
};

/// A named run of numbers of a parameter vector.
struct ParameterBlock {
  std::string name;  ///< as in result.json
  std::string unit;
  int size = 1;
  Role role = Role::Material;
  bool operator==(const ParameterBlock&) const = default;
};

/// Where a block's numbers stand in the parameter vectors of one layout. Converts to the index of the first:
/// `theta[handle]` is a scalar's value, `theta.segment<3>(handle)` a vector's.
struct ParameterHandle {
  int first = -1;  ///< negative: no block
  int size = 0;

  bool exists() const { return first >= 0; }
  operator Eigen::Index() const { return first; }
  Vector3 vector(const VectorX& theta) const { return theta.segment<3>(first); }
  bool operator==(const ParameterHandle&) const = default;
};

/// Whether a change of a parameter vector changes a number of any of these blocks; all of them exist.
bool changes_any(std::span<const ParameterHandle> blocks, const Eigen::Ref<const VectorX>& d_theta);

/// The blocks of a parameter vector in their order.
class ParameterLayout {
 public:
  /// Appends a block. Throws std::invalid_argument where its name is taken or its size is not positive.
  ParameterHandle add(ParameterBlock block);

  int size() const { return size_; }  ///< numbers of all blocks together
  const std::vector<ParameterBlock>& blocks() const { return blocks_; }
  bool contains(std::string_view name) const { return find_index(name) >= 0; }
  /// Throws std::invalid_argument where no block has this name.
  ParameterHandle at(std::string_view name) const;
  /// Block of this number, in the layout's order.
  ParameterHandle handle(std::size_t block) const { return handles_[block]; }
  /// The block that a handle of this layout points to, or to a part of. Throws std::invalid_argument where none does.
  const ParameterBlock& block_of(const ParameterHandle& handle) const;

  bool operator==(const ParameterLayout& other) const { return blocks_ == other.blocks_; }

 private:
  int find_index(std::string_view name) const;

  std::vector<ParameterBlock> blocks_;
  std::vector<ParameterHandle> handles_;
  int size_ = 0;
};

/// What a block of one layout is called in another.
using BlockNames = std::function<std::string(const std::string& name)>;

/// Carries values from a vector of one layout to a vector of another, block by block, by their names.
/// @param theta         of layout `from`
/// @param onto          of layout `to`: blocks that `from` does not have keep these values
/// @param name_in_from  of a block of `to`; empty: the same
/// Throws std::invalid_argument where vectors and layouts differ in length, or blocks of one name in size.
[[nodiscard]] VectorX carry(const ParameterLayout& from, const VectorX& theta, const ParameterLayout& to, VectorX onto,
                            const BlockNames& name_in_from = {});

}  // namespace pliant
