#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "scan/scan_pose.hpp"

namespace pliant {

namespace {

/// The parabola of least squares through places at instants, three at least.
struct Parabola {
  Matrix3 coefficients;  // rows: place, velocity and acceleration at time 0
  Vector3 std;           // of a coordinate of each of them

  Parabola(const std::vector<double>& times, const std::vector<Vector3>& places) {
    const auto count = Eigen::Index(times.size());
    MatrixX A(count, 3), b(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
      A.row(i) = row(times[std::size_t(i)]);
      b.row(i) = places[std::size_t(i)].transpose();
    }
    coefficients = A.householderQr().solve(b);
    const double squares = (A * coefficients - b).squaredNorm() / (3.0 * double(std::max<Eigen::Index>(count - 3, 1)));
    std = (squares * Matrix3((A.transpose() * A).inverse()).diagonal()).cwiseSqrt();
  }
  static Eigen::RowVector3d row(double t) { return {1.0, t, 0.5 * t * t}; }
  Vector3 at(double t) const { return (row(t) * coefficients).transpose(); }
};

double least_height(const TriangleMesh& scan, const RigidMotion& pose, const std::vector<Plane>& planes) {
  double least = infinite;
  for (const Plane& plane : planes)
    for (const Vector3& v : scan.vertices) least = std::min(least, plane.normal.dot(pose(v) - plane.point));
  return least;
}

}  // namespace

std::optional<Flight> free_flight(const Capture& capture, std::span<const ObservedFrame> frames) {
  constexpr std::size_t fewest = 6;  // three of them are the parabola's own
  constexpr double near = 0.02;      // of the object's size
  const Scene& scene = capture.scene;
  if (!scene.object.surface || scene.timing.is_static || scene.initial.released || scene.is_held()) return std::nullopt;
  const ScanFollower follower(*scene.object.surface);
  const Vector3 centre = enclosed_centroid(follower.scan());
  const double close = near * bounding_box(follower.scan()).extent().maxCoeff();
  std::vector<Vector3> places;
  std::vector<double> times;
  RigidMotion before, last;
  for (const ObservedFrame& seen : frames) {
    if (seen.frame < scene.timing.start_frame) continue;
    // It goes on as it did.
    const RigidMotion back = before.inverse();
    const RigidMotion guess = {last.rotation * back.rotation * last.rotation,
                               last.rotation * back(last.translation) + last.translation};
    const std::optional<RigidMotion> pose = follower.follow(seen.points, guess);
    if (!pose) break;
    const double t =
        scene.timing.times[std::size_t(seen.frame)] - scene.timing.times[std::size_t(scene.timing.start_frame)];
    const Vector3 place = (*pose)(centre);
    if (least_height(follower.scan(), *pose, scene.planes) < close) break;
    if (places.size() >= fewest && (Parabola(times, places).at(t) - place).norm() > close) break;
    times.push_back(t), places.push_back(place);
    before = times.size() == 1 ? *pose : last;
    last = *pose;
  }
  if (places.size() < fewest) return std::nullopt;
  const Parabola path(times, places);
  return Flight{int(places.size()), path.coefficients.row(1).transpose(), path.coefficients.row(2).transpose(),
                path.std[1], path.std[2]};
}

}  // namespace pliant
