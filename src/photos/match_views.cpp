#include "photos/match_views.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/calib3d.hpp>
#include <set>
#include <stdexcept>

#include "base/median.hpp"

namespace pliant {

namespace {

constexpr double least_limit = 0.1;     // [pixels] no set is dropped for less
constexpr double clearly_worse = 2.5;   // times the rms of another
constexpr double usual_multiple = 5.0;  // of the median rms

// The point between the rays of the first two dots, by OpenCV's linear method in coordinates without camera matrix.
Vector3 first_guess(std::span<const LensCamera> cameras, std::span<const ViewDots> views,
                    const std::vector<int>& dots) {
  std::vector<int> seen;
  for (int c = 0; c < int(dots.size()); ++c)
    if (dots[std::size_t(c)] >= 0) seen.push_back(c);
  cv::Mat1d projections[2], points[2], homogeneous;
  for (int k = 0; k < 2; ++k) {
    const std::size_t c = std::size_t(k == 0 ? seen.front() : seen.back());
    const RigidMotion& pose = cameras[c].world_to_camera;
    projections[k].create(3, 4);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) projections[k](i, j) = pose.rotation(i, j);
      projections[k](i, 3) = pose.translation[i];
    }
    const Vector2& pixel = views[c].pixels[std::size_t(dots[c])];
    const Vector3 ray =
        cameras[c].camera_matrix.triangularView<Eigen::Upper>().solve(Vector3(pixel.x(), pixel.y(), 1.0));
    points[k].create(2, 1);
    points[k](0) = ray.x() / ray.z();
    points[k](1) = ray.y() / ray.z();
  }
  cv::triangulatePoints(projections[0], projections[1], points[0], points[1], homogeneous);
  return Vector3(homogeneous(0), homogeneous(1), homogeneous(2)) / homogeneous(3);
}

// Distance [pixels] of a dot in view b from the epipolar line of a dot in view a.
class EpipolarGeometry {
 public:
  EpipolarGeometry(const LensCamera& a, const LensCamera& b) {
    const RigidMotion& from = a.world_to_camera;
    const RigidMotion& to = b.world_to_camera;
    const Matrix3 turn = to.rotation * from.rotation.transpose();
    const Vector3 shift = to.translation - turn * from.translation;
    fundamental_ = b.camera_matrix.inverse().transpose() * cross_matrix(shift) * turn * a.camera_matrix.inverse();
  }
  double distance(const Vector2& in_a, const Vector2& in_b) const {
    const Vector3 line = fundamental_ * in_a.homogeneous();
    return std::abs(line.dot(in_b.homogeneous())) / line.head<2>().norm();
  }

 private:
  Matrix3 fundamental_;
};

class Matcher {
 public:
  Matcher(std::span<const LensCamera> cameras, std::span<const ViewDots> views, const MatchOptions& options)
      : cameras_(cameras), views_(views), options_(options) {}

  std::vector<Sighting> match() {
    const int n = int(cameras_.size());
    for (int a = 0; a < n; ++a)
      for (int b = a + 1; b < n; ++b) match_pair(a, b);
    return without_parts();
  }

 private:
  bool is_usable(int camera, int dot) const { return views_[std::size_t(camera)].pixels[std::size_t(dot)].allFinite(); }
  int dot_count(int camera) const { return int(views_[std::size_t(camera)].pixels.size()); }

  void match_pair(int a, int b) {
    const EpipolarGeometry geometry(cameras_[std::size_t(a)], cameras_[std::size_t(b)]);
    for (int i = 0; i < dot_count(a); ++i)
      for (int j = 0; is_usable(a, i) && j < dot_count(b); ++j) {
        if (!is_usable(b, j) || !(geometry.distance(pixel(a, i), pixel(b, j)) <= 2.0 * options_.tolerance)) continue;
        std::vector<int> dots(cameras_.size(), -1);
        dots[std::size_t(a)] = i;
        dots[std::size_t(b)] = j;
        const Sighting pair = triangulate(cameras_, views_, dots);
        if (!is_good(pair)) continue;
        extend(pair, 0, a, b);
      }
  }

  const Vector2& pixel(int camera, int dot) const { return views_[std::size_t(camera)].pixels[std::size_t(dot)]; }

  bool is_good(const Sighting& s) const {
    return s.greatest <= options_.tolerance && (!options_.is_possible || options_.is_possible(s.position));
  }

  // Adds dots of the cameras from `camera` on: each that agrees, or none where none does.
  void extend(const Sighting& sighting, int camera, int a, int b) {
    if (camera == int(cameras_.size())) {
      if (sighting.view_count() >= options_.least_views) found_.emplace(sighting.dots, sighting);
      return;
    }
    if (camera == a || camera == b) return extend(sighting, camera + 1, a, b);
    const Vector2 expected = project_without_lens(cameras_[std::size_t(camera)], sighting.position);
    bool any = false;
    for (int k = 0; k < dot_count(camera); ++k) {
      // A pair's own error can shift what it says of a third view: look farther, and judge all together.
      if (!is_usable(camera, k) || !((pixel(camera, k) - expected).norm() <= 4.0 * options_.tolerance)) continue;
      std::vector<int> dots = sighting.dots;
      dots[std::size_t(camera)] = k;
      const Sighting more = triangulate(cameras_, views_, dots);
      if (!is_good(more)) continue;
      any = true;
      extend(more, camera + 1, a, b);
    }
    if (!any) extend(sighting, camera + 1, a, b);
  }

  // A set whose dots all belong to a larger one says nothing more.
  std::vector<Sighting> without_parts() const {
    const auto is_part = [](const std::vector<int>& small, const std::vector<int>& large) {
      if (small == large) return false;
      for (std::size_t c = 0; c < small.size(); ++c)
        if (small[c] >= 0 && small[c] != large[c]) return false;
      return true;
    };
    std::vector<Sighting> out;
    for (const auto& [dots, sighting] : found_)
      if (sighting.view_count() == int(cameras_.size()) ||
          std::ranges::none_of(found_, [&](const auto& other) { return is_part(dots, other.first); }))
        out.push_back(sighting);
    return out;
  }

  std::span<const LensCamera> cameras_;
  std::span<const ViewDots> views_;
  const MatchOptions& options_;
  std::map<std::vector<int>, Sighting> found_;
};

bool share_a_dot(const Sighting& a, const Sighting& b) {
  for (std::size_t c = 0; c < a.dots.size(); ++c)
    if (a.dots[c] >= 0 && a.dots[c] == b.dots[c]) return true;
  return false;
}

ResolvedSightings resolve_below(const std::vector<Sighting>& all, double limit, double tolerance) {
  std::vector<int> open;
  for (int i = 0; i < int(all.size()); ++i)
    if (all[std::size_t(i)].rms <= limit) open.push_back(i);
  std::ranges::stable_sort(open, {}, [&](int i) { return all[std::size_t(i)].rms; });
  ResolvedSightings out;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t k = 0; k < open.size(); ++k) {
      const Sighting& own = all[std::size_t(open[k])];
      const bool is_clear = std::ranges::all_of(open, [&](int j) {
        const Sighting& other = all[std::size_t(j)];
        return j == open[k] || !share_a_dot(own, other) || own.view_count() > other.view_count() ||
               (own.view_count() == other.view_count() && other.rms > clearly_worse * own.rms &&
                other.rms > own.rms + tolerance / 3.0);
      });
      if (!is_clear) continue;
      out.sure.push_back(own);
      std::erase_if(open, [&](int j) { return share_a_dot(own, all[std::size_t(j)]); });
      changed = true;
      break;
    }
  }
  for (const int i : open) out.open.push_back(all[std::size_t(i)]);
  return out;
}

double median_rms(std::span<const Sighting> sightings) {
  std::vector<double> all;
  for (const Sighting& s : sightings) all.push_back(s.rms);
  return all.empty() ? infinite : median(std::move(all));
}

}  // namespace

int Sighting::view_count() const {
  return int(std::ranges::count_if(dots, [](int dot) { return dot >= 0; }));
}

Sighting triangulate(std::span<const LensCamera> cameras, std::span<const ViewDots> views, std::vector<int> dots) {
  constexpr int iterations = 6;
  Sighting out{std::move(dots), Vector3::Zero(), Matrix3::Zero(), infinite, infinite, infinite};
  out.position = first_guess(cameras, views, out.dots);
  if (!out.position.allFinite()) return out;
  Matrix3 normal = Matrix3::Zero();
  for (int iteration = 0; iteration < iterations; ++iteration) {
    Vector3 side = Vector3::Zero();
    double squares = 0.0, greatest = 0.0, chi = 0.0;
    normal.setZero();
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      if (out.dots[c] < 0) continue;
      if (!(cameras[c].world_to_camera(out.position).z() > 0)) return out;
      Eigen::Matrix<double, 2, 3> by_point;
      const Vector2 residual =
          views[c].pixels[std::size_t(out.dots[c])] - project_without_lens(cameras[c], out.position, &by_point);
      const double weight = 1.0 / std::pow(views[c].sigmas[std::size_t(out.dots[c])], 2);
      normal += weight * by_point.transpose() * by_point;
      side += weight * by_point.transpose() * residual;
      squares += residual.squaredNorm();
      chi += weight * residual.squaredNorm();
      greatest = std::max(greatest, residual.norm());
    }
    const Vector3 step = normal.ldlt().solve(side);
    if (!step.allFinite()) return out;
    if (iteration + 1 == iterations || step.norm() < 1e-12) {
      out.rms = std::sqrt(squares / out.view_count());
      out.greatest = greatest;
      out.chi_squared = chi;
      break;
    }
    out.position += step;
  }
  out.covariance = normal.inverse();
  return out;
}

std::vector<Sighting> possible_sightings(std::span<const LensCamera> cameras, std::span<const ViewDots> views,
                                         const MatchOptions& options) {
  if (cameras.size() != views.size() || cameras.size() < 2)
    throw std::invalid_argument("possible_sightings: one view a camera, and two at least");
  return Matcher(cameras, views, options).match();
}

ResolvedSightings resolve(std::vector<Sighting> sightings, double tolerance) {
  const ResolvedSightings first = resolve_below(sightings, tolerance, tolerance);
  const double limit = std::max(least_limit, usual_multiple * median_rms(first.sure));
  if (limit >= tolerance) return first;
  return resolve_below(sightings, limit, limit);
}

int ResolvedSightings::ambiguous_dots() const {
  std::set<std::pair<std::size_t, int>> left;
  for (const Sighting& sighting : open)
    for (std::size_t c = 0; c < sighting.dots.size(); ++c)
      if (sighting.dots[c] >= 0) left.emplace(c, sighting.dots[c]);
  return int(left.size());
}

double noise_factor(std::span<const Sighting> sightings) {
  double chi = 0.0;
  int freedom = 0;
  for (const Sighting& s : sightings) {
    chi += s.chi_squared;
    freedom += s.degrees_of_freedom();
  }
  return freedom > 0 ? std::max(1.0, std::sqrt(chi / freedom)) : 1.0;
}

}  // namespace pliant
