#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/median.hpp"
#include "base/parallel.hpp"
#include "capture/capture_rules.hpp"
#include "geometry/whole_picture.hpp"
#include "scan/ball.hpp"
#include "scan/calibrate.hpp"
#include "scan/lens_terms.hpp"

namespace pliant {

namespace {

constexpr int fewest_ball_frames = 6;
constexpr double greatest_turn_std = 0.5 * 3.14159265358979 / 180.0;  // [rad] of a pose that counts as found
constexpr double tukey_scale = 4.685;
constexpr double better_with_lenses = 8.0;  // F of the lenses' two coefficients: beyond chance

/// One camera's sight of the ball in one frame, and how its centre changes with k1 and k2.
struct Sighting {
  double time;  ///< [s] of the frame
  BallSight sight;
  Vector3 centre;
  Eigen::Matrix<double, 3, 2> by_lens;
};

struct Sensor {
  const DepthCamera* depth = nullptr;
  std::vector<Sighting> seen;
};

/// What is estimated of one camera: x -> turn x + shift from its own axes, its clock, and k1 and k2.
struct State {
  RigidMotion pose;
  double offset = 0.0;
  Eigen::Vector2d lens = Eigen::Vector2d::Zero();  ///< beyond those that the capture has
};

/// Cubic through four centres of a path around a time; false where it is not between known ones.
class Path {
 public:
  Path(const std::vector<Sighting>& seen, double interval) : seen_(&seen), interval_(interval) {}

  struct Place {
    Vector3 position, velocity;
    std::array<std::size_t, 4> at;
    std::array<double, 4> weight;
  };
  template <class Centre>
  std::optional<Place> operator()(double time, const Centre& centre) const {
    const auto& s = *seen_;
    const auto next = std::ranges::upper_bound(s, time, {}, &Sighting::time);
    const std::ptrdiff_t i = next - s.begin();
    if (i < 1 || i >= std::ptrdiff_t(s.size()) || s[std::size_t(i)].time - s[std::size_t(i) - 1].time > 1.5 * interval_)
      return std::nullopt;
    // The two around it and one beyond each, where they are there.
    std::vector<std::size_t> nodes;
    for (std::ptrdiff_t k = i - 2; k <= i + 1; ++k)
      if (k >= 0 && k < std::ptrdiff_t(s.size()) && std::abs(s[std::size_t(k)].time - time) < 2.6 * interval_)
        nodes.push_back(std::size_t(k));
    Place place{Vector3::Zero(), Vector3::Zero(), {}, {}};
    for (std::size_t a = 0; a < nodes.size(); ++a) {  // Lagrange's polynomials, and their derivatives
      double w = 1.0, d = 0.0;
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        if (b == a) continue;
        const double span = s[nodes[a]].time - s[nodes[b]].time;
        d = (d * (time - s[nodes[b]].time) + w) / span;
        w *= (time - s[nodes[b]].time) / span;
      }
      place.position += w * centre(nodes[a]), place.velocity += d * centre(nodes[a]);
      place.at[a] = nodes[a], place.weight[a] = w;
    }
    for (std::size_t a = nodes.size(); a < 4; ++a) place.at[a] = nodes[0], place.weight[a] = 0.0;
    return place;
  }

 private:
  const std::vector<Sighting>* seen_;
  double interval_;
};

/// The rigid motion that takes points to others with least squares (Kabsch 1976).
RigidMotion kabsch(const std::vector<Vector3>& from, const std::vector<Vector3>& to) {
  Vector3 a = Vector3::Zero(), b = Vector3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) a += from[i] / double(from.size()), b += to[i] / double(from.size());
  Matrix3 H = Matrix3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) H += (from[i] - a) * (to[i] - b).transpose();
  const Eigen::JacobiSVD<Matrix3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3 sign(1, 1, (svd.matrixV() * svd.matrixU().transpose()).determinant() < 0 ? -1.0 : 1.0);
  const Matrix3 R = svd.matrixV() * sign.asDiagonal() * svd.matrixU().transpose();
  return {R, b - R * a};
}

Matrix3 rotation_by(const Vector3& turn) {
  return turn.norm() > 0.0 ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()
                           : Matrix3(Matrix3::Identity());
}

class BallCalibration {
 public:
  BallCalibration(const Capture& capture, double radius, const CalibrationOptions& options)
      : capture_(capture), options_(options), moves_(!capture.scene.timing.is_static) {
    if (capture.depth.size() < 2)
      fail(std::to_string(capture.depth.size()) + " depth cameras", "two at least", "one camera alone needs no others");
    look(radius);
    choose_reference();
    const auto& times = capture.scene.timing.times;
    interval_ = times.size() > 1 ? (times.back() - times.front()) / double(times.size() - 1) : 1.0;
  }

  std::vector<SensorCalibration> run() {
    for (std::size_t c = 0; c < sensors_.size(); ++c) states_.push_back(given(c));
    for (std::size_t c = 0; c < sensors_.size(); ++c) before_.push_back(rms(c, states_[c], states_[reference_]));
    for (std::size_t c = 0; c < sensors_.size(); ++c)
      if (c != reference_) states_[c] = first_guess(c);
    clock_is_known_.assign(sensors_.size(), !moves_);
    Solution plain = solve(false);
    if (settle_clocks(plain)) plain = solve(false);
    // Where the ball did not come near the picture's edges, k2 is a guess that may fold it back there: k1 alone then.
    for (const double k2_prior : {0.1, 0.003}) {
      if (!options_.finds_lenses || lenses_found_) break;
      k2_prior_ = k2_prior;
      try_lenses(plain);
    }
    return results(plain);
  }

 private:
  struct Solution {
    double cost = 0.0, rows = 0.0, unknowns = 0.0;
    double scale = 1.0;  ///< standard deviations of what a residual's noise says
    MatrixX covariance;
  };

  /// Takes k1 and k2 of all cameras along where that makes the centres agree better beyond chance.
  void try_lenses(Solution& plain) {
    const std::vector<State> without = states_;
    const Solution bent = solve(true);
    const double more = 2.0 * double(sensors_.size()), with = robust_cost(bent.scale);
    const bool are_whole = lenses_are_whole();
    std::vector<State> with_lenses = without;
    std::swap(with_lenses, states_);
    const double F = (robust_cost(bent.scale) - with) / more / (with / std::max(1.0, bent.rows - bent.unknowns));
    if (!(F > better_with_lenses) || !are_whole) return;
    states_ = with_lenses;
    plain = bent, lenses_found_ = true;
  }

  [[noreturn]] void fail(const std::string& found, const std::string& expected, const std::string& advice) const {
    throw InputError({{capture_.file}, found, expected, advice});
  }

  State given(std::size_t c) const {
    return {sensors_[c].depth->camera.camera_to_world, sensors_[c].depth->time_offset, Eigen::Vector2d::Zero()};
  }

  void look(double radius) {
    for (const DepthCamera& depth : capture_.depth) {
      const PixelSorter sorter(capture_, depth, {});
      const std::vector<int> frames = frames_of(capture_.frame_count(), depth.every);
      std::vector<std::optional<Sighting>> seen(frames.size());
      parallel_for(0, int(frames.size()), [&](int i) {
        const int frame = frames[std::size_t(i)];
        const DepthImage image = read_depth(capture_, depth, frame);
        const auto kinds = sorter.sort(image, read_object_mask(capture_, depth, frame));
        auto ball = find_ball(image, kinds, depth.camera, sorter.noise(), radius);
        if (!ball) return;
        Sighting s{capture_.scene.timing.times[std::size_t(frame)], std::move(*ball), Vector3::Zero(), {}};
        s.centre = s.sight.centre;
        constexpr double step = 1e-3;
        const double scale = 3.0 * s.sight.rms + 1e-4;
        for (int k = 0; k < 2; ++k) {
          Eigen::Vector2d change = Eigen::Vector2d::Zero();
          change[k] = step;
          PinholeCamera more = depth.camera, less = depth.camera;
          more.lens = changed_lens(depth.camera.lens, change), less.lens = changed_lens(depth.camera.lens, -change);
          s.by_lens.col(k) = (ball_centre(s.sight.pixels, more, radius, s.centre, scale) -
                              ball_centre(s.sight.pixels, less, radius, s.centre, scale)) /
                             (2.0 * step);
        }
        seen[std::size_t(i)] = std::move(s);
      });
      Sensor sensor{&depth, {}};
      for (auto& s : seen)
        if (s) sensor.seen.push_back(std::move(*s));
      if (int(sensor.seen.size()) < fewest_ball_frames)
        fail("camera \"" + depth.name + "\" shows the ball in " + std::to_string(sensor.seen.size()) + " frames",
             std::to_string(fewest_ball_frames) + " at least",
             "check the radius, which is half the diameter, in metres; masks or a background tell the ball's pixels");
      sensors_.push_back(std::move(sensor));
    }
  }

  void choose_reference() {
    if (options_.reference.empty()) {
      for (std::size_t c = 1; c < sensors_.size(); ++c)
        if (sensors_[c].seen.size() > sensors_[reference_].seen.size()) reference_ = c;
      return;
    }
    const auto at = std::ranges::find(capture_.depth, options_.reference, &DepthCamera::name);
    if (at == capture_.depth.end()) fail("no camera \"" + options_.reference + "\"", "one of the capture's", "");
    reference_ = std::size_t(at - capture_.depth.begin());
  }

  Vector3 centre(std::size_t c, std::size_t i, const State& state) const {
    const Sighting& s = sensors_[c].seen[i];
    return s.centre + s.by_lens * state.lens;
  }

  /// Where the reference saw the ball at a time of its own clock, in the world.
  std::optional<Path::Place> reference_at(double time, const State& reference) const {
    const Path path(sensors_[reference_].seen, interval_);
    const auto at = [&](std::size_t i) { return reference.pose(centre(reference_, i, reference)); };
    if (moves_) return path(time - reference.offset, at);
    const auto& seen = sensors_[reference_].seen;
    const auto same = std::ranges::find(seen, time, &Sighting::time);
    if (same == seen.end()) return std::nullopt;
    const std::size_t i = std::size_t(same - seen.begin());
    return Path::Place{at(i), Vector3::Zero(), {i, i, i, i}, {1.0, 0.0, 0.0, 0.0}};
  }

  double time_of(std::size_t c, std::size_t i, const State& state) const {
    return sensors_[c].seen[i].time + (moves_ ? state.offset : 0.0);
  }

  /// Of nine tenths of the distances.
  double rms(std::size_t c, const State& state, const State& reference) const {
    if (c == reference_) return 0.0;
    std::vector<double> squares;
    for (std::size_t i = 0; i < sensors_[c].seen.size(); ++i)
      if (const auto there = reference_at(time_of(c, i, state), reference))
        squares.push_back((state.pose(centre(c, i, state)) - there->position).squaredNorm());
    if (squares.empty()) return 0.0;
    std::ranges::sort(squares);
    const std::size_t most = std::max<std::size_t>(1, squares.size() * 9 / 10);
    double sum = 0.0;
    for (std::size_t i = 0; i < most; ++i) sum += squares[i] / double(most);
    return std::sqrt(sum);
  }

  State first_guess(std::size_t c) const {
    const State reference = given(reference_);
    State best = given(c);
    double least = infinite;
    constexpr int around = 12;  // quarter intervals to each side
    for (int k = moves_ ? -around : 0; k <= (moves_ ? around : 0); ++k) {
      State guess = given(c);
      guess.offset += 0.25 * k * interval_;
      std::vector<Vector3> from, to;
      for (std::size_t i = 0; i < sensors_[c].seen.size(); ++i)
        if (const auto there = reference_at(time_of(c, i, guess), reference))
          from.push_back(centre(c, i, guess)), to.push_back(there->position);
      if (int(from.size()) < fewest_ball_frames) continue;
      guess.pose = kabsch(from, to);
      if (const double r = rms(c, guess, reference); r < least) least = r, best = guess;
    }
    if (least == infinite)
      fail("cameras \"" + sensors_[c].depth->name + "\" and \"" + sensors_[reference_].depth->name +
               "\" see the ball in fewer than " + std::to_string(fewest_ball_frames) + " common frames",
           "a ball moved about where both see it", "choose another camera by --reference");
    return best;
  }

  // Unknowns: of each camera but the reference turn, shift and offset, 7; then k1 and k2 of every camera.
  std::size_t column_of(std::size_t c) const { return 7 * (c < reference_ ? c : c - 1); }
  std::size_t lens_column(std::size_t c) const { return 7 * (sensors_.size() - 1) + 2 * c; }

  void apply(const VectorX& d, bool lenses) {
    for (std::size_t c = 0; c < sensors_.size(); ++c) {
      State& s = states_[c];
      if (c != reference_) {
        const auto at = Eigen::Index(column_of(c));
        const Vector3 middle = middle_of(c);
        const Matrix3 R = rotation_by(d.segment<3>(at));
        s.pose = {R * s.pose.rotation, R * (s.pose.translation - middle) + middle + d.segment<3>(at + 3)};
        s.offset += d[at + 6];
      }
      if (lenses) s.lens += d.segment<2>(Eigen::Index(lens_column(c)));
    }
  }

  /// Middle of the centres that a camera saw, in the world: about which its pose is turned.
  Vector3 middle_of(std::size_t c) const {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = 0; i < sensors_[c].seen.size(); ++i)
      sum += states_[c].pose(centre(c, i, states_[c])) / double(sensors_[c].seen.size());
    return sum;
  }

  /// A centre of a camera against the reference's path.
  struct Residual {
    std::size_t camera, sighting;
    Path::Place there;
    Vector3 here, value, middle;
    double noise;
  };
  std::vector<Residual> compare() const {
    std::vector<Residual> all;
    for (std::size_t c = 0; c < sensors_.size(); ++c) {
      if (c == reference_) continue;
      const State& s = states_[c];
      const Vector3 middle = middle_of(c);
      for (std::size_t i = 0; i < sensors_[c].seen.size(); ++i) {
        const auto there = reference_at(time_of(c, i, s), states_[reference_]);
        if (!there) continue;
        const Vector3 here = s.pose(centre(c, i, s));
        const double own = sensors_[c].seen[i].sight.noise;
        all.push_back({c, i, *there, here, here - there->position, middle,
                       std::hypot(own, sensors_[reference_].seen[there->at[1]].sight.noise)});
      }
    }
    return all;
  }

  Eigen::Matrix<double, 3, Eigen::Dynamic> row_of(const Residual& r, Eigen::Index n, bool lenses) const {
    Eigen::Matrix<double, 3, Eigen::Dynamic> J = Eigen::Matrix<double, 3, Eigen::Dynamic>::Zero(3, n);
    const auto at = Eigen::Index(column_of(r.camera));
    J.middleCols<3>(at) = -cross_matrix(r.here - r.middle);
    J.middleCols<3>(at + 3).setIdentity();
    if (moves_) J.col(at + 6) = -r.there.velocity;
    if (!lenses) return J;
    const State& reference = states_[reference_];
    J.middleCols<2>(Eigen::Index(lens_column(r.camera))) =
        states_[r.camera].pose.rotation * sensors_[r.camera].seen[r.sighting].by_lens;
    for (std::size_t k = 0; k < 4; ++k)
      J.middleCols<2>(Eigen::Index(lens_column(reference_))) -=
          r.there.weight[k] * reference.pose.rotation * sensors_[reference_].seen[r.there.at[k]].by_lens;
    return J;
  }

  /// Tukey's loss of all residuals, whose noise is `scale` times what it says.
  double robust_cost(double scale) const {
    double sum = 0.0;
    for (const Residual& r : compare()) {
      const double s = std::min(1.0, r.value.norm() / r.noise / scale / tukey_scale);
      sum += scale * scale * tukey_scale * tukey_scale / 3.0 * (1.0 - std::pow(1.0 - s * s, 3));
    }
    return sum;
  }

  Solution solve(bool lenses) {
    constexpr int most_steps = 30;
    constexpr double offset_prior = 0.2;             // [s]
    const std::array lens_prior = {0.5, k2_prior_};  // of k1 and k2, which stand for each other where little is seen
    const auto n = Eigen::Index(7 * (sensors_.size() - 1) + (lenses ? 2 * sensors_.size() : 0));
    Solution solution;
    for (int step = 0; step < most_steps; ++step) {
      std::vector<Eigen::Matrix<double, 3, Eigen::Dynamic>> rows;
      const std::vector<Residual> residuals = compare();
      for (const Residual& r : residuals) rows.push_back(row_of(r, n, lenses));
      std::vector<double> sizes;
      for (const Residual& r : residuals) sizes.push_back(r.value.norm() / r.noise);
      solution.scale = std::max(1e-6, median(sizes) / 1.538);  // the median length of three normal deviates
      MatrixX A = MatrixX::Zero(n, n);
      VectorX b = VectorX::Zero(n);
      solution.cost = solution.rows = 0.0;
      for (std::size_t r = 0; r < rows.size(); ++r) {
        const double size = sizes[r] / solution.scale / tukey_scale;
        if (size >= 1.0) continue;
        const double w = std::pow(1.0 - size * size, 2) / std::pow(residuals[r].noise, 2);
        A += w * rows[r].transpose() * rows[r], b -= w * rows[r].transpose() * residuals[r].value;
        solution.cost += w * residuals[r].value.squaredNorm(), solution.rows += 3.0;
      }
      solution.unknowns = double(n);
      const double variance = std::max(1e-12, solution.cost / std::max(1.0, solution.rows - double(n)));
      for (std::size_t c = 0; c < sensors_.size(); ++c) {
        if (c != reference_) {
          const auto at = Eigen::Index(column_of(c)) + 6;
          A(at, at) += variance / (clock_is_known_[c] ? 1e-16 : offset_prior * offset_prior);
        }
        for (int k = 0; lenses && k < 2; ++k) {
          const auto at = Eigen::Index(lens_column(c)) + k;
          const double weight = variance / std::pow(lens_prior[std::size_t(k)], 2);
          A(at, at) += weight, b[at] -= weight * states_[c].lens[k];
        }
      }
      for (Eigen::Index i = 0; i < n; ++i) A(i, i) *= 1.0 + 1e-10;
      const Eigen::LDLT<MatrixX> factor(A);
      const VectorX d = factor.solve(b);
      solution.covariance = variance * factor.solve(MatrixX::Identity(n, n));
      if (!d.allFinite()) break;
      apply(d, lenses);
      if (d.norm() < 1e-9) break;
    }
    return solution;
  }

  /// Keeps the clocks that the ball's motion does not tell as the capture has them; true where there are any.
  bool settle_clocks(const Solution& solution) {
    bool any = false;
    for (std::size_t c = 0; c < sensors_.size(); ++c) {
      if (c == reference_ || clock_is_known_[c]) continue;
      const auto at = Eigen::Index(column_of(c)) + 6;
      if (std::sqrt(solution.covariance(at, at)) < 0.25 * interval_) continue;
      clock_is_known_[c] = true, any = true;
      states_[c].offset = sensors_[c].depth->time_offset;
    }
    return any;
  }

  bool lenses_are_whole() const {
    for (std::size_t c = 0; c < sensors_.size(); ++c)
      if (!sees_whole_picture(with_lens(c))) return false;
    return true;
  }
  PinholeCamera with_lens(std::size_t c) const {
    PinholeCamera camera = sensors_[c].depth->camera;
    if (states_[c].lens.norm() > 0.0) camera.lens = changed_lens(camera.lens, states_[c].lens);
    return camera;
  }

  std::vector<SensorCalibration> results(const Solution& solution) const {
    std::vector<SensorCalibration> all;
    for (std::size_t c = 0; c < sensors_.size(); ++c) {
      const DepthCamera& depth = *sensors_[c].depth;
      const State& s = states_[c];
      SensorCalibration r;
      r.name = depth.name, r.camera_to_world = s.pose, r.lens = with_lens(c).lens, r.time_offset = depth.time_offset;
      r.count = int(sensors_[c].seen.size()), r.is_reference = c == reference_, r.lens_is_found = lenses_found_;
      const RigidMotion correction = {s.pose.rotation * depth.camera.camera_to_world.rotation.transpose(), {}};
      r.turned = Eigen::AngleAxisd(correction.rotation).angle();
      r.moved = moved_by(c);
      r.rms_before = before_[c], r.rms_after = rms(c, s, states_[reference_]);
      if (lenses_found_) {
        const auto at = Eigen::Index(lens_column(c));
        r.k1_std = std::sqrt(solution.covariance(at, at));
      }
      if (c != reference_) check_told(c, solution, r);
      all.push_back(std::move(r));
    }
    return all;
  }

  double moved_by(std::size_t c) const {
    const Vector3 middle = middle_of(c);
    const RigidMotion& was = sensors_[c].depth->camera.camera_to_world;
    return (was(states_[c].pose.inverse()(middle)) - middle).norm();
  }

  void check_told(std::size_t c, const Solution& solution, SensorCalibration& r) const {
    const auto at = Eigen::Index(column_of(c));
    const auto worst = [&](Eigen::Index first) {
      return std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix3>(Matrix3(solution.covariance.block<3, 3>(first, first)))
                           .eigenvalues()[2]);
    };
    r.turn_std = worst(at), r.shift_std = worst(at + 3);
    if (!(r.turn_std < greatest_turn_std) || !std::isfinite(r.shift_std))
      fail("the ball's centres before camera \"" + r.name + "\" leave its pose open: they " + spread_text(c),
           "a ball that was moved about in all three directions, over half of what the cameras see", "");
    if (clock_is_known_[c]) return;
    r.time_offset = states_[c].offset, r.time_offset_std = std::sqrt(solution.covariance(at + 6, at + 6));
  }

  std::string spread_text(std::size_t c) const {
    Matrix3 moment = Matrix3::Zero();
    const Vector3 middle = middle_of(c);
    for (std::size_t i = 0; i < sensors_[c].seen.size(); ++i) {
      const Vector3 arm = states_[c].pose(centre(c, i, states_[c])) - middle;
      moment += arm * arm.transpose() / double(sensors_[c].seen.size());
    }
    const Vector3 spread = Eigen::SelfAdjointEigenSolver<Matrix3>(moment).eigenvalues().cwiseMax(0.0).cwiseSqrt();
    return "spread over " + text_of(1e3 * spread[2], "mm") + " along a line and " + text_of(1e3 * spread[1], "mm") +
           " off it (rms)";
  }

  const Capture& capture_;
  CalibrationOptions options_;
  bool moves_;
  double interval_ = 1.0;  // [s] between frames, the mean
  std::vector<Sensor> sensors_;
  std::size_t reference_ = 0;
  std::vector<State> states_;
  std::vector<double> before_;
  std::vector<char> clock_is_known_;
  double k2_prior_ = 0.1;
  bool lenses_found_ = false;
};

}  // namespace

std::vector<SensorCalibration> calibrate_by_ball(const Capture& capture, double radius,
                                                 const CalibrationOptions& options) {
  require_standing_cameras(capture, "calibration");
  return BallCalibration(capture, radius, options).run();
}

}  // namespace pliant
