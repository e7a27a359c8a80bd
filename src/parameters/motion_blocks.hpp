#pragma once

#include <functional>
#include <string>
#include <vector>

#include "parameters/layout.hpp"

namespace pliant {

/// Blocks of a linearly elastic material: its control moduli and one Poisson's ratio.
struct MaterialBlocks {
  std::vector<ParameterHandle> youngs_moduli;  ///< [Pa], one a control of the body's `ModulusField`
  ParameterHandle poissons_ratio;              ///< [-]

  /// Sets every control modulus of a parameter vector [Pa].
  void set_moduli(VectorX& theta, double youngs_modulus) const;
  /// Multiplies every control modulus of a parameter vector.
  void scale_moduli(VectorX& theta, double factor) const;
  /// Every control modulus of a parameter vector [Pa].
  VectorX moduli(const VectorX& theta) const;
};

/// A plane's blocks: six numbers of its place, one of its friction and one of how hard it is.
struct PlaneBlock {
  ParameterHandle point;      ///< 3, [m]
  ParameterHandle normal;     ///< 3, unit length
  ParameterHandle friction;   ///< Coulomb's coefficient [-]; may not exist: none
  ParameterHandle stiffness;  ///< of the penalty [Pa/m]; may not exist or be 0: that which the contact was made with

  /// The six numbers of its place.
  ParameterHandle whole() const { return {point.first, point.size + normal.size}; }
};

/// Blocks of contact with an obstacle whose place is known.
struct ContactBlock {
  ParameterHandle friction;   ///< Coulomb's coefficient [-]; may not exist: that which the contact was made with
  ParameterHandle stiffness;  ///< as of `PlaneBlock`
};

/// Blocks of everything that the motion of a body depends on.
struct MotionBlocks : MaterialBlocks {
  ParameterHandle mass_damping;                   ///< Rayleigh, [1/s]
  ParameterHandle stiffness_damping;              ///< Rayleigh, [s]
  ParameterHandle density;                        ///< [kg/m^3]
  ParameterHandle gravity;                        ///< 3, [m/s^2]
  ParameterHandle linear_velocity;                ///< 3, of the centre of mass at the start [m/s]
  ParameterHandle angular_velocity;               ///< 3, about the centre of mass at the start [rad/s]
  std::vector<PlaneBlock> planes;                 ///< obstacles; all have one block of stiffness,
  std::vector<ContactBlock> obstacles;            ///< and so have those of other shapes
  ParameterHandle contact_stiffness;              ///< that block [Pa/m]; does not exist where there is no obstacle
  std::vector<ParameterHandle> pulls;             ///< 3 each [-], see `Pull`
  std::vector<ParameterHandle> scan_corrections;  ///< 3 each [-], see `ShapeField`
  ParameterHandle wind;                           ///< 3, mean velocity of the air [m/s]; may not exist
  std::vector<ParameterHandle> strengths;         ///< 1 each [-], factors of forces that are applied

  /// All of them.
  std::vector<ParameterHandle> all() const;
  /// The same blocks of another layout.
  /// @param there  says where a handle's numbers stand in it
  MotionBlocks moved(const std::function<ParameterHandle(const ParameterHandle&)>& there) const;
};

/// How many blocks of each kind a motion has.
struct MotionCounts {
  int moduli = 1, planes = 0, obstacles = 0, pulls = 0, scan_corrections = 0;
  bool wind = false;
  int strengths = 0;
};

/// Appends the blocks of a motion: Young's modulus, Poisson's ratio, dampings, density, gravity and first velocities,
/// then planes, obstacles, pulls, corrections of the scan, wind, strengths, and further control moduli. So blocks that
/// every motion has stand in the same places whatever follows.
/// @param moduli_names  of the control moduli; empty: "youngs_modulus", "youngs_modulus@2", ...
/// Throws std::invalid_argument where a name is taken.
MotionBlocks add_motion_blocks(ParameterLayout& layout, const MotionCounts& counts,
                               const std::vector<std::string>& moduli_names = {});

/// The blocks of a motion in a layout of their own.
class MotionLayout : public MotionBlocks {
 public:
  explicit MotionLayout(const MotionCounts& counts = {}) {
    MotionBlocks::operator=(add_motion_blocks(layout_, counts));
  }
  const ParameterLayout& layout() const { return layout_; }
  int size() const { return layout_.size(); }
  VectorX zero() const { return VectorX::Zero(layout_.size()); }

 private:
  ParameterLayout layout_;
};

}  // namespace pliant
