#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "capture/capture.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"
#include "capture/object_space.hpp"
#include "capture/observe.hpp"

namespace pliant {

/// What a pixel of a depth image shows.
enum class PixelKind : std::uint8_t {
  NoReading,
  Object,
  OnPlane,    ///< on a plane, or behind it
  AtEdge,     ///< at a depth edge: flying, or a mixture of two surfaces
  Elsewhere,  ///< outside the mask, as in the background image, on an obstacle, or far from the object
};

/// Tells the object's pixels of one camera from the others; prepared once, used for every frame.
class PixelSorter {
 public:
  /// Throws InputError where the background or the first image cannot be decoded.
  PixelSorter(const Capture& capture, const DepthCamera& camera, const ObserveOptions& options);

  /// @param seen_by  the camera as it stood then, where it moves; null: as it stood in the first frame
  /// @param time     of the recording [s], for obstacles that move
  Image<PixelKind> sort(const DepthImage& depth, const std::optional<Image<std::uint8_t>>& mask,
                        const PinholeCamera* seen_by = nullptr, double time = 0.0) const;

  const DepthNoise& noise() const { return noise_; }
  double jump(double depth) const { return edge_jump_ > 0 ? edge_jump_ : noise_.jump(depth); }
  const std::vector<Plane>& planes() const { return space_.planes(); }

 private:
  bool may_show_object(float z, int u, int v, const Vector3& point, const Image<std::uint8_t>* mask, double time) const;
  bool is_at_edge(const DepthImage& depth, const Image<std::uint8_t>* mask, int u, int v) const;
  void find_undeclared_planes(const Capture& capture, const DepthCamera& camera);

  PinholeCamera camera_;
  DepthNoise noise_;
  double edge_jump_;
  ObjectSpace space_;
  std::optional<DepthImage> background_;
};

}  // namespace pliant
