#include "capture/cloud_kinds.hpp"

#include <algorithm>
#include <numbers>

#include "capture/isolated_points.hpp"
#include "capture/plane_fit.hpp"
#include "capture/point_cloud.hpp"

namespace pliant {

namespace {

// Of the difference of two points: clouds show a surface at other places each time.
constexpr double background_deviations = 3.0;
constexpr double of_spacing = 0.5;    // of the distance to the sixth neighbour: about one point's share of the surface
constexpr double least_share = 0.15;  // of a cloud's points, on a plane that counts
constexpr int most_planes = 3;

/// Whether most of the object at rest lies clear of a plane, so that what is cut off there is not the object.
bool leaves_object(const TriangleMesh& surface, const Plane& plane, double margin) {
  const auto clear = std::ranges::count_if(
      surface.vertices, [&](const Vector3& vertex) { return plane.normal.dot(vertex - plane.point) > margin; });
  return 2 * std::size_t(clear) >= surface.vertices.size();
}

}  // namespace

CloudSorter::CloudSorter(const Capture& capture, const CloudSequence* sequence, const ObserveOptions& options)
    : space_(capture, options), noise_(default_cloud_noise) {
  if (!sequence) return;
  noise_ = sequence->noise.value_or(default_cloud_noise);
  if (sequence->background) {
    const std::vector<Vector3> points = read_points(*sequence->background);
    background_.emplace(points);
    background_reach_ = std::max(background_deviations * std::numbers::sqrt2 * noise_,
                                 of_spacing * typical_spacing(points, *background_));
  } else {
    find_undeclared_planes(capture, *sequence);
  }
}

void CloudSorter::find_undeclared_planes(const Capture& capture, const CloudSequence& sequence) {
  const auto& surface = capture.scene.object.surface;
  const bool is_at_rest = !capture.scene.initial.released && !capture.scene.timing.is_static &&
                          capture.scene.object.shape_is == ShapeIs::Reference;
  if (!surface || !capture.scene.object.pose_is_known || !is_at_rest || capture.frame_count() == 0) return;
  std::vector<Vector3> rest = read_points(capture.folder / sequence.points(0));
  const std::size_t all = rest.size();
  const Box box = bounding_box(*surface);
  const Vector3 middle = 0.5 * (box.min + box.max);
  for (int i = 0; i < most_planes; ++i) {
    const auto fit = fit_plane(rest, std::vector<float>(rest.size(), float(noise_)));
    if (!fit || double(fit->inliers) < least_share * double(all)) return;
    const double side = fit->height(middle) < 0.0 ? -1.0 : 1.0;
    const Plane plane{fit->point, side * fit->normal, true};
    const auto is_on = [&](const Vector3& p) { return std::abs(fit->height(p)) < plane_reach * noise_; };
    std::vector<Vector3> on_plane;
    std::ranges::copy_if(rest, std::back_inserter(on_plane), is_on);
    std::erase_if(rest, is_on);
    if (leaves_object(*surface, plane, plane_reach * noise_))
      space_.take_undeclared(plane, on_plane, plane_reach * noise_);
  }
}

std::vector<Vector3> CloudSorter::sorted(std::vector<Vector3> points, CloudCounts& counts, double time) const {
  counts.read += int(points.size());
  counts.out_of_reach += int(std::erase_if(points, [&](const Vector3& p) { return !space_.is_within_reach(p); }));
  counts.on_plane += int(std::erase_if(points, [&](const Vector3& p) { return space_.is_on_plane(p, noise_); }));
  counts.on_plane +=
      int(std::erase_if(points, [&](const Vector3& p) { return space_.is_on_obstacle(p, noise_, time); }));
  if (background_)
    counts.background += int(std::erase_if(points, [&](const Vector3& p) {
      return background_->squared_distance(p, 1) < background_reach_ * background_reach_;
    }));
  const std::vector<bool> alone = isolated_points(points);
  std::vector<Vector3> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!alone[i]) kept.push_back(points[i]);
  counts.isolated += int(points.size() - kept.size());
  return kept;
}

}  // namespace pliant
