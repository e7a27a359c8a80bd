// Whether what was recorded shows the object where the capture has it.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

#include "base/median.hpp"
#include "capture/capture_rules.hpp"
#include "capture/depth_frame.hpp"
#include "capture/image_io.hpp"
#include "capture/point_cloud.hpp"
#include "geometry/surface_distance.hpp"

namespace pliant {

namespace {

constexpr double nearest_scene = 0.02, farthest_scene = 50.0;  // [m] median depth of an image
constexpr int least_pixels = 10;                               // that show something near the object
constexpr double most_of_border = 0.5;                         // of a mask, that the object may cover

// Whether there are frames, and `start_frame` is one of them.
bool has_start(const RuleContext& context) {
  return !context.capture.scene.timing.times.empty() && context.toml.is_sound("timing.start_frame");
}

// The first frame of a sequence that shows the object free.
int first_free_frame(const Capture& capture, int every) {
  const int frame = (capture.scene.timing.start_frame + every - 1) / every * every;
  return frame < capture.frame_count() ? frame : (capture.frame_count() - 1) / every * every;
}

struct Sphere {
  Vector3 centre;
  double radius;
};

// Where the object may be: around its place at rest, and on the way of a fall. Generous on purpose.
std::vector<Sphere> possible_places(const Capture& capture) {
  const Box box = bounding_box(*capture.scene.object.surface);
  const double own = 0.5 * box.extent().norm();
  const double radius = (capture.scene.timing.is_static || capture.scene.initial.released ? 3.0 : 1.5) * own;
  std::vector<Sphere> places{{0.5 * (box.min + box.max), radius}};
  const bool may_fall = !capture.scene.is_held() && !capture.scene.timing.is_static;
  for (double fallen = own; may_fall && fallen < 2.0; fallen += own)
    places.push_back({places[0].centre - fallen * capture.scene.world.up, radius});
  for (const FixedRegion& fixed : capture.scene.fixed)
    if (fixed.displaced_to) places.push_back({(*fixed.displaced_to)(places[0].centre), radius});
  for (const LedRegion& led : capture.scene.led)
    for (const auto& key : led.motion) places.push_back({places[0].centre + key.value.head<3>(), radius});
  return places;
}

bool may_see(const PinholeCamera& camera, const Sphere& sphere) {
  const Vector3 seen = camera.project(sphere.centre);
  if (seen.z() < sphere.radius) return seen.z() > -sphere.radius;
  const double du = camera.fx * sphere.radius / seen.z(), dv = camera.fy * sphere.radius / seen.z();
  return seen.x() + du > 0 && seen.x() - du < camera.width && seen.y() + dv > 0 && seen.y() - dv < camera.height;
}

bool is_near(const std::vector<Sphere>& places, const Vector3& point) {
  return std::ranges::any_of(places,
                             [&](const Sphere& s) { return (point - s.centre).squaredNorm() < s.radius * s.radius; });
}

/// Whether a ray, from where the camera stands and of depth 1 in the world's axes, passes through a sphere.
bool passes(const PinholeCamera& lens, double u, double v, const Sphere& sphere) {
  const Vector3 ray = lens.unproject(u, v, 1.0) - lens.camera_to_world.translation;
  const Vector3 to = sphere.centre - lens.camera_to_world.translation;
  return ray.dot(to) > 0.0 && ray.cross(to).squaredNorm() < sphere.radius * sphere.radius * ray.squaredNorm();
}

int pixels_near(const Capture& capture, const SilhouetteCamera& camera, int frame, const std::vector<Sphere>& places) {
  const Image<std::uint8_t> mask = read_object_mask(capture, camera, frame);
  const PinholeCamera lens = camera.at(frame);
  int count = 0;
  for (int v = 0; v < mask.height; ++v)
    for (int u = 0; u < mask.width; ++u)
      if (mask(u, v) && std::ranges::any_of(places, [&](const Sphere& s) { return passes(lens, u, v, s); })) ++count;
  return count;
}

int pixels_near(const Capture& capture, const DepthCamera& camera, int frame, const std::vector<Sphere>& places) {
  const DepthImage depth = read_depth(capture, camera, frame);
  const auto mask = read_object_mask(capture, camera, frame);
  const PinholeCamera lens = camera.at(frame);
  int count = 0;
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u)
      if (depth(u, v) > 0 && (!mask || (*mask)(u, v)) && is_near(places, lens.unproject(u, v, depth(u, v)))) ++count;
  return count;
}

/// What the first mask of the free object shows: nothing, or all but the object. A depth camera beside others may see
/// it later.
template <class Camera>
void check_first_mask(RuleContext& context, const Camera& camera, const FramePattern& pattern, const std::string& key) {
  const int frame = first_free_frame(context.capture, camera.every);
  const Image<std::uint8_t> mask = read_object_mask(camera, context.capture.folder / pattern(frame));
  const std::string file = "\"" + pattern(frame).string() + "\"";
  if (std::is_same_v<Camera, SilhouetteCamera> &&
      std::ranges::all_of(mask.pixels, [](std::uint8_t m) { return m == 0; }))
    return context.toml.reject(key, file + " shows no pixel of the object", "pixels that are not zero on the object",
                               "the object must be in the picture when it begins to move");
  int border = 0, of_object = 0;
  for (int v = 0; v < mask.height; ++v)
    for (int u = 0; u < mask.width; ++u)
      if (u == 0 || v == 0 || u == mask.width - 1 || v == mask.height - 1) ++border, of_object += mask(u, v) != 0;
  if (of_object > most_of_border * border)
    context.toml.reject(key, file + " shows the object along most of the picture's border",
                        "zero around the object, and another value on it",
                        "turn the masks round: they look inverted; or move the camera away from the object");
}

void check_masks(RuleContext& context) {
  if (!has_start(context)) return;
  for_each_sound(context, "silhouette", context.capture.silhouettes, [&](const auto& camera, const std::string& key) {
    try_file(context, key, [&] { check_first_mask(context, camera, camera.masks, key + ".masks"); });
  });
  for_each_sound(context, "depth", context.capture.depth, [&](const auto& camera, const std::string& key) {
    if (camera.masks) try_file(context, key, [&] { check_first_mask(context, camera, *camera.masks, key + ".masks"); });
  });
}

void check_depth_scale(RuleContext& context) {
  if (!has_start(context)) return;
  for_each_sound(context, "depth", context.capture.depth, [&](const DepthCamera& camera, const std::string& key) {
    try_file(context, key, [&] {
      auto readings = read_depth(context.capture, camera, first_free_frame(context.capture, camera.every)).pixels;
      std::erase_if(readings, [](float z) { return !(z > 0); });
      if (readings.empty())
        return context.toml.reject(key + ".images", "the first image of the free object has no reading",
                                   "depth readings", "0 means no reading");
      const float distance = median(std::move(readings));
      if (distance < nearest_scene || distance > farthest_scene)
        context.toml.reject(key + ".depth_scale", "a scene " + text_of(distance, "m") + " away (median)",
                            "0.02 to 50 m", "depth_scale is raw units per metre: 1000 for millimetres");
    });
  });
}

void check_cameras_see_object(RuleContext& context) {
  const Capture& capture = context.capture;
  if (!capture.scene.object.surface || !capture.scene.object.pose_is_known || !has_start(context)) return;
  const std::vector<Sphere> places = possible_places(capture);
  const auto check = [&](const auto& camera, const std::string& block, const std::string& what) {
    const std::string key = block + ".camera_to_world";
    const int last = (capture.frame_count() - 1) / camera.every * camera.every;
    const int first = first_free_frame(capture, camera.every);
    const int middle = (first + last) / 2 / camera.every * camera.every;
    const auto sees = [&](const Sphere& sphere) {
      return may_see(camera.at(first), sphere) || may_see(camera.at(middle), sphere) ||
             may_see(camera.at(last), sphere);
    };
    const std::string advice = "the pose maps camera (x right, y down, z forward) to world coordinates, in metres";
    if (std::ranges::none_of(places, sees))
      return context.toml.complain(key, "camera \"" + camera.name + "\" looks past the rest surface",
                                   "the object in its view", advice);
    try_file(context, block, [&] {
      int seen = 0;
      for (const int frame : {first, middle, last}) seen = std::max(seen, pixels_near(capture, camera, frame, places));
      if (seen < least_pixels)
        context.toml.complain(key,
                              "camera \"" + camera.name + "\" has " +
                                  (seen == 0 ? "no" : "only " + std::to_string(seen)) + " " + what +
                                  " near the rest surface",
                              what + " of the object", advice);
    });
  };
  for_each_sound(context, "depth", capture.depth,
                 [&](const auto& camera, const std::string& block) { check(camera, block, "readings"); });
  for_each_sound(context, "silhouette", capture.silhouettes,
                 [&](const auto& camera, const std::string& block) { check(camera, block, "pixels of its masks"); });
}

/// Another pose, or another unit of depth, that a camera may have been given in the place of its own.
struct OtherSight {
  RigidMotion camera_to_world;
  double depth_scale;  // raw units a metre
  std::string words;
};

/// First `b`, then `a`.
RigidMotion product(const RigidMotion& a, const RigidMotion& b) { return {a.rotation * b.rotation, a(b.translation)}; }

std::vector<OtherSight> other_sights(const DepthCamera& camera) {
  const RigidMotion stated = camera.camera.camera_to_world;
  const auto turned = [](const Vector3& axis, double degrees) {
    RigidMotion turn;
    turn.rotation = Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis).toRotationMatrix();
    return turn;
  };
  const RigidMotion to_opengl = turned(Vector3::UnitX(), 180.0);
  RigidMotion transposed = stated, in_millimetres = stated;
  transposed.rotation.transposeInPlace();
  in_millimetres.translation *= 1e-3;
  std::vector<OtherSight> others = {
      {stated.inverse(), camera.depth_scale, "its inverse would: it looks like one from world to camera"},
      {product(stated, to_opengl), camera.depth_scale, "with the axes of OpenGL (x right, y up, z backward) it would"},
      {product(to_opengl, stated).inverse(), camera.depth_scale,
       "its inverse with the axes of OpenGL (x right, y up, z backward) would"},
      {transposed, camera.depth_scale, "with its rotation transposed it would"},
      {in_millimetres, camera.depth_scale, "with its translation divided by 1000 it would: it looks like millimetres"}};
  for (const double degrees : {90.0, -90.0, 180.0})
    others.push_back({product(stated, turned(Vector3::UnitZ(), degrees)), camera.depth_scale,
                      "with images turned by " + std::to_string(int(std::abs(degrees))) + " degrees it would"});
  for (const double degrees : {90.0, -90.0})
    others.push_back({product(turned(Vector3::UnitX(), degrees), stated), camera.depth_scale,
                      "with y and z of the world traded it would: scan and pose may have different axes"});
  for (const double scale : {100.0, 1000.0, 4000.0, 5000.0, 8000.0, 10000.0})
    if (std::abs(scale / camera.depth_scale - 1.0) > 0.01)
      others.push_back({stated, scale, "with `depth_scale` = " + std::to_string(int(scale)) + " it would"});
  return others;
}

/// Readings of an image in the camera's axes [m], some hundreds, of the mask where there is one.
std::vector<Vector3> readings_of(const Capture& capture, const DepthCamera& camera, int frame) {
  constexpr std::size_t most = 400;
  const DepthImage depth = read_depth(capture, camera, frame);
  const auto mask = read_object_mask(capture, camera, frame);
  std::vector<Vector3> all, some;
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u)
      if (depth(u, v) > 0 && (!mask || (*mask)(u, v))) all.push_back(camera.at(frame).ray(u, v) * depth(u, v));
  for (std::size_t i = 0; i < std::min(most, all.size()); ++i)
    some.push_back(all[i * all.size() / std::min(most, all.size())]);
  return some;
}

/// Whether the free object is seen where its scan stands at all. What would have it there is said.
void check_scan_is_seen(RuleContext& context) {
  constexpr double reach = 0.05;                         // of the object's size
  constexpr double few_masked = 0.2, most_masked = 0.6;  // of the object's readings, as stated and by another sight
  constexpr double least = 5.0;                          // readings that another sight must put there without masks
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const Scene& scene = context.capture.scene;
  const bool is_elsewhere = scene.initial.released || scene.timing.is_static ||
                            std::ranges::any_of(scene.fixed, [](const auto& f) { return f.displaced_to.has_value(); });
  if (!scene.object.surface || scene.object.surface->triangles.empty() || !scene.object.pose_is_known ||
      !context.toml.is_sound("object") || !has_start(context) || is_elsewhere)
    return;
  const SurfaceDistance distance(*scene.object.surface);
  const double near = reach * bounding_box(*scene.object.surface).extent().maxCoeff();
  for_each_sound(context, "depth", context.capture.depth, [&](const DepthCamera& camera, const std::string& key) {
    try_file(context, key, [&] {
      const int frame = first_free_frame(context.capture, camera.every);
      const std::vector<Vector3> readings = readings_of(context.capture, camera, frame);
      const double off = 3.0 * camera.pose_std.shift;
      struct Sight {
        std::ptrdiff_t near = 0;  // readings by the scan
        double distance = 0.0;    // [m] mean of all, of each as far as it counts as near
      };
      const auto sight = [&](const RigidMotion& pose, double stretch) {
        Sight seen;
        for (const Vector3& p : readings) {
          const double d = distance(pose(stretch * p));
          seen.near += d < near + off;
          seen.distance += std::min(d, near + off) / double(readings.size());
        }
        return seen;
      };
      if (readings.empty()) return;
      const double all = double(readings.size());
      const double stated = double(sight(camera.at(frame).camera_to_world, 1.0).near);
      if (stated > (camera.masks ? few_masked * all : 0.0)) return;
      const OtherSight* best = nullptr;
      const std::vector<OtherSight> others = camera.moved.empty() ? other_sights(camera) : std::vector<OtherSight>();
      const double enough = camera.masks ? most_masked * all : least;
      double closest = infinite;
      for (const OtherSight& other : others) {
        const Sight seen = sight(other.camera_to_world, camera.depth_scale / other.depth_scale);
        if (double(seen.near) >= enough && seen.distance < closest) best = &other, closest = seen.distance;
      }
      if (stated > 0.0 && !best) return;  // no other convention explains it
      const bool is_scale = best && best->depth_scale != camera.depth_scale;
      context.toml.reject(
          key + (is_scale ? ".depth_scale" : ".camera_to_world"),
          "camera \"" + camera.name + (stated > 0.0 ? "\" shows little within " : "\" shows nothing within ") +
              text_of(near + off, "m") + " of the scan" + (best ? "; " + best->words : ""),
          "the object where its scan stands at the start frame",
          best ? ""
               : "the pose maps camera (x right, y down, z forward) to world coordinates, in metres; the "
                 "scan may be of another object, in another unit or place (`pliant place` finds both)");
    });
  });
}

void check_clouds_near_object(RuleContext& context) {
  const Capture& capture = context.capture;
  if (!capture.scene.object.surface || !capture.scene.object.pose_is_known || !has_start(context)) return;
  const std::vector<Sphere> places = possible_places(capture);
  for_each_sound(context, "cloud", capture.clouds, [&](const CloudSequence& cloud, const std::string& key) {
    try_file(context, key, [&] {
      const auto points = read_points(capture.folder / cloud.points(first_free_frame(capture, cloud.every)));
      if (std::ranges::none_of(points, [&](const Vector3& p) { return is_near(places, p); }))
        context.toml.complain(key + ".points", "no point near the rest surface", "points on the object",
                              "clouds are in metres, in world coordinates");
    });
  });
}

}  // namespace

std::vector<Rule> sight_rules() {
  return {check_masks, check_depth_scale, check_scan_is_seen, check_cameras_see_object, check_clouds_near_object};
}

}  // namespace pliant
