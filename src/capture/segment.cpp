#include "capture/segment.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "capture/depth_points.hpp"

namespace pliant {

namespace {

constexpr int no_reading = -1, unlabelled = -50;
constexpr double reach = 3.5;           // standard deviations between a plane and what stands on it
constexpr double touching = 0.02;       // [m] gap between an object's lowest point seen and the plane it stands on
constexpr double least_height = 0.015;  // [m] what is flatter is a stain, a sheet or a bump of the plane

int plane_label(std::size_t plane) { return -2 - int(plane); }

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
    for (std::size_t k = 0; k < left.points.size(); ++k)
      if (std::abs(plane->height(left.points[k])) < reach * std::max(double(left.noise[k]), plane->rms))
        label[std::size_t(left.pixel[k])] = plane_label(result.planes.size());
    result.planes.push_back(*plane);
  }
}

// Pixels connected with `seed` through unlabelled pixels without a depth jump.
std::vector<int> grow(const DepthImage& depth, const DepthNoise& noise, int seed, Image<int>& label, int value) {
  std::vector<int> members{seed};
  label.pixels[std::size_t(seed)] = value;
  for (std::size_t next = 0; next < members.size(); ++next) {
    const int u = members[next] % depth.width, v = members[next] / depth.width;
    for (const auto& [du, dv] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
      if (!depth.contains(u + du, v + dv) || label(u + du, v + dv) != unlabelled) continue;
      if (std::abs(depth(u + du, v + dv) - depth(u, v)) > noise.jump(depth(u, v))) continue;
      label(u + du, v + dv) = value;
      members.push_back((v + dv) * depth.width + u + du);
    }
  }
  return members;
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
    const auto members = grow(depth, noise, p, result.label, int(result.objects.size()));
    if (int(members.size()) >= options.least_pixels)
      result.objects.push_back(describe(members, depth, camera, result.planes));
    else
      for (const int member : members) result.label.pixels[std::size_t(member)] = Segmentation::small;
  }
  sort_objects(result);
  return result;
}

}  // namespace pliant
