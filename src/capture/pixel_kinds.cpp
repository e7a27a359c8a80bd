#include "capture/pixel_kinds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/depth_points.hpp"
#include "capture/segment.hpp"

namespace pliant {

namespace {

constexpr double background_reach = 4.0;  // of the difference of two readings: many pixels, few may slip through

}  // namespace

PixelSorter::PixelSorter(const Capture& capture, const DepthCamera& camera, const ObserveOptions& options)
    : camera_(camera.camera),
      noise_(camera, typical_depth(capture, camera.camera)),
      edge_jump_(options.edge_jump),
      space_(capture, options),
      background_(read_background(camera)) {
  if (!camera.masks && !background_) find_undeclared_planes(capture, camera);
}

void PixelSorter::find_undeclared_planes(const Capture& capture, const DepthCamera& camera) {
  if (capture.frame_count() == 0) return;
  const DepthImage depth = read_depth(capture, camera, 0);
  const Segmentation scene = segment(depth, camera_, noise_);
  for (std::size_t p = 0; p < scene.planes.size(); ++p) {
    const auto on_plane =
        points_of(depth, camera_, noise_, [&](int i) { return scene.label.pixels[std::size_t(i)] == -2 - int(p); });
    space_.take_undeclared({scene.planes[p].point, scene.planes[p].normal, true}, on_plane.points);
  }
}

Image<PixelKind> PixelSorter::sort(const DepthImage& depth, const std::optional<Image<std::uint8_t>>& mask,
                                   const PinholeCamera* seen_by, double time) const {
  const PinholeCamera& camera = seen_by ? *seen_by : camera_;
  Image<PixelKind> kinds(depth.width, depth.height, PixelKind::NoReading);
  const Image<std::uint8_t>* own_mask = mask ? &*mask : nullptr;
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u) {
      const float z = depth(u, v);
      if (!(z > 0)) continue;
      const Vector3 point = camera.unproject(u, v, z);
      kinds(u, v) = space_.is_on_plane(point, noise_.axial(z))         ? PixelKind::OnPlane
                    : !may_show_object(z, u, v, point, own_mask, time) ? PixelKind::Elsewhere
                    : is_at_edge(depth, own_mask, u, v)                ? PixelKind::AtEdge
                                                                       : PixelKind::Object;
    }
  return kinds;
}

bool PixelSorter::may_show_object(float z, int u, int v, const Vector3& point, const Image<std::uint8_t>* mask,
                                  double time) const {
  if (mask) return (*mask)(u, v) != 0;
  if (!space_.is_within_reach(point) || space_.is_on_obstacle(point, noise_.axial(z), time)) return false;
  if (!background_) return true;
  const float behind = (*background_)(u, v);
  return !(behind > 0) || z < behind - background_reach * std::numbers::sqrt2 * noise_.axial(z);
}

bool PixelSorter::is_at_edge(const DepthImage& depth, const Image<std::uint8_t>* mask, int u, int v) const {
  const double limit = jump(depth(u, v));
  if (!is_supported(depth, u, v, limit) || is_at_discontinuity(depth, u, v, limit)) return true;
  if (!mask) return false;
  // The mask ends where nothing is read: its border is a silhouette whose other side the sensor lost.
  for (const auto& [du, dv] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)})
    if (depth.contains(u + du, v + dv) && (*mask)(u + du, v + dv) == 0 && !(depth(u + du, v + dv) > 0)) return true;
  return false;
}

}  // namespace pliant
