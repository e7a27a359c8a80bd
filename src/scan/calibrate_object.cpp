#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "capture/observe.hpp"
#include "geometry/whole_picture.hpp"
#include "meshing/mesh_distance.hpp"
#include "scan/calibrate.hpp"
#include "scan/lens_terms.hpp"

namespace pliant {

namespace {

constexpr int most_rest_points = 4000, fewest_rest_points = 200;
constexpr double independent_rest_points = 200.0;  // readings, at most: neighbours err together, and so does the scan
// Mean square of how far distances change, over that of a shift, or of a turn by as much at half the object's size:
// where it is less than (4.5 %)^2 the pose is open.
constexpr double least_told = 0.002;
constexpr double lens_told = 0.05;  // standard deviation of k1 that counts as found
constexpr double better_with_lens = 8.0;

using Pose8 = Eigen::Matrix<double, 8, 1>;

/// What one camera saw of the object at rest.
struct View {
  std::vector<Vector3> pixels;  ///< (u, v, depth)
  double noise = 0.0;           ///< [m], of a point
};

class ObjectCalibration {
 public:
  ObjectCalibration(const Capture& capture, const CalibrationOptions& options) : capture_(capture), options_(options) {
    const Object& object = capture.scene.object;
    if (!object.surface) fail("no scan of the object", "[object] with `surface`, or a ball (--ball)", "");
    if (!object.pose_is_known)
      fail("a scan whose pose is unknown", "a scan that stands where the object is at rest",
           "run `pliant place` first, or calibrate by a ball (--ball)");
    if (capture.scene.initial.released || object.shape_is == ShapeIs::Static)
      fail("an object that is seen in another shape than its scan", "frames of the object at rest as it was scanned",
           "calibrate by a ball (--ball)");
    if (capture.depth.empty()) fail("no depth camera", "[[depth]]", "");
    size_ = bounding_box(*object.surface).extent().maxCoeff();
    const Box box = bounding_box(*object.surface);
    middle_ = 0.5 * (box.min + box.max);
    distance_ = signed_distance(*object.surface, size_ / 80.0, 0.4 * size_);
    look();
  }

  std::vector<SensorCalibration> run() const {
    std::vector<SensorCalibration> all(views_.size());
    std::vector<std::string> open(views_.size());
    parallel_for(0, int(views_.size()),
                 [&](int c) { all[std::size_t(c)] = found(std::size_t(c), open[std::size_t(c)]); });
    for (std::size_t c = 0; c < open.size(); ++c)
      if (!open[c].empty())
        fail("what camera \"" + capture_.depth[c].name + "\" sees of the object leaves its pose open: " + open[c],
             "an object without such a symmetry, seen from where its shape tells",
             "move a ball about before the cameras, and calibrate by it (--ball)");
    return all;
  }

 private:
  [[noreturn]] void fail(const std::string& found, const std::string& expected, const std::string& advice) const {
    throw InputError({{capture_.file}, found, expected, advice});
  }

  void look() {
    Capture rest = capture_;
    Timing& timing = rest.scene.timing;
    const int last = options_.last_frame.value_or(timing.is_static ? timing.frame_count() - 1 : timing.start_frame);
    if (last < 0 || last >= timing.frame_count())
      fail("the last frame at rest is " + std::to_string(last), "0 to " + std::to_string(timing.frame_count() - 1), "");
    timing.times.resize(std::size_t(last) + 1);
    rest.clouds.clear();
    views_.resize(rest.depth.size());
    std::vector<double> squares(views_.size(), 0.0);
    for (const ObservedFrame& frame : observe(rest))
      for (std::size_t i = 0; i < frame.points.size(); ++i) {
        if (frame.camera[i] < 0) continue;
        const auto c = std::size_t(frame.camera[i]);
        const PinholeCamera& camera = rest.depth[c].camera;
        views_[c].pixels.emplace_back(frame.pixel[i] % camera.width, frame.pixel[i] / camera.width,
                                      camera.project(frame.points[i]).z());
        squares[c] += double(frame.noise[i]) * double(frame.noise[i]);
      }
    for (std::size_t c = 0; c < views_.size(); ++c) {
      View& view = views_[c];
      if (int(view.pixels.size()) < fewest_rest_points)
        fail("camera \"" + rest.depth[c].name + "\" shows " + std::to_string(view.pixels.size()) +
                 " points of the object at rest",
             std::to_string(fewest_rest_points) + " at least", "`pliant check` says what is seen");
      view.noise = std::sqrt(squares[c] / double(view.pixels.size()));
      const double every = std::max(1.0, double(view.pixels.size()) / most_rest_points);
      std::vector<Vector3> kept;
      for (double i = 0.0; i < double(view.pixels.size()); i += every) kept.push_back(view.pixels[std::size_t(i)]);
      view.pixels = std::move(kept);
    }
  }

  /// Normal equations of a view's distances at a pose and lens, by turn about the object's middle over its half size,
  /// shift, k1 and k2.
  struct Normal {
    Eigen::Matrix<double, 8, 8> A = Eigen::Matrix<double, 8, 8>::Zero();
    Pose8 b = Pose8::Zero();
    double cost = 0.0, weights = 0.0, squares = 0.0;
  };
  Normal normal(const View& view, const PinholeCamera& camera, double c, bool with_lens) const {
    Normal n;
    const double step = 1e-4, arm_length = 0.5 * size_;
    PinholeCamera more[2] = {camera, camera};
    for (int k = 0; k < 2 && with_lens; ++k) more[k].lens = changed_lens(camera.lens, step * Vector2::Unit(k));
    for (const Vector3& pixel : view.pixels) {
      const Vector3 p = camera.unproject(pixel.x(), pixel.y(), pixel.z());
      const SignedDistance::Sample s = distance_.sample(p);
      const double w = std::pow(c * c / (c * c + s.value * s.value), 2);
      Pose8 row = Pose8::Zero();
      row << (p - middle_).cross(s.gradient) / arm_length, s.gradient, 0.0, 0.0;
      for (int k = 0; k < 2 && with_lens; ++k)
        row[6 + k] = s.gradient.dot(more[k].unproject(pixel.x(), pixel.y(), pixel.z()) - p) / step;
      n.A += w * row * row.transpose(), n.b -= w * s.value * row;
      n.cost += w * s.value * s.value, n.weights += w;
    }
    return n;
  }

  PinholeCamera settled(const View& view, PinholeCamera camera, double c, int steps, bool with_lens) const {
    const int unknowns = with_lens ? 8 : 6;
    for (int i = 0; i < steps; ++i) {
      Normal n = normal(view, camera, c, with_lens);
      for (int k = 0; k < 2 && with_lens; ++k)  // a prior of 0.5
        n.A(6 + k, 6 + k) += view.noise * view.noise * n.weights / independent_rest_points / 0.25;
      const double little = 1e-6 * n.A.topLeftCorner<6, 6>().trace() / 6.0;
      for (int k = 0; k < 6; ++k) n.A(k, k) += little;
      const VectorX d = n.A.topLeftCorner(unknowns, unknowns).ldlt().solve(n.b.head(unknowns));
      if (!d.allFinite()) break;
      camera = moved(camera, d);
      if (with_lens) camera.lens = changed_lens(camera.lens, d.segment<2>(6));
      if (d.head<6>().norm() < 1e-8) break;
    }
    return camera;
  }

  PinholeCamera moved(PinholeCamera camera, const VectorX& d) const {
    const Vector3 turn = d.head<3>() / (0.5 * size_);
    Matrix3 R = Matrix3::Identity();
    if (turn.norm() > 0.0) R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    const RigidMotion was = camera.camera_to_world;
    camera.camera_to_world = {R * was.rotation, R * (was.translation - middle_) + middle_ + d.segment<3>(3)};
    return camera;
  }

  /// Of nine tenths of the distances.
  double rms(const View& view, const PinholeCamera& camera) const {
    std::vector<double> squares;
    for (const Vector3& pixel : view.pixels)
      squares.push_back(std::pow(distance_.value(camera.unproject(pixel.x(), pixel.y(), pixel.z())), 2));
    std::ranges::sort(squares);
    const std::size_t most = squares.size() * 9 / 10;
    double sum = 0.0;
    for (std::size_t i = 0; i < most; ++i) sum += squares[i] / double(most);
    return std::sqrt(sum);
  }

  SensorCalibration found(std::size_t c, std::string& open) const {
    const DepthCamera& depth = capture_.depth[c];
    const View& view = views_[c];
    SensorCalibration r;
    r.name = depth.name, r.lens = depth.camera.lens, r.time_offset = depth.time_offset;
    r.count = int(view.pixels.size()), r.rms_before = rms(view, depth.camera);
    PinholeCamera camera = depth.camera;
    for (const double scale : {0.2, 0.1, 0.05, 0.02}) camera = settled(view, camera, scale * size_, 15, false);
    const double last = std::max(3.0 * view.noise, 0.004 * size_);
    camera = settled(view, camera, last, 40, false);
    const Normal plain = normal(view, camera, last, false);
    open = open_direction(plain);
    if (options_.finds_lenses && open.empty()) try_lens(view, camera, last, plain, r);
    const Normal end = normal(view, camera, last, r.lens_is_found);
    r.lens = camera.lens, r.camera_to_world = camera.camera_to_world;
    const RigidMotion& was = depth.camera.camera_to_world;
    r.turned = Eigen::AngleAxisd(Matrix3(camera.camera_to_world.rotation * was.rotation.transpose())).angle();
    r.moved = (was(camera.camera_to_world.inverse()(middle_)) - middle_).norm();
    r.rms_after = rms(view, camera);
    const MatrixX covariance = covariance_of(end, r.lens_is_found ? 8 : 6);
    const auto worst = [&](int first) {
      const Matrix3 block = covariance.block<3, 3>(first, first);
      return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Matrix3>(block).eigenvalues()[2]));
    };
    r.turn_std = worst(0) / (0.5 * size_), r.shift_std = worst(3);
    if (r.lens_is_found) r.k1_std = std::sqrt(covariance(6, 6));
    return r;
  }

  /// With the errors that neighbouring readings have in common: as few count as may be independent_rest_points.
  static MatrixX covariance_of(const Normal& n, int unknowns) {
    const double variance = n.cost / std::max(1.0, n.weights),
                 repeats = std::max(1.0, n.weights / independent_rest_points);
    const MatrixX A = n.A.topLeftCorner(unknowns, unknowns) +
                      1e-9 * n.A.topLeftCorner<6, 6>().trace() * MatrixX::Identity(unknowns, unknowns);
    return variance * repeats * A.ldlt().solve(MatrixX::Identity(unknowns, unknowns));
  }

  void try_lens(const View& view, PinholeCamera& camera, double scale, const Normal& plain,
                SensorCalibration& r) const {
    const PinholeCamera bent = settled(view, camera, scale, 40, true);
    const Normal n = normal(view, bent, scale, true);
    const double share = independent_rest_points / std::max(independent_rest_points, n.weights);
    const double F = (plain.cost / plain.weights - n.cost / n.weights) / 2.0 /
                     (n.cost / n.weights / std::max(1.0, share * n.weights - 8.0));
    if (!(F > better_with_lens) || !(std::sqrt(covariance_of(n, 8)(6, 6)) < lens_told) || !sees_whole_picture(bent))
      return;
    camera = bent, r.lens_is_found = true;
  }

  std::string open_direction(const Normal& n) const {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(
        Eigen::Matrix<double, 6, 6>(n.A.topLeftCorner<6, 6>() / std::max(1e-300, n.weights)));
    if (eigen.eigenvalues()[0] > least_told) return "";
    const Eigen::Matrix<double, 6, 1> way = eigen.eigenvectors().col(0);
    const auto text = [](const Vector3& v) {
      const Vector3 u = v.normalized();
      char words[96];
      std::snprintf(words, sizeof words, "[%.2f, %.2f, %.2f]", u.x(), u.y(), u.z());
      return std::string(words);
    };
    return way.head<3>().norm() > way.tail<3>().norm()
               ? "turning it about the axis " + text(way.head<3>()) + " changes no distance"
               : "shifting it along " + text(way.tail<3>()) + " changes no distance";
  }

  const Capture& capture_;
  CalibrationOptions options_;
  double size_ = 0.0;
  Vector3 middle_;
  SignedDistance distance_;
  std::vector<View> views_;
};

}  // namespace

LensDistortion changed_lens(const LensDistortion& lens, const Vector2& change) {
  std::vector<double> coefficients = lens.coefficients();
  coefficients.resize(std::max<std::size_t>(5, coefficients.size()), 0.0);
  for (std::size_t k = 0; k < 2; ++k) coefficients[k] += change[Eigen::Index(k)];
  return LensDistortion(std::move(coefficients));
}

std::vector<SensorCalibration> calibrate_by_object(const Capture& capture, const CalibrationOptions& options) {
  require_standing_cameras(capture, "calibration");
  return ObjectCalibration(capture, options).run();
}

Capture with_calibration(Capture capture, const std::vector<SensorCalibration>& sensors) {
  PoseStd of_reference{0.0, 0.0};
  for (const SensorCalibration& sensor : sensors)
    for (const DepthCamera& depth : capture.depth)
      if (sensor.is_reference && sensor.name == depth.name) of_reference = depth.pose_std;
  for (const SensorCalibration& sensor : sensors) {
    const auto at = std::ranges::find(capture.depth, sensor.name, &DepthCamera::name);
    if (at == capture.depth.end())
      throw InputError({{capture.file},
                        "no depth camera \"" + sensor.name + "\"",
                        "the cameras that were calibrated, under the same names",
                        "name them alike in both recordings"});
    if (!at->moved.empty())
      throw InputError({{capture.file},
                        "camera \"" + sensor.name + "\" moves while it records",
                        "a stationary camera, whose pose can be replaced",
                        "leave --apply out"});
    at->camera.camera_to_world = sensor.camera_to_world;
    at->pose_std = {std::hypot(sensor.turn_std, of_reference.turn), std::hypot(sensor.shift_std, of_reference.shift)};
    at->camera.lens = sensor.lens;
    at->time_offset = sensor.time_offset;
  }
  return capture;
}

}  // namespace pliant
