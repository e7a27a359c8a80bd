#include "capture/survey.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/files.hpp"
#include "base/median.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"
#include "capture/markers.hpp"
#include "capture/pixel_kinds.hpp"
#include "capture/point_cloud.hpp"

namespace pliant {

namespace {

constexpr double moving = 4.0;          // standard deviations of a point; the centroid of hundreds is far steadier
constexpr double moving_markers = 8.0;  // the same of markers: they are few
constexpr double contact_gap = 0.02;    // of the object's size: how near a plane counts as touching it

/// @param counted  a frame, and how many points it shows
PointCounts count_points(std::span<const std::pair<int, int>> counted) {
  PointCounts counts;
  std::vector<int> all;
  for (const auto& [frame, points] : counted) {
    all.push_back(points);
    if (points == 0) counts.empty_frames.push_back(frame);
  }
  if (all.empty()) return counts;
  counts.least = *std::ranges::min_element(all);
  counts.greatest = *std::ranges::max_element(all);
  counts.median = median(all);
  return counts;
}

double median_noise(std::span<const ObservedFrame> frames) {
  std::vector<float> noise;
  for (const ObservedFrame& frame : frames)
    if (!frame.noise.empty()) noise.push_back(median(frame.noise));
  return double(median(noise));
}

Vector3 centroid_of(const std::vector<Vector3>& points) {
  Vector3 sum = Vector3::Zero();
  for (const Vector3& point : points) sum += point;
  return sum / double(points.size());
}

// Height of the second percentile: the lowest points without the few that noise throws further down.
double low_height(const std::vector<Vector3>& points, const Plane& plane) {
  std::vector<double> heights;
  for (const Vector3& point : points) heights.push_back(plane.normal.dot(point - plane.point));
  const auto low = heights.begin() + std::ptrdiff_t(heights.size() / 50);
  std::nth_element(heights.begin(), low, heights.end());
  return *low;
}

double greatest_travel(std::span<const ObservedFrame> frames) {
  const auto first = std::ranges::find_if(frames, [](const ObservedFrame& frame) { return !frame.points.empty(); });
  if (first == frames.end()) return 0.0;
  const Vector3 start = centroid_of(first->points);
  double travel = 0.0;
  for (const ObservedFrame& frame : frames)
    if (!frame.points.empty()) travel = std::max(travel, (centroid_of(frame.points) - start).norm());
  return travel;
}

// How far the seen points' centroid has moved along a direction since the object was let go.
std::vector<double> shifts(const Capture& capture, std::span<const ObservedFrame> frames, const Vector3& direction) {
  std::vector<double> result(frames.size(), 0.0);
  std::optional<Vector3> start;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].frame < capture.scene.timing.start_frame || frames[i].points.empty()) continue;
    const Vector3 now = centroid_of(frames[i].points);
    if (!start) start = now;
    result[i] = direction.dot(now - *start);
  }
  return result;
}

// Lowest point of the rest surface above a plane [m].
double clearance(const TriangleMesh& surface, const Plane& plane) {
  double lowest = 1e300;
  for (const Vector3& vertex : surface.vertices) lowest = std::min(lowest, plane.normal.dot(vertex - plane.point));
  return lowest;
}

// The side on which an object touches a plane is mostly hidden, so contact follows from the seen side too: when it has
// come nearer to the plane by the clearance at the start.
std::optional<int> first_contact(const Capture& capture, std::span<const ObservedFrame> frames, double noise,
                                 const std::vector<PlaneSurvey>& seen) {
  if (!capture.scene.object.surface || capture.scene.timing.is_static) return std::nullopt;
  const double gap =
      plane_reach * noise + contact_gap * bounding_box(*capture.scene.object.surface).extent().maxCoeff();
  std::optional<int> first;
  for (std::size_t p = 0; p < capture.scene.planes.size(); ++p) {
    const bool is_found = !capture.scene.planes[p].known && seen[p].seen;
    const Plane plane = is_found ? Plane(*seen[p].seen) : capture.scene.planes[p];
    const std::vector<double> shift = shifts(capture, frames, plane.normal);
    const double start = capture.scene.initial.released ? 1e300 : clearance(*capture.scene.object.surface, plane);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (frames[i].frame < capture.scene.timing.start_frame || frames[i].points.empty()) continue;
      if (low_height(frames[i].points, plane) >= gap && start + shift[i] >= gap) continue;
      first = std::min(first.value_or(frames[i].frame), frames[i].frame);
      break;
    }
  }
  return first;
}

// Share of the rest surface's vertices with a seen point near them.
std::optional<double> seen_share(const Capture& capture, std::span<const ObservedFrame> frames, double noise) {
  if (!capture.scene.object.surface || capture.scene.timing.is_static || capture.scene.initial.released)
    return std::nullopt;
  const auto start = std::ranges::find_if(frames, [&](const ObservedFrame& frame) {
    return frame.frame >= capture.scene.timing.start_frame && !frame.points.empty();
  });
  if (start == frames.end()) return std::nullopt;
  const double reach = std::max(3.0 * noise, 0.02 * bounding_box(*capture.scene.object.surface).extent().maxCoeff());
  const auto is_seen = [&](const Vector3& vertex) {
    return std::ranges::any_of(start->points,
                               [&](const Vector3& p) { return (p - vertex).squaredNorm() < reach * reach; });
  };
  const auto& vertices = capture.scene.object.surface->vertices;
  return double(std::ranges::count_if(vertices, is_seen)) / double(vertices.size());
}

std::vector<PlaneSurvey> survey_planes(const Capture& capture) {
  std::vector<PlaneSurvey> planes;
  for (const Plane& declared : capture.scene.planes) {
    PlaneSurvey& plane = planes.emplace_back();
    plane.seen = find_plane(capture, declared);
    if (!plane.seen) continue;
    plane.angle = std::acos(std::min(1.0, declared.normal.dot(plane.seen->normal)));
    plane.distance = (plane.seen->point - declared.point).norm();
  }
  return planes;
}

std::vector<Segmentation> survey_scenes(const Capture& capture) {
  std::vector<Segmentation> scenes;
  if (capture.scene.object.surface) return scenes;
  for (const DepthCamera& camera : capture.depth)
    if (capture.frame_count() > 0)
      scenes.push_back(segment(read_depth(capture, camera, 0), camera.camera, DepthNoise(camera, 1.0)));
  return scenes;
}

std::vector<CloudScene> survey_clouds(const Capture& capture) {
  constexpr double least_share = 0.2;
  std::vector<CloudScene> scenes;
  if (capture.scene.object.surface || capture.frame_count() == 0) return scenes;
  for (const CloudSequence& cloud : capture.clouds) {
    const auto points = read_points(capture.folder / cloud.points(0));
    CloudScene& scene = scenes.emplace_back();
    scene.points = int(points.size());
    for (const Vector3& point : points) scene.box.extend(point);
    const std::vector<float> noise(points.size(), float(cloud.noise.value_or(0.002)));
    scene.plane = fit_plane(points, noise);
    if (scene.plane && scene.plane->inliers < least_share * scene.points) scene.plane.reset();
  }
  return scenes;
}

// The greatest way over all frames, of the frame's median marker.
double median_travel(const MarkerSet& markers) {
  double travel = 0.0;
  Points first = Points::Constant(markers.rest.rows(), 3, std::nan(""));
  for (int f = 0; f < int(markers.frames.size()); ++f) {
    const Points& frame = markers.frames[std::size_t(f)];
    std::vector<double> ways;
    for (int i = 0; i < markers.marker_count(); ++i) {
      if (!markers.is_seen(f, i)) continue;
      if (std::isnan(first(i, 0))) first.row(i) = frame.row(i);
      ways.push_back((frame.row(i) - first.row(i)).norm());
    }
    travel = std::max(travel, median(std::move(ways)));
  }
  return travel;
}

MarkerSurvey survey_markers(const MarkerSet& markers) {
  MarkerSurvey result;
  result.markers = markers.marker_count();
  result.frames = int(markers.frames.size());
  std::vector<int> sightings(markers.ids.size(), 0);
  for (int f = 0; f < result.frames; ++f) {
    int seen = 0;
    for (int i = 0; i < result.markers; ++i)
      if (markers.is_seen(f, i)) ++seen, ++sightings[std::size_t(i)];
    if (seen == 0) result.empty_frames.push_back(f);
    result.missing += result.markers - seen;
  }
  result.missing /= std::max(1.0, double(result.markers) * result.frames);
  for (std::size_t i = 0; i < sightings.size(); ++i)
    if (sightings[i] == 0) result.never_seen.push_back(markers.ids[i]);
  result.left_out = markers.left_out;
  result.noise = track_noise(markers);
  result.travel = median_travel(markers);
  result.frame_rate = markers.frame_rate;
  return result;
}

std::optional<MarkerSurvey> survey_loaded_markers(const Capture& capture) {
  std::vector<MarkerSet> sets;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < capture.presses.size(); ++i) {
    sets.push_back(read_marker_pair(capture.presses[i].markers_rest, capture.presses[i].markers));
    names.push_back("press " + std::to_string(i + 1));
  }
  for (std::size_t i = 0; i < capture.loads.size(); ++i)
    if (const Load& load = capture.loads[i]; load.markers && load.markers_rest) {
      sets.push_back(read_marker_pair(*load.markers_rest, *load.markers));
      names.push_back("load " + std::to_string(i + 1));
    }
  if (sets.empty()) return std::nullopt;
  MarkerSurvey result;
  double positions = 0.0;
  for (std::size_t k = 0; k < sets.size(); ++k) {
    const MarkerSet& set = sets[k];
    for (const std::string& doubt : marker_doubts(set, true)) result.doubts.push_back(names[k] + ": " + doubt);
    result.markers = std::max(result.markers, set.marker_count());
    positions += set.marker_count();
    std::vector<double> ways;
    for (int i = 0; i < set.marker_count(); ++i)
      if (set.is_seen(0, i)) ways.push_back((set.frames[0].row(i) - set.rest.row(i)).norm());
    result.missing += double(set.marker_count()) - double(ways.size());
    if (!ways.empty()) result.travel = std::max(result.travel, *std::ranges::max_element(ways));
  }
  result.missing /= positions;
  result.frames = int(sets.size());
  return result;
}

// Whether a marker is at the plane, or the seen ones have come nearer to it by the object's clearance at rest.
bool touches(const MarkerSet& markers, int frame, const Plane& plane, double start, double gap) {
  double way = 0.0, lowest = 1e300;
  int seen = 0;
  for (int i = 0; i < markers.marker_count(); ++i) {
    if (!markers.is_seen(frame, i)) continue;
    const Vector3 now = markers.frames[std::size_t(frame)].row(i), rest = markers.rest.row(i);
    lowest = std::min(lowest, plane.normal.dot(now - plane.point));
    way += plane.normal.dot(now - rest);
    ++seen;
  }
  return seen > 0 && (lowest < gap || start + way / seen < gap);
}

std::optional<int> first_contact(const Capture& capture, const MarkerSet& markers, double noise) {
  if (!capture.scene.object.surface || capture.scene.timing.is_static) return std::nullopt;
  const double gap =
      plane_reach * noise + contact_gap * bounding_box(*capture.scene.object.surface).extent().maxCoeff();
  for (int frame = capture.scene.timing.start_frame; frame < capture.frame_count(); ++frame)
    for (const Plane& plane : capture.scene.planes) {
      const double start = capture.scene.initial.released ? 1e300 : clearance(*capture.scene.object.surface, plane);
      if (touches(markers, frame, plane, start, gap)) return frame;
    }
  return std::nullopt;
}

void add_markers(const Capture& capture, Survey& result) {
  for (const MarkerTrack& files : capture.markers) {
    const MarkerSet markers = read_markers(files, capture.frame_count());
    MarkerSurvey own = survey_markers(markers);
    own.doubts = marker_doubts(markers, !capture.scene.initial.released && capture.scene.timing.start_frame == 0);
    const double noise = own.noise.value_or(0.0);
    result.moves = result.moves || (!capture.scene.timing.is_static && own.travel > moving_markers * noise);
    if (const auto contact = first_contact(capture, markers, noise))
      result.first_contact = std::min(result.first_contact.value_or(*contact), *contact);
    result.markers.push_back(std::move(own));
  }
  result.loaded_markers = survey_loaded_markers(capture);
}

/// The outline's middle in each frame that shows one whole, where the object is at rest before the camera [m].
std::vector<std::pair<int, Vector3>> outline_path(const Capture& capture, std::span<const ObservedFrame> frames,
                                                  int index) {
  const Box box = bounding_box(*capture.scene.object.surface);
  std::vector<std::pair<int, Vector3>> path;
  for (const ObservedFrame& frame : frames)
    for (const ObservedOutline& seen : frame.outlines) {
      if (seen.camera != index || seen.outline.points.empty() || seen.outline.is_cut) continue;
      PinholeCamera straight = capture.silhouettes[std::size_t(index)].at(frame.frame);
      straight.lens = {};
      Vector2 middle = Vector2::Zero();
      for (const Vector2& point : seen.outline.points) middle += point / double(seen.outline.points.size());
      const double depth = straight.project(0.5 * (box.min + box.max)).z();
      path.emplace_back(frame.frame, straight.unproject(middle.x(), middle.y(), depth));
    }
  return path;
}

/// By when an outline's middle has come nearer to a plane by the object's clearance at rest. Where no frame before the
/// motion shows the outline whole, it set out from the scan's middle.
std::optional<int> first_contact(const Capture& capture, const std::vector<std::pair<int, Vector3>>& path,
                                 double noise) {
  if (capture.scene.timing.is_static || capture.scene.initial.released || path.empty()) return std::nullopt;
  const Box box = bounding_box(*capture.scene.object.surface);
  const double gap = plane_reach * noise + contact_gap * box.extent().maxCoeff();
  const bool is_seen_before = path.front().first <= capture.scene.timing.start_frame;
  const Vector3 start = is_seen_before ? path.front().second : Vector3(0.5 * (box.min + box.max));
  for (const auto& [frame, middle] : path)
    for (const Plane& plane : capture.scene.planes)
      if (frame >= capture.scene.timing.start_frame &&
          clearance(*capture.scene.object.surface, plane) + plane.normal.dot(middle - start) < gap)
        return frame;
  return std::nullopt;
}

void add_outlines(const Capture& capture, std::span<const ObservedFrame> frames, Survey& result) {
  if (!capture.scene.object.surface) return;
  for (int c = 0; c < int(capture.silhouettes.size()); ++c) {
    OutlineSurvey& own = result.outlines.emplace_back();
    const SilhouetteCamera& camera = capture.silhouettes[std::size_t(c)];
    own.noise = camera.outline_std * pixel_size(capture, camera, 0);
    std::vector<std::pair<int, int>> counts;
    for (const ObservedFrame& frame : frames)
      for (const ObservedOutline& seen : frame.outlines) {
        if (seen.camera != c) continue;
        counts.emplace_back(frame.frame, int(seen.outline.points.size()));
        if (seen.outline.is_cut) own.cut_frames.push_back(frame.frame);
      }
    own.points = count_points(counts);
    const auto path = outline_path(capture, frames, c);
    for (const auto& [frame, middle] : path) own.travel = std::max(own.travel, (middle - path.front().second).norm());
    result.moves = result.moves || (!capture.scene.timing.is_static && own.travel > moving * own.noise);
    if (const auto contact = first_contact(capture, path, own.noise))
      result.first_contact = std::min(result.first_contact.value_or(*contact), *contact);
  }
}

std::vector<int> repeated_images(const Capture& capture, const DepthCamera& camera) {
  std::vector<int> repeated;
  std::string before;
  for (int frame = 0; frame < capture.frame_count(); frame += camera.every) {
    if (frame < capture.scene.timing.start_frame) continue;
    std::string now = read_file(capture.folder / camera.images(frame));
    if (now == before) repeated.push_back(frame);
    before = std::move(now);
  }
  return repeated;
}

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", 1e3 * metres);
  return text;
}

bool has_forces_to_fit(const Capture& capture) {
  const auto is_fit = [](const auto& item) { return item.role == "fit"; };
  const auto has_force = [&](const Grip& grip) { return is_fit(grip) && grip.force; };
  return std::ranges::any_of(capture.presses, is_fit) || std::ranges::any_of(capture.loads, is_fit) ||
         std::ranges::any_of(capture.indentations, is_fit) || std::ranges::any_of(capture.grips, has_force) ||
         std::ranges::any_of(capture.material_curves, is_fit);
}

/// What fixes the absolute scale of stiffness; empty: nothing.
std::string source_of_scale(const Capture& capture) {
  if (has_forces_to_fit(capture)) return "measured forces or stresses";
  if (capture.scene.initial.release_of) return "the weight from which the object is released";
  if (capture.scene.object.mass) return "the mass";
  return capture.scene.object.density ? "the density" : "";
}

void add_missing_scale(const Capture& capture, Identifiability& result) {
  if (source_of_scale(capture).empty())
    result.impossible.push_back(
        "The absolute scale of stiffness is not identifiable: neither mass, density nor a force is known. Only the "
        "ratio E/rho of stiffness to density can be estimated; weigh the object and write `mass`.");
}

void add_scale(const Capture& capture, Identifiability& result) {
  if (const std::string source = source_of_scale(capture); !source.empty())
    result.possible.push_back("The absolute scale of stiffness follows from " + source + ".");
  add_missing_scale(capture, result);
}

void add_stiffness(const Capture& capture, const Survey& seen, Identifiability& result) {
  const bool is_held = capture.scene.is_held(), touches = seen.first_contact || !capture.scene.obstacles.empty();
  const bool has_forces = has_forces_to_fit(capture);
  if (has_forces)
    result.possible.push_back("Stiffness, and Poisson's ratio to some degree: from shapes under known forces.");
  if (capture.scene.timing.times.empty()) return;
  if (capture.scene.timing.is_static) {
    result.possible.push_back(
        is_held ? "Stiffness: from how far the held object sags under gravity."
                : "Stiffness is identifiable if the support of the object is specified: it rests under gravity.");
  } else if (!seen.moves) {
    result.impossible.push_back(
        "The object does not move: neither stiffness nor damping is identifiable from its motion.");
  } else if (is_held || capture.scene.initial.released || touches) {
    result.possible.push_back(std::string("Stiffness: from ") +
                              (touches ? "the impact and the motion after it." : "the swinging of the held object."));
  } else if (!has_forces && !(has_silhouettes_alone(capture) && !capture.scene.planes.empty())) {
    result.impossible.push_back(
        "Stiffness is not identifiable: the object touches nothing and is not held, and in free fall nothing "
        "strains "
        "it.");
  }
}

void add_damping(const Capture& capture, const Survey& seen, Identifiability& result) {
  if (capture.scene.timing.times.empty())
    result.impossible.push_back("Damping is not identifiable: in static tests the object is at rest.");
  else if (capture.scene.timing.is_static)
    result.impossible.push_back("Damping is not identifiable: the object is at rest in every frame (`static = true`).");
  else if (seen.moves && (capture.scene.is_held() || capture.scene.initial.released || seen.first_contact))
    result.possible.push_back("Damping: from how the motion dies out.");
}

void add_surroundings(const Capture& capture, const Survey& seen, Identifiability& result) {
  if (!capture.scene.world.gravity)
    result.possible.push_back("Gravity is unknown and has to be estimated from the motion.");
  if (!capture.scene.initial.known)
    result.possible.push_back("The velocity at the start has to be estimated from the first frames.");
  if (capture.scene.object.shape_is == ShapeIs::Static)
    result.possible.push_back(
        "The stress-free reference shape is unknown (`shape_is = \"static\"`) and is estimated along (inverse "
        "elastostatics).");
  for (std::size_t i = 0; i < capture.scene.regions.size(); ++i)
    result.possible.push_back("Region \"" + capture.scene.regions[i].name + "\" can have a stiffness of its own.");
  if (!capture.scene.controls.empty())
    result.possible.push_back("Young's modulus blends from " + std::to_string(capture.scene.controls.size()) +
                              " control points.");
  for (std::size_t i = 0; i < capture.scene.planes.size(); ++i) {
    const std::string name = "Plane " + std::to_string(i + 1);
    if (seen.planes[i].seen && !capture.scene.planes[i].known)
      result.possible.push_back(name + " is only roughly known; the cameras see it (" +
                                millimetres(seen.planes[i].seen->rms) + " rms), and its place is taken from there.");
    else if (!capture.scene.planes[i].known)
      result.possible.push_back(
          name + " is only roughly known and no camera sees it: it has to be estimated from the impact.");
  }
}

}  // namespace

Survey survey(const Capture& capture, std::span<const ObservedFrame> frames) {
  Survey result;
  for (const DepthCamera& camera : capture.depth) result.repeated_images.push_back(repeated_images(capture, camera));
  std::vector<std::pair<int, int>> counts;
  for (const ObservedFrame& frame : frames) counts.emplace_back(frame.frame, int(frame.points.size()));
  result.points = count_points(counts);
  result.median_noise = median_noise(frames);
  result.travel = greatest_travel(frames);
  result.moves = !capture.scene.timing.is_static && result.travel > moving * result.median_noise;
  result.planes = survey_planes(capture);
  result.first_contact = first_contact(capture, frames, result.median_noise, result.planes);
  result.seen_share = seen_share(capture, frames, result.median_noise);
  result.scenes = survey_scenes(capture);
  result.clouds = survey_clouds(capture);
  add_outlines(capture, frames, result);
  add_markers(capture, result);
  return result;
}

Identifiability identifiability(const Capture& capture, const Survey& seen) {
  Identifiability result;
  const bool has_curves = std::ranges::any_of(capture.material_curves, [](const auto& c) { return c.role == "fit"; });
  if (has_curves && !capture.scene.object.surface) {
    result.possible.push_back("Stiffness: from stress-strain curves of the material.");
    add_scale(capture, result);
    return result;
  }
  if (!capture.scene.object.surface) {
    result.impossible.push_back(
        "Nothing can be fitted: there is no scan of the object at rest. Scan it all around and write `[object] "
        "surface`.");
    if (!seen.scenes.empty())
      result.possible.push_back("The seen side of the scene can be split into planes and objects.");
    if (!seen.clouds.empty()) result.possible.push_back("The points can be looked at and measured.");
    add_missing_scale(capture, result);
    return result;
  }
  add_stiffness(capture, seen, result);
  add_scale(capture, result);
  add_damping(capture, seen, result);
  if (has_silhouettes_alone(capture))
    result.possible.push_back(
        "Silhouettes are all that is seen: scan, scale and gravity are taken as known, and of planes that are only "
        "roughly known nothing but the impact tells.");
  add_surroundings(capture, seen, result);
  return result;
}

}  // namespace pliant
