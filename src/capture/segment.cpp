#include "capture/segment.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "capture/depth_points.hpp"

namespace pliant {

namespace {

constexpr int no_reading = -1, unlabelled = -50;
constexpr double standing_reach = 3.5;  // standard deviations between a plane and what stands on it
constexpr double touching = 0.02;       // [m] gap between an object's lowest point seen and the plane it stands on
constexpr double least_height = 0.015;  // [m] what is flatter is a stain, a sheet or a bump of the plane

int plane_label(std::size_t plane) { return -2 - int(plane); }

// Pixels connected with `seed` among those labelled `from`, up to `pixel_reach` pixels apart and without a jump in
// depth; they get the label `value`.
std::vector<int> grow(const DepthImage& depth, const DepthNoise& noise, int seed, Image<int>& label, int from,
                      int value, int pixel_reach, double gap) {
  std::vector<int> members{seed};
  label.pixels[std::size_t(seed)] = value;
  for (std::size_t next = 0; next < members.size(); ++next) {
    const int u = members[next] % depth.width, v = members[next] / depth.width;
    const double limit = std::max(gap, noise.jump(depth(u, v)));
    for (int dv = -pixel_reach; dv <= pixel_reach; ++dv)
      for (int du = -pixel_reach; du <= pixel_reach; ++du) {
        if (!depth.contains(u + du, v + dv) || label(u + du, v + dv) != from) continue;
        if (std::abs(depth(u + du, v + dv) - depth(u, v)) > limit) continue;
        label(u + du, v + dv) = value;
        members.push_back((v + dv) * depth.width + u + du);
      }
  }
  return members;
}

// A plane is what is connected: islands of less than a twentieth of its pixels are given back.
void keep_connected(const DepthImage& depth, const DepthNoise& noise, int own, Image<int>& label) {
  constexpr int visiting = -60;
  std::vector<std::vector<int>> parts;
  std::size_t total = 0;
  for (int p = 0; p < int(label.pixels.size()); ++p) {
    if (label.pixels[std::size_t(p)] != own) continue;
    parts.push_back(grow(depth, noise, p, label, own, visiting, 2, 0.0));
    total += parts.back().size();
  }
  for (const auto& part : parts)
    for (const int p : part) label.pixels[std::size_t(p)] = part.size() * 20 < total ? unlabelled : own;
}

// Removes large planes one after another; the readings on them get the plane's label.
void find_planes(const DepthImage& depth, const PinholeCamera& camera, const DepthNoise& noise,
                 const SegmentOptions& options, Segmentation& result) {
  auto& label = result.label.pixels;
  const auto readings = std::ranges::count_if(depth.pixels, [](float z) { return z > 0; });
  for (int i = 0; i < options.most_planes; ++i) {
    const DepthPoints left =
        points_of(depth, camera, noise, [&](int p) { return label[std::size_t(p)] == unlabelled; });
    auto plane = fit_plane(left.points, left.noise);
    if (!plane || plane->inliers < options.least_plane * double(readings)) return;
    if (plane->height(camera.camera_to_world.translation) < 0) plane->normal = -plane->normal;
    const int own = plane_label(result.planes.size());
    for (std::size_t k = 0; k < left.points.size(); ++k)
      if (std::abs(plane->height(left.points[k])) < standing_reach * double(left.noise[k]))
        label[std::size_t(left.pixel[k])] = own;
    keep_connected(depth, noise, own, result.label);
    const DepthPoints kept = points_of(depth, camera, noise, [&](int p) { return label[std::size_t(p)] == own; });
    PlaneFitOptions same_side;
    same_side.normal = plane->normal;
    result.planes.push_back(fit_plane(kept.points, kept.noise, same_side).value_or(*plane));
  }
}

SceneObject describe(const std::vector<int>& members, const DepthImage& depth, const PinholeCamera& camera,
                     const std::vector<PlaneFit>& planes) {
  SceneObject object;
  object.pixels = int(members.size());
  std::vector<Vector3> points;
  for (const int p : members) {
    const int u = p % depth.width, v = p / depth.width;
    points.push_back(camera.unproject(u, v, depth(u, v)));
    object.box.extend(points.back());
    object.centroid += points.back() / double(members.size());
  }
  Matrix3 moment = Matrix3::Zero();
  for (const Vector3& point : points) moment += (point - object.centroid) * (point - object.centroid).transpose();
  const Matrix3 axes = Eigen::SelfAdjointEigenSolver<Matrix3>(moment).eigenvectors();
  Box own;
  for (const Vector3& point : points) own.extend(axes.transpose() * point);
  object.extent = own.extent().reverse();
  if (planes.empty()) return object;
  double lowest = 1e300, highest = -1e300;
  for (const Vector3& point : points) {
    lowest = std::min(lowest, planes[0].height(point));
    highest = std::max(highest, planes[0].height(point));
  }
  object.height = highest;
  object.stands_on_plane = std::abs(lowest) < touching && highest > least_height;
  return object;
}

// Objects in falling order of size; labels follow.
void sort_objects(Segmentation& result) {
  std::vector<int> order(result.objects.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater{}, [&](int i) { return result.objects[std::size_t(i)].pixels; });
  std::vector<SceneObject> sorted;
  std::vector<int> rank(order.size());
  for (const int i : order) {
    rank[std::size_t(i)] = int(sorted.size());
    sorted.push_back(result.objects[std::size_t(i)]);
  }
  result.objects = std::move(sorted);
  for (int& label : result.label.pixels)
    if (label >= 0) label = rank[std::size_t(label)];
}

}  // namespace

Segmentation segment(const DepthImage& depth, const PinholeCamera& camera, const DepthNoise& noise,
                     const SegmentOptions& options) {
  Segmentation result;
  result.label = Image<int>(depth.width, depth.height, no_reading);
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u)
      if (depth(u, v) > 0) result.label(u, v) = unlabelled;
  find_planes(depth, camera, noise, options, result);
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u)
      if (result.label(u, v) == unlabelled && !is_supported(depth, u, v, noise.jump(depth(u, v))))
        result.label(u, v) = Segmentation::small;
  for (int p = 0; p < int(result.label.pixels.size()); ++p) {
    if (result.label.pixels[std::size_t(p)] != unlabelled) continue;
    const auto members = grow(depth, noise, p, result.label, unlabelled, int(result.objects.size()), 2, options.gap);
    if (int(members.size()) >= options.least_pixels)
      result.objects.push_back(describe(members, depth, camera, result.planes));
    else
      for (const int member : members) result.label.pixels[std::size_t(member)] = Segmentation::small;
  }
  sort_objects(result);
  return result;
}

}  // namespace pliant
