#include "capture/object_space.hpp"

#include <algorithm>

#include "capture/find_plane.hpp"
#include "scene/obstacle.hpp"

namespace pliant {

namespace {

constexpr double fall = 2.0;  // [m] an object that nothing holds may fall out of its box

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
  for (const LedRegion& led : capture.scene.led)
    for (const auto& key : led.motion) {
      const KeyedMotion motion(0.5 * (rest.min + rest.max), KeyFrames<6>(led.motion));
      extend(box, moved(rest, motion.at(key.time)));
    }
  if (!capture.scene.is_held() && !capture.scene.timing.is_static)
    extend(box, moved(rest, {Matrix3::Identity(), -fall * capture.scene.world.up}));
  box.min.array() -= margin;
  box.max.array() += margin;
  return box;
}

ObjectSpace::ObjectSpace(const Capture& capture, const ObserveOptions& options) : plane_margin_(options.plane_margin) {
  if (capture.scene.object.surface) {
    own_box_ = bounding_box(*capture.scene.object.surface);
    band_ = reachable_box(capture, options.band > 0 ? options.band : own_box_->extent().maxCoeff());
  }
  for (const Plane& plane : capture.scene.planes) {
    if (plane.known)
      planes_.push_back(plane);
    else if (const auto found = find_plane(capture, plane))
      planes_.push_back(*found);
  }
  for (const RigidObstacle& obstacle : capture.scene.obstacles)
    obstacles_.push_back({distance_to(obstacle), motion_of(obstacle)});
}

bool ObjectSpace::is_on_obstacle(const Vector3& point, double sigma, double time) const {
  return std::ranges::any_of(obstacles_, [&](const SeenObstacle& obstacle) {
    return obstacle.distance(obstacle.motion.at(time).inverse()(point)) < plane_reach * sigma;
  });
}

bool ObjectSpace::is_within_reach(const Vector3& point) const { return !band_ || is_inside(*band_, point); }

bool ObjectSpace::is_on_plane(const Vector3& point, double sigma) const {
  const double margin = plane_margin_ > 0 ? plane_margin_ : plane_reach * sigma;
  return std::ranges::any_of(planes_,
                             [&](const Plane& plane) { return plane.normal.dot(point - plane.point) < margin; });
}

void ObjectSpace::take_undeclared(const Plane& plane, std::span<const Vector3> on_plane, double margin) {
  constexpr double greatest_share = 0.3;
  std::optional<Box> own = own_box_;
  if (own) own->min.array() -= margin, own->max.array() += margin;
  const auto inside =
      std::ranges::count_if(on_plane, [&](const Vector3& point) { return own && is_inside(*own, point); });
  if (double(inside) < greatest_share * double(on_plane.size())) planes_.push_back(plane);
}

}  // namespace pliant
