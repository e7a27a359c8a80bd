#include "scan/scan_pose.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "capture/depth_frame.hpp"
#include "meshing/mesh_distance.hpp"
#include "rays/ray_scene.hpp"

namespace pliant {

namespace {

constexpr int fewest_points = 50, followed_points = 150, compared_points = 3000;
constexpr double same_turn = 10.0 * std::numbers::pi / 180.0, other_turn = 25.0 * std::numbers::pi / 180.0;
constexpr int judged = 32, refined = 8;

/// From the world to the scan over its size, y = scale * rotation (p - middle) + place, about the points' middle.
struct Guess {
  Matrix3 rotation = Matrix3::Identity();
  Vector3 place = Vector3::Zero();  ///< of the points' middle, in the scan
  double scale = 1.0;               ///< sizes of the scan a metre
  double cost = infinite;
  Vector3 operator()(const Vector3& from_middle) const { return scale * (rotation * from_middle) + place; }
};

double angle_between(const Matrix3& a, const Matrix3& b) {
  return std::acos(std::clamp(0.5 * ((a.transpose() * b).trace() - 1.0), -1.0, 1.0));
}

/// Rotation k of n that lie evenly in all of them: a spiral over quaternions (Alexa 2022).
Matrix3 even_rotation(int k, int n) {
  constexpr double phi = std::numbers::sqrt2, psi = 1.533751168755204288;
  const double s = k + 0.5, r = std::sqrt(s / n), R = std::sqrt(1.0 - s / n);
  const double a = 2.0 * std::numbers::pi * s / phi, b = 2.0 * std::numbers::pi * s / psi;
  return Eigen::Quaterniond(R * std::cos(b), r * std::sin(a), r * std::cos(a), R * std::sin(b)).toRotationMatrix();
}

Matrix3 turned(const Vector3& turn) {
  const double angle = turn.norm();
  return angle > 0.0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Matrix3(Matrix3::Identity());
}

std::vector<Vector3> thinned(const std::vector<Vector3>& points, int most) {
  std::vector<Vector3> kept;
  const double every = std::max(1.0, double(points.size()) / most);
  for (double i = 0.0; i < double(points.size()); i += every) kept.push_back(points[std::size_t(i)]);
  return kept;
}

/// Gauss-Newton steps to the least of sum c^2 r^2 / (c^2 + r^2), r the points' distances in the scan.
/// @param about  the scale, which is found between half and 1.6 times that; 0: it stays
void follow(const SignedDistance& distance, Guess& guess, std::span<const Vector3> points, double c, int steps,
            double about = 0.0) {
  const int unknowns = about > 0.0 ? 7 : 6;
  for (int step = 0; step < steps; ++step) {
    Eigen::Matrix<double, 7, 7> A = Eigen::Matrix<double, 7, 7>::Zero();
    Eigen::Matrix<double, 7, 1> b = Eigen::Matrix<double, 7, 1>::Zero(), row;
    for (const Vector3& p : points) {
      const Vector3 arm = guess.scale * (guess.rotation * p);
      const SignedDistance::Sample s = distance.sample(arm + guess.place);
      const double w = std::pow(c * c / (c * c + s.value * s.value), 2);
      row << arm.cross(s.gradient), s.gradient, s.gradient.dot(arm) - s.value;  // of distances in the world
      A += w * row * row.transpose(), b -= w * s.value * row;
    }
    // A little damping: along what nothing tells, such as a ball's turn, it stays.
    const double mean = A.topLeftCorner(unknowns, unknowns).trace() / unknowns;
    if (!(mean > 0.0)) return;
    for (int i = 0; i < unknowns; ++i) A(i, i) += 1e-4 * (A(i, i) + mean);
    const VectorX d = A.topLeftCorner(unknowns, unknowns).ldlt().solve(b.head(unknowns));
    guess.rotation = turned(d.head<3>()) * guess.rotation;
    guess.place += d.segment<3>(3);
    if (unknowns == 7)
      guess.scale = std::clamp(guess.scale * std::exp(std::clamp(d[6], -0.1, 0.1)), 0.5 * about, 1.6 * about);
    if (d.head<3>().norm() < 1e-6 && d.segment<3>(3).norm() < 1e-6) return;
  }
}

/// A depth camera's frame as it is compared with the scan: every so many pixels.
struct Look {
  PinholeCamera camera;       ///< of those pixels
  std::vector<float> object;  ///< depth of the object's points [m]; 0: none
  std::vector<float> all;     ///< of whatever is seen [m]; 0: no reading
};

class PoseSearch {
 public:
  PoseSearch(const TriangleMesh& scan, const Capture& capture, const ObservedFrame& seen,
             const ScanPoseOptions& options)
      : scan_(scan), options_(options) {
    if (scan.triangles.empty()) throw std::invalid_argument("a scan without triangles has no pose");
    if (seen.points.size() < fewest_points)
      throw InputError({{capture.file},
                        "frame " + std::to_string(seen.frame) + " shows " + std::to_string(seen.points.size()) +
                            " points of the object",
                        "50 at least",
                        "masks or a background tell the object's pixels; `pliant check` says what is seen"});
    unit_ = bounding_box(scan).extent().maxCoeff();
    for (Vector3& vertex : scan_.vertices) vertex /= unit_;
    distance_ = signed_distance(scan_, 1.0 / 64.0, 0.5);
    for (const Vector3& p : seen.points) middle_ += p / double(seen.points.size());
    std::vector<Vector3> from_middle;
    for (const Vector3& p : seen.points) from_middle.push_back(p - middle_);
    followed_ = thinned(from_middle, followed_points), compared_ = thinned(from_middle, compared_points);
    for (const Vector3& view : seen.view) to_sensor_ -= view;
    if (to_sensor_.norm() > 0.0) to_sensor_.normalize();
    for (const auto& t : scan_.triangles) {
      const Vector3 &a = scan_.vertices[std::size_t(t[0])], &b = scan_.vertices[std::size_t(t[1])],
                    &c = scan_.vertices[std::size_t(t[2])];
      faces_.push_back({(a + b + c) / 3.0, 0.5 * (b - a).cross(c - a)});
    }
    mesh_.add(scan_);
    about_ = options.finds_scale ? likely_scale() : 1.0 / unit_;
    for (std::size_t c = 0; c < capture.depth.size(); ++c) add_look(capture, seen, int(c));
    noise_ = 0.0;
    for (const float n : seen.noise) noise_ += double(n) / double(seen.noise.size());
  }

  ScanPose run() {
    std::vector<Guess> guesses = followed();
    keep_apart(guesses, judged);
    parallel_for(0, int(guesses.size()), [&](int i) { judge(guesses[std::size_t(i)]); });
    std::ranges::stable_sort(guesses, {}, &Guess::cost);
    guesses.resize(std::min<std::size_t>(guesses.size(), refined));
    parallel_for(0, int(guesses.size()), [&](int i) { refine(guesses[std::size_t(i)]); });
    std::ranges::stable_sort(guesses, {}, &Guess::cost);
    const Guess& best = guesses.front();
    ScanPose pose;
    pose.scale = 1.0 / (best.scale * unit_);
    // y = s R (p - m) + c is the scan over its size: p = R^T (y / s) + m - R^T c / s.
    pose.motion = {best.rotation.transpose(), middle_ - best.rotation.transpose() * best.place / best.scale};
    pose.points = int(compared_.size());
    std::vector<double> squares;
    for (const Vector3& p : compared_) squares.push_back(std::pow(distance_.value(best(p)) / best.scale, 2));
    std::ranges::sort(squares);
    const std::size_t most = squares.size() * 9 / 10;
    for (std::size_t i = 0; i < most; ++i) pose.rms += squares[i] / double(most);
    pose.rms = std::sqrt(pose.rms);
    pose.overlap = overlap(best);
    for (const Guess& other : guesses)
      if (angle_between(other.rotation, best.rotation) > other_turn) {
        pose.runner_up = other.cost / best.cost;
        break;
      }
    return pose;
  }

 private:
  struct Face {
    Vector3 middle, area;
  };

  void add_look(const Capture& capture, const ObservedFrame& seen, int c) {
    const DepthCamera& depth = capture.depth[std::size_t(c)];
    if (seen.frame % std::max(1, depth.every) != 0) return;
    const PinholeCamera lens = depth.at(seen.frame);
    const int width = depth.camera.width, height = depth.camera.height;
    std::vector<float> object(std::size_t(width) * std::size_t(height), 0.0f);
    int left = width, right = 0, top = height, bottom = 0;
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
      if (seen.camera[i] != c || seen.pixel[i] < 0) continue;
      object[std::size_t(seen.pixel[i])] = float(lens.project(seen.points[i]).z());
      const int u = seen.pixel[i] % width, v = seen.pixel[i] / width;
      left = std::min(left, u), right = std::max(right, u), top = std::min(top, v), bottom = std::max(bottom, v);
    }
    if (right <= left || bottom <= top) return;
    constexpr int across = 60;  // pixels over the object
    const int step = std::max(1, std::max(right - left, bottom - top) / across);
    const DepthImage raw = read_depth(capture, depth, seen.frame);
    Look look;
    look.camera = lens;
    look.camera.width = (width - 1) / step + 1, look.camera.height = (height - 1) / step + 1;
    look.camera.fx /= step, look.camera.fy /= step, look.camera.cx /= step, look.camera.cy /= step;
    for (int v = 0; v < look.camera.height; ++v)
      for (int u = 0; u < look.camera.width; ++u) {
        const auto at = std::size_t(v * step) * std::size_t(width) + std::size_t(u * step);
        look.object.push_back(object[at]), look.all.push_back(raw.pixels[at]);
      }
    looks_.push_back(std::move(look));
  }

  /// Where the middle of the seen points lies in the scan for a rotation: the middle of what faces the sensors.
  Vector3 facing_middle(const Matrix3& rotation) const {
    const Vector3 towards = rotation * to_sensor_;
    Vector3 sum = Vector3::Zero();
    double weight = 0.0;
    for (const Face& face : faces_) {
      const double w = to_sensor_.isZero() ? face.area.norm() : std::max(0.0, face.area.dot(towards));
      sum += w * face.middle, weight += w;
    }
    return weight > 0.0 ? Vector3(sum / weight) : Vector3(Vector3::Zero());
  }

  /// Sizes of the scan a metre with which the points fill about as much as a view of the scan does.
  double likely_scale() const {
    double extent = 0.0, own = 0.0, area = 0.0;
    for (const Vector3& p : followed_) extent += p.squaredNorm() / double(followed_.size());
    Vector3 middle = Vector3::Zero();
    for (const Face& f : faces_) middle += f.area.norm() * f.middle, area += f.area.norm();
    middle /= area;
    for (const Face& f : faces_) own += f.area.norm() * (f.middle - middle).squaredNorm() / area;
    return std::sqrt(own / extent);
  }

  void follow(Guess& guess, const std::vector<Vector3>& points, double c, int steps) const {
    pliant::follow(distance_, guess, points, c, steps, options_.finds_scale ? about_ : 0.0);
  }

  /// Mean of the points' squared distances over the object's size, cut off.
  double point_cost(const Guess& guess, const std::vector<Vector3>& points) const {
    double sum = 0.0;
    for (const Vector3& p : points)
      sum += std::pow(std::min(std::abs(distance_.value(guess(p))) * about_ / guess.scale, cut), 2);
    return sum / double(points.size());
  }

  std::vector<Guess> followed() const {
    const std::vector<double> scales = options_.finds_scale ? std::vector{0.7, 0.85, 1.0, 1.15} : std::vector{1.0};
    const int each = int(scales.size());
    std::vector<Guess> guesses(std::size_t(options_.rotations * each));
    parallel_for(0, int(guesses.size()), [&](int i) {
      Guess& guess = guesses[std::size_t(i)];
      guess.rotation = even_rotation(i / each, options_.rotations);
      guess.place = facing_middle(guess.rotation);
      guess.scale = about_ * scales[std::size_t(i % each)];
      for (const double c : {0.2, 0.06}) follow(guess, followed_, c, 6);
      guess.cost = point_cost(guess, followed_);
      if (!std::isfinite(guess.cost)) guess.cost = infinite;
    });
    return guesses;
  }

  /// The best that differ from each other.
  void keep_apart(std::vector<Guess>& guesses, int most) const {
    std::ranges::stable_sort(guesses, {}, &Guess::cost);
    std::vector<Guess> kept;
    for (const Guess& guess : guesses) {
      if (int(kept.size()) == most) break;
      const bool is_new = std::ranges::none_of(kept, [&](const Guess& other) {
        return angle_between(guess.rotation, other.rotation) < same_turn && (guess.place - other.place).norm() < 0.1;
      });
      if (is_new && guess.cost < infinite) kept.push_back(guess);
    }
    guesses = std::move(kept);
  }

  DepthRender seen_by(const Look& look, const Guess& guess) const {
    PinholeCamera in_scan = look.camera;  // whose depths are in the scan's unit
    const RigidMotion& at = look.camera.camera_to_world;
    in_scan.camera_to_world = {guess.rotation * at.rotation, guess(at.translation - middle_)};
    return mesh_.render_depth(in_scan);
  }

  /// Squared differences between what cameras saw and would have seen, over the scan's size, cut off, one a pixel that
  /// either shows the object in.
  double look_cost(const Guess& guess) const {
    double sum = 0.0, count = 0.0;
    const double cut2 = cut * cut;
    for (const Look& look : looks_) {
      const DepthRender render = seen_by(look, guess);
      for (std::size_t i = 0; i < look.object.size(); ++i) {
        const double scan = double(render.depth[i]) / guess.scale, object = double(look.object[i]),
                     any = double(look.all[i]);
        // A reading beside the scan may be of an edge of the object that was left out.
        const bool is_seen_past = scan > 0.0 && any > scan + cut / about_;
        if (scan > 0.0 && object > 0.0) {
          sum += std::pow(std::min(std::abs(scan - object) * about_, cut), 2), count += 1.0;
        } else if (object > 0.0 || is_seen_past) {
          sum += cut2, count += 1.0;
        } else if (scan > 0.0 && any <= 0.0) {
          sum += 0.1 * cut2, count += 0.1;
        }
      }
    }
    return count > 0.0 ? sum / count : 0.0;
  }

  double overlap(const Guess& guess) const {
    double both = 0.0, either = 0.0;
    for (const Look& look : looks_) {
      const DepthRender render = seen_by(look, guess);
      for (std::size_t i = 0; i < look.object.size(); ++i) {
        const bool scan = render.depth[i] > 0.0f, object = look.object[i] > 0.0f;
        both += scan && object, either += scan || object;
      }
    }
    return either > 0.0 ? both / either : 1.0;
  }

  void judge(Guess& guess) const { guess.cost = point_cost(guess, compared_) + look_cost(guess); }

  /// Outlines tell what points beside the surface do not: moved along each coordinate as long as the cost falls, then
  /// to the least squares of the points again.
  void refine(Guess& guess) const {
    for (const double c : {0.03, 0.01}) follow(guess, compared_, c, 10);
    judge(guess);
    const int unknowns = looks_.empty() ? 0 : options_.finds_scale ? 7 : 6;
    for (double step = 0.03; step > 1e-3; step *= 0.5)
      for (bool is_better = true; is_better;) {
        is_better = false;
        for (int i = 0; i < unknowns; ++i)
          for (const double sign : {-1.0, 1.0}) {
            Guess next = guess;
            if (i < 3) next.rotation = turned(sign * step * Vector3::Unit(i)) * guess.rotation;
            if (i >= 3 && i < 6) next.place += sign * step * Vector3::Unit(i - 3);
            if (i == 6) next.scale *= 1.0 + sign * step;
            judge(next);
            if (next.cost < guess.cost * (1.0 - 1e-3)) guess = next, is_better = true;
          }
      }
    Guess settled = guess;
    follow(settled, compared_, std::max(3.0 * noise_ * guess.scale, 4e-3), 15);
    judge(settled);
    if (settled.cost <= 1.05 * guess.cost) guess = settled;
  }

  static constexpr double cut = 0.06;  // of differences, over the scan's size
  TriangleMesh scan_;                  // over its size
  ScanPoseOptions options_;
  double unit_ = 1.0, about_ = 1.0, noise_ = 0.0;  // [m], or what the scan is in; sizes of the scan a metre; [m]
  SignedDistance distance_;
  Vector3 middle_ = Vector3::Zero(), to_sensor_ = Vector3::Zero();
  std::vector<Vector3> followed_, compared_;
  std::vector<Face> faces_;
  RayScene mesh_;
  std::vector<Look> looks_;
};

}  // namespace

ScanFollower::ScanFollower(const TriangleMesh& scan)
    : scan_(scan),
      unit_(bounding_box(scan).extent().maxCoeff()),
      distance_(signed_distance(scan, unit_ / 64.0, 0.5 * unit_)) {}

std::optional<RigidMotion> ScanFollower::follow(const std::vector<Vector3>& seen, const RigidMotion& guess) const {
  if (seen.size() < fewest_points) return std::nullopt;
  const std::vector<Vector3> points = thinned(seen, compared_points / 4);
  Vector3 middle = Vector3::Zero();
  for (const Vector3& p : points) middle += p / double(points.size());
  std::vector<Vector3> from_middle;
  for (const Vector3& p : points) from_middle.push_back(p - middle);
  const RigidMotion to_scan = guess.inverse();
  Guess pose{to_scan.rotation, to_scan(middle)};
  for (const double c : {0.1, 0.03}) pliant::follow(distance_, pose, from_middle, c * unit_, 20);
  if (!pose.place.allFinite() || !pose.rotation.allFinite()) return std::nullopt;
  return RigidMotion{pose.rotation, pose.place - pose.rotation * middle}.inverse();
}

ScanPose find_scan_pose(const TriangleMesh& scan, const Capture& capture, const ObservedFrame& seen,
                        const ScanPoseOptions& options) {
  return PoseSearch(scan, capture, seen, options).run();
}

void place(Scene& scene, const ScanPose& pose) {
  const auto moved = [&](const Vector3& p) { return pose.motion(pose.scale * p); };
  const auto move_region = [&](Region& region) {
    if (std::holds_alternative<RegionBox>(region)) throw std::invalid_argument("a box cannot be turned");
    if (auto* sphere = std::get_if<RegionSphere>(&region))
      sphere->centre = moved(sphere->centre), sphere->radius *= pose.scale;
    if (auto* half = std::get_if<RegionHalfSpace>(&region))
      half->point = moved(half->point), half->normal = pose.motion.rotation * half->normal;
  };
  if (scene.object.surface) scene.object.surface = placed(*scene.object.surface, pose);
  for (FixedRegion& fixed : scene.fixed) move_region(fixed.region);
  for (LedRegion& led : scene.led) move_region(led.region);
  for (MaterialRegion& part : scene.regions) move_region(part.region);
  for (MaterialControl& control : scene.controls) control.point = moved(control.point);
  for (Weight& weight : scene.weights) weight.at = moved(weight.at);
  for (AppliedForce& force : scene.forces) force.at = moved(force.at);
  scene.object.pose_is_known = scene.object.scale_is_known = true;
}

std::vector<ObservedFrame> observe_placed(Capture& capture, const ObserveOptions& options,
                                          const std::function<void(int, int)>& progress,
                                          std::optional<ScanPose>* found) {
  std::vector<ObservedFrame> seen = observe(capture, options, progress);
  if (capture.scene.object.pose_is_known) return seen;
  const int start = capture.scene.timing.start_frame;
  const auto first = std::ranges::find_if(seen, [&](const ObservedFrame& f) { return f.frame >= start; });
  if (first == seen.end())
    throw InputError({{capture.file},
                      "no frame from " + std::to_string(start) + " on shows the object",
                      "a frame in which the scan can be placed",
                      "`pliant check` says what is seen"});
  ScanPoseOptions search;
  search.finds_scale = !capture.scene.object.scale_is_known;
  const ScanPose pose = find_scan_pose(*capture.scene.object.surface, capture, *first, search);
  place(capture.scene, pose);
  if (found) *found = pose;
  return seen;
}

TriangleMesh placed(const TriangleMesh& scan, const ScanPose& pose) {
  TriangleMesh mesh = scan;
  for (Vector3& vertex : mesh.vertices) vertex = pose.motion(pose.scale * vertex);
  return mesh;
}

}  // namespace pliant
