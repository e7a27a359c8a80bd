#include "capture/pixel_kinds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/depth_points.hpp"
#include "capture/find_plane.hpp"
#include "capture/segment.hpp"

namespace pliant {

namespace {

constexpr double background_reach = 4.0;  // of the difference of two readings: many pixels, few may slip through
constexpr double fall = 2.0;              // [m] an object that nothing holds may fall out of its box

bool is_inside(const Box& box, const Vector3& point) {
  return (point.array() >= box.min.array()).all() && (point.array() <= box.max.array()).all();
}

Box moved(const Box& box, const RigidMotion& motion) {
  Box result;
  for (int corner = 0; corner < 8; ++corner)
    result.extend(motion({(corner & 1 ? box.max : box.min).x(), (corner & 2 ? box.max : box.min).y(),
                          (corner & 4 ? box.max : box.min).z()}));
  return result;
}

void extend(Box& box, const Box& other) {
  box.extend(other.min);
  box.extend(other.max);
}

}  // namespace

std::optional<Box> reachable_box(const Capture& capture, double margin) {
  if (!capture.scene.object.surface) return std::nullopt;
  const Box rest = bounding_box(*capture.scene.object.surface);
  Box box = rest;
  for (const FixedRegion& fixed : capture.scene.fixed)
    if (fixed.displaced_to) extend(box, moved(rest, *fixed.displaced_to));
  if (capture.scene.fixed.empty() && !capture.scene.timing.is_static)
    extend(box, moved(rest, {Matrix3::Identity(), -fall * capture.scene.world.up}));
  box.min.array() -= margin;
  box.max.array() += margin;
  return box;
}

PixelSorter::PixelSorter(const Capture& capture, const DepthCamera& camera, const ObserveOptions& options)
    : camera_(camera.camera),
      noise_(camera, typical_depth(capture, camera.camera)),
      plane_margin_(options.plane_margin),
      edge_jump_(options.edge_jump),
      background_(read_background(camera)) {
  if (capture.scene.object.surface) {
    const double size = bounding_box(*capture.scene.object.surface).extent().maxCoeff();
    band_ = reachable_box(capture, options.band > 0 ? options.band : size);
  }
  for (const Plane& plane : capture.scene.planes) {
    if (plane.known)
      planes_.push_back(plane);
    else if (const auto found = find_plane(capture, plane))
      planes_.push_back(*found);
  }
  if (!camera.masks && !background_) find_undeclared_planes(capture, camera);
}

// A table that nobody declared: a large plane most of which lies outside the object's own box, so that a flat side of
// the object is never taken for it.
void PixelSorter::find_undeclared_planes(const Capture& capture, const DepthCamera& camera) {
  if (capture.frame_count() == 0) return;
  const DepthImage depth = read_depth(capture, camera, 0);
  const Segmentation scene = segment(depth, camera_, noise_);
  for (std::size_t p = 0; p < scene.planes.size(); ++p) {
    const auto on_plane =
        points_of(depth, camera_, noise_, [&](int i) { return scene.label.pixels[std::size_t(i)] == -2 - int(p); });
    const auto own_box =
        capture.scene.object.surface ? std::optional(bounding_box(*capture.scene.object.surface)) : std::nullopt;
    const auto inside = std::ranges::count_if(
        on_plane.points, [&](const Vector3& point) { return own_box && is_inside(*own_box, point); });
    if (double(inside) < 0.3 * double(on_plane.points.size()))
      planes_.push_back({scene.planes[p].point, scene.planes[p].normal, true});
  }
}

Image<PixelKind> PixelSorter::sort(const DepthImage& depth, const std::optional<Image<std::uint8_t>>& mask) const {
  Image<PixelKind> kinds(depth.width, depth.height, PixelKind::NoReading);
  const Image<std::uint8_t>* own_mask = mask ? &*mask : nullptr;
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u) {
      const float z = depth(u, v);
      if (!(z > 0)) continue;
      const Vector3 point = camera_.unproject(u, v, z);
      kinds(u, v) = is_on_plane(point, noise_.axial(z))          ? PixelKind::OnPlane
                    : !may_show_object(z, u, v, point, own_mask) ? PixelKind::Elsewhere
                    : is_at_edge(depth, own_mask, u, v)          ? PixelKind::AtEdge
                                                                 : PixelKind::Object;
    }
  return kinds;
}

bool PixelSorter::may_show_object(float z, int u, int v, const Vector3& point, const Image<std::uint8_t>* mask) const {
  if (mask) return (*mask)(u, v) != 0;
  if (band_ && !is_inside(*band_, point)) return false;
  if (!background_) return true;
  const float behind = (*background_)(u, v);
  return !(behind > 0) || z < behind - background_reach * std::numbers::sqrt2 * noise_.axial(z);
}

bool PixelSorter::is_on_plane(const Vector3& point, double sigma) const {
  const double margin = plane_margin_ > 0 ? plane_margin_ : plane_reach * sigma;
  return std::ranges::any_of(planes_,
                             [&](const Plane& plane) { return plane.normal.dot(point - plane.point) < margin; });
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
