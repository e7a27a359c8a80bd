#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "capture/capture.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"
#include "capture/observe.hpp"

namespace pliant {

/// Standard deviations of a reading within which a pixel counts as one of a plane.
inline constexpr double plane_reach = 3.0;

/// What a pixel of a depth image shows.
enum class PixelKind : std::uint8_t {
  NoReading,
  Object,
  OnPlane,    ///< on a plane, or behind it
  AtEdge,     ///< at a depth edge: flying, or a mixture of two surfaces
  Elsewhere,  ///< outside the mask, as in the background image, or far from the object
};

/// Tells the object's pixels of one camera from the others; prepared once, used for every frame.
class PixelSorter {
 public:
  /// Throws InputError where the background or the first image cannot be decoded.
  PixelSorter(const Capture& capture, const DepthCamera& camera, const ObserveOptions& options);

  Image<PixelKind> sort(const DepthImage& depth, const std::optional<Image<std::uint8_t>>& mask) const;

  const DepthNoise& noise() const { return noise_; }
  double jump(double depth) const { return edge_jump_ > 0 ? edge_jump_ : noise_.jump(depth); }
  const std::vector<Plane>& planes() const { return planes_; }

 private:
  bool may_show_object(float z, int u, int v, const Vector3& point, const Image<std::uint8_t>* mask) const;
  bool is_on_plane(const Vector3& point, double sigma) const;
  bool is_at_edge(const DepthImage& depth, const Image<std::uint8_t>* mask, int u, int v) const;
  void find_undeclared_planes(const Capture& capture, const DepthCamera& camera);

  PinholeCamera camera_;
  DepthNoise noise_;
  double plane_margin_, edge_jump_;
  std::vector<Plane> planes_;
  std::optional<DepthImage> background_;
  std::optional<Box> band_;
};

/// Where the object may be: the rest surface's bounding box grown by `margin` [m] on all sides, and down to where it
/// may fall. Nothing without a rest surface.
std::optional<Box> reachable_box(const Capture& capture, double margin);

}  // namespace pliant
