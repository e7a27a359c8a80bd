#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>

#include "capture/capture_rules.hpp"
#include "capture/image_io.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/surface_distance.hpp"
#include "geometry/whole_picture.hpp"
#include "scene/obstacle.hpp"
#include "scene/region.hpp"
#include "scene/scene_toml.hpp"

namespace pliant {

std::string text_of(double value, const char* unit) {
  char text[64];
  std::snprintf(text, sizeof text, "%.4g %s", value, unit);
  return text;
}

std::string text_of(const Vector3& v) {
  char text[96];
  std::snprintf(text, sizeof text, "[%.4g, %.4g, %.4g]", v.x(), v.y(), v.z());
  return text;
}

std::string item(const char* name, std::size_t i, const char* key) {
  return std::string(name) + "[" + std::to_string(i) + "]" + (*key ? "." : "") + key;
}

namespace {

// Plausible ranges. Each is far wider than any soft object, and narrower than a slip of a factor 1000.
constexpr double smallest_object = 1e-3, largest_object = 10.0;      // [m]
constexpr double least_density = 3.0, greatest_density = 25e3;       // [kg/m^3] foam to metal
constexpr double least_gravity = 1.0, greatest_gravity = 30.0;       // [m/s^2] the Moon to Jupiter
constexpr double shortest_interval = 1e-5, longest_interval = 10.0;  // [s] between frames
constexpr double fastest = 100.0, fastest_spin = 1000.0;             // [m/s], [rad/s]
constexpr double least_noise = 1e-6, greatest_noise = 0.25;          // [m]
constexpr double greatest_offset = 1.0;                              // [s]
constexpr double greatest_force = 1e5;                               // [N]
constexpr double greatest_load = 100.0;                              // times the object's own mass
constexpr double surface_tolerance = 0.05;                           // of the object's size

double size_of(const TriangleMesh& surface) { return bounding_box(surface).extent().maxCoeff(); }

void complain_off_surface(RuleContext& context, const std::string& key, const Vector3& point) {
  if (!context.capture.scene.object.surface) return;
  const double distance = distances_to_surface(*context.capture.scene.object.surface, {&point, 1}).front();
  if (distance > surface_tolerance * size_of(*context.capture.scene.object.surface))
    context.toml.complain(key, text_of(point) + " is " + text_of(distance, "m") + " off the rest surface",
                          "a point on the undeformed surface", "give it in metres, in world coordinates, at rest");
}

/// Where the shape comes from.
const char* surface_key(const Capture& capture) {
  return capture.scene.object.volume ? "object.volume_mesh" : "object.surface";
}

void check_surface_is_solid(RuleContext& context) {
  if (!context.capture.scene.object.surface) return;
  const MeshReport report = examine(*context.capture.scene.object.surface);
  if (report.is_closed_solid) return;
  std::string wrong;
  for (const std::string& complaint : report.complaints) wrong += (wrong.empty() ? "" : "; ") + complaint;
  context.toml.complain(surface_key(context.capture),
                        (context.capture.scene.object.volume ? "the boundary of `volume_mesh`" : "`surface`") +
                            std::string(" is no solid: ") + wrong,
                        "a closed surface that faces outwards", report.cure);
}

/// A pose that is to be found needs the object's pixels told apart without it, and regions that can turn.
void check_pose(RuleContext& context) {
  const Capture& capture = context.capture;
  const Object& object = capture.scene.object;
  if (object.pose_is_known) {
    if (!object.scale_is_known)
      context.toml.complain("object.scale", "`scale` is \"unknown\" and `pose` is not", "pose = \"unknown\" beside it",
                            "a scan in another unit stands elsewhere, too");
    return;
  }
  if (object.volume)
    context.toml.complain("object.pose", "`pose` is \"unknown\", and the object is a volume mesh", "a `surface`",
                          "place its surface by `pliant place` and move the volume by what place.json says");
  if (!capture.scene.inner.empty())
    context.toml.complain("object.pose", "`pose` is \"unknown\", and a rigid body lies inside the object",
                          "a known pose", "place the scan by `pliant place` first");
  if (capture.depth.empty() && capture.clouds.empty())
    context.toml.complain("object.pose", "`pose` is \"unknown\", and nothing shows the surface",
                          "depth images or clouds", "");
  if (capture.scene.initial.released || capture.scene.timing.is_static || object.shape_is == ShapeIs::Static)
    context.toml.complain("object.pose", "`pose` is \"unknown\" for an object that is seen in another shape",
                          "an object at rest in the start frame", "place the scan by hand");
  for (std::size_t i = 0; i < capture.depth.size(); ++i)
    if (!capture.depth[i].masks && !capture.depth[i].background)
      context.toml.complain(item("depth", i), "neither `masks` nor `background`, and the scan's pose is unknown",
                            "one of them: what of an image is the object", "");
  const auto complain_of_box = [&](const Region& region, const std::string& key) {
    if (std::holds_alternative<RegionBox>(region))
      context.toml.complain(key, "a box in the frame of a scan whose pose is unknown",
                            "`sphere`, `half_space` or `vertices`", "a box cannot be turned");
  };
  for (std::size_t i = 0; i < capture.scene.fixed.size(); ++i)
    complain_of_box(capture.scene.fixed[i].region, item("fixed", i));
  for (std::size_t i = 0; i < capture.scene.led.size(); ++i)
    complain_of_box(capture.scene.led[i].region, item("led", i));
  for (std::size_t i = 0; i < capture.scene.regions.size(); ++i)
    complain_of_box(capture.scene.regions[i].region, item("region", i));
}

void check_object_size(RuleContext& context) {
  if (!context.capture.scene.object.surface || !context.capture.scene.object.scale_is_known) return;
  const double size = size_of(*context.capture.scene.object.surface);
  if (size >= smallest_object && size <= largest_object) return;
  context.toml.complain(surface_key(context.capture), "the object is " + text_of(size, "m") + " long", "1 mm to 10 m",
                        size > largest_object ? "meshes are in metres: divide by 1000 if this one is in millimetres"
                                              : "meshes are in metres: check the unit of this one");
}

void check_surface_noise(RuleContext& context) {
  constexpr double most = 0.02;  // of the object's size: beyond that it is another object's
  const Object& object = context.capture.scene.object;
  const double noise = object.surface_noise.value_or(0.0);
  const double size = object.surface && object.scale_is_known ? size_of(*object.surface) : infinite;
  if (noise < 0.0 || noise > most * size)
    context.toml.complain("object.surface_noise", "a surface that errs by " + text_of(noise, "m"),
                          size < infinite ? "0 to " + text_of(most * size, "m") : "0 or more",
                          "it is a standard deviation in metres, that of the scanner");
}

void check_mass_or_density(RuleContext& context) {
  const Capture& capture = context.capture;
  if (capture.scene.object.mass && capture.scene.object.density)
    context.toml.complain("object.density", "both `mass` and `density`", "one of the two", "keep what was measured");
  for (const auto& [key, value] :
       {std::pair("object.mass", capture.scene.object.mass), std::pair("object.density", capture.scene.object.density)})
    if (value && *value <= 0) context.toml.complain(key, text_of(*value, ""), "a number above 0", "");
  if (capture.scene.object.density && *capture.scene.object.density > 0 &&
      (*capture.scene.object.density < least_density || *capture.scene.object.density > greatest_density))
    context.toml.complain("object.density", "a density of " + text_of(*capture.scene.object.density, "kg/m^3"),
                          "3 to 25000 kg/m^3", "1 g/cm^3 is 1000 kg/m^3");
  if (!capture.scene.object.mass || *capture.scene.object.mass <= 0 || !capture.scene.object.surface ||
      !capture.scene.object.scale_is_known)
    return;
  const double volume = enclosed_volume(*capture.scene.object.surface), density = *capture.scene.object.mass / volume;
  if (volume > 0 && (density < least_density || density > greatest_density))
    context.toml.complain("object.mass",
                          text_of(*capture.scene.object.mass, "kg") + " in " + text_of(volume, "m^3") + " is " +
                              text_of(density, "kg/m^3"),
                          "3 to 25000 kg/m^3", "mass is in kilograms and the mesh in metres");
}

/// How well something is known may be said of what is given, and of the mass less than a half.
void check_given_deviations(RuleContext& context) {
  constexpr double most = 0.5;  // of a mass
  const Object& object = context.capture.scene.object;
  const auto check = [&](const char* what, const std::optional<double>& value, const std::optional<double>& std,
                         const char* unit) {
    if (!std) return;
    const std::string name = std::string(what) + "_std", key = "object." + name;
    if (!value)
      context.toml.complain(key, "`" + name + "` without `" + what + "`", "`" + std::string(what) + "` beside it",
                            "it says how well that is known");
    else if (*value > 0 && !(*std >= 0 && *std < most * *value))
      context.toml.complain(key, "a deviation of " + text_of(*std, unit),
                            "0 to " + text_of(most * *value, unit) + ", half of `" + what + "`",
                            "it is a standard deviation in " + std::string(unit));
  };
  check("mass", object.mass, object.mass_std, "kg");
  check("density", object.density, object.density_std, "kg/m^3");
  if (context.capture.scene.world.gravity_std && !context.capture.scene.world.gravity)
    context.toml.complain("world.gravity_std", "`gravity_std` without `gravity`", "`gravity` beside it",
                          "a gravity that is unknown is estimated");
}

/// What lengths that are all off by one share do to an estimate is known where weight and inertia alone act.
void check_scale_deviation(RuleContext& context) {
  const Capture& capture = context.capture;
  const Scene& scene = capture.scene;
  if (scene.object.scale_std.value_or(0.0) == 0.0) return;
  if (!capture.presses.empty() || !capture.indentations.empty() || !capture.grips.empty() ||
      !capture.material_curves.empty() || scene.wind || !scene.forces.empty())
    context.toml.complain("object.scale_std", "`scale_std` of a recording with forces that are no weight",
                          "motions, and equilibria under weights", "leave it out, or measure the scale");
  const bool has_weights = !scene.weights.empty() || !capture.loads.empty() || scene.initial.release_of;
  if (scene.object.density && has_weights)
    context.toml.complain("object.scale_std", "`scale_std` and `density`, and an attached weight",
                          "`mass` in the place of `density`", "weigh the object: its mass has no length in it");
}

void check_gravity(RuleContext& context) {
  const auto& gravity = context.capture.scene.world.gravity;
  if (!gravity) {
    if (context.toml.places.has("world") && !context.toml.places.has("world.up") && context.toml.is_sound("world"))
      context.toml.complain("world.gravity", "neither `gravity` nor `up`", "gravity = [x, y, z] in m/s^2",
                            "where gravity is unknown write `up`, the direction away from the ground");
    return;
  }
  const double strength = gravity->norm();
  if (strength != 0 && (strength < least_gravity || strength > greatest_gravity))
    context.toml.complain("world.gravity", "a gravity of " + text_of(strength, "m/s^2"), "about 9.81 m/s^2",
                          "give it in metres per second squared");
  if (strength > 0 && context.toml.places.has("world.up") &&
      context.capture.scene.world.up.dot(*gravity) > -0.5 * strength)
    context.toml.complain("world.up", "`up` does not point against `gravity`", "the opposite direction",
                          "leave out `up`");
}

void check_timing(RuleContext& context) {
  const Capture& capture = context.capture;
  const bool is_moving =
      !capture.depth.empty() || !capture.silhouettes.empty() || !capture.clouds.empty() || !capture.markers.empty();
  if (is_moving && !context.toml.places.has("timing"))
    context.toml.complain("timing", "no table [timing]", "[timing] with `frame_rate` and `frame_count`");
  if (!context.toml.is_sound("timing")) return;
  const auto& times = capture.scene.timing.times;
  const std::string key = context.toml.places.has("timing.timestamps") ? "timing.timestamps" : "timing.frame_rate";
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i] <= times[i - 1]) {
      context.toml.complain(
          key, "time " + std::to_string(i) + " (" + text_of(times[i], "s") + ") is not after the one before",
          "times that increase", "sort the frames by time");
      return;
    }
  if (times.size() < 2 || capture.scene.timing.is_static) return;
  const double interval = (times.back() - times.front()) / double(times.size() - 1);
  if (interval < shortest_interval || interval > longest_interval)
    context.toml.complain(key, text_of(interval, "s") + " between frames", "0.00001 to 10 s",
                          "times are in seconds; looks at one equilibrium need `static = true`");
}

void check_start_frame(RuleContext& context) {
  const Capture& capture = context.capture;
  if (!context.toml.is_sound("timing") || capture.scene.timing.times.empty()) return;
  if (capture.scene.timing.start_frame < 0 || capture.scene.timing.start_frame >= capture.frame_count())
    context.toml.reject("timing.start_frame", "`start_frame` is " + std::to_string(capture.scene.timing.start_frame),
                        "0 to " + std::to_string(capture.frame_count() - 1), "frames are counted from 0");
}

void check_static(RuleContext& context) {
  const Capture& capture = context.capture;
  if (!capture.scene.timing.is_static) return;
  if (capture.scene.initial.released)
    context.toml.complain("initial.released", "a static capture that is released", "one of the two",
                          "remove `static` or `released`");
  if (capture.scene.initial.linear_velocity.norm() > 0 || capture.scene.initial.angular_velocity.norm() > 0)
    context.toml.complain("initial", "a static capture with a velocity", "an object at rest",
                          "remove the velocity or `static`");
}

void check_initial_velocity(RuleContext& context) {
  const Initial& initial = context.capture.scene.initial;
  if (const double speed = initial.linear_velocity.norm(); speed > fastest)
    context.toml.complain("initial.linear_velocity", text_of(speed, "m/s"), "at most 100 m/s",
                          "give it in metres per second");
  if (const double spin = initial.angular_velocity.norm(); spin > fastest_spin)
    context.toml.complain("initial.angular_velocity", text_of(spin, "rad/s"), "at most 1000 rad/s",
                          "give it in radians per second");
}

void check_held_regions(RuleContext& context) {
  const Capture& capture = context.capture;
  if (!capture.scene.object.surface) return;
  const TriangleMesh& surface = *capture.scene.object.surface;
  const auto check = [&](const Region& region, const std::string& key, const std::string& kind) {
    if (!context.toml.is_sound(key)) return;
    if (!touches_solid(region, surface))
      context.toml.complain(
          key, "no point of the object lies in this " + kind + " region", "a region that holds a part of it",
          "the object's box is " + text_of(bounding_box(surface).min) + " to " + text_of(bounding_box(surface).max));
    bool holds_all = true;
    for (int v = 0; holds_all && v < int(surface.vertices.size()); ++v) holds_all = contains_vertex(region, surface, v);
    if (holds_all)
      context.toml.complain(key, "the whole object lies in this " + kind + " region", "a part of it",
                            "nothing could move");
  };
  for (std::size_t i = 0; i < capture.scene.fixed.size(); ++i)
    check(capture.scene.fixed[i].region, item("fixed", i), "fixed");
  for (std::size_t i = 0; i < capture.scene.led.size(); ++i) check(capture.scene.led[i].region, item("led", i), "led");
  if (!capture.scene.led.empty() &&
      (capture.scene.object.shape_is == ShapeIs::Static || capture.scene.initial.released))
    context.toml.complain("led[0]", "a led region of an object that was scanned as it sags, or that is released",
                          "[[fixed]] regions alone", "load-free shapes and held poses know what is fixed");
  for (std::size_t i = 0; i < capture.scene.inner.size(); ++i)
    if (capture.scene.object.shape_is == ShapeIs::Static &&
        capture.scene.inner[i].contact == InnerBody::Contact::Sliding)
      context.toml.complain(item("inner", i), "a rigid body on which an object slides that was scanned as it sags",
                            "contact = \"glued\", or shape_is = \"reference\"", "load-free shapes know what is fixed");
  const bool is_of_tests_alone = capture.scene.timing.times.empty();
  if (is_of_tests_alone && (!capture.scene.led.empty() || !capture.scene.obstacles.empty()))
    context.toml.complain(capture.scene.led.empty() ? "obstacle[0]" : "led[0]",
                          "an obstacle or a led region of an object that does not move",
                          "[[inner]], [[fixed]], [[grip]]", "static tests take no time");
}

/// An object may touch an obstacle where it starts, as deep as scan errors and a soft sole allow, and lie on it.
void check_obstacles(RuleContext& context) {
  constexpr double deepest = 0.1;  // of the object's size
  const Capture& capture = context.capture;
  const Timing& timing = capture.scene.timing;
  if (!capture.scene.object.surface || !capture.scene.object.pose_is_known || capture.scene.initial.released ||
      timing.is_static || timing.times.empty() || timing.start_frame >= timing.frame_count())
    return;
  const TriangleMesh& surface = *capture.scene.object.surface;
  for (std::size_t i = 0; i < capture.scene.obstacles.size(); ++i) {
    if (!context.toml.is_sound(item("obstacle", i))) continue;
    const RigidObstacle& obstacle = capture.scene.obstacles[i];
    const RigidMotion back = motion_of(obstacle).at(timing.times[std::size_t(timing.start_frame)]).inverse();
    std::vector<Vector3> points = surface.vertices;
    for (Vector3& p : points) p = back(p);
    const double depth = greatest_depth(obstacle, points);
    if (depth > deepest * size_of(surface))
      context.toml.complain(item("obstacle", i), "the object starts " + text_of(depth, "m") + " inside this obstacle",
                            "the two apart, or touching, at the start frame",
                            "obstacles are in metres, in world coordinates, where their motion is zero");
  }
}

void check_planes(RuleContext& context) {
  const Capture& capture = context.capture;
  // A released or static object is not in its rest pose when it is seen.
  if (!capture.scene.object.surface || !capture.scene.object.pose_is_known || capture.scene.initial.released ||
      capture.scene.timing.is_static)
    return;
  const double size = size_of(*capture.scene.object.surface);
  for (std::size_t i = 0; i < capture.scene.planes.size(); ++i) {
    const Plane& plane = capture.scene.planes[i];
    if (!context.toml.is_sound(item("plane", i))) continue;
    double deepest = 1e300, highest = -1e300;
    for (const Vector3& vertex : capture.scene.object.surface->vertices) {
      const double height = plane.normal.dot(vertex - plane.point);
      deepest = std::min(deepest, height);
      highest = std::max(highest, height);
    }
    // A guess may cut the object; a known plane may touch it as deep as scan errors and a soft sole allow.
    const bool is_wrong = plane.known ? deepest < -0.1 * size : highest < 0.0;
    if (is_wrong)
      context.toml.complain(item("plane", i), "the object starts " + text_of(-deepest, "m") + " below this plane",
                            "the object on the side to which the normal points",
                            "turn the normal round or move the point");
  }
}

void check_camera_names(RuleContext& context) {
  std::set<std::string> names;
  for_each_camera(context.capture, [&](const RecordingCamera& camera, const char* kind, std::size_t i) {
    if (!camera.name.empty() && !names.insert(camera.name).second)
      context.toml.complain(item(kind, i, "name"), "a second camera \"" + camera.name + "\"", "different names");
  });
}

void check_intrinsics(RuleContext& context) {
  for_each_camera(context.capture, [&](const RecordingCamera& recording, const char* kind, std::size_t i) {
    const PinholeCamera& camera = recording.camera;
    for (const auto& [key, value] : {std::pair("width", camera.width), std::pair("height", camera.height)})
      if (context.toml.is_sound(item(kind, i, key)) && (value < 2 || value > largest_side))
        context.toml.reject(item(kind, i, key), "`" + std::string(key) + "` is " + std::to_string(value),
                            "2 to 32768 pixels");
    if (!context.toml.is_sound(item(kind, i))) return;
    // From a view of 150 degrees to a long telephoto lens.
    for (const auto& [key, value] : {std::pair("fx", camera.fx), std::pair("fy", camera.fy)})
      if (value < 0.13 * camera.width || value > 30.0 * camera.width)
        context.toml.reject(item(kind, i, key),
                            "a focal length of " + text_of(value, "pixels") + " in an image " +
                                std::to_string(camera.width) + " pixels wide",
                            "0.13 to 30 times the width",
                            "focal lengths are in pixels: millimetres / sensor width x image width");
    const bool is_normalised = camera.cx <= 1.0 && camera.cy <= 1.0;
    const auto is_off = [](double c, int side) { return c < 0.3 * side || c > 0.7 * side; };
    if (is_normalised || is_off(camera.cx, camera.width) || is_off(camera.cy, camera.height))
      context.toml.reject(
          item(kind, i, "cx"), "the principal point (" + text_of(camera.cx, "") + ", " + text_of(camera.cy, "") + ")",
          "a point in the middle of the image (0.3 to 0.7 of its size), in pixels",
          "these are intrinsics of another image: of the colour camera, of another resolution, or of one "
          "that was not turned or cut; write those of the depth images");
  });
}

void check_lenses(RuleContext& context) {
  for_each_camera(context.capture, [&](const RecordingCamera& recording, const char* kind, std::size_t i) {
    const PinholeCamera& camera = recording.camera;
    if (!context.toml.is_sound(item(kind, i)) || !camera.lens.bends()) return;
    if (!sees_whole_picture(camera))
      context.toml.reject(item(kind, i, "distortion"),
                          "a lens through which no ray reaches some pixels: beyond " +
                              text_of(std::atan(camera.lens.reach()) * 180.0 / std::numbers::pi, "degrees") +
                              " from its axis it folds back",
                          "a lens that shows each place of the image once",
                          "k1, k2, p1, p2, k3 in the order of OpenCV; calibrate with corners near the image's edges");
  });
}

void check_time_offsets(RuleContext& context) {
  for_each_camera(context.capture, [&](const RecordingCamera& camera, const char* kind, std::size_t i) {
    const double offset = camera.time_offset;
    if (!context.toml.is_sound(item(kind, i))) return;
    if (std::abs(offset) > greatest_offset)
      context.toml.complain(item(kind, i, "time_offset"), "a `time_offset` of " + text_of(offset, "s"), "-1 to 1 s",
                            "in seconds; whole frames are better left out of the recording");
  });
}

void check_moving_cameras(RuleContext& context) {
  const Capture& capture = context.capture;
  for (std::size_t i = 0; i < capture.depth.size(); ++i) {
    const DepthCamera& camera = capture.depth[i];
    if (!camera.poses || !context.toml.is_sound(item("depth", i))) continue;
    if (camera.background)
      context.toml.complain(item("depth", i, "background"), "a `background` of a camera that moves",
                            "`masks`, or neither", "the scene behind the object is another in each image");
    for (std::size_t k = 0; k < capture.loads.size(); ++k)
      if (capture.loads[k].images.contains(camera.name))
        context.toml.complain(item("load", k, "images"), "an image of camera \"" + camera.name + "\", which moves",
                              "a stationary camera", "give the load a `cloud` in world coordinates");
  }
}

void check_every(RuleContext& context) {
  const auto check = [&](int every, const std::string& key) {
    if (every < 1 || (context.capture.frame_count() > 0 && every > context.capture.frame_count()))
      context.toml.reject(key, "`every` is " + std::to_string(every), "1 to the number of frames",
                          "2 means every other frame");
  };
  for_each_camera(context.capture, [&](const RecordingCamera& camera, const char* kind, std::size_t i) {
    check(camera.every, item(kind, i, "every"));
  });
  for (std::size_t i = 0; i < context.capture.clouds.size(); ++i)
    check(context.capture.clouds[i].every, item("cloud", i, "every"));
}

void check_noise(RuleContext& context) {
  const auto check = [&](const std::optional<double>& noise, const std::string& key) {
    if (noise && (*noise < least_noise || *noise > greatest_noise))
      context.toml.complain(key, "a noise of " + text_of(*noise, "m"), "0.000001 to 0.25 m",
                            "a standard deviation in metres");
  };
  for (std::size_t i = 0; i < context.capture.depth.size(); ++i)
    check(context.capture.depth[i].noise, item("depth", i, "noise"));
  for (std::size_t i = 0; i < context.capture.clouds.size(); ++i)
    check(context.capture.clouds[i].noise, item("cloud", i, "noise"));
}

void check_has_observations(RuleContext& context) {
  for (const char* kind :
       {"depth", "silhouette", "cloud", "markers", "press", "load", "indentation", "grip", "material_curve"})
    if (context.toml.places.has(kind)) return;
  context.toml.complain("", "no observation",
                        "a block [[depth]], [[silhouette]], [[cloud]], [[markers]], [[press]], [[load]], "
                        "[[indentation]], [[grip]] or [[material_curve]]",
                        "say what was recorded");
}

/// Outlines alone tell neither how large the object is nor how it falls.
void check_silhouettes_alone(RuleContext& context) {
  if (!has_silhouettes_alone(context.capture) || !context.toml.is_sound("silhouette[0]")) return;
  if (!context.capture.scene.object.surface)
    context.toml.complain("silhouette[0]", "silhouettes alone, and no scan of the object", "[object] with `surface`",
                          "scan the object at rest, or record depth as well");
  if (!context.capture.scene.world.gravity)
    context.toml.complain("silhouette[0]", "silhouettes alone, and `gravity` is unknown", "[world] with `gravity`",
                          "outlines do not tell it from the object's distance");
}

void check_presses(RuleContext& context) {
  for (std::size_t i = 0; i < context.capture.presses.size(); ++i) {
    const Press& press = context.capture.presses[i];
    if (!context.toml.is_sound(item("press", i))) continue;
    if (const double force = press.force.norm(); force == 0 || force > greatest_force)
      context.toml.complain(item("press", i, "force"), "a force of " + text_of(force, "N"),
                            "above 0 and at most 100000 N", "forces are in newtons");
    const double limit =
        context.capture.scene.object.surface ? size_of(*context.capture.scene.object.surface) : largest_object;
    if (press.contact_radius <= 0 || press.contact_radius > limit)
      context.toml.complain(item("press", i, "contact"), "a contact radius of " + text_of(press.contact_radius, "m"),
                            "above 0 and smaller than the object", "radii are in metres");
    complain_off_surface(context, item("press", i, "contact"), press.contact_centre);
  }
}

void complain_of_mass(RuleContext& context, const std::string& key, double mass) {
  const double limit = greatest_load * context.capture.scene.object.total_mass().value_or(largest_object);
  if (mass <= 0 || mass > limit)
    context.toml.complain(key, "an attached point mass of " + text_of(mass, "kg"),
                          "above 0 and at most " + text_of(limit, "kg"), "masses are in kilograms");
}

void check_weights(RuleContext& context) {
  for (std::size_t i = 0; i < context.capture.scene.weights.size(); ++i) {
    if (!context.toml.is_sound(item("weight", i))) continue;
    complain_of_mass(context, item("weight", i, "mass"), context.capture.scene.weights[i].mass);
    complain_off_surface(context, item("weight", i, "at"), context.capture.scene.weights[i].at);
  }
}

void check_wind(RuleContext& context) {
  const Scene& scene = context.capture.scene;
  if (!scene.wind || !context.toml.is_sound("wind")) return;
  if (scene.timing.is_static || scene.timing.times.empty())
    context.toml.complain("wind", "a wind in a recording at rest", "frames of an object that moves",
                          "its drag is that of a motion; remove [wind]");
  if (scene.wind->velocity.norm() > fastest)
    context.toml.complain("wind.velocity", text_of(scene.wind->velocity.norm(), "m/s"),
                          "up to " + text_of(fastest, "m/s"), "velocities are in metres a second");
}

void check_applied_forces(RuleContext& context) {
  const std::vector<AppliedForce>& forces = context.capture.scene.forces;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    if (!context.toml.is_sound(item("force", i))) continue;
    double greatest = 0.0;
    for (const auto& key : forces[i].force) greatest = std::max(greatest, key.value.norm());
    if (!(greatest > 0.0) || greatest > greatest_force)
      context.toml.complain(item("force", i), "a force of " + text_of(greatest, "N"),
                            "above 0 and at most " + text_of(greatest_force, "N"),
                            "write a guess where its strength is not known, and `known = false`");
    complain_off_surface(context, item("force", i, "at"), forces[i].at);
  }
}

void check_release(RuleContext& context) {
  const Capture& capture = context.capture;
  const auto& weight = capture.scene.initial.release_of;
  if (!weight || !context.toml.is_sound("initial")) return;
  if (!capture.scene.initial.released)
    context.toml.complain("initial.release_of", "`release_of` without `released`", "released = true",
                          "a weight that hangs in every frame is a block [[weight]]");
  if (capture.scene.world.gravity && capture.scene.world.gravity->norm() == 0)
    context.toml.complain("initial.release_of", "an attached weight without gravity", "a gravity that pulls at it",
                          "remove `release_of`");
  complain_of_mass(context, "initial.release_of.mass", weight->mass);
  complain_off_surface(context, "initial.release_of.at", weight->at);
}

void check_loads(RuleContext& context) {
  const Capture& capture = context.capture;
  for (std::size_t i = 0; i < capture.loads.size(); ++i) {
    const Load& load = capture.loads[i];
    if (!context.toml.is_sound(item("load", i))) continue;
    complain_of_mass(context, item("load", i, "mass"), load.mass);
    complain_off_surface(context, item("load", i, "at"), load.at);
    if (!load.cloud && !load.markers && load.images.empty())
      context.toml.complain(item("load", i), "a load without observation", "`cloud`, `markers` or `images`");
    if (load.markers && !load.markers_rest)
      context.toml.complain(item("load", i, "markers"), "`markers` without `markers_rest`", "both",
                            "name the markers at rest");
    for (const auto& [name, path] : load.images)
      if (std::ranges::find(capture.depth, name, &DepthCamera::name) == capture.depth.end())
        context.toml.complain(item("load", i, "images"), "no depth camera \"" + name + "\"",
                              "the name of a [[depth]] block");
  }
}

void check_indentations(RuleContext& context) {
  const Capture& capture = context.capture;
  const auto& surface = capture.scene.object.surface;
  const double limit = surface ? size_of(*surface) : largest_object;
  for (std::size_t i = 0; i < capture.indentations.size(); ++i) {
    const Indentation& test = capture.indentations[i];
    if (!context.toml.is_sound(item("indentation", i))) continue;
    if (test.radius <= 0 || test.radius > limit)
      context.toml.complain(item("indentation", i, "radius"), "a probe's radius of " + text_of(test.radius, "m"),
                            "above 0 and smaller than the object", "radii are in metres");
    complain_off_surface(context, item("indentation", i, "contact"), test.contact);
    if (test.contact_std < 0 || test.contact_std > limit)
      context.toml.complain(item("indentation", i, "contact_std"), text_of(test.contact_std, "m"),
                            "0 or above, and smaller than the object", "a standard deviation in metres");
  }
}

void check_grips(RuleContext& context) {
  const Capture& capture = context.capture;
  const auto& surface = capture.scene.object.surface;
  const double limit = surface ? size_of(*surface) : largest_object;
  for (std::size_t i = 0; i < capture.grips.size(); ++i) {
    const Grip& grip = capture.grips[i];
    if (!context.toml.is_sound(item("grip", i))) continue;
    const auto complain = [&](const char* key, const std::string& found, const char* expected, const char* advice) {
      context.toml.complain(item("grip", i, key), found, expected, advice);
    };
    if (const double way = grip.displacement.norm(); way > 10.0 * limit)
      complain("displacement", "a displacement of " + text_of(way, "m"), "at most ten times the object's size",
               "displacements are in metres");
    if (!grip.force && !grip.markers)
      complain("", "a grip without observation", "`force`, `markers`, or both", "say what was measured");
    if (grip.force && std::abs(*grip.force) > greatest_force)
      complain("force", "a force of " + text_of(*grip.force, "N"), "at most 100000 N in size", "forces are in newtons");
    if (grip.force && grip.force_direction.isZero() && grip.displacement.isZero())
      complain("force", "a force without direction", "`force_direction`, a unit vector",
               "a grip that stays where it rests has no displacement to take it from");
    if (grip.force.has_value() != grip.force_std.has_value())
      complain("force_std", grip.force ? "`force` without `force_std`" : "`force_std` without `force`", "both",
               "the standard deviation of the force in newtons");
    if (grip.force_std && *grip.force_std <= 0)
      complain("force_std", text_of(*grip.force_std, "N"), "a standard deviation above 0", "");
    if (grip.markers.has_value() != grip.markers_rest.has_value() ||
        grip.markers.has_value() != grip.markers_std.has_value())
      complain("markers", "one or two of `markers`, `markers_rest` and `markers_std`", "all three or none",
               "name the markers under load and at rest, and the standard deviation of a coordinate in metres");
    if (grip.markers_std && (*grip.markers_std < least_noise || *grip.markers_std > greatest_noise))
      complain("markers_std", text_of(*grip.markers_std, "m"), "0.000001 to 0.25 m", "a standard deviation in metres");
    if (surface && !touches_solid(grip.region, *surface))
      complain("", "no point of the object lies in this grip", "a region that holds a part of it",
               "check its unit and its place at rest");
  }
}

void check_material_curves(RuleContext& context) {
  for (std::size_t i = 0; i < context.capture.material_curves.size(); ++i) {
    const MaterialCurve& test = context.capture.material_curves[i];
    if (!context.toml.is_sound(item("material_curve", i))) continue;
    if (test.prestretch <= 0)
      context.toml.complain(item("material_curve", i, "prestretch"), text_of(test.prestretch, ""), "above 0",
                            "1 is the unloaded length");
    if (test.prestretch != 1.0 && test.mode != TestMode::SimpleShear)
      context.toml.complain(item("material_curve", i, "prestretch"), "`prestretch` of another test than a simple shear",
                            "mode = \"simple_shear\"", "remove it");
  }
}

}  // namespace

std::vector<Rule> fact_rules() {
  return {check_surface_is_solid,
          check_object_size,
          check_pose,
          check_surface_noise,
          check_mass_or_density,
          check_given_deviations,
          check_scale_deviation,
          check_gravity,
          check_timing,
          check_start_frame,
          check_static,
          check_initial_velocity,
          [](RuleContext& context) { check_vertex_lists(context.toml, context.capture.scene); },
          check_held_regions,
          check_obstacles,
          [](RuleContext& context) { check_materials(context.toml, context.capture.scene); },
          check_planes,
          check_camera_names,
          check_intrinsics,
          check_lenses,
          check_time_offsets,
          check_moving_cameras,
          check_every,
          check_noise,
          check_has_observations,
          check_silhouettes_alone,
          check_presses,
          check_weights,
          check_wind,
          check_applied_forces,
          check_release,
          check_loads,
          check_indentations,
          check_grips,
          check_material_curves};
}

}  // namespace pliant
