#include "mismatch/outline_constraints.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <stdexcept>

#include "geometry/box_tree.hpp"
#include "geometry/subdivided.hpp"

namespace pliant {

namespace {

constexpr double agreement = 0.5;       // cosine between normals, and between a normal and the way across it
constexpr double beyond = 1.0;          // [pixels] outside the contour, where nothing may be seen
constexpr unsigned nearest = 8;         // points of the contour that are looked at more closely
constexpr int most_vertices = 200'000;  // of a surface that is split

/// Pixels that a projection covers, within a picture and half of its size around.
class Coverage {
 public:
  explicit Coverage(const PinholeCamera& camera)
      : left_(-camera.width / 2),
        top_(-camera.height / 2),
        width_(2 * camera.width),
        height_(2 * camera.height),
        covered_(std::size_t(width_) * std::size_t(height_), 0) {}

  bool contains(const Vector2& pixel) const {
    const Vector2 p = pixel - Vector2(left_, top_);
    return p.x() > -0.5 && p.y() > -0.5 && p.x() < width_ - 0.5 && p.y() < height_ - 0.5;
  }
  bool is_covered(const Vector2& pixel) const {
    return contains(pixel) && covered_[index(int(std::lround(pixel.y())), int(std::lround(pixel.x())))] != 0;
  }
  /// Covers the pixels whose middle lies in a triangle.
  void add(const Vector2& a, const Vector2& b, const Vector2& c) {
    const double low = std::min({a.y(), b.y(), c.y()}), high = std::max({a.y(), b.y(), c.y()});
    const int first = int(std::ceil(std::max(low, double(top_)))),
              last = int(std::floor(std::min(high, double(top_ + height_ - 1))));
    for (int v = first; v <= last; ++v) {
      double begin = 1e300, end = -1e300;
      const auto cross = [&](const Vector2& p, const Vector2& q) {
        if ((p.y() < v) == (q.y() < v) && p.y() != v && q.y() != v) return;
        const double t = p.y() == q.y() ? 0.0 : std::clamp((v - p.y()) / (q.y() - p.y()), 0.0, 1.0);
        const double u = p.x() + t * (q.x() - p.x());
        begin = std::min(begin, u), end = std::max(end, u);
      };
      cross(a, b), cross(b, c), cross(c, a);
      const int from = int(std::ceil(std::max(begin, double(left_)))),
                to = int(std::floor(std::min(end, double(left_ + width_ - 1))));
      for (int u = from; u <= to; ++u) covered_[index(v, u)] = 1;
    }
  }

 private:
  std::size_t index(int v, int u) const { return std::size_t(v - top_) * std::size_t(width_) + std::size_t(u - left_); }
  int left_, top_, width_, height_;
  std::vector<std::uint8_t> covered_;
};

/// The ray of a pixel, in the world's axes, of unit length.
Vector3 ray_of(const PinholeCamera& camera, const Vector2& pixel) {
  const Vector3 ray((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy, 1.0);
  return camera.camera_to_world.rotation * ray.normalized();
}

}  // namespace

OutlineObservation corrected(OutlineObservation outline, const SensorCorrection& correction) {
  for (OutlinePoint& point : outline.points) point.pixel -= correction.error() / outline.pixel * point.normal;
  RigidMotion& pose = outline.camera.camera_to_world;
  const Vector3 eye = pose.translation;
  pose.translation = correction.apply(eye, {});
  for (int k = 0; k < 3; ++k)
    pose.rotation.col(k) = correction.apply(eye + pose.rotation.col(k), {}) - pose.translation;
  return outline;
}

OutlineConstraints::OutlineConstraints(const Body& body, const TriangleMesh& surface, double spacing, double reach)
    : surface_(subdivided(surface, spacing, most_vertices)), embedding_(body, surface_.vertices), reach_(reach) {
  if (!(spacing > 0.0 && reach > 0.0)) throw std::invalid_argument("outlines need edges of some length, and a reach");
  std::map<std::array<int, 2>, int> numbers;
  for (int t = 0; t < int(surface_.triangles.size()); ++t)
    for (int k = 0; k < 3; ++k) {
      std::array<int, 2> ends = {surface_.triangles[std::size_t(t)][std::size_t(k)],
                                 surface_.triangles[std::size_t(t)][std::size_t(k + 1) % 3]};
      std::ranges::sort(ends);
      const auto [entry, is_new] = numbers.try_emplace(ends, int(edges_.size()));
      if (is_new)
        edges_.push_back({ends, {t, -1}});
      else
        edges_[std::size_t(entry->second)].triangles[1] = t;
    }
  std::erase_if(edges_, [](const Edge& edge) { return edge.triangles[1] < 0; });
}

std::vector<OutlineConstraints::ContourPoint> OutlineConstraints::outer_contour(
    const PinholeCamera& camera, const std::vector<Vector3>& vertices) const {
  std::vector<Vector3> projected;
  for (const Vector3& vertex : vertices) projected.push_back(camera.project(vertex));
  const auto pixel = [&](int v) -> Vector2 { return projected[std::size_t(v)].head<2>(); };
  Coverage coverage(camera);
  std::vector<int> faces(surface_.triangles.size());  // 1: it faces the camera, -1: it does not, 0: it is behind it
  for (std::size_t t = 0; t < faces.size(); ++t) {
    const auto& [a, b, c] = surface_.triangles[t];
    if (std::min({projected[std::size_t(a)].z(), projected[std::size_t(b)].z(), projected[std::size_t(c)].z()}) <= 0.0)
      continue;
    const Vector3& at = vertices[std::size_t(a)];
    const Vector3 normal = (vertices[std::size_t(b)] - at).cross(vertices[std::size_t(c)] - at);
    faces[t] = normal.dot(camera.camera_to_world.translation - at) > 0.0 ? 1 : -1;
    if (faces[t] > 0) coverage.add(pixel(a), pixel(b), pixel(c));
  }
  std::vector<ContourPoint> contour;
  for (int e = 0; e < int(edges_.size()); ++e) {
    const Edge& edge = edges_[std::size_t(e)];
    if (faces[std::size_t(edge.triangles[0])] * faces[std::size_t(edge.triangles[1])] >= 0) continue;
    const Vector2 from = pixel(edge.vertices[0]), along = pixel(edge.vertices[1]) - from;
    const double length = along.norm();
    if (!(length > 0.0)) continue;
    // Both triangles lie on the same side of the edge: the surface folds back there.
    Vector2 normal = Vector2(along.y(), -along.x()) / length;
    double side = 0.0;
    for (const int t : edge.triangles)
      for (const int v : surface_.triangles[std::size_t(t)]) side += normal.dot(pixel(v) - from);
    if (side > 0.0) normal = -normal;
    const int count = std::max(1, int(std::ceil(std::min(length, 1e4))));
    for (int i = 0; i < count; ++i) {
      const Vector2 at = from + (i + 0.5) / count * along;
      if (coverage.contains(at) && !coverage.is_covered(at + beyond * normal)) contour.push_back({at, normal, e});
    }
  }
  return contour;
}

std::vector<OutlineMatch> OutlineConstraints::match(const OutlineObservation& seen, const Points& positions) const {
  const PinholeCamera& camera = seen.camera;
  const RigidMotion& pose = camera.camera_to_world;
  if (camera.lens.bends()) throw std::invalid_argument("outlines are matched where a straight lens shows them");
  std::vector<Vector3> vertices(surface_.vertices.size());
  for (int v = 0; v < int(vertices.size()); ++v) vertices[std::size_t(v)] = embedding_.position(v, positions);
  const std::vector<ContourPoint> contour = outer_contour(camera, vertices);
  const auto in_picture = [](const Vector2& pixel) { return Vector3(pixel.x(), pixel.y(), 0.0); };
  const BoxTree tree = box_tree(contour.size(), [&](std::size_t i) {
    Box box;
    box.extend(in_picture(contour[i].pixel));
    return box;
  });
  std::vector<OutlineMatch> matches(seen.points.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const OutlinePoint& point = seen.points[i];
    const Vector3 ray = ray_of(camera, point.pixel);
    const Vector3 outwards = pose.rotation * Vector3(point.normal.x() * camera.fx, point.normal.y() * camera.fy, 0.0);
    const auto agrees = [&](const auto& entry) {
      return contour[std::size_t(entry.second)].normal.dot(point.normal) > agreement;
    };
    OutlineMatch& best = matches[i];
    double least = reach_;
    namespace index = boost::geometry::index;
    for (auto it =
             tree.qbegin(index::nearest(tree_point(in_picture(point.pixel)), nearest) && index::satisfies(agrees));
         it != tree.qend(); ++it) {
      // From the nearest place of the edge straight to the ray: both in the plane across the ray.
      const Edge& edge = edges_[std::size_t(contour[std::size_t(it->second)].edge)];
      const Vector3 a = vertices[std::size_t(edge.vertices[0])], along = vertices[std::size_t(edge.vertices[1])] - a;
      const Vector3 across = along - along.dot(ray) * ray, from_eye = a - pose.translation;
      const Vector3 offset = from_eye - from_eye.dot(ray) * ray;
      const double s = std::clamp(-offset.dot(across) / std::max(across.squaredNorm(), 1e-300), 0.0, 1.0);
      const Vector3 way = -(offset + s * across);
      const double length = way.norm();
      if (length >= least) continue;
      least = length;
      const Vector3 facing = (outwards - outwards.dot(ray) * ray).normalized();
      Vector3 normal = across.cross(ray);  // of the edge, in the plane across the ray
      normal = (normal.dot(facing) < 0.0 ? -1.0 : 1.0) * normal.normalized();
      const bool is_at_end = (s == 0.0 || s == 1.0) && length > 1e-9 * reach_;
      if (is_at_end) normal = (way.dot(facing) < 0.0 ? -1.0 : 1.0) / length * way;
      best.is_found = normal.allFinite() && normal.dot(facing) > agreement;
      best.distance = normal.dot(way);
      best.direction = -normal;
      best.vertices = edge.vertices, best.weights = {1.0 - s, s};
      best.seen = pose.rotation.transpose() * ((from_eye + s * along).dot(ray) * ray);
      best.outwards =
          best.seen.z() / seen.pixel * Vector3(point.normal.x() / camera.fx, point.normal.y() / camera.fy, 0.0);
    }
  }
  return matches;
}

MatrixX OutlineConstraints::tangents(const std::vector<OutlineMatch>& matches,
                                     std::span<const Points> d_positions) const {
  MatrixX change = MatrixX::Zero(Eigen::Index(matches.size()), Eigen::Index(d_positions.size()));
  for (Eigen::Index i = 0; i < change.rows(); ++i) {
    const OutlineMatch& m = matches[std::size_t(i)];
    if (!m.is_found) continue;
    for (Eigen::Index c = 0; c < change.cols(); ++c)
      for (std::size_t k = 0; k < 2; ++k)
        change(i, c) += m.weights[k] * m.direction.dot(embedding_.position(m.vertices[k], d_positions[std::size_t(c)]));
  }
  return change;
}

void OutlineConstraints::add_adjoint(const std::vector<OutlineMatch>& matches, const VectorX& distance_bar,
                                     Points& positions_bar) const {
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const OutlineMatch& m = matches[i];
    if (!m.is_found) continue;
    for (std::size_t k = 0; k < 2; ++k)
      embedding_.add_transpose(m.vertices[k], m.weights[k] * distance_bar[Eigen::Index(i)] * m.direction,
                               positions_bar);
  }
}

}  // namespace pliant
